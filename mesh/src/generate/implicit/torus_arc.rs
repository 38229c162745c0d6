//! A bent tube.

use super::{Implicit, ShapeError, around, error};
use crate::geometry::{cross, dot, norm, subtract};
use std::f64::consts::TAU;

/// All points within a radius of an arc of a circle: a torus, or a part of one with half balls at its ends.
///
/// The distance is true; inside, where the two ends overlap, it is that to the nearer of the two surfaces' sheets.
#[derive(Clone, Debug, PartialEq)]
pub struct TorusArc {
    centre: [f64; 3],
    /// Unit vectors: to the middle of the arc, across it in its plane, and the axis.
    frame: [[f64; 3]; 3],
    ring: f64,
    tube: f64,
    /// Half the angle of the arc.
    half: f64,
}

impl TorusArc {
    /// The tube of radius `tube` around an arc of radius `ring`, m, that runs about `axis` by the right-hand rule, from
    /// the direction `start` (its part across the axis) through `angle`, rad.
    ///
    /// # Errors
    /// Radii that are not positive, or `tube >= ring`; an angle that is not in (0, 2 pi]; an axis or a start without a
    /// direction, or along one line; a centre that is not finite.
    pub fn new(
        centre: [f64; 3],
        axis: [f64; 3],
        start: [f64; 3],
        angle: f64,
        ring: f64,
        tube: f64,
    ) -> Result<Self, ShapeError> {
        let (ring, tube) =
            (error::length("the radius of the ring", ring)?, error::length("the radius of the tube", tube)?);
        if tube >= ring {
            let expected = "less than the radius of the ring,";
            return Err(ShapeError::Relation { name: "the radius of the tube", value: tube, expected, other: ring });
        }
        if !(angle > 0.0 && angle <= TAU) {
            return Err(ShapeError::Angle { name: "the angle", value: angle, expected: "more than 0, at most 2 pi" });
        }
        let axis = error::direction("the axis", axis)?;
        let start = error::direction("the start", start)?;
        let along = dot(&start, &axis);
        let across: [f64; 3] = std::array::from_fn(|i| start[i] - along * axis[i]);
        if norm(&across) < 1e-9 {
            return Err(ShapeError::Direction { name: "the part of the start across the axis", value: across });
        }
        let u = error::direction("the start", across)?;
        let v = cross(&axis, &u);
        let (sin, cos) = (0.5 * angle).sin_cos();
        let middle = std::array::from_fn(|i| cos * u[i] + sin * v[i]);
        let frame = [middle, cross(&axis, &middle), axis];
        Ok(Self { centre: error::point("the centre", centre)?, frame, ring, tube, half: 0.5 * angle })
    }

    /// The point of the arc at an angle from its middle.
    fn at(&self, angle: f64) -> [f64; 3] {
        let (sin, cos) = angle.sin_cos();
        let [u, v, _] = &self.frame;
        std::array::from_fn(|i| self.centre[i] + self.ring * (cos * u[i] + sin * v[i]))
    }
}

impl Implicit for TorusArc {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let q = subtract(p, &self.centre);
        let [x, y, z] = self.frame.each_ref().map(|axis| dot(&q, axis));
        // The arc is its own mirror image, so only the end on the side of the point can be nearest.
        let y = y.abs();
        let off = if y.atan2(x) <= self.half {
            [x.hypot(y) - self.ring, 0.0, z]
        } else {
            let (sin, cos) = self.half.sin_cos();
            [x - self.ring * cos, y - self.ring * sin, z]
        };
        norm(&off) - self.tube
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        // The ends, and where the circle turns back along a coordinate.
        let mut extremes = vec![self.at(-self.half), self.at(self.half)];
        for i in 0..3 {
            let turn = self.frame[1][i].atan2(self.frame[0][i]);
            for angle in [turn, turn - TAU / 2.0, turn + TAU / 2.0] {
                if angle.abs() <= self.half {
                    extremes.push(self.at(angle));
                }
            }
        }
        Some(around(&extremes, self.tube))
    }
}
