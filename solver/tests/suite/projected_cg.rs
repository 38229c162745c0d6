//! Projected conjugate gradients against dense factorisations, and their behaviour at the edges.

use crate::common::{System, dense_solution, distance, from_dense, grid, rule, system};
use proptest::prelude::*;
use stylet_solver::LinearOperator;
use stylet_solver::linear::{CgError, CgReport, CgSettings, CgWorkspace, projected_cg};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::stop::{Criterion, Stop, StopRule, StopRuleError};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;
use stylet_solver::vector::{dot, norm2};

fn settings(stop: StopRule) -> CgSettings {
    CgSettings { stop, max_iterations: 2_000 }
}

fn solve<const B: usize>(
    s: &System<B>,
    m: &impl Preconditioner,
    stop: StopRule,
    ws: &mut CgWorkspace,
) -> (Vec<f64>, CgReport) {
    let mut x = s.x0.clone();
    let report = projected_cg(&s.a, m, &s.w, &s.b, &mut x, &settings(stop), ws).unwrap();
    (x, report)
}

/// `b − A x`.
fn residual<const B: usize>(s: &System<B>, x: &[f64]) -> Vec<f64> {
    let mut ax = vec![0.0; x.len()];
    s.a.apply(x, &mut ax);
    s.b.iter().zip(&ax).map(|(b, ax)| b - ax).collect()
}

fn check<const B: usize>(s: &System<B>, m: &impl Preconditioner) {
    let exact = dense_solution(s);
    let mut ws = CgWorkspace::new();
    let (x, report) = solve(s, m, rule(1e-13, Criterion::Reaction), &mut ws);
    // At 1e-13 rounding may have the last word, but the answer is that of the factorisation either way.
    assert_ne!(report.stop, Stop::IterationLimit, "{report:?}");
    assert!(distance(&x, &exact) <= 1e-9 * norm2(&exact).max(1.0), "{report:?}");
    // Moves stay in W; the residual at hand is that of x, reactions included.
    let mut outside = vec![0.0; B * s.w.n_constrained()];
    let moved: Vec<f64> = x.iter().zip(&s.x0).map(|(x, x0)| x - x0).collect();
    s.w.project_complement(&moved, &mut outside);
    assert!(norm2(&outside) <= 1e-13 * norm2(&x).max(1.0));
    let r = residual(s, &x);
    assert!(distance(&r, ws.residual()) <= 1e-11 * (norm2(&s.b) + norm2(&r)));
    // Again from the solution: nothing to do.
    let mut again = x.clone();
    let looser = settings(rule(1e-9, Criterion::Reaction));
    let report = projected_cg(&s.a, m, &s.w, &s.b, &mut again, &looser, &mut ws).unwrap();
    assert_eq!((report.stop, report.iterations, report.products), (Stop::Converged, 0, 1));
    assert_eq!(again, x);
}

fn check_all<const B: usize>(s: &System<B>) {
    check(s, &Identity);
    check(s, &Jacobi::new(&s.a, &s.w).unwrap());
    check(s, &BlockJacobi::new(&s.a, &s.w).unwrap());
}

proptest! {
    #[test]
    fn agrees_with_a_dense_factorisation_2d(s in system::<2>()) { check_all(&s); }

    #[test]
    fn agrees_with_a_dense_factorisation_3d(s in system::<3>()) { check_all(&s); }

    /// The rule holds for the residual and the reactions of the iterate returned, evaluated independently.
    #[test]
    fn stops_by_the_rule(s in system::<2>(), exponent in 1i32..12, reaction in any::<bool>()) {
        let criterion = if reaction { Criterion::Reaction } else { Criterion::External };
        let stop = rule(10f64.powi(-exponent), criterion);
        let mut ws = CgWorkspace::new();
        let (x, report) = solve(&s, &Identity, stop, &mut ws);
        prop_assert_eq!(report.stop, Stop::Converged);
        let mut r = residual(&s, &x);
        let mut outside = vec![0.0; 2 * s.w.n_constrained()];
        s.w.split(&mut r, &mut outside);
        let threshold = stop.threshold(norm2(&s.b), norm2(&outside));
        prop_assert!(norm2(&r) <= threshold * 1.001, "{} above {threshold}", norm2(&r));
        prop_assert!((report.reaction_norm - norm2(&outside)).abs() <= 1e-9 * (1.0 + norm2(&outside)));
        prop_assert!((report.residual_norm - norm2(&r)).abs() <= 1e-3 * norm2(&r) + 1e-12 * norm2(&s.b));
    }
}

#[test]
fn exact_arithmetic_ends_after_as_many_steps_as_eigenvalues() {
    // Three distinct eigenvalues on the free space.
    let a = from_dense::<2>(10, |i, j| if i == j { [1.0, 5.0, 9.0][i % 3] } else { 0.0 });
    let s = System { a, w: Subspace::new(10), b: vec![1.0; 20], x0: vec![0.0; 20] };
    let (_, report) = solve(&s, &Identity, rule(1e-5, Criterion::External), &mut CgWorkspace::new());
    assert_eq!(report.iterations, 3);
}

#[test]
fn reaction_rule_converges_where_only_displacements_are_prescribed() {
    let mut s = grid(20);
    s.b.fill(0.0);
    for i in 0..20 {
        s.x0[2 * (i * 20)] = 1.0; // the fixed side moves by one
    }
    let mut ws = CgWorkspace::new();
    let (x, report) = solve(&s, &Identity, rule(1e-4, Criterion::Reaction), &mut ws);
    assert_eq!(report.stop, Stop::Converged);
    assert!(report.iterations > 3);
    assert_eq!(x[0], 1.0);
    // Without reactions the threshold is zero, which rounding does not allow: that is said, not hidden.
    let (_, report) = solve(&s, &Identity, rule(1e-4, Criterion::External), &mut ws);
    assert_eq!(report.stop, Stop::Stalled);
    // A rounding floor makes it possible again.
    let stop = StopRule { round_floor: 1e-10, ..rule(1e-4, Criterion::External) };
    let (_, report) = solve(&s, &Identity, stop, &mut ws);
    assert_eq!(report.stop, Stop::Converged);
}

#[test]
fn a_tolerance_below_rounding_stalls_with_the_best_iterate() {
    let s = grid(40);
    let mut ws = CgWorkspace::new();
    let (x, report) = solve(&s, &Identity, rule(1e-19, Criterion::Reaction), &mut ws);
    assert_eq!(report.stop, Stop::Stalled);
    assert!(report.iterations < 400, "{report:?}");
    let mut r = residual(&s, &x);
    s.w.project(&mut r);
    assert!(norm2(&r) <= 1e-14 * norm2(&s.b));
    assert!((norm2(&r) - report.residual_norm).abs() <= 1e-16 * norm2(&s.b));
    // From there it stalls again at once, and does not make things worse.
    let mut again = x.clone();
    let tight = settings(rule(1e-19, Criterion::Reaction));
    let second = projected_cg(&s.a, &Identity, &s.w, &s.b, &mut again, &tight, &mut ws).unwrap();
    assert_eq!(second.stop, Stop::Stalled);
    assert!(second.residual_norm <= report.residual_norm);
}

#[test]
fn the_budget_ends_a_solve_with_the_iterate_so_far() {
    let s = grid(30);
    let mut x = s.x0.clone();
    let mut ws = CgWorkspace::new();
    let mut energy_before = 0.0;
    for max_iterations in [0, 1, 5, 10] {
        x.copy_from_slice(&s.x0);
        let settings = CgSettings { stop: rule(1e-10, Criterion::External), max_iterations };
        let report = projected_cg(&s.a, &Identity, &s.w, &s.b, &mut x, &settings, &mut ws).unwrap();
        assert_eq!((report.stop, report.iterations), (Stop::IterationLimit, max_iterations));
        let mut ax = vec![0.0; x.len()];
        let energy = 0.5 * s.a.apply_dot(&x, &mut ax) - dot(&s.b, &x);
        assert!(energy < energy_before || max_iterations == 0);
        energy_before = energy;
    }
}

#[test]
fn preconditioners_save_iterations_where_blocks_differ() {
    let mut s = grid(30);
    for i in (0..900).filter(|i| i % 7 == 3) {
        s.a.add_to_block(i, i, &[[900.0, 500.0], [500.0, 300.0]]).unwrap();
    }
    let iterations = |m: &dyn Preconditioner| {
        let mut x = s.x0.clone();
        let settings = settings(rule(1e-6, Criterion::Reaction));
        let mut ws = CgWorkspace::new();
        projected_cg(&s.a, m, &s.w, &s.b, &mut x, &settings, &mut ws).unwrap().iterations
    };
    let none = iterations(&Identity);
    let jacobi = iterations(&Jacobi::new(&s.a, &s.w).unwrap());
    let block = iterations(&BlockJacobi::new(&s.a, &s.w).unwrap());
    assert!(block < jacobi && jacobi < none, "{block} {jacobi} {none}");
}

#[test]
fn a_matrix_that_is_not_positive_is_refused() {
    let a = from_dense::<2>(2, |i, j| if i == j { [1.0, 2.0, -1.0, 3.0][i] } else { 0.0 });
    let mut s = System { a, w: Subspace::new(2), b: vec![1.0; 4], x0: vec![0.0; 4] };
    let mut ws = CgWorkspace::new();
    let stop = settings(rule(1e-8, Criterion::External));
    let mut x = s.x0.clone();
    let error = projected_cg(&s.a, &Identity, &s.w, &s.b, &mut x, &stop, &mut ws).unwrap_err();
    assert!(matches!(error, CgError::NotPositiveDefinite { iteration: 2.., curvature } if curvature <= 0.0), "{error}");
    assert!(x.iter().all(|v| v.is_finite()));
    // Restricted to moves that avoid the negative direction it is fine.
    s.w.set(1, Constraint::Line([0.0, 1.0])).unwrap();
    let (x, report) = solve(&s, &Identity, stop.stop, &mut ws);
    assert_eq!(report.stop, Stop::Converged);
    assert!(distance(&x, &[1.0, 0.5, 0.0, 1.0 / 3.0]) < 1e-7);
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let s = grid(5);
    let n = s.b.len();
    let mut ws = CgWorkspace::new();
    let mut run = |b: &[f64], x: &[f64], w: &Subspace<2>, stop: StopRule| {
        projected_cg(&s.a, &Identity, w, b, &mut x.to_vec(), &settings(stop), &mut ws)
    };
    let good = rule(1e-6, Criterion::External);
    let shape = |what, len| Err(CgError::Shape { what, dim: n, len });
    assert_eq!(run(&s.b[1..], &s.x0, &s.w, good), shape("b", n - 1));
    assert_eq!(run(&s.b, &s.x0[2..], &s.w, good), shape("x", n - 2));
    assert_eq!(run(&s.b, &s.x0, &Subspace::new(24), good), shape("the subspace", 48));
    let mut bad = s.b.clone();
    bad[7] = f64::NAN;
    let not_finite = |what, index| Err(CgError::NotFinite { what, index, iteration: 0 });
    assert_eq!(run(&bad, &s.x0, &s.w, good), not_finite("b", 7));
    bad[7] = 1e200;
    assert_eq!(run(&bad, &s.x0, &s.w, good), Err(CgError::Overflow { what: "b", iteration: 0 }));
    let mut bad = s.x0.clone();
    bad[9] = f64::INFINITY;
    assert_eq!(run(&s.b, &bad, &s.w, good), not_finite("x", 9));
    for tolerance in [0.0, f64::NAN] {
        let error = run(&s.b, &s.x0, &s.w, StopRule { tolerance, ..good }).unwrap_err();
        assert!(matches!(error, CgError::StopRule(StopRuleError::Tolerance(_))));
    }
}

/// An operator that breaks down: its products hold a NaN in one row.
struct Broken(usize);

impl LinearOperator for Broken {
    fn dim(&self) -> usize {
        self.0
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(x);
        if x.iter().any(|v| *v != 0.0) {
            y[3] = f64::NAN;
        }
    }
}

#[test]
fn a_product_that_is_not_finite_names_its_row() {
    let (mut x, mut ws) = (vec![0.0; 6], CgWorkspace::new());
    let stop = settings(rule(1e-6, Criterion::External));
    let w = Subspace::<2>::new(3);
    let error = projected_cg(&Broken(6), &Identity, &w, &[1.0; 6], &mut x, &stop, &mut ws);
    assert_eq!(error, Err(CgError::NotFinite { what: "A p", index: 3, iteration: 1 }));
}

struct Negative;

impl Preconditioner for Negative {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        for (z, r) in z.iter_mut().zip(r) {
            *z = -r;
        }
    }
}

#[test]
fn a_negative_preconditioner_is_refused() {
    let s = grid(5);
    let stop = settings(rule(1e-6, Criterion::External));
    let mut x = s.x0.clone();
    let error = projected_cg(&s.a, &Negative, &s.w, &s.b, &mut x, &stop, &mut CgWorkspace::new());
    assert!(matches!(error, Err(CgError::PreconditionerNotPositive { iteration: 0, .. })));
}

#[test]
fn nothing_to_solve_is_solved() {
    let empty = System::<2> { a: from_dense(0, |_, _| 0.0), w: Subspace::new(0), b: vec![], x0: vec![] };
    let (_, report) = solve(&empty, &Identity, rule(1e-6, Criterion::External), &mut CgWorkspace::new());
    assert_eq!(report.stop, Stop::Converged);
    let mut held = grid(4);
    for node in 0..16 {
        held.w.set(node, Constraint::Fixed).unwrap();
    }
    let (x, report) = solve(&held, &Identity, rule(1e-6, Criterion::External), &mut CgWorkspace::new());
    assert_eq!((report.stop, report.iterations), (Stop::Converged, 0));
    assert_eq!(x, held.x0);
}

#[test]
fn extreme_scales_change_nothing_but_the_scale() {
    let s = grid(12);
    let (reference, report) = solve(&s, &Identity, rule(1e-8, Criterion::Reaction), &mut CgWorkspace::new());
    for exponent in [-120, 120] {
        let factor = 2f64.powi(exponent);
        let scaled = System { b: s.b.iter().map(|b| b * factor).collect(), ..s.clone() };
        let (x, other) = solve(&scaled, &Identity, rule(1e-8, Criterion::Reaction), &mut CgWorkspace::new());
        assert_eq!(other.iterations, report.iterations);
        let back: Vec<f64> = x.iter().map(|x| x / factor).collect();
        assert!(distance(&back, &reference) <= 1e-12 * norm2(&reference));
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let s = grid(130); // above the size at which a second thread is woken
    let mut bits = Vec::new();
    for threads in [1, 2, 8] {
        let mut ws = CgWorkspace::on(&Team::new(threads));
        let (x, report) = solve(&s, &Identity, rule(1e-6, Criterion::Reaction), &mut ws);
        assert_eq!(report.stop, Stop::Converged);
        bits.push(x.iter().map(|v| v.to_bits()).collect::<Vec<_>>());
    }
    assert!(bits[0] == bits[1] && bits[0] == bits[2]);
}
