//! When a residual is small enough, and why an iteration ended.

use serde::{Deserialize, Serialize};

/// Why a solve ended. Running out of budget is an outcome, not an error: an interactive scene keeps the iterate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stop {
    /// The residual satisfies the [`StopRule`].
    Converged,
    /// The budget of iterations was used up first.
    IterationLimit,
    /// Rounding errors keep the residual above the rule; the best iterate is kept.
    Stalled,
    /// The caller had seen enough.
    Abandoned,
}

/// Which forces the residual is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Criterion {
    /// External forces alone, eq. (6.8). Cannot be met when only displacements are prescribed.
    External,
    /// External and reaction forces, eq. (6.9).
    Reaction,
}

/// The residual `‖P_W r‖₂` must not exceed [`threshold`](Self::threshold).
///
/// Source: Nienhuys, *Cutting in deformable objects*, PhD thesis, Utrecht (2003), eqs. (6.8) and (6.9). Equation (6.8) is
/// [`Criterion::External`] with a `round_floor` of zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StopRule {
    /// Relaxation tolerance ε, positive, dimensionless.
    pub tolerance: f64,
    /// Which forces the residual is compared with.
    pub criterion: Criterion,
    /// Estimate of the rounding error in the residual, in its unit: `E d H ε_round / √n` in (6.9). Zero or more.
    pub round_floor: f64,
}

/// A stopping rule that no residual can be held against.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StopRuleError {
    /// The tolerance is zero, negative, infinite or NaN.
    #[error("tolerance {0:e} is not a positive number")]
    Tolerance(f64),
    /// The rounding floor is negative, infinite or NaN.
    #[error("rounding floor {0:e} is not a finite number of at least zero")]
    RoundFloor(f64),
    /// The norm of the external forces is negative, infinite or NaN.
    #[error("norm of the external forces {0:e} is not a finite number of at least zero")]
    ExternalNorm(f64),
}

impl StopRule {
    /// The largest residual norm that counts as converged, from the norms of the external and the reaction forces.
    #[must_use]
    pub fn threshold(&self, external_norm: f64, reaction_norm: f64) -> f64 {
        let scale = match self.criterion {
            Criterion::External => external_norm,
            Criterion::Reaction => external_norm.hypot(reaction_norm),
        };
        self.tolerance * scale + self.round_floor
    }

    /// Refuses a rule that makes no sense.
    ///
    /// # Errors
    /// [`StopRuleError`] names the offending number.
    pub fn validate(&self) -> Result<(), StopRuleError> {
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return Err(StopRuleError::Tolerance(self.tolerance));
        }
        if !(self.round_floor >= 0.0 && self.round_floor.is_finite()) {
            return Err(StopRuleError::RoundFloor(self.round_floor));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(criterion: Criterion) -> StopRule {
        StopRule { tolerance: 1e-2, criterion, round_floor: 0.5 }
    }

    #[test]
    fn thresholds_are_those_of_the_thesis() {
        assert_eq!(rule(Criterion::External).threshold(3.0, 4.0), 0.03 + 0.5);
        assert_eq!(rule(Criterion::Reaction).threshold(3.0, 4.0), 0.05 + 0.5);
    }

    #[test]
    fn nonsense_is_refused() {
        for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let bad = StopRule { tolerance, ..rule(Criterion::External) };
            assert!(matches!(bad.validate(), Err(StopRuleError::Tolerance(_))));
        }
        for round_floor in [-1.0, f64::NAN, f64::INFINITY] {
            let bad = StopRule { round_floor, ..rule(Criterion::External) };
            assert!(matches!(bad.validate(), Err(StopRuleError::RoundFloor(_))));
        }
    }
}
