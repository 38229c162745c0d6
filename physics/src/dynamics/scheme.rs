//! How displacement and velocity follow from accelerations.

use serde::{Deserialize, Serialize};

/// A step of length `h`: `u1 = u^ + cx a1`, `v1 = v^ + cv a1`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// `u^ = u0 + h v0 + h^2 (1/2 - beta) a0`, `cx = beta h^2`, `v^ = v0 + h (1 - gamma) a0`, `cv = gamma h`, with
    /// `0 < beta <= 1/2` and `1/2 <= gamma <= 1`. Order 2 for `gamma = 1/2`, stable for any step in linear problems if
    /// `2 beta >= gamma`.
    ///
    /// Source: Newmark (1959), J. Eng. Mech. Div. ASCE 85; eqs. (1) and (2) of Chentanez et al. (2009).
    Newmark {
        /// Weight of the new acceleration in the displacement.
        beta: f64,
        /// Weight of the new acceleration in the velocity.
        gamma: f64,
    },
    /// `u^ = u0 + h v0`, `cx = h^2`, `v^ = v0`, `cv = h`: order 1, and dissipates what it does not resolve.
    BackwardEuler,
}

/// The scheme for one length of step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coefficients {
    pub h: f64,
    /// Weights of `a0` in `u^` and `v^`.
    pub u_a0: f64,
    pub v_a0: f64,
    pub cx: f64,
    pub cv: f64,
}

impl Scheme {
    /// Newmark's method with `beta = 1/4`, `gamma = 1/2`: the trapezoid rule.
    pub const TRAPEZOID: Self = Self::Newmark { beta: 0.25, gamma: 0.5 };

    pub(crate) fn coefficients(self, h: f64) -> Coefficients {
        match self {
            Self::Newmark { beta, gamma } => {
                Coefficients { h, u_a0: h * h * (0.5 - beta), v_a0: h * (1.0 - gamma), cx: beta * h * h, cv: gamma * h }
            }
            Self::BackwardEuler => Coefficients { h, u_a0: 0.0, v_a0: 0.0, cx: h * h, cv: h },
        }
    }

    /// Factor of `h^2 (a1 - a0)` in the estimate of the error that one step adds to the displacement: the Taylor term of
    /// `h^3 / 6` less what the scheme has of it.
    ///
    /// Source: Zienkiewicz & Xie (1991), Earthquake Eng. Struct. Dyn. 20, for Newmark's method.
    pub(super) fn error_factor(self) -> f64 {
        match self {
            Self::Newmark { beta, .. } => (beta - 1.0 / 6.0).abs(),
            // u1 = u0 + h v0 + h^2 a1 against h^2 a / 2: the difference is of second order, and never below this.
            Self::BackwardEuler => 1.0,
        }
    }
}
