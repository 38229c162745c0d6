//! The type and range of a key, and how both read in a message or a reference.

use std::fmt::Write as _;

/// One end of a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// No limit on this side; the number is finite all the same.
    None,
    /// The limit itself is allowed.
    Inclusive(f64),
    /// The limit itself is refused.
    Exclusive(f64),
}

impl Bound {
    pub(crate) fn admits_from_below(self, x: f64) -> bool {
        match self {
            Self::None => true,
            Self::Inclusive(limit) => x >= limit,
            Self::Exclusive(limit) => x > limit,
        }
    }

    pub(crate) fn admits_from_above(self, x: f64) -> bool {
        match self {
            Self::None => true,
            Self::Inclusive(limit) => x <= limit,
            Self::Exclusive(limit) => x < limit,
        }
    }
}

/// Type and range of a key. NaN and infinity are refused everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// `true` or `false`.
    Bool,
    /// A whole number from `min` to `max`; `3.0` is not one.
    Int {
        /// Smallest value allowed.
        min: i64,
        /// Largest value allowed.
        max: i64,
    },
    /// A finite number; an integer is taken as well.
    Float {
        /// Lower end of the range.
        min: Bound,
        /// Upper end of the range.
        max: Bound,
    },
    /// One word of a list.
    Choice(&'static [&'static str]),
    /// Any string.
    Text,
    /// A list of `dim_min` to `dim_max` finite numbers.
    Point {
        /// Fewest numbers allowed.
        dim_min: usize,
        /// Most numbers allowed.
        dim_max: usize,
    },
    /// An array of tables with these columns.
    Rows(&'static [Column]),
}

/// One column of an array of tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Its key in each table of the array.
    pub name: &'static str,
    /// Type and range; an array of tables may stand in a row, written inline.
    pub kind: Kind,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
    /// Whether every row has to name it.
    pub required: bool,
    /// What it is, in a sentence.
    pub meaning: &'static str,
}

impl Kind {
    /// A finite number from `min` to `max`.
    pub const fn between(min: Bound, max: Bound) -> Self {
        Self::Float { min, max }
    }

    /// What a message says that it wants, such as `a number >= 0 and < 0.5`.
    pub(crate) fn expected(&self) -> String {
        match self {
            Self::Bool => "true or false".into(),
            Self::Int { .. } => join("an integer", &self.range()),
            Self::Float { .. } => join("a number", &self.range()),
            Self::Choice(words) => {
                let quoted: Vec<_> = words.iter().map(|w| format!("\"{w}\"")).collect();
                format!("one of {}", quoted.join(", "))
            }
            Self::Text => "a string".into(),
            Self::Point { .. } => format!("a list of {} numbers", self.range()),
            Self::Rows(_) => "an array of tables".into(),
        }
    }

    /// The word for the type in the reference.
    pub(crate) fn type_name(&self) -> &'static str {
        match self {
            Self::Bool => "boolean",
            Self::Int { .. } => "integer",
            Self::Float { .. } => "number",
            Self::Choice(_) => "choice",
            Self::Text => "string",
            Self::Point { .. } => "list",
            Self::Rows(_) => "array of tables",
        }
    }

    /// The range in words; empty if there is none.
    pub(crate) fn range(&self) -> String {
        match *self {
            Self::Bool | Self::Text | Self::Rows(_) => String::new(),
            Self::Int { min, max } => match (min, max) {
                (i64::MIN, i64::MAX) => String::new(),
                (min, i64::MAX) => format!(">= {min}"),
                (i64::MIN, max) => format!("<= {max}"),
                (min, max) => format!("from {min} to {max}"),
            },
            Self::Float { min, max } => float_range(min, max),
            Self::Choice(words) => words.join(", "),
            Self::Point { dim_min, dim_max } if dim_min == dim_max => dim_min.to_string(),
            Self::Point { dim_min, dim_max } => format!("{dim_min} to {dim_max}"),
        }
    }
}

fn join(noun: &str, range: &str) -> String {
    if range.is_empty() { noun.into() } else { format!("{noun} {range}") }
}

fn float_range(min: Bound, max: Bound) -> String {
    let mut text = String::new();
    match min {
        Bound::None => {}
        Bound::Inclusive(x) => text = format!(">= {}", number(x)),
        Bound::Exclusive(x) => text = format!("> {}", number(x)),
    }
    let and = if text.is_empty() { "" } else { " and " };
    match max {
        Bound::None => {}
        Bound::Inclusive(x) => write!(text, "{and}<= {}", number(x)).expect("a String takes everything"),
        Bound::Exclusive(x) => write!(text, "{and}< {}", number(x)).expect("a String takes everything"),
    }
    text
}

/// A limit as a reader writes it: `0.5`, `1e-9`, never three hundred digits.
#[must_use]
pub fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e6).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_read_like_sentences() {
        let poisson = Kind::Float { min: Bound::Inclusive(0.0), max: Bound::Exclusive(0.5) };
        assert_eq!(poisson.expected(), "a number >= 0 and < 0.5");
        let below = Kind::Float { min: Bound::None, max: Bound::Inclusive(1e-9) };
        assert_eq!(below.expected(), "a number <= 1e-9");
        assert_eq!(Kind::Float { min: Bound::None, max: Bound::None }.expected(), "a number");
        assert_eq!(Kind::Int { min: 0, max: 20 }.expected(), "an integer from 0 to 20");
        assert_eq!(Kind::Int { min: 1, max: i64::MAX }.expected(), "an integer >= 1");
        assert_eq!(Kind::Choice(&["cg", "newton"]).expected(), "one of \"cg\", \"newton\"");
        assert_eq!(Kind::Point { dim_min: 2, dim_max: 3 }.expected(), "a list of 2 to 3 numbers");
        assert_eq!(Kind::Point { dim_min: 2, dim_max: 2 }.expected(), "a list of 2 numbers");
    }
}
