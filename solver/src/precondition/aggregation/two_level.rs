//! Two levels: the nodes, and a few large aggregates that move as they may at little energy.

use super::aggregates::Aggregates;
use super::coarsest::Coarsest;
use super::graph::Graph;
use super::level::{Level, Problem, Recipe};
use super::modes::Modes;
use crate::precondition::chebyshev::ChebyshevSettings;
use crate::precondition::{Preconditioner, PreconditionerError};
use crate::real::Real;
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;
use crate::team::Team;

/// More coarse rows than this are not chosen: factoring them takes longer than they save.
const MAX_COARSE_DIM: f64 = 1536.0;

/// How the levels work together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// `D⁺ + P (Pᵀ A P)⁻¹ Pᵀ`: no product.
    Additive,
    /// Smoother, coarse correction, smoother: two products for each degree of the smoother.
    VCycle(ChebyshevSettings),
}

impl Form {
    /// The V-cycle that was measured to be quickest.
    #[must_use]
    pub fn v_cycle() -> Self {
        Self::VCycle(ChebyshevSettings { degree: 1, ratio: 4.0 })
    }
}

/// Block Jacobi or a Chebyshev smoother, and a direct solve for the modes of compact aggregates; `B` numbers per node, `M`
/// modes.
///
/// Source: Nicolaides, *Deflation of conjugate gradients with applications to boundary value problems*, SIAM J. Numer.
/// Anal. 24 (1987), with rigid moves in place of constants; the aggregates are balls of the graph of the matrix.
#[derive(Clone, Debug)]
pub struct TwoLevel<const B: usize, const M: usize, T: Real = f64> {
    level: Level<B, M, T>,
    coarsest: Coarsest<M, T>,
    form: Form,
    aggregates: Option<usize>,
    /// Whether the last build came to its end.
    complete: bool,
}

impl<const B: usize, const M: usize> TwoLevel<B, M> {
    /// The preconditioner of `P_W A P_W`; `matrix` must be symmetric. About `aggregates` of them are made, or, if that is
    /// `None`, so many that the coarse solve costs as much as a product: with `m` coarse rows `2 m² = 2 B²` times the number
    /// of blocks, two flops each, `m` at most 1,536.
    ///
    /// # Errors
    /// [`PreconditionerError::Parameter`], [`PreconditionerError::Modes`], [`PreconditionerError::Shape`],
    /// [`PreconditionerError::NotFinite`]; [`PreconditionerError::NotPositive`], [`PreconditionerError::Indefinite`] and
    /// [`PreconditionerError::Coarse`] for a matrix that is not positive definite on the subspace.
    pub fn new(
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        modes: Modes<B, M>,
        form: Form,
        aggregates: Option<usize>,
    ) -> Result<Self, PreconditionerError> {
        Self::new_on(&Team::serial(), matrix, subspace, modes, form, aggregates)
    }

    /// [`new`](Self::new) by all members of a team, with the same bits.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn new_on(
        team: &Team,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        modes: Modes<B, M>,
        form: Form,
        aggregates: Option<usize>,
    ) -> Result<Self, PreconditionerError> {
        Self::build_on(team, matrix, subspace, modes, form, aggregates)
    }
}

impl<const B: usize, const M: usize> TwoLevel<B, M, f32> {
    /// [`new_on`](TwoLevel::new_on) for vectors in `f32`: half the bytes a cycle. The coarse matrix is worked out and factored
    /// in `f64`; the numbers of the matrix must not leave the range of `f32`.
    ///
    /// # Errors
    /// As [`new`](TwoLevel::new).
    pub fn in_single_precision(
        team: &Team,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        modes: Modes<B, M>,
        form: Form,
        aggregates: Option<usize>,
    ) -> Result<Self, PreconditionerError> {
        Self::build_on(team, matrix, subspace, modes, form, aggregates)
    }
}

impl<const B: usize, const M: usize, T: Real> TwoLevel<B, M, T> {
    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.level.memory_bytes() + self.coarsest.memory_bytes()
    }

    fn build_on(
        team: &Team,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        modes: Modes<B, M>,
        form: Form,
        aggregates: Option<usize>,
    ) -> Result<Self, PreconditionerError> {
        let level = Level::new(Problem { modes, ..Problem::default() });
        let mut this = Self { level, coarsest: Coarsest::default(), form, aggregates, complete: false };
        this.rebuild_on(team, matrix, subspace)?;
        Ok(this)
    }

    /// Follows a change of the matrix and the subspace, the modes staying. If the pattern and the set of fixed nodes are
    /// those of before, the aggregates stay as well, only numbers are redone, and nothing is allocated.
    ///
    /// # Errors
    /// As [`new`](Self::new); the preconditioner is then of no use until a rebuild succeeds.
    pub fn rebuild(&mut self, matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<(), PreconditionerError> {
        self.rebuild_on(&Team::serial(), matrix, subspace)
    }

    /// [`rebuild`](Self::rebuild) by all members of a team, with the same bits.
    ///
    /// # Errors
    /// As [`rebuild`](Self::rebuild).
    pub fn rebuild_on(
        &mut self,
        team: &Team,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
    ) -> Result<(), PreconditionerError> {
        let count = self.aggregates.unwrap_or_else(|| balanced_count::<M>(matrix.n_blocks() * B * B));
        self.rebuild_with(team, matrix, subspace, &|graph| Aggregates::balls(graph, count))
    }

    pub(super) fn rebuild_with(
        &mut self,
        team: &Team,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        partition: &dyn Fn(&Graph) -> Aggregates,
    ) -> Result<(), PreconditionerError> {
        let smoother = match self.form {
            Form::Additive => ChebyshevSettings { degree: 1, ratio: 4.0 }, // not used
            Form::VCycle(smoother) => smoother.validate()?,
        };
        // A build that ends early leaves levels that do not belong together.
        let complete = std::mem::replace(&mut self.complete, false);
        let Problem { a, modes, .. } = &mut self.level.problem;
        let (modes, nodes) = (modes.n_nodes(), matrix.n_rows());
        if modes != nodes {
            return Err(PreconditionerError::Modes { modes, nodes });
        }
        let same = a.rebuild(team, matrix, subspace)? && complete;
        let recipe = Recipe { smoother, smoothing: 0.0, strength: 0.0, partition };
        self.level.build(team, Some(matrix), &recipe, same, &mut self.coarsest.problem)?;
        self.coarsest.factor()?;
        self.complete = true;
        Ok(())
    }

    /// Lets the next rebuild choose aggregates anew.
    #[cfg(test)]
    pub(super) fn forget(&mut self) {
        self.complete = false;
    }

    /// Scalar rows of the coarse level.
    #[must_use]
    pub fn coarse_dim(&self) -> usize {
        self.coarsest.dim()
    }
}

/// Aggregates for a matrix that stores so many numbers.
fn balanced_count<const M: usize>(stored: usize) -> usize {
    let dim = (0.5 * stored as f64).sqrt().min(MAX_COARSE_DIM);
    ((dim / M as f64).round() as usize).max(1)
}

impl<const B: usize, const M: usize, T: Real> Preconditioner<T> for TwoLevel<B, M, T> {
    fn apply(&self, r: &[T], z: &mut [T]) {
        self.apply_on(&Team::serial(), r, z);
    }

    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply_on(&self, team: &Team, r: &[T], z: &mut [T]) {
        let n = self.level.dim();
        assert!(r.len() == n && z.len() == n, "two-level preconditioner of {n} rows");
        let coarse = |f: &[T], e: &mut [T]| self.coarsest.solve(f, e);
        match self.form {
            Form::Additive => self.level.add(team, r, z, coarse),
            Form::VCycle(_) => self.level.cycle(team, r, z, coarse),
        }
    }
}
