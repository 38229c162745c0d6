//! The rigid needle: a straight shaft that ends in a tip.

use crate::motion::Pose;
use serde::{Deserialize, Serialize};

/// A point or vector of the plane, m.
pub type Vec2 = [f64; 2];

/// `a + s b`.
#[inline]
pub(crate) fn along(a: Vec2, s: f64, b: Vec2) -> Vec2 {
    [a[0] + s * b[0], a[1] + s * b[1]]
}

/// `a - b`.
#[inline]
pub(crate) fn minus(a: Vec2, b: Vec2) -> Vec2 {
    [a[0] - b[0], a[1] - b[1]]
}

/// `a . b`.
#[inline]
pub(crate) fn dot(a: Vec2, b: Vec2) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The z component of `a x b`.
#[inline]
pub(crate) fn cross(a: Vec2, b: Vec2) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// A rigid needle in space. The shaft reaches from the tip backwards without end; the base is the point of the shaft that
/// stood at the entry before the insertion began.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Needle {
    entry: Vec2,
    tangent: Vec2,
    pose: Pose,
}

/// A point in the needle's frame (Fig 6.5 of Nienhuys, 2003).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct OnNeedle {
    /// Distance behind the tip along the shaft, m; negative ahead of the tip.
    pub behind: f64,
    /// Distance from the shaft's axis, positive to its left, m: d_perp.
    pub perpendicular: f64,
}

impl Needle {
    /// A needle about to enter at `entry`, at `angle` (rad) from the x axis.
    pub fn new(entry: Vec2, angle: f64) -> Self {
        // The axes are hit exactly, so that a needle along a mesh line stays on it to the last bit.
        let tangent = if angle == 0.0 { [1.0, 0.0] } else { [angle.cos(), angle.sin()] };
        Self { entry, tangent, pose: Pose::default() }
    }

    /// The unit vector from base to tip.
    #[inline]
    pub fn tangent(&self) -> Vec2 {
        self.tangent
    }

    /// The unit vector to the left of the shaft.
    #[inline]
    pub fn normal(&self) -> Vec2 {
        [-self.tangent[1], self.tangent[0]]
    }

    /// The pose of the base.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Moves the base.
    pub fn set_pose(&mut self, pose: Pose) {
        self.pose = pose;
    }

    /// The tip, m.
    #[inline]
    pub fn tip(&self) -> Vec2 {
        let foot = along(self.entry, self.pose.sleeve, self.normal());
        along(foot, self.pose.insert, self.tangent)
    }

    /// The point where the shaft is held: where it crosses the plane of the entry, m. Moments refer to it.
    pub fn base(&self) -> Vec2 {
        along(self.entry, self.pose.sleeve, self.normal())
    }

    /// A point of space in the needle's frame.
    #[inline]
    pub fn frame_of(&self, point: Vec2) -> OnNeedle {
        let from_tip = minus(point, self.tip());
        OnNeedle { behind: -dot(from_tip, self.tangent), perpendicular: dot(from_tip, self.normal()) }
    }

    /// The point of space at a place in the needle's frame.
    #[inline]
    pub fn point_at(&self, place: OnNeedle) -> Vec2 {
        along(along(self.tip(), -place.behind, self.tangent), place.perpendicular, self.normal())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_needle_frame_round_trips() {
        let mut needle = Needle::new([0.0, 0.045], 0.087);
        needle.set_pose(Pose { insert: 0.03, sleeve: -0.002 });
        let point = [0.0123, 0.0456];
        let back = needle.point_at(needle.frame_of(point));
        assert!((back[0] - point[0]).abs() < 1e-16 && (back[1] - point[1]).abs() < 1e-16);
        assert!(needle.frame_of(needle.tip()).behind.abs() < 1e-17);
        assert!((needle.frame_of(needle.base()).behind - 0.03).abs() < 1e-16);
    }
}
