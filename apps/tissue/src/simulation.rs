//! A scene brought to life: the one interface that the command line, the recorder and other programs drive.

use crate::error::RunError;
use crate::history::{Columns, HistoryRow};
use crate::stages::Stages;
use crate::state::Saved;
use crate::summary::Summary;
use std::path::Path;

/// A running scene, whatever its application, dimension and material. Arrays are flat, `dim` numbers a vertex.
pub trait Simulation: Send {
    /// Name of the scene.
    fn name(&self) -> &str;

    /// Dimensions of the body, 2 or 3.
    fn dim(&self) -> usize;

    /// One step: a cycle of an insertion, a time step, the whole solve of a static scene.
    ///
    /// # Errors
    /// [`RunError`] that names the step. The state is then the last one reached, and can be looked at and saved.
    fn step(&mut self) -> Result<HistoryRow, RunError>;

    /// Whether the scene has come to its end.
    fn finished(&self) -> bool;

    /// Steps so far.
    fn steps(&self) -> usize;

    /// The share of the scene that is done, 0 to 1.
    fn progress(&self) -> f64;

    /// Where the run is after the step of `row`, in a few words.
    fn place(&self, row: &HistoryRow) -> String;

    /// The time that frames are listed at in their collections; the step, where a scene has no time.
    fn frame_time(&self) -> f64;

    /// Seconds and calls of each stage so far.
    fn stages(&self) -> &Stages;

    /// What the rows of this scene hold.
    fn columns(&self) -> Columns;

    /// Places of the vertices in the undeformed body, m.
    fn points(&self) -> &[f64];

    /// Vertices of the live cells in ascending order, `dim + 1` of them a cell.
    fn cells(&self) -> Vec<u32>;

    /// Displacements of the vertices, m.
    fn displacement(&self) -> &[f64];

    /// Strain energy, J.
    fn strain_energy(&self) -> f64;

    /// What the run says of itself, with the displacements at `probes`, which have `dim` coordinates each.
    fn summary(&self, probes: &[Vec<f64>]) -> Summary;

    /// All that a later run needs to go on with the same bits.
    ///
    /// # Errors
    /// A sentence, should the encoding fail.
    fn save(&self) -> Result<Saved, String>;

    /// The series of frames that this scene writes, the body first.
    fn frame_series(&self) -> &'static [FrameSeries];

    /// Writes the frame of the present state that belongs to the series of this index.
    ///
    /// # Errors
    /// [`RunError::Output`].
    fn write_frame(&self, series: usize, path: &Path) -> Result<(), RunError>;

    /// Says before the first step that [`draw`](Self::draw) will not be called, so that nothing is kept for it.
    fn forgo_pictures(&mut self) {}

    /// Draws the pictures of a run into `folder`.
    ///
    /// # Errors
    /// [`RunError::Output`].
    fn draw(&self, folder: &Path, rows: &[HistoryRow]) -> Result<(), RunError>;
}

/// Frames of one kind: their collection is `NAME.pvd`, their files are `frames/PREFIX_000123.vtu`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FrameSeries {
    /// Name of the collection.
    pub name: &'static str,
    /// How the names of its files begin.
    pub prefix: &'static str,
}

impl FrameSeries {
    /// The deformed body, the first series of every scene.
    pub const BODY: Self = Self { name: "body", prefix: "step" };
}
