//! What a key holds, once checked against its [`Kind`](crate::Kind).

/// The value of a key. A setter receives the variant of its [`Kind`](crate::Kind), already within its range.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A finite number. An integer in the file arrives here as well when the key is a number.
    Float(f64),
    /// A string, or one of the words of a choice.
    Text(String),
    /// A point or another short list of finite numbers.
    Floats(Vec<f64>),
    /// An array of tables, such as `[[needle.motion]]`.
    Rows(Vec<Row>),
}

impl Value {
    /// The flag, or a sentence for the author of the table if the kind is another one.
    pub fn bool(&self) -> Result<bool, String> {
        match self {
            Self::Bool(b) => Ok(*b),
            other => other.mismatch("a boolean"),
        }
    }

    /// The whole number.
    pub fn int(&self) -> Result<i64, String> {
        match self {
            Self::Int(i) => Ok(*i),
            other => other.mismatch("an integer"),
        }
    }

    /// The whole number as a count or a level; an error if it is negative.
    pub fn count(&self) -> Result<usize, String> {
        let value = self.int()?;
        usize::try_from(value).map_err(|_| format!("found {value}, expected a count"))
    }

    /// The number; an integer is taken as well.
    pub fn float(&self) -> Result<f64, String> {
        match self {
            Self::Float(x) => Ok(*x),
            // Exact up to 2^53, then rounded to the nearest.
            Self::Int(i) => Ok(*i as f64),
            other => other.mismatch("a number"),
        }
    }

    /// The string.
    pub fn text(&self) -> Result<&str, String> {
        match self {
            Self::Text(s) => Ok(s),
            other => other.mismatch("a string"),
        }
    }

    /// The list of numbers.
    pub fn floats(&self) -> Result<&[f64], String> {
        match self {
            Self::Floats(x) => Ok(x),
            other => other.mismatch("a list of numbers"),
        }
    }

    /// The list of numbers as a point of `D` coordinates.
    pub fn point<const D: usize>(&self) -> Result<[f64; D], String> {
        let x = self.floats()?;
        x.try_into().map_err(|_| format!("found {} coordinates, expected {D}", x.len()))
    }

    /// The rows of an array of tables.
    pub fn rows(&self) -> Result<&[Row], String> {
        match self {
            Self::Rows(rows) => Ok(rows),
            other => other.mismatch("an array of tables"),
        }
    }

    fn mismatch<T>(&self, expected: &str) -> Result<T, String> {
        let found = match self {
            Self::Bool(_) => "a boolean",
            Self::Int(_) => "an integer",
            Self::Float(_) => "a number",
            Self::Text(_) => "a string",
            Self::Floats(_) => "a list of numbers",
            Self::Rows(_) => "an array of tables",
        };
        Err(format!("found {found}, expected {expected}"))
    }
}

/// One table of an array of tables: values by column name. A column that the row does not name is not there, which is
/// not the same as zero.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Row {
    cells: Vec<(&'static str, Value)>,
}

impl Row {
    /// The number in a column, if the row names it and it is one.
    pub fn get(&self, column: &str) -> Option<f64> {
        self.value(column)?.float().ok()
    }

    /// The value in a column, if the row names it.
    pub fn value(&self, column: &str) -> Option<&Value> {
        self.cells.iter().find(|(name, _)| *name == column).map(|(_, value)| value)
    }

    /// Writes the value of a column, over an older one if there is one.
    pub fn set(&mut self, column: &'static str, value: impl Into<Value>) {
        let value = value.into();
        match self.cells.iter_mut().find(|(name, _)| *name == column) {
            Some(cell) => cell.1 = value,
            None => self.cells.push((column, value)),
        }
    }

    /// The columns present, with their values. A row that was read lists them in the order of the declaration.
    pub fn cells(&self) -> &[(&'static str, Value)] {
        &self.cells
    }
}

impl From<f64> for Value {
    fn from(x: f64) -> Self {
        Self::Float(x)
    }
}

impl<V: Into<Value>> FromIterator<(&'static str, V)> for Row {
    fn from_iter<I: IntoIterator<Item = (&'static str, V)>>(cells: I) -> Self {
        let mut row = Self::default();
        for (column, x) in cells {
            row.set(column, x);
        }
        row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_accessor_of_another_kind_says_what_it_found() {
        assert_eq!(Value::Bool(true).float(), Err("found a boolean, expected a number".into()));
        assert_eq!(Value::Int(-1).count(), Err("found -1, expected a count".into()));
        assert_eq!(Value::Floats(vec![1.0]).point::<2>(), Err("found 1 coordinates, expected 2".into()));
        assert_eq!(Value::Int(7).float(), Ok(7.0));
    }

    #[test]
    fn a_row_keeps_one_value_per_column() {
        let row: Row = [("t", 0.0), ("insert", 1.0), ("t", 2.0)].into_iter().collect();
        assert_eq!(row.get("t"), Some(2.0));
        assert_eq!(row.get("spin"), None);
        assert_eq!(row.cells(), [("t", Value::Float(2.0)), ("insert", Value::Float(1.0))]);
    }
}
