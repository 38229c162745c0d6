//! A warm solve allocates nothing, counted by the allocator itself.
#![allow(unsafe_code)] // implementing `GlobalAlloc` has no safe form

#[path = "suite/common/mod.rs"]
mod common;

use common::energies::{Chain, Law};
use common::{grid, krylov, rule};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use stylet_solver::LinearOperator;
use stylet_solver::complementarity::{
    BoxProblem, BoxWorkspace, GaussSeidelSettings, PivotingSettings, block_pivoting, projected_gauss_seidel,
};
use stylet_solver::condensation::{CondensedMatrix, Prescribed, Woodbury};
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::linear::{
    CgSettings, CgWorkspace, ConstrainedWorkspace, ConstraintPreconditioner, Constraints, Elimination,
    EliminationWorkspace, KktOperator, KktWorkspace, KrylovReport, ManyCgWorkspace, MinresWorkspace, NullSpace,
    NullSpaceWorkspace, SchurDiagonal, constrained_cg, elimination_cg, kkt_cg, kkt_minres, many_cg, minres,
    null_space_cg, projected_cg,
};
use stylet_solver::nonlinear::line_search::{ApproximateWolfe, Armijo, StrongWolfe};
use stylet_solver::nonlinear::{
    Direction, LbfgsSettings, LbfgsWorkspace, LineSearch, Linearization, NewtonSettings, NewtonWorkspace,
    NonlinearCgSettings, NonlinearCgWorkspace, StepModel, lbfgs, newton_cg, nonlinear_cg,
};
use stylet_solver::precondition::aggregation::{
    Form, Modes, SmoothedAggregation, SmoothedAggregationSettings, TwoLevel,
};
use stylet_solver::precondition::multilevel::{BisectionHierarchy, Bpx, VCycle};
use stylet_solver::precondition::{
    BlockJacobi, Chebyshev, ChebyshevSettings, Identity, IncompleteCholesky, Jacobi, Preconditioner, SinglePrecision,
    Ssor, SsorSettings,
};
use stylet_solver::sparse::{BlockCsr, ElementBlocks, ElementContributions, RefreshRule};
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

thread_local!(static ALLOCATIONS: Cell<usize> = const { Cell::new(0) });

struct Counting;

// SAFETY: every call is passed on to the system allocator unchanged; counting touches a thread-local integer only.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's promises are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(p, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations<T>(f: impl FnOnce() -> T) -> (T, usize) {
    let before = ALLOCATIONS.get();
    let result = f();
    (result, ALLOCATIONS.get() - before)
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| vec![1.0; 3]).1, 1);
}

fn cg_allocations(m: &impl Preconditioner, tolerance: f64) -> usize {
    let s = grid(20);
    let mut ws = CgWorkspace::new();
    let settings = CgSettings { stop: rule(tolerance, Criterion::Reaction), max_iterations: 1000 };
    let mut x = s.x0.clone();
    projected_cg(&s.a, m, &s.w, &s.b, &mut x, &settings, &mut ws).unwrap();
    x.copy_from_slice(&s.x0);
    let (report, count) = allocations(|| projected_cg(&s.a, m, &s.w, &s.b, &mut x, &settings, &mut ws));
    assert!(report.unwrap().iterations > 5);
    count
}

#[test]
fn a_warm_linear_solve_allocates_nothing() {
    let s = grid(20);
    for tolerance in [1e-3, 1e-10, 1e-20] {
        assert_eq!(cg_allocations(&Identity, tolerance), 0);
        assert_eq!(cg_allocations(&Jacobi::new(&s.a, &s.w).unwrap(), tolerance), 0);
        assert_eq!(cg_allocations(&BlockJacobi::new(&s.a, &s.w).unwrap(), tolerance), 0);
    }
}

#[test]
fn warm_preconditioners_allocate_nothing() {
    let s = grid(20);
    let (a, w, n) = (&s.a, &s.w, s.a.n_rows());
    let settings = SmoothedAggregationSettings { max_coarse_dim: 20, ..Default::default() };
    let mut ssor = Ssor::new(a, w, SsorSettings::default()).unwrap();
    let mut ic = IncompleteCholesky::new(a, w).unwrap();
    let mut chebyshev = Chebyshev::new(a, w, ChebyshevSettings::new(3)).unwrap();
    let mut two_level = TwoLevel::new(a, w, Modes::constants(n), Form::v_cycle(), None).unwrap();
    let mut smoothed = SmoothedAggregation::new(a, w, Modes::constants(n), settings).unwrap();
    let single =
        SmoothedAggregation::in_single_precision(&Team::serial(), a, w, Modes::constants(n), settings).unwrap();
    let mut single = SinglePrecision::new(single);
    single.apply(&vec![1.0; 2 * n], &mut vec![0.0; 2 * n]);
    assert!(smoothed.dims().count() > 2);
    let rebuild = || {
        ssor.rebuild(a, w, SsorSettings::default()).unwrap();
        ic.rebuild(a, w).unwrap();
        chebyshev.rebuild(a, w, ChebyshevSettings::new(3)).unwrap();
        two_level.rebuild(a, w).unwrap();
        smoothed.rebuild(a, w).unwrap();
        single.inner_mut().rebuild(a, w).unwrap();
    };
    assert_eq!(allocations(rebuild).1, 0);
    for m in [&ssor as &dyn Preconditioner, &ic, &chebyshev, &two_level, &smoothed, &single] {
        let (r, mut z) = (vec![1.0; 2 * n], vec![0.0; 2 * n]);
        assert_eq!(allocations(|| m.apply(&r, &mut z)).1, 0);
    }
    assert_eq!(cg_allocations(&smoothed, 1e-10), 0);
}

/// A chain whose Hessian is made once: what the energy allocates is not the solver's.
struct Prepared(Chain, BlockCsr<2>);

impl Energy for Prepared {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        self.0.value(x)
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.0.gradient(x, g);
    }

    fn linearize(&mut self, _: &[f64]) {}

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.1.apply(p, hp);
    }
}

impl BlockHessian<2> for Prepared {
    fn matrix(&self) -> &BlockCsr<2> {
        &self.1
    }
}

#[test]
fn a_warm_nonlinear_solve_allocates_nothing() {
    let mut chain = Chain::new(20, Law::Cosh, 5.0, [2.0, 1.0]);
    chain.linearize(&[0.0; 40]);
    let hessian = chain.matrix().clone();
    let mut energy = Prepared(chain, hessian);
    let mut w = Subspace::new(20);
    w.set(0, Constraint::Fixed).unwrap();
    w.set(5, Constraint::Line([1.0, 0.0])).unwrap();
    let stop = rule(1e-8, Criterion::Reaction);

    let mut ws = NewtonWorkspace::new();
    for linearization in [Linearization::Every, Linearization::WhenSlow] {
        let settings = NewtonSettings { linearization, ..NewtonSettings::new(stop) };
        newton_cg(&mut energy, &w, 2.0, &mut [0.0; 40], &settings, &mut ws).unwrap();
        let solve = || newton_cg(&mut energy, &w, 2.0, &mut [0.0; 40], &settings, &mut ws);
        let (report, count) = allocations(solve);
        assert_eq!((report.unwrap().stop, count), (Stop::Converged, 0));
    }

    let searches = [
        LineSearch::GradientFirst,
        LineSearch::Armijo(Armijo::default()),
        LineSearch::StrongWolfe(StrongWolfe::tight()),
        LineSearch::ApproximateWolfe(ApproximateWolfe::default()),
    ];
    let mut ws = NonlinearCgWorkspace::new();
    for direction in [Direction::FletcherReeves, Direction::HagerZhang { eta: 0.01 }, Direction::Subspace] {
        for search in searches {
            let settings = NonlinearCgSettings { direction, search, ..NonlinearCgSettings::new(stop) };
            nonlinear_cg(&mut energy, &Identity, &w, 2.0, &mut [0.0; 40], &settings, &mut ws).unwrap();
            let solve = || nonlinear_cg(&mut energy, &Identity, &w, 2.0, &mut [0.0; 40], &settings, &mut ws);
            let (report, count) = allocations(solve);
            assert_eq!((report.unwrap().stop, count), (Stop::Converged, 0));
        }
    }
    let mut ws = LbfgsWorkspace::new();
    for search in searches {
        let settings = LbfgsSettings { search, ..LbfgsSettings::new(stop) };
        lbfgs(&mut energy, &Identity, &w, 2.0, &mut [0.0; 40], &settings, &mut ws).unwrap();
        let solve = || lbfgs(&mut energy, &Identity, &w, 2.0, &mut [0.0; 40], &settings, &mut ws);
        let (report, count) = allocations(solve);
        assert_eq!((report.unwrap().stop, count), (Stop::Converged, 0));
    }

    let mut ws = NonlinearCgWorkspace::new();
    for step in [StepModel::Curvature, StepModel::Secant] {
        let settings = NonlinearCgSettings { step, ..NonlinearCgSettings::new(stop) };
        nonlinear_cg(&mut energy, &Identity, &w, 2.0, &mut [0.0; 40], &settings, &mut ws).unwrap();
        let solve = || nonlinear_cg(&mut energy, &Identity, &w, 2.0, &mut [0.0; 40], &settings, &mut ws);
        let (report, count) = allocations(solve);
        assert_eq!((report.unwrap().stop, count), (Stop::Converged, 0));
    }
}

#[test]
fn rewriting_a_row_in_its_place_allocates_nothing() {
    let mut s = grid(20);
    let (cols, blocks) = s.a.row(50);
    let (cols, blocks) = (cols.to_vec(), blocks.to_vec());
    let (result, count) = allocations(|| s.a.set_row(50, &cols, &blocks));
    assert_eq!((result, count), (Ok(()), 0));
}

/// Node `i` midway between `i/2` and its predecessor: a hierarchy of many levels.
fn hierarchy(n: usize) -> BisectionHierarchy {
    let (mut parents, mut generations) = (vec![[0; 2]; 2], vec![0u16; 2]);
    for i in 2..n {
        parents.push([i as u32 / 2, i as u32 / 2 - 1]);
        generations.push(1 + generations[i / 2].max(generations[i / 2 - 1]));
    }
    BisectionHierarchy::new(0..n as u32, &parents, &generations).unwrap()
}

#[test]
fn multilevel_preconditioners_allocate_nothing_once_built() {
    let s = grid(20);
    let h = hierarchy(400);
    let (mut bpx, mut v) = (Bpx::new(&s.a, &s.w, &h).unwrap(), VCycle::new(&s.a, &s.w, &h).unwrap());
    assert_eq!(cg_allocations(&bpx, 1e-10), 0);
    assert_eq!(cg_allocations(&v, 1e-10), 0);
    assert_eq!(allocations(|| bpx.rebuild(&s.a, &s.w, &h).unwrap()).1, 0);
    assert_eq!(allocations(|| v.rebuild(&s.a, &s.w, &h).unwrap()).1, 0);
}

fn spring(k: f64) -> ElementBlocks<2, 2> {
    let block = |s: f64| [[s, 0.0], [0.0, s]];
    [[block(k), block(-k)], [block(-k), block(k)]]
}

#[test]
fn lazy_updates_allocate_nothing_once_warm() {
    let n = 200;
    let mut matrix = BlockCsr::new(n + 1);
    let mut lazy = ElementContributions::new(RefreshRule { max_replacements: 3, rows_per_update: 4 });
    lazy.change(&mut matrix, [], (0..n).map(|e| (e, [e as u32, e as u32 + 1], spring(1.0)))).unwrap();
    let mut update = |step: usize| {
        let measure = |e: usize| ((e * 7 + step) % 5) as f64;
        allocations(|| lazy.update_where(&mut matrix, measure, 2.5, |e| spring(1.0 + e as f64)).unwrap())
    };
    update(0);
    for step in 1..10 {
        let (report, count) = update(step);
        assert!(report.elements > 50 && report.rows_refreshed > 0 && count == 0, "{report:?} {count}");
    }
}

#[test]
fn small_dense_methods_allocate_nothing_once_warm() {
    let n = 12usize;
    let matrix: Vec<f64> =
        (0..n * n).map(|k| 1.0 / (1.0 + (k / n).abs_diff(k % n) as f64) + f64::from(k / n == k % n)).collect();
    let q: Vec<f64> = (0..n).map(|i| (i as f64 * 1.7).sin()).collect();
    let (lower, upper) = (vec![-0.3; n], vec![0.2; n]);
    let problem = BoxProblem { matrix: &matrix, q: &q, lower: &lower, upper: &upper };
    let (mut lambda, mut ws) = (vec![0.0; n], BoxWorkspace::new());
    let mut solve = || {
        ws.set_states(&[]);
        block_pivoting(&problem, &mut lambda, &PivotingSettings::default(), &mut ws).unwrap();
        lambda.fill(0.0);
        projected_gauss_seidel(&problem, &mut lambda, &GaussSeidelSettings::default(), &mut ws).unwrap()
    };
    solve();
    assert_eq!(allocations(solve).1, 0);

    let mut condensed = CondensedMatrix::new(n, &matrix).unwrap();
    let ((), count) = allocations(|| {
        condensed.prescribe(3, Prescribed::Displacement).unwrap();
        condensed.drift();
        condensed.refresh().unwrap();
    });
    assert_eq!(count, 0);

    let (u, mut woodbury) = (vec![1.0; 2 * n], Woodbury::new());
    let mut build = || woodbury.build(n, &u, &[1.0, 0.0, 0.0, 0.0], |x| x.iter_mut().for_each(|x| *x *= 0.5)).unwrap();
    build();
    assert_eq!(allocations(build).1, 0);
    assert_eq!(allocations(|| woodbury.correct(&mut lambda)).1, 0);
}

/// Allocations of the second of two equal calls, which succeed.
fn second<T, E: std::fmt::Debug>(mut solve: impl FnMut() -> Result<T, E>) -> usize {
    solve().unwrap();
    let (result, count) = allocations(solve);
    result.unwrap();
    count
}

/// Pairs of the grid's nodes, held together.
fn pairs(s: &common::System<2>, count: usize) -> Constraints {
    let mut c = Constraints::new(s.b.len());
    let free: Vec<usize> = (0..s.a.n_rows()).filter(|v| v % 4 == 1 && s.w.get(*v) == Constraint::Free).collect();
    for k in 0..count {
        let entry = 2 * free[k / 2] + k % 2;
        c.push(&[entry, entry + 2], &[1.0, -1.0], 0.01).unwrap();
    }
    c
}

#[test]
fn warm_indefinite_and_constrained_solves_allocate_nothing() {
    // With `direct` the second system's Schur matrix is factored sparsely.
    for (s, rows) in [(grid(20), 30), (grid(70), if cfg!(feature = "direct") { 1000 } else { 500 })] {
        let settings = krylov(1e-8, Criterion::Reaction);
        let cg = CgSettings { stop: settings.stop, max_iterations: 1000 };
        let block = BlockJacobi::new(&s.a, &s.w).unwrap();
        let c = pairs(&s, rows);
        let m = ConstraintPreconditioner::new(&s.a, &s.w, &c).unwrap();
        let k = KktOperator::new(&s.a, &s.w, &c).unwrap();
        let e = Elimination::new(&s.a, &s.w, &c).unwrap();
        let (mut x, mut lambda) = (s.x0.clone(), vec![0.0; rows]);

        let mut ws = MinresWorkspace::new();
        assert_eq!(second(|| minres(&s.a, &block, &s.w, &s.b, &mut x, &settings, &mut ws)), 0);
        x.copy_from_slice(&s.x0);
        let mut ws = ConstrainedWorkspace::new();
        let solve = || {
            x.copy_from_slice(&s.x0);
            constrained_cg(&s.a, &m, &s.b, &mut x, &mut lambda, &settings, &mut ws)
        };
        assert_eq!(second(solve), 0);
        let mut ws = KktWorkspace::new();
        let solve = || {
            x.copy_from_slice(&s.x0);
            kkt_cg(&k, &SchurDiagonal(&m), &s.b, &mut x, &mut lambda, &settings, &mut ws)?;
            x.copy_from_slice(&s.x0);
            kkt_minres(&k, &SchurDiagonal(&m), &s.b, &mut x, &mut lambda, &settings, &mut ws)
        };
        assert_eq!(second(solve), 0);
        let mut ws = EliminationWorkspace::new();
        let solve = || {
            x.copy_from_slice(&s.x0);
            elimination_cg(&s.a, &e, &s.b, &mut x, &cg, &mut ws)
        };
        assert_eq!(second(solve), 0);
    }
}

#[test]
fn warm_solves_of_many_right_sides_allocate_nothing() {
    let s = grid(20);
    let (b, mut ws) = (s.b.repeat(3), ManyCgWorkspace::new());
    let none = KrylovReport {
        stop: Stop::Stalled,
        iterations: 0,
        products: 0,
        residual_norm: 0.0,
        reaction_norm: 0.0,
        threshold: 0.0,
    };
    let (mut x, mut reports) = (s.x0.repeat(3), [none; 3]);
    let settings = krylov(1e-8, Criterion::Reaction);
    let solve = || {
        x.fill(0.0);
        many_cg(&s.a, &Identity, &s.w, (&b, &mut x), &mut reports, &settings, &mut ws)
    };
    assert_eq!(second(solve), 0);
}

#[test]
fn a_change_of_state_of_a_coupled_body_allocates_nothing() {
    let (s, small) = (grid(20), grid(3));
    let m = BlockJacobi::new(&s.a, &s.w).unwrap();
    let attachments: Vec<Vec<(usize, f64)>> = (0..9).map(|i| vec![(25 + 40 * i, 0.5), (26 + 40 * i, 0.5)]).collect();
    let states = [Constraint::Free, Constraint::Fixed, Constraint::Line([0.6, 0.8])];
    let mut form = NullSpace::new(&s.a, &s.w, small.a.clone(), attachments, &[Constraint::Fixed; 9]).unwrap();
    let (mut u, mut v, g, mut ws) = (s.x0.clone(), small.x0.clone(), vec![0.0; 18], NullSpaceWorkspace::new());
    let settings = CgSettings { stop: rule(1e-8, Criterion::External), max_iterations: 1000 };
    let mut solve = |form: &NullSpace<2>| {
        u.fill(0.0);
        v.fill(0.0);
        null_space_cg(form, &s.a, &m, (&s.b, &small.b, &g), (&mut u, &mut v), &settings, &mut ws).unwrap()
    };
    // Memory grows to that of the states with the most unknowns and with the most ties once.
    for state in [Constraint::Fixed, Constraint::Free] {
        (0..9).for_each(|node| form.set_free(node, state).unwrap());
        solve(&form);
    }
    let (_, count) = allocations(|| {
        for node in 0..9 {
            for state in states {
                form.set_free(node, state).unwrap();
            }
            solve(&form);
        }
    });
    assert_eq!(count, 0);
}

#[cfg(feature = "direct")]
mod direct {
    use super::*;
    use std::sync::Arc;
    use stylet_solver::linear::direct::{Factor, FactorNumber, FillOrder, Method, Symbolic};
    use stylet_solver::linear::{RefineSettings, RefineWorkspace, refine};
    use stylet_solver::precondition::StaleFactor;

    fn check<T: FactorNumber>(symbolic: &Arc<Symbolic<3>>, method: Method, a: &BlockCsr<3>, load: &[f64]) {
        let mut w = Subspace::new(a.n_rows());
        w.set(3, Constraint::Line([1.0, 0.0, 0.0])).unwrap();
        let mut factor = Factor::<3, T>::new(symbolic.clone(), method, a, &w).unwrap();
        w.set(4, Constraint::Fixed).unwrap();
        assert_eq!(allocations(|| factor.refactor(a, &w).unwrap()).1, 0, "{method:?}: refactor");

        let mut columns: Vec<f64> = load.iter().chain(load).copied().collect();
        factor.solve(&mut columns).unwrap();
        assert_eq!(allocations(|| factor.solve(&mut columns).unwrap()).1, 0, "{method:?}: two right sides");
        assert_eq!(allocations(|| factor.solve(&mut columns[..load.len()]).unwrap()).1, 0, "{method:?}: one");

        let settings = RefineSettings { stop: rule(1e-12, Criterion::Reaction), max_iterations: 10 };
        let mut ws = RefineWorkspace::new();
        let mut x = vec![0.0; load.len()];
        refine(a, &factor, &w, load, &mut x, &settings, &mut ws).unwrap();
        x.fill(0.0);
        let (report, count) = allocations(|| refine(a, &factor, &w, load, &mut x, &settings, &mut ws));
        assert_eq!((report.unwrap().stop, count), (Stop::Converged, 0), "{method:?}: refine");

        let mut stale = StaleFactor::new(factor, a, &w).unwrap();
        let identity = vec![[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]; a.n_rows()];
        stale.turn(&identity).unwrap();
        stale.apply(load, &mut x);
        assert_eq!(allocations(|| stale.apply(load, &mut x)).1, 0, "{method:?}: stale");
        assert_eq!(allocations(|| stale.turn(&identity).unwrap()).1, 0, "{method:?}: turn");
        assert_eq!(allocations(|| stale.follow(a, &w, []).unwrap()).1, 0, "{method:?}: follow");
    }

    /// One cube that faer factors column by column, and one with supernodes.
    #[test]
    fn a_warm_factor_allocates_nothing() {
        for cells in [2, 6] {
            let cube = common::elasticity::cube(cells, 0.34);
            let symbolic = Arc::new(Symbolic::new(&cube.a, FillOrder::MinimumDegree).unwrap());
            let pivoted = Arc::new(Symbolic::indefinite(&cube.a, FillOrder::MinimumDegree).unwrap());
            for (symbolic, method) in [(&symbolic, Method::Llt), (&symbolic, Method::Ldlt), (&pivoted, Method::Lblt)] {
                check::<f64>(symbolic, method, &cube.a, &cube.load);
                check::<f32>(symbolic, method, &cube.a, &cube.load);
            }
        }
    }
}
