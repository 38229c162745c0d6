//! Preconditioners that follow the Hessian of a Newton iteration.

use crate::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;
use crate::team::Team;

/// The preconditioners that [`newton_cg`](super::newton_cg) brings along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preconditioning {
    /// None.
    None,
    /// [`Jacobi`].
    Jacobi,
    /// [`BlockJacobi`].
    BlockJacobi,
}

/// A preconditioner that is told of every new Hessian.
pub trait HessianPreconditioner<const B: usize>: Preconditioner {
    /// Called once per solve and at every new Hessian. `false` if it cannot follow, as where the Hessian is not positive
    /// definite: the linear solves then go without, up to the next Hessian.
    fn follow(&mut self, hessian: &BlockCsr<B>, w: &Subspace<B>) -> bool;
}

impl<const B: usize> HessianPreconditioner<B> for Identity {
    fn follow(&mut self, _: &BlockCsr<B>, _: &Subspace<B>) -> bool {
        true
    }
}

impl<const B: usize> HessianPreconditioner<B> for Jacobi<B> {
    fn follow(&mut self, hessian: &BlockCsr<B>, w: &Subspace<B>) -> bool {
        self.rebuild(hessian, w).is_ok()
    }
}

impl<const B: usize> HessianPreconditioner<B> for BlockJacobi<B> {
    fn follow(&mut self, hessian: &BlockCsr<B>, w: &Subspace<B>) -> bool {
        BlockJacobi::follow(self, hessian, w).is_ok()
    }
}

/// A preconditioner that stays as it is, whatever the Hessian: one that was factored before, for instance.
#[derive(Clone, Copy, Debug)]
pub struct Kept<'a, M: ?Sized>(
    /// The preconditioner.
    pub &'a M,
);

impl<M: Preconditioner + ?Sized> Preconditioner for Kept<'_, M> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.0.apply(r, z);
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        self.0.apply_on(team, r, z);
    }

    fn is_identity(&self) -> bool {
        self.0.is_identity()
    }
}

impl<const B: usize, M: Preconditioner + ?Sized> HessianPreconditioner<B> for Kept<'_, M> {
    fn follow(&mut self, _: &BlockCsr<B>, _: &Subspace<B>) -> bool {
        true
    }
}

/// A preconditioner that a function brings up to date: `follow(m, hessian, w)` says whether it could.
#[derive(Debug)]
pub struct Following<'a, M, F> {
    /// The preconditioner.
    pub m: &'a mut M,
    /// What makes it follow.
    pub follow: F,
}

impl<M: Preconditioner + Send, F: Sync> Preconditioner for Following<'_, M, F> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.m.apply(r, z);
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        self.m.apply_on(team, r, z);
    }

    fn is_identity(&self) -> bool {
        self.m.is_identity()
    }
}

impl<const B: usize, M, F> HessianPreconditioner<B> for Following<'_, M, F>
where
    M: Preconditioner + Send,
    F: FnMut(&mut M, &BlockCsr<B>, &Subspace<B>) -> bool + Sync,
{
    fn follow(&mut self, hessian: &BlockCsr<B>, w: &Subspace<B>) -> bool {
        (self.follow)(self.m, hessian, w)
    }
}
