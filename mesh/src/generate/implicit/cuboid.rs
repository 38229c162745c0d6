//! A box.

use super::{Implicit, ShapeError, error};
use crate::geometry::norm;

/// A box with its edges along the coordinates, by its true distance; see [`Placed`](super::Placed) for others.
#[derive(Clone, Debug, PartialEq)]
pub struct Cuboid {
    low: [f64; 3],
    high: [f64; 3],
}

impl Cuboid {
    /// The box between two corners, m.
    ///
    /// # Errors
    /// Corners that are not finite, or not apart along every axis, `low` first; all within 1e12 m.
    pub fn new(low: [f64; 3], high: [f64; 3]) -> Result<Self, ShapeError> {
        let (low, high) = (error::point("the lowest corner", low)?, error::point("the highest corner", high)?);
        for (i, name) in ["the length along x", "the length along y", "the length along z"].into_iter().enumerate() {
            error::length(name, high[i] - low[i])?;
        }
        Ok(Self { low, high })
    }
}

impl Implicit for Cuboid {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let beyond: [f64; 3] = std::array::from_fn(|i| (self.low[i] - p[i]).max(p[i] - self.high[i]));
        norm(&beyond.map(|x| x.max(0.0))) + beyond[0].max(beyond[1]).max(beyond[2]).min(0.0)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        Some([self.low, self.high])
    }
}
