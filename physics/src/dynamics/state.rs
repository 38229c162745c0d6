//! What a run needs to go on.

use crate::body::Linearization;
use serde::{Deserialize, Serialize};

/// A body in motion: with the body of the same mesh and settings, a run that is resumed from it has the bits of one that
/// never stopped.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Time, s.
    pub t: f64,
    /// Steps made.
    pub step: u64,
    /// Length of the next step, s.
    pub dt: f64,
    /// Displacement, m, flat.
    pub u: Vec<f64>,
    /// Velocity, m/s.
    pub v: Vec<f64>,
    /// Acceleration, m/s^2.
    pub a: Vec<f64>,
    /// Where the stiffness was last evaluated: filled in by [`Integrator::save`](super::Integrator::save).
    pub linearization: Linearization,
}
