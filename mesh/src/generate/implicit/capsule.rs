//! A capsule.

use super::{Implicit, ShapeError, around, error};
use crate::geometry::{dot, norm, subtract};

/// All points within a radius of a segment, by their true distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Capsule {
    ends: [[f64; 3]; 2],
    /// From the first end to the second.
    along: [f64; 3],
    radius: f64,
}

impl Capsule {
    /// The capsule around the segment from `start` to `end`, whose ends are half balls, m.
    ///
    /// # Errors
    /// An end that is not finite, a radius or a length that is not positive; all within 1e12 m.
    pub fn new(start: [f64; 3], end: [f64; 3], radius: f64) -> Result<Self, ShapeError> {
        let ends = [error::point("the start", start)?, error::point("the end", end)?];
        let along = subtract(&end, &start);
        error::length("the distance of the ends", norm(&along))?;
        Ok(Self { ends, along, radius: error::length("the radius", radius)? })
    }
}

impl Implicit for Capsule {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let q = subtract(p, &self.ends[0]);
        let t = (dot(&q, &self.along) / dot(&self.along, &self.along)).clamp(0.0, 1.0);
        norm(&std::array::from_fn::<f64, 3, _>(|i| q[i] - t * self.along[i])) - self.radius
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        Some(around(&self.ends, self.radius))
    }
}
