//! Back to the last good state: a step that fails half way leaves the mesh between two states. An old state is kept, and the steps
//! from there are made again, with the same bits.

use super::settings::settings;
use super::{Run, motions};
use crate::builtin::Setup;
use crate::scene::PreconditionerKind;
use crate::tissue;
use crate::two_level::TwoLevelSteps;
use stylet_physics::insertion::{Insertion, InsertionState};
use stylet_physics::material::Solid;
use stylet_solver::team::Team;

/// Steps from one state that is kept to the next: its copy costs about as much as a step.
const EVERY: usize = 256;

/// A state that is kept.
pub(super) struct Checkpoint {
    steps: usize,
    state: InsertionState,
}

impl Checkpoint {
    pub fn of(steps: usize, insertion: &Insertion<Solid>) -> Self {
        Self { steps, state: insertion.save() }
    }

    /// Keeps the state of now, if the one that is kept is old.
    pub fn follow(&mut self, steps: usize, insertion: &Insertion<Solid>) {
        if steps >= self.steps + EVERY {
            *self = Self::of(steps, insertion);
        }
    }
}

impl Run {
    /// Goes back to the end of the last step that was counted. Where that cannot be done the state stays as it is.
    pub(super) fn go_back(&mut self) {
        let team = Team::new(self.threads);
        let Ok(mut insertion) = revive(&self.opened, self.checkpoint.state.clone(), &team) else { return };
        precondition(&self.opened, &mut insertion);
        let h = self.opened.scene.time.dt;
        let again = (self.checkpoint.steps..self.steps)
            .try_for_each(|step| insertion.step(&motions(&self.opened, step), h).map(|_| ()));
        if again.is_ok() {
            self.insertion = insertion;
        }
    }
}

/// Needles and tissue as they were saved.
pub(super) fn revive(opened: &Setup, saved: InsertionState, team: &Team) -> Result<Insertion<Solid>, String> {
    let body = tissue::body(saved.mesh(), &opened.tissues, &opened.scene, team)?;
    Insertion::resume(saved, body, settings(opened), opened.fields.clone(), [0.0; 3], team)
        .map_err(|error| error.to_string())
}

/// The preconditioner of the scene.
pub(super) fn precondition(opened: &Setup, insertion: &mut Insertion<Solid>) {
    if opened.scene.solver.preconditioner == PreconditionerKind::TwoLevel {
        insertion.integrator().set_preconditioner(TwoLevelSteps::default());
    }
}
