//! What can go wrong with a scene and its run.

use stylet_mesh::CellId;

/// Why a scene cannot be run or a run cannot go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
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
    #[error("--probe: found {}, expected a point of the undeformed {body}", point(at))]
    Probe {
        /// The point, m.
        at: Vec<f64>,
        /// The body and its extent.
        body: String,
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
    #[error("cycle {cycle}: element {} of reference centre {} m is inverting (det F = {det_f:.3e}) and blocks the solve; {reason}", cell.0, rounded(centre))]
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
    #[error("cycle {cycle}: element {} of reference centre {} m has left the domain of its material; {reason}", cell.0, rounded(centre))]
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
    /// A step of a body that cannot be made, and why as far as it is known.
    #[error("step {step}: {reason}")]
    Step {
        /// Step, from 1; 0 before the first.
        step: usize,
        /// What was found.
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

impl RunError {
    /// Whether the input is at fault (exit code 2), and not the computation (exit code 3).
    pub fn is_bad_input(&self) -> bool {
        !matches!(
            self,
            Self::Mesh { .. }
                | Self::Step { .. }
                | Self::Inverting { .. }
                | Self::OutsideDomain { .. }
                | Self::Solve { .. }
        )
    }
}

/// `(0.1, 0.2)`
fn point(at: &[f64]) -> String {
    list(at.iter().map(f64::to_string))
}

/// `(0.1000, 0.2000)`
fn rounded(at: &[f64]) -> String {
    list(at.iter().map(|x| format!("{x:.4}")))
}

fn list(numbers: impl Iterator<Item = String>) -> String {
    format!("({})", numbers.collect::<Vec<_>>().join(", "))
}
