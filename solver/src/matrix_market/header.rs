//! The banner and the line of sizes.

use super::lines::{Lines, end, whole, words};
use super::{Problem, ReadError};
use std::io::BufRead;

/// What a file says that it holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    pub format: Format,
    pub field: Field,
    pub symmetry: Symmetry,
    pub rows: u32,
    pub cols: u32,
    /// Entries that should follow; may be a lie.
    pub announced: u64,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Format {
    Coordinate,
    Array,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Field {
    Real,
    Integer,
    Pattern,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Symmetry {
    General,
    Symmetric,
    Skew,
}

impl Symmetry {
    pub fn name(self) -> &'static str {
        match self {
            Self::General => "general",
            Self::Symmetric => "symmetric",
            Self::Skew => "skew-symmetric",
        }
    }
}

/// Reads all up to the first entry.
pub(super) fn read_header<R: BufRead>(lines: &mut Lines<R>) -> Result<Header, ReadError> {
    let banner = match lines.any()? {
        None => Err(Problem::syntax("`%%MatrixMarket matrix ...`", Some(b"an empty file"))),
        Some(line) => read_banner(line),
    };
    let (format, field, symmetry) = banner.map_err(|problem| lines.error(problem))?;
    let sizes = match lines.next()? {
        None => Err(Problem::syntax(expected_sizes(format), Some(b"the end of the file"))),
        Some(line) => read_sizes(line, format, symmetry),
    };
    let (rows, cols, announced) = sizes.map_err(|problem| lines.error(problem))?;
    Ok(Header { format, field, symmetry, rows, cols, announced })
}

fn read_banner(line: &[u8]) -> Result<(Format, Field, Symmetry), Problem> {
    const FIELDS: &str = "`real`, `integer` or `pattern`";
    const SYMMETRIES: &str = "`general`, `symmetric` or `skew-symmetric`";
    let mut words = words(line);
    let mut is = |expected: &'static str, choices: &[&str]| {
        let word = words.next();
        let known =
            word.and_then(|word| choices.iter().position(|choice| word.eq_ignore_ascii_case(choice.as_bytes())));
        known.ok_or_else(|| Problem::syntax(expected, word))
    };
    is("`%%MatrixMarket`", &["%%MatrixMarket"])?;
    is("`matrix`", &["matrix"])?;
    let format = match is("`coordinate` or `array`", &["coordinate", "array"])? {
        0 => Format::Coordinate,
        _ => Format::Array,
    };
    // `double` is what some writers say for `real`.
    let field = match is(FIELDS, &["real", "double", "integer", "pattern", "complex"])? {
        0 | 1 => Field::Real,
        2 => Field::Integer,
        3 => Field::Pattern,
        _ => return Err(Problem::Unsupported { what: "complex", expected: FIELDS }),
    };
    let symmetry = match is(SYMMETRIES, &["general", "symmetric", "skew-symmetric", "hermitian"])? {
        0 => Symmetry::General,
        1 => Symmetry::Symmetric,
        2 => Symmetry::Skew,
        _ => return Err(Problem::Unsupported { what: "hermitian", expected: SYMMETRIES }),
    };
    end(words.next())?;
    match (format, field, symmetry) {
        (Format::Array, Field::Pattern, _) => {
            Err(Problem::Unsupported { what: "dense pattern", expected: "`real` or `integer` with `array`" })
        }
        (_, Field::Pattern, Symmetry::Skew) => Err(Problem::Unsupported {
            what: "skew-symmetric pattern",
            expected: "`general` or `symmetric` with `pattern`",
        }),
        known => Ok(known),
    }
}

fn read_sizes(line: &[u8], format: Format, symmetry: Symmetry) -> Result<(u32, u32, u64), Problem> {
    let expected = expected_sizes(format);
    let mut words = words(line);
    let (rows, cols) = (whole(words.next(), expected)?, whole(words.next(), expected)?);
    let size =
        |what, found| u32::try_from(found).map_err(|_| Problem::TooLarge { what, found, limit: u64::from(u32::MAX) });
    let (m, n) = (size("rows", rows)?, size("columns", cols)?);
    if symmetry != Symmetry::General && m != n {
        return Err(Problem::NotSquare { rows, cols, symmetry: symmetry.name() });
    }
    let announced = match (format, symmetry) {
        (Format::Coordinate, _) => whole(words.next(), expected)?,
        (Format::Array, Symmetry::General) => rows * cols,
        (Format::Array, Symmetry::Symmetric) => rows * (rows + 1) / 2,
        (Format::Array, Symmetry::Skew) => rows * rows.saturating_sub(1) / 2,
    };
    end(words.next())?;
    Ok((m, n, announced))
}

fn expected_sizes(format: Format) -> &'static str {
    match format {
        Format::Coordinate => "three whole numbers: rows, columns, entries",
        Format::Array => "two whole numbers: rows, columns",
    }
}
