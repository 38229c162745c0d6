//! Reading.

use super::error::shown;
use super::header::{Field, Format, Header, Symmetry, read_header};
use super::lines::{Lines, end, whole, words};
use super::{Problem, ReadError};
use crate::sparse::{ConversionError, ScalarCsr};
use std::io::BufRead;

/// Rows or columns that a file may have whatever the number of its entries: memory for them is taken by the header's word.
pub const MOST_EMPTY: u32 = 1 << 24;

/// Reads a matrix: entries at one place added up, both halves of a symmetric one, zeros of a dense one left out.
///
/// # Errors
/// [`ReadError`] names the line, what was found there and what was expected.
pub fn read_matrix(reader: impl BufRead) -> Result<ScalarCsr, ReadError> {
    let mut entries = Entries::new(reader)?;
    let Header { format, symmetry, rows, cols, .. } = entries.header;
    let mut triplets = Vec::new();
    while let Some((row, col, value)) = entries.next()? {
        if format == Format::Array && value == 0.0 {
            continue;
        }
        triplets.push((row, col, value));
        if symmetry != Symmetry::General && row != col {
            triplets.push((col, row, if symmetry == Symmetry::Skew { -value } else { value }));
        }
    }
    entries.check_size("rows", rows)?;
    entries.check_size("columns", cols)?;
    ScalarCsr::from_triplets(rows as usize, cols as usize, &triplets).map_err(|error| match error {
        ConversionError::NotFinite { row, col, value } => entries.sum_error(row, col, value),
        other => unreachable!("entries were checked one by one: {other}"),
    })
}

/// Reads a vector: a matrix with one column, dense or not. Entries that the file does not state are zero.
///
/// # Errors
/// [`ReadError`] names the line, what was found there and what was expected.
pub fn read_vector(reader: impl BufRead) -> Result<Vec<f64>, ReadError> {
    let mut entries = Entries::new(reader)?;
    let Header { format, rows, cols, .. } = entries.header;
    if cols != 1 {
        return Err(entries.lines.error(Problem::NotVector(u64::from(cols))));
    }
    if format == Format::Array {
        let mut vector = Vec::new();
        while let Some((_, _, value)) = entries.next()? {
            vector.push(value);
        }
        return Ok(vector);
    }
    let mut stated = Vec::new();
    while let Some((row, _, value)) = entries.next()? {
        stated.push((row as usize, value));
    }
    entries.check_size("rows", rows)?;
    let mut vector = vec![0.0; rows as usize];
    for (row, value) in stated {
        vector[row] += value;
    }
    match vector.iter().position(|value| !value.is_finite()) {
        Some(row) => Err(entries.sum_error(row, 0, vector[row])),
        None => Ok(vector),
    }
}

/// The entries of a file, as they stand in it.
struct Entries<R> {
    lines: Lines<R>,
    header: Header,
    /// How many were read.
    found: u64,
    /// Where the next entry of a dense file belongs.
    place: (u32, u32),
    /// Whether the entries of a symmetric file lie below the diagonal, once one is off it.
    below: Option<bool>,
}

impl<R: BufRead> Entries<R> {
    fn new(reader: R) -> Result<Self, ReadError> {
        let mut lines = Lines::new(reader);
        let header = read_header(&mut lines)?;
        let place = if header.symmetry == Symmetry::Skew { (1, 0) } else { (0, 0) };
        Ok(Self { lines, header, found: 0, place, below: None })
    }

    /// The next entry `(row, column, value)`, counted from 0; `None` after the last one, if the file ends there.
    fn next(&mut self) -> Result<Option<(u32, u32, f64)>, ReadError> {
        let Header { format, announced, .. } = self.header;
        let entry = match self.lines.next()? {
            None if self.found == announced => return Ok(None),
            None => Err(Problem::Missing { found: self.found, announced }),
            Some(line) if self.found == announced => Err(Problem::Extra { announced, found: shown(line.trim_ascii()) }),
            Some(line) => match format {
                Format::Coordinate => read_coordinate(line, &self.header),
                Format::Array => read_dense(line, &self.header).map(|value| (self.place.0, self.place.1, value)),
            },
        };
        let checked = entry.and_then(|entry| self.check_half(entry));
        let entry = checked.map_err(|problem| self.lines.error(problem))?;
        self.found += 1;
        if format == Format::Array {
            self.advance();
        }
        Ok(Some(entry))
    }

    /// Moves on to the next place of a dense matrix, down its columns.
    fn advance(&mut self) {
        let (row, col) = self.place;
        self.place = if row + 1 < self.header.rows {
            (row + 1, col)
        } else {
            let first = match self.header.symmetry {
                Symmetry::General => 0,
                Symmetry::Symmetric => col + 1,
                Symmetry::Skew => col + 2,
            };
            (first, col + 1)
        };
    }

    fn check_half(&mut self, entry: (u32, u32, f64)) -> Result<(u32, u32, f64), Problem> {
        let (row, col, value) = entry;
        let symmetry = self.header.symmetry;
        if symmetry == Symmetry::General {
            return Ok(entry);
        }
        if row == col {
            if symmetry == Symmetry::Skew && value != 0.0 {
                return Err(Problem::SkewDiagonal { row: u64::from(row) + 1, value });
            }
            return Ok(entry);
        }
        if *self.below.get_or_insert(row > col) != (row > col) {
            let (row, col) = (u64::from(row) + 1, u64::from(col) + 1);
            return Err(Problem::BothHalves { row, col, symmetry: symmetry.name() });
        }
        Ok(entry)
    }

    /// Refuses to take memory for rows or columns that hardly any entry fills.
    fn check_size(&self, what: &'static str, size: u32) -> Result<(), ReadError> {
        let (found, limit, entries) = (u64::from(size), u64::from(MOST_EMPTY), self.found);
        if found <= limit.max(entries) {
            return Ok(());
        }
        Err(self.lines.error(Problem::TooEmpty { what, found, entries, limit }))
    }

    fn sum_error(&self, row: usize, col: usize, value: f64) -> ReadError {
        let (row, col) = (row as u64 + 1, col as u64 + 1);
        self.lines.error(Problem::Sum { row, col, value })
    }
}

fn read_coordinate(line: &[u8], header: &Header) -> Result<(u32, u32, f64), Problem> {
    let mut words = words(line);
    let mut index = |what, expected, size: u32| {
        let found = whole(words.next(), expected)?;
        let limit = u64::from(size);
        if found == 0 || found > limit {
            return Err(Problem::Index { what, found, limit });
        }
        Ok((found - 1) as u32) // below a u32
    };
    let row = index("row", "a row, column and value; the row from 1", header.rows)?;
    let col = index("column", "a row, column and value; the column from 1", header.cols)?;
    let value = match header.field {
        Field::Pattern => 1.0,
        field => read_number(words.next(), field)?,
    };
    end(words.next())?;
    Ok((row, col, value))
}

fn read_dense(line: &[u8], header: &Header) -> Result<f64, Problem> {
    let mut words = words(line);
    let value = read_number(words.next(), header.field)?;
    end(words.next())?;
    Ok(value)
}

fn read_number(word: Option<&[u8]>, field: Field) -> Result<f64, Problem> {
    let text = word.and_then(|word| std::str::from_utf8(word).ok());
    if field == Field::Integer {
        let number: Option<i64> = text.and_then(|text| text.parse().ok());
        let number = number.ok_or_else(|| Problem::syntax("a whole number of 64 bits", word))?;
        let value = number as f64;
        // i64::MAX rounds to 2^63, which the cast back would saturate to i64::MAX.
        let exact = value as i128 == i128::from(number);
        return if exact { Ok(value) } else { Err(Problem::syntax("a whole number that 64-bit reals can hold", word)) };
    }
    let number: Option<f64> = text.and_then(|text| text.parse().ok());
    let value = number.ok_or_else(|| Problem::syntax("a number", word))?;
    if value.is_finite() { Ok(value) } else { Err(Problem::NotFinite { found: word.map(shown).unwrap_or_default() }) }
}
