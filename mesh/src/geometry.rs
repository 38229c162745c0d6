//! Small dense geometry of one simplex: measures, barycentric coordinates and their gradients.
//!
//! A simplex is its corners, `[[f64; D]; N]`. For `N = D + 1` it fills space and has a sign; for `N < D + 1` (a triangle
//! of a surface, a segment of a rod) all that is said here holds within its affine hull.

/// `p - q`.
#[inline]
pub fn subtract<const D: usize>(p: &[f64; D], q: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| p[k] - q[k])
}

/// The dot product of two vectors.
#[inline]
pub fn dot<const D: usize>(p: &[f64; D], q: &[f64; D]) -> f64 {
    (0..D).map(|k| p[k] * q[k]).sum()
}

/// The squared distance of two points: the same bits whichever of the two comes first.
#[inline]
pub fn distance2<const D: usize>(p: &[f64; D], q: &[f64; D]) -> f64 {
    let d = subtract(p, q);
    dot(&d, &d)
}

/// The length of a vector.
#[inline]
pub fn norm<const D: usize>(v: &[f64; D]) -> f64 {
    dot(v, v).sqrt()
}

/// The cross product of two vectors of space.
#[inline]
pub fn cross(p: &[f64; 3], q: &[f64; 3]) -> [f64; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

/// The longest edge of a simplex, squared.
#[inline]
pub fn longest_edge2<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> f64 {
    let mut longest = 0.0_f64;
    for i in 1..N {
        for j in 0..i {
            longest = longest.max(distance2(&corners[i], &corners[j]));
        }
    }
    longest
}

/// The edge vectors from corner 0; row `i` is `corners[i + 1] - corners[0]`, rows from `N - 1` on are zero.
#[inline]
fn edges<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> [[f64; D]; D] {
    std::array::from_fn(|i| if i + 1 < N { subtract(&corners[i + 1], &corners[0]) } else { [0.0; D] })
}

/// The determinant of a matrix given by rows: cofactors up to three rows, Gaussian elimination beyond.
#[inline]
fn determinant<const D: usize>(m: &[[f64; D]; D]) -> f64 {
    match D {
        1 => m[0][0],
        2 => m[0][0] * m[1][1] - m[0][1] * m[1][0],
        3 => {
            m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
                + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
        }
        _ => eliminate(*m),
    }
}

/// The determinant by Gaussian elimination with partial pivoting.
fn eliminate<const D: usize>(mut m: [[f64; D]; D]) -> f64 {
    let mut determinant = 1.0;
    for column in 0..D {
        let pivot = pivot_row(&m, column, D);
        if m[pivot][column] == 0.0 {
            return 0.0;
        }
        if pivot != column {
            m.swap(pivot, column);
            determinant = -determinant;
        }
        determinant *= m[column][column];
        for row in column + 1..D {
            let factor = m[row][column] / m[column][column];
            for k in column..D {
                m[row][k] -= factor * m[column][k];
            }
        }
    }
    determinant
}

/// The row from `column` on, of the first `n`, with the entry of largest magnitude in `column`.
fn pivot_row<const D: usize>(m: &[[f64; D]; D], column: usize, n: usize) -> usize {
    let mut pivot = column;
    for row in column + 1..n {
        if m[row][column].abs() > m[pivot][column].abs() {
            pivot = row;
        }
    }
    pivot
}

/// The inverse of the leading `n` rows and columns by Gauss-Jordan elimination; `None` if a pivot vanishes.
fn inverse<const D: usize>(mut m: [[f64; D]; D], n: usize) -> Option<[[f64; D]; D]> {
    let mut inverse: [[f64; D]; D] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    for column in 0..n {
        let pivot = pivot_row(&m, column, n);
        let value = m[pivot][column];
        // NaN and infinity fail this test too.
        if !(value.abs() > 0.0 && value.is_finite()) {
            return None;
        }
        m.swap(pivot, column);
        inverse.swap(pivot, column);
        for k in 0..n {
            m[column][k] /= value;
            inverse[column][k] /= value;
        }
        for row in 0..n {
            let factor = m[row][column];
            if row == column || factor == 0.0 {
                continue;
            }
            for k in 0..n {
                m[row][k] -= factor * m[column][k];
                inverse[row][k] -= factor * inverse[column][k];
            }
        }
    }
    Some(inverse)
}

/// `(N - 1)!`, the number of simplices that fill the parallelepiped of a simplex.
#[inline]
pub fn factorial(n: usize) -> f64 {
    (2..=n).map(|k| k as f64).product()
}

/// The signed volume for `N = D + 1`, positive when the edge vectors from corner 0 are right-handed; the length, area,
/// ... of a simplex with fewer corners, never negative.
#[inline]
pub fn signed_measure<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> f64 {
    parallelepiped(edges(corners), N) / factorial(N - 1)
}

/// The measure spanned by `n - 1` edge vectors, signed if they fill space; otherwise by Gram-Schmidt, which unlike
/// the root of a Gram determinant keeps full accuracy on thin simplices.
#[inline]
fn parallelepiped<const D: usize>(mut edges: [[f64; D]; D], n: usize) -> f64 {
    if n == D + 1 {
        return determinant(&edges);
    }
    let mut measure = 1.0;
    for i in 0..n - 1 {
        let norm = dot(&edges[i], &edges[i]).sqrt();
        measure *= norm;
        if norm == 0.0 {
            return 0.0;
        }
        let unit = edges[i].map(|x| x / norm);
        for j in i + 1..n - 1 {
            let along = dot(&edges[j], &unit);
            for k in 0..D {
                edges[j][k] -= along * unit[k];
            }
        }
    }
    measure
}

/// The determinant of the edge vectors after division by the longest edge: free of scale, zero for a flat simplex,
/// with the sign of [`signed_measure`].
pub fn relative_measure<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> f64 {
    let longest = longest_edge2(corners).sqrt();
    if longest == 0.0 {
        return 0.0;
    }
    parallelepiped(edges(corners).map(|edge| edge.map(|x| x / longest)), N)
}

/// The measure of the facet opposite corner `opposite`.
pub fn facet_measure<const D: usize, const N: usize>(corners: &[[f64; D]; N], opposite: usize) -> f64 {
    let base = usize::from(opposite == 0);
    let mut rows = [[0.0; D]; D];
    let others = (0..N).filter(|&i| i != base && i != opposite);
    for (row, i) in others.enumerate() {
        rows[row] = subtract(&corners[i], &corners[base]);
    }
    parallelepiped(rows, N - 1) / factorial(N - 2)
}

/// The gradients of the `N` barycentric coordinates, 1/length; `None` for a flat simplex.
///
/// They sum to zero; `1 / |g_i|` is the height over facet `i`.
pub fn gradients<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> Option<[[f64; D]; N]> {
    let e = edges(corners);
    let n = N - 1;
    let mut g = [[0.0; D]; N];
    if n == D {
        let inverse = inverse(e, n)?;
        for i in 0..n {
            g[i + 1] = std::array::from_fn(|k| inverse[k][i]);
        }
    } else {
        let inverse = inverse(gram(&e), n)?;
        for i in 0..n {
            g[i + 1] = std::array::from_fn(|k| (0..n).map(|j| inverse[i][j] * e[j][k]).sum());
        }
    }
    g[0] = std::array::from_fn(|k| -(1..N).map(|i| g[i][k]).sum::<f64>());
    Some(g)
}

/// The Gram matrix of the rows.
fn gram<const D: usize>(rows: &[[f64; D]; D]) -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|j| dot(&rows[i], &rows[j])))
}

/// The barycentric coordinates of (the orthogonal projection of) `p`; `None` for a flat simplex.
pub fn barycentric<const D: usize, const N: usize>(corners: &[[f64; D]; N], p: &[f64; D]) -> Option<[f64; N]> {
    let g = gradients(corners)?;
    let d = subtract(p, &corners[0]);
    let mut lambda: [f64; N] = std::array::from_fn(|i| if i == 0 { 0.0 } else { dot(&g[i], &d) });
    lambda[0] = 1.0 - lambda[1..].iter().sum::<f64>();
    Some(lambda)
}

/// The point with the given barycentric coordinates.
#[inline]
pub fn combine<const D: usize, const N: usize>(corners: &[[f64; D]; N], lambda: &[f64; N]) -> [f64; D] {
    std::array::from_fn(|k| (0..N).map(|i| lambda[i] * corners[i][k]).sum())
}

/// The measure of the regular simplex of dimension `d` with unit edges: `sqrt(d + 1) / (d! sqrt(2^d))`.
pub fn regular_measure(d: usize) -> f64 {
    (d as f64 + 1.0).sqrt() / (factorial(d) * 2_f64.powi(d as i32).sqrt())
}

/// The circumradius; `None` for a flat simplex.
pub fn circumradius<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> Option<f64> {
    // The centre c, seen from corner 0, has c . e_i = |e_i|^2 / 2, and g_i is the basis dual to e_i.
    let (g, e) = (gradients(corners)?, edges(corners));
    let centre: [f64; D] = std::array::from_fn(|k| (0..N - 1).map(|i| 0.5 * dot(&e[i], &e[i]) * g[i + 1][k]).sum());
    Some(dot(&centre, &centre).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TET: [[f64; 3]; 4] = [[0.1, 0.2, -0.3], [1.3, 0.1, 0.2], [0.2, 1.7, 0.4], [-0.2, 0.3, 2.1]];

    #[test]
    fn gradients_are_dual_to_the_edges() {
        let g = gradients(&TET).unwrap();
        for i in 0..4 {
            for j in 1..4 {
                let expected = f64::from(u8::from(i == j)) - f64::from(u8::from(i == 0));
                assert!((dot(&g[i], &subtract(&TET[j], &TET[0])) - expected).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn measures_agree_across_dimensions() {
        // The same triangle in the plane and tilted in space.
        let flat = [[0.0, 0.0], [3.0, 0.0], [1.0, 2.0]];
        let lifted = flat.map(|[x, y]| [x, 0.6 * y, 0.8 * y]);
        assert!((signed_measure(&flat) - 3.0).abs() < 1e-15);
        assert!((signed_measure(&lifted) - 3.0).abs() < 1e-14);
        assert!((circumradius(&flat).unwrap() - circumradius(&lifted).unwrap()).abs() < 1e-14);
    }

    #[test]
    fn elimination_agrees_with_cofactors() {
        let m = [[0.0, 2.0, 1.0], [3.0, -1.0, 0.5], [2.0, 7.0, 1.5]];
        assert!((determinant(&m) - eliminate(m)).abs() < 1e-13);
    }

    #[test]
    fn facets_of_a_tetrahedron_close() {
        // |facet_i| = 3 V |g_i|, from V = |facet| height / 3.
        let (g, volume) = (gradients(&TET).unwrap(), signed_measure(&TET).abs());
        for i in 0..4 {
            let expected = 3.0 * volume * dot(&g[i], &g[i]).sqrt();
            assert!((facet_measure(&TET, i) - expected).abs() < 1e-13 * expected);
        }
    }

    #[test]
    fn barycentric_coordinates_reproduce_a_point() {
        let p = [0.3, 0.4, 0.5];
        let q = combine(&TET, &barycentric(&TET, &p).unwrap());
        assert!(distance2(&p, &q).sqrt() < 1e-15);
    }

    #[test]
    fn a_flat_simplex_has_no_gradients() {
        assert!(gradients(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]).is_none());
        assert_eq!(relative_measure(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), 0.0);
    }
}
