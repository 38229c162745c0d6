//! Validation across crates: published tables, exact solutions, determinism and stability. The tests are in `tests/`;
//! this library holds what several of them share.

use stylet_needle::simulation::{self, Simulation};
use stylet_needle::{NeedleError, builtin};

/// A built-in scene with assignments on top, at its start.
///
/// # Errors
/// [`NeedleError`] of the scene.
pub fn start(scene: &str, assignments: &[&str], threads: usize) -> Result<Box<dyn Simulation>, NeedleError> {
    let assignments: Vec<String> = assignments.iter().map(|a| (*a).to_owned()).collect();
    simulation::start(&builtin::open(scene, &assignments)?, threads)
}

/// Runs to the end.
///
/// # Errors
/// [`NeedleError`] of a step.
pub fn finish(run: &mut dyn Simulation) -> Result<(), NeedleError> {
    while !run.finished() {
        run.step()?;
    }
    Ok(())
}

/// The bits of a displacement field.
pub fn bits(run: &dyn Simulation) -> Vec<u64> {
    run.displacement().iter().map(|u| u.to_bits()).collect()
}
