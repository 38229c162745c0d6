//! What a state file keeps of a needle scene.

use crate::insertion::InsertionState;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use stylet_tissue::state::Saved;

/// The name of this application in a state file, by the dimensions of the tissue.
const fn app<const D: usize>() -> &'static str {
    if D == 2 { "needle" } else { "needle-3d" }
}

/// A run that can be gone on with.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct State<const D: usize, const N: usize> {
    /// The scene.
    pub scene: Scene,
    /// What cannot be derived from it.
    pub experiment: Experiment<D, N>,
}

/// What a scene is doing.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub enum Experiment<const D: usize, const N: usize> {
    /// A static load: one solve, which is done afresh.
    Static,
    /// An insertion.
    Insertion(Box<InsertionState<D, N>>),
}

impl<const D: usize, const N: usize> State<D, N> {
    /// As a state file keeps it.
    ///
    /// # Errors
    /// A sentence, should the encoding fail.
    pub fn to_saved(&self) -> Result<Saved, String> {
        Saved::new(app::<D>(), self)
    }

    /// The state that a file kept.
    ///
    /// # Errors
    /// What was found and what was expected.
    pub fn from_saved(saved: &Saved) -> Result<Self, String> {
        saved.decode(app::<D>())
    }
}
