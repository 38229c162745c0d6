//! How far the principal axes of elements have turned since they were evaluated.
//!
//! `F = U S V^T` with rotations `U`, `V` and singular values in descending order, the last with the sign of `det F`. `V`
//! holds the eigenvectors of `E = F^T F - I`, which a fixed number of Jacobi sweeps finds from those at the last evaluation;
//! the columns of `U` are those of `F V`, orthonormalised. Rotations that are compared with a threshold need few digits: all
//! is in single precision, from `F - I`, so that small strains keep theirs.
//!
//! Sources: Golub & Van Loan, *Matrix Computations*, 4th ed. (2013), section 8.5 (Jacobi's method); Irving, Teran & Fedkiw
//! (2004), *Invertible finite elements for robust simulation of large deformation*, section 4 (signs and order).

use crate::lanes::{LANES, Lane, Pack, PackMatrix, times, transpose_times};

/// Groups that are compared at a time: their lanes fill a register with single precision.
pub(super) const GROUPS: usize = 2;

const WIDTH: usize = GROUPS * LANES;

/// Numbers of single precision for the lanes of [`GROUPS`] groups.
type Wide = Pack<WIDTH, f32>;
type WideMatrix<const D: usize> = PackMatrix<D, WIDTH, f32>;

/// Sweeps from axes near by, whose changes are only compared with a threshold, and from any. Jacobi's method converges
/// quadratically.
const SWEEPS_FROM_NEAR: usize = 2;
const SWEEPS_FROM_AFAR: usize = 6;

/// Squares below this are zero.
const NEGLIGIBLE: f32 = 1e-36;

/// The rotations `U`, `V` of the elements of a group where they were evaluated: a function of `F` there alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn<const D: usize> {
    u: [[[f32; LANES]; D]; D],
    v: [[[f32; LANES]; D]; D],
}

impl<const D: usize> Turn<D> {
    /// Those of elements at rest.
    pub fn at_rest() -> Self {
        let mut identity = [[[0.0; LANES]; D]; D];
        for i in 0..D {
            identity[i][i] = [1.0; LANES];
        }
        Self { u: identity, v: identity }
    }

    /// Those of evaluations at `f`. In one dimension nothing turns.
    #[inline(always)]
    pub fn of(f: &[[[Lane; D]; D]; GROUPS]) -> [Self; GROUPS] {
        let mut turns = [Self::at_rest(); GROUPS];
        if D == 1 {
            return turns;
        }
        let (_, v0) = side_by_side(&turns);
        let (u, v) = axes(&strains(f), &v0, SWEEPS_FROM_AFAR);
        for i in 0..D {
            for k in 0..D {
                for lane in 0..WIDTH {
                    let turn = &mut turns[lane / LANES];
                    turn.u[i][k][lane % LANES] = u[i][k].0[lane];
                    turn.v[i][k][lane % LANES] = v[i][k].0[lane];
                }
            }
        }
        turns
    }

    /// Takes over a lane of another group.
    #[inline(always)]
    pub fn copy_lane(&mut self, lane: usize, from: &Self, from_lane: usize) {
        for i in 0..D {
            for k in 0..D {
                self.u[i][k][lane] = from.u[i][k][from_lane];
                self.v[i][k][lane] = from.v[i][k][from_lane];
            }
        }
    }

    /// `max|dU| max|dV|` of each lane on the way to `f`; NaN where there is no telling.
    #[inline(always)]
    pub fn products(turns: &[Self; GROUPS], f: &[[[Lane; D]; D]; GROUPS]) -> [[f32; LANES]; GROUPS] {
        let mut products = [[0.0; LANES]; GROUPS];
        if D == 1 {
            return products;
        }
        let (u0, v0) = side_by_side(turns);
        let (u, v) = axes(&strains(f), &v0, SWEEPS_FROM_NEAR);
        let product = largest_change(&u, &u0) * largest_change(&v, &v0);
        for lane in 0..WIDTH {
            products[lane / LANES][lane % LANES] = product.0[lane];
        }
        products
    }
}

/// `F - I`, the groups side by side.
#[inline(always)]
fn strains<const D: usize>(f: &[[[Lane; D]; D]; GROUPS]) -> WideMatrix<D> {
    let mut h = [[Wide::ZERO; D]; D];
    for i in 0..D {
        for k in 0..D {
            for lane in 0..WIDTH {
                let rest = if i == k { 1.0 } else { 0.0 };
                h[i][k].0[lane] = (f[lane / LANES][i][k][lane % LANES] - rest) as f32;
            }
        }
    }
    h
}

/// The rotations `U` and `V` of the groups side by side.
#[inline(always)]
fn side_by_side<const D: usize>(turns: &[Turn<D>; GROUPS]) -> (WideMatrix<D>, WideMatrix<D>) {
    let (mut u, mut v) = ([[Wide::ZERO; D]; D], [[Wide::ZERO; D]; D]);
    for i in 0..D {
        for k in 0..D {
            for lane in 0..WIDTH {
                u[i][k].0[lane] = turns[lane / LANES].u[i][k][lane % LANES];
                v[i][k].0[lane] = turns[lane / LANES].v[i][k][lane % LANES];
            }
        }
    }
    (u, v)
}

/// `U` and `V` of `F = I + h`, found from a `V` near by.
#[inline(always)]
fn axes<const D: usize>(h: &WideMatrix<D>, v0: &WideMatrix<D>, sweeps: usize) -> (WideMatrix<D>, WideMatrix<D>) {
    // E = h + h^T + h^T h in the frame of v0.
    let mut e = transpose_times(h, h);
    for i in 0..D {
        for k in 0..D {
            e[i][k] += h[i][k] + h[k][i];
        }
    }
    let mut e = transpose_times(v0, &times(&e, v0));
    let mut v = *v0;
    for _ in 0..sweeps {
        for p in 0..D {
            for q in p + 1..D {
                annihilate(&mut e, &mut v, p, q);
            }
        }
    }
    sort(&mut e, &mut v);
    // The columns of F V.
    let mut u = times(h, &v);
    for i in 0..D {
        for k in 0..D {
            u[i][k] += v[i][k];
        }
    }
    orthonormalise(&mut u);
    (u, v)
}

/// Turns axes `p` and `q` until `e[p][q]` vanishes, by 45 degrees at most.
#[inline(always)]
fn annihilate<const D: usize>(e: &mut WideMatrix<D>, v: &mut WideMatrix<D>, p: usize, q: usize) {
    // tan(2 angle) = x / d.
    let (d, x) = (e[q][q] - e[p][p], e[p][q] + e[p][q]);
    let square = x * x;
    let long = d.abs() + (d * d + square).sqrt();
    let reciprocal = Wide::ONE / (long * long + square).sqrt();
    let signed = d.where_less(Wide::ZERO, -x, x);
    let negligible = Wide::splat(NEGLIGIBLE);
    let c = square.where_less(negligible, Wide::ONE, long * reciprocal);
    let s = square.where_less(negligible, Wide::ZERO, signed * reciprocal);
    let (cc, ss, cross) = (c * c, s * s, c * s * x);
    let (pp, qq) = (e[p][p], e[q][q]);
    e[p][p] = cc * pp - cross + ss * qq;
    e[q][q] = ss * pp + cross + cc * qq;
    e[p][q] = Wide::ZERO;
    for r in 0..D {
        if r != p && r != q {
            // The upper triangle holds the matrix.
            let (pr, qr) = ((p.min(r), p.max(r)), (q.min(r), q.max(r)));
            let (a, b) = (e[pr.0][pr.1], e[qr.0][qr.1]);
            e[pr.0][pr.1] = c * a - s * b;
            e[qr.0][qr.1] = s * a + c * b;
        }
    }
    for row in v {
        let (a, b) = (row[p], row[q]);
        row[p] = c * a - s * b;
        row[q] = s * a + c * b;
    }
}

/// Largest stretch first. A swap turns one of the two axes round, so that `v` stays a rotation.
#[inline(always)]
fn sort<const D: usize>(e: &mut WideMatrix<D>, v: &mut WideMatrix<D>) {
    for p in 0..D {
        for q in p + 1..D {
            let (short, long) = (e[p][p], e[q][q]);
            e[p][p] = short.where_less(long, long, short);
            e[q][q] = short.where_less(long, short, long);
            for row in &mut *v {
                let (a, b) = (row[p], row[q]);
                row[p] = short.where_less(long, b, a);
                row[q] = short.where_less(long, -a, b);
            }
        }
    }
}

/// Makes a rotation of orthogonal columns, whose last one may vanish; NaN where two do.
#[inline(always)]
fn orthonormalise<const D: usize>(u: &mut WideMatrix<D>) {
    normalise(u, 0);
    if D == 2 {
        (u[0][1], u[1][1]) = (-u[1][0], u[0][0]);
        return;
    }
    let mut along = Wide::ZERO;
    for row in &*u {
        along += row[0] * row[1];
    }
    for row in &mut *u {
        row[1] -= along * row[0];
    }
    normalise(u, 1);
    for i in 0..D {
        let (i1, i2) = ((i + 1) % D, (i + 2) % D);
        u[i][2] = u[i1][0] * u[i2][1] - u[i2][0] * u[i1][1];
    }
}

#[inline(always)]
fn normalise<const D: usize>(u: &mut WideMatrix<D>, column: usize) {
    let mut square = Wide::ZERO;
    for row in &*u {
        square += row[column] * row[column];
    }
    let reciprocal = Wide::ONE / square.sqrt();
    for row in u {
        row[column] = row[column] * reciprocal;
    }
}

/// The largest `|a - b|`; NaN if there is one.
#[inline(always)]
fn largest_change<const D: usize>(a: &WideMatrix<D>, b: &WideMatrix<D>) -> Wide {
    let mut largest = Wide::ZERO;
    for i in 0..D {
        for k in 0..D {
            // In this order a NaN replaces what was found, and stays: `max` takes the other where the first is NaN.
            let change = (a[i][k] - b[i][k]).abs();
            largest = largest.where_less(change, change, largest + change * 0.0);
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small::determinant;
    use crate::svd::signed_svd;
    use nalgebra::{Matrix2, Matrix3, Rotation3, SMatrix, Vector3};
    use proptest::prelude::*;

    fn lanes<const D: usize>(f: &SMatrix<f64, D, D>) -> [[Lane; D]; D] {
        std::array::from_fn(|i| std::array::from_fn(|k| [f[(i, k)]; LANES]))
    }

    fn lane<const D: usize>(m: &[[[f32; LANES]; D]; D]) -> SMatrix<f64, D, D> {
        SMatrix::from_fn(|i, k| f64::from(m[i][k][1]))
    }

    fn product<const D: usize>(from: &SMatrix<f64, D, D>, to: &SMatrix<f64, D, D>) -> f32 {
        let ([turn, ..], to) = (Turn::of(&[lanes(from); GROUPS]), lanes(to));
        Turn::products(&[turn; GROUPS], &[to; GROUPS])[1][2]
    }

    /// The rotations with their signs changed alike, column by column, to be near others.
    fn near<const D: usize>(m: &SMatrix<f64, D, D>, to: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        SMatrix::from_fn(|i, k| if m.column(k).dot(&to.column(k)) < 0.0 { -m[(i, k)] } else { m[(i, k)] })
    }

    fn agrees_with_the_decomposition<const D: usize>(f: &SMatrix<f64, D, D>) -> Result<(), TestCaseError> {
        let ([turn, ..], svd) = (Turn::of(&[lanes(f); GROUPS]), signed_svd(f));
        let (u, v) = (lane(&turn.u), lane(&turn.v));
        prop_assert!((determinant(&u) - 1.0).abs() < 1e-4 && (determinant(&v) - 1.0).abs() < 1e-4);
        prop_assert!((near(&svd.u, &u) - u).amax() < 1e-3, "U {} of {f}, exact {}", u, svd.u);
        prop_assert!((near(&svd.v, &v) - v).amax() < 1e-3, "V {} of {f}, exact {}", v, svd.v);
        Ok(())
    }

    proptest! {
        #[test]
        fn axes_are_those_of_the_decomposition(x in proptest::array::uniform9(-1.0f64..1.0)) {
            let f = Matrix3::identity() + Matrix3::from_row_slice(&x);
            let s = signed_svd(&f).sigma;
            prop_assume!(s[0] - s[1] > 0.05 && s[1] - s[2].abs() > 0.05 && s[2].abs() > 0.05);
            agrees_with_the_decomposition(&f)?;
            let plane = Matrix2::new(1.0 + x[0], x[1], x[2], 1.0 + x[3]);
            let s = signed_svd(&plane).sigma;
            prop_assume!(s[0] - s[1].abs() > 0.05 && s[1].abs() > 0.05);
            agrees_with_the_decomposition(&plane)?;
        }

        /// Small strains keep their axes in single precision, on top of any rotation that is not large.
        #[test]
        fn a_turn_as_a_whole_is_none(x in proptest::array::uniform9(-1.0f64..1.0), size in -5.0f64..-0.5) {
            let strain = Matrix3::from_row_slice(&x) * 10.0f64.powf(size);
            let f = Matrix3::identity() + strain;
            let s = signed_svd(&f).sigma;
            prop_assume!(s[0] - s[1] > 0.1 * (s[0] - 1.0).abs() && s[1] - s[2].abs() > 0.1 * (s[0] - 1.0).abs());
            let r = Rotation3::new(Vector3::new(0.2, -0.1, 0.15) * x[0]).into_inner();
            prop_assert!(product(&f, &(r * f)) < 0.02);
        }
    }

    #[test]
    fn nothing_turns_where_nothing_moves_and_much_where_stretches_trade_places() {
        let rest = Matrix3::identity();
        assert_eq!(product(&rest, &rest), 0.0);
        let long = Matrix3::from_diagonal(&Vector3::new(1.3, 1.1, 1.0));
        let other = Matrix3::from_diagonal(&Vector3::new(1.1, 1.3, 1.0));
        assert!(product(&long, &(long * 1.2)) < 1e-6);
        // A quarter turn of both: an entry changes by one.
        assert!((product(&long, &other) - 1.0).abs() < 1e-5);
        assert!(product(&long, &(rest * f64::NAN)).is_nan());
        assert!(product(&long, &Matrix3::zeros()).is_nan(), "a point has no axes");
    }
}
