//! What can go wrong with a file, as values that carry the numbers.

use super::DataError;
use std::{
    borrow::Cow,
    fmt,
    path::{Path, PathBuf},
};

/// Why a file could not be written. No file was left half written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IoError {
    /// The system refused.
    #[error("{}: {source}", path.display())]
    System {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// VTK knows cells with two to four vertices in up to three dimensions.
    #[error("{}: VTK has no cells with {n} vertices in {d} dimensions", path.display())]
    Dimension {
        /// The file.
        path: PathBuf,
        /// Dimension of space.
        d: usize,
        /// Vertices per cell.
        n: usize,
    },
    /// A field without a name, or two fields of one name on points or on cells.
    #[error("{}: field name {name:?} is empty or taken", path.display())]
    Name {
        /// The file.
        path: PathBuf,
        /// The name.
        name: String,
    },
    /// A field of the wrong length.
    #[error("{}: field {name:?} has {found} numbers, expected were {entries} times {components}", path.display())]
    Length {
        /// The file.
        path: PathBuf,
        /// The field.
        name: String,
        /// Its length.
        found: usize,
        /// Vertices or live cells.
        entries: usize,
        /// Numbers per entry.
        components: usize,
    },
    /// A position that is not a finite number.
    #[error("{}: the displacement of vertex {vertex} is not finite", path.display())]
    Position {
        /// The file.
        path: PathBuf,
        /// The vertex.
        vertex: usize,
    },
    /// A time that is not a finite number.
    #[error("{}: time {time} of {file:?} is not finite", path.display())]
    Time {
        /// The collection.
        path: PathBuf,
        /// The file at that time.
        file: String,
        /// The time.
        time: f64,
    },
    /// Data that contradict themselves.
    #[error("{}: {source}", path.display())]
    Data {
        /// The file.
        path: PathBuf,
        /// What is wrong with them.
        source: DataError,
    },
    /// Data beyond what the format can hold, and without which the rest has no meaning.
    #[error("{}: {format} cannot hold {what}", path.display())]
    DoesNotFit {
        /// The file.
        path: PathBuf,
        /// The format.
        format: &'static str,
        /// What it cannot hold, with its size.
        what: String,
    },
}

impl IoError {
    pub(super) fn system(path: &Path, source: std::io::Error) -> Self {
        Self::System { path: path.to_path_buf(), source }
    }
}

/// Why a file could not be read: which file, where in it, and what was found there.
#[derive(Debug)]
pub struct ReadError {
    /// The file; `None` for bytes that came from elsewhere.
    pub file: Option<PathBuf>,
    /// Where in it.
    pub place: Place,
    /// What is wrong there.
    pub problem: Box<Problem>,
}

/// A place in a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, from 1.
    Line(usize),
    /// A byte of binary data, from 0.
    Byte(usize),
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The system refused.
    #[error("{0}")]
    System(#[from] std::io::Error),
    /// A folder where a file was expected.
    #[error("this is a folder, expected was a file")]
    Folder,
    /// No bytes, or nothing but white space.
    #[error("the file is empty")]
    Empty,
    /// No reader for it.
    #[error("unknown format: {found}; expected was {expected}")]
    Format {
        /// What extension and content look like.
        found: String,
        /// What is read.
        expected: &'static str,
    },
    /// A version of a format that is not read.
    #[error("version {found} is not read, expected was {expected}")]
    Version {
        /// As it stands in the file.
        found: String,
        /// Versions that are read.
        expected: &'static str,
    },
    /// Something else than what the format has in this place.
    #[error("expected {expected}, found {found}")]
    Syntax {
        /// What the format has here.
        expected: Cow<'static, str>,
        /// What the file has, shortened.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends where {expected} was expected")]
    Truncated {
        /// What should have followed.
        expected: Cow<'static, str>,
    },
    /// A count beyond what the rest of the file can hold.
    #[error("{found} {what} need {needed} bytes or more, but {left} are left")]
    Count {
        /// Of what.
        what: Cow<'static, str>,
        /// The count in the file.
        found: u64,
        /// Fewest bytes that these take; saturated.
        needed: u64,
        /// Bytes that are left.
        left: u64,
    },
    /// A count, a number of components, or a memory demand beyond a limit of this crate.
    #[error("{found} {what} are too many, the limit is {limit}")]
    Limit {
        /// Of what.
        what: Cow<'static, str>,
        /// The number found; saturated.
        found: u64,
        /// The most that is read.
        limit: u64,
    },
    /// A reference to something that does not exist.
    #[error("{what} {found} does not exist, there are {range}")]
    Index {
        /// Of what.
        what: &'static str,
        /// The reference.
        found: i128,
        /// What there is.
        range: String,
    },
    /// A number given twice.
    #[error("{what} {id} occurs twice")]
    Duplicate {
        /// Of what.
        what: &'static str,
        /// The number.
        id: i128,
    },
    /// A section, attribute or array that is not there.
    #[error("{0} is missing")]
    Missing(Cow<'static, str>),
    /// A section or array that is there twice.
    #[error("{0} occurs a second time")]
    Repeated(Cow<'static, str>),
    /// Arrays that should be of one length.
    #[error("{what} has {found} numbers, expected were {expected}")]
    Length {
        /// Of what.
        what: String,
        /// The number found.
        found: u64,
        /// The number that belongs there.
        expected: u64,
    },
    /// A coordinate that is not a finite number.
    #[error("coordinate {axis} of vertex {vertex} is {value}, expected was a finite number")]
    NotFinite {
        /// The vertex, by its position in the file, from 0.
        vertex: usize,
        /// The axis, from 0.
        axis: usize,
        /// The value.
        value: f64,
    },
    /// Cells that are not simplices with straight edges.
    #[error("{count} cells of type {kind}: only points, segments, triangles and tetrahedra of first order are read")]
    Element {
        /// Name of the type.
        kind: Cow<'static, str>,
        /// Cells of the type, in the block or section that begins here.
        count: u64,
    },
    /// Something that the format allows and this crate does not read.
    #[error("{0} cannot be read")]
    Unsupported(Cow<'static, str>),
}

impl ReadError {
    pub(super) fn new(place: Place, problem: Problem) -> Self {
        Self { file: None, place, problem: Box::new(problem) }
    }

    /// Names the file, unless an inner reader did so.
    pub(super) fn in_file(mut self, file: &Path) -> Self {
        self.file.get_or_insert_with(|| file.to_path_buf());
        self
    }
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}", file.display())?;
        }
        let separator = if self.file.is_some() { ", " } else { "" };
        match self.place {
            Place::File => {}
            Place::Line(line) => write!(f, "{separator}line {line}")?,
            Place::Byte(byte) => write!(f, "{separator}byte {byte}")?,
        }
        let colon = if self.file.is_none() && self.place == Place::File { "" } else { ": " };
        write!(f, "{colon}{}", self.problem)
    }
}

impl std::error::Error for ReadError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &*self.problem {
            Problem::System(source) => Some(source),
            _ => None,
        }
    }
}
