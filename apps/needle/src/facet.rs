//! Simplices and straight ways: where a way meets a facet (an edge of a triangle, a face of a tetrahedron), and how far a
//! cell is from a segment.

use crate::needle::{along, cross, cross3, dot, minus};

/// Barycentric coordinates of `p`; not finite if the simplex is flat.
#[inline]
pub fn barycentric<const D: usize, const N: usize>(corners: [[f64; D]; N], p: [f64; D]) -> [f64; N] {
    let from = corners.map(|corner| minus(corner, p));
    let mut parts = [0.0; N];
    if D == 2 {
        let (a, b, c) = (from[0], from[1], from[2]);
        (parts[0], parts[1], parts[2]) = (cross(b, c), cross(c, a), cross(a, b));
    } else {
        let (a, b, c, d) = (from[0], from[1], from[2], from[3]);
        (parts[0], parts[1]) = (volume(b, c, d), volume(a, d, c));
        (parts[2], parts[3]) = (volume(a, b, d), volume(a, c, b));
    }
    let sum = (1..N).fold(parts[0], |sum, k| sum + parts[k]);
    parts.map(|part| part / sum)
}

/// Six times the signed volume of the tetrahedron of three vectors of space.
#[inline]
fn volume<const D: usize>(a: [f64; D], b: [f64; D], c: [f64; D]) -> f64 {
    let n = cross3(b, c);
    a[0] * n[0] + a[1] * n[1] + a[2] * n[2]
}

/// Where a way meets a facet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Crossing<const N: usize> {
    /// The part of the way up to there.
    pub on_way: f64,
    /// Barycentric coordinates in the cell; that of the corner opposite the facet is zero.
    pub weights: [f64; N],
    /// Local index of the corner of the facet that is closest.
    pub nearest: usize,
}

/// Where the line from `from` along `way` meets the facet opposite corner `facet`, on its way into the cell. `None` if it
/// runs along the facet, or out of the cell, or more than `slack` (in barycentric coordinates) beside the facet.
pub(crate) fn crossing_inwards<const D: usize, const N: usize>(
    corners: &[[f64; D]; N],
    facet: usize,
    from: [f64; D],
    way: [f64; D],
    slack: f64,
) -> Option<Crossing<N>> {
    let mut weights = [0.0; N];
    if D == 2 {
        let (i, j) = ((facet + 1) % 3, (facet + 2) % 3);
        let edge = minus(corners[j], corners[i]);
        let across = cross(way, edge);
        // The way must lead to the side of the edge where the triangle is.
        let inner = cross(edge, minus(corners[facet], corners[i]));
        if across == 0.0 || (across < 0.0) == (inner < 0.0) {
            return None;
        }
        let on_edge = cross(way, minus(from, corners[i])) / across;
        if !(-slack..=1.0 + slack).contains(&on_edge) {
            return None;
        }
        (weights[i], weights[j]) = (1.0 - on_edge, on_edge);
        let on_way = cross(edge, minus(from, corners[i])) / across;
        return Some(Crossing { on_way, weights, nearest: if on_edge <= 0.5 { i } else { j } });
    }
    let [i, j, k] = [1, 2, 3].map(|step| (facet + step) % 4);
    let edges = [minus(corners[j], corners[i]), minus(corners[k], corners[i])];
    let across = volume(way, edges[0], edges[1]);
    let inner = volume(minus(corners[facet], corners[i]), edges[0], edges[1]);
    if across == 0.0 || (across < 0.0) != (inner < 0.0) {
        return None;
    }
    let on_way = -volume(minus(from, corners[i]), edges[0], edges[1]) / across;
    // Components of the way to the crossing in the edges, by Cramer's rule with the way as third vector.
    let start = minus(from, corners[i]);
    let on_j = volume(start, edges[1], way) / volume(edges[0], edges[1], way);
    let on_k = volume(edges[0], start, way) / volume(edges[0], edges[1], way);
    (weights[i], weights[j], weights[k]) = (1.0 - on_j - on_k, on_j, on_k);
    if ![i, j, k].iter().all(|&v| weights[v] >= -slack) {
        return None;
    }
    Some(Crossing { on_way, weights, nearest: nearest_corner(corners, facet, along(from, on_way, way)) })
}

/// The local index of the corner of a facet that is closest to where the way from `from` to `to` meets it; where it runs
/// along the facet, to `to`.
pub(crate) fn nearest_to_way<const D: usize, const N: usize>(
    corners: &[[f64; D]; N],
    facet: usize,
    from: [f64; D],
    to: [f64; D],
) -> usize {
    let way = minus(to, from);
    if D == 2 {
        let (i, j) = ((facet + 1) % 3, (facet + 2) % 3);
        return if nearer_first(corners[i], corners[j], from, to) { i } else { j };
    }
    let [i, j, k] = [1, 2, 3].map(|step| (facet + step) % 4);
    let normal = cross3(minus(corners[j], corners[i]), minus(corners[k], corners[i]));
    let component = |v: [f64; D]| (1..D).fold(v[0] * normal[0], |sum, k| sum + v[k] * normal[k]);
    let size = (normal.iter().map(|n| n * n).sum::<f64>() * dot(way, way)).sqrt();
    let across = component(way);
    let meets =
        if across.abs() > 1e-12 * size { along(from, -component(minus(from, corners[i])) / across, way) } else { to };
    nearest_corner(corners, facet, meets)
}

/// Of the corners of a facet the closest one to `p`, the first of several.
fn nearest_corner<const D: usize, const N: usize>(corners: &[[f64; D]; N], facet: usize, p: [f64; D]) -> usize {
    let distance2 = |corner: usize| {
        let way = minus(corners[corner], p);
        dot(way, way)
    };
    let others = (0..N).filter(|&corner| corner != facet);
    others.min_by(|&a, &b| distance2(a).total_cmp(&distance2(b))).unwrap_or(0)
}

/// Whether the way from `from` to `to` crosses the edge `a b` nearer to `a`.
fn nearer_first<const D: usize>(a: [f64; D], b: [f64; D], from: [f64; D], to: [f64; D]) -> bool {
    let (way, edge) = (minus(to, from), minus(b, a));
    let across = cross(way, edge);
    let size = dot(way, way).sqrt() * dot(edge, edge).sqrt();
    let on_edge = if across.abs() > 1e-12 * size {
        cross(way, minus(from, a)) / across
    } else {
        dot(minus(to, a), edge) / dot(edge, edge)
    };
    on_edge <= 0.5
}

/// The distance between a cell and the segment from `a` to `b`; zero where they meet. A flat cell is as far away as its
/// edges.
///
/// Two convex bodies that do not meet are closest at a corner of one and a facet of the other, or at two edges: here at an
/// end of the segment and a point of the cell, or at the segment and an edge of the cell.
pub(crate) fn distance_to_segment<const D: usize, const N: usize>(
    corners: &[[f64; D]; N],
    a: [f64; D],
    b: [f64; D],
) -> f64 {
    if meets_segment(corners, a, b) {
        return 0.0;
    }
    let mut least = f64::INFINITY;
    for i in 0..N {
        for j in 0..i {
            least = least.min(edge_to_segment2(corners[i], corners[j], a, b));
        }
    }
    if D > 2 {
        for facet in 0..N {
            let [i, j, k] = [1, 2, 3].map(|step| corners[(facet + step) % N]);
            for end in [a, b] {
                least = least.min(above_face2(i, j, k, end));
            }
        }
    }
    least.sqrt()
}

/// Whether the segment from `a` to `b` meets the cell: the part of it where no barycentric coordinate is negative.
fn meets_segment<const D: usize, const N: usize>(corners: &[[f64; D]; N], a: [f64; D], b: [f64; D]) -> bool {
    let (at_a, at_b) = (barycentric(*corners, a), barycentric(*corners, b));
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (&start, &end) in at_a.iter().zip(&at_b) {
        match (start >= 0.0, end >= 0.0) {
            (true, true) => {}
            (true, false) => to = to.min(start / (start - end)),
            (false, true) => from = from.max(start / (start - end)),
            // Also for coordinates of a flat cell, which are not numbers.
            (false, false) => return false,
        }
    }
    from <= to
}

/// The square of the distance of two segments.
///
/// Source: Ericson, *Real-Time Collision Detection* (2005), section 5.1.9.
fn edge_to_segment2<const D: usize>(p: [f64; D], q: [f64; D], a: [f64; D], b: [f64; D]) -> f64 {
    let (d1, d2, r) = (minus(q, p), minus(b, a), minus(p, a));
    let (e, f, c) = (dot(d1, d1), dot(d2, d2), dot(d1, r));
    let (g, h) = (dot(d1, d2), dot(d2, r));
    let ratio = |over: f64, under: f64| if under > 0.0 { (over / under).clamp(0.0, 1.0) } else { 0.0 };
    let mut s = ratio(g * h - c * f, e * f - g * g);
    let mut t = ratio(g * s + h, f);
    s = ratio(g * t - c, e);
    t = ratio(g * s + h, f);
    let way = minus(along(p, s, d1), along(a, t, d2));
    dot(way, way)
}

/// The square of the distance of `p` from the plane of a face, if it is above or below the face; infinite otherwise.
fn above_face2<const D: usize>(i: [f64; D], j: [f64; D], k: [f64; D], p: [f64; D]) -> f64 {
    let (e, f, r) = (minus(j, i), minus(k, i), minus(p, i));
    let (ee, ef, ff, re, rf) = (dot(e, e), dot(e, f), dot(f, f), dot(r, e), dot(r, f));
    let area2 = ee * ff - ef * ef;
    let (s, t) = ((re * ff - rf * ef) / area2, (rf * ee - re * ef) / area2);
    if !(s >= 0.0 && t >= 0.0 && s + t <= 1.0) {
        return f64::INFINITY;
    }
    let way = minus(r, along(e.map(|x| s * x), t, f));
    dot(way, way)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn barycentric_coordinates_reproduce_the_point() {
        let p = [0.2, 0.3, -0.7];
        for corners in [TETRAHEDRON, [[0.1, 0.2, 0.3], [1.3, -0.4, 0.1], [0.2, 0.1, 1.1], [0.4, 0.9, 0.2]]] {
            let l = barycentric(corners, p);
            for k in 0..3 {
                assert!(((0..4).map(|i| l[i] * corners[i][k]).sum::<f64>() - p[k]).abs() < 1e-14);
            }
            assert!((l.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn a_way_meets_a_face_from_outside_only() {
        let (below, up) = ([0.25, 0.125, -1.0], [0.0, 0.0, 2.0]);
        let found = crossing_inwards(&TETRAHEDRON, 3, below, up, 0.0).unwrap();
        assert_eq!((found.on_way, found.weights, found.nearest), (0.5, [0.625, 0.25, 0.125, 0.0], 0));
        assert!(crossing_inwards(&TETRAHEDRON, 3, [0.25, 0.125, 1.0], [0.0, 0.0, -2.0], 0.0).is_none());
        assert!(crossing_inwards(&TETRAHEDRON, 3, [0.8, 0.3, -1.0], up, 0.0).is_none(), "beside the face");
        assert!(crossing_inwards(&TETRAHEDRON, 3, [-1.0, 0.2, 0.0], [1.0, 0.0, 0.0], 0.0).is_none(), "along it");
        // Exactly through a corner.
        assert_eq!(crossing_inwards(&TETRAHEDRON, 3, [0.0, 0.0, -1.0], up, 0.0).unwrap().weights, [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(nearest_to_way(&TETRAHEDRON, 3, [0.1, 0.6, -1.0], [0.1, 0.6, 0.1]), 2);
        assert_eq!(nearest_to_way(&TETRAHEDRON, 3, [0.1, 0.1, 0.0], [0.8, 0.1, 0.0]), 1, "along the face");
    }

    /// Against the least distance over a fine grid of points of both.
    #[test]
    fn the_distance_of_cell_and_segment_is_the_least_of_all_points() {
        let cases = [
            ([[-1.0, 0.3, 0.3], [2.0, 0.3, 0.3]], "through"),
            ([[0.1, 0.1, 0.1], [0.2, 0.1, 0.1]], "within"),
            ([[-1.0, -0.5, 0.5], [1.0, -0.5, 0.4]], "past a face"),
            ([[0.2, 0.2, -3.0], [0.2, 0.2, -0.5]], "towards a face"),
            ([[1.2, 1.0, -1.0], [1.0, 1.2, 1.0]], "past an edge"),
            ([[2.0, 0.1, 0.0], [3.0, 0.1, 0.3]], "towards a corner"),
            ([[-1.0, 0.0, 0.0], [-0.2, 0.0, 0.0]], "along an edge"),
        ];
        for ([a, b], name) in cases {
            let found = distance_to_segment(&TETRAHEDRON, a, b);
            let mut least = f64::INFINITY;
            let n = 40;
            for i in 0..=n {
                for j in 0..=n - i {
                    for k in 0..=n - i - j {
                        let p = [i, j, k].map(|x| f64::from(x) / f64::from(n));
                        least = least.min(edge_to_segment2(p, p, a, b));
                    }
                }
            }
            assert!(found <= least.sqrt() + 1e-15 && found > least.sqrt() - 0.03, "{name}: {found}, {}", least.sqrt());
        }
        let triangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(distance_to_segment(&triangle, [-1.0, 0.2], [2.0, 0.2]), 0.0);
        assert_eq!(distance_to_segment(&triangle, [-1.0, -0.5], [2.0, -0.5]), 0.5);
    }
}
