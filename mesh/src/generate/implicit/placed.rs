//! A shape moved and turned.

use super::{Implicit, ShapeError, combine::hull_of, error};
use crate::geometry::dot;

/// A shape turned about the origin, then moved; its distances stay what they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed<S> {
    shape: S,
    /// Where the axes of the shape go.
    axes: [[f64; 3]; 3],
    shift: [f64; 3],
}

impl<S: Implicit> Placed<S> {
    /// `shape` turned about `axis` through the origin by `angle`, rad, by the right-hand rule, then moved by `shift`, m.
    ///
    /// # Errors
    /// An axis that is zero or not finite, an angle that is not finite, a shift that is not finite and within 1e12 m.
    pub fn new(shape: S, axis: [f64; 3], angle: f64, shift: [f64; 3]) -> Result<Self, ShapeError> {
        let shift = error::point("the shift", shift)?;
        let [x, y, z] = error::direction("the axis", axis)?;
        if !angle.is_finite() {
            return Err(ShapeError::Angle { name: "the angle", value: angle, expected: "a finite number" });
        }
        // Rodrigues' rotation formula, by columns.
        let (s, c) = angle.sin_cos();
        let t = 1.0 - c;
        let axes = [
            [t * x * x + c, t * x * y + s * z, t * x * z - s * y],
            [t * x * y - s * z, t * y * y + c, t * y * z + s * x],
            [t * x * z + s * y, t * y * z - s * x, t * z * z + c],
        ];
        Ok(Self { shape, axes, shift })
    }

    /// The smallest box around a box of the shape's own space, once placed.
    fn hull(&self, [low, high]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        let corner = |bits: usize| {
            let q: [f64; 3] = std::array::from_fn(|i| if bits >> i & 1 == 0 { low[i] } else { high[i] });
            let p = std::array::from_fn(|k| self.shift[k] + (0..3).map(|i| q[i] * self.axes[i][k]).sum::<f64>());
            [p, p]
        };
        (1..8).map(corner).fold(corner(0), hull_of)
    }
}

impl<S: Implicit> Implicit for Placed<S> {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let q = std::array::from_fn(|k| p[k] - self.shift[k]);
        self.shape.distance(&self.axes.each_ref().map(|axis| dot(axis, &q)))
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.bounds_within(0.0)
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        self.shape.bounds_within(level).map(|bounds| self.hull(bounds))
    }
}
