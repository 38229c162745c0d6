//! Frames: the deformed mesh and what an application adds as VTU files, and the collections that list them.

use super::{cannot_make_folder, mesh_file_error};
use crate::error::RunError;
use crate::simulation::{FrameSeries, Simulation};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use stylet_mesh::io::Collection;

/// The collections are written again no more often than this, and at the end.
const LIST_AFTER: Duration = Duration::from_secs(1);

/// The frames of a run.
#[derive(Debug)]
pub(super) struct Frames {
    folder: PathBuf,
    /// A frame every so many steps; 0: the last state only.
    every: usize,
    /// Step of each frame that was due, and the time it is listed at. The last state is one more, which a resumed run need not have.
    regular: Vec<(usize, f64)>,
    listed: Option<Instant>,
}

impl Frames {
    /// Makes the folder of the frames. Of `earlier` ones those are kept that are there.
    pub fn create(folder: &Path, every: usize, earlier: Vec<(usize, f64)>) -> Result<Self, RunError> {
        let frames = folder.join("frames");
        std::fs::create_dir_all(&frames).map_err(|e| cannot_make_folder(&frames, &e))?;
        let regular = earlier
            .into_iter()
            .filter(|(step, _)| folder.join(file(FrameSeries::BODY.prefix, *step)).is_file())
            .collect();
        Ok(Self { folder: folder.to_owned(), every, regular, listed: None })
    }

    /// Whether this step is one of those to be shown.
    pub fn is_due(&self, step: usize) -> bool {
        self.every > 0 && step.is_multiple_of(self.every)
    }

    /// Step and time of the frames that were due.
    pub fn regular(&self) -> &[(usize, f64)] {
        &self.regular
    }

    /// Writes the frame of the present state.
    pub fn write(&mut self, simulation: &dyn Simulation) -> Result<(), RunError> {
        let step = simulation.steps();
        self.write_files(simulation, step)?;
        self.regular.push((step, simulation.frame_time()));
        if self.listed.is_none_or(|then| then.elapsed() >= LIST_AFTER) {
            self.list(simulation, None)?;
            self.listed = Some(Instant::now());
        }
        Ok(())
    }

    /// Writes the frame of the last state, if it was not due anyway, and the collections.
    pub fn finish(&mut self, simulation: &dyn Simulation) -> Result<(), RunError> {
        let step = simulation.steps();
        if self.regular.last().is_some_and(|last| last.0 == step) {
            return self.list(simulation, None);
        }
        self.write_files(simulation, step)?;
        self.list(simulation, Some(step))
    }

    fn list(&self, simulation: &dyn Simulation, last: Option<usize>) -> Result<(), RunError> {
        let last = last.map(|step| (step, simulation.frame_time()));
        for FrameSeries { name, prefix } in simulation.frame_series() {
            let mut collection = Collection::default();
            for (step, time) in self.regular.iter().copied().chain(last) {
                collection.push(time, file(prefix, step));
            }
            let path = self.folder.join(format!("{name}.pvd"));
            collection.write(&path).map_err(|e| mesh_file_error(&path, e))?;
        }
        Ok(())
    }

    fn write_files(&self, simulation: &dyn Simulation, step: usize) -> Result<(), RunError> {
        for (index, series) in simulation.frame_series().iter().enumerate() {
            let path = self.folder.join(file(series.prefix, step));
            simulation.write_frame(index, &path)?;
        }
        Ok(())
    }
}

fn file(prefix: &str, step: usize) -> String {
    format!("frames/{prefix}_{step:06}.vtu")
}
