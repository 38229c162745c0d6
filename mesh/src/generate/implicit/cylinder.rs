//! A cylinder with flat ends.

use super::{Implicit, ShapeError, around, error};
use crate::geometry::{dot, norm, subtract};

/// A circular cylinder with flat ends, by its true distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Cylinder {
    ends: [[f64; 3]; 2],
    /// Unit vector from the first end to the second.
    axis: [f64; 3],
    length: f64,
    radius: f64,
}

impl Cylinder {
    /// The cylinder whose axis runs from `start` to `end`, m.
    ///
    /// # Errors
    /// An end that is not finite, a radius or a length that is not positive; all within 1e12 m.
    pub fn new(start: [f64; 3], end: [f64; 3], radius: f64) -> Result<Self, ShapeError> {
        let ends = [error::point("the start", start)?, error::point("the end", end)?];
        let along = subtract(&end, &start);
        let length = error::length("the distance of the ends", norm(&along))?;
        Ok(Self { ends, axis: along.map(|x| x / length), length, radius: error::length("the radius", radius)? })
    }
}

impl Implicit for Cylinder {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let q = subtract(p, &self.ends[0]);
        let height = dot(&q, &self.axis);
        let radial = norm(&std::array::from_fn::<f64, 3, _>(|i| q[i] - height * self.axis[i]));
        let beyond = [radial - self.radius, (-height).max(height - self.length)];
        norm(&beyond.map(|x| x.max(0.0))) + beyond[0].max(beyond[1]).min(0.0)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let [low, high] = around(&self.ends, 0.0);
        // How far a disc across the axis reaches along each coordinate.
        let reach = self.axis.map(|a| self.radius * (1.0 - a * a).max(0.0).sqrt());
        Some([std::array::from_fn(|i| low[i] - reach[i]), std::array::from_fn(|i| high[i] + reach[i])])
    }
}
