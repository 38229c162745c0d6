//! Which way a vertex may move without a change of the boundary's shape.
//!
//! ```text
//!   inside: anywhere     in a flat patch: along it     on a straight crease: along it     at a corner: nowhere
//! ```
//!
//! A facet stays within its plane if its vertices move along it. So whoever moves along the planes of all boundary facets
//! that it has leaves the boundary where it is.

use crate::geometry::{dot, norm};

/// Normals of planes that differ by less than this angle, radians, are of one plane.
const SAME: f64 = 1e-10;

/// What the moves of a vertex are orthogonal to: an orthonormal basis of the first `n` entries.
#[derive(Clone, Copy, Debug)]
pub(super) struct Freedom<const D: usize> {
    basis: [[f64; D]; D],
    n: usize,
}

impl<const D: usize> Freedom<D> {
    /// Anywhere.
    pub fn full() -> Self {
        Self { basis: [[0.0; D]; D], n: 0 }
    }

    /// Takes the direction of a normal of any length away.
    pub fn restrict(&mut self, normal: &[f64; D]) {
        let length = norm(normal);
        let unit = normal.map(|x| x / length);
        let rest = self.project(&self.project(&unit));
        let part = norm(&rest);
        if part > SAME && self.n < D {
            self.basis[self.n] = rest.map(|x| x / part);
            self.n += 1;
        }
    }

    /// Whether there is no way at all.
    pub fn is_none(&self) -> bool {
        self.n == D
    }

    /// Whether there is every way.
    pub fn is_full(&self) -> bool {
        self.n == 0
    }

    /// The part of a vector that is free.
    pub fn project(&self, v: &[f64; D]) -> [f64; D] {
        let mut free = *v;
        for normal in &self.basis[..self.n] {
            let part = dot(&free, normal);
            (0..D).for_each(|k| free[k] -= part * normal[k]);
        }
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_creases_and_corners() {
        let mut freedom = Freedom::<3>::full();
        assert!(freedom.is_full());
        freedom.restrict(&[0.0, 0.0, -3.0]);
        freedom.restrict(&[0.0, 0.0, 2.0]);
        assert_eq!(freedom.project(&[1.0, 2.0, 5.0]), [1.0, 2.0, 0.0]);
        freedom.restrict(&[0.0, 4.0, 1.0]);
        assert_eq!(freedom.project(&[1.0, 2.0, 5.0]), [1.0, 0.0, 0.0]);
        assert!(!freedom.is_none());
        freedom.restrict(&[1.0, 1.0, 1.0]);
        assert!(freedom.is_none() && freedom.project(&[1.0, 2.0, 5.0]) == [0.0; 3]);
    }
}
