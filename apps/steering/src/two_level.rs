//! Two levels for a mesh whose nodes come and go.

use stylet_physics::dynamics::StepPreconditioner;
use stylet_solver::precondition::aggregation::{Form, Modes, TwoLevel};
use stylet_solver::precondition::{Preconditioner, PreconditionerError};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;

/// Aggregates whose translations are corrected, made anew when the number of nodes changes.
#[derive(Default)]
pub(crate) struct TwoLevelSteps(Option<(usize, TwoLevel<3, 3>)>);

impl Preconditioner for TwoLevelSteps {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.apply_on(&Team::serial(), r, z);
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        match &self.0 {
            Some((_, two)) => two.apply_on(team, r, z),
            None => z.copy_from_slice(r),
        }
    }
}

impl StepPreconditioner<3> for TwoLevelSteps {
    fn follow(&mut self, team: &Team, matrix: &BlockCsr<3>, w: &Subspace<3>) -> Result<(), PreconditionerError> {
        let n = matrix.n_rows();
        match &mut self.0 {
            Some((nodes, two)) if *nodes == n => two.rebuild_on(team, matrix, w),
            _ => {
                self.0 = None;
                let two = TwoLevel::new_on(team, matrix, w, Modes::constants(n), Form::v_cycle(), None)?;
                self.0 = Some((n, two));
                Ok(())
            }
        }
    }

    fn memory_bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |(_, two)| two.memory_bytes())
    }
}
