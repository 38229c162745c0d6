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
            // A NaN fails this test too.
            if !(length > INDEPENDENT * norm(&full)) {
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
