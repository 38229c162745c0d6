//! What the iterative methods beside [`cg`](super::cg) share: how far they go, what they report, and vectors they refuse.

use crate::stop::{Stop, StopRule};
use crate::vector::first_not_finite;

/// How far a solve goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KrylovSettings {
    /// When the residual is small enough; the external forces are the right side.
    pub stop: StopRule,
    /// Budget of iterations, one product each; zero only evaluates the residual.
    pub max_iterations: usize,
}

/// How a solve went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KrylovReport {
    /// Why it ended.
    pub stop: Stop,
    /// Iterations, each with one product.
    pub iterations: usize,
    /// All products, those that evaluate a residual included.
    pub products: usize,
    /// `‖P_W (b − A x)‖₂` of the iterate returned.
    pub residual_norm: f64,
    /// `‖(I − P_W)(b − A x)‖₂`: norm of the reaction forces.
    pub reaction_norm: f64,
    /// What the residual norm was last compared with.
    pub threshold: f64,
}

/// A vector that a method cannot work with.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VectorError {
    /// An argument does not fit the operator.
    #[error("{what} has length {len}, not {expected}")]
    Length {
        /// Which argument.
        what: &'static str,
        /// Length that fits.
        expected: usize,
        /// Length of the argument.
        len: usize,
    },
    /// A vector holds NaN or an infinity; products point at the operator or the preconditioner.
    #[error("entry {index} of {what} is not finite at iteration {iteration}")]
    NotFinite {
        /// Which vector.
        what: &'static str,
        /// Its first entry that is not finite.
        index: usize,
        /// Iteration, 0 before the first.
        iteration: usize,
    },
    /// Every entry is finite, but a sum of squares is not.
    #[error("the norm of {what} overflows at iteration {iteration}")]
    Overflow {
        /// Which vector.
        what: &'static str,
        /// Iteration, 0 before the first.
        iteration: usize,
    },
}

pub(super) fn check_length(what: &'static str, len: usize, expected: usize) -> Result<(), VectorError> {
    if len == expected { Ok(()) } else { Err(VectorError::Length { what, expected, len }) }
}

/// Passes a sum on, or names the entry of `v` that spoilt it.
pub(super) fn finite(sum: f64, what: &'static str, v: &[f64], iteration: usize) -> Result<f64, VectorError> {
    if sum.is_finite() {
        return Ok(sum);
    }
    Err(match first_not_finite(v) {
        Some(index) => VectorError::NotFinite { what, index, iteration },
        None => VectorError::Overflow { what, iteration },
    })
}

/// Below this tolerance the residual of a recurrence is not taken at its word.
pub(super) const VERIFY_BELOW: f64 = 1e-6;

/// Below this a square is not to be divided by: it has lost digits to underflow, and nothing is left to minimise.
pub(super) const UNDERFLOW: f64 = f64::MIN_POSITIVE / f64::EPSILON;

/// A residual with a smaller square has vanished: its product with a preconditioner of small entries may be zero.
const VANISHED: f64 = 1e-200;

/// Whether `rᵀM⁻¹r = value` tells of a preconditioner that is not positive definite, and not of a residual that underflows.
pub(super) fn not_positive(value: f64, rr: f64) -> bool {
    value < 0.0 || (value == 0.0 && rr > VANISHED)
}
