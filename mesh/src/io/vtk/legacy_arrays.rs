//! Numbers and names in legacy VTK files.

use super::kind::Kind;
use crate::io::{
    Problem, ReadError,
    cursor::{ByteOrder, Cursor, shown},
};

/// The part of a legacy file behind its header.
pub(super) struct Legacy<'a> {
    pub cursor: Cursor<'a>,
    pub is_binary: bool,
}

impl<'a> Legacy<'a> {
    /// A type of numbers as the next word.
    pub fn kind(&mut self) -> Result<Kind, ReadError> {
        let (at, word) = self.cursor.need("a type of numbers")?;
        if word.eq_ignore_ascii_case(b"bit") || word.eq_ignore_ascii_case(b"string") {
            let what = format!("an array of type {}", shown(word)).into();
            return Err(self.cursor.line_error(at, Problem::Unsupported(what)));
        }
        Kind::of_legacy(word).ok_or_else(|| self.cursor.syntax(at, "a type of numbers, such as \"double\"", word))
    }

    /// `n` numbers from the next line on.
    pub fn reals(&mut self, kind: Kind, n: u64, what: &'static str) -> Result<Vec<f64>, ReadError> {
        if let Some(bytes) = self.binary(kind, n, what)? {
            return Ok(bytes.chunks_exact(kind.size()).map(|bytes| kind.real(ByteOrder::Big, bytes)).collect());
        }
        let n = self.count(n, 2, what)?;
        (0..n).map(|_| self.cursor.number("a number")).collect()
    }

    /// `n` integers from the next line on.
    pub fn integers(&mut self, kind: Kind, n: u64, what: &'static str) -> Result<Vec<i64>, ReadError> {
        if kind.is_real() {
            let what = format!("an array of real numbers for {what}").into();
            return Err(self.cursor.line_error(self.cursor.at(), Problem::Unsupported(what)));
        }
        if let Some(bytes) = self.binary(kind, n, what)? {
            return Ok(bytes.chunks_exact(kind.size()).map(|bytes| kind.integer(ByteOrder::Big, bytes)).collect());
        }
        let n = self.count(n, 2, what)?;
        (0..n).map(|_| self.cursor.number("an integer")).collect()
    }

    /// The bytes of `n` numbers from the next line on; `None` in a file of text.
    fn binary(&mut self, kind: Kind, n: u64, what: &'static str) -> Result<Option<&'a [u8]>, ReadError> {
        if !self.is_binary {
            return Ok(None);
        }
        self.end_of_line()?;
        let n = self.count(n, kind.size(), what)?;
        self.cursor.take(n * kind.size(), what).map(Some)
    }

    fn count(&self, n: u64, bytes_each: usize, what: &'static str) -> Result<usize, ReadError> {
        // Numbers in a field are no indices, so only the bytes limit them.
        let (needed, left) = (n.saturating_mul(bytes_each as u64), self.cursor.left() as u64);
        if needed > left {
            let problem = Problem::Count { what: what.into(), found: n, needed, left };
            return Err(self.cursor.line_error(self.cursor.at(), problem));
        }
        Ok(n as usize)
    }

    /// Moves behind the end of a line on which nothing is left.
    fn end_of_line(&mut self) -> Result<(), ReadError> {
        let at = self.cursor.at();
        let rest = self.cursor.line();
        if rest.is_empty() { Ok(()) } else { Err(self.cursor.syntax(at, "the end of the line", rest)) }
    }

    /// A name as the next word.
    pub fn name(&mut self) -> Result<String, ReadError> {
        Ok(decode_name(self.cursor.need("a name")?.1))
    }
}

/// A name with every `%` and two hexadecimal digits turned into the byte that they stand for.
fn decode_name(word: &[u8]) -> String {
    let mut bytes = Vec::with_capacity(word.len());
    let mut at = 0;
    while at < word.len() {
        let digits = word.get(at + 1..at + 3).and_then(|digits| std::str::from_utf8(digits).ok());
        let byte = digits.filter(|_| word[at] == b'%').and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(byte.unwrap_or(word[at]));
        at += if byte.is_some() { 3 } else { 1 };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A name as a word, with every byte that would end it written as `%` and two digits.
pub(super) fn encode_name(name: &str) -> String {
    let plain = |b: u8| (33..127).contains(&b) && b != b'%' && b != b'"';
    name.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for name in ["u", "von Mises", "100 %", "%20", "\"q\"", "Spannung σ", "a\nb"] {
            let word = encode_name(name);
            assert!(word.bytes().all(|b| b.is_ascii_graphic()), "{word}");
            assert_eq!(decode_name(word.as_bytes()), name);
        }
        assert_eq!(decode_name(b"100%"), "100%", "a sign without digits stays");
    }
}
