//! Why a rod is refused, or its angles do not settle.

use stylet_solver::sparse::SparseError;

/// Why a rod, or what is to be set on one, is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RodError {
    /// A number that no rod has.
    #[error("{name} of the rod is {value:e}, expected {expected}")]
    Value {
        /// Which number.
        name: &'static str,
        /// What was found.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// A number of one edge or node that no rod has.
    #[error("{name} {index} of the rod is {value:e}, expected {expected}")]
    Entry {
        /// Which list.
        name: &'static str,
        /// Position in the list.
        index: usize,
        /// What was found.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// A list that does not fit the rod.
    #[error("{name} of the rod: {found} given, expected {expected}")]
    Shape {
        /// Which list.
        name: &'static str,
        /// Length of the list given.
        found: usize,
        /// Length that fits.
        expected: usize,
    },
    /// An edge of no length or a corner folded back onto itself, or a coordinate that is not finite: there are no frames.
    #[error("edge {edge} of the rod has no direction, or the one before it is its opposite")]
    Degenerate {
        /// The edge.
        edge: usize,
    },
    /// Torques on a rod that no end holds do not add up to zero.
    #[error("the torques on a rod that turns freely add up to {sum:e} N m, expected zero")]
    Unbalanced {
        /// Their sum, N m.
        sum: f64,
    },
    /// The angles did not come to rest.
    #[error("angles not in equilibrium after {iterations} iterations: largest torque {torque:e} N m")]
    NotSettled {
        /// Iterations made.
        iterations: usize,
        /// The largest torque that is left, N m.
        torque: f64,
    },
    /// The tangent could not be stored.
    #[error(transparent)]
    Sparse(#[from] SparseError),
}

/// Refuses what is not finite, or not above zero.
pub(super) fn positive(name: &'static str, value: f64) -> Result<(), RodError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(RodError::Value { name, value, expected: "a positive number" })
}

pub(super) fn shape(name: &'static str, found: usize, expected: usize) -> Result<(), RodError> {
    if found == expected { Ok(()) } else { Err(RodError::Shape { name, found, expected }) }
}
