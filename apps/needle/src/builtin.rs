//! The scenes that come with the program, and reading scenes from files.

use crate::check;
use crate::error::NeedleError;
use crate::keys::TABLE;
use crate::scene::{Scene, Tissue};
use crate::simulation;
use crate::state::State;
use stylet_tissue::source::{self, BuiltIn, Source};
use stylet_tissue::state::{Saved, check_same_scene};
use stylet_tissue::{Scenario, Simulation};

/// The needle scenes that come with the program.
pub const SCENES: &[BuiltIn] = &[
    BuiltIn {
        name: "slab2d-static",
        about: "a static load along the needle's line in an adaptive slab (Fig 6.9 of Nienhuys, 2003)",
        toml: include_str!("../scenes/slab2d-static.toml"),
    },
    BuiltIn {
        name: "slab2d-insertion",
        about: "a needle pushed 70 mm into a slab that refines itself around the tip (Table 6.5)",
        toml: include_str!("../scenes/slab2d-insertion.toml"),
    },
    BuiltIn {
        name: "slab2d-tilted",
        about: "a static load along a line that no mesh edge follows (Table 6.6)",
        toml: include_str!("../scenes/slab2d-tilted.toml"),
    },
    BuiltIn {
        name: "slab2d-sideways",
        about: "a needle pushed sideways into a standing slab: large deformations (Fig 6.12)",
        toml: include_str!("../scenes/slab2d-sideways.toml"),
    },
    BuiltIn {
        name: "cube3d-insertion",
        about: "a needle of 1 mm radius pushed 65 mm into a cube that refines itself around it (Figs 6.13 and 6.14)",
        toml: include_str!("../scenes/cube3d-insertion.toml"),
    },
];

/// The built-in scene of this name.
pub fn built_in(name: &str) -> Option<&'static BuiltIn> {
    SCENES.iter().find(|scene| scene.name == name)
}

/// Reads a built-in scene or a TOML file, with `key=value` assignments on top, and checks that its keys go together.
///
/// # Errors
/// [`NeedleError`] in one line: the file, the key or line, what was found and what was expected.
pub fn open(name_or_path: &str, assignments: &[String]) -> Result<Scene, NeedleError> {
    read(&source::find(name_or_path, SCENES)?, assignments)
}

/// Reads the text of a scene, with `key=value` assignments on top, and checks that its keys go together.
///
/// # Errors
/// As [`open`].
pub fn read(source: &Source, assignments: &[String]) -> Result<Scene, NeedleError> {
    let mut scene = Scene { name: source.name.clone(), ..Scene::default() };
    TABLE.read(&source.label, &source.text, &mut scene)?;
    for assignment in assignments {
        TABLE.set(&mut scene, assignment)?;
    }
    check::check(&scene, &source.label)?;
    Ok(scene)
}

impl Scene {
    /// A saved state of this scene.
    fn saved_state<const D: usize, const N: usize>(&self, saved: &Saved) -> Result<State<D, N>, NeedleError> {
        let refuse = |reason| NeedleError::State { path: "state".to_owned(), reason };
        let mut state = State::from_saved(saved).map_err(refuse)?;
        check_same_scene(&TABLE, &state.scene, self).map_err(refuse)?;
        // Name and output of the run are those of today.
        state.scene = self.clone();
        Ok(state)
    }
}

impl Scenario for Scene {
    fn name(&self) -> &str {
        &self.name
    }

    fn dim(&self) -> usize {
        self.mesh.dimensions()
    }

    fn frames_every(&self) -> usize {
        self.output.as_ref().map_or(0, |output| usize::try_from(output.frames).unwrap_or(0))
    }

    fn check_probes(&self, probes: &[Vec<f64>]) -> Result<(), NeedleError> {
        check::check_probes(self, probes)
    }

    fn start(&self, threads: usize) -> Result<Box<dyn Simulation>, NeedleError> {
        Ok(match self.mesh.kind {
            Tissue::Slab => simulation::start(self, threads)?,
            Tissue::Cube => simulation::start_cube(self, threads)?,
        })
    }

    fn resume(&self, saved: &Saved, threads: usize) -> Result<Box<dyn Simulation>, NeedleError> {
        Ok(match self.mesh.kind {
            Tissue::Slab => simulation::resume(self.saved_state(saved)?, threads)?,
            Tissue::Cube => simulation::resume_cube(self.saved_state(saved)?, threads)?,
        })
    }

    fn unreached(&self) -> String {
        let solver = &self.solver;
        format!("solver.tolerance = {:e} within solver.max_iterations = {}", solver.tolerance, solver.max_iterations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_scenes_are_sound_and_survive_writing() {
        for built_in in SCENES {
            let scene = open(built_in.name, &[]).unwrap();
            let mut again = Scene { name: scene.name.clone(), ..Scene::default() };
            TABLE.read("written", &TABLE.write(&scene), &mut again).unwrap();
            assert_eq!(scene, again);
        }
    }
}
