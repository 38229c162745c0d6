//! One level above the coarsest: its matrix, its smoother and its way down.

use super::aggregates::Aggregates;
use super::galerkin::Galerkin;
use super::graph::Graph;
use super::modes::Modes;
use super::tentative::orthonormalise;
use super::transfer::{JacobiStep, Transfer};
use crate::LinearOperator;
use crate::memory::{bytes_of, bytes_of_all};
use crate::precondition::PreconditionerError;
use crate::precondition::block_jacobi::multiply;
use crate::precondition::chebyshev::{ChebyshevSettings, Guess, Polynomial};
use crate::precondition::projected::ProjectedOperator;
use crate::precondition::scratch::Scratch;
use crate::precondition::spectrum::Vectors;
use crate::real::Real;
use crate::sparse::BlockCsr;
use crate::team::Team;

/// A matrix and the modes that its near-null space consists of.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem<const B: usize, const M: usize, T: Real = f64> {
    /// On a coarse level; the finest is the caller's.
    pub matrix: BlockCsr<B>,
    pub a: ProjectedOperator<B, T>,
    pub modes: Modes<B, M>,
}

impl<const B: usize, const M: usize, T: Real> Problem<B, M, T> {
    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        self.matrix.memory_bytes() + self.a.memory_bytes() + size_of_val(self.modes.nodal())
    }
}

/// How a level is made.
pub(super) struct Recipe<'a> {
    pub smoother: ChebyshevSettings,
    /// `ω λ` of the damped Jacobi step that smooths the prolongator; 0 leaves it tentative.
    pub smoothing: f64,
    pub strength: f64,
    pub partition: &'a dyn Fn(&Graph) -> Aggregates,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Level<const B: usize, const M: usize, T: Real = f64> {
    pub problem: Problem<B, M, T>,
    polynomial: Polynomial,
    aggregates: Aggregates,
    tentative: Vec<[[f64; M]; B]>,
    transfer: Transfer<B, M, T>,
    galerkin: Galerkin<B, M>,
    scratch: Scratch<Work<T>>,
}

#[derive(Clone, Debug, Default)]
struct Work<T> {
    fine: Vectors<T>,
    f: Vec<T>,
    e: Vec<T>,
}

impl<const B: usize, const M: usize, T: Real> Level<B, M, T> {
    pub fn new(problem: Problem<B, M, T>) -> Self {
        Self { problem, ..Self::default() }
    }

    /// Makes the smoother, the prolongator and the problem of the next level, whose operator is left to be made; `matrix` is
    /// that of this level, on a coarse one `None` for its own; `same` keeps the aggregates and all patterns.
    pub fn build(
        &mut self,
        team: &Team,
        matrix: Option<&BlockCsr<B>>,
        recipe: &Recipe,
        same: bool,
        next: &mut Problem<M, M, T>,
    ) -> Result<(), PreconditionerError> {
        let Problem { matrix: own, a, modes } = &self.problem;
        let rows = a.projected.rows(matrix.unwrap_or(own));
        let work = self.scratch.get_mut();
        self.polynomial = Polynomial::new(a, team, recipe.smoother, &mut work.fine)?;
        if !same {
            self.aggregates = (recipe.partition)(&Graph::new(team, rows, recipe.strength));
            self.transfer.set_pattern(rows, &self.aggregates, recipe.smoothing != 0.0);
            self.galerkin.set_pattern(team, rows, &self.transfer, &mut next.matrix);
        }
        let coarse_dim = self.aggregates.count() * M;
        work.f.resize(coarse_dim, T::ZERO);
        work.e.resize(coarse_dim, T::ZERO);
        orthonormalise(modes.nodal(), &a.projected.constraints, &self.aggregates, &mut self.tentative, &mut next.modes);
        let omega = recipe.smoothing / self.polynomial.upper;
        let step = JacobiStep { a: rows, inverses: &a.projected.inverses, omega };
        self.transfer.set_numbers(team, step, &self.tentative, &self.aggregates);
        self.galerkin.set_numbers(team, rows, &self.transfer, &mut next.matrix);
        fill_dependent(next);
        Ok(())
    }

    /// `x ← M⁻¹ f`: smoother, correction by `coarse`, smoother. `coarse(f, e)` overwrites `e` with an approximation of the
    /// coarse matrix's inverse times `f`; if that is symmetric, so is the whole.
    pub fn cycle(&self, team: &Team, f: &[T], x: &mut [T], coarse: impl FnOnce(&[T], &mut [T])) {
        let Work { fine, f: coarse_f, e } = &mut *self.scratch.lock();
        let a = &self.problem.a;
        fine.r.copy_from_slice(f);
        self.polynomial.smooth(a, team, Guess::Zero, x, fine);
        self.polynomial.residual_after(a, team, fine);
        self.transfer.restrict(team, &fine.r, coarse_f);
        coarse(coarse_f, e);
        self.transfer.prolong(team, e, &mut fine.d);
        team.axpy(T::ONE, &fine.d, x);
        self.polynomial.residual_after(a, team, fine);
        self.polynomial.smooth(a, team, Guess::Present, x, fine);
        a.project(x);
    }

    /// `x ← D⁺ f + P e`, where `coarse` makes `e` of `Pᵀ f`.
    pub fn add(&self, team: &Team, f: &[T], x: &mut [T], coarse: impl FnOnce(&[T], &mut [T])) {
        let Work { fine, f: coarse_f, e } = &mut *self.scratch.lock();
        self.transfer.restrict(team, f, coarse_f);
        coarse(coarse_f, e);
        self.transfer.prolong(team, e, &mut fine.d);
        multiply(&self.problem.a.projected.inverses, f, x);
        team.axpy(T::ONE, &fine.d, x);
        self.problem.a.project(x);
    }

    pub fn dim(&self) -> usize {
        self.problem.a.dim()
    }

    /// Blocks of its own matrix.
    pub fn n_blocks(&self) -> usize {
        self.problem.matrix.n_blocks()
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        let Work { fine, f, e } = &*self.scratch.lock();
        self.problem.memory_bytes()
            + self.aggregates.memory_bytes()
            + bytes_of(&self.tentative)
            + self.transfer.memory_bytes()
            + self.galerkin.memory_bytes()
            + fine.memory_bytes()
            + bytes_of_all([f, e])
    }
}

/// Modes that depend on others have zero columns in the prolongator, hence zero rows in the coarse matrix: a diagonal of the
/// size of the others makes them equations `s e = 0` of their own.
fn fill_dependent<const M: usize, T: Real>(next: &mut Problem<M, M, T>) {
    for (k, modes) in next.modes.nodal().iter().enumerate() {
        let Some(block) = next.matrix.get_mut(k, k) else { continue };
        let largest = (0..M).map(|m| block[m][m]).fold(0.0, f64::max);
        let scale = if largest > 0.0 { largest } else { 1.0 };
        for m in (0..M).filter(|&m| modes[m][m] == 0.0) {
            block[m][m] = scale;
        }
    }
}
