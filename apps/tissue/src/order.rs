//! Which numbers the vertices of a start mesh have.

use stylet_mesh::SimplexMesh;
use stylet_physics::numbering::in_reverse_cuthill_mckee_order;
use stylet_scene::Words;

/// `mesh.order`: the numbers of the vertices of a start mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum VertexOrder {
    /// As they were made or read.
    Made,
    /// By reverse Cuthill-McKee.
    Rcm,
}

impl Words for VertexOrder {
    const WORDS: &'static [(&'static str, Self)] = &[("made", Self::Made), ("rcm", Self::Rcm)];
}

impl VertexOrder {
    /// The mesh with vertices, and cells by their vertices, in this order.
    ///
    /// # Errors
    /// A mesh that is not as it was made, with the key.
    pub fn of<const D: usize, const N: usize>(self, mesh: SimplexMesh<D, N>) -> Result<SimplexMesh<D, N>, String> {
        match self {
            Self::Made => Ok(mesh),
            Self::Rcm => in_reverse_cuthill_mckee_order(&mesh)
                .map(|(renumbered, _)| renumbered)
                .map_err(|error| format!("mesh.order: {error}")),
        }
    }
}
