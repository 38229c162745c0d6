//! One side of a plane.

use super::{Implicit, ShapeError, error};
use crate::geometry::{dot, subtract};

/// All points on one side of a plane, by their true distance.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfSpace {
    point: [f64; 3],
    normal: [f64; 3],
}

impl HalfSpace {
    /// What lies below the plane through `point`, m, that `normal` points away from, of any length.
    ///
    /// # Errors
    /// A point that is not finite and within 1e12 m; a normal that is not finite, or zero.
    pub fn new(point: [f64; 3], normal: [f64; 3]) -> Result<Self, ShapeError> {
        Ok(Self { point: error::point("the point", point)?, normal: error::direction("the normal", normal)? })
    }
}

impl Implicit for HalfSpace {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        dot(&subtract(p, &self.point), &self.normal)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        None
    }
}
