//! What a cycle says of itself, and how it stands in a row of the history.

use crate::needle::Vec2;
use crate::scene::{Method, Model, PreconditionerKind, Scene};
use crate::stages::Stage;
use stylet_tissue::history::{Columns, HistoryRow};

/// One cycle of the loop.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct CycleRow {
    /// Cycle, from 1.
    pub step: usize,
    /// Insertion of the tip along the axis, m.
    pub depth_m: f64,
    /// The tip, m.
    pub tip: Vec2,
    /// Force at the base, N.
    pub base_force: Vec2,
    /// Moment at the base, N m.
    pub base_torque: f64,
    /// Iterations of conjugate gradients in this cycle.
    pub iterations: u64,
    /// Cycles at this position of the base, this one included.
    pub cycles: u64,
    /// Needle nodes at the end of this cycle.
    pub needle_nodes: usize,
    /// Mesh vertices.
    pub nodes: usize,
    /// Triangles.
    pub elements: usize,
}

const QUANTITIES: [&str; 6] = ["depth_m", "tip_x", "tip_y", "base_force_x", "base_force_y", "base_torque"];

impl From<CycleRow> for HistoryRow {
    fn from(row: CycleRow) -> Self {
        let ([tip_x, tip_y], [force_x, force_y]) = (row.tip, row.base_force);
        Self {
            step: row.step,
            quantities: vec![row.depth_m, tip_x, tip_y, force_x, force_y, row.base_torque],
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
pub fn depth_and_force(row: &HistoryRow) -> (f64, Vec2) {
    match row.quantities[..] {
        [depth, _, _, x, y, _] => (depth, [x, y]),
        _ => (f64::NAN, [f64::NAN; 2]),
    }
}

/// The columns of a needle scene.
pub(crate) fn columns(scene: &Scene) -> Columns {
    Columns { quantities: QUANTITIES.to_vec(), counts: vec!["needle_nodes"], stages: stages_of_a_step(scene) }
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
