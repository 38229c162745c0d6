//! How a body is taken through time.

use super::{DynamicsError, Scheme};
use serde::{Deserialize, Serialize};
use stylet_solver::stop::{Criterion, StopRule};

/// What is solved in a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solution {
    /// The equation of motion linearised at the start of the step: eq. (4) of Chentanez et al. (2009).
    Linearised,
    /// The equation of motion itself, by projected Newton steps on the incremental potential, which no step leaves higher
    /// than it was at its start: a step of backward Euler under a dead load never gains energy. Where elements are inverted
    /// and the law allows it, the best of the budget is accepted, see
    /// [`StepReport::unconverged`](super::StepReport::unconverged).
    Newton {
        /// Steps per time step; when they are used up the step is halved.
        max_iterations: usize,
    },
}

/// Rayleigh's damping, `D = mass M + stiffness K`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Damping {
    /// Proportional to the mass, 1/s.
    pub mass: f64,
    /// Proportional to the stiffness at the start of the step, s.
    pub stiffness: f64,
}

/// Steps whose length follows the error that they make.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Adaptive {
    /// Largest displacement error of one step, m: a step that exceeds it is taken again with half the length, one that
    /// stays below an eighth is followed by one of twice the length.
    pub tolerance: f64,
    /// Shortest step, s; it is accepted whatever its error.
    pub smallest: f64,
    /// Longest step, s.
    pub largest: f64,
}

/// How a body is taken through time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DynamicsSettings {
    /// The scheme.
    pub scheme: Scheme,
    /// The step, s; the first one of adaptive steps.
    pub dt: f64,
    /// What is solved.
    pub solution: Solution,
    /// Damping.
    pub damping: Damping,
    /// When a linear solve (or Newton's method) has come far enough; the external forces are the right-hand side (in
    /// Newton's method load, elastic forces and inertia at the start).
    pub stop: StopRule,
    /// Budget of conjugate gradients, per step.
    pub max_inner_iterations: usize,
    /// How often a step that cannot be made is halved before that is an error; the whole step is made all the same.
    pub max_halvings: u32,
    /// Steps that adapt.
    pub adaptive: Option<Adaptive>,
    /// Whether reports hold energies and momentum: a pass over all elements.
    pub balance: bool,
}

impl DynamicsSettings {
    /// The trapezoid rule with one linearised step of length `dt` (s), no damping, 1e-5 of the right-hand side, ten
    /// halvings.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self {
            scheme: Scheme::TRAPEZOID,
            dt,
            solution: Solution::Linearised,
            damping: Damping::default(),
            stop: StopRule { tolerance: 1e-5, criterion: Criterion::External, round_floor: 0.0 },
            max_inner_iterations: 10_000,
            max_halvings: 10,
            adaptive: None,
            balance: false,
        }
    }

    pub(super) fn validate(&self) -> Result<(), DynamicsError> {
        let refuse = |name, value, expected| Err(DynamicsError::Setting { name, value, expected });
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !positive(self.dt) {
            return refuse("dt", self.dt, "a positive time, s");
        }
        if let Scheme::Newmark { beta, gamma } = self.scheme {
            if !(beta > 0.0 && beta <= 0.5) {
                return refuse("beta", beta, "above 0 and at most 1/2");
            }
            if !(0.5..=1.0).contains(&gamma) {
                return refuse("gamma", gamma, "1/2 to 1: less makes energy out of nothing");
            }
        }
        for (name, value) in [("damping.mass", self.damping.mass), ("damping.stiffness", self.damping.stiffness)] {
            if !(value >= 0.0 && value.is_finite()) {
                return refuse(name, value, "zero or more");
            }
        }
        if let Some(adaptive) = &self.adaptive {
            if !positive(adaptive.tolerance) {
                return refuse("adaptive.tolerance", adaptive.tolerance, "a positive length, m");
            }
            if !(positive(adaptive.smallest) && adaptive.smallest <= self.dt) {
                return refuse("adaptive.smallest", adaptive.smallest, "a positive time up to dt, s");
            }
            if !(adaptive.largest >= self.dt && adaptive.largest.is_finite()) {
                return refuse("adaptive.largest", adaptive.largest, "a time of at least dt, s");
            }
        }
        if self.max_halvings > 20 {
            return refuse("max_halvings", f64::from(self.max_halvings), "at most 20");
        }
        self.stop.validate()?;
        Ok(())
    }
}
