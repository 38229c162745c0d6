//! The two constants of an isotropic solid, checked once.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Why a material could not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// Young's modulus must be positive and finite.
    #[error("Young's modulus is {young} Pa, it must be positive and finite")]
    YoungModulus {
        /// The value found, Pa.
        young: f64,
    },
    /// Poisson's ratio must lie in the range of the law.
    #[error("Poisson's ratio is {poisson}, this material needs {requirement}")]
    PoissonRatio {
        /// The value found.
        poisson: f64,
        /// The range that the law needs.
        requirement: &'static str,
    },
    /// Lamé's constants must be finite, `mu > 0`, and the bulk modulus `lambda + 2 mu / 3` positive.
    #[error("Lamé constants mu = {mu:e} Pa, lambda = {lambda:e} Pa: this material needs finite values, {requirement}")]
    LameConstants {
        /// Shear modulus found, Pa.
        mu: f64,
        /// First constant found, Pa.
        lambda: f64,
        /// What the law needs of them.
        requirement: &'static str,
    },
    /// The principal stretch below which a law is continued must lie in the range of the law.
    #[error("the stretch below which the law is continued is {threshold}, it must satisfy {requirement}")]
    Threshold {
        /// The value found.
        threshold: f64,
        /// The range that the law needs.
        requirement: &'static str,
    },
    /// Viscosities must be finite, and such that power is never negative.
    #[error(
        "viscosities psi = {psi:e} Pa s, alpha = {alpha:e} Pa s: finite values are needed, psi > 0 and alpha > -2 psi / 3"
    )]
    Viscosity {
        /// The first coefficient found, Pa s.
        psi: f64,
        /// The second coefficient found, Pa s.
        alpha: f64,
    },
    /// The damping time must be positive and finite.
    #[error("the damping time is {damping_time} s, it must be positive and finite")]
    DampingTime {
        /// The value found, s.
        damping_time: f64,
    },
    /// No law of this name.
    #[error("there is no material model \"{model}\"; there are {known}")]
    UnknownModel {
        /// The name found.
        model: String,
        /// The names there are.
        known: String,
    },
}

const STABLE: &str = "mu > 0 and lambda > -2 mu / 3";
const NON_NEGATIVE: &str = "mu > 0 and lambda >= 0";

/// Lamé's constants `mu` (shear modulus) and `lambda`, Pa, of a stable isotropic solid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Lame {
    mu: f64,
    lambda: f64,
}

/// What a file holds, before it is checked.
#[derive(Deserialize)]
#[serde(rename = "Lame")]
struct Unchecked {
    mu: f64,
    lambda: f64,
}

impl TryFrom<Unchecked> for Lame {
    type Error = MaterialError;
    fn try_from(raw: Unchecked) -> Result<Self, MaterialError> {
        Self::new(raw.mu, raw.lambda)
    }
}

impl Lame {
    /// From the constants themselves, Pa.
    ///
    /// # Errors
    /// [`MaterialError::LameConstants`] unless both are finite, `mu > 0` and `lambda > -2 mu / 3`.
    pub fn new(mu: f64, lambda: f64) -> Result<Self, MaterialError> {
        let stable = mu > 0.0 && mu.is_finite() && lambda.is_finite() && lambda > -2.0 / 3.0 * mu;
        if stable {
            Ok(Self { mu, lambda })
        } else {
            Err(MaterialError::LameConstants { mu, lambda, requirement: STABLE })
        }
    }

    /// From Young's modulus (Pa, positive) and Poisson's ratio, `-1 < poisson < 0.5`:
    /// `mu = E / 2(1 + nu)`, `lambda = E nu / (1 + nu)(1 - 2 nu)`.
    ///
    /// # Errors
    /// [`MaterialError::YoungModulus`], [`MaterialError::PoissonRatio`], or [`MaterialError::LameConstants`] where the
    /// constants overflow.
    pub fn from_young_poisson(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        if !(young > 0.0 && young.is_finite()) {
            return Err(MaterialError::YoungModulus { young });
        }
        if !(poisson > -1.0 && poisson < 0.5) {
            return Err(MaterialError::PoissonRatio { poisson, requirement: "-1 < nu < 0.5" });
        }
        Self::new(young / (2.0 * (1.0 + poisson)), young / (1.0 + poisson) * (poisson / (1.0 - 2.0 * poisson)))
    }

    /// The same for laws that need `0 <= poisson`.
    pub(super) fn from_young_non_negative_poisson(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        if !(0.0..0.5).contains(&poisson) {
            return Err(MaterialError::PoissonRatio { poisson, requirement: "0 <= nu < 0.5" });
        }
        Self::from_young_poisson(young, poisson)
    }

    /// The same, if `lambda >= 0`: below, the energy of the neo-Hookean law has no lower bound.
    pub(super) fn non_negative(self) -> Result<Self, MaterialError> {
        let Self { mu, lambda } = self;
        if lambda >= 0.0 {
            Ok(self)
        } else {
            Err(MaterialError::LameConstants { mu, lambda, requirement: NON_NEGATIVE })
        }
    }

    /// From a file, if `lambda >= 0`.
    pub(super) fn deserialize_non_negative<'de, D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        Self::deserialize(source)?.non_negative().map_err(D::Error::custom)
    }

    /// Young's modulus, Pa.
    #[must_use]
    pub fn young(&self) -> f64 {
        self.mu * (3.0 * self.lambda + 2.0 * self.mu) / (self.lambda + self.mu)
    }

    /// Shear modulus `mu`, Pa.
    #[inline]
    pub fn mu(&self) -> f64 {
        self.mu
    }

    /// First Lamé constant `lambda`, Pa.
    #[inline]
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// The constants of plane stress, `lambda* = 2 mu lambda / (lambda + 2 mu)`.
    ///
    /// From `S33 = 0` with `S = 2 mu G + lambda tr(G) I`: `G33 = -lambda / (lambda + 2 mu) tr(G~)`. (Nienhuys (2003)
    /// prints this condition as (6.3) with a factor `2 mu` that does not belong there.)
    pub(super) fn plane_stress(&self) -> Self {
        // Through the quotient, which stays finite however large lambda is.
        Self { mu: self.mu, lambda: 2.0 * self.mu * (self.lambda / (self.lambda + 2.0 * self.mu)) }
    }
}

/// The constructors of a law that is defined by Lamé's constants, whatever the sign of `lambda`.
macro_rules! law_of_lame {
    ($law:ident) => {
        impl $law {
            /// From Young's modulus (Pa, positive) and Poisson's ratio, `-1 < poisson < 0.5`.
            ///
            /// # Errors
            /// [`MaterialError`] if a constant is out of range.
            pub fn from_young_poisson(young: f64, poisson: f64) -> Result<Self, MaterialError> {
                Ok(Self { lame: Lame::from_young_poisson(young, poisson)? })
            }

            /// From Lamé's constants.
            pub fn from_lame(lame: Lame) -> Self {
                Self { lame }
            }

            /// Lamé's constants.
            pub fn lame(&self) -> Lame {
                self.lame
            }
        }
    };
}
pub(super) use law_of_lame;

/// As [`law_of_lame`], of a law whose energy has no lower bound below `lambda = 0`.
macro_rules! law_of_non_negative_lame {
    ($law:ident) => {
        impl $law {
            /// From Young's modulus (Pa, positive) and Poisson's ratio, `0 <= poisson < 0.5` (below 0 the energy has no lower
            /// bound).
            ///
            /// # Errors
            /// [`MaterialError`] if a constant is out of range.
            pub fn from_young_poisson(young: f64, poisson: f64) -> Result<Self, MaterialError> {
                Ok(Self { lame: Lame::from_young_non_negative_poisson(young, poisson)? })
            }

            /// From Lamé's constants.
            ///
            /// # Errors
            /// [`MaterialError::LameConstants`] if `lambda < 0`.
            pub fn from_lame(lame: Lame) -> Result<Self, MaterialError> {
                Ok(Self { lame: lame.non_negative()? })
            }

            /// Lamé's constants.
            pub fn lame(&self) -> Lame {
                self.lame
            }
        }
    };
}
pub(super) use law_of_non_negative_lame;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_constants_are_errors() {
        for young in [0.0, -1.0, f64::NAN, f64::INFINITY, -f64::INFINITY] {
            assert!(matches!(Lame::from_young_poisson(young, 0.3), Err(MaterialError::YoungModulus { .. })), "{young}");
        }
        for poisson in [0.5, -1.0, 1.0, f64::NAN, f64::INFINITY] {
            assert!(
                matches!(Lame::from_young_poisson(1.0, poisson), Err(MaterialError::PoissonRatio { .. })),
                "{poisson}"
            );
        }
        assert!(matches!(Lame::from_young_poisson(1e308, 0.4999999), Err(MaterialError::LameConstants { .. })));
        assert!(matches!(Lame::from_young_poisson(5e-324, 0.49), Err(MaterialError::LameConstants { .. })));
        assert!(Lame::new(1.0, -0.7).is_err() && Lame::new(1.0, -0.6).is_ok());
    }

    #[test]
    fn plane_stress_constants_keep_the_uniaxial_modulus() {
        let star = Lame::from_young_poisson(34e3, 0.34).unwrap().plane_stress();
        let modulus = 4.0 * star.mu * (star.lambda + star.mu) / (star.lambda + 2.0 * star.mu);
        assert!((modulus - 34e3).abs() < 1e-9 * 34e3);
    }
}
