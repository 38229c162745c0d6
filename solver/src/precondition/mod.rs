//! Approximate inverses that respect the subspace: symmetric, and mapping `W` into itself.

mod block_jacobi;
mod jacobi;
mod restricted;

pub use block_jacobi::BlockJacobi;
pub use jacobi::Jacobi;

/// A symmetric positive definite approximation of the inverse of `P_W A P_W` on `W`.
pub trait Preconditioner: Sync {
    /// Overwrites `z` with `M⁻¹ r`; `r` lies in `W`.
    fn apply(&self, r: &[f64], z: &mut [f64]);

    /// Whether `M` is the identity, so that a solver can do without the copy.
    fn is_identity(&self) -> bool {
        false
    }
}

/// No preconditioning.
#[derive(Clone, Copy, Debug, Default)]
pub struct Identity;

impl Preconditioner for Identity {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
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
}

#[cfg(test)]
mod tests;
