//! Approximate inverses that respect the subspace: symmetric, and mapping `W` into itself.

mod block_jacobi;
mod jacobi;
mod restricted;
#[cfg(feature = "direct")]
mod stale;

pub use block_jacobi::BlockJacobi;
pub use jacobi::Jacobi;
#[cfg(feature = "direct")]
pub use stale::StaleFactor;

use crate::real::Real;
use crate::team::Team;

/// A symmetric positive definite approximation of the inverse of `P_W A P_W` on `W`.
///
/// Working memory that `apply` needs is the preconditioner's own, behind a lock, so that a warm call allocates nothing.
pub trait Preconditioner<T: Real = f64>: Sync {
    /// Overwrites `z` with `M⁻¹ r`; `r` lies in `W`.
    fn apply(&self, r: &[T], z: &mut [T]);

    /// [`apply`](Self::apply) by all members of a team, with the same bits.
    fn apply_on(&self, team: &Team, r: &[T], z: &mut [T]) {
        let _ = team;
        self.apply(r, z);
    }

    /// Whether `M` is the identity, so that a solver can do without the copy.
    fn is_identity(&self) -> bool {
        false
    }
}

/// No preconditioning.
#[derive(Clone, Copy, Debug, Default)]
pub struct Identity;

impl<T: Real> Preconditioner<T> for Identity {
    fn apply(&self, r: &[T], z: &mut [T]) {
        z.copy_from_slice(r);
    }

    fn is_identity(&self) -> bool {
        true
    }
}

/// A preconditioner that cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PreconditionerError {
    /// Matrix and subspace have different numbers of nodes.
    #[error("matrix has {rows} block rows, subspace has {nodes} nodes")]
    Shape {
        /// Block rows of the matrix.
        rows: usize,
        /// Nodes of the subspace.
        nodes: usize,
    },
    /// There is no such node.
    #[error("node {node} is out of range: there are {n_nodes} nodes")]
    NodeOutOfRange {
        /// The node asked for.
        node: usize,
        /// Number of nodes.
        n_nodes: usize,
    },
    /// The diagonal block of a node, restricted to its allowed moves, is not positive definite.
    #[error("pivot {pivot:e} in block row {row}: its diagonal block is not positive definite on the allowed moves")]
    NotPositive {
        /// Block row, which is the node.
        row: usize,
        /// The pivot that should have been positive.
        pivot: f64,
    },
    /// A nodal matrix is no rotation.
    #[error("the matrix of node {node} is not orthogonal: RᵀR differs from the identity by {deviation:e}")]
    NotRotation {
        /// The node.
        node: usize,
        /// Largest entry of the difference.
        deviation: f64,
    },
}

#[cfg(test)]
mod tests;
