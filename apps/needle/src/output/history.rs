//! `history.csv`: one row a cycle.

use super::output_error;
use crate::error::NeedleError;
use crate::scene::{Method, Model, PreconditionerKind, Scene};
use crate::stages::{Stage, Stages};
use crate::summary::HistoryRow;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const COLUMNS: &str = "step,time_s,depth_m,tip_x,tip_y,base_force_x,base_force_y,base_torque,iterations,cycles,\
                       needle_nodes,nodes,elements";

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
    pub fn create(path: &Path, scene: &Scene) -> Result<Self, NeedleError> {
        let file = File::create(path).map_err(|e| output_error(path, e))?;
        let stages = stages_of_a_step(scene);
        let mut line = COLUMNS.to_owned();
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
    pub fn write(&mut self, row: &HistoryRow) -> Result<(), NeedleError> {
        let line = &mut self.line;
        line.clear();
        // Writing to a string cannot fail.
        let _ = write!(line, "{}", row.step);
        let [[tip_x, tip_y], [force_x, force_y]] = [row.tip, row.base_force];
        for number in [row.time_s, row.depth_m, tip_x, tip_y, force_x, force_y, row.base_torque] {
            let _ = write!(line, ",{number:?}");
        }
        let _ = write!(line, ",{},{},{},{},{}", row.iterations, row.cycles, row.needle_nodes, row.nodes, row.elements);
        for &stage in &self.stages {
            let _ = write!(line, ",{:.3e}", row.stage_seconds[stage as usize]);
        }
        self.put_line()?;
        if self.flushed.elapsed() >= FLUSH_AFTER {
            self.flush()?;
        }
        Ok(())
    }

    fn put_line(&mut self) -> Result<(), NeedleError> {
        self.line.push('\n');
        self.file.write_all(self.line.as_bytes()).map_err(|e| output_error(&self.path, e))
    }

    /// Hands all rows to the system.
    pub fn flush(&mut self) -> Result<(), NeedleError> {
        self.flushed = Instant::now();
        self.file.flush().map_err(|e| output_error(&self.path, e))
    }
}

/// The stages that a step of this scene can run, in their order. Those before the first step are in the summary.
fn stages_of_a_step(scene: &Scene) -> Vec<Stage> {
    let nonlinear = scene.material.model != Model::Linear;
    let never_linearized =
        scene.solver.method == Some(Method::NonlinearCg) && scene.solver.preconditioner == PreconditionerKind::None;
    let inserted = scene.friction.is_some();
    let relocated = scene.needle.as_ref().is_some_and(|needle| needle.relocate);
    [
        (Stage::Move, inserted),
        (Stage::Locate, inserted),
        (Stage::Refine, inserted),
        (Stage::Capture, inserted),
        (Stage::Relocate, inserted && relocated),
        (Stage::Solve, true),
        (Stage::Force, nonlinear),
        (Stage::Linearize, nonlinear && !never_linearized),
        (Stage::Rearrange, inserted),
        (Stage::Release, inserted),
    ]
    .into_iter()
    .filter_map(|(stage, runs)| runs.then_some(stage))
    .collect()
}
