//! What a scene asks of a law beyond its stress: the thickness of a sheet.

use nalgebra::{Matrix2, SMatrix};
use stylet_physics::material::{Hyperelastic, Linear, Plane, Solid};

/// A law that a body of a scene may be made of.
pub(super) trait Law<const D: usize>: Hyperelastic<D> {
    /// Stretch of the thickness at the deformation gradient `f`; `None` unless the law is one of plane stress. Where nothing
    /// is left of the thickness it is not positive, or NaN.
    fn thickness_stretch(&self, _f: &SMatrix<f64, D, D>) -> Option<f64> {
        None
    }
}

impl Law<3> for Linear {}
impl Law<3> for Solid {}

impl Law<2> for Plane<Linear> {
    fn thickness_stretch(&self, f: &Matrix2<f64>) -> Option<f64> {
        match self {
            Self::Strain(_) => None,
            Self::Stress(law) => Some(law.thickness_stretch(f)),
        }
    }
}

impl Law<2> for Plane<Solid> {
    fn thickness_stretch(&self, f: &Matrix2<f64>) -> Option<f64> {
        match self {
            Self::Strain(_) => None,
            Self::Stress(law) => Some(law.thickness_stretch(f)),
        }
    }
}
