//! A law of two dimensions whose state across the plane is chosen at run time.

use super::plane_stress::{PLANE, PlaneStress};
use super::solid::handed_on;
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
    handed_on!(PLANE, with_either);
}
