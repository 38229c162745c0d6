//! Validation across crates: published tables, exact solutions, determinism and stability. The tests are in `tests/`;
//! this library holds what several of them share.

use stylet_needle::simulation;
use stylet_needle::{NeedleError, builtin};
use stylet_tissue::Simulation;

/// A built-in scene of a slab with assignments on top, at its start.
///
/// # Errors
/// [`NeedleError`] of the scene.
pub fn start(
    scene: &str,
    assignments: &[&str],
    threads: usize,
) -> Result<Box<dyn simulation::Simulation>, NeedleError> {
    simulation::start(&builtin::open(scene, &owned(assignments))?, threads)
}

/// The built-in scene of a cube with assignments on top, at its start.
///
/// # Errors
/// [`NeedleError`] of the scene.
pub fn start_cube(assignments: &[&str], threads: usize) -> Result<Box<dyn simulation::Simulation<3, 4>>, NeedleError> {
    simulation::start_cube(&builtin::open("cube3d-insertion", &owned(assignments))?, threads)
}

fn owned(assignments: &[&str]) -> Vec<String> {
    assignments.iter().map(|a| (*a).to_owned()).collect()
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
