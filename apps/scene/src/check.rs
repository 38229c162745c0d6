//! From a TOML item to a [`Value`] of the declared kind, or a problem that says what was found.

use std::ops::Range;

use toml_edit::{Item, TableLike, Value as Toml};

use crate::error::{Problem, VALUE_LIMIT, one_line};
use crate::nearest::nearest;
use crate::table::is_bare;
use crate::{Bound, Column, Kind, Row, Value};

/// A problem and the bytes of the source that it is about.
pub(crate) type Fault = (Problem, Option<Range<usize>>);

/// Checks what stands at the key `path` against `kind`. `source` is the text that the item was parsed from.
pub(crate) fn value_of(kind: Kind, path: &str, item: &Item, source: &str) -> Result<Value, Fault> {
    let wrong = || fault(path, item, source, kind.expected());
    match (kind, item.as_value()) {
        (Kind::Rows(columns), _) => rows_of(columns, path, item, source),
        (_, None) => Err(wrong()),
        (Kind::Bool, Some(Toml::Boolean(b))) => Ok(Value::Bool(*b.value())),
        (Kind::Int { min, max }, Some(Toml::Integer(i))) if (min..=max).contains(i.value()) => {
            Ok(Value::Int(*i.value()))
        }
        (Kind::Float { min, max }, Some(x)) => in_range(x, min, max).map(Value::Float).ok_or_else(wrong),
        (Kind::Choice(words), Some(Toml::String(s))) => match words.iter().find(|word| *word == s.value()) {
            Some(word) => Ok(Value::Text((*word).into())),
            None => {
                let nearest = nearest(s.value(), words.iter().copied());
                Err(fault(path, item, source, format!("{}; nearest is \"{nearest}\"", kind.expected())))
            }
        },
        (Kind::Text, Some(Toml::String(s))) => Ok(Value::Text(s.value().clone())),
        (Kind::Point { dim_min, dim_max }, Some(Toml::Array(list))) if (dim_min..=dim_max).contains(&list.len()) => {
            let numbers: Option<Vec<f64>> = list.iter().map(|x| in_range(x, Bound::None, Bound::None)).collect();
            numbers.map(Value::Floats).ok_or_else(wrong)
        }
        _ => Err(wrong()),
    }
}

/// The number, if it is one, finite and within the range.
fn in_range(value: &Toml, min: Bound, max: Bound) -> Option<f64> {
    let x = match value {
        Toml::Float(x) => *x.value(),
        Toml::Integer(i) => *i.value() as f64,
        _ => return None,
    };
    (x.is_finite() && min.admits_from_below(x) && max.admits_from_above(x)).then_some(x)
}

/// Rows from `[[path]]` tables, or from an inline `path = [{ … }, { … }]`.
fn rows_of(columns: &'static [Column], path: &str, item: &Item, source: &str) -> Result<Value, Fault> {
    let expected = || format!("an array of tables [[{path}]]");
    let mut rows = Vec::new();
    if let Some(tables) = item.as_array_of_tables() {
        for table in tables {
            let row = Place { path, number: rows.len() + 1, span: table.span() };
            rows.push(row_of(columns, table, &row, source)?);
        }
    } else if let Some(list) = item.as_array() {
        for entry in list {
            let row = Place { path, number: rows.len() + 1, span: entry.span() };
            let table = entry.as_inline_table().ok_or_else(|| fault(path, item, source, expected()))?;
            rows.push(row_of(columns, table, &row, source)?);
        }
    } else {
        return Err(fault(path, item, source, expected()));
    }
    Ok(Value::Rows(rows))
}

/// One row of an array of tables, for messages.
struct Place<'a> {
    path: &'a str,
    number: usize,
    span: Option<Range<usize>>,
}

impl Place<'_> {
    fn key(&self, column: &str) -> String {
        format!("{}.{} (row {})", self.path, shown_part(column), self.number)
    }
}

fn row_of(columns: &'static [Column], table: &dyn TableLike, at: &Place<'_>, source: &str) -> Result<Row, Fault> {
    for (name, _) in table.iter() {
        if !columns.iter().any(|column| column.name == name) {
            let nearest = nearest(name, columns.iter().map(|column| column.name));
            let problem = Problem::UnknownKey { key: at.key(name), nearest: format!("{}.{nearest}", at.path) };
            return Err((problem, key_span(table, name).or(at.span.clone())));
        }
    }
    let mut row = Row::default();
    for column in columns {
        match table.get(column.name) {
            Some(item) => {
                row.set(column.name, value_of(column.kind, &at.key(column.name), item, source)?);
            }
            None if column.required => {
                let problem = Problem::MissingKey { key: at.key(column.name), expected: column.kind.expected() };
                return Err((problem, at.span.clone()));
            }
            None => {}
        }
    }
    Ok(row)
}

/// Where a key of a table stands in the source.
pub(crate) fn key_span(table: &dyn TableLike, name: &str) -> Option<Range<usize>> {
    let (key, item) = table.get_key_value(name)?;
    key.span().or_else(|| item.span())
}

/// One part of a path as a message shows it: quoted unless it is a bare key, so that a quoted `"a.b"` stays one part.
pub(crate) fn shown_part(part: &str) -> String {
    let line = one_line(part, VALUE_LIMIT);
    if is_bare(part) { line } else { format!("\"{line}\"") }
}

/// The fault of a value that is not what the key wants.
pub(crate) fn fault(path: &str, item: &Item, source: &str, expected: String) -> Fault {
    (Problem::Value { key: path.into(), found: found(item, source), expected }, item.span())
}

/// What stands at a key, as a message shows it: the text of the source, with the type where the text does not tell.
fn found(item: &Item, source: &str) -> String {
    let Item::Value(value) = item else {
        return if item.is_array_of_tables() { "an array of tables".into() } else { "a table".into() };
    };
    let raw = match value.span().and_then(|span| source.get(span)) {
        Some(raw) => one_line(raw, VALUE_LIMIT),
        None => match value {
            Toml::String(text) => format!("\"{}\"", one_line(text.value(), VALUE_LIMIT)),
            other => one_line(&other.to_string(), VALUE_LIMIT),
        },
    };
    match value {
        Toml::String(_) => format!("the string {raw}"),
        Toml::Array(list) => format!("a list of {} ({raw})", list.len()),
        Toml::InlineTable(_) => format!("the table {raw}"),
        Toml::Datetime(_) => format!("the date or time {raw}"),
        _ => raw,
    }
}
