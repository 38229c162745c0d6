//! The lines of a file, one at a time.

use super::{Problem, ReadError};
use std::io::{BufRead, Read as _};

/// Longer lines are refused: a file without line ends must not fill the memory.
const LONGEST_LINE: usize = 1 << 16;

/// The lines of a file that carry something, with their numbers.
pub(super) struct Lines<R> {
    reader: R,
    line: Vec<u8>,
    /// Number of the line at hand, from 1.
    number: u64,
}

impl<R: BufRead> Lines<R> {
    pub fn new(reader: R) -> Self {
        Self { reader, line: Vec::new(), number: 0 }
    }

    /// The next line, whatever it holds, without its end; `None` at the end of the file.
    pub fn any(&mut self) -> Result<Option<&[u8]>, ReadError> {
        Ok(if self.advance()? { Some(&self.line) } else { None })
    }

    /// The next line that is neither blank nor a comment.
    pub fn next(&mut self) -> Result<Option<&[u8]>, ReadError> {
        while self.advance()? {
            let first = self.line.iter().find(|byte| !byte.is_ascii_whitespace());
            if !matches!(first, None | Some(b'%')) {
                return Ok(Some(&self.line));
            }
        }
        Ok(None)
    }

    fn advance(&mut self) -> Result<bool, ReadError> {
        self.line.clear();
        let limit = LONGEST_LINE as u64 + 1;
        let result = (&mut self.reader).take(limit).read_until(b'\n', &mut self.line);
        if !matches!(result, Ok(0)) {
            self.number += 1;
        }
        let n = result.map_err(|error| self.error(Problem::System(error)))?;
        if self.line.last() == Some(&b'\n') {
            self.line.pop();
        }
        if self.line.len() > LONGEST_LINE {
            return Err(self.error(Problem::LongLine { limit: LONGEST_LINE }));
        }
        Ok(n > 0)
    }

    /// An error in the line at hand.
    pub fn error(&self, problem: Problem) -> ReadError {
        ReadError { line: self.number.max(1), problem }
    }
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A whole number that is not negative.
pub(super) fn whole(word: Option<&[u8]>, expected: &'static str) -> Result<u64, Problem> {
    let number = word.and_then(|word| std::str::from_utf8(word).ok()?.parse().ok());
    number.ok_or_else(|| Problem::syntax(expected, word))
}

/// There must be no further word.
pub(super) fn end(word: Option<&[u8]>) -> Result<(), Problem> {
    match word {
        None => Ok(()),
        found => Err(Problem::syntax("the end of the line", found)),
    }
}
