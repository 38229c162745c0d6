//! MINRES against dense factorisations and projected conjugate gradients, and its behaviour on singular systems.

use crate::common::{System, dense_solution, distance, from_dense, grid, krylov, projector, residual, rule, system};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use proptest::prelude::*;
use stylet_solver::LinearOperator;
use stylet_solver::linear::{
    CgSettings, CgWorkspace, KrylovReport, KrylovSettings, MinresError, MinresWorkspace, VectorError, minres,
    projected_cg,
};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::stop::{Criterion, Stop, StopRuleError};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;
use stylet_solver::vector::{dot, norm2};

fn solve<const B: usize>(
    s: &System<B>,
    m: &impl Preconditioner,
    settings: &KrylovSettings,
) -> (Vec<f64>, KrylovReport) {
    let mut x = s.x0.clone();
    let report = minres(&s.a, m, &s.w, &s.b, &mut x, settings, &mut MinresWorkspace::new()).unwrap();
    (x, report)
}

fn check_definite<const B: usize>(s: &System<B>) {
    let exact = dense_solution(s);
    let settings = krylov(1e-11, Criterion::Reaction);
    for m in
        [&Identity as &dyn Preconditioner, &Jacobi::new(&s.a, &s.w).unwrap(), &BlockJacobi::new(&s.a, &s.w).unwrap()]
    {
        let mut x = s.x0.clone();
        let mut ws = MinresWorkspace::new();
        let report = minres(&s.a, m, &s.w, &s.b, &mut x, &settings, &mut ws).unwrap();
        assert_eq!(report.stop, Stop::Converged, "{report:?}");
        assert!(distance(&x, &exact) <= 1e-8 * norm2(&exact).max(1.0), "{report:?}");
        // What is reported is the residual of what is returned.
        let mut r = residual(&s.a, &s.b, &x);
        let mut outside = vec![0.0; B * s.w.n_constrained()];
        s.w.split(&mut r, &mut outside);
        assert!((norm2(&r) - report.residual_norm).abs() <= 1e-14 * (1.0 + norm2(&s.b)));
        assert!((norm2(&outside) - report.reaction_norm).abs() <= 1e-12 * (1.0 + norm2(&outside)));
        // From the solution there is nothing to do.
        let looser = krylov(1e-9, Criterion::Reaction);
        let again = minres(&s.a, m, &s.w, &s.b, &mut x.clone(), &looser, &mut ws).unwrap();
        assert_eq!((again.stop, again.iterations, again.products), (Stop::Converged, 0, 1));
    }
}

/// `A − shift I` on the subspace by LU, if it is far from singular there.
fn indefinite_solution(s: &System<2>) -> Option<Vec<f64>> {
    let n = s.b.len();
    let p = projector(&s.w);
    let dense = s.a.to_dense();
    let a = Mat::from_fn(n, n, |i, j| dense[i * n + j]);
    let projected = &p * &a * &p + Mat::<f64>::identity(n, n) - &p;
    let eigen = projected.self_adjoint_eigenvalues(Side::Lower).unwrap();
    if eigen.iter().any(|e| e.abs() < 1e-2) || eigen.iter().all(|e| *e > 0.0) {
        return None;
    }
    let (b, x0) = (Mat::from_fn(n, 1, |i, _| s.b[i]), Mat::from_fn(n, 1, |i, _| s.x0[i]));
    let v = projected.partial_piv_lu().solve(&p * (b - &a * &x0));
    Some((0..n).map(|i| s.x0[i] + v[(i, 0)]).collect())
}

proptest! {
    #[test]
    fn agrees_with_a_dense_factorisation_2d(s in system::<2>()) { check_definite(&s); }

    #[test]
    fn agrees_with_a_dense_factorisation_3d(s in system::<3>()) { check_definite(&s); }

    #[test]
    fn solves_indefinite_systems(s in system::<2>(), shift in 0.6..4.0f64) {
        let m = BlockJacobi::new(&s.a, &s.w).unwrap();
        let mut s = s;
        for i in 0..s.a.n_rows() {
            s.a.add_to_block(i, i, &[[-shift, 0.0], [0.0, -shift]]).unwrap();
        }
        let exact = indefinite_solution(&s);
        prop_assume!(exact.is_some());
        let exact = exact.unwrap();
        let settings = krylov(1e-11, Criterion::Reaction);
        for (x, report) in [solve(&s, &Identity, &settings), solve(&s, &m, &settings)] {
            prop_assert_eq!(report.stop, Stop::Converged);
            prop_assert!(distance(&x, &exact) <= 1e-7 * norm2(&exact).max(1.0), "{:?}", report);
        }
    }

    /// Without a preconditioner no step makes the residual longer, definite or not.
    #[test]
    fn residuals_never_grow(s in system::<2>(), shift in 0.0..4.0f64) {
        let mut s = s;
        for i in 0..s.a.n_rows() {
            s.a.add_to_block(i, i, &[[-shift, 0.0], [0.0, -shift]]).unwrap();
        }
        let mut before = f64::INFINITY;
        for max_iterations in 0..12 {
            let settings = KrylovSettings { max_iterations, ..krylov(1e-10, Criterion::External) };
            let (_, report) = solve(&s, &Identity, &settings);
            prop_assert!(report.residual_norm <= before * (1.0 + 1e-9) + 1e-12);
            before = report.residual_norm;
        }
    }
}

#[test]
fn needs_about_the_iterations_of_conjugate_gradients() {
    let s = grid(40);
    let m = BlockJacobi::new(&s.a, &s.w).unwrap();
    let (x, report) = solve(&s, &m, &krylov(1e-8, Criterion::Reaction));
    let mut y = s.x0.clone();
    let settings = CgSettings { stop: rule(1e-8, Criterion::Reaction), max_iterations: 5000 };
    let cg = projected_cg(&s.a, &m, &s.w, &s.b, &mut y, &settings, &mut CgWorkspace::new()).unwrap();
    assert!(report.iterations <= cg.iterations + 2 && report.iterations + 10 >= cg.iterations, "{report:?} {cg:?}");
    assert!(distance(&x, &y) <= 1e-6 * norm2(&y));
}

/// A chain of springs that nothing holds.
fn floating(n: usize) -> System<2> {
    let a = from_dense::<2>(n, |i, j| match (i % 2 == j % 2, i.abs_diff(j)) {
        (true, 0) => (1 + usize::from(i / 2 > 0 && i / 2 + 1 < n)) as f64,
        (true, 2) => -1.0,
        _ => 0.0,
    });
    let b = (0..2 * n).map(|k| (k as f64 * 0.7).sin()).collect();
    System { a, w: Subspace::new(n), b, x0: vec![0.0; 2 * n] }
}

#[test]
fn singular_systems_end_with_a_solution_or_the_least_residual() {
    let mut s = floating(60);
    let mean: [f64; 2] = std::array::from_fn(|k| s.b.iter().skip(k).step_by(2).sum::<f64>() / 60.0);
    let m = Jacobi::new(&s.a, &s.w).unwrap();
    // Inconsistent: the residual is what no spring can carry.
    let least = (60.0f64).sqrt() * mean[0].hypot(mean[1]);
    let (x, report) = solve(&s, &Identity, &krylov(1e-9, Criterion::External));
    assert_eq!(report.stop, Stop::Stalled);
    assert!((report.residual_norm - least).abs() <= 1e-9 * least, "{report:?}");
    let r = residual(&s.a, &s.b, &x);
    let mut ar = vec![0.0; r.len()];
    s.a.apply(&r, &mut ar);
    assert!(norm2(&ar) <= 1e-9 * norm2(&s.b));
    // With a preconditioner it is the least in the norm of that.
    let (x, report) = solve(&s, &m, &krylov(1e-9, Criterion::External));
    assert_eq!(report.stop, Stop::Stalled);
    let (r, mut z) = (residual(&s.a, &s.b, &x), vec![0.0; 120]);
    m.apply(&r, &mut z);
    s.a.apply(&z, &mut ar);
    assert!(norm2(&ar) <= 1e-7 * norm2(&s.b), "{:e} {report:?}", norm2(&ar));
    // Consistent.
    for (k, b) in s.b.iter_mut().enumerate() {
        *b -= mean[k % 2];
    }
    for report in [
        solve(&s, &Identity, &krylov(1e-9, Criterion::External)).1,
        solve(&s, &m, &krylov(1e-9, Criterion::External)).1,
    ] {
        assert_eq!(report.stop, Stop::Converged, "{report:?}");
    }
}

#[test]
fn a_matrix_of_zeros_is_stalled_at_once() {
    let s = System { a: from_dense::<2>(3, |_, _| 0.0), w: Subspace::new(3), b: vec![1.0; 6], x0: vec![2.0; 6] };
    let (x, report) = solve(&s, &Identity, &krylov(1e-9, Criterion::External));
    assert_eq!((report.stop, x), (Stop::Stalled, s.x0));
}

#[test]
fn a_tolerance_below_rounding_stalls_with_the_best_iterate() {
    let s = grid(40);
    let (x, report) = solve(&s, &Identity, &krylov(1e-19, Criterion::Reaction));
    assert_eq!(report.stop, Stop::Stalled);
    let mut r = residual(&s.a, &s.b, &x);
    s.w.project(&mut r);
    assert!(norm2(&r) <= 1e-13 * norm2(&s.b), "{report:?}");
}

#[test]
fn an_unsymmetric_operator_is_refused() {
    let s = grid(6);
    let mut a = s.a.clone();
    for i in (0..35).filter(|i| i % 6 < 5) {
        a.add_to_block(i, i + 1, &[[0.5, 0.0], [0.0, 0.5]]).unwrap();
    }
    let run = |a: &dyn LinearOperator| {
        let settings = krylov(1e-9, Criterion::External);
        minres(a, &Identity, &s.w, &s.b, &mut s.x0.clone(), &settings, &mut MinresWorkspace::new())
    };
    assert!(matches!(run(&a), Err(MinresError::NotSymmetric { .. })));
    assert!(run(&s.a).is_ok());
}

struct Negative;

impl Preconditioner for Negative {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        z.iter_mut().zip(r).for_each(|(z, r)| *z = -r);
    }
}

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
fn bad_input_is_refused_with_its_place() {
    let s = grid(5);
    let n = s.b.len();
    let mut ws = MinresWorkspace::new();
    let good = krylov(1e-6, Criterion::External);
    let mut run = |b: &[f64], x: &[f64], w: &Subspace<2>, settings: &KrylovSettings| {
        minres(&s.a, &Identity, w, b, &mut x.to_vec(), settings, &mut ws)
    };
    let length = |what, len| Err(MinresError::Vector(VectorError::Length { what, expected: n, len }));
    assert_eq!(run(&s.b[1..], &s.x0, &s.w, &good), length("b", n - 1));
    assert_eq!(run(&s.b, &s.x0[2..], &s.w, &good), length("x", n - 2));
    assert_eq!(run(&s.b, &s.x0, &Subspace::new(24), &good), length("the subspace", 48));
    let not_finite = |what, index| Err(MinresError::Vector(VectorError::NotFinite { what, index, iteration: 0 }));
    let mut bad = s.b.clone();
    bad[7] = f64::NAN;
    assert_eq!(run(&bad, &s.x0, &s.w, &good), not_finite("b", 7));
    bad[7] = 1e200;
    assert_eq!(run(&bad, &s.x0, &s.w, &good), Err(VectorError::Overflow { what: "b", iteration: 0 }.into()));
    let mut bad = s.x0.clone();
    bad[9] = f64::INFINITY;
    assert_eq!(run(&s.b, &bad, &s.w, &good), not_finite("x", 9));
    let error = run(&s.b, &s.x0, &s.w, &krylov(0.0, Criterion::External)).unwrap_err();
    assert!(matches!(error, MinresError::StopRule(StopRuleError::Tolerance(_))));
    let error = minres(&s.a, &Negative, &s.w, &s.b, &mut s.x0.clone(), &good, &mut ws);
    assert!(matches!(error, Err(MinresError::PreconditionerNotPositive { iteration: 0, .. })));
    let error = minres(&Broken(6), &Identity, &Subspace::<2>::new(3), &[1.0; 6], &mut [0.0; 6], &good, &mut ws);
    assert_eq!(error, Err(VectorError::NotFinite { what: "A v", index: 3, iteration: 1 }.into()));
}

#[test]
fn nothing_to_solve_is_solved() {
    let empty = System::<2> { a: from_dense(0, |_, _| 0.0), w: Subspace::new(0), b: vec![], x0: vec![] };
    assert_eq!(solve(&empty, &Identity, &krylov(1e-6, Criterion::External)).1.stop, Stop::Converged);
    let mut held = grid(4);
    (0..16).for_each(|node| held.w.set(node, Constraint::Fixed).unwrap());
    let (x, report) = solve(&held, &Identity, &krylov(1e-6, Criterion::External));
    assert_eq!((report.stop, report.iterations), (Stop::Converged, 0));
    assert_eq!(x, held.x0);
    let mut still = grid(4);
    still.b.fill(0.0);
    let (x, report) = solve(&still, &Identity, &krylov(1e-6, Criterion::External));
    assert_eq!((report.stop, report.iterations, dot(&x, &x)), (Stop::Converged, 0, 0.0));
}

#[test]
fn threads_do_not_change_a_bit() {
    let s = grid(130);
    let m = BlockJacobi::new(&s.a, &s.w).unwrap();
    let mut bits = Vec::new();
    for threads in [1, 2, 8] {
        let mut x = s.x0.clone();
        let mut ws = MinresWorkspace::on(Team::new(threads));
        let report = minres(&s.a, &m, &s.w, &s.b, &mut x, &krylov(1e-6, Criterion::Reaction), &mut ws).unwrap();
        assert_eq!(report.stop, Stop::Converged);
        bits.push(x.iter().map(|v| v.to_bits()).collect::<Vec<_>>());
    }
    assert!(bits[0] == bits[1] && bits[0] == bits[2]);
}
