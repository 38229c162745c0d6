//! Nested dissection.

use super::{Adjacency, Permutation, PermutationError};
use crate::metis_graph::{MetisError, MetisGraph};

/// Why there is no nested-dissection order.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NestedDissectionError {
    /// METIS could not be asked, or gave up.
    #[error(transparent)]
    Metis(#[from] MetisError),
    /// What METIS returned is no permutation.
    #[error("METIS returned no permutation: {0}")]
    Result(#[from] PermutationError),
}

/// Orders the nodes so that the factor of a matrix with this pattern stays sparse: separators last, from METIS.
///
/// In 3D that leaves less fill than minimum degree, in 2D about as much. A pattern that is not symmetric is made so. The same
/// pattern always gives the same order. Calls from several threads wait for each other.
///
/// # Errors
/// [`NestedDissectionError`] if the graph has more than 268 million nodes or a billion entries, or METIS runs out of memory.
///
/// Source: Karypis & Kumar, *A fast and high quality multilevel scheme for partitioning irregular graphs*, SIAM J. Sci.
/// Comput. 20 (1998).
pub fn nested_dissection(graph: &(impl Adjacency + ?Sized)) -> Result<Permutation, NestedDissectionError> {
    let mut metis = MetisGraph::new(graph)?;
    if !metis.has_edges() {
        return Ok(Permutation::identity(metis.n_nodes()));
    }
    // A negative number becomes one that is out of range.
    let order = metis.node_nd()?.into_iter().map(|old| old as u32).collect();
    Ok(Permutation::from_new_to_old(order)?)
}
