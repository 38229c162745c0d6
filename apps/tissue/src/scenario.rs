//! A scene that was read and checked, and can be started.

use crate::error::RunError;
use crate::simulation::Simulation;
use crate::state::Saved;

/// A scene of some application, ready to run.
pub trait Scenario {
    /// Its name.
    fn name(&self) -> &str;

    /// Dimensions of its body, 2 or 3.
    fn dim(&self) -> usize;

    /// What is legal but hardly meant, a line each: the key, what was found and what was expected.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// A frame every so many steps; 0: the last state only.
    fn frames_every(&self) -> usize;

    /// Checks the points whose displacement is asked for, of [`dim`](Self::dim) coordinates each.
    ///
    /// # Errors
    /// [`RunError::Probe`] for a point outside the undeformed body.
    fn check_probes(&self, probes: &[Vec<f64>]) -> Result<(), RunError>;

    /// Makes the starting state. `threads` is the most that any stage may use.
    ///
    /// # Errors
    /// [`RunError`] if a layer below refuses.
    fn start(&self, threads: usize) -> Result<Box<dyn Simulation>, RunError>;

    /// Goes on from a saved state of this scene, with the same bits as the run that was saved.
    ///
    /// # Errors
    /// [`RunError::State`] if the state is one of another scene, or does not fit together.
    fn resume(&self, saved: &Saved, threads: usize) -> Result<Box<dyn Simulation>, RunError>;

    /// What a solve that ran out of iterations did not reach, and within what: keys and values.
    fn unreached(&self) -> String;
}
