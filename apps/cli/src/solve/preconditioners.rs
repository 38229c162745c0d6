//! One preconditioner for each word.

use super::args::Precond;
use super::coordinates::Coordinates;
use stylet_solver::linear::{ConstraintPreconditioner, SchurDiagonal};
use stylet_solver::precondition::aggregation::{
    Form, Modes, SmoothedAggregation, SmoothedAggregationSettings, TwoLevel,
};
use stylet_solver::precondition::{
    BlockJacobi, Chebyshev, ChebyshevSettings, Identity, IncompleteCholesky, Jacobi, Preconditioner,
    PreconditionerError, Ssor, SsorSettings,
};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;

/// Solves `M z = r` with `M` of any kind.
pub type AnyPreconditioner = Box<dyn Preconditioner>;

const CHEBYSHEV_DEGREE: usize = 4;

/// The preconditioner of a matrix of blocks of `B` rows, `M` rigid moves to a node.
///
/// # Errors
/// Says what is wrong with which row, counted from 1.
pub fn build<const B: usize, const M: usize>(
    kind: Precond,
    a: &BlockCsr<B>,
    w: &Subspace<B>,
    coordinates: Option<&Coordinates>,
) -> Result<AnyPreconditioner, String> {
    let built: Result<AnyPreconditioner, PreconditionerError> = match kind {
        Precond::None => Ok(Box::new(Identity)),
        Precond::Jacobi => Jacobi::new(a, w).map(boxed),
        Precond::BlockJacobi => BlockJacobi::new(a, w).map(boxed),
        Precond::Ssor => Ssor::new(a, w, SsorSettings::default()).map(boxed),
        Precond::Ic0 => IncompleteCholesky::new(a, w).map(boxed),
        Precond::Chebyshev => Chebyshev::new(a, w, ChebyshevSettings::new(CHEBYSHEV_DEGREE)).map(boxed),
        Precond::TwoLevel | Precond::SmoothedAggregation => match coordinates.and_then(Coordinates::points) {
            Some(points) => Modes::<B, M>::rigid(points).and_then(|modes| aggregate(kind, a, w, modes)),
            None => aggregate(kind, a, w, Modes::<B, B>::constants(a.n_rows())),
        },
    };
    built.map_err(|error| reason::<B>(&error))
}

fn boxed(m: impl Preconditioner + 'static) -> AnyPreconditioner {
    Box::new(m)
}

fn aggregate<const B: usize, const M: usize>(
    kind: Precond,
    a: &BlockCsr<B>,
    w: &Subspace<B>,
    modes: Modes<B, M>,
) -> Result<AnyPreconditioner, PreconditionerError> {
    match kind {
        Precond::TwoLevel => TwoLevel::new(a, w, modes, Form::v_cycle(), None).map(boxed),
        _ => SmoothedAggregation::new(a, w, modes, SmoothedAggregationSettings::default()).map(boxed),
    }
}

/// An error with rows counted from 1.
pub fn reason<const B: usize>(error: &PreconditionerError) -> String {
    match *error {
        PreconditionerError::NotPositive { row, pivot } => {
            format!("{}: pivot {pivot:e}: not positive definite", rows_of_node::<B>(row))
        }
        PreconditionerError::Breakdown { row, pivot, shift } => {
            let rows = rows_of_node::<B>(row);
            format!("{rows}: pivot {pivot:e} of the incomplete factor, with the diagonal raised by {shift} of it")
        }
        other => other.to_string(),
    }
}

/// `row 4` or `rows 10 to 12`.
fn rows_of_node<const B: usize>(node: usize) -> String {
    if B == 1 { format!("row {}", node + 1) } else { format!("rows {} to {}", node * B + 1, node * B + B) }
}

/// `diag(M, C G⁻¹ Cᵀ)` for the whole system `[A Cᵀ; C 0]`, with `G` the block diagonal of `A`.
pub struct Stacked<const B: usize> {
    /// `M`; absent for `M = G`.
    pub first: Option<AnyPreconditioner>,
    pub schur: ConstraintPreconditioner<B>,
}

impl<const B: usize> Preconditioner for Stacked<B> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.apply_on(&Team::serial(), r, z);
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        SchurDiagonal(&self.schur).apply_on(team, r, z);
        if let Some(first) = &self.first {
            let n = self.schur.constraints().dim();
            first.apply_on(team, &r[..n], &mut z[..n]);
        }
    }
}
