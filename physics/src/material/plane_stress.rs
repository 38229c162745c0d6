//! Plane stress: thin slabs whose thickness adjusts until `S33 = 0`.

use super::neo_hookean::{Volumetric, inverse_transpose};
use super::st_venant_kirchhoff::green_strain;
use super::{Corotated, Hyperelastic, Lame, Linear, NeoHookean, StVenantKirchhoff, Tangent};
use crate::lanes::Lane;
use crate::small::{cofactor, determinant, determinant_minus_one};
use crate::svd::signed_svd;
use nalgebra::{Matrix2, SMatrix};
use serde::{Deserialize, Serialize};

/// The dimensions of a plane, by a name that macros take.
pub(super) const PLANE: usize = 2;

/// A two-dimensional law from a solid: for each in-plane `F~` the thickness stretch `q = F33` solves `S33 = 0`, and the
/// energy is that of the solid at `diag(F~, q)`. Because `dW/dq = 0` there, no derivative of `q` enters the stress, and
/// one enters the tangent.
///
/// | solid | `q` |
/// |---|---|
/// | [`Linear`] | `1 - lambda/(lambda + 2 mu) tr e~` |
/// | [`StVenantKirchhoff`] | `q^2 = 1 - 2 lambda/(lambda + 2 mu) tr G~`; outside the domain where this is not positive |
/// | [`NeoHookean`] | positive root of `mu (q - 1/q) + lambda (J2 q - 1) J2 = 0` |
/// | [`Corotated`] | `1 - lambda/(lambda + 2 mu) tr(R^T F~ - I)` |
/// | [`FixedCorotated`](super::FixedCorotated), [`StableNeoHookean`](super::StableNeoHookean), [`Invertible`](super::Invertible) | by Newton's method on the principal stretches |
/// | [`Solid`](super::Solid) | as the law that it is |
///
/// The first two and the corotated law are those of plane strain with `lambda* = 2 mu lambda/(lambda + 2 mu)`.
///
/// What is defined for every `F` stays so. In an inverted triangle it is the smaller stretch *in the plane* that takes the
/// sign of `det F~`, and the thickness, which would rather turn over, must not: `q` minimises the energy over `q >= 0`.
/// Where that minimum is `q = 0` (an inverted triangle, or a sheet of the continued St. Venant-Kirchhoff law drawn out in
/// both directions) no positive root exists: the thickness is used up, and `S33 > 0` is held by nothing. Linear and
/// corotated solids, linear in `q`, go on to negative values there. [`thickness_stretch`](Self::thickness_stretch) tells.
///
/// Sources: Nienhuys (2003), section 6.1; its (6.3) is corrected here (it prints a modulus for a ratio). The tangent by
/// static condensation: de Borst (1991), *The zero-normal-stress condition in plane-stress and shell elastoplasticity*.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaneStress<M> {
    pub(super) solid: M,
}

impl<M> PlaneStress<M> {
    /// The plane-stress law of `solid`.
    pub fn new(solid: M) -> Self {
        Self { solid }
    }

    /// The solid.
    pub fn solid(&self) -> &M {
        &self.solid
    }
}

impl PlaneStress<Linear> {
    fn reduced(&self) -> Linear {
        Linear { lame: self.solid.lame.plane_stress() }
    }

    /// Thickness stretch `q` at the in-plane deformation gradient `f`.
    pub fn thickness_stretch(&self, f: &Matrix2<f64>) -> f64 {
        1.0 - ratio(&self.solid.lame) * (f - Matrix2::identity()).trace()
    }
}

impl PlaneStress<StVenantKirchhoff> {
    #[inline(always)]
    fn reduced(&self) -> StVenantKirchhoff {
        StVenantKirchhoff { lame: self.solid.lame.plane_stress() }
    }

    #[inline(always)]
    fn thickness_squared(&self, f: &Matrix2<f64>) -> f64 {
        1.0 - 2.0 * ratio(&self.solid.lame) * green_strain(&(f - Matrix2::identity())).trace()
    }

    /// Thickness stretch `q` at the in-plane deformation gradient `f`; NaN where the law has none.
    pub fn thickness_stretch(&self, f: &Matrix2<f64>) -> f64 {
        self.thickness_squared(f).sqrt()
    }
}

impl PlaneStress<Corotated> {
    #[inline(always)]
    fn reduced(&self) -> Corotated {
        Corotated { lame: self.solid.lame.plane_stress(), ..self.solid }
    }

    /// Thickness stretch `q` at the in-plane deformation gradient `f`; not positive where nothing of it is left.
    pub fn thickness_stretch(&self, f: &Matrix2<f64>) -> f64 {
        let [a, b] = signed_svd(f).sigma;
        1.0 - ratio(&self.solid.lame) * ((a - 1.0) + (b - 1.0))
    }
}

/// `lambda / (lambda + 2 mu)`.
#[inline(always)]
fn ratio(lame: &Lame) -> f64 {
    lame.lambda() / (lame.lambda() + 2.0 * lame.mu())
}

impl PlaneStress<NeoHookean> {
    /// Thickness stretch `q` at the in-plane deformation gradient `f`.
    pub fn thickness_stretch(&self, f: &Matrix2<f64>) -> f64 {
        self.stretch(determinant(f))
    }

    /// The positive root of `(1 + k J2^2) q^2 - k J2 q - 1 = 0`, `k = lambda/mu`.
    #[inline(always)]
    fn stretch(&self, j2: f64) -> f64 {
        let k = self.solid.lame.lambda() / self.solid.lame.mu();
        if k == 0.0 {
            return 1.0;
        }
        let (b, a) = (k * j2, 1.0 + k * j2 * j2);
        (b + (b * b + 4.0 * a).sqrt()) / (2.0 * a)
    }

    /// `s = J U'(J) = -mu q^2` by the equation of `q`, and `J2 ds/dJ2 = -2 mu q J2 dq/dJ2`.
    #[inline(always)]
    fn volumetric(&self, j2: f64) -> Volumetric {
        let (mu, q) = (self.solid.lame.mu(), self.stretch(j2));
        let k = self.solid.lame.lambda() / mu;
        let dq = -k * (2.0 * j2 * q - 1.0) / (1.0 + 1.0 / (q * q) + k * j2 * j2);
        Volumetric { stress: -mu * q * q, slope: -2.0 * mu * q * j2 * dq }
    }
}

/// A law that is the one of plane strain with other constants, for every `F~`.
macro_rules! reduced_law {
    ($solid:ty) => {
        impl Hyperelastic<2> for PlaneStress<$solid> {
            const IS_LINEAR: bool = <$solid as Hyperelastic<2>>::IS_LINEAR;
            const REQUIRES_POSITIVE_J: bool = false;

            #[inline(always)]
            fn energy_density(&self, f: &Matrix2<f64>) -> f64 {
                self.reduced().energy_density(f)
            }
            #[inline(always)]
            fn first_piola_kirchhoff(&self, f: &Matrix2<f64>) -> Matrix2<f64> {
                self.reduced().first_piola_kirchhoff(f)
            }
            #[inline(always)]
            fn stress_differential(&self, f: &Matrix2<f64>, df: &Matrix2<f64>) -> Matrix2<f64> {
                self.reduced().stress_differential(f, df)
            }
            fn projected_tangent(&self, f: &Matrix2<f64>) -> Tangent<2> {
                self.reduced().projected_tangent(f)
            }
            #[inline(always)]
            fn element_stiffness<const N: usize>(
                &self,
                f: &Matrix2<f64>,
                gradients: &[[f64; 2]; N],
                weight: f64,
                upper: &mut [[[f64; 2]; 2]],
            ) {
                self.reduced().element_stiffness(f, gradients, weight, upper);
            }
            #[inline(always)]
            fn energy_lanes(&self, f: &[[Lane; 2]; 2]) -> Lane {
                self.reduced().energy_lanes(f)
            }
            #[inline(always)]
            fn stress_lanes(&self, f: &[[Lane; 2]; 2]) -> [[Lane; 2]; 2] {
                self.reduced().stress_lanes(f)
            }
            #[inline(always)]
            fn element_stiffness_lanes<const N: usize>(
                &self,
                f: &[[Lane; 2]; 2],
                gradients: &[[Lane; 2]; N],
                weight: &Lane,
                project: bool,
                upper: &mut [[[Lane; 2]; 2]],
            ) {
                self.reduced().element_stiffness_lanes(f, gradients, weight, project, upper);
            }
        }
    };
}
reduced_law!(Linear);
reduced_law!(Corotated);

impl Hyperelastic<2> for PlaneStress<StVenantKirchhoff> {
    #[inline(always)]
    fn energy_density(&self, f: &Matrix2<f64>) -> f64 {
        if self.thickness_squared(f) > 0.0 { self.reduced().energy_density(f) } else { f64::INFINITY }
    }
    #[inline(always)]
    fn first_piola_kirchhoff(&self, f: &Matrix2<f64>) -> Matrix2<f64> {
        let inside = if self.thickness_squared(f) > 0.0 { 1.0 } else { f64::NAN };
        self.reduced().first_piola_kirchhoff(f) * inside
    }
    #[inline(always)]
    fn stress_differential(&self, f: &Matrix2<f64>, df: &Matrix2<f64>) -> Matrix2<f64> {
        self.reduced().stress_differential(f, df)
    }
    #[inline(always)]
    fn element_stiffness<const N: usize>(
        &self,
        f: &Matrix2<f64>,
        gradients: &[[f64; 2]; N],
        weight: f64,
        upper: &mut [[[f64; 2]; 2]],
    ) {
        self.reduced().element_stiffness(f, gradients, weight, upper);
    }
}

impl Hyperelastic<2> for PlaneStress<NeoHookean> {
    #[inline(always)]
    fn energy_density(&self, f: &Matrix2<f64>) -> f64 {
        let (mu, lambda) = (self.solid.lame.mu(), self.solid.lame.lambda());
        let h = f - Matrix2::identity();
        let dj2 = determinant_minus_one(&h);
        let dq = self.stretch(1.0 + dj2) - 1.0;
        let dj = dj2 + dq + dj2 * dq;
        let isochoric = h.trace() + 0.5 * h.norm_squared() + dq + 0.5 * dq * dq;
        let energy = mu * (isochoric - dj2.ln_1p() - dq.ln_1p()) + 0.5 * lambda * dj * dj;
        if 1.0 + dj2 > 0.0 && !energy.is_nan() { energy } else { f64::INFINITY }
    }

    /// `P~ = mu (F~ - q^2 F~^-T)`: the volumetric term is eliminated by the equation of `q`.
    #[inline(always)]
    fn first_piola_kirchhoff(&self, f: &Matrix2<f64>) -> Matrix2<f64> {
        let j2 = determinant(f);
        let q = self.stretch(j2);
        let ratio = if j2 > 0.0 { q * q / j2 } else { f64::NAN };
        (f - cofactor(f) * ratio) * self.solid.lame.mu()
    }

    #[inline(always)]
    fn stress_differential(&self, f: &Matrix2<f64>, df: &Matrix2<f64>) -> Matrix2<f64> {
        let (j2, inverse) = inverse_transpose(f);
        self.volumetric(j2).stress_differential(self.solid.lame.mu(), &inverse, df)
    }

    #[inline(always)]
    fn element_stiffness<const N: usize>(
        &self,
        f: &SMatrix<f64, 2, 2>,
        gradients: &[[f64; 2]; N],
        weight: f64,
        upper: &mut [[[f64; 2]; 2]],
    ) {
        let (j2, inverse) = inverse_transpose(f);
        self.volumetric(j2).element_stiffness(self.solid.lame.mu(), &inverse, gradients, weight, upper);
    }
}
