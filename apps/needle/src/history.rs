//! What a cycle says of itself, and how it stands in a row of the history.

use crate::scene::{Method, Model, PreconditionerKind, Scene};
use crate::shaft::Hold;
use crate::stages::Stage;
use stylet_tissue::history::{Columns, HistoryRow};

/// One cycle of the loop.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CycleRow<const D: usize> {
    /// Cycle, from 1.
    pub step: usize,
    /// Insertion of the tip along the axis, m.
    pub depth_m: f64,
    /// The tip, m.
    pub tip: [f64; D],
    /// Force and moment at the base.
    pub held_by: Hold<D>,
    /// Iterations of conjugate gradients in this cycle.
    pub iterations: u64,
    /// Cycles at this position of the base, this one included.
    pub cycles: u64,
    /// Needle nodes at the end of this cycle.
    pub needle_nodes: usize,
    /// Mesh vertices.
    pub nodes: usize,
    /// Cells.
    pub elements: usize,
}

const IN_THE_PLANE: [&str; 6] = ["depth_m", "tip_x", "tip_y", "base_force_x", "base_force_y", "base_torque"];
const IN_SPACE: [&str; 10] = [
    "depth_m",
    "tip_x",
    "tip_y",
    "tip_z",
    "base_force_x",
    "base_force_y",
    "base_force_z",
    "base_torque_x",
    "base_torque_y",
    "base_torque_z",
];

impl<const D: usize> From<CycleRow<D>> for HistoryRow {
    fn from(row: CycleRow<D>) -> Self {
        let mut quantities = vec![row.depth_m];
        quantities.extend(row.tip.iter().chain(&row.held_by.force).chain(row.held_by.moment_components()));
        Self {
            step: row.step,
            quantities,
            iterations: row.iterations,
            cycles: row.cycles,
            counts: vec![row.needle_nodes as u64],
            nodes: row.nodes,
            elements: row.elements,
            ..Self::default()
        }
    }
}

/// Insertion of the tip (m) and force at the base (N) of a row of a needle scene; NaN in any other row.
pub fn depth_and_force<const D: usize>(row: &HistoryRow) -> (f64, [f64; D]) {
    let expected = if D == 2 { IN_THE_PLANE.len() } else { IN_SPACE.len() };
    if row.quantities.len() != expected {
        return (f64::NAN, [f64::NAN; D]);
    }
    (row.quantities[0], std::array::from_fn(|k| row.quantities[1 + D + k]))
}

/// The columns of a needle scene.
pub(crate) fn columns(scene: &Scene) -> Columns {
    let quantities = if scene.mesh.dimensions() == 2 { IN_THE_PLANE.to_vec() } else { IN_SPACE.to_vec() };
    Columns { quantities, counts: vec!["needle_nodes"], stages: stages_of_a_step(scene) }
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
