//! Why a step could not be made.

use crate::body::BodyError;
use stylet_mesh::CellId;
use stylet_solver::linear::CgError;
use stylet_solver::nonlinear::NonlinearError;
use stylet_solver::precondition::PreconditionerError;
use stylet_solver::stop::StopRuleError;

/// Why a step could not be made; the state is then that before the step.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DynamicsError {
    /// The body has no mass.
    #[error("the body has no mass: a body in motion needs a density")]
    NoMass,
    /// A setting is out of range.
    #[error("{name} is {value}, expected {expected}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
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
    /// A load or a prescribed motion is not finite.
    #[error("entry {index} of {what} at t = {t} s is not finite")]
    NotFinite {
        /// Which vector.
        what: &'static str,
        /// Its first entry that is not finite.
        index: usize,
        /// The time, s.
        t: f64,
    },
    /// A vertex without elements is free to move, and has no mass.
    #[error("vertex {vertex} belongs to no element, so it has no mass: constrain it")]
    MasslessVertex {
        /// The vertex.
        vertex: usize,
    },
    /// An element is inside out where the material does not allow it, before the step.
    #[error("cell {} is inverted at t = {t} s: det F = {jacobian:e}", cell.0)]
    Inverted {
        /// The cell.
        cell: CellId,
        /// Its `det F`.
        jacobian: f64,
        /// The time, s.
        t: f64,
    },
    /// The step failed, and so did its halves.
    #[error(
        "no step from t = {t} s, not even of {smallest:e} s; smallest det F of the last attempt = {jacobian:e}, in cell {}: {reason}",
        cell.0
    )]
    Failed {
        /// The time before the step, s.
        t: f64,
        /// The shortest step that was tried, s.
        smallest: f64,
        /// The cell closest to inversion in the last attempt.
        cell: CellId,
        /// Its `det F`.
        jacobian: f64,
        /// What the last attempt ended with.
        reason: String,
    },
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// The first acceleration could not be found.
    #[error("initial acceleration: {0}")]
    Start(CgError),
    /// The preconditioner could not be built.
    #[error(transparent)]
    Preconditioner(#[from] PreconditionerError),
    /// A matrix could not be built, or a stored state does not fit the body.
    #[error(transparent)]
    Body(#[from] BodyError),
}

/// Why one attempt at a step was given up.
#[derive(Debug)]
pub(crate) enum Setback {
    /// A shorter one may do.
    Curable(String),
    Final(DynamicsError),
}

impl From<DynamicsError> for Setback {
    fn from(error: DynamicsError) -> Self {
        Self::Final(error)
    }
}

impl From<CgError> for Setback {
    fn from(error: CgError) -> Self {
        match error {
            CgError::StopRule(error) => Self::Final(error.into()),
            other => Self::Curable(other.to_string()),
        }
    }
}

impl From<NonlinearError> for Setback {
    fn from(error: NonlinearError) -> Self {
        match error {
            NonlinearError::StopRule(error) => Self::Final(error.into()),
            other => Self::Curable(other.to_string()),
        }
    }
}

impl From<PreconditionerError> for Setback {
    fn from(error: PreconditionerError) -> Self {
        Self::Curable(error.to_string())
    }
}
