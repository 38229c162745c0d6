//! How a rod is taken through time.

use super::RodDynamicsError;
use crate::dynamics::{Damping, Scheme, Solution};
use crate::rod::Tangent;

/// How a rod is taken through time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodDynamicsSettings {
    /// The scheme.
    pub scheme: Scheme,
    /// Length of a step, s.
    pub dt: f64,
    /// What is solved in a step; in the minimisation the tangent is exact.
    pub solution: Solution,
    /// Tangent of linearised steps. Where the exact one does not give a definite matrix, Gauss-Newton's is taken instead, which
    /// leaves out the derivatives of twist and of the couple.
    pub tangent: Tangent,
    /// Whether twist is taken at the end of the step with the other forces, rather than at its start.
    pub implicit_twist: bool,
    /// Damping.
    pub damping: Damping,
    /// Residual of Newton's method as a share of elastic, inertial and external forces at the start of the step;
    /// [`Rod::force_round_off`](crate::rod::Rod::force_round_off) is always allowed besides.
    pub tolerance: f64,
}

impl RodDynamicsSettings {
    /// The trapezoid rule with one linearised step of length `dt` (s), exact tangent, explicit twist, no damping; 1e-8.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self {
            scheme: Scheme::TRAPEZOID,
            dt,
            solution: Solution::Linearised,
            tangent: Tangent::Exact,
            implicit_twist: false,
            damping: Damping::default(),
            tolerance: 1e-8,
        }
    }

    pub(super) fn validate(&self) -> Result<(), RodDynamicsError> {
        let refuse = |name, value, expected| Err(RodDynamicsError::Setting { name, value, expected });
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !positive(self.dt) {
            return refuse("dt", self.dt, "a positive time, s");
        }
        if !positive(self.tolerance) {
            return refuse("tolerance", self.tolerance, "a positive number");
        }
        if let Scheme::Newmark { beta, gamma } = self.scheme {
            if !(beta > 0.0 && beta <= 0.5) {
                return refuse("beta", beta, "above 0 and at most 1/2");
            }
            if !(0.5..=1.0).contains(&gamma) {
                return refuse("gamma", gamma, "1/2 to 1");
            }
        }
        for (name, value) in [("damping.mass", self.damping.mass), ("damping.stiffness", self.damping.stiffness)] {
            if !(value >= 0.0 && value.is_finite()) {
                return refuse(name, value, "zero or more");
            }
        }
        Ok(())
    }
}
