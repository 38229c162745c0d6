//! What can be wrong with drawn contours: refused, or repaired and said so.

use serde::Serialize;
use std::fmt;

/// Messages list up to this many faults.
const SHOWN: usize = 8;

/// Why contours were refused: every fault that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct ContourError {
    /// The faults, organ by organ; never empty.
    pub faults: Vec<Fault>,
}

impl std::error::Error for ContourError {}

impl fmt::Display for ContourError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.faults.iter().take(SHOWN).enumerate() {
            write!(f, "{}{fault}", if i > 0 { "; " } else { "" })?;
        }
        match self.faults.len().saturating_sub(SHOWN) {
            0 => Ok(()),
            more => write!(f, "; and {more} more faults"),
        }
    }
}

impl From<Fault> for ContourError {
    fn from(fault: Fault) -> Self {
        Self { faults: vec![fault] }
    }
}

/// One fault that cannot be repaired without guessing. Contours are named by their organ and their place in its drawing,
/// from zero; lengths are metres.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// A setting out of range.
    #[error("{name} is {value}, expected {expected}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// A set without organs.
    #[error("no organ, expected at least one")]
    NoOrgans,
    /// Two organs of one name.
    #[error("organ {organ:?} stands in the set twice")]
    RepeatedOrgan {
        /// The name.
        organ: String,
    },
    /// An organ without a contour, or with none left after repair.
    #[error("organ {organ:?} has no contour of at least three points that enclose an area")]
    NoContours {
        /// The organ.
        organ: String,
    },
    /// One slice does not say how thick an organ is.
    #[error("organ {organ:?} has contours at z = {z} m only, expected two slices or more, or a thickness")]
    SingleSlice {
        /// The organ.
        organ: String,
        /// The plane.
        z: f64,
    },
    /// A coordinate that is not a number, or absurd.
    #[error(
        "organ {organ:?}, contour {contour}, point {point}: {value} m, expected a number within 1e6 m of the origin"
    )]
    Coordinate {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// The point.
        point: usize,
        /// The coordinate.
        value: f64,
    },
    /// More points than one contour can have.
    #[error("organ {organ:?}, contour {contour} has {found} points, expected at most {limit}")]
    TooManyPoints {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// Its points.
        found: usize,
        /// The most there may be.
        limit: usize,
    },
    /// More contours than one slice can have.
    #[error("organ {organ:?} has {found} contours at z = {z} m, expected at most {limit}")]
    TooManyContours {
        /// The organ.
        organ: String,
        /// The plane.
        z: f64,
        /// Its contours.
        found: usize,
        /// The most there may be.
        limit: usize,
    },
    /// A contour that does not lie in a plane `z = const`.
    #[error("organ {organ:?}, contour {contour} runs from z = {lowest} to {highest} m, expected one plane")]
    NotPlanar {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// Its lowest point.
        lowest: f64,
        /// Its highest point.
        highest: f64,
    },
    /// A contour that its source calls open, or whose ends stand far apart.
    #[error(
        "organ {organ:?}, contour {contour} is open: {gap} m between its ends, at most {longest} m between neighbours"
    )]
    Open {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// Distance from the last point to the first.
        gap: f64,
        /// The longest other edge.
        longest: f64,
    },
    /// A contour that crosses itself or runs back on itself.
    #[error(
        "organ {organ:?}, contour {contour}: the edges from ({}, {}) and from ({}, {}) m at z = {z} m cross or overlap",
        edges[0][0], edges[0][1], edges[1][0], edges[1][1]
    )]
    SelfIntersecting {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// Where the two edges start.
        edges: [[f64; 2]; 2],
        /// The plane.
        z: f64,
    },
    /// Two contours of one organ on one slice that cross each other or share a stretch.
    #[error("organ {organ:?}: contours {} and {} at z = {z} m cross or overlap near ({}, {}) m", contours[0], contours[1], near[0], near[1])]
    Overlapping {
        /// The organ.
        organ: String,
        /// The contours.
        contours: [usize; 2],
        /// Where an edge of the first starts that crosses the second.
        near: [f64; 2],
        /// The plane.
        z: f64,
    },
}

/// What was changed in a drawing, or assumed of it, so that a solid could be made.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Repair {
    /// Points that repeat the one before, or go out and straight back, were removed. A first point repeated as the last is
    /// no fault and not counted.
    DuplicatePoints {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// How many points went.
        removed: usize,
    },
    /// Points closer than the culling threshold were removed.
    Culled {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// How many points went.
        removed: usize,
    },
    /// Points out of order were put in order: runs of up to three points whose edges crossed were turned round.
    Reordered {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// How many runs.
        runs: usize,
    },
    /// A contour with fewer than three different points, or that encloses no area, was left out.
    Degenerate {
        /// The organ.
        organ: String,
        /// The contour.
        contour: usize,
        /// Its different points.
        points: usize,
    },
    /// A contour drawn twice was left out the second time.
    RepeatedContour {
        /// The organ.
        organ: String,
        /// The contour left out.
        contour: usize,
        /// The one that it repeats.
        of: usize,
    },
    /// Slices at unequal distances: the organ is interpolated across the larger ones.
    UnequalSpacing {
        /// The organ.
        organ: String,
        /// The smallest distance, m.
        smallest: f64,
        /// The largest, m.
        largest: f64,
    },
    /// The organ has one slice, and was given the thickness in the settings.
    SingleSlice {
        /// The organ.
        organ: String,
        /// The plane, m.
        z: f64,
        /// The thickness, m.
        thickness: f64,
    },
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DuplicatePoints { organ, contour, removed } => {
                write!(f, "organ {organ:?}, contour {contour}: removed {removed} duplicate points")
            }
            Self::Culled { organ, contour, removed } => {
                write!(f, "organ {organ:?}, contour {contour}: culled {removed} points")
            }
            Self::Reordered { organ, contour, runs } => {
                write!(f, "organ {organ:?}, contour {contour}: put {runs} runs of points in order")
            }
            Self::Degenerate { organ, contour, points } => {
                write!(f, "organ {organ:?}, contour {contour}: left out, its {points} points enclose no area")
            }
            Self::RepeatedContour { organ, contour, of } => {
                write!(f, "organ {organ:?}, contour {contour}: left out, it repeats contour {of}")
            }
            Self::UnequalSpacing { organ, smallest, largest } => {
                write!(f, "organ {organ:?}: slices {smallest} to {largest} m apart, interpolated across")
            }
            Self::SingleSlice { organ, z, thickness } => {
                write!(f, "organ {organ:?}: one slice, at z = {z} m, made {thickness} m thick")
            }
        }
    }
}
