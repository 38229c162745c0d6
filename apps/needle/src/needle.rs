//! The rigid needle: a straight shaft that ends in a tip.

use crate::motion::Pose;
use serde::{Deserialize, Serialize};

/// A point or vector of the plane, m.
pub type Vec2 = [f64; 2];

/// `a + s b`.
#[inline]
pub(crate) fn along<const D: usize>(a: [f64; D], s: f64, b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] + s * b[k])
}

/// `a - b`.
#[inline]
pub(crate) fn minus<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// `a . b`.
#[inline]
pub(crate) fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (1..D).fold(a[0] * b[0], |sum, k| sum + a[k] * b[k])
}

/// The z component of `a x b`, for vectors of the plane.
#[inline]
pub(crate) fn cross<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// `a x b`; of two vectors of the plane the third component alone.
#[inline]
pub(crate) fn cross3<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; 3] {
    if D == 2 {
        return [0.0, 0.0, cross(a, b)];
    }
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], cross(a, b)]
}

/// A rigid needle in space. The shaft reaches from the tip backwards without end; the base is the point of the shaft that
/// stood at the entry before the insertion began.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Needle<const D: usize> {
    #[serde(with = "crate::array")]
    entry: [f64; D],
    #[serde(with = "crate::array")]
    tangent: [f64; D],
    pose: Pose,
}

/// A point in the needle's frame (Fig 6.5 of Nienhuys, 2003).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct OnNeedle {
    /// Distance behind the tip along the shaft, m; negative ahead of the tip.
    pub behind: f64,
    /// Distance from the shaft's axis to its left, m: d_perp in the plane.
    pub perpendicular: f64,
    /// Distance from the shaft's axis upwards, m; zero in the plane.
    pub above: f64,
}

impl OnNeedle {
    /// The distance from the shaft's axis, m.
    #[inline]
    pub fn from_axis(&self) -> f64 {
        self.perpendicular.hypot(self.above)
    }
}

/// The direction at `angle` (rad) from the x axis, raised by `elevation` (rad) out of the plane of the first two axes; in
/// the plane there is nothing to raise it to.
pub fn direction<const D: usize>(angle: f64, elevation: f64) -> [f64; D] {
    // The axes are hit exactly, so that a needle along a mesh line stays on it to the last bit.
    let (c, s) = if angle == 0.0 { (1.0, 0.0) } else { (angle.cos(), angle.sin()) };
    let mut tangent = [0.0; D];
    (tangent[0], tangent[1]) = (c, s);
    if D > 2 && elevation != 0.0 {
        (tangent[0], tangent[1], tangent[2]) = (c * elevation.cos(), s * elevation.cos(), elevation.sin());
    }
    tangent
}

impl<const D: usize> Needle<D> {
    const VALID: () = assert!(D == 2 || D == 3, "a needle is in the plane or in space");

    /// A needle about to enter at `entry`, in the direction of the unit vector `tangent`.
    pub fn new(entry: [f64; D], tangent: [f64; D]) -> Self {
        let () = Self::VALID;
        Self { entry, tangent, pose: Pose::default() }
    }

    /// The unit vector from base to tip.
    #[inline]
    pub fn tangent(&self) -> [f64; D] {
        self.tangent
    }

    /// The unit vector to the left of the shaft; in space level, and along the second axis for an upright needle.
    #[inline]
    pub fn normal(&self) -> [f64; D] {
        let t = self.tangent;
        let mut normal = [0.0; D];
        (normal[0], normal[1]) = (-t[1], t[0]);
        if D > 2 && t[2] != 0.0 {
            let level = t[0].hypot(t[1]);
            (normal[0], normal[1]) = if level > 1e-9 { (-t[1] / level, t[0] / level) } else { (0.0, 1.0) };
        }
        normal
    }

    /// In space the unit vector perpendicular to shaft and [`normal`](Self::normal), which points up.
    pub fn upward(&self) -> Option<[f64; D]> {
        if D == 2 {
            return None;
        }
        let up = cross3(self.tangent, self.normal());
        Some(std::array::from_fn(|k| up[k]))
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
    pub fn tip(&self) -> [f64; D] {
        along(self.base(), self.pose.insert, self.tangent)
    }

    /// The point where the shaft is held: where it crosses the plane of the entry, m. Moments refer to it.
    pub fn base(&self) -> [f64; D] {
        along(self.entry, self.pose.sleeve, self.normal())
    }

    /// A point of space in the needle's frame.
    #[inline]
    pub fn frame_of(&self, point: [f64; D]) -> OnNeedle {
        let from_tip = minus(point, self.tip());
        OnNeedle {
            behind: -dot(from_tip, self.tangent),
            perpendicular: dot(from_tip, self.normal()),
            above: self.upward().map_or(0.0, |up| dot(from_tip, up)),
        }
    }

    /// The point of space at a place in the needle's frame.
    #[inline]
    pub fn point_at(&self, place: OnNeedle) -> [f64; D] {
        let beside = along(along(self.tip(), -place.behind, self.tangent), place.perpendicular, self.normal());
        self.upward().map_or(beside, |up| along(beside, place.above, up))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_needle_frame_round_trips() {
        let mut needle = Needle::new([0.0, 0.045], direction(0.087, 0.0));
        needle.set_pose(Pose { insert: 0.03, sleeve: -0.002 });
        let point = [0.0123, 0.0456];
        let back = needle.point_at(needle.frame_of(point));
        assert!((back[0] - point[0]).abs() < 1e-16 && (back[1] - point[1]).abs() < 1e-16);
        assert!(needle.frame_of(needle.tip()).behind.abs() < 1e-17);
        assert!((needle.frame_of(needle.base()).behind - 0.03).abs() < 1e-16);
    }

    #[test]
    fn the_frame_in_space_is_right_handed_and_round_trips() {
        for (angle, elevation) in [(0.0, 0.0), (0.4, 0.0), (-2.0, 0.7), (0.3, -1.2), (0.0, std::f64::consts::FRAC_PI_2)]
        {
            let mut needle = Needle::<3>::new([0.0, 0.05, 0.04], direction(angle, elevation));
            needle.set_pose(Pose { insert: 0.03, sleeve: 0.002 });
            let (t, n, up) = (needle.tangent(), needle.normal(), needle.upward().unwrap());
            for (a, b, expected) in [(t, t, 1.0), (n, n, 1.0), (up, up, 1.0), (t, n, 0.0), (t, up, 0.0), (n, up, 0.0)] {
                assert!((dot(a, b) - expected).abs() < 1e-15);
            }
            assert!(dot(cross3(t, n), up) > 0.99 && n[2] == 0.0);
            let point = [0.0123, 0.0456, 0.031];
            let back = needle.point_at(needle.frame_of(point));
            assert!((0..3).all(|k| (back[k] - point[k]).abs() < 1e-16));
            let base = needle.frame_of(needle.base());
            assert!((base.behind - 0.03).abs() < 1e-16 && base.from_axis() < 1e-16);
        }
    }
}
