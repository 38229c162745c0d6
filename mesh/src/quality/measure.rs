//! The measures of quality by name: where their bins lie, and from where on a cell counts as bad.

use super::{CellQuality, Histogram};
use serde::Serialize;

/// A number that says how well shaped a cell is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Every angle between two facets: dihedral in 3D, at the vertices in 2D; degrees.
    Angle,
    /// The smallest of a cell, degrees.
    MinAngle,
    /// The largest of a cell, degrees.
    MaxAngle,
    /// [`normalized_volume`](super::normalized_volume): 1 for the regular simplex, negative for an inverted cell.
    Quality,
    /// Longest edge over the diameter of the inscribed sphere.
    Aspect,
    /// Circumradius over shortest edge.
    RadiusEdge,
}

/// On which side of a limit the bad values lie.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Below it, or equal.
    Below,
    /// Above it, or equal.
    Above,
}

impl Measure {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Angle, Self::MinAngle, Self::MaxAngle, Self::Quality, Self::Aspect, Self::RadiusEdge];

    /// Its name, with the unit if it has one, for cells of `n` vertices.
    pub fn name(self, n: usize) -> &'static str {
        match (self, n) {
            (Self::Angle, 3) => "angle (deg)",
            (Self::Angle, _) => "dihedral angle (deg)",
            (Self::MinAngle, _) => "smallest angle (deg)",
            (Self::MaxAngle, _) => "largest angle (deg)",
            (Self::Quality, _) => "quality q",
            (Self::Aspect, _) => "aspect ratio",
            (Self::RadiusEdge, _) => "radius-edge ratio",
        }
    }

    /// Whether cells of `n` vertices have it: segments have no angles.
    pub fn is_defined(self, n: usize) -> bool {
        n > 2 || !matches!(self, Self::Angle | Self::MinAngle | Self::MaxAngle)
    }

    /// Its value for a cell; `None` if a cell has several.
    pub fn of(self, cell: &CellQuality) -> Option<f64> {
        match self {
            Self::Angle => None,
            Self::MinAngle => Some(cell.min_angle_deg),
            Self::MaxAngle => Some(cell.max_angle_deg),
            Self::Quality => Some(cell.quality),
            Self::Aspect => Some(cell.aspect),
            Self::RadiusEdge => Some(cell.radius_edge),
        }
    }

    /// The side on which the bad values lie; angles of all sorts are bad on both.
    pub fn bad_side(self) -> Option<Side> {
        match self {
            Self::Angle => None,
            Self::MinAngle | Self::Quality => Some(Side::Below),
            Self::MaxAngle | Self::Aspect | Self::RadiusEdge => Some(Side::Above),
        }
    }

    /// Limits beyond which values are counted.
    ///
    /// Angles of 10 and 160 degrees bound what needle remeshing is known to keep (Chentanez et al. 2009); aspect ratios of
    /// 15 and radius-edge ratios of 2 are those of Goksel's Table 3.1 (2004).
    pub fn limits(self) -> &'static [(Side, f64)] {
        use Side::{Above, Below};
        match self {
            Self::Angle => &[(Below, 10.0), (Below, 20.0), (Above, 150.0), (Above, 160.0)],
            Self::MinAngle => &[(Below, 10.0), (Below, 20.0)],
            Self::MaxAngle => &[(Above, 150.0), (Above, 160.0)],
            Self::Quality => &[(Below, 0.0), (Below, 0.1), (Below, 0.3)],
            Self::Aspect => &[(Above, 5.0), (Above, 15.0)],
            Self::RadiusEdge => &[(Above, 1.0), (Above, 2.0)],
        }
    }

    /// Empty bins that suit it: 5 degrees wide for angles.
    pub fn bins(self) -> Histogram {
        match self {
            Self::Angle => Histogram::new(0.0, 180.0, 36),
            Self::MinAngle => Histogram::new(0.0, 90.0, 18),
            Self::MaxAngle => Histogram::new(60.0, 180.0, 24),
            Self::Quality => Histogram::new(0.0, 1.0, 20),
            Self::Aspect => Histogram::new(1.0, 16.0, 30),
            Self::RadiusEdge => Histogram::new(0.5, 3.0, 25),
        }
    }
}

impl Side {
    /// Whether `x` lies on this side of `limit`, or on it.
    pub fn holds(self, x: f64, limit: f64) -> bool {
        match self {
            Self::Below => x <= limit,
            Self::Above => x >= limit,
        }
    }
}
