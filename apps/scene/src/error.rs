//! One line for everything that can be wrong with a scene file.

use std::fmt;

/// What is wrong with a scene, and where. Its `Display` is one line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct SceneError {
    /// The file and line, or the command line.
    pub place: Place,
    /// What was found and what was expected.
    pub problem: Problem,
}

impl SceneError {
    /// An error about a key of a scene, for rules that tie several keys together.
    ///
    /// `name` is the file or the built-in scene, as given to [`Table::read`](crate::Table::read).
    pub fn rejected(name: &str, key: &str, reason: &str) -> Self {
        Self {
            place: Place::File(one_line(name, NAME_LIMIT)),
            problem: Problem::Rejected { key: key.into(), reason: one_line(reason, REASON_LIMIT) },
        }
    }
}

/// Where a problem is.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// A file, or a built-in scene, as a whole.
    File(String),
    /// A line of a file, counted from 1.
    Line(String, usize),
    /// An assignment on the command line.
    Set,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(name) => f.write_str(name),
            Self::Line(name, line) => write!(f, "{name}:{line}"),
            Self::Set => f.write_str("--set"),
        }
    }
}

/// What is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file cannot be read at all.
    #[error("{0}")]
    File(String),
    /// The text is not TOML.
    #[error("not valid TOML: {0}")]
    Syntax(String),
    /// An assignment without `=`, or without a key.
    #[error("found {0}, expected key=value")]
    Assignment(String),
    /// A key that no stage has.
    #[error("{key}: unknown key; nearest known key is {nearest}")]
    UnknownKey {
        /// The key as found.
        key: String,
        /// The declared key closest to it.
        nearest: String,
    },
    /// A table that is no stage.
    #[error("[{table}]: unknown table; nearest known table is [{nearest}]")]
    UnknownTable {
        /// The table as found.
        table: String,
        /// The declared table closest to it.
        nearest: String,
    },
    /// A value of the wrong type or out of its range.
    #[error("{key}: found {found}, expected {expected}")]
    Value {
        /// The key, with the row in an array of tables.
        key: String,
        /// What stands there, shortened.
        found: String,
        /// Type and range.
        expected: String,
    },
    /// A required column that a row does not have.
    #[error("{key}: missing, expected {expected}")]
    MissingKey {
        /// The key, with the row in an array of tables.
        key: String,
        /// Type and range.
        expected: String,
    },
    /// A required table that the file does not have.
    #[error("table [{table}] is missing: {meaning}")]
    MissingTable {
        /// Name of the table.
        table: &'static str,
        /// What it is for.
        meaning: &'static str,
    },
    /// A value that the application refuses.
    #[error("{key}: {reason}")]
    Rejected {
        /// The key.
        key: String,
        /// Why, in a few words.
        reason: String,
    },
}

/// Longest piece of a user's value, key or file name that a message repeats, in characters.
pub(crate) const VALUE_LIMIT: usize = 40;
/// See [`VALUE_LIMIT`]; a path may be long and is still wanted whole.
pub(crate) const NAME_LIMIT: usize = 400;
/// See [`VALUE_LIMIT`].
pub(crate) const REASON_LIMIT: usize = 300;

/// `text` with white space collapsed, control characters escaped, and at most `limit` characters of it.
pub(crate) fn one_line(text: &str, limit: usize) -> String {
    let mut line = String::new();
    let mut length = 0;
    let mut gap = false;
    for c in text.trim().chars() {
        if c.is_whitespace() {
            gap = true;
            continue;
        }
        if length >= limit {
            line.push('…');
            break;
        }
        if std::mem::take(&mut gap) {
            line.push(' ');
            length += 1;
        }
        // Other invisible characters (bidirectional overrides, line separators) could rewrite a terminal line.
        if c.is_control() || is_format_character(c) {
            line.extend(c.escape_unicode());
        } else {
            line.push(c);
        }
        length += 1;
    }
    line
}

/// Zero-width and direction-changing characters.
fn is_format_character(c: char) -> bool {
    matches!(c, '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_text_becomes_one_short_line() {
        assert_eq!(one_line("  a\n\tb \r\n", 40), "a b");
        assert_eq!(one_line("a\u{1b}[31m", 40), "a\\u{1b}[31m");
        assert_eq!(one_line("\u{202e}x", 40), "\\u{202e}x");
        assert_eq!(one_line(&"é".repeat(1000), 40), format!("{}…", "é".repeat(40)));
    }
}
