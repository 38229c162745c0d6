//! A place in the bytes of a file, for formats that mix lines of text with binary data.
//!
//! Nothing here allocates by a number that a file states: counts are checked against the bytes that are left.

use super::{Place, Problem, ReadError};
use std::{borrow::Cow, str::FromStr};

/// Order of the bytes in a binary number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

/// A place in some bytes.
#[derive(Clone, Copy)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        // A byte order mark says nothing here.
        let at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { bytes, at }
    }

    /// Byte `at` of some bytes, at most their length.
    pub fn at_byte(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at: at.min(bytes.len()) }
    }

    /// Bytes before the place.
    pub fn at(&self) -> usize {
        self.at
    }

    /// What follows.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// Bytes that are left.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// An error in the line that holds byte `at`.
    pub fn line_error(&self, at: usize, problem: Problem) -> ReadError {
        let line = 1 + self.bytes[..at.min(self.bytes.len())].iter().filter(|&&b| b == b'\n').count();
        ReadError::new(Place::Line(line), problem)
    }

    /// An error in binary data at byte `at`.
    pub fn byte_error(&self, at: usize, problem: Problem) -> ReadError {
        ReadError::new(Place::Byte(at), problem)
    }

    pub fn skip_space(&mut self) {
        self.at += self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
    }

    /// The next word, and the place where it begins; `None` at the end.
    pub fn word(&mut self) -> Option<(usize, &'a [u8])> {
        self.skip_space();
        let start = self.at;
        self.at += self.rest().iter().take_while(|b| !b.is_ascii_whitespace()).count();
        (self.at > start).then(|| (start, &self.bytes[start..self.at]))
    }

    /// The next word, without moving.
    pub fn peek(&self) -> Option<&'a [u8]> {
        let mut ahead = *self;
        ahead.word().map(|(_, word)| word)
    }

    /// The next word, which has to be there.
    pub fn need(&mut self, expected: impl Into<Cow<'static, str>>) -> Result<(usize, &'a [u8]), ReadError> {
        self.word().ok_or_else(|| self.line_error(self.at, Problem::Truncated { expected: expected.into() }))
    }

    /// The next word, which has to be `keyword`, in whatever case.
    pub fn keyword(&mut self, keyword: &'static str) -> Result<(), ReadError> {
        let expected = format!("{keyword:?}");
        let (at, word) = self.need(expected.clone())?;
        if word.eq_ignore_ascii_case(keyword.as_bytes()) {
            return Ok(());
        }
        Err(self.syntax(at, expected, word))
    }

    /// The next word as a number.
    pub fn number<T: FromStr>(&mut self, expected: &'static str) -> Result<T, ReadError> {
        let (at, word) = self.need(expected)?;
        parse(word).ok_or_else(|| self.syntax(at, expected, word))
    }

    /// The next word as a count of things, each of which takes so many bytes or more in what follows.
    pub fn count(&mut self, what: &'static str, bytes_each: usize) -> Result<usize, ReadError> {
        let (at, word) = self.need(Cow::from(format!("the number of {what}")))?;
        let Some(found) = parse::<u64>(word) else {
            return Err(self.syntax(at, format!("the number of {what}"), word));
        };
        self.check_count(found, bytes_each, what).map_err(|problem| self.line_error(at, problem))
    }

    /// A count, checked against the bytes that are left, and against what indices of 32 bits can name.
    pub fn check_count(&self, found: u64, bytes_each: usize, what: &'static str) -> Result<usize, Problem> {
        let (needed, left) = (found.saturating_mul(bytes_each as u64), self.left() as u64);
        if needed > left {
            return Err(Problem::Count { what: what.into(), found, needed, left });
        }
        check_u32(found, what)
    }

    /// An error about a word that should have been something else.
    pub fn syntax(&self, at: usize, expected: impl Into<Cow<'static, str>>, found: &[u8]) -> ReadError {
        self.line_error(at, Problem::Syntax { expected: expected.into(), found: shown(found) })
    }

    /// What is left of the line, without its end.
    pub fn line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        rest[..length].trim_ascii()
    }

    /// The next line that has something before a `#`, as a cursor that ends with it.
    pub fn record(&mut self) -> Option<Cursor<'a>> {
        loop {
            let start = self.at;
            let rest = self.rest();
            if rest.is_empty() {
                return None;
            }
            let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
            self.at += (end + 1).min(rest.len());
            let text = rest[..end].iter().position(|&b| b == b'#').unwrap_or(end);
            if !rest[..text].trim_ascii().is_empty() {
                return Some(Cursor { bytes: &self.bytes[..start + text], at: start });
            }
        }
    }

    /// The next `n` bytes.
    pub fn take(&mut self, n: usize, expected: &'static str) -> Result<&'a [u8], ReadError> {
        let taken = self.rest().get(..n).ok_or_else(|| {
            let problem = Problem::Truncated { expected: format!("{n} bytes of {expected}").into() };
            self.byte_error(self.bytes.len(), problem)
        })?;
        self.at += n;
        Ok(taken)
    }

    /// The next 4 bytes as an integer.
    pub fn i32(&mut self, order: ByteOrder, expected: &'static str) -> Result<i32, ReadError> {
        Ok(order.i32(self.take(4, expected)?))
    }

    /// Moves behind the next occurrence of `text`; false, without moving, if there is none.
    pub fn skip_past(&mut self, text: &[u8]) -> bool {
        let found = find(self.rest(), text);
        self.at += found.map_or(0, |at| at + text.len());
        found.is_some()
    }
}

impl ByteOrder {
    /// # Panics
    /// These panic, as do the slices they are, on less than the bytes that they need.
    pub fn i32(self, bytes: &[u8]) -> i32 {
        i32::from_ne_bytes(self.native(bytes))
    }

    pub fn u64(self, bytes: &[u8]) -> u64 {
        u64::from_ne_bytes(self.native(bytes))
    }

    pub fn f64(self, bytes: &[u8]) -> f64 {
        f64::from_bits(self.u64(bytes))
    }

    /// The first `N` bytes in the order of this machine.
    pub fn native<const N: usize>(self, bytes: &[u8]) -> [u8; N] {
        let mut native: [u8; N] = std::array::from_fn(|i| bytes[i]);
        if (self == Self::Big) == cfg!(target_endian = "little") {
            native.reverse();
        }
        native
    }
}

/// A number from the bytes of a word.
pub(super) fn parse<T: FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A count as indices of 32 bits can name it.
pub(super) fn check_u32(found: u64, what: &'static str) -> Result<usize, Problem> {
    let limit = u64::from(u32::MAX);
    if found > limit { Err(Problem::Limit { what: what.into(), found, limit }) } else { Ok(found as usize) }
}

/// The first place where `text` occurs.
pub(super) fn find(bytes: &[u8], text: &[u8]) -> Option<usize> {
    bytes.windows(text.len()).position(|window| window == text)
}

/// A coordinate, which has to be finite.
pub(super) fn check_finite(vertex: usize, axis: usize, value: f64) -> Result<f64, Problem> {
    if value.is_finite() { Ok(value) } else { Err(Problem::NotFinite { vertex, axis, value }) }
}

/// A word of a file as an error message shows it: quoted, shortened, and with nothing that a terminal would act upon.
pub(super) fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text: String = String::from_utf8_lossy(&word[..word.len().min(4 * LONGEST)]).chars().take(LONGEST).collect();
    let dots = if text.len() < word.len() { "..." } else { "" };
    format!("{text:?}{dots}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_lines_and_records_know_their_place() {
        let mut cursor = Cursor::new(b"one\r\n  2 # note\r\n\r\n# only a note \xff\n3.5 x");
        assert_eq!(cursor.line(), b"one");
        assert_eq!(cursor.record().unwrap().number::<u32>("a number").unwrap(), 2);
        let mut record = cursor.record().unwrap();
        assert_eq!(record.number::<f64>("a number").unwrap(), 3.5);
        let error = record.number::<f64>("a number").unwrap_err();
        assert_eq!(error.to_string(), "line 5: expected a number, found \"x\"");
        let error = record.number::<f64>("a number").unwrap_err();
        assert_eq!(error.to_string(), "line 5: the file ends where a number was expected");
        assert!(cursor.record().is_none());
    }

    #[test]
    fn counts_are_held_against_the_bytes_that_are_left() {
        let huge = Cursor::new(b"99999999999999999999 1").number::<u64>("a count").unwrap_err();
        assert!(huge.to_string().contains("99999999999999999999"));
        let error = Cursor::new(b"\n400 1 2 3").count("nodes", 8).unwrap_err();
        assert_eq!(error.to_string(), "line 2: 400 nodes need 3200 bytes or more, but 6 are left");
        assert_eq!(Cursor::new(b"3 1 2 3").count("nodes", 2).unwrap(), 3);
        assert!(Cursor::new(b"-3").count("nodes", 2).is_err());
        assert!(matches!(check_u32(1 << 32, "nodes"), Err(Problem::Limit { .. })));
    }

    #[test]
    fn both_byte_orders() {
        assert_eq!(ByteOrder::Big.i32(&[0, 0, 1, 2]), 258);
        assert_eq!(ByteOrder::Little.i32(&[2, 1, 0, 0]), 258);
        assert_eq!(ByteOrder::Big.f64(&1.5_f64.to_be_bytes()), 1.5);
        assert_eq!(ByteOrder::Little.f64(&1.5_f64.to_le_bytes()), 1.5);
    }
}
