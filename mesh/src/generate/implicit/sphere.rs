//! A ball.

use super::{Implicit, ShapeError, around, error};
use crate::geometry::{norm, subtract};

/// A ball, by its true distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    centre: [f64; 3],
    radius: f64,
}

impl Sphere {
    /// A ball of `radius`, m.
    ///
    /// # Errors
    /// A centre that is not finite, a radius that is not positive; both within 1e12 m.
    pub fn new(centre: [f64; 3], radius: f64) -> Result<Self, ShapeError> {
        Ok(Self { centre: error::point("the centre", centre)?, radius: error::length("the radius", radius)? })
    }
}

impl Implicit for Sphere {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        norm(&subtract(p, &self.centre)) - self.radius
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        Some(around(&[self.centre], self.radius))
    }
}
