//! What a command has to say: one JSON object, or lines for people.

use crate::exit::Failure;
use crate::output;
use serde_json::Value;
use std::fmt::Write as _;

/// Prints a JSON object.
///
/// # Errors
/// Standard output that cannot be written.
pub fn print_json(value: &Value) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Failure::bad_input(format!("report: {e}")))?;
    output::print(&(text + "\n"))
}

/// Lines `name value`, the values one below the other.
#[derive(Default)]
pub struct Facts {
    text: String,
}

impl Facts {
    /// Begins with a headline.
    pub fn new(headline: &str) -> Self {
        Self { text: format!("{headline}\n\n") }
    }

    /// Adds a line.
    pub fn add(&mut self, name: &str, value: impl std::fmt::Display) {
        // A String takes everything.
        let _ = writeln!(self.text, "  {name:<13} {value}");
    }

    /// Adds a line of its own.
    pub fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// Prints all.
    ///
    /// # Errors
    /// Standard output that cannot be written.
    pub fn print(&self) -> Result<(), Failure> {
        output::print(&self.text)
    }
}

/// Seconds in a unit that suits them.
pub fn seconds(s: f64) -> String {
    match s {
        s if s < 1e-4 => format!("{:.1} us", 1e6 * s),
        s if s < 0.1 => format!("{:.2} ms", 1e3 * s),
        s => format!("{s:.2} s"),
    }
}

/// `1 cell`, `2 cells`.
pub fn count(n: usize, one: &str, many: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {many}") }
}
