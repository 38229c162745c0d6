//! A vertex on surfaces: directions along them, and the way back onto them.

use super::freedom::Freedom;
use crate::generate::implicit::{Implicit, gradient};
use crate::geometry::{dot, norm};

/// Steps back at most. With the normals of the place that a vertex comes from, a step leaves a part of the distance that is
/// about half the square of the angle by which the surface turns.
const STEPS: usize = 6;
/// Least part of a normal that must be independent of the other normal, and of the fixed axes.
const INDEPENDENT: f64 = 0.1;

/// The surfaces at a vertex, linearised.
pub(super) struct Footing<'a> {
    solids: [Option<&'a dyn Implicit>; 2],
    free: [bool; 3],
    /// Orthonormal; the first `n` of them are used.
    basis: [[f64; 3]; 2],
    /// `normal_i . basis_j`.
    normals: [[f64; 2]; 2],
    n: usize,
}

impl<'a> Footing<'a> {
    /// The surfaces at `p`, with slopes by differences over `step`; `None` where they, or the faces of the box, are so near
    /// to parallel that no direction along them all is certain.
    pub fn new(freedom: &Freedom, solids: &'a [Box<dyn Implicit>], p: &[f64; 3], step: f64) -> Option<Self> {
        let mut footing =
            Self { solids: [None; 2], free: freedom.free, basis: [[0.0; 3]; 2], normals: [[0.0; 2]; 2], n: 0 };
        for s in freedom.surfaces() {
            let solid = &*solids[s as usize];
            let full = gradient(solid, p, step);
            let mut rest = footing.masked(full);
            let i = footing.n;
            for j in 0..i {
                let along = dot(&rest, &footing.basis[j]);
                footing.normals[i][j] = along;
                rest = std::array::from_fn(|k| rest[k] - along * footing.basis[j][k]);
            }
            let length = norm(&rest);
            if length <= INDEPENDENT * norm(&full) || length.is_nan() {
                return None;
            }
            footing.basis[i] = rest.map(|x| x / length);
            footing.normals[i][i] = length;
            footing.solids[i] = Some(solid);
            footing.n += 1;
        }
        Some(footing)
    }

    fn masked(&self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| if self.free[k] { v[k] } else { 0.0 })
    }

    /// The part of a vector along faces and surfaces.
    pub fn along(&self, v: [f64; 3]) -> [f64; 3] {
        let mut rest = self.masked(v);
        for basis in &self.basis[..self.n] {
            let across = dot(&rest, basis);
            rest = std::array::from_fn(|k| rest[k] - across * basis[k]);
        }
        rest
    }

    /// The point on all surfaces that is reached from `p` across them, to within `near`; `None` if there is none close by.
    pub fn project(&self, mut p: [f64; 3], near: f64) -> Option<[f64; 3]> {
        for _ in 0..STEPS {
            let mut values = [0.0; 2];
            for (value, solid) in values.iter_mut().zip(self.solids.iter().flatten()) {
                *value = solid.distance(&p);
            }
            if values.iter().all(|value| value.abs() <= near) {
                return Some(p);
            }
            // Forward substitution: the normals are a lower triangle in the basis.
            for i in 0..self.n {
                let known: f64 = (0..i).map(|j| self.normals[i][j] * values[j]).sum();
                values[i] = (values[i] - known) / self.normals[i][i];
            }
            for (value, basis) in values.iter().zip(&self.basis[..self.n]) {
                p = std::array::from_fn(|k| p[k] - value * basis[k]);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::implicit::{HalfSpace, Sphere};
    use crate::generate::improve::{adjacency::NONE, freedom::tests::bound};
    use crate::geometry::distance2;

    fn solids() -> Vec<Box<dyn Implicit>> {
        let plane = |normal| Box::new(HalfSpace::new([0.0; 3], normal).unwrap()) as Box<dyn Implicit>;
        let ball = |x: f64| Box::new(Sphere::new([x, 0.0, 0.0], 1.0).unwrap()) as Box<dyn Implicit>;
        vec![ball(-0.5), ball(0.5), plane([0.0, 0.0, 1.0]), plane([0.0, 1e-3, 1.0])]
    }

    #[test]
    fn the_way_back_ends_on_all_surfaces() {
        let solids = solids();
        // Two unit balls meet in a circle of radius sqrt(3) / 2 in the plane x = 0.
        let p = [0.0, 0.0, 0.75_f64.sqrt()];
        let footing = Footing::new(&bound([0, 1], [true; 3]), &solids, &p, 1e-5).unwrap();
        let along = footing.along([1.0, 1.0, 1.0]);
        assert!(distance2(&along, &[0.0, 1.0, 0.0]) < 1e-16);
        let q = footing.project([0.01, 0.1, 0.88], 1e-10).unwrap();
        assert!(q[0].abs() < 1e-9 && (q[1].hypot(q[2]) - 0.75_f64.sqrt()).abs() < 1e-9, "{q:?}");
        // Far away there is none, and of no number neither.
        assert_eq!(footing.project([0.0, 3.0, 0.0], 1e-10), None);
        assert_eq!(footing.project([f64::NAN; 3], 1e-10), None);
    }

    #[test]
    fn a_fixed_axis_stays_fixed() {
        let solids = solids();
        let footing = Footing::new(&bound([0, NONE], [true, true, false]), &solids, &[0.3, 0.0, 0.6], 1e-5).unwrap();
        assert!(distance2(&footing.along([1.0, 1.0, 1.0]), &[0.0, 1.0, 0.0]) < 1e-16);
        let q = footing.project([0.31, 0.05, 0.6], 1e-10).unwrap();
        assert!(q[2] == 0.6 && solids[0].distance(&q).abs() <= 1e-10);
    }

    #[test]
    fn surfaces_along_each_other_give_no_footing() {
        let footing = |solids: &[Box<dyn Implicit>], pair, free| {
            Footing::new(&bound(pair, free), solids, &[0.0; 3], 1e-5).is_some()
        };
        assert!(!footing(&solids(), [2, 3], [true; 3]));
        // A plane along a face of the box leaves no direction that is both on it and along the free axes.
        assert!(!footing(&solids(), [2, NONE], [true, true, false]));
        assert!(footing(&solids(), [2, NONE], [true, false, true]));
    }
}
