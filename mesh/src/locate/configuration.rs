//! A mesh with its vertices at given positions.

use super::LocateError;
use crate::{CellId, SimplexMesh, VertexId, geometry};

/// Positions of vertices by id, in the length of the coordinates.
///
/// Implemented by slices of points, so by [`SimplexMesh::points`] (rest positions), and for flat coordinates by
/// `flat.as_chunks::<D>().0`; and by [`Displaced`].
pub trait Positions<const D: usize> {
    /// The number of vertices that have a position: those with ids below.
    fn n_positions(&self) -> usize;
    /// The position of a vertex with an id below [`n_positions`](Self::n_positions).
    fn position(&self, vertex: VertexId) -> [f64; D];
}

impl<const D: usize> Positions<D> for [[f64; D]] {
    fn n_positions(&self) -> usize {
        self.len()
    }

    #[inline]
    fn position(&self, vertex: VertexId) -> [f64; D] {
        self[vertex.index()]
    }
}

/// Points plus displacements.
#[derive(Clone, Copy, Debug)]
pub struct Displaced<'a, const D: usize> {
    /// By vertex id.
    pub points: &'a [[f64; D]],
    /// Flat: vertex id times `D`.
    pub displacement: &'a [f64],
}

impl<const D: usize> Positions<D> for Displaced<'_, D> {
    fn n_positions(&self) -> usize {
        self.points.len().min(self.displacement.len() / D)
    }

    #[inline]
    fn position(&self, vertex: VertexId) -> [f64; D] {
        let (x, u) = (self.points[vertex.index()], &self.displacement[vertex.index() * D..][..D]);
        std::array::from_fn(|k| x[k] + u[k])
    }
}

/// A mesh with its vertices at given positions; made by [`SimplexMesh::configuration`].
#[derive(Debug)]
pub struct Configuration<'a, const D: usize, const N: usize, P: ?Sized> {
    pub(super) mesh: &'a SimplexMesh<D, N>,
    positions: &'a P,
}

impl<const D: usize, const N: usize, P: ?Sized> Clone for Configuration<'_, D, N, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<const D: usize, const N: usize, P: ?Sized> Copy for Configuration<'_, D, N, P> {}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// The mesh with its vertices at other positions.
    ///
    /// # Errors
    /// [`LocateError::Positions`] if vertices are without position.
    pub fn configuration<'a, P: Positions<D> + ?Sized>(
        &'a self,
        positions: &'a P,
    ) -> Result<Configuration<'a, D, N, P>, LocateError> {
        let (found, expected) = (positions.n_positions(), self.points.len());
        if found < expected {
            return Err(LocateError::Positions { found, expected });
        }
        Ok(Configuration { mesh: self, positions })
    }

    /// The mesh with its vertices where they are at rest.
    pub(super) fn at_rest(&self) -> Configuration<'_, D, N, [[f64; D]]> {
        Configuration { mesh: self, positions: &self.points }
    }
}

impl<const D: usize, const N: usize, P: Positions<D> + ?Sized> Configuration<'_, D, N, P> {
    /// The positions of the vertices of a cell, in the order of [`SimplexMesh::cell`].
    ///
    /// # Panics
    /// If there is no such cell.
    #[inline]
    pub fn corners(&self, cell: CellId) -> [[f64; D]; N] {
        self.mesh.cell(cell).map(|v| self.positions.position(v))
    }
}

/// The barycentric coordinates of (the projection of) `p`, by Cramer's rule where a simplex fills the plane or space;
/// `None` for a flat simplex, and if a coordinate is not finite.
#[inline]
pub(super) fn barycentric<const D: usize, const N: usize>(corners: &[[f64; D]; N], p: &[f64; D]) -> Option<[f64; N]> {
    let edge = |i: usize| geometry::subtract(&corners[i], &corners[0]);
    let d = geometry::subtract(p, &corners[0]);
    let mut lambda = [0.0; N];
    match (D, N) {
        (2, 3) => {
            let (e, f) = (edge(1), edge(2));
            let cross = |a: [f64; D], b: [f64; D]| a[0] * b[1] - a[1] * b[0];
            let volume = cross(e, f);
            (lambda[1], lambda[2]) = (cross(d, f) / volume, cross(e, d) / volume);
        }
        (3, 4) => {
            let (e, f, g) = (edge(1), edge(2), edge(3));
            let cross = |a: [f64; D], b: [f64; D]| -> [f64; D] {
                std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
            };
            let normal = cross(f, g);
            let volume = geometry::dot(&e, &normal);
            lambda[1] = geometry::dot(&d, &normal) / volume;
            let normal = cross(d, e);
            lambda[2] = -geometry::dot(&g, &normal) / volume;
            lambda[3] = geometry::dot(&f, &normal) / volume;
        }
        _ => lambda = geometry::barycentric(corners, p)?,
    }
    lambda[0] = 1.0 - lambda[1..].iter().sum::<f64>();
    // Also if the volume is zero, or overflows.
    lambda.iter().all(|l| l.is_finite()).then_some(lambda)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cramers_rule_agrees_with_elimination() {
        let triangle = [[0.1, 0.2], [1.3, 0.1], [0.2, 1.7]];
        let tetrahedron = [[0.1, 0.2, -0.3], [1.3, 0.1, 0.2], [0.2, 1.7, 0.4], [-0.2, 0.3, 2.1]];
        let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-14);
        let p = [0.3, -0.4, 0.5];
        let q = [p[0], p[1]];
        assert!(close(&barycentric(&triangle, &q).unwrap(), &geometry::barycentric(&triangle, &q).unwrap()));
        assert!(close(&barycentric(&tetrahedron, &p).unwrap(), &geometry::barycentric(&tetrahedron, &p).unwrap()));
        assert!(barycentric(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], &q).is_none());
        assert!(barycentric(&triangle, &[f64::NAN, 0.0]).is_none());
    }
}
