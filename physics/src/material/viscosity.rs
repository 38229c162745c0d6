//! Damping stress from the velocity gradient.

use super::{Corotated, Hyperelastic, Lame, MaterialError, RotationTangent};
use crate::lanes::Lane;
use crate::svd::{polar_rotation, polar_rotation_differential};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// `P = R (psi (D + D^T) + alpha tr(D) I)` with `D = R^T dF/dt` and the rotation `R` closest to `F`; `psi`, `alpha` in
/// Pa s.
///
/// The rates of stretching see what strains see in the corotated law: turning costs nothing, and power is never negative.
///
/// Source: Irving, Teran & Fedkiw (2004), *Invertible finite elements for robust simulation of large deformation*, section
/// on damping; Chentanez et al. (2009), section 3.2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Coefficients", into = "Coefficients")]
pub struct Viscosity {
    /// The stress is linear in the rates as the corotated one with a held rotation is in displacements.
    law: Corotated,
}

/// What a file holds.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename = "Viscosity")]
struct Coefficients {
    psi: f64,
    alpha: f64,
}

impl TryFrom<Coefficients> for Viscosity {
    type Error = MaterialError;
    fn try_from(raw: Coefficients) -> Result<Self, MaterialError> {
        Self::new(raw.psi, raw.alpha)
    }
}

impl From<Viscosity> for Coefficients {
    fn from(viscosity: Viscosity) -> Self {
        Self { psi: viscosity.psi(), alpha: viscosity.alpha() }
    }
}

impl Viscosity {
    /// From the two coefficients, Pa s.
    ///
    /// # Errors
    /// [`MaterialError::Viscosity`] unless both are finite, `psi > 0` and `alpha > -2 psi / 3` (power would be negative).
    pub fn new(psi: f64, alpha: f64) -> Result<Self, MaterialError> {
        let lame = Lame::new(psi, alpha).map_err(|_| MaterialError::Viscosity { psi, alpha })?;
        Ok(Self { law: Corotated::from_lame(lame).with_rotation(RotationTangent::Held) })
    }

    /// Kelvin and Voigt's solid: viscosities are the elastic constants times `damping_time` (s), so that `eta = tau E`.
    ///
    /// # Errors
    /// [`MaterialError::DampingTime`] unless the time is positive and finite; [`MaterialError::Viscosity`] if the
    /// products over- or underflow.
    pub fn kelvin_voigt(lame: Lame, damping_time: f64) -> Result<Self, MaterialError> {
        if !(damping_time > 0.0 && damping_time.is_finite()) {
            return Err(MaterialError::DampingTime { damping_time });
        }
        Self::new(lame.mu() * damping_time, lame.lambda() * damping_time)
    }

    /// The coefficient of shear and stretching rates, Pa s.
    pub fn psi(&self) -> f64 {
        self.law.lame().mu()
    }

    /// The coefficient of the rate of volume, Pa s.
    pub fn alpha(&self) -> f64 {
        self.law.lame().lambda()
    }

    /// First Piola-Kirchhoff stress at `F` and `dF/dt` (1/s), Pa. Linear in the rate: it is its own differential in
    /// that direction.
    pub fn stress<const D: usize>(&self, f: &SMatrix<f64, D, D>, rate: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        self.law.stress_differential(f, rate)
    }

    /// Differential of the stress in the direction `dF`, the rate held, Pa. (In the damping of a time step usually left
    /// out, as the rotation is held there.)
    pub fn stress_differential<const D: usize>(
        &self,
        f: &SMatrix<f64, D, D>,
        rate: &SMatrix<f64, D, D>,
        df: &SMatrix<f64, D, D>,
    ) -> SMatrix<f64, D, D> {
        let (r, dr) = (polar_rotation(f), polar_rotation_differential(f, df));
        let viscous = |d: SMatrix<f64, D, D>| {
            (d + d.transpose()) * self.psi() + SMatrix::<f64, D, D>::identity() * (self.alpha() * d.trace())
        };
        dr * viscous(r.transpose() * rate) + r * viscous(dr.transpose() * rate)
    }

    /// Damping matrix of a P1 element, positive semidefinite: `d force / d velocity`, N s/m; arguments as
    /// [`Hyperelastic::element_stiffness`].
    ///
    /// # Panics
    /// If `upper` does not hold `N (N + 1) / 2` blocks.
    pub fn element_damping<const D: usize, const N: usize>(
        &self,
        f: &SMatrix<f64, D, D>,
        gradients: &[[f64; D]; N],
        weight: f64,
        upper: &mut [[[f64; D]; D]],
    ) {
        self.law.element_stiffness(f, gradients, weight, upper);
    }

    /// The same for a group of elements.
    ///
    /// # Panics
    /// If `upper` does not hold `N (N + 1) / 2` blocks.
    #[inline(always)]
    pub fn element_damping_lanes<const D: usize, const N: usize>(
        &self,
        f: &[[Lane; D]; D],
        gradients: &[[Lane; D]; N],
        weight: &Lane,
        upper: &mut [[[Lane; D]; D]],
    ) {
        self.law.element_stiffness_lanes(f, gradients, weight, false, upper);
    }
}
