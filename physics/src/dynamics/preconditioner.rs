//! Preconditioners that follow the matrix of a step.

use stylet_solver::nonlinear::HessianPreconditioner;
use stylet_solver::precondition::aggregation::TwoLevel;
use stylet_solver::precondition::{BlockJacobi, Preconditioner, PreconditionerError};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;

/// A preconditioner that an [`Integrator`](super::Integrator) keeps up to date.
///
/// [`BlockJacobi`] is the choice where mass dominates, up to a few milliseconds for soft tissue; [`TwoLevel`] with the
/// rigid modes of the places at rest takes fewer iterations in longer steps.
pub trait StepPreconditioner<const D: usize>: Preconditioner + Send + Sync {
    /// Follows a change of the matrix and the subspace.
    ///
    /// # Errors
    /// What the preconditioner says; the step is then tried again with half the length.
    fn follow(&mut self, team: &Team, matrix: &BlockCsr<D>, w: &Subspace<D>) -> Result<(), PreconditionerError>;

    /// Bytes that it takes, spare room included.
    fn memory_bytes(&self) -> usize;
}

impl<const D: usize> StepPreconditioner<D> for BlockJacobi<D> {
    fn follow(&mut self, _: &Team, matrix: &BlockCsr<D>, w: &Subspace<D>) -> Result<(), PreconditionerError> {
        BlockJacobi::follow(self, matrix, w)
    }

    fn memory_bytes(&self) -> usize {
        BlockJacobi::memory_bytes(self)
    }
}

impl<const D: usize, const M: usize> StepPreconditioner<D> for TwoLevel<D, M> {
    fn follow(&mut self, team: &Team, matrix: &BlockCsr<D>, w: &Subspace<D>) -> Result<(), PreconditionerError> {
        self.rebuild_on(team, matrix, w)
    }

    fn memory_bytes(&self) -> usize {
        TwoLevel::memory_bytes(self)
    }
}

/// The form in which Newton's method takes it.
pub(super) struct Followed<'a, const D: usize> {
    pub team: &'a Team,
    pub inner: &'a mut dyn StepPreconditioner<D>,
}

impl<const D: usize> Preconditioner for Followed<'_, D> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.inner.apply(r, z);
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        self.inner.apply_on(team, r, z);
    }
}

impl<const D: usize> HessianPreconditioner<D> for Followed<'_, D> {
    fn follow(&mut self, hessian: &BlockCsr<D>, w: &Subspace<D>) -> bool {
        self.inner.follow(self.team, hessian, w).is_ok()
    }
}
