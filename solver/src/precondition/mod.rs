//! Approximate inverses that respect the subspace: symmetric, and mapping `W` into itself.
//!
//! Iterations to a relative residual of 1e-5 on the model system of 13,182 tetrahedra, ν = 0.34, and products per iteration,
//! that of conjugate gradients included:
//!
//! | | static | dt = 20 ms | dt = 1 ms | products |
//! |---|---|---|---|---|
//! | [`Identity`] | 301 | 160 | 22 | 1 |
//! | [`Jacobi`] | 250 | 134 | 9 | 1 |
//! | [`BlockJacobi`] | 245 | 133 | 9 | 1 |
//! | [`Chebyshev`] of degree 3 | 96 | 51 | 6 | 3 |
//! | [`Ssor`] | 79 | 44 | 5 | 2 |
//! | [`IncompleteCholesky`] | 71 | 39 | 4 | 2 |
//! | [`TwoLevel`](aggregation::TwoLevel), additive | 50 | 41 | 10 | 1 and a coarse solve |
//! | [`TwoLevel`](aggregation::TwoLevel), V-cycle | 24 | 20 | 5 | 3 and a coarse solve |
//! | [`SmoothedAggregation`](aggregation::SmoothedAggregation) | 11 | 8 | 5 | 5, and about half as much on coarser levels |
//!
//! All take the matrix for symmetric, and none checks it.

pub mod aggregation;
mod block_jacobi;
mod chebyshev;
mod incomplete_cholesky;
mod jacobi;
pub mod multilevel;
mod projected;
mod restricted;
mod scratch;
mod single_precision;
mod spectrum;
mod ssor;
#[cfg(feature = "direct")]
mod stale;

pub use block_jacobi::BlockJacobi;
pub use chebyshev::{Chebyshev, ChebyshevSettings};
pub use incomplete_cholesky::IncompleteCholesky;
pub use jacobi::Jacobi;
pub use single_precision::SinglePrecision;
pub use ssor::{Ssor, SsorSettings};
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

    /// The preconditioner as one that works block row by block row, if it does: its work is then done in the same pass as
    /// the update of the residual.
    fn by_rows(&self) -> Option<&dyn PreconditionRows<T>> {
        None
    }

    /// Whether `M` is the identity, so that a solver can do without the copy.
    fn is_identity(&self) -> bool {
        false
    }
}

/// A preconditioner whose rows do not mix.
pub trait PreconditionRows<T: Real = f64>: Sync {
    /// Overwrites `z` with the entries of `M⁻¹ r` from entry `first` on, as many as `r` and `z` have; a part is made of whole
    /// blocks.
    fn apply_rows(&self, first: usize, r: &[T], z: &mut [T]);

    /// Whether some entries of `M⁻¹ r` follow from more than their rows: [`finish_rows`](Self::finish_rows) writes them.
    fn is_finished_later(&self) -> bool {
        false
    }

    /// Overwrites these entries of `z` once all rows are there, in `W`; returns by how much that changes `rᵀz`.
    fn finish_rows(&self, r: &[T], z: &mut [T]) -> f64 {
        let _ = (r, z);
        0.0
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
    /// A block of the matrix holds NaN or an infinity.
    #[error("block ({row}, {col}) of the matrix holds a number that is not finite")]
    NotFinite {
        /// Block row.
        row: usize,
        /// Block column.
        col: usize,
    },
    /// A setting makes no sense.
    #[error("{name} = {value} is out of its range")]
    Parameter {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The matrix has a negative curvature on the subspace.
    #[error("curvature {curvature:e}: the matrix is not positive semidefinite on the allowed moves")]
    Indefinite {
        /// `pᵀA p` of a direction met.
        curvature: f64,
    },
    /// Modes are given for a number of nodes that is not the matrix's.
    #[error("modes of {modes} nodes are given, the matrix has {nodes}")]
    Modes {
        /// Nodes of the modes.
        modes: usize,
        /// Nodes of the matrix.
        nodes: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("coordinates of node {node} are not finite")]
    Coordinates {
        /// The node.
        node: usize,
    },
    /// An incomplete factorisation meets a pivot block that is not positive definite, whatever the shift.
    #[error(
        "pivot {pivot:e} in block row {row} of an incomplete factor, still with the diagonal raised by {shift} of it"
    )]
    Breakdown {
        /// Block row.
        row: usize,
        /// The pivot that should have been positive.
        pivot: f64,
        /// The last shift tried.
        shift: f64,
    },
    /// The coarsest matrix has no factor.
    #[error("pivot {pivot:e} in row {row} of the coarse matrix: not positive definite")]
    Coarse {
        /// Scalar row of the coarsest matrix.
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
