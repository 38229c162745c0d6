//! What can go wrong with a needle scene.

use stylet_mesh::CellId;

/// Why a scene cannot be run or a run cannot go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NeedleError {
    /// The scene file, a key or a `--set`.
    #[error(transparent)]
    Scene(#[from] stylet_scene::SceneError),
    /// Keys that do not go together.
    #[error("{source_name}: {reason}")]
    Inconsistent {
        /// The file or built-in scene.
        source_name: String,
        /// The key, what was found, what was expected.
        reason: String,
    },
    /// A probe outside the body.
    #[error("--probe: found ({x}, {y}), expected a point of the undeformed slab, 0 to {side} m each way")]
    Probe {
        /// Coordinate, m.
        x: f64,
        /// Coordinate, m.
        y: f64,
        /// Side of the slab, m.
        side: f64,
    },
    /// A state file that cannot be used.
    #[error("{path}: {reason}")]
    State {
        /// The file.
        path: String,
        /// What was found and what was expected.
        reason: String,
    },
    /// A file or folder that cannot be written.
    #[error("{path}: {reason}")]
    Output {
        /// The file or folder.
        path: String,
        /// What the system says.
        reason: String,
    },
    /// The mesh could not be made or refined.
    #[error("cycle {cycle}: {reason}")]
    Mesh {
        /// Cycle, 0 before the first.
        cycle: usize,
        /// What the mesh layer says.
        reason: String,
    },
    /// An equilibrium that cannot be found because a cell stands at the limit of inversion.
    #[error("cycle {cycle}: element {} of reference centre ({}) m is inverting (det F = {det_f:.3e}) and blocks the solve; {reason}", cell.0, coordinates(centre))]
    Inverting {
        /// Cycle, from 1.
        cycle: usize,
        /// The cell with the smallest det F.
        cell: CellId,
        /// Its centre in the undeformed body, m.
        centre: Vec<f64>,
        /// Its det F.
        det_f: f64,
        /// What the method says.
        reason: String,
    },
    /// An equilibrium that cannot be found because a cell is deformed further than its material can be.
    #[error("cycle {cycle}: element {} of reference centre ({}) m has left the domain of its material; {reason}", cell.0, coordinates(centre))]
    OutsideDomain {
        /// Cycle, from 1.
        cycle: usize,
        /// The cell.
        cell: CellId,
        /// Its centre in the undeformed body, m.
        centre: Vec<f64>,
        /// What the method says.
        reason: String,
    },
    /// An equilibrium that cannot be found for another reason.
    #[error("cycle {cycle}: {reason}")]
    Solve {
        /// Cycle, from 1.
        cycle: usize,
        /// What the method says.
        reason: String,
    },
}

impl NeedleError {
    /// Whether the input is at fault (exit code 2), and not the computation (exit code 3).
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Mesh { .. } | Self::Inverting { .. } | Self::OutsideDomain { .. } | Self::Solve { .. })
    }
}

/// Coordinates to four decimals, with commas between.
fn coordinates(point: &[f64]) -> String {
    let words: Vec<String> = point.iter().map(|x| format!("{x:.4}")).collect();
    words.join(", ")
}
