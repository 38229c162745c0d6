//! Fresh partitions.

use super::{Partition, PartsError};
use crate::metis_graph::{MetisError, MetisGraph};
use crate::ordering::Adjacency;

/// Why there is no partition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartitionError {
    /// Nodes have to be in some part.
    #[error("{nodes} nodes cannot be put into no parts")]
    NoParts {
        /// Number of nodes.
        nodes: usize,
    },
    /// More parts than METIS has numbers.
    #[error("{0} parts are too many")]
    TooManyParts(usize),
    /// METIS could not be asked, or gave up.
    #[error(transparent)]
    Metis(#[from] MetisError),
    /// METIS returned parts that do not exist.
    #[error("METIS returned no partition: {0}")]
    Result(#[from] PartsError),
}

/// Puts the nodes into `n_parts` parts of about equal size with few edges between them, by METIS.
///
/// The same graph always gives the same parts. Calls from several threads wait for each other. At least as many parts as
/// nodes give every node a part of its own; nodes without any edge are dealt out in rows of equal length.
///
/// # Errors
/// [`PartitionError`] if there are nodes but no parts, or the graph has more than 268 million nodes or a billion entries.
///
/// Source: Karypis & Kumar, *Multilevel k-way partitioning scheme for irregular graphs*, J. Parallel Distrib. Comput. 48
/// (1998).
pub fn partition(graph: &(impl Adjacency + ?Sized), n_parts: usize) -> Result<Partition, PartitionError> {
    let n = graph.n_nodes();
    if n_parts == 0 && n > 0 {
        return Err(PartitionError::NoParts { nodes: n });
    }
    let Ok(k) = i32::try_from(n_parts) else {
        return Err(PartitionError::TooManyParts(n_parts));
    };
    let metis = MetisGraph::new(graph)?;
    let parts = if n_parts >= n {
        (0..n as u32).collect() // as many as METIS has numbers
    } else if n_parts == 1 || !metis.has_edges() {
        (0..n).map(|node| (node * n_parts / n) as u32).collect()
    } else {
        // A negative number becomes one that is out of range.
        metis.part_kway(k)?.into_iter().map(|part| part as u32).collect()
    };
    Ok(Partition::new(graph, parts, n_parts)?)
}
