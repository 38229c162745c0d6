//! Quality of one simplex.

use crate::geometry::{self, distance2, dot, gradients};

/// The measures of one simplex.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CellQuality {
    /// Smallest angle between two facets, degrees.
    pub min_angle_deg: f64,
    /// Largest angle between two facets, degrees.
    pub max_angle_deg: f64,
    /// [`normalized_volume`].
    pub quality: f64,
    /// Longest edge over the diameter of the inscribed sphere; infinite for a flat cell.
    ///
    /// Source: Goksel, *Ultrasound image and 3D finite element based tissue deformation simulator for prostate
    /// brachytherapy*, thesis (2004), Table 3.1.
    pub aspect: f64,
    /// Circumradius over the shortest edge; infinite for a flat cell.
    pub radius_edge: f64,
}

impl CellQuality {
    /// Measures a simplex given by its corners; the sign of the volume is that of their order.
    pub fn of<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> Self {
        let (min_angle_deg, max_angle_deg) = angles_deg(corners);
        let (shortest, longest) = edge_range(corners);
        let aspect = gradients(corners).map_or(f64::INFINITY, |g| {
            // The radius of the inscribed sphere is 1 / sum |g_i|, because 1 / |g_i| are the heights.
            let inverse_radius: f64 = g.iter().map(|g| dot(g, g).sqrt()).sum();
            0.5 * longest * inverse_radius
        });
        let radius_edge = geometry::circumradius(corners).map_or(f64::INFINITY, |radius| radius / shortest);
        Self { min_angle_deg, max_angle_deg, quality: normalized_volume(corners), aspect, radius_edge }
    }
}

/// The shortest and the longest edge.
pub(super) fn edge_range<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> (f64, f64) {
    let lengths2 = pairs::<N>().map(|(i, j)| distance2(&corners[i], &corners[j]));
    let (shortest2, longest2) = lengths2.fold((f64::INFINITY, 0.0_f64), |(s, l), x| (s.min(x), l.max(x)));
    (shortest2.sqrt(), longest2.sqrt())
}

/// The pairs `i < j` below `N`.
pub(super) fn pairs<const N: usize>() -> impl Iterator<Item = (usize, usize)> {
    (1..N).flat_map(|j| (0..j).map(move |i| (i, j)))
}

/// Volume over the `N - 1`-st power of the root mean square edge, scaled so that the regular simplex has 1:
/// `6 sqrt(2) V / l_rms^3` for a tetrahedron. Negative for an inverted cell, 0 for one that is a point.
pub fn normalized_volume<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> f64 {
    // Scaled by the longest edge first: volumes of very small cells would underflow.
    let longest = geometry::longest_edge2(corners).sqrt();
    if longest == 0.0 {
        return 0.0;
    }
    let sum: f64 = pairs::<N>().map(|(i, j)| distance2(&corners[i], &corners[j]) / (longest * longest)).sum();
    let rms = (sum / (N * (N - 1) / 2) as f64).sqrt();
    let volume = geometry::relative_measure(corners) / geometry::factorial(N - 1);
    volume / (geometry::regular_measure(N - 1) * rms.powi(N as i32 - 1))
}

/// The smallest and the largest angle between two facets, degrees: the angles of a triangle, the dihedral angles of a
/// tetrahedron. `(0, 180)` for a flat cell and for a segment.
pub fn angles_deg<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> (f64, f64) {
    let Some(angles) = each_angle_deg(corners) else { return (0.0, 180.0) };
    angles.fold((180.0_f64, 0.0_f64), |(min, max), angle| (min.min(angle), max.max(angle)))
}

/// The angles between facets, degrees, by pairs of opposite vertices; `None` for a flat cell and for a segment.
pub fn each_angle_deg<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> Option<impl Iterator<Item = f64>> {
    let normals = unit_normals(corners).filter(|_| N > 2)?;
    Some(pairs::<N>().map(move |(i, j)| 180.0 - between_deg(&normals[i], &normals[j])))
}

/// The inward unit normals of the facets, which are the directions of the gradients.
fn unit_normals<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> Option<[[f64; D]; N]> {
    let normals = gradients(corners)?.map(|g| {
        let norm = dot(&g, &g).sqrt();
        g.map(|x| x / norm)
    });
    normals.iter().flatten().all(|x| x.is_finite()).then_some(normals)
}

/// The angle between unit vectors, accurate near 0 and 180 degrees where the arc cosine is not.
///
/// Source: Kahan, *How futile are mindless assessments of roundoff in floating-point computation?* (2006), section 12.
fn between_deg<const D: usize>(u: &[f64; D], v: &[f64; D]) -> f64 {
    let sum: [f64; D] = std::array::from_fn(|k| u[k] + v[k]);
    2.0 * (distance2(u, v).sqrt()).atan2(dot(&sum, &sum).sqrt()).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} is not {b}");
    }

    #[test]
    fn a_right_triangle() {
        let q = CellQuality::of(&[[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]]);
        close(q.min_angle_deg, (3.0_f64 / 4.0).atan().to_degrees());
        close(q.max_angle_deg, 90.0);
        close(q.aspect, 5.0 / 2.0); // inradius (3 + 4 - 5) / 2
        close(q.radius_edge, 2.5 / 3.0);
        close(q.quality, 6.0 / (3.0_f64.sqrt() / 4.0 * 50.0 / 3.0));
    }

    #[test]
    fn a_regular_tetrahedron() {
        let q = CellQuality::of(&[[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]]);
        close(q.min_angle_deg, (1.0_f64 / 3.0).acos().to_degrees());
        close(q.max_angle_deg, q.min_angle_deg);
        close(q.quality.abs(), 1.0);
        close(q.aspect, 6.0_f64.sqrt());
        close(q.radius_edge, 6.0_f64.sqrt() / 4.0);
    }

    #[test]
    fn tets_use_the_formula_of_the_literature() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.3, 0.2, 0.7]];
        let mean2 = pairs::<4>().map(|(i, j)| distance2(&corners[i], &corners[j])).sum::<f64>() / 6.0;
        let expected = 6.0 * 2.0_f64.sqrt() * geometry::signed_measure(&corners) / mean2.sqrt().powi(3);
        close(normalized_volume(&corners), expected);
    }

    #[test]
    fn quality_has_no_scale() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.3, 0.2, 0.7]];
        let tiny = corners.map(|p| p.map(|x| 1e-90 * x));
        close(normalized_volume(&tiny), normalized_volume(&corners));
    }

    #[test]
    fn degenerate_cells_have_the_worst_values() {
        let q = CellQuality::of(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]);
        assert_eq!((q.min_angle_deg, q.max_angle_deg, q.quality), (0.0, 180.0, 0.0));
        assert_eq!((q.aspect, q.radius_edge), (f64::INFINITY, f64::INFINITY));
        assert_eq!(CellQuality::of(&[[1.0, 1.0]; 3]).quality, 0.0);
    }
}
