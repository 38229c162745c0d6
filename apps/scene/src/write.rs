//! A scene as TOML that reads back to the same scene.

use crate::{Column, Key, Kind, Row, Stage, Table, Value};

impl<S> Table<S> {
    /// The scene as TOML, with units in comments. A stage of which no key is present is left out.
    ///
    /// Numbers are written with as many digits as it takes to read the same bits back.
    pub fn write(&self, scene: &S) -> String {
        let mut text = self.write_keys("", scene);
        for stage in self.stages {
            let keys = self.write_keys(stage.name, scene);
            if !keys.is_empty() {
                text.push_str(if text.is_empty() { "" } else { "\n" });
                text.push_str(&header(stage));
                text.push_str(&keys);
            }
        }
        text
    }

    /// The lines of one stage, plain keys before arrays of tables: a line after `[[a.b]]` would belong to `a.b`.
    fn write_keys(&self, stage: &str, scene: &S) -> String {
        let present: Vec<(&Key<S>, Value)> = self
            .keys
            .iter()
            .filter(|key| key.stage() == stage)
            .filter_map(|key| (key.get)(scene).map(|value| (key, value)))
            .collect();
        let mut lines = Vec::new();
        let mut arrays = String::new();
        for (key, value) in &present {
            match (key.kind, value) {
                (Kind::Rows(columns), Value::Rows(rows)) if !rows.is_empty() => {
                    arrays.push_str(&write_rows(key, columns, rows));
                }
                _ => lines.push((format!("{} = {}", key.name(), inline(value)), key.unit)),
            }
        }
        let width = lines.iter().map(|(line, _)| line.chars().count()).filter(|&n| n <= 40).max().unwrap_or(0);
        let mut text = String::new();
        for (line, unit) in lines {
            match unit {
                "" => text.push_str(&line),
                unit => text.push_str(&format!("{line:width$}  # {}", comment(unit))),
            }
            text.push('\n');
        }
        text + &arrays
    }
}

fn header<S>(stage: &Stage<S>) -> String {
    match stage.meaning {
        "" => format!("[{}]\n", stage.name),
        meaning => format!("# {}\n[{}]\n", comment(meaning), stage.name),
    }
}

/// A comment ends with its line, and holds no control characters.
fn comment(text: &str) -> String {
    text.replace(|c: char| c.is_control(), " ")
}

fn write_rows<S>(key: &Key<S>, columns: &[Column], rows: &[Row]) -> String {
    let units: Vec<_> = columns
        .iter()
        .filter(|column| !column.unit.is_empty())
        .map(|column| format!("{} in {}", column.name, column.unit))
        .collect();
    let mut text = String::new();
    if !units.is_empty() {
        text = format!("\n# {}", comment(&units.join(", ")));
    }
    for row in rows {
        text.push_str(&format!("\n[[{}]]\n", key.path));
        for (name, value) in row.cells() {
            text.push_str(&format!("{name} = {}\n", inline(value)));
        }
    }
    text
}

/// In the syntax of TOML, on one line.
impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&inline(self))
    }
}

/// A value on one line.
fn inline(value: &Value) -> String {
    match value {
        Value::Bool(b) => b.to_string(),
        Value::Int(i) => i.to_string(),
        Value::Float(x) => float(*x),
        Value::Text(s) => toml_edit::Value::from(s.as_str()).to_string(),
        Value::Floats(list) => format!("[{}]", list.iter().map(|x| float(*x)).collect::<Vec<_>>().join(", ")),
        Value::Rows(rows) => {
            let tables: Vec<_> = rows.iter().map(inline_row).collect();
            format!("[{}]", tables.join(", "))
        }
    }
}

fn inline_row(row: &Row) -> String {
    let cells: Vec<_> = row.cells().iter().map(|(name, value)| format!("{name} = {}", inline(value))).collect();
    format!("{{ {} }}", cells.join(", "))
}

/// The shortest decimal that reads back to the same bits; `Debug` keeps a point or an exponent, as a TOML float needs.
fn float(x: f64) -> String {
    format!("{x:?}")
}
