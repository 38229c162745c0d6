//! `history.csv`: one row a step.

use super::output_error;
use crate::error::RunError;
use crate::history::{Columns, HistoryRow};
use crate::stages::{Stage, Stages};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A crash loses the rows of this time at most.
const FLUSH_AFTER: Duration = Duration::from_millis(500);

/// The file, open for appending.
#[derive(Debug)]
pub(super) struct History {
    path: PathBuf,
    file: BufWriter<File>,
    stages: Vec<Stage>,
    flushed: Instant,
    line: String,
}

impl History {
    /// A new file with its head.
    pub fn create(path: &Path, columns: &Columns) -> Result<Self, RunError> {
        let file = File::create(path).map_err(|e| output_error(path, e))?;
        let stages = columns.stages.clone();
        let (quantities, counts) = (columns.quantities.iter(), columns.counts.iter());
        let before = ["step", "time_s"].iter().chain(quantities).chain(&["iterations", "cycles"]);
        let names: Vec<&str> = before.chain(counts).chain(&["nodes", "elements"]).copied().collect();
        let mut line = names.join(",");
        for &stage in &stages {
            line.push(',');
            line.push_str(Stages::names()[stage as usize]);
            line.push_str("_s");
        }
        let mut history =
            Self { path: path.to_owned(), file: BufWriter::new(file), stages, flushed: Instant::now(), line };
        history.put_line()?;
        Ok(history)
    }

    /// Appends a row. Numbers are written with as many digits as it takes to read the same bits back; seconds with four.
    pub fn write(&mut self, row: &HistoryRow) -> Result<(), RunError> {
        let line = &mut self.line;
        line.clear();
        // Writing to a string cannot fail.
        let _ = write!(line, "{}", row.step);
        for number in std::iter::once(&row.time_s).chain(&row.quantities) {
            let _ = write!(line, ",{number:?}");
        }
        let counts = [row.iterations, row.cycles].into_iter().chain(row.counts.iter().copied());
        for count in counts.chain([row.nodes as u64, row.elements as u64]) {
            let _ = write!(line, ",{count}");
        }
        for &stage in &self.stages {
            let _ = write!(line, ",{:.3e}", row.stage_seconds[stage as usize]);
        }
        self.put_line()?;
        if self.flushed.elapsed() >= FLUSH_AFTER {
            self.flush()?;
        }
        Ok(())
    }

    fn put_line(&mut self) -> Result<(), RunError> {
        self.line.push('\n');
        self.file.write_all(self.line.as_bytes()).map_err(|e| output_error(&self.path, e))
    }

    /// Hands all rows to the system.
    pub fn flush(&mut self) -> Result<(), RunError> {
        self.flushed = Instant::now();
        self.file.flush().map_err(|e| output_error(&self.path, e))
    }
}
