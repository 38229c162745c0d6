//! Smoothed aggregation: a multilevel preconditioner that needs no mesh.

use super::aggregates::Aggregates;
use super::coarsest::Coarsest;
use super::level::{Level, Problem, Recipe};
use super::modes::Modes;
use crate::precondition::chebyshev::ChebyshevSettings;
use crate::precondition::{Preconditioner, PreconditionerError};
use crate::real::Real;
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;
use crate::team::Team;

/// More levels than this are not made: each has at most half the nodes of the one before, in 3D a twentieth.
const MAX_LEVELS: usize = 20;

/// How the hierarchy is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothedAggregationSettings {
    /// Nodes `i` and `j` may share an aggregate if `‖A_ij‖ > strength √(‖A_ii‖ ‖A_jj‖)` in the Frobenius norm; in [0, 1).
    pub strength: f64,
    /// The smoother, before and after each coarse correction.
    pub smoother: ChebyshevSettings,
    /// `ω` of the prolongator `(I − ω/λ D⁺A) Q`, where `λ` bounds the spectrum of `D⁺A`; in [0, 2).
    pub smoothing: f64,
    /// A level of at most this many scalar rows is factored.
    pub max_coarse_dim: usize,
}

impl Default for SmoothedAggregationSettings {
    fn default() -> Self {
        Self { strength: 0.0, smoother: ChebyshevSettings::new(2), smoothing: 4.0 / 3.0, max_coarse_dim: 400 }
    }
}

impl SmoothedAggregationSettings {
    fn validate(&self) -> Result<(), PreconditionerError> {
        self.smoother.validate()?;
        for (name, value, end) in [("strength", self.strength, 1.0), ("smoothing", self.smoothing, 2.0)] {
            if !(0.0..end).contains(&value) {
                return Err(PreconditionerError::Parameter { name, value });
            }
        }
        Ok(())
    }
}

/// Symmetric V(1,1) cycle on levels of aggregates of aggregates; `B` numbers per node, `M` modes.
///
/// The near-null space of `A` (for elasticity: [`Modes::rigid`]) is kept by every level, so that the number of iterations
/// grows slowly with the number of nodes, if at all.
///
/// Source: Vaněk, Mandel & Brezina, *Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
/// problems*, Computing 56 (1996).
#[derive(Clone, Debug, Default)]
pub struct SmoothedAggregation<const B: usize, const M: usize, T: Real = f64> {
    fine: Level<B, M, T>,
    coarser: Vec<Level<M, M, T>>,
    coarsest: Coarsest<M, T>,
    /// Blocks of the finest matrix.
    n_blocks: usize,
    settings: SmoothedAggregationSettings,
    /// Whether the last build came to its end.
    complete: bool,
}

impl<const B: usize, const M: usize> SmoothedAggregation<B, M> {
    /// The preconditioner of `P_W A P_W`; `matrix` must be symmetric.
    ///
    /// # Errors
    /// [`PreconditionerError::Parameter`], [`PreconditionerError::Modes`], [`PreconditionerError::Shape`],
    /// [`PreconditionerError::NotFinite`]; [`PreconditionerError::NotPositive`], [`PreconditionerError::Indefinite`] and
    /// [`PreconditionerError::Coarse`] for a matrix that is not positive definite on the subspace.
    pub fn new(
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        modes: Modes<B, M>,
        settings: SmoothedAggregationSettings,
    ) -> Result<Self, PreconditionerError> {
        Self::new_on(&Team::serial(), matrix, subspace, modes, settings)
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
        settings: SmoothedAggregationSettings,
    ) -> Result<Self, PreconditionerError> {
        Self::build_on(team, matrix, subspace, modes, settings)
    }
}

impl<const B: usize, const M: usize> SmoothedAggregation<B, M, f32> {
    /// [`new_on`](SmoothedAggregation::new_on) for vectors in `f32`: half the bytes a cycle. Coarse matrices are worked out in
    /// `f64`; the numbers of the matrix must not leave the range of `f32`.
    ///
    /// # Errors
    /// As [`new`](SmoothedAggregation::new).
    pub fn in_single_precision(
        team: &Team,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        modes: Modes<B, M>,
        settings: SmoothedAggregationSettings,
    ) -> Result<Self, PreconditionerError> {
        Self::build_on(team, matrix, subspace, modes, settings)
    }
}

impl<const B: usize, const M: usize, T: Real> SmoothedAggregation<B, M, T> {
    fn build_on(
        team: &Team,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        modes: Modes<B, M>,
        settings: SmoothedAggregationSettings,
    ) -> Result<Self, PreconditionerError> {
        let fine = Level::new(Problem { modes, ..Problem::default() });
        let mut this = Self { fine, settings, ..Self::default() };
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
        self.settings.validate()?;
        // A build that ends early leaves levels that do not belong together.
        let complete = std::mem::replace(&mut self.complete, false);
        let Problem { a, modes, .. } = &mut self.fine.problem;
        let (modes, nodes) = (modes.n_nodes(), matrix.n_rows());
        if modes != nodes {
            return Err(PreconditionerError::Modes { modes, nodes });
        }
        let same = a.rebuild(team, matrix, subspace)? && complete;
        self.n_blocks = matrix.n_blocks();
        self.build(team, matrix, same)?;
        self.complete = true;
        Ok(())
    }

    fn build(&mut self, team: &Team, matrix: &BlockCsr<B>, same: bool) -> Result<(), PreconditionerError> {
        let SmoothedAggregationSettings { strength, smoother, smoothing, max_coarse_dim } = self.settings;
        let recipe = Recipe { smoother, smoothing, strength, partition: &Aggregates::neighbourhoods };
        if !same {
            self.coarser.clear();
        }
        let mut depth = 0;
        loop {
            let (above, below) = self.coarser.split_at_mut(depth);
            let next = below.first_mut().map_or(&mut self.coarsest.problem, |level| &mut level.problem);
            match above.last_mut() {
                None => self.fine.build(team, Some(matrix), &recipe, same, next)?,
                Some(level) => level.build(team, None, &recipe, same, next)?,
            }
            if !same && depth + 2 < MAX_LEVELS && self.coarsest.dim() > max_coarse_dim {
                self.coarser.push(Level::new(std::mem::take(&mut self.coarsest.problem)));
            }
            if depth == self.coarser.len() {
                return self.coarsest.factor();
            }
            let Problem { matrix, a, .. } = &mut self.coarser[depth].problem;
            a.rebuild_free(team, matrix)?;
            depth += 1;
        }
    }

    /// Scalar rows of every level, finest first.
    pub fn dims(&self) -> impl Iterator<Item = usize> {
        let coarser = self.coarser.iter().map(Level::dim);
        [self.fine.dim()].into_iter().chain(coarser).chain([self.coarsest.dim()])
    }

    /// Numbers stored in the matrices of all levels over those of the finest: what a cycle costs beyond the finest level.
    #[must_use]
    pub fn operator_complexity(&self) -> f64 {
        let fine = (self.n_blocks * B * B) as f64;
        let coarser: usize = self.coarser.iter().map(|level| level.n_blocks() * M * M).sum();
        1.0 + (coarser + self.coarsest.dim().pow(2)) as f64 / fine.max(1.0)
    }

    /// Products with the finest matrix per application; those of conjugate gradients come on top.
    #[must_use]
    pub fn products(&self) -> usize {
        2 * self.settings.smoother.degree
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let coarser: usize = self.coarser.iter().map(Level::memory_bytes).sum();
        self.fine.memory_bytes() + coarser + self.coarsest.memory_bytes()
    }
}

impl<const B: usize, const M: usize, T: Real> Preconditioner<T> for SmoothedAggregation<B, M, T> {
    fn apply(&self, r: &[T], z: &mut [T]) {
        self.apply_on(&Team::serial(), r, z);
    }

    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply_on(&self, team: &Team, r: &[T], z: &mut [T]) {
        let n = self.fine.dim();
        assert!(r.len() == n && z.len() == n, "multilevel preconditioner of {n} rows");
        self.fine.cycle(team, r, z, |f, e| descend(&self.coarser, &self.coarsest, team, f, e));
    }
}

/// The cycle from the first of `levels` down.
fn descend<const M: usize, T: Real>(
    levels: &[Level<M, M, T>],
    coarsest: &Coarsest<M, T>,
    team: &Team,
    f: &[T],
    e: &mut [T],
) {
    match levels.split_first() {
        None => coarsest.solve(f, e),
        Some((level, rest)) => level.cycle(team, f, e, |f, e| descend(rest, coarsest, team, f, e)),
    }
}
