//! A warm solve allocates nothing, counted by the allocator itself.
#![allow(unsafe_code)] // implementing `GlobalAlloc` has no safe form

#[path = "suite/common/mod.rs"]
mod common;

use common::energies::{Chain, Law};
use common::{grid, rule};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use stylet_solver::LinearOperator;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::nonlinear::line_search::{ApproximateWolfe, Armijo, StrongWolfe};
use stylet_solver::nonlinear::{
    Direction, LbfgsSettings, LbfgsWorkspace, LineSearch, Linearization, NewtonSettings, NewtonWorkspace,
    NonlinearCgSettings, NonlinearCgWorkspace, StepModel, lbfgs, newton_cg, nonlinear_cg,
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
