//! The files of a run: history, frames for ParaView, state files, summary and pictures.
//!
//! ```text
//! OUT/summary.json              the run in numbers
//! OUT/history.csv               one row a cycle
//! OUT/body.pvd, needle.pvd      collections of the frames, to be opened in ParaView
//! OUT/frames/step_000123.vtu    the deformed mesh with displacement and stress
//! OUT/frames/needle_000123.vtu  the needle
//! OUT/state/step_000123.state   what `--resume` goes on from
//! OUT/mesh.svg, force.svg, iterations.svg
//! ```

mod frames;
mod history;

use crate::error::NeedleError;
use crate::picture;
use crate::scene::Scene;
use crate::simulation::Simulation;
use crate::state::State;
use crate::summary::{HistoryRow, Summary};
use frames::Frames;
use history::History;
use std::io;
use std::path::{Path, PathBuf};

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
    /// Makes the folder of a new run. A state is saved every `save_every` cycles and at the end, or never.
    ///
    /// # Errors
    /// [`NeedleError::Output`] names the file or folder that cannot be written.
    pub fn create(folder: &Path, scene: &Scene, save_every: Option<usize>) -> Result<Self, NeedleError> {
        Self::resume(folder, scene, save_every, Vec::new(), Vec::new())
    }

    /// Goes on with the rows and the frames of a saved state. Rows are written anew; frames that are not in this folder
    /// are left out of the collections.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn resume(
        folder: &Path,
        scene: &Scene,
        save_every: Option<usize>,
        rows: Vec<HistoryRow>,
        frames: Vec<(usize, String)>,
    ) -> Result<Self, NeedleError> {
        std::fs::create_dir_all(folder).map_err(|e| cannot_make_folder(folder, &e))?;
        let every = scene.output.as_ref().map_or(0, |output| output.frames);
        let mut history = History::create(&folder.join("history.csv"), scene)?;
        for row in &rows {
            history.write(row)?;
        }
        history.flush()?;
        Ok(Self {
            history,
            rows,
            frames: Frames::create(folder, usize::try_from(every).unwrap_or(0), frames)?,
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

    /// The cycles so far, those before a resumption included.
    pub fn rows(&self) -> &[HistoryRow] {
        &self.rows
    }

    /// Has [`finish`](Self::finish) save the last state even if no states were asked for: for a run that was interrupted.
    pub fn keep_last_state(&mut self) {
        self.keep_last = true;
    }

    /// Takes note of a cycle, and writes the frame and the state that are due.
    ///
    /// # Errors
    /// [`NeedleError::Output`].
    pub fn record(&mut self, row: &HistoryRow, simulation: &dyn Simulation) -> Result<(), NeedleError> {
        self.rows.push(*row);
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
    /// amid a cycle, which no later run could go on from), summary and pictures.
    ///
    /// # Errors
    /// The first [`NeedleError::Output`]; the other files are written all the same.
    pub fn finish(&mut self, simulation: &dyn Simulation, summary: &Summary) -> Result<(), NeedleError> {
        let wants_state = self.keep_last && summary.failure.is_none();
        let results = [
            self.history.flush(),
            self.frames.finish(simulation),
            if wants_state { self.save(simulation) } else { Ok(()) },
            self.write_summary(summary),
            self.write_pictures(simulation),
        ];
        results.into_iter().collect()
    }

    fn save(&mut self, simulation: &dyn Simulation) -> Result<(), NeedleError> {
        let step = simulation.steps();
        if self.saved == Some(step) {
            return Ok(());
        }
        let folder = self.folder.join("state");
        std::fs::create_dir_all(&folder).map_err(|e| cannot_make_folder(&folder, &e))?;
        let state = State { rows: self.rows.clone(), frames: self.frames.regular().to_vec(), ..simulation.save() };
        state.write(&folder.join(format!("step_{step:06}.state")))?;
        self.saved = Some(step);
        Ok(())
    }

    fn write_summary(&self, summary: &Summary) -> Result<(), NeedleError> {
        let path = self.folder.join("summary.json");
        let mut text = serde_json::to_string_pretty(summary).map_err(|e| output_error(&path, e))?;
        text.push('\n');
        write_atomically(&path, text.as_bytes())
    }

    /// A picture of the mesh, and charts over the cycles where there are several.
    fn write_pictures(&self, simulation: &dyn Simulation) -> Result<(), NeedleError> {
        let path = self.folder.join("mesh.svg");
        picture::mesh(simulation, &path).map_err(|e| plot_error(&path, e))?;
        if self.rows.len() < 2 {
            return Ok(());
        }
        let charts = [
            ("force.svg", picture::force(simulation, &self.rows)),
            ("iterations.svg", picture::iterations(simulation, &self.rows)),
        ];
        for (name, chart) in charts {
            let path = self.folder.join(name);
            chart.write(&path).map_err(|e| plot_error(&path, e))?;
        }
        Ok(())
    }
}

/// Writes a file by way of a temporary one beside it, so that a crash leaves the old file or the new one.
///
/// # Errors
/// [`NeedleError::Output`] names the file; no temporary file is left.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), NeedleError> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(format!(".{}.part", std::process::id()));
    let written = std::fs::write(&temporary, bytes).and_then(|()| std::fs::rename(&temporary, path));
    written.map_err(|e| {
        // The first error is the one to report.
        let _ = std::fs::remove_file(&temporary);
        output_error(path, e)
    })
}

fn output_error(path: &Path, reason: impl std::fmt::Display) -> NeedleError {
    NeedleError::Output { path: path.display().to_string(), reason: reason.to_string() }
}

fn cannot_make_folder(folder: &Path, error: &io::Error) -> NeedleError {
    // The system would say "File exists" of a file that stands where the folder should be.
    if folder.exists() {
        return output_error(folder, "found a file, expected a folder for the files of the run");
    }
    output_error(folder, format!("cannot make this folder: {error}"))
}

fn plot_error(path: &Path, error: stylet_plot::PlotError) -> NeedleError {
    match error {
        stylet_plot::PlotError::Write { path, error } => output_error(&path, error),
        other => output_error(path, other),
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
            let error = Recorder::create(&folder, &Scene::default(), None).unwrap_err();
            assert!(
                matches!(&error, NeedleError::Output { path, .. } if *path == folder.display().to_string()),
                "{error}"
            );
        }
        std::fs::remove_file(&file).unwrap();
    }
}
