//! Writing to standard output and standard error without ever failing loudly.

use crate::exit::Failure;
use std::io::{ErrorKind, Write as _};

/// Prints to standard output. A reader that has gone away is no error: the run's files are what counts then.
///
/// # Errors
/// Any other failure, such as a full disk.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::bad_input(format!("standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes one line to standard error, whatever the text holds. Nobody is left to tell should that fail.
pub fn error_line(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "stylet: {}", one_line(text));
}

/// Writes a line of progress to standard error.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", one_line(text));
}

/// `text` with line breaks and other control characters (as file names may hold) made visible.
fn one_line(text: &str) -> String {
    let mut line = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() { line.extend(c.escape_default()) } else { line.push(c) }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_text_stays_on_its_line() {
        assert_eq!(one_line("a\nb\u{1b}[2J\tc é"), "a\\nb\\u{1b}[2J\\tc é");
    }
}
