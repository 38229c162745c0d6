//! Why a file cannot be read.

use std::borrow::Cow;
use std::fmt;

/// Why a file cannot be read: where in it, and what was found there.
#[derive(Debug)]
pub struct ReadError {
    /// A line of the file, from 1; the last one if the file as a whole is at fault.
    pub line: u64,
    /// What is wrong there.
    pub problem: Problem,
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The system refused.
    #[error("{0}")]
    System(#[from] std::io::Error),
    /// Something else than what the format has in this place.
    #[error("expected {expected}, found {found}")]
    Syntax {
        /// What the format has here.
        expected: Cow<'static, str>,
        /// What the file has, shortened.
        found: String,
    },
    /// Part of the format that is not read.
    #[error("{what} matrices are not read, expected {expected}")]
    Unsupported {
        /// The word in the banner.
        what: &'static str,
        /// What is read.
        expected: &'static str,
    },
    /// A line longer than any entry.
    #[error("a line of more than {limit} bytes")]
    LongLine {
        /// The longest line that is read.
        limit: usize,
    },
    /// A size that cannot be.
    #[error("{found} {what}, expected at most {limit}")]
    TooLarge {
        /// Of what.
        what: &'static str,
        /// The number in the file.
        found: u64,
        /// The most that is read.
        limit: u64,
    },
    /// More rows or columns than memory should be given for.
    #[error("{found} {what} but only {entries} entries, expected at most {limit} {what} in so empty a file")]
    TooEmpty {
        /// Rows or columns.
        what: &'static str,
        /// Their number.
        found: u64,
        /// Number of entries in the file.
        entries: u64,
        /// The most that is read with so few entries.
        limit: u64,
    },
    /// A symmetric matrix has as many rows as columns.
    #[error("{rows} x {cols}, expected a {symmetry} matrix to be square")]
    NotSquare {
        /// Number of rows.
        rows: u64,
        /// Number of columns.
        cols: u64,
        /// The word in the banner.
        symmetry: &'static str,
    },
    /// A vector has one column.
    #[error("expected a vector, that is a matrix with 1 column, found {0} columns")]
    NotVector(u64),
    /// A row or column that does not exist.
    #[error("{what} {found}, expected {what} 1 to {limit}")]
    Index {
        /// Row or column.
        what: &'static str,
        /// The number in the file.
        found: u64,
        /// The last one there is.
        limit: u64,
    },
    /// A number that is NaN, infinite or too large.
    #[error("{found} is not a finite 64-bit number")]
    NotFinite {
        /// As it stands in the file, shortened.
        found: String,
    },
    /// Both halves of a matrix of which one is enough.
    #[error(
        "entry ({row}, {col}) lies on the other side of the diagonal than an earlier one, expected one half of a {symmetry} matrix"
    )]
    BothHalves {
        /// Row, from 1.
        row: u64,
        /// Column, from 1.
        col: u64,
        /// The word in the banner.
        symmetry: &'static str,
    },
    /// The diagonal of a skew-symmetric matrix is zero.
    #[error("entry ({row}, {row}) is {value}, expected 0 on the diagonal of a skew-symmetric matrix")]
    SkewDiagonal {
        /// Row and column, from 1.
        row: u64,
        /// The entry.
        value: f64,
    },
    /// The file ends too early.
    #[error("the file ends after {found} of {announced} entries")]
    Missing {
        /// Entries that are there.
        found: u64,
        /// Entries that should be.
        announced: u64,
    },
    /// The file goes on after its last entry.
    #[error("expected nothing after the {announced} entries of the size line, found {found}")]
    Extra {
        /// Entries that should be there.
        announced: u64,
        /// What follows, shortened.
        found: String,
    },
    /// Entries of one place whose sum overflows.
    #[error("the entries at ({row}, {col}) add up to {value}, expected a finite number")]
    Sum {
        /// Row, from 1.
        row: u64,
        /// Column, from 1.
        col: u64,
        /// The sum.
        value: f64,
    },
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.problem)
    }
}

impl std::error::Error for ReadError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.problem {
            Problem::System(source) => Some(source),
            _ => None,
        }
    }
}

impl Problem {
    pub(super) fn syntax(expected: impl Into<Cow<'static, str>>, found: Option<&[u8]>) -> Self {
        let found = found.map_or_else(|| "the end of the line".to_owned(), shown);
        Self::Syntax { expected: expected.into(), found }
    }
}

/// Bytes of a file, as an error shows them: short, on one line, whatever they are.
pub(super) fn shown(bytes: &[u8]) -> String {
    const MOST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * MOST)]);
    let mut shown: String = text.chars().take(MOST).flat_map(char::escape_debug).collect();
    if bytes.len() > 4 * MOST || text.chars().nth(MOST).is_some() {
        shown.push('…');
    }
    format!("`{shown}`")
}
