//! Frames: the deformed mesh and the needle as VTU files, and the collections that list them.

use super::{cannot_make_folder, output_error};
use crate::error::NeedleError;
use crate::needle::Needle;
use crate::picture::visible_shaft;
use crate::simulation::Simulation;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use stylet_mesh::SimplexMesh;
use stylet_mesh::io::{Collection, Field, IoError, VtuData, write_vtu};

/// The collections are written again no more often than this, and at the end.
const LIST_AFTER: Duration = Duration::from_secs(1);

/// The frames of a run.
#[derive(Debug)]
pub(super) struct Frames {
    folder: PathBuf,
    /// A frame every so many cycles; 0: the last state only.
    every: usize,
    /// Cycle and file of each frame that was due. The last state is one more, which a resumed run need not have.
    regular: Vec<(usize, String)>,
    listed: Option<Instant>,
}

impl Frames {
    /// Makes the folder of the frames. Of `earlier` ones those are kept that are there.
    pub fn create(folder: &Path, every: usize, earlier: Vec<(usize, String)>) -> Result<Self, NeedleError> {
        let frames = folder.join("frames");
        std::fs::create_dir_all(&frames).map_err(|e| cannot_make_folder(&frames, &e))?;
        let regular = earlier.into_iter().filter(|(step, _)| folder.join(body_file(*step)).is_file()).collect();
        Ok(Self { folder: folder.to_owned(), every, regular, listed: None })
    }

    /// Whether this cycle is one of those to be shown.
    pub fn is_due(&self, step: usize) -> bool {
        self.every > 0 && step.is_multiple_of(self.every)
    }

    /// Cycle and file of the frames that were due.
    pub fn regular(&self) -> &[(usize, String)] {
        &self.regular
    }

    /// Writes the frame of the present state.
    pub fn write(&mut self, simulation: &dyn Simulation) -> Result<(), NeedleError> {
        let step = simulation.steps();
        self.write_files(simulation, step)?;
        self.regular.push((step, body_file(step)));
        if self.listed.is_none_or(|then| then.elapsed() >= LIST_AFTER) {
            self.list(simulation, None)?;
            self.listed = Some(Instant::now());
        }
        Ok(())
    }

    /// Writes the frame of the last state, if it was not due anyway, and the collections.
    pub fn finish(&mut self, simulation: &dyn Simulation) -> Result<(), NeedleError> {
        let step = simulation.steps();
        if self.regular.last().is_some_and(|last| last.0 == step) {
            return self.list(simulation, None);
        }
        self.write_files(simulation, step)?;
        self.list(simulation, Some(step))
    }

    fn list(&self, simulation: &dyn Simulation, last: Option<usize>) -> Result<(), NeedleError> {
        let steps = || self.regular.iter().map(|frame| frame.0).chain(last);
        // Cycles stand for the time that quasi-static scenes do not have.
        let write = |name: &str, file: fn(usize) -> String| {
            let mut collection = Collection::default();
            steps().for_each(|step| collection.push(step as f64, file(step)));
            let path = self.folder.join(name);
            collection.write(&path).map_err(|e| mesh_file_error(&path, e))
        };
        write("body.pvd", body_file)?;
        if simulation.needle().is_some() { write("needle.pvd", needle_file) } else { Ok(()) }
    }

    fn write_files(&self, simulation: &dyn Simulation, step: usize) -> Result<(), NeedleError> {
        let path = self.folder.join(body_file(step));
        write_body(simulation, &path)?;
        let path = self.folder.join(needle_file(step));
        simulation.needle().map_or(Ok(()), |needle| write_needle(simulation, needle, &path))
    }
}

fn body_file(step: usize) -> String {
    format!("frames/step_{step:06}.vtu")
}

fn needle_file(step: usize) -> String {
    format!("frames/needle_{step:06}.vtu")
}

/// Deformed mesh with `displacement` (m), `needle_node` (0 none, 1 slipping or loaded, 2 sticking), the first
/// Piola-Kirchhoff stress `stress_p` (Pa: P11, P12, P21, P22) and `region`.
fn write_body(simulation: &dyn Simulation, path: &Path) -> Result<(), NeedleError> {
    let mesh = simulation.mesh();
    let mut on_needle = vec![0.0; mesh.n_vertex_slots()];
    for (vertex, sticks) in simulation.needle_nodes() {
        on_needle[vertex.index()] = if sticks { 2.0 } else { 1.0 };
    }
    let stresses = simulation.stresses();
    let data = VtuData {
        displacement: Some(simulation.displacement()),
        point_fields: &[Field { name: "needle_node", components: 1, values: &on_needle }],
        cell_fields: &[Field { name: "stress_p", components: 4, values: stresses.as_flattened() }],
    };
    write_vtu(mesh, path, &data).map_err(|e| mesh_file_error(path, e))
}

/// The needle as one line, from a point before the slab to the tip.
fn write_needle(simulation: &dyn Simulation, needle: &Needle<2>, path: &Path) -> Result<(), NeedleError> {
    let ends = visible_shaft(needle, simulation.scene().mesh.side);
    let line = SimplexMesh::<2, 2>::new(ends.to_vec(), vec![[0, 1]]).map_err(|e| output_error(path, e))?;
    write_vtu(&line, path, &VtuData::default()).map_err(|e| mesh_file_error(path, e))
}

fn mesh_file_error(path: &Path, error: IoError) -> NeedleError {
    match error {
        IoError::System { path, source } => output_error(&path, source),
        other => {
            let text = other.to_string();
            let named = format!("{}: ", path.display());
            output_error(path, text.strip_prefix(&named).unwrap_or(&text))
        }
    }
}
