//! What a suite has found: rows, figures with their targets, and the machine. One shape for all suites.

use crate::BenchError;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// Numbers by name, such as `mean_mm`.
pub type Numbers = BTreeMap<&'static str, f64>;

/// One run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Row {
    /// Which problem.
    pub case: String,
    /// How it was solved.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub method: String,
    /// With which preconditioner.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub preconditioner: String,
    /// To which tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// On how many threads.
    pub threads: usize,
    /// Whether it reached its end and its tolerance.
    pub ok: bool,
    /// Errors, in the unit of their name.
    #[serde(skip_serializing_if = "Numbers::is_empty")]
    pub error: Numbers,
    /// Iterations in all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iterations: Option<u64>,
    /// Median of the run time, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Further results of this suite.
    #[serde(flatten)]
    pub more: Numbers,
    /// Seconds of each stage.
    #[serde(skip_serializing_if = "Numbers::is_empty")]
    pub stages: Numbers,
    /// What was published for this case.
    #[serde(skip_serializing_if = "Numbers::is_empty")]
    pub published: Numbers,
    /// Why it failed, or what to know of it.
    pub note: String,
}

/// A number that sums a suite up, beside what it should reach.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// What it is.
    pub name: String,
    /// What it came to.
    pub value: f64,
    /// The largest value that counts as reached; absent for a figure that is only reported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_most: Option<f64>,
    /// The smallest value that counts as reached.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_least: Option<f64>,
}

impl Figure {
    /// A figure that should not exceed `at_most`.
    pub fn at_most(name: impl Into<String>, value: f64, at_most: f64) -> Self {
        Self { name: name.into(), value, at_most: Some(at_most), at_least: None }
    }

    /// A figure that should not fall below `at_least`.
    pub fn at_least(name: impl Into<String>, value: f64, at_least: f64) -> Self {
        Self { name: name.into(), value, at_most: None, at_least: Some(at_least) }
    }

    /// A figure that should stay in a range.
    pub fn within(name: impl Into<String>, value: f64, at_least: f64, at_most: f64) -> Self {
        Self { name: name.into(), value, at_most: Some(at_most), at_least: Some(at_least) }
    }

    /// A figure that is only reported.
    pub fn plain(name: impl Into<String>, value: f64) -> Self {
        Self { name: name.into(), value, at_most: None, at_least: None }
    }

    /// Whether it reaches what it should.
    pub fn reached(&self) -> bool {
        self.at_most.is_none_or(|most| self.value <= most) && self.at_least.is_none_or(|least| self.value >= least)
    }
}

/// The machine of a report.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Its processor.
    pub cpu: String,
    /// Cores.
    pub cores: usize,
    /// Threads that runs were allowed.
    pub threads: usize,
}

impl Machine {
    /// This machine.
    pub fn here(threads: usize) -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
        Self {
            cpu: name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, cpu)| cpu.trim().to_owned()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            threads,
        }
    }
}

/// What a suite has found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of this layout.
    pub schema: u32,
    /// The suite.
    pub suite: &'static str,
    /// Revision of the program.
    pub revision: &'static str,
    /// The machine.
    pub machine: Machine,
    /// The runs.
    pub rows: Vec<Row>,
    /// What they come to.
    pub figures: Vec<Figure>,
    /// Plots and other files written.
    pub files: Vec<String>,
}

impl Report {
    /// An empty report.
    pub fn new(suite: &'static str, threads: usize) -> Self {
        Self {
            schema: 1,
            suite,
            revision: env!("STYLET_REVISION"),
            machine: Machine::here(threads),
            rows: Vec::new(),
            figures: Vec::new(),
            files: Vec::new(),
        }
    }

    /// How many runs failed.
    pub fn failed_rows(&self) -> usize {
        self.rows.iter().filter(|row| !row.ok).count()
    }

    /// The first row of a case.
    pub fn row(&self, case: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.case == case)
    }

    /// The report as text: a table of the runs, the figures with their targets, the machine.
    pub fn table(&self) -> String {
        let mut text = format!(
            "{} ({}, {} cores, revision {})\n",
            self.suite, self.machine.cpu, self.machine.cores, self.revision
        );
        // Rows with other results are another table: one with columns for all would be mostly empty.
        for rows in self.rows.chunk_by(|a, b| a.more.keys().eq(b.more.keys())) {
            text.push('\n');
            text += &rows_as_text(rows);
        }
        if !self.figures.is_empty() {
            text.push('\n');
            let width = self.figures.iter().map(|figure| figure.name.chars().count()).max().unwrap_or(0);
            for figure in &self.figures {
                let target = match (figure.at_least, figure.at_most) {
                    (Some(least), Some(most)) => format!("  (target {least} to {most})"),
                    (None, Some(most)) => format!("  (target at most {most})"),
                    (Some(least), None) => format!("  (target at least {least})"),
                    (None, None) => String::new(),
                };
                let verdict = if figure.reached() { "" } else { "  MISSED" };
                let pad = " ".repeat(width - figure.name.chars().count());
                let _ = writeln!(text, "{}{pad}  {}{target}{verdict}", figure.name, short(figure.value));
            }
        }
        for file in &self.files {
            let _ = writeln!(text, "wrote {file}");
        }
        text
    }

    /// Writes a file of the suite into a folder, and enters it into the report.
    ///
    /// # Errors
    /// [`BenchError::Output`].
    pub fn write(&mut self, folder: &Path, name: &str, contents: &str) -> Result<(), BenchError> {
        let path = folder.join(name);
        let fail = |e: std::io::Error| BenchError::Output { path: path.display().to_string(), reason: e.to_string() };
        std::fs::create_dir_all(folder).map_err(fail)?;
        std::fs::write(&path, contents).map_err(fail)?;
        self.files.push(path.display().to_string());
        Ok(())
    }
}

/// Rows as an aligned table, without the columns that all of them leave empty.
fn rows_as_text(rows: &[Row]) -> String {
    let mut columns: Vec<Column> = vec![Column::text("case", rows, |row| row.case.clone())];
    columns.push(Column::text("method", rows, |row| row.method.clone()));
    columns.push(Column::text("precond.", rows, |row| row.preconditioner.clone()));
    columns.push(Column::text("tolerance", rows, |row| row.tolerance.map_or(String::new(), |t| format!("{t:e}"))));
    for name in names(rows, |row| &row.error) {
        columns.push(Column::number(name, rows, |row| row.error.get(name).copied()));
        columns.push(Column::number("(publ.)", rows, |row| row.published.get(name).copied()));
    }
    columns.push(Column::number("iterations", rows, |row| row.iterations.map(|i| i as f64)));
    columns.push(Column::number("(publ.)", rows, |row| row.published.get("iterations").copied()));
    for name in names(rows, |row| &row.more) {
        columns.push(Column::number(name, rows, |row| row.more.get(name).copied()));
        columns.push(Column::number("(publ.)", rows, |row| row.published.get(name).copied()));
    }
    columns.push(Column::number("ms", rows, |row| row.seconds.map(|s| 1e3 * s)));
    for name in names(rows, |row| &row.stages) {
        let head = format!("{name} ms");
        columns.push(Column::number(&head, rows, |row| row.stages.get(name).map(|s| 1e3 * s)));
    }
    columns.push(Column::text(
        "note",
        rows,
        |row| {
            if row.ok { row.note.clone() } else { format!("FAILED: {}", row.note) }
        },
    ));
    columns.retain(|column| column.cells.iter().any(|cell| !cell.is_empty()));

    let mut text = String::new();
    let line = |cells: Vec<String>| cells.join("  ").trim_end().to_owned() + "\n";
    text += &line(columns.iter().map(|column| column.padded(&column.head)).collect());
    for index in 0..rows.len() {
        text += &line(columns.iter().map(|column| column.padded(&column.cells[index])).collect());
    }
    text
}

/// The names that any row has a number for.
fn names(rows: &[Row], of: impl Fn(&Row) -> &Numbers) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = rows.iter().flat_map(|row| of(row).keys().copied()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

struct Column {
    head: String,
    cells: Vec<String>,
    width: usize,
    right: bool,
}

impl Column {
    fn text(head: &str, rows: &[Row], cell: impl Fn(&Row) -> String) -> Self {
        Self::new(head, rows.iter().map(cell).collect(), false)
    }

    fn number(head: &str, rows: &[Row], cell: impl Fn(&Row) -> Option<f64>) -> Self {
        Self::new(head, rows.iter().map(|row| cell(row).map_or(String::new(), short)).collect(), true)
    }

    fn new(head: &str, cells: Vec<String>, right: bool) -> Self {
        let width = cells.iter().map(|cell| cell.chars().count()).chain([head.len()]).max().unwrap_or(0);
        Self { head: head.to_owned(), cells, width, right }
    }

    fn padded(&self, cell: &str) -> String {
        let pad = " ".repeat(self.width - cell.chars().count());
        if self.right { pad + cell } else { cell.to_owned() + &pad }
    }
}

/// A number with about three digits.
pub(crate) fn short(x: f64) -> String {
    let size = x.abs();
    if x.fract() == 0.0 && size < 1e7 {
        format!("{x}")
    } else if size >= 100.0 {
        format!("{x:.0}")
    } else if size >= 10.0 {
        format!("{x:.1}")
    } else if size >= 1.0 {
        format!("{x:.2}")
    } else if size >= 1e-3 {
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.2e}")
    }
}
