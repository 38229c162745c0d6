//! Approximate minimum degree.

use super::{Adjacency, Permutation, PermutationError};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::FaerError;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// Why there is no minimum-degree order.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MinimumDegreeError {
    /// Too many entries, or too little memory.
    #[error("faer could not order {nodes} nodes: {reason:?}")]
    Failed {
        /// Number of nodes.
        nodes: usize,
        /// What faer says.
        reason: FaerError,
    },
    /// What faer returned is no permutation.
    #[error("faer returned no permutation: {0}")]
    Result(#[from] PermutationError),
}

/// Orders the nodes so that the factor of a matrix with this pattern stays sparse: those with few neighbours left first.
///
/// # Errors
/// [`MinimumDegreeError`] if memory runs out.
///
/// Source: Amestoy, Davis & Duff, *An approximate minimum degree ordering algorithm*, SIAM J. Matrix Anal. Appl. 17 (1996).
pub fn minimum_degree(graph: &(impl Adjacency + ?Sized)) -> Result<Permutation, MinimumDegreeError> {
    let n = graph.n_nodes();
    let mut starts = Vec::with_capacity(n + 1);
    let mut rows = Vec::new();
    starts.push(0);
    for i in 0..n {
        let first = rows.len();
        rows.extend(graph.neighbours(i).iter().map(|&j| j as usize));
        rows[first..].sort_unstable();
        starts.push(rows.len());
    }
    by_faer(&starts, &rows)
}

/// Not generic, so that it is compiled here.
fn by_faer(starts: &[usize], rows: &[usize]) -> Result<Permutation, MinimumDegreeError> {
    let n = starts.len() - 1;
    let failed = |reason: FaerError| MinimumDegreeError::Failed { nodes: n, reason };
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, starts, None, rows);
    let mut memory =
        MemBuffer::try_new(amd::order_scratch::<usize>(n, rows.len())).map_err(|_| failed(FaerError::OutOfMemory))?;
    let (mut order, mut inverse) = (vec![0; n], vec![0; n]);
    amd::order(&mut order, &mut inverse, pattern, amd::Control::default(), MemStack::new(&mut memory))
        .map_err(failed)?;
    Ok(Permutation::from_new_to_old(order.into_iter().map(|old| old as u32).collect())?) // below `n`, a u32
}
