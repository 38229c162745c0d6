//! What generators hand to each other: arrays of tetrahedra, not yet a mesh.

use crate::{MeshError, SimplexMesh};

/// Tetrahedra as arrays, conforming as far as their maker says so.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tets {
    /// Positions, m.
    pub points: Vec<[f64; 3]>,
    /// Corners, of positive volume by `geometry::signed_measure`.
    pub cells: Vec<[u32; 4]>,
    /// For each cell the number of its region in [`Strata`](super::implicit::Strata).
    pub regions: Vec<u32>,
}

impl Tets {
    /// The mesh of these arrays.
    ///
    /// # Errors
    /// As [`SimplexMesh::with_regions`].
    pub fn into_mesh(self) -> Result<SimplexMesh<3, 4>, MeshError> {
        SimplexMesh::with_regions(self.points, self.cells, self.regions)
    }
}
