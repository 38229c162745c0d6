//! Why a step could not be made.

use crate::rod::{BandedError, RodError};
use stylet_solver::nonlinear::NonlinearError;
use stylet_solver::stop::Stop;

/// Why a step could not be made; the state is then that before the step.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RodDynamicsError {
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
    /// Rod, load or state are refused, or the angles do not settle.
    #[error(transparent)]
    Rod(#[from] RodError),
    /// The matrix of the step has no factor.
    #[error("the matrix of the step at t = {t} s: {source}")]
    Matrix {
        /// Time before the step, s.
        t: f64,
        /// Why.
        source: BandedError,
    },
    /// The minimisation is refused.
    #[error(transparent)]
    Nonlinear(#[from] NonlinearError),
    /// Newton's method ended above the tolerance.
    #[error(
        "step at t = {t} s: {stop:?} after {iterations} iterations, residual {residual:e} N, threshold {threshold:e} N"
    )]
    NotConverged {
        /// Time before the step, s.
        t: f64,
        /// Why it ended.
        stop: Stop,
        /// Iterations made.
        iterations: usize,
        /// Residual, N.
        residual: f64,
        /// What it should have come down to, N.
        threshold: f64,
    },
    /// A number of the state at the end of the step is not finite.
    #[error("node {node} has no finite place after the step at t = {t} s")]
    NotFinite {
        /// The first such node.
        node: usize,
        /// Time before the step, s.
        t: f64,
    },
}
