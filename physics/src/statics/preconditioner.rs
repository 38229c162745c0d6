//! One preconditioner of any kind, which keeps the memory of those it was before.

use super::Preconditioning;
#[cfg(feature = "direct")]
use std::sync::Arc;
#[cfg(feature = "direct")]
use stylet_solver::linear::direct::{Factor, FillOrder, Method, Symbolic};
use stylet_solver::nonlinear::HessianPreconditioner;
use stylet_solver::precondition::aggregation::{Modes, SmoothedAggregation, SmoothedAggregationSettings};
use stylet_solver::precondition::{
    BlockJacobi, Chebyshev, ChebyshevSettings, Identity, IncompleteCholesky, Jacobi, Preconditioner,
    PreconditionerError, Ssor, SsorSettings,
};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;

/// Degree of the polynomial of [`Preconditioning::Chebyshev`].
const CHEBYSHEV_DEGREE: usize = 3;

/// The preconditioner of a static solve.
#[derive(Debug, Default)]
pub(super) struct AnyPreconditioner<const D: usize> {
    kind: Option<Preconditioning>,
    jacobi: Jacobi<D>,
    block_jacobi: BlockJacobi<D>,
    ssor: Ssor<D>,
    incomplete_cholesky: IncompleteCholesky<D>,
    chebyshev: Chebyshev<D>,
    aggregation: SmoothedAggregation<D, D>,
    #[cfg(feature = "direct")]
    factor: Option<Factor<D>>,
}

impl<const D: usize> AnyPreconditioner<D> {
    /// What it is from now on.
    pub fn become_kind(&mut self, kind: Preconditioning) {
        self.kind = Some(kind);
    }

    /// Bytes of all that it has been.
    pub fn memory_bytes(&self) -> usize {
        let iterated = self.jacobi.memory_bytes()
            + self.block_jacobi.memory_bytes()
            + self.ssor.memory_bytes()
            + self.incomplete_cholesky.memory_bytes()
            + self.chebyshev.memory_bytes()
            + self.aggregation.memory_bytes();
        #[cfg(feature = "direct")]
        let iterated = iterated + self.factor.as_ref().map_or(0, Factor::memory_bytes);
        iterated
    }

    /// Follows a matrix.
    pub fn rebuild(&mut self, a: &BlockCsr<D>, w: &Subspace<D>) -> Result<(), PreconditionerError> {
        match self.kind.unwrap_or(Preconditioning::None) {
            Preconditioning::None => Ok(()),
            Preconditioning::Jacobi => self.jacobi.rebuild(a, w),
            Preconditioning::BlockJacobi => self.block_jacobi.rebuild(a, w),
            Preconditioning::Ssor => self.ssor.rebuild(a, w, SsorSettings::default()),
            Preconditioning::IncompleteCholesky => self.incomplete_cholesky.rebuild(a, w),
            Preconditioning::Chebyshev => self.chebyshev.rebuild(a, w, ChebyshevSettings::new(CHEBYSHEV_DEGREE)),
            Preconditioning::Aggregation => {
                let modes = Modes::constants(a.n_rows());
                self.aggregation = SmoothedAggregation::new(a, w, modes, SmoothedAggregationSettings::default())?;
                Ok(())
            }
            #[cfg(feature = "direct")]
            Preconditioning::Factor => self.refactor(a, w),
        }
    }

    #[cfg(feature = "direct")]
    fn refactor(&mut self, a: &BlockCsr<D>, w: &Subspace<D>) -> Result<(), PreconditionerError> {
        let refuse = |_| PreconditionerError::Indefinite { curvature: f64::NAN };
        if let Some(factor) = &mut self.factor
            && factor.refactor(a, w).is_ok()
        {
            return Ok(());
        }
        // Another pattern, or no factor yet.
        let symbolic = Symbolic::new(a, FillOrder::MinimumDegree).map_err(refuse)?;
        self.factor = Some(Factor::new(Arc::new(symbolic), Method::Llt, a, w).map_err(refuse)?);
        Ok(())
    }

    fn active(&self) -> &dyn Preconditioner {
        match self.kind.unwrap_or(Preconditioning::None) {
            Preconditioning::None => &Identity,
            Preconditioning::Jacobi => &self.jacobi,
            Preconditioning::BlockJacobi => &self.block_jacobi,
            Preconditioning::Ssor => &self.ssor,
            Preconditioning::IncompleteCholesky => &self.incomplete_cholesky,
            Preconditioning::Chebyshev => &self.chebyshev,
            Preconditioning::Aggregation => &self.aggregation,
            #[cfg(feature = "direct")]
            Preconditioning::Factor => match &self.factor {
                Some(factor) => factor,
                None => &Identity,
            },
        }
    }
}

impl<const D: usize> Preconditioner for AnyPreconditioner<D> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.active().apply(r, z);
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        self.active().apply_on(team, r, z);
    }

    fn is_identity(&self) -> bool {
        self.active().is_identity()
    }
}

impl<const D: usize> HessianPreconditioner<D> for AnyPreconditioner<D> {
    fn follow(&mut self, hessian: &BlockCsr<D>, w: &Subspace<D>) -> bool {
        self.rebuild(hessian, w).is_ok()
    }
}
