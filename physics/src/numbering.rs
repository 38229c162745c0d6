//! Numbers and parts of the vertices of a mesh, by the graph of its edges.

use stylet_mesh::{RenumberError, SimplexMesh};
use stylet_solver::ordering::{AdjacencySlices, Permutation, profile, reverse_cuthill_mckee};
#[cfg(feature = "metis")]
use stylet_solver::partition::{PartitionError, partition};

/// What [`SimplexMesh::vertex_graph`] hands out fits together.
const GRAPH: &str = "the graph of a mesh has its vertices as nodes";

/// The mesh with its vertices in reverse Cuthill-McKee order and its cells in the order of their vertices: neighbours, and with
/// them the numbers that a row, a product or an element needs, then lie close together in memory. What else is kept by vertex
/// follows the permutation.
///
/// # Errors
/// [`RenumberError::Changed`] if the mesh is not as it was made.
///
/// Source: [`reverse_cuthill_mckee`].
pub fn in_reverse_cuthill_mckee_order<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
) -> Result<(SimplexMesh<D, N>, Permutation), RenumberError> {
    let (offsets, neighbours) = mesh.vertex_graph();
    let order = reverse_cuthill_mckee(&AdjacencySlices::new(&offsets, &neighbours).expect(GRAPH));
    Ok((mesh.renumbered(order.new_to_old())?, order))
}

/// Mean over the vertices of the distance, in numbers, to the lowest neighbour; 0 for one that has no lower one.
#[must_use]
pub fn mean_bandwidth<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> f64 {
    let (offsets, neighbours) = mesh.vertex_graph();
    let graph = AdjacencySlices::new(&offsets, &neighbours).expect(GRAPH);
    let n = mesh.n_vertex_slots();
    profile(&graph, &Permutation::identity(n)) as f64 / n as f64
}

/// The part of each vertex, of `n_parts` about equal ones with few edges between them, for
/// [`Body::set_partition`](crate::body::Body::set_partition).
///
/// # Errors
/// [`PartitionError`]: no parts, or more than METIS can count.
///
/// Source: [`partition`].
#[cfg(feature = "metis")]
pub fn metis_parts<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    n_parts: usize,
) -> Result<Vec<u32>, PartitionError> {
    let (offsets, neighbours) = mesh.vertex_graph();
    let graph = AdjacencySlices::new(&offsets, &neighbours).expect(GRAPH);
    partition(&graph, n_parts).map(|partition| partition.parts().to_vec())
}
