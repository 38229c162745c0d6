//! What is compared: a method is one entry of [`METHODS`].

use super::baseline::{faer_cg, textbook_cg};
use super::systems::Case;
use faer::Side;
use faer::linalg::solvers::SolveCore;
use faer::sparse::SparseColMat;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::{Conj, MatMut};
use std::borrow::Borrow;
use std::sync::Arc;
use stylet_solver::LinearOperator;
use stylet_solver::linear::direct::{Factor, FactorNumber, FillOrder, Method as Factors, Symbolic};
use stylet_solver::linear::{
    CgSettings, CgWorkspace, KrylovSettings, MinresWorkspace, MixedWorkspace, RefineSettings, RefineWorkspace, minres,
    mixed_cg, projected_cg, refine,
};
use stylet_solver::precondition::aggregation::{
    Form, Modes, SmoothedAggregation, SmoothedAggregationSettings, TwoLevel,
};
use stylet_solver::precondition::{
    BlockJacobi, Chebyshev, ChebyshevSettings, Identity, IncompleteCholesky, Jacobi, Preconditioner, SinglePrecision,
    Ssor, SsorSettings,
};
use stylet_solver::sparse::{BlockCsr, Frozen};
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::team::Team;

/// Iterations after which a solve gives up.
const MAX_ITERATIONS: usize = 5000;

/// Whose a method is, and where it is tried.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Ours, iterative.
    Ours,
    /// Ours, iterative, with nothing to offer on the large system.
    Small,
    /// Ours, by a factorisation that faer does; not tried on the large system, where it takes half a minute.
    Direct,
    /// Someone else's, on one thread.
    Peer,
    /// As [`Peer`](Self::Peer), by a factorisation.
    DirectPeer,
}

impl Kind {
    /// Whether it is an iterative method of ours.
    pub fn is_ours(self) -> bool {
        matches!(self, Self::Ours | Self::Small)
    }

    /// Whether it is someone else's.
    pub fn is_peer(self) -> bool {
        matches!(self, Self::Peer | Self::DirectPeer)
    }
}

/// A way to solve a [`Case`].
pub(super) struct Method {
    pub solver: &'static str,
    pub preconditioner: &'static str,
    pub kind: Kind,
    /// Everything that depends on the matrix alone.
    pub set_up: for<'a> fn(&'a Case, &Team) -> Result<Prepared<'a>, String>,
}

/// Solves to a relative residual, from `x = 0`.
type Solve<'a> = Box<dyn FnMut(f64, &mut [f64]) -> Result<Solved, String> + 'a>;

/// A method that is ready to solve.
pub(super) struct Prepared<'a> {
    pub solve: Solve<'a>,
    /// Products with the matrix per iteration.
    pub products: usize,
}

/// How a solve ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solved {
    pub iterations: usize,
    pub stop: Stop,
}

use Kind::{Direct, DirectPeer, Ours, Peer, Small};

/// All of them.
pub(super) const METHODS: &[Method] = &[
    Method { solver: "cg", preconditioner: "none", kind: Small, set_up: |case, team| Ok(cg(case, team, Identity, 1)) },
    Method {
        solver: "cg",
        preconditioner: "jacobi",
        kind: Small,
        set_up: |case, team| Ok(cg(case, team, Jacobi::new(&case.matrix, &case.free).map_err(text)?, 1)),
    },
    Method {
        solver: "cg",
        preconditioner: "block-jacobi",
        kind: Ours,
        set_up: |case, team| Ok(cg(case, team, BlockJacobi::new(&case.matrix, &case.free).map_err(text)?, 1)),
    },
    Method { solver: "cg, unfrozen", preconditioner: "block-jacobi", kind: Small, set_up: unfrozen },
    Method { solver: "mixed-cg", preconditioner: "block-jacobi", kind: Ours, set_up: mixed },
    Method { solver: "minres", preconditioner: "block-jacobi", kind: Small, set_up: minimal_residual },
    Method {
        solver: "cg",
        preconditioner: "chebyshev",
        kind: Ours,
        set_up: |case, team| {
            let m = Chebyshev::new(&case.matrix, &case.free, ChebyshevSettings::new(3)).map_err(text)?;
            Ok(cg(case, team, m, 3))
        },
    },
    Method {
        solver: "cg",
        preconditioner: "ssor",
        kind: Ours,
        set_up: |case, team| {
            Ok(cg(case, team, Ssor::new(&case.matrix, &case.free, SsorSettings::default()).map_err(text)?, 2))
        },
    },
    Method {
        solver: "cg",
        preconditioner: "ic0",
        kind: Ours,
        set_up: |case, team| Ok(cg(case, team, IncompleteCholesky::new(&case.matrix, &case.free).map_err(text)?, 2)),
    },
    Method {
        solver: "cg",
        preconditioner: "two-level",
        kind: Ours,
        set_up: |case, team| Ok(cg(case, team, two_level(case, team, Form::Additive)?, 1)),
    },
    Method {
        solver: "cg",
        preconditioner: "two-level-v",
        kind: Ours,
        set_up: |case, team| Ok(cg(case, team, two_level(case, team, Form::v_cycle())?, 3)),
    },
    Method {
        solver: "cg",
        preconditioner: "smoothed-aggregation",
        kind: Ours,
        set_up: |case, team| {
            let m = smoothed_aggregation(case, team)?;
            let products = 1 + m.products();
            Ok(cg(case, team, m, products))
        },
    },
    Method {
        solver: "cg, unfrozen",
        preconditioner: "smoothed-aggregation-f32",
        kind: Ours,
        set_up: |case, team| {
            let m = smoothed_aggregation_in_single_precision(case, team)?;
            let products = 1 + m.products();
            Ok(cg_with::<BlockCsr<3>>(case, team, &case.matrix, SinglePrecision::new(m), products))
        },
    },
    Method {
        solver: "cg, unfrozen",
        preconditioner: "two-level-v-f32",
        kind: Ours,
        set_up: |case, team| {
            let modes = Modes::<3, 6>::rigid(&case.places).map_err(text)?;
            let m = TwoLevel::in_single_precision(team, &case.matrix, &case.free, modes, Form::v_cycle(), None);
            Ok(cg_with::<BlockCsr<3>>(case, team, &case.matrix, SinglePrecision::new(m.map_err(text)?), 3))
        },
    },
    Method {
        solver: "cholesky",
        preconditioner: "f64",
        kind: Direct,
        set_up: |case, _| factored::<f64>(case, FillOrder::MinimumDegree),
    },
    Method {
        solver: "cholesky",
        preconditioner: "f32, refined",
        kind: Direct,
        set_up: |case, _| factored::<f32>(case, FillOrder::NestedDissection),
    },
    Method { solver: "sprs cg", preconditioner: "jacobi", kind: Peer, set_up: sprs_textbook },
    Method { solver: "faer cg", preconditioner: "jacobi", kind: Peer, set_up: faer_iterative },
    Method { solver: "faer llt", preconditioner: "f64", kind: DirectPeer, set_up: faer_direct },
    Method { solver: "faer llt", preconditioner: "f64, analysed before", kind: DirectPeer, set_up: faer_direct_again },
];

/// What the stop rule asks for.
pub(super) fn settings(tolerance: f64) -> CgSettings {
    let stop = StopRule { tolerance, criterion: Criterion::External, round_floor: 0.0 };
    CgSettings { stop, max_iterations: MAX_ITERATIONS }
}

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// Conjugate gradients with a preconditioner on the frozen matrix; `products` per iteration, the one of the iteration itself
/// among them.
fn cg<'a>(case: &'a Case, team: &Team, m: impl Preconditioner + 'a, products: usize) -> Prepared<'a> {
    cg_with::<Frozen<3>>(case, team, Frozen::new(&case.matrix), m, products)
}

/// Conjugate gradients on the matrix as it is: nothing to prepare, for solves of a few iterations.
fn unfrozen<'a>(case: &'a Case, team: &Team) -> Result<Prepared<'a>, String> {
    let m = BlockJacobi::new(&case.matrix, &case.free).map_err(text)?;
    Ok(cg_with::<BlockCsr<3>>(case, team, &case.matrix, m, 1))
}

fn cg_with<'a, A: LinearOperator>(
    case: &'a Case,
    team: &Team,
    a: impl Borrow<A> + 'a,
    m: impl Preconditioner + 'a,
    products: usize,
) -> Prepared<'a> {
    let mut ws = CgWorkspace::on(team);
    let solve = move |tolerance: f64, x: &mut [f64]| {
        let report =
            projected_cg(a.borrow(), &m, &case.free, &case.load, x, &settings(tolerance), &mut ws).map_err(text)?;
        Ok(Solved { iterations: report.iterations, stop: report.stop })
    };
    Prepared { solve: Box::new(solve), products }
}

/// Two products in f64 a solve, with the matrix as it is; all others in f32.
fn mixed<'a>(case: &'a Case, team: &Team) -> Result<Prepared<'a>, String> {
    let m = BlockJacobi::in_single_precision(&case.matrix, &case.free).map_err(text)?;
    let a32 = Frozen::<3, f32>::new(&case.matrix);
    let mut ws = MixedWorkspace::on(team);
    let solve = move |tolerance: f64, x: &mut [f64]| {
        let report =
            mixed_cg(&case.matrix, &a32, &m, &case.free, &case.load, x, &settings(tolerance), &mut ws).map_err(text)?;
        Ok(Solved { iterations: report.iterations, stop: report.stop })
    };
    Ok(Prepared { solve: Box::new(solve), products: 1 })
}

fn minimal_residual<'a>(case: &'a Case, team: &Team) -> Result<Prepared<'a>, String> {
    let m = BlockJacobi::new(&case.matrix, &case.free).map_err(text)?;
    let a = Frozen::<3>::new(&case.matrix);
    let mut ws = MinresWorkspace::on(team.clone());
    let solve = move |tolerance: f64, x: &mut [f64]| {
        let settings = KrylovSettings { stop: settings(tolerance).stop, max_iterations: MAX_ITERATIONS };
        let report = minres(&a, &m, &case.free, &case.load, x, &settings, &mut ws).map_err(text)?;
        Ok(Solved { iterations: report.iterations, stop: report.stop })
    };
    Ok(Prepared { solve: Box::new(solve), products: 1 })
}

fn two_level(case: &Case, team: &Team, form: Form) -> Result<TwoLevel<3, 6>, String> {
    let modes = Modes::rigid(&case.places).map_err(text)?;
    TwoLevel::new_on(team, &case.matrix, &case.free, modes, form, None).map_err(text)
}

/// Smoothed aggregation with rigid modes, as it comes.
pub(super) fn smoothed_aggregation(case: &Case, team: &Team) -> Result<SmoothedAggregation<3, 6>, String> {
    let modes = Modes::rigid(&case.places).map_err(text)?;
    let settings = SmoothedAggregationSettings::default();
    SmoothedAggregation::new_on(team, &case.matrix, &case.free, modes, settings).map_err(text)
}

/// [`smoothed_aggregation`] in f32.
fn smoothed_aggregation_in_single_precision(
    case: &Case,
    team: &Team,
) -> Result<SmoothedAggregation<3, 6, f32>, String> {
    let modes = Modes::rigid(&case.places).map_err(text)?;
    let settings = SmoothedAggregationSettings::default();
    SmoothedAggregation::in_single_precision(team, &case.matrix, &case.free, modes, settings).map_err(text)
}

/// A factor, and refinement until the residual is small enough.
fn factored<'a, T: FactorNumber>(case: &'a Case, order: FillOrder<'_>) -> Result<Prepared<'a>, String> {
    let symbolic = Arc::new(Symbolic::new(&case.matrix, order).map_err(text)?);
    let factor = Factor::<3, T>::new(symbolic, Factors::Llt, &case.matrix, &case.free).map_err(text)?;
    let mut ws = RefineWorkspace::new();
    let solve = move |tolerance: f64, x: &mut [f64]| {
        let settings = RefineSettings { stop: settings(tolerance).stop, max_iterations: 50 };
        let report = refine(&case.matrix, &factor, &case.free, &case.load, x, &settings, &mut ws).map_err(text)?;
        Ok(Solved { iterations: report.iterations, stop: report.stop })
    };
    Ok(Prepared { solve: Box::new(solve), products: 1 })
}

fn sprs_textbook<'a>(case: &'a Case, _: &Team) -> Result<Prepared<'a>, String> {
    let a = sprs::CsMat::<f64>::from(&case.matrix);
    let diagonal = inverse_diagonal(case);
    let solve = move |tolerance: f64, x: &mut [f64]| {
        Ok(solved(textbook_cg(&a, &diagonal, &case.load, x, tolerance, MAX_ITERATIONS)))
    };
    Ok(Prepared { solve: Box::new(solve), products: 1 })
}

fn faer_iterative<'a>(case: &'a Case, _: &Team) -> Result<Prepared<'a>, String> {
    let a = SparseColMat::<usize, f64>::from(&case.matrix);
    let diagonal = inverse_diagonal(case);
    let solve = move |tolerance: f64, x: &mut [f64]| {
        Ok(solved(faer_cg(&a, &diagonal, &case.load, x, tolerance, MAX_ITERATIONS)?))
    };
    Ok(Prepared { solve: Box::new(solve), products: 1 })
}

/// Analysis, factorisation and solution by faer's own types.
fn faer_direct<'a>(case: &'a Case, _: &Team) -> Result<Prepared<'a>, String> {
    let a = SparseColMat::<usize, f64>::from(&case.matrix);
    let symbolic = SymbolicLlt::try_new(a.symbolic(), Side::Lower).map_err(|e| format!("{e:?}"))?;
    llt_solver(case, &a, symbolic)
}

/// As [`faer_direct`], without the analysis: what a matrix of the same pattern costs.
fn faer_direct_again<'a>(case: &'a Case, _: &Team) -> Result<Prepared<'a>, String> {
    let analysis = case.analysis.get_or_init(|| {
        let a = SparseColMat::<usize, f64>::from(&case.matrix);
        let symbolic = SymbolicLlt::try_new(a.symbolic(), Side::Lower).map_err(|e| format!("{e:?}"));
        symbolic.map(|symbolic| (a, symbolic))
    });
    let (a, symbolic) = analysis.as_ref().map_err(String::clone)?;
    llt_solver(case, a, symbolic.clone())
}

fn llt_solver<'a>(
    case: &'a Case,
    a: &SparseColMat<usize, f64>,
    symbolic: SymbolicLlt<usize>,
) -> Result<Prepared<'a>, String> {
    let factor = Llt::try_new_with_symbolic(symbolic, a.as_ref(), Side::Lower).map_err(|e| format!("{e:?}"))?;
    let solve = move |_: f64, x: &mut [f64]| {
        x.copy_from_slice(&case.load);
        let n = x.len();
        factor.solve_in_place_with_conj(Conj::No, MatMut::from_column_major_slice_mut(x, n, 1));
        Ok(Solved { iterations: 1, stop: Stop::Converged })
    };
    Ok(Prepared { solve: Box::new(solve), products: 0 })
}

fn inverse_diagonal(case: &Case) -> Vec<f64> {
    let blocks = (0..case.matrix.n_rows()).map(|row| case.matrix.diagonal(row));
    blocks.flat_map(|block| [0, 1, 2].map(|k| 1.0 / block[k][k])).collect()
}

fn solved((iterations, converged): (usize, bool)) -> Solved {
    Solved { iterations, stop: if converged { Stop::Converged } else { Stop::IterationLimit } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solvers::grid::relative_residual;
    use crate::solvers::systems::cube;

    #[test]
    fn every_method_solves_a_small_system() {
        for dt in [None, Some(1e-3)] {
            let case = cube(4, 0.4).case(dt);
            for method in METHODS {
                let name = format!("{}, {}", method.solver, method.preconditioner);
                let mut prepared = (method.set_up)(&case, &Team::serial()).unwrap();
                let mut x = vec![0.0; case.load.len()];
                let solved = (prepared.solve)(1e-8, &mut x).unwrap();
                assert_eq!(solved.stop, Stop::Converged, "{name}");
                let residual = relative_residual(&case, &x);
                assert!(residual <= 1.1e-8, "{name}: {residual:e}");
            }
        }
    }
}
