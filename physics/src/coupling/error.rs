//! What can go wrong in a coupled step, as values that carry the numbers. Values count needles from 0, messages from 1.

use crate::dynamics::DynamicsError;
use crate::rod::RodError;
use stylet_solver::linear::{ConstrainedError, ConstraintError, KktError, NullSpaceError};

/// Why a coupled step could not be made. Tissue and needles are as they were.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CouplingError {
    /// The tissue alone is at fault.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// A rod is.
    #[error("needle {}: {error}", needle + 1)]
    Rod {
        /// The needle.
        needle: usize,
        /// What is wrong.
        error: RodError,
    },
    /// The coupled system has no solution.
    #[error(transparent)]
    NullSpace(NullSpaceError),
    /// The system with its multipliers has none.
    #[error(transparent)]
    Kkt(#[from] KktError),
    /// Nor has it on the kernel of its constraints.
    #[error(transparent)]
    Constrained(#[from] ConstrainedError),
    /// The constraints do not fit.
    #[error(transparent)]
    Constraint(#[from] ConstraintError),
    /// Conjugate gradients ran out of iterations.
    #[error("the coupled system: residual {residual:e} N after {iterations} iterations, threshold {threshold:e} N")]
    IterationLimit {
        /// Iterations made.
        iterations: usize,
        /// Residual then, N.
        residual: f64,
        /// What it was compared with, N.
        threshold: f64,
    },
    /// The matrix of the step is not positive definite, even with the nearest semidefinite tangents.
    #[error("the matrix of the step is not positive definite")]
    Indefinite,
    /// The step was given up.
    #[error("{0}")]
    GivenUp(String),
    /// A needle slid further than the mesh allows for one step.
    #[error(
        "needle {} slides {slip:.3e} m past the tissue at its node {node} in a step, more than the {reach:.3e} m that the mesh allows",
        needle + 1
    )]
    Overrun {
        /// The needle.
        needle: usize,
        /// Its node.
        node: usize,
        /// How far it slid, m.
        slip: f64,
        /// How far it may, m.
        reach: f64,
    },
    /// A node of a needle moved so far in a step that the step cannot be meant.
    #[error("needle {} is thrown by {moved:.3e} m at its node {node} in a step, more than {most:.3e} m", needle + 1)]
    Thrown {
        /// The needle.
        needle: usize,
        /// Its node.
        node: usize,
        /// How far it moved, m.
        moved: f64,
        /// How far it may, m.
        most: f64,
    },
    /// A needle has too few nodes, or vectors of another length.
    #[error("needle {}: {what}", needle + 1)]
    Shape {
        /// The needle.
        needle: usize,
        /// What does not fit.
        what: &'static str,
    },
}

impl From<NullSpaceError> for CouplingError {
    fn from(error: NullSpaceError) -> Self {
        use stylet_solver::linear::CgError;
        match error {
            NullSpaceError::NotPositiveDefinite { .. }
            | NullSpaceError::Cg(CgError::NotPositiveDefinite { .. } | CgError::PreconditionerNotPositive { .. }) => {
                Self::Indefinite
            }
            error => Self::NullSpace(error),
        }
    }
}
