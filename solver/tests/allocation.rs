//! A warm solve allocates nothing, counted by the allocator itself.
#![allow(unsafe_code)] // implementing `GlobalAlloc` has no safe form

#[path = "suite/common/mod.rs"]
mod common;

use common::energies::{Chain, Law};
use common::{grid, krylov, rule};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use stylet_solver::LinearOperator;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::linear::{
    CgSettings, CgWorkspace, ConstrainedWorkspace, ConstraintPreconditioner, Constraints, Elimination,
    EliminationWorkspace, KktOperator, KktWorkspace, KrylovReport, ManyCgWorkspace, MinresWorkspace, NullSpace,
    NullSpaceWorkspace, SchurDiagonal, constrained_cg, elimination_cg, kkt_cg, kkt_minres, many_cg, minres,
    null_space_cg, projected_cg,
};
use stylet_solver::nonlinear::{
    Linearization, NewtonSettings, NewtonWorkspace, NonlinearCgSettings, NonlinearCgWorkspace, StepModel, newton_cg,
    nonlinear_cg,
};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::subspace::{Constraint, Subspace};

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

    let mut ws = NonlinearCgWorkspace::new();
    for step in [StepModel::Curvature, StepModel::Secant] {
        let settings = NonlinearCgSettings { stop, max_iterations: 1000, step };
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
