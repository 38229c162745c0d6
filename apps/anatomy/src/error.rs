//! What can be wrong with a file of contours, as values that name what was found and what was expected.

use std::{fmt, path::PathBuf};

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The system refused.
    #[error("{}: {source}", path.display())]
    System {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not what it should be.
    #[error("{}: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: Box<Problem>,
    },
}

/// Why a file could not be written. No file was left half written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The DICOM library refused.
    #[error("cannot encode the structure set: {0}")]
    Dicom(String),
    /// A name that the format cannot hold.
    #[error("organ {name:?}: DICOM names have 1 to 64 characters, without backslash or control characters")]
    Name {
        /// The name.
        name: String,
    },
    /// Numbers that are not finite.
    #[error("organ {name:?}, contour {contour}: a coordinate is not a finite number")]
    Coordinate {
        /// The organ.
        name: String,
        /// The contour.
        contour: usize,
    },
    /// A contour whose points are not on one plane: the plain form has one height per contour.
    #[error("organ {name:?}, contour {contour} does not lie in one plane z = const")]
    NotPlanar {
        /// The organ.
        name: String,
        /// The contour.
        contour: usize,
    },
}

/// A selection that the study cannot satisfy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// No organ of this name.
    #[error("no organ {name:?} in the study; it has {}", list(has))]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names there are.
        has: Vec<String>,
    },
    /// One name for several organs: it does not say which.
    #[error("{count} organs are named {name:?} in the study")]
    Ambiguous {
        /// The name.
        name: String,
        /// How many have it.
        count: usize,
    },
}

fn list(names: &[String]) -> String {
    names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ")
}

/// What is wrong within a file. ROIs are named by their number and, as far as it is known, their name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// Neither DICOM nor JSON.
    #[error("starts with {found}, expected a DICOM file (\"DICM\" after 128 bytes) or JSON (\"{{\")")]
    Unknown {
        /// The first bytes.
        found: String,
    },
    /// More than is read.
    #[error("has {found} bytes, expected at most {limit}")]
    TooLarge {
        /// The size.
        found: u64,
        /// The most.
        limit: u64,
    },
    /// Not JSON, or not of the schema.
    #[error("not contours as JSON: {0}")]
    Json(String),
    /// Of another format or version.
    #[error("{key} is {found:?}, expected {expected:?}")]
    Schema {
        /// Which key.
        key: &'static str,
        /// Its value.
        found: String,
        /// What is read here.
        expected: &'static str,
    },
    /// The DICOM encoding is broken, or of a kind that is not read.
    #[error("not readable as DICOM: {0}")]
    Dicom(String),
    /// Another kind of DICOM file.
    #[error("SOP class {found}, expected RT Structure Set Storage ({expected})")]
    SopClass {
        /// Its UID.
        found: String,
        /// The right one.
        expected: &'static str,
    },
    /// An element that must be there.
    #[error("{place}: {element} is missing or empty")]
    Missing {
        /// Where.
        place: Place,
        /// Name and tag.
        element: &'static str,
    },
    /// An element that cannot be read as what it should be.
    #[error("{place}: {element} is {found}, expected {expected}")]
    Value {
        /// Where.
        place: Place,
        /// Name and tag.
        element: &'static str,
        /// What it holds.
        found: String,
        /// What it should hold.
        expected: String,
    },
    /// Contours of an ROI that the list of ROIs does not have, or has twice.
    #[error("ROI {number} stands {found} times in Structure Set ROI Sequence (3006,0020), expected once")]
    RoiNumber {
        /// The number.
        number: i64,
        /// How often it is there.
        found: usize,
    },
    /// A contour in a plane that is not axial.
    #[error("{place} lies in the {plane}, expected an axial plane (z = const)")]
    NotAxial {
        /// Where.
        place: Place,
        /// The plane.
        plane: String,
    },
    /// There is no contour at all.
    #[error("no contour in any of its {rois} ROIs, expected closed planar contours")]
    NoContour {
        /// How many ROIs it lists.
        rois: usize,
    },
}

/// Where in a structure set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// The ROI's number.
    pub roi: Option<i64>,
    /// Its name.
    pub name: Option<String>,
    /// The item of a sequence, from zero: a contour of an ROI, or an ROI whose number is not known.
    pub item: Option<usize>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.roi, &self.name) {
            (Some(roi), Some(name)) => write!(f, "ROI {roi} ({name:?})")?,
            (Some(roi), None) => write!(f, "ROI {roi}")?,
            (None, _) => f.write_str("structure set")?,
        }
        match (self.roi, self.item) {
            (Some(_), Some(item)) => write!(f, ", contour {item}"),
            (None, Some(item)) => write!(f, ", item {item}"),
            (_, None) => Ok(()),
        }
    }
}
