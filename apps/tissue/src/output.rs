//! The files of a run: history, frames for ParaView, state files, summary and pictures.
//!
//! ```text
//! OUT/summary.json              the run in numbers
//! OUT/history.csv               one row a step
//! OUT/body.pvd, ...             collections of the frames, to be opened in ParaView
//! OUT/frames/step_000123.vtu    the deformed mesh with displacement and stress; others by application
//! OUT/state/step_000123.state   what `--resume` goes on from
//! OUT/mesh.svg, ...             pictures, by application
//! ```

mod frames;
mod history;

use crate::error::RunError;
use crate::history::{Columns, HistoryRow};
use crate::simulation::Simulation;
use crate::state::State;
use crate::summary::Summary;
use frames::Frames;
use history::History;
use std::io;
use std::path::{Path, PathBuf};
use stylet_mesh::io::IoError;

/// Writes the files of one run into one folder.
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    history: History,
    rows: Vec<HistoryRow>,
    frames: Frames,
    save_every: Option<usize>,
    keep_last: bool,
    saved: Option<usize>,
}

impl Recorder {
    /// Makes the folder of a new run, with a frame every `frames_every` steps (0: of the last state only). A state is
    /// saved every `save_every` steps and at the end, or never.
    ///
    /// # Errors
    /// [`RunError::Output`] names the file or folder that cannot be written.
    pub fn create(
        folder: &Path,
        columns: &Columns,
        frames_every: usize,
        save_every: Option<usize>,
    ) -> Result<Self, RunError> {
        Self::resume(folder, columns, frames_every, save_every, Vec::new(), Vec::new())
    }

    /// Goes on with the rows and the frames of a saved state. Rows are written anew; frames that are not in this folder
    /// are left out of the collections.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn resume(
        folder: &Path,
        columns: &Columns,
        frames_every: usize,
        save_every: Option<usize>,
        rows: Vec<HistoryRow>,
        frames: Vec<(usize, f64)>,
    ) -> Result<Self, RunError> {
        std::fs::create_dir_all(folder).map_err(|e| cannot_make_folder(folder, &e))?;
        let mut history = History::create(&folder.join("history.csv"), columns)?;
        for row in &rows {
            history.write(row)?;
        }
        history.flush()?;
        Ok(Self {
            history,
            rows,
            frames: Frames::create(folder, frames_every, frames)?,
            keep_last: save_every.is_some(),
            save_every: save_every.filter(|&every| every > 0),
            saved: None,
            folder: folder.to_owned(),
        })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The steps so far, those before a resumption included.
    pub fn rows(&self) -> &[HistoryRow] {
        &self.rows
    }

    /// Has [`finish`](Self::finish) save the last state even if no states were asked for: for a run that was interrupted.
    pub fn keep_last_state(&mut self) {
        self.keep_last = true;
    }

    /// Takes note of a step, and writes the frame and the state that are due.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn record(&mut self, row: &HistoryRow, simulation: &dyn Simulation) -> Result<(), RunError> {
        self.rows.push(row.clone());
        self.history.write(row)?;
        if self.frames.is_due(row.step) {
            self.history.flush()?;
            self.frames.write(simulation)?;
        }
        if self.save_every.is_some_and(|every| row.step.is_multiple_of(every)) {
            self.history.flush()?;
            self.save(simulation)?;
        }
        Ok(())
    }

    /// Writes what belongs to the end of a run, whatever ended it: the last frame, the last state (unless the run failed
    /// amid a step, which no later run could go on from), summary and pictures.
    ///
    /// # Errors
    /// The first [`RunError::Output`]; the other files are written all the same.
    pub fn finish(&mut self, simulation: &dyn Simulation, summary: &Summary) -> Result<(), RunError> {
        let wants_state = self.keep_last && summary.failure.is_none();
        let results = [
            self.history.flush(),
            self.frames.finish(simulation),
            if wants_state { self.save(simulation) } else { Ok(()) },
            self.write_summary(summary),
            simulation.draw(&self.folder, &self.rows),
        ];
        results.into_iter().collect()
    }

    fn save(&mut self, simulation: &dyn Simulation) -> Result<(), RunError> {
        let step = simulation.steps();
        if self.saved == Some(step) {
            return Ok(());
        }
        let folder = self.folder.join("state");
        std::fs::create_dir_all(&folder).map_err(|e| cannot_make_folder(&folder, &e))?;
        let path = folder.join(format!("step_{step:06}.state"));
        let saved = simulation.save().map_err(|e| output_error(&path, e))?;
        let state = State { saved, rows: self.rows.clone(), frames: self.frames.regular().to_vec() };
        state.write(&path)?;
        self.saved = Some(step);
        Ok(())
    }

    fn write_summary(&self, summary: &Summary) -> Result<(), RunError> {
        let path = self.folder.join("summary.json");
        let mut text = serde_json::to_string_pretty(summary).map_err(|e| output_error(&path, e))?;
        text.push('\n');
        write_atomically(&path, text.as_bytes())
    }
}

/// Writes a file by way of a temporary one beside it, so that a crash leaves the old file or the new one.
///
/// # Errors
/// [`RunError::Output`] names the file; no temporary file is left.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(format!(".{}.part", std::process::id()));
    let written = std::fs::write(&temporary, bytes).and_then(|()| std::fs::rename(&temporary, path));
    written.map_err(|e| {
        // The first error is the one to report.
        let _ = std::fs::remove_file(&temporary);
        output_error(path, e)
    })
}

/// The error of a file that cannot be written.
pub fn output_error(path: &Path, reason: impl std::fmt::Display) -> RunError {
    RunError::Output { path: path.display().to_string(), reason: reason.to_string() }
}

fn cannot_make_folder(folder: &Path, error: &io::Error) -> RunError {
    // The system would say "File exists" of a file that stands where the folder should be.
    if folder.exists() {
        return output_error(folder, "found a file, expected a folder for the files of the run");
    }
    output_error(folder, format!("cannot make this folder: {error}"))
}

/// The error of a picture that cannot be drawn or written.
pub fn plot_error(path: &Path, error: stylet_plot::PlotError) -> RunError {
    match error {
        stylet_plot::PlotError::Write { path, error } => output_error(&path, error),
        other => output_error(path, other),
    }
}

/// The error of a mesh file or a collection that cannot be written, its path named once.
pub fn mesh_file_error(path: &Path, error: IoError) -> RunError {
    match error {
        IoError::System { path, source } => output_error(&path, source),
        other => {
            let text = other.to_string();
            let named = format!("{}: ", path.display());
            output_error(path, text.strip_prefix(&named).unwrap_or(&text))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_leaves_the_new_file_and_nothing_else() {
        let folder = std::env::temp_dir().join(format!("stylet-output-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.txt");
        write_atomically(&path, b"old").unwrap();
        write_atomically(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        // A folder cannot be replaced by a file: the error names it, and the temporary file is gone.
        let taken = folder.join("taken");
        std::fs::create_dir_all(taken.join("inside")).unwrap();
        let error = write_atomically(&taken, b"new").unwrap_err().to_string();
        assert!(error.contains("taken"), "{error}");
        let mut names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["a.txt", "taken"]);
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_file_in_the_way_is_named() {
        let file = std::env::temp_dir().join(format!("stylet-in-the-way-{}", std::process::id()));
        std::fs::write(&file, "x").unwrap();
        for folder in [file.clone(), file.join("below")] {
            let error = Recorder::create(&folder, &Columns::default(), 0, None).unwrap_err();
            assert!(
                matches!(&error, RunError::Output { path, .. } if *path == folder.display().to_string()),
                "{error}"
            );
        }
        std::fs::remove_file(&file).unwrap();
    }
}
