//! Numbers in MSH files: words of text, or bytes in the order and of the size that the header states.

use crate::io::{
    Problem, ReadError,
    cursor::{ByteOrder, Cursor},
};
use std::borrow::Cow;

/// A place in a file, and how numbers are written there.
pub(super) struct Stream<'a> {
    pub cursor: Cursor<'a>,
    /// `None` for text.
    pub order: Option<ByteOrder>,
    /// Bytes of Gmsh's `size_t`, 4 or 8.
    pub size_of_size: usize,
}

impl Stream<'_> {
    /// An error at byte `at`, which is the line in text.
    pub fn error(&self, at: usize, problem: Problem) -> ReadError {
        match self.order {
            None => self.cursor.line_error(at, problem),
            Some(_) => self.cursor.byte_error(at, problem),
        }
    }

    /// Where the next number begins.
    pub fn at(&mut self) -> usize {
        if self.order.is_none() {
            self.cursor.skip_space();
        }
        self.cursor.at()
    }

    /// Gmsh's `int`.
    pub fn int(&mut self, expected: &'static str) -> Result<i64, ReadError> {
        match self.order {
            None => self.cursor.number(expected),
            Some(order) => self.cursor.i32(order, expected).map(i64::from),
        }
    }

    /// An `int` that names or counts something.
    pub fn natural(&mut self, expected: &'static str) -> Result<u64, ReadError> {
        let at = self.at();
        let found = self.int(expected)?;
        let syntax = || Problem::Syntax { expected: Cow::from(expected), found: found.to_string() };
        u64::try_from(found).map_err(|_| self.error(at, syntax()))
    }

    /// Gmsh's `size_t`.
    pub fn size(&mut self, expected: &'static str) -> Result<u64, ReadError> {
        match self.order {
            None => self.cursor.number(expected),
            Some(order) if self.size_of_size == 8 => Ok(order.u64(self.cursor.take(8, expected)?)),
            Some(order) => Ok(u64::from(self.cursor.i32(order, expected)? as u32)),
        }
    }

    /// Gmsh's `double`.
    pub fn real(&mut self, expected: &'static str) -> Result<f64, ReadError> {
        match self.order {
            None => self.cursor.number(expected),
            Some(order) => Ok(order.f64(self.cursor.take(8, expected)?)),
        }
    }

    /// The fewest bytes that numbers of these kinds take: a word and its separator, or their size.
    pub fn bytes_of(&self, ints: u64, sizes: u64, reals: u64) -> usize {
        let bytes = match self.order {
            None => ints.saturating_add(sizes).saturating_add(reals).saturating_mul(2),
            Some(_) => ints
                .saturating_mul(4)
                .saturating_add(sizes.saturating_mul(self.size_of_size as u64))
                .saturating_add(reals.saturating_mul(8)),
        };
        usize::try_from(bytes).unwrap_or(usize::MAX)
    }

    /// A count that was read at `at`, held against the bytes that are left.
    pub fn check_count(&self, at: usize, n: u64, bytes_each: usize, what: &'static str) -> Result<usize, ReadError> {
        self.cursor.check_count(n, bytes_each, what).map_err(|problem| self.error(at, problem))
    }

    /// The end of a section.
    pub fn end(&mut self, section: &str) -> Result<(), ReadError> {
        let expected = format!("${}", format_args!("End{section}"));
        let (at, word) = self.cursor.need(format!("{expected:?}"))?;
        if word == expected.as_bytes() {
            return Ok(());
        }
        Err(self.cursor.syntax(at, format!("{expected:?} after what the section says it has"), word))
    }
}
