//! Projected nonlinear conjugate gradients on energies with known minimisers.

use crate::common::energies::{Chain, Law, Quadratic, Rosenbrock};
use crate::common::{distance, grid, rule};
use stylet_solver::energy::Energy;
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::nonlinear::{
    NonlinearCgSettings, NonlinearCgWorkspace, NonlinearError, NonlinearReport, StepModel, nonlinear_cg,
};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi};
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::vector::norm2;

fn settings(tolerance: f64, step: StepModel) -> NonlinearCgSettings {
    NonlinearCgSettings {
        max_iterations: 5_000,
        step,
        ..NonlinearCgSettings::new(rule(tolerance, Criterion::Reaction))
    }
}

fn held(n: usize) -> Subspace<2> {
    let mut w = Subspace::new(n);
    w.set(0, Constraint::Fixed).unwrap();
    w
}

#[test]
fn on_a_quadratic_it_is_linear_cg() {
    let s = grid(20);
    let stop = rule(1e-6, Criterion::Reaction);
    let m = BlockJacobi::new(&s.a, &s.w).unwrap();
    let mut linear = s.x0.clone();
    let cg = CgSettings { stop, max_iterations: 1_000 };
    let expected = projected_cg(&s.a, &m, &s.w, &s.b, &mut linear, &cg, &mut CgWorkspace::new()).unwrap();

    let mut energy = Quadratic { a: s.a.clone(), b: s.b.clone() };
    let mut x = s.x0.clone();
    let (settings, mut ws) = (settings(1e-6, StepModel::Curvature), NonlinearCgWorkspace::new());
    let report = nonlinear_cg(&mut energy, &m, &s.w, norm2(&s.b), &mut x, &settings, &mut ws).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    assert_eq!(report.iterations, expected.iterations);
    assert_eq!((report.values, report.gradients), (0, report.iterations + 1));
    assert!(distance(&x, &linear) <= 1e-9 * norm2(&linear));
    // The workspace holds the unprojected gradient, reactions included.
    let mut g = vec![0.0; x.len()];
    energy.gradient(&x, &mut g);
    assert!(distance(&g, ws.gradient()) <= 1e-12 * norm2(&g));
}

fn solve(chain: &mut Chain, w: &Subspace<2>, x: &mut [f64], s: &NonlinearCgSettings) -> NonlinearReport {
    let external = chain.load[0].hypot(chain.load[1]);
    chain.linearize(x);
    let m = Jacobi::new(stylet_solver::energy::BlockHessian::matrix(chain), w).unwrap();
    nonlinear_cg(chain, &m, w, external, x, s, &mut NonlinearCgWorkspace::new()).unwrap()
}

#[test]
fn chains_reach_their_analytic_shape() {
    for law in [Law::Cosh, Law::Barrier, Law::Quadratic] {
        for load in [[2.0, 1.0], [-30.0, 0.5], [0.0, 0.0]] {
            for step in [StepModel::Curvature, StepModel::Secant] {
                let mut chain = Chain::new(12, law, 5.0, load);
                let mut x = vec![0.0; 24];
                let report = solve(&mut chain, &held(12), &mut x, &settings(1e-8, step));
                let exact = chain.solution();
                assert_eq!(report.stop, Stop::Converged, "{law:?} {load:?} {step:?} {report:?}");
                assert!(distance(&x, &exact) <= 1e-5 * norm2(&exact), "{law:?} {load:?} {step:?}");
            }
        }
    }
}

#[test]
fn constrained_nodes_keep_to_their_constraints() {
    let mut chain = Chain::new(8, Law::Cosh, 1.0, [3.0, -2.0]);
    let mut w = held(8);
    for node in 1..8 {
        w.set(node, Constraint::Line([1.0, 0.0])).unwrap();
    }
    let mut x = vec![0.0; 16];
    let report = solve(&mut chain, &w, &mut x, &settings(1e-9, StepModel::Curvature));
    assert_eq!(report.stop, Stop::Converged);
    let exact: Vec<f64> = chain.solution().chunks(2).flat_map(|v| [v[0], 0.0]).collect();
    assert!(distance(&x, &exact) < 1e-6);
}

#[test]
fn rosenbrock_valleys_are_followed() {
    for (n, coupling) in [(1, 0.0), (4, 1.0)] {
        for step in [StepModel::Curvature, StepModel::Secant] {
            let mut valley = Rosenbrock::new(n, coupling);
            let mut x: Vec<f64> = (0..n).flat_map(|_| [-1.2, 1.0]).collect();
            let (settings, w) = (settings(1e-8, step), Subspace::<2>::new(n));
            let mut ws = NonlinearCgWorkspace::new();
            let report = nonlinear_cg(&mut valley, &Identity, &w, 1.0, &mut x, &settings, &mut ws).unwrap();
            assert_eq!(report.stop, Stop::Converged, "{n} {step:?} {report:?}");
            assert!(distance(&x, &vec![1.0; 2 * n]) < 1e-5, "{n} {step:?} {report:?}");
        }
    }
}

#[test]
fn outcomes_are_told_apart() {
    let mut chain = Chain::new(12, Law::Cosh, 5.0, [2.0, 1.0]);
    let w = held(12);
    // A start at the solution: one gradient.
    let mut x = chain.solution();
    let report = solve(&mut chain, &w, &mut x, &settings(1e-6, StepModel::Curvature));
    assert_eq!((report.stop, report.gradients, report.products), (Stop::Converged, 1, 0));
    // A budget too small.
    let mut x = vec![0.0; 24];
    let small = NonlinearCgSettings { max_iterations: 3, ..settings(1e-9, StepModel::Curvature) };
    let report = solve(&mut chain, &w, &mut x, &small);
    assert_eq!((report.stop, report.iterations), (Stop::IterationLimit, 3));
    // A tolerance too small.
    let mut x = vec![0.0; 24];
    let report = solve(&mut chain, &w, &mut x, &settings(1e-25, StepModel::Curvature));
    assert_eq!(report.stop, Stop::Stalled, "{report:?}");
    assert!(report.iterations < 500, "{report:?}");
    assert!(distance(&x, &chain.solution()) < 1e-11);
}

#[test]
fn bad_input_is_refused() {
    let mut chain = Chain::new(4, Law::Barrier, 5.0, [1.0, 0.0]);
    let (w, s) = (held(4), settings(1e-6, StepModel::Secant));
    let mut run = |x: &[f64], external: f64| {
        let mut ws = NonlinearCgWorkspace::new();
        nonlinear_cg(&mut chain, &Identity, &w, external, &mut x.to_vec(), &s, &mut ws).unwrap_err()
    };
    assert_eq!(run(&[0.0; 7], 1.0), NonlinearError::Shape { what: "x", dim: 8, len: 7 });
    assert_eq!(run(&[f64::INFINITY; 8], 1.0), NonlinearError::StartNotFinite { index: 0 });
    assert!(matches!(run(&[0.0; 8], -1.0), NonlinearError::StopRule(_)));
    let barrier = [0.0, 0.0, -1.0, 0.0, -1.0, 0.0, -1.0, 0.0];
    assert!(matches!(run(&barrier, 1.0), NonlinearError::GradientNotFinite { index: 0, iteration: 0 }));
}
