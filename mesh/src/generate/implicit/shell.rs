//! A layer around the surface of a shape.

use super::{Implicit, ShapeError, error};

/// All points within given distances of the surface of a shape, inside and outside of it.
///
/// As thick as said where the shape gives its true distance; near a dent of a union, or an outer edge of an intersection,
/// it is thicker. The distance is that of the shape, but for its sign and a shift.
#[derive(Clone, Debug, PartialEq)]
pub struct Shell<S> {
    shape: S,
    inside: f64,
    outside: f64,
}

impl<S: Implicit> Shell<S> {
    /// The layer from `inside` below the surface of `shape` to `outside` above it, m; one of the two may be zero.
    ///
    /// # Errors
    /// A thickness that is negative, or not finite; both zero.
    pub fn new(shape: S, inside: f64, outside: f64) -> Result<Self, ShapeError> {
        for (name, value) in [("the thickness inside", inside), ("the thickness outside", outside)] {
            if value != 0.0 {
                error::length(name, value)?;
            }
        }
        error::length("the thickness", inside + outside)?;
        Ok(Self { shape, inside, outside })
    }
}

impl<S: Implicit> Implicit for Shell<S> {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let d = self.shape.distance(p);
        (d - self.outside).max(-self.inside - d)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.shape.bounds_within(self.outside)
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        self.shape.bounds_within(self.outside + level)
    }
}
