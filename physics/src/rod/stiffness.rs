//! Stiffness of a section.

use super::RodError;
use super::error::positive;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Stiffness of a rod whose section bends the same way in every direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RodStiffness {
    /// `EI`, N m^2: zero (a chain) or more.
    pub bending: f64,
    /// `GJ`, N m^2: zero or more.
    pub twisting: f64,
    /// `EA`, N: positive.
    pub stretching: f64,
}

impl RodStiffness {
    /// A round bar: Young's modulus (Pa), Poisson's ratio, diameter (m).
    ///
    /// # Errors
    /// [`RodError::Value`] unless modulus and diameter are positive and the ratio above -1 and at most 1/2.
    pub fn round(young: f64, poisson: f64, diameter: f64) -> Result<Self, RodError> {
        Self::tube(young, poisson, diameter, 0.0)
    }

    /// A tube: Young's modulus (Pa), Poisson's ratio, outer and inner diameter (m).
    ///
    /// # Errors
    /// [`RodError::Value`] as for [`round`](Self::round), and unless the inner diameter is at least zero and below the outer.
    pub fn tube(young: f64, poisson: f64, outer: f64, inner: f64) -> Result<Self, RodError> {
        positive("Young's modulus", young)?;
        positive("outer diameter", outer)?;
        if !(poisson > -1.0 && poisson <= 0.5) {
            return Err(RodError::Value { name: "Poisson's ratio", value: poisson, expected: "above -1, at most 1/2" });
        }
        if !(inner >= 0.0 && inner < outer) {
            let expected = "zero or more, below the outer diameter";
            return Err(RodError::Value { name: "inner diameter", value: inner, expected });
        }
        let second_moment = PI / 64.0 * (outer.powi(4) - inner.powi(4));
        let area = PI / 4.0 * (outer * outer - inner * inner);
        let shear = young / (2.0 * (1.0 + poisson));
        let stiffness =
            Self { bending: young * second_moment, twisting: shear * 2.0 * second_moment, stretching: young * area };
        stiffness.validate()?;
        Ok(stiffness)
    }

    pub(super) fn validate(&self) -> Result<(), RodError> {
        positive("stretching stiffness", self.stretching)?;
        for (name, value) in [("bending stiffness", self.bending), ("twisting stiffness", self.twisting)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(RodError::Value { name, value, expected: "zero or more" });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_have_the_known_stiffness() {
        let wire = RodStiffness::round(60e9, 0.33, 0.83e-3).unwrap();
        assert!((wire.bending - 1.397763e-3).abs() < 1e-9);
        assert!((wire.stretching - 32464.0).abs() < 1.0);
        assert!((wire.bending / wire.twisting - 1.33).abs() < 1e-12);
        let tube = RodStiffness::tube(200e9, 0.3, 1.270e-3, 0.838e-3).unwrap();
        assert!((tube.bending - 0.020698).abs() < 1e-6);
    }

    #[test]
    fn nonsense_is_refused() {
        for (young, poisson, outer, inner) in [
            (f64::NAN, 0.3, 1e-3, 0.0),
            (-1.0, 0.3, 1e-3, 0.0),
            (1e9, 0.6, 1e-3, 0.0),
            (1e9, f64::NAN, 1e-3, 0.0),
            (1e9, 0.3, 0.0, 0.0),
            (1e9, 0.3, 1e-3, 1e-3),
            (1e9, 0.3, 1e-3, -1e-4),
            (1e300, 0.3, 1e30, 0.0),
        ] {
            assert!(RodStiffness::tube(young, poisson, outer, inner).is_err(), "{young} {poisson} {outer} {inner}");
        }
    }
}
