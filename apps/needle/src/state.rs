//! What a state file keeps of a needle scene.

use crate::insertion::InsertionState;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use stylet_tissue::state::Saved;

/// The name of this application in a state file.
pub(crate) const APP: &str = "needle";

/// A run that can be gone on with.
#[derive(Clone, Serialize, Deserialize)]
pub struct State {
    /// The scene.
    pub scene: Scene,
    /// What cannot be derived from it.
    pub experiment: Experiment,
}

/// What a scene is doing.
#[derive(Clone, Serialize, Deserialize)]
pub enum Experiment {
    /// A static load: one solve, which is done afresh.
    Static,
    /// An insertion.
    Insertion(Box<InsertionState>),
}

impl State {
    /// As a state file keeps it.
    ///
    /// # Errors
    /// A sentence, should the encoding fail.
    pub fn to_saved(&self) -> Result<Saved, String> {
        Saved::new(APP, self)
    }

    /// The state that a file kept.
    ///
    /// # Errors
    /// What was found and what was expected.
    pub fn from_saved(saved: &Saved) -> Result<Self, String> {
        saved.decode(APP)
    }
}
