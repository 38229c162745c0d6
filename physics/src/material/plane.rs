//! A law of two dimensions whose state across the plane is chosen at run time.

use super::plane_stress::{PLANE, PlaneStress};
use super::{Hyperelastic, Tangent};
use crate::lanes::Lane;
use nalgebra::SMatrix;

/// What holds across the plane of a body: like [`Solid`](super::Solid), a choice at the cost of a question per group of
/// elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plane<M> {
    /// No strain: a slice of a long body.
    Strain(M),
    /// No stress: a thin sheet.
    Stress(PlaneStress<M>),
}

/// Evaluates an expression with the law in a variable.
macro_rules! with_either {
    ($plane:expr, $law:ident => $body:expr) => {
        match $plane {
            Plane::Strain($law) => $body,
            Plane::Stress($law) => $body,
        }
    };
}

impl<M: Hyperelastic<PLANE>> Hyperelastic<PLANE> for Plane<M>
where
    PlaneStress<M>: Hyperelastic<PLANE>,
{
    const IS_LINEAR: bool = M::IS_LINEAR;
    fn requires_positive_j(&self) -> bool {
        with_either!(self, law => Hyperelastic::<PLANE>::requires_positive_j(law))
    }

    #[inline(always)]
    fn energy_density(&self, f: &SMatrix<f64, PLANE, PLANE>) -> f64 {
        with_either!(self, law => law.energy_density(f))
    }

    #[inline(always)]
    fn first_piola_kirchhoff(&self, f: &SMatrix<f64, PLANE, PLANE>) -> SMatrix<f64, PLANE, PLANE> {
        with_either!(self, law => law.first_piola_kirchhoff(f))
    }

    fn stress_differential(
        &self,
        f: &SMatrix<f64, PLANE, PLANE>,
        df: &SMatrix<f64, PLANE, PLANE>,
    ) -> SMatrix<f64, PLANE, PLANE> {
        with_either!(self, law => law.stress_differential(f, df))
    }

    fn tangent(&self, f: &SMatrix<f64, PLANE, PLANE>) -> Tangent<PLANE> {
        with_either!(self, law => law.tangent(f))
    }

    fn projected_tangent(&self, f: &SMatrix<f64, PLANE, PLANE>) -> Tangent<PLANE> {
        with_either!(self, law => law.projected_tangent(f))
    }

    fn element_stiffness<const N: usize>(
        &self,
        f: &SMatrix<f64, PLANE, PLANE>,
        gradients: &[[f64; PLANE]; N],
        weight: f64,
        upper: &mut [[[f64; PLANE]; PLANE]],
    ) {
        with_either!(self, law => law.element_stiffness(f, gradients, weight, upper));
    }

    #[inline(always)]
    fn energy_lanes(&self, f: &[[Lane; PLANE]; PLANE]) -> Lane {
        with_either!(self, law => law.energy_lanes(f))
    }

    #[inline(always)]
    fn stress_lanes(&self, f: &[[Lane; PLANE]; PLANE]) -> [[Lane; PLANE]; PLANE] {
        with_either!(self, law => law.stress_lanes(f))
    }

    #[inline(always)]
    fn stress_groups(&self, groups: &mut [[[Lane; PLANE]; PLANE]]) {
        with_either!(self, law => law.stress_groups(groups));
    }

    #[inline(always)]
    fn element_stiffness_lanes<const N: usize>(
        &self,
        f: &[[Lane; PLANE]; PLANE],
        gradients: &[[Lane; PLANE]; N],
        weight: &Lane,
        project: bool,
        upper: &mut [[[Lane; PLANE]; PLANE]],
    ) {
        with_either!(self, law => law.element_stiffness_lanes(f, gradients, weight, project, upper));
    }
}
