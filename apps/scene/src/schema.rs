//! The reference of all keys, in Markdown that reads well as plain text too.

use crate::{Column, Key, Kind, Stage, Table};

const HEAD: [&str; 6] = ["key", "type", "range", "unit", "default", "meaning"];

impl<S> Table<S> {
    /// Every stage and key with its type, range, unit, default and meaning: one Markdown table a stage, columns aligned
    /// over all of them.
    pub fn schema(&self) -> String {
        let top: Vec<_> = self.keys.iter().filter(|key| key.stage().is_empty()).flat_map(lines_of).collect();
        let stages: Vec<(&Stage<S>, Vec<Line>)> = self
            .stages
            .iter()
            .map(|stage| {
                let own = self.keys.iter().filter(|key| key.stage() == stage.name);
                (stage, own.flat_map(lines_of).collect())
            })
            .collect();
        let widths = widths(stages.iter().flat_map(|(_, lines)| lines).chain(&top));

        let mut text = String::new();
        if !top.is_empty() {
            text.push_str(&render(&top, &widths));
        }
        for (stage, lines) in &stages {
            if !text.is_empty() {
                text.push('\n');
            }
            let required = if stage.required { "required" } else { "optional" };
            text.push_str(&format!("### `[{}]`: {} ({required})\n", stage.name, stage.meaning));
            if !lines.is_empty() {
                text.push('\n');
                text.push_str(&render(lines, &widths));
            }
        }
        text
    }
}

/// The cells of one line of the reference.
type Line = [String; 6];

fn lines_of<S>(key: &Key<S>) -> Vec<Line> {
    let code = |text: &str| {
        if text.is_empty() { String::new() } else { format!("`{text}`") }
    };
    let unit = |unit: &str| {
        if unit.is_empty() { "-".to_owned() } else { escape(unit) }
    };
    let path = match key.kind {
        Kind::Rows(_) => format!("[[{}]]", key.path),
        _ => key.path.to_owned(),
    };
    let mut lines = vec![[
        code(&path),
        key.kind.type_name().into(),
        escape(&key.kind.range()),
        unit(key.unit),
        escape(key.default),
        escape(key.meaning),
    ]];
    if let Kind::Rows(columns) = key.kind {
        column_lines(key.path, columns, code, unit, &mut lines);
    }
    lines
}

/// The columns of an array of tables, and of those within it.
fn column_lines(
    path: &str,
    columns: &[Column],
    code: impl Fn(&str) -> String + Copy,
    unit: impl Fn(&str) -> String + Copy,
    lines: &mut Vec<Line>,
) {
    for column in columns {
        lines.push(column_line(path, column, code, unit));
        if let Kind::Rows(inner) = column.kind {
            column_lines(&format!("{path}.{}", column.name), inner, code, unit, lines);
        }
    }
}

fn column_line(path: &str, column: &Column, code: impl Fn(&str) -> String, unit: impl Fn(&str) -> String) -> Line {
    let Column { name, kind, .. } = *column;
    [
        code(&format!("{path}.{name}")),
        kind.type_name().into(),
        escape(&kind.range()),
        unit(column.unit),
        if column.required { "required".into() } else { "absent".into() },
        escape(column.meaning),
    ]
}

/// A cell cannot hold a bar or a line break.
fn escape(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

fn widths<'a>(lines: impl Iterator<Item = &'a Line>) -> [usize; 6] {
    let mut widths = HEAD.map(str::len);
    for line in lines {
        for (width, cell) in widths.iter_mut().zip(line) {
            *width = (*width).max(cell.chars().count());
        }
    }
    widths
}

fn render(lines: &[Line], widths: &[usize; 6]) -> String {
    let mut text = row(&HEAD.map(String::from), widths);
    text.push_str(&row(&widths.map(|width| "-".repeat(width.min(60))), widths));
    for line in lines {
        text.push_str(&row(line, widths));
    }
    text
}

/// One line; the last column is left ragged, since meanings differ in length.
fn row(cells: &Line, widths: &[usize; 6]) -> String {
    let padded = cells[..5].iter().zip(widths).map(|(cell, width)| format!("| {cell:width$} "));
    format!("{}| {} |\n", padded.collect::<String>(), cells[5])
}

#[cfg(test)]
mod tests {
    use crate::sample::TABLE;

    #[test]
    fn every_key_has_its_line() {
        let schema = TABLE.schema();
        for key in TABLE.keys {
            assert!(
                schema
                    .lines()
                    .any(|line| line.contains(key.path) && line.contains(key.meaning.split(' ').next().unwrap()))
            );
        }
        assert!(schema.contains("### `[mesh]`: the tissue (required)"));
        let poisson = schema.lines().find(|line| line.contains("mesh.poisson")).unwrap();
        let cells: Vec<_> = poisson.split(" | ").map(|cell| cell.trim_matches([' ', '|'])).collect();
        assert_eq!(cells, ["`mesh.poisson`", "number", ">= 0 and < 0.5", "-", "0.0", "Poisson's ratio \\| nu"]);
        assert!(schema.lines().any(|line| line.starts_with("| `needle.motion.t`") && line.contains("required")));
    }

    #[test]
    fn columns_are_aligned_over_all_tables() {
        let starts = |line: &str| line.match_indices(" | ").take(5).map(|(i, _)| i).collect::<Vec<_>>();
        let schema = TABLE.schema();
        let mut rows = schema.lines().filter(|line| line.starts_with("| ")).map(starts);
        let first = rows.next().unwrap();
        assert!(rows.all(|row| row == first), "{schema}");
    }
}
