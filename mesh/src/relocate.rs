//! Moving a vertex within the mesh.
//!
//! The forest remembers where vertices were: their reference positions, of which every midpoint is one, decide which edge
//! a cell of the first cycle bisects, and guide the search for points. They are stored from the first move on.

use crate::{CellId, SimplexMesh, VertexId, geometry, start::coordinate_limit};

/// Why a vertex cannot be moved.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MoveError {
    /// A coordinate that is not a number, infinite, or so large that a volume would overflow.
    #[error("vertex {vertex} cannot be moved to a coordinate of {value}")]
    Coordinate {
        /// The vertex.
        vertex: u32,
        /// The coordinate.
        value: f64,
    },
    /// A cell around the vertex would keep too little of its volume, or turn over.
    #[error("moving vertex {vertex} leaves cell {cell} {share:.3} of its volume, expected at least {least}")]
    Flattens {
        /// The vertex.
        vertex: u32,
        /// The cell.
        cell: u32,
        /// New volume over old volume, negative if the cell turns over.
        share: f64,
        /// The smallest share accepted.
        least: f64,
    },
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// Moves a vertex to `point`, if every cell around it keeps at least the share `least` of its volume.
    ///
    /// Which edges will be bisected does not change, and all else follows the move: midpoints of later bisections,
    /// lengths, location and refinement, whose search widens by the farthest move.
    ///
    /// # Errors
    /// [`MoveError`]; the mesh is then unchanged.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn move_vertex(&mut self, vertex: VertexId, point: [f64; D], least: f64) -> Result<(), MoveError> {
        if let Some(&value) = point.iter().find(|x| x.is_nan() || x.abs() > coordinate_limit::<D>()) {
            return Err(MoveError::Coordinate { vertex: vertex.0, value });
        }
        let mut star = Vec::new();
        self.star(vertex, &mut star);
        for &cell in &star {
            let share = self.share_left(cell, vertex, point);
            // A share that is not a number is refused too.
            if !(share >= least && share > 0.0) {
                return Err(MoveError::Flattens { vertex: vertex.0, cell: cell.0, share, least });
            }
        }
        if self.reference.is_empty() {
            self.reference = self.points.clone();
        }
        self.points[vertex.index()] = point;
        let distance = geometry::distance2(&point, &self.reference[vertex.index()]).sqrt();
        self.farthest_move = self.farthest_move.max(distance);
        Ok(())
    }

    fn share_left(&self, cell: CellId, vertex: VertexId, point: [f64; D]) -> f64 {
        let mut corners = self.corners(cell);
        let before = geometry::signed_measure(&corners);
        for (corner, v) in corners.iter_mut().zip(self.cell(cell)) {
            if v == vertex {
                *corner = point;
            }
        }
        geometry::signed_measure(&corners) / before
    }

    /// The positions of which every midpoint is one: where vertices would be had none been moved.
    #[inline]
    pub(crate) fn reference_points(&self) -> &[[f64; D]] {
        if self.reference.is_empty() { &self.points } else { &self.reference }
    }

    #[inline]
    pub(crate) fn reference_corners(&self, v: &[u32; N]) -> [[f64; D]; N] {
        let points = self.reference_points();
        std::array::from_fn(|i| points[v[i] as usize])
    }
}
