//! Why a static solve ended without an equilibrium.

use stylet_mesh::CellId;
#[cfg(feature = "direct")]
use stylet_solver::linear::direct::DirectError;
use stylet_solver::linear::{CgError, RefineError};
use stylet_solver::precondition::PreconditionerError;
use stylet_solver::stop::StopRuleError;

/// Why there is no equilibrium to return. `u` then holds the last one that was reached (the start, if none was).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticError {
    /// A linear method on a nonlinear material.
    #[error("conjugate gradients and direct solves need a material with constant stiffness")]
    NotLinear,
    /// A vector or the subspace does not fit the body.
    #[error("the body has {dim} displacement components, {what} has {len}")]
    Shape {
        /// Which argument.
        what: &'static str,
        /// Components of a displacement.
        dim: usize,
        /// Components of the argument.
        len: usize,
    },
    /// A load step is not in `(0, 1]`.
    #[error("{name} is {value}, it must be above 0 and at most 1")]
    LoadStep {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// An element is inside out (or flat) where the solve starts, which the material does not allow.
    #[error("cell {} is inverted at the start: det F = {jacobian:e}", cell.0)]
    InvertedAtStart {
        /// The cell.
        cell: CellId,
        /// Its `det F`.
        jacobian: f64,
    },
    /// No load step, however small, led further.
    #[error(
        "no equilibrium beyond {load_factor} of the load; smallest det F = {jacobian:e}, in cell {}: {reason}", cell.0
    )]
    Blocked {
        /// Share of the load that is in equilibrium.
        load_factor: f64,
        /// The cell that was closest to inversion in the last attempt.
        cell: CellId,
        /// Its `det F` there.
        jacobian: f64,
        /// What the last attempt ended with.
        reason: String,
    },
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// The linear solve failed.
    #[error(transparent)]
    Cg(#[from] CgError),
    /// The stiffness has no factor: it is singular on the moves that are allowed, or indefinite.
    #[cfg(feature = "direct")]
    #[error(transparent)]
    Direct(#[from] DirectError),
    /// The factored solve could not be refined.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// The iteration limit ended a linear solve.
    #[error("not converged after {iterations} iterations: residual {residual:e} N, threshold {threshold:e} N")]
    IterationLimit {
        /// Iterations made.
        iterations: usize,
        /// Residual, N.
        residual: f64,
        /// What it should have come down to, N.
        threshold: f64,
    },
    /// The preconditioner could not be built.
    #[error(transparent)]
    Preconditioner(#[from] PreconditionerError),
}
