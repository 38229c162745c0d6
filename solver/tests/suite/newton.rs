//! Projected Newton-CG on energies with known minimisers.

use crate::common::energies::{Chain, Law, Rosenbrock};
use crate::common::{distance, rule};
use stylet_solver::check::{taylor_gradient, taylor_hessian};
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::nonlinear::line_search::{ApproximateWolfe, Armijo};
use stylet_solver::nonlinear::{
    LineSearch, Linearization, NewtonSettings, NewtonWorkspace, NonlinearError, NonlinearReport, Preconditioning,
    newton_cg,
};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop, StopRule, StopRuleError};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::vector::norm2;

const LAWS: [Law; 3] = [Law::Cosh, Law::Barrier, Law::Quadratic];

fn settings(tolerance: f64) -> NewtonSettings {
    NewtonSettings::new(rule(tolerance, Criterion::Reaction))
}

fn held(n: usize) -> Subspace<2> {
    let mut w = Subspace::new(n);
    w.set(0, Constraint::Fixed).unwrap();
    w
}

fn solve(chain: &mut Chain, w: &Subspace<2>, x: &mut [f64], s: &NewtonSettings) -> NonlinearReport {
    let external = chain.load[0].hypot(chain.load[1]);
    newton_cg(chain, w, external, x, s, &mut NewtonWorkspace::new()).unwrap()
}

#[test]
fn test_energies_have_consistent_derivatives() {
    for law in LAWS {
        let mut chain = Chain::new(6, law, 3.0, [0.7, 0.2]);
        let x: Vec<f64> = (0..12).map(|k| 0.3 * k as f64 + 0.1 * (k as f64).sin()).collect();
        let d: Vec<f64> = (0..12).map(|k| (1.3 * k as f64).cos()).collect();
        assert!(taylor_gradient(&mut chain, &x, &d) > 1.95, "{law:?}");
        assert!(taylor_hessian(&mut chain, &x, &d) > 1.95, "{law:?}");
    }
    let mut valley = Rosenbrock::new(4, 2.0);
    let x: Vec<f64> = (0..8).map(|k| (k as f64).sin()).collect();
    let d: Vec<f64> = (0..8).map(|k| 0.1 * (1.3 * k as f64).cos()).collect();
    assert!(taylor_gradient(&mut valley, &x, &d) > 1.95);
    assert!(taylor_hessian(&mut valley, &x, &d) > 1.95);
}

/// An energy whose gradient, and whose Hessian, are five per cent off.
struct Wrong(Chain);

impl Energy for Wrong {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        self.0.value(x) * 1.05
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.0.gradient(x, g);
    }

    fn linearize(&mut self, x: &[f64]) {
        self.0.linearize(x);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.0.hessian_apply(p, hp);
        hp.iter_mut().for_each(|v| *v *= 1.05);
    }
}

#[test]
fn the_taylor_test_finds_a_wrong_derivative() {
    let mut wrong = Wrong(Chain::new(6, Law::Cosh, 3.0, [0.7, 0.2]));
    let x: Vec<f64> = (0..12).map(|k| (k * k) as f64 * 0.1).collect();
    let d: Vec<f64> = (0..12).map(|k| (1.3 * k as f64).cos()).collect();
    assert!(taylor_gradient(&mut wrong, &x, &d) < 1.5);
    assert!(taylor_hessian(&mut wrong, &x, &d) < 1.5);
}

#[test]
fn chains_reach_their_analytic_shape() {
    for law in LAWS {
        for load in [[2.0, 1.0], [-30.0, 0.5], [0.0, 0.0]] {
            for preconditioning in [Preconditioning::None, Preconditioning::Jacobi, Preconditioning::BlockJacobi] {
                for linearization in [Linearization::Every, Linearization::WhenSlow] {
                    let mut chain = Chain::new(20, law, 5.0, load);
                    let mut x = vec![0.0; 40];
                    let settings = NewtonSettings { preconditioning, linearization, ..settings(1e-10) };
                    let report = solve(&mut chain, &held(20), &mut x, &settings);
                    let exact = chain.solution();
                    assert_eq!(report.stop, Stop::Converged, "{law:?} {load:?} {report:?}");
                    assert!(distance(&x, &exact) <= 1e-7 * norm2(&exact), "{law:?} {load:?} {settings:?}");
                }
            }
        }
    }
}

#[test]
fn a_prescribed_end_spreads_evenly() {
    // No load at all: only reactions to compare with.
    let mut chain = Chain::new(11, Law::Barrier, 2.0, [0.0, 0.0]);
    let mut w = held(11);
    w.set(10, Constraint::Fixed).unwrap();
    let mut x = vec![0.0; 22];
    x[20] = -8.0; // the last spring is beyond its barrier: out of the domain
    let mut ws = NewtonWorkspace::new();
    let error = newton_cg(&mut chain, &w, 0.0, &mut x, &settings(1e-9), &mut ws).unwrap_err();
    assert!(matches!(error, NonlinearError::EnergyNotFinite { iteration: 0, .. }), "{error}");
    // Spread it roughly and it relaxes to equal elongations of -0.8.
    for i in 0..11 {
        x[2 * i] = -8.0 * (i as f64 / 10.0) - if i % 10 == 0 { 0.0 } else { 0.1 * (i as f64).sin() };
    }
    let report = newton_cg(&mut chain, &w, 0.0, &mut x, &settings(1e-9), &mut ws).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    let exact: Vec<f64> = (0..11).flat_map(|i| [-0.8 * i as f64, 0.0]).collect();
    assert!(distance(&x, &exact) < 1e-7);
    // Both ends are held by k φ'(-0.8) = 2 * (-0.8 / 0.2) = -8: the gradient there is the force that holds them.
    assert!((report.reaction_norm - 8.0 * 2f64.sqrt()).abs() < 1e-6);
    assert!((ws.gradient()[20] + 8.0).abs() < 1e-6 && (ws.gradient()[0] - 8.0).abs() < 1e-6);
}

#[test]
fn nodes_on_lines_stay_on_them() {
    let mut chain = Chain::new(8, Law::Cosh, 1.0, [3.0, -2.0]);
    let mut w = held(8);
    for node in 1..8 {
        w.set(node, Constraint::Line([1.0, 0.0])).unwrap();
    }
    let mut x = vec![0.0; 16];
    let report = solve(&mut chain, &w, &mut x, &settings(1e-10));
    assert_eq!(report.stop, Stop::Converged);
    let exact: Vec<f64> = chain.solution().chunks(2).flat_map(|v| [v[0], 0.0]).collect();
    assert!(distance(&x, &exact) < 1e-7);
    assert!(x.iter().skip(1).step_by(2).all(|y| *y == 0.0));
}

#[test]
fn a_warm_start_costs_one_gradient() {
    let mut chain = Chain::new(20, Law::Cosh, 5.0, [2.0, 1.0]);
    let mut x = chain.solution();
    let before = x.clone();
    let report = solve(&mut chain, &held(20), &mut x, &settings(1e-6));
    assert_eq!(report.stop, Stop::Converged);
    assert_eq!((report.iterations, report.gradients, report.values), (0, 1, 0));
    assert_eq!((report.linearizations, report.products), (0, 0));
    assert_eq!(x, before);
}

#[test]
fn full_steps_cost_one_gradient_and_no_energy() {
    let mut chain = Chain::new(20, Law::Cosh, 5.0, [2.0, 1.0]);
    let mut x = vec![0.0; 40];
    let report = solve(&mut chain, &held(20), &mut x, &settings(1e-8));
    assert_eq!(report.gradients, report.iterations + 1, "{report:?}");
    assert_eq!(report.values, 0);
    assert!(report.iterations <= 12, "{report:?}");
}

#[test]
fn a_lazy_hessian_is_made_once_where_little_changes() {
    let mut chain = Chain::new(30, Law::Cosh, 5.0, [0.5, 0.1]);
    let (w, mut ws) = (held(30), NewtonWorkspace::new());
    let lazy = NewtonSettings { linearization: Linearization::WhenSlow, ..settings(1e-8) };
    let mut x = vec![0.0; 60];
    let mut linearizations = 0;
    for step in 0..10 {
        chain.load[0] = 0.5 + 0.01 * step as f64;
        let report = newton_cg(&mut chain, &w, 0.5, &mut x, &lazy, &mut ws).unwrap();
        assert_eq!(report.stop, Stop::Converged);
        linearizations += report.linearizations;
    }
    assert_eq!(linearizations, 1);
    assert!(distance(&x, &chain.solution()) < 1e-5);
    // Told that the energy is another one, it starts afresh.
    ws.invalidate();
    chain.load[0] = 0.0;
    let report = newton_cg(&mut chain, &w, 0.5, &mut x, &lazy, &mut ws).unwrap();
    assert!(report.linearizations >= 1);
}

#[test]
fn rosenbrock_valleys_are_followed_through_negative_curvature() {
    for (n, coupling) in [(1, 0.0), (5, 0.0), (8, 1.0)] {
        let mut valley = Rosenbrock::new(n, coupling);
        let mut x: Vec<f64> = (0..n).flat_map(|i| [-1.2 + 0.1 * i as f64, 1.0]).collect();
        let w = Subspace::new(n);
        let stop = rule(1e-9, Criterion::External);
        for preconditioning in [Preconditioning::None, Preconditioning::BlockJacobi] {
            let settings = NewtonSettings { preconditioning, ..NewtonSettings::new(stop) };
            let mut y = x.clone();
            let report = newton_cg(&mut valley, &w, 1.0, &mut y, &settings, &mut NewtonWorkspace::new()).unwrap();
            assert_eq!(report.stop, Stop::Converged, "{n} {coupling} {report:?}");
            assert!(distance(&y, &vec![1.0; 2 * n]) < 1e-7, "{n} {coupling} {report:?}");
        }
        // Out of a point where the Hessian is indefinite: x = 0, y = 1.
        x.iter_mut().enumerate().for_each(|(k, v)| *v = if k % 2 == 0 { 0.0 } else { 1.0 });
        let report =
            newton_cg(&mut valley, &w, 1.0, &mut x, &NewtonSettings::new(stop), &mut NewtonWorkspace::new()).unwrap();
        assert_eq!(report.stop, Stop::Converged);
        assert!(valley.value(&x) < 1e-12);
    }
}

#[test]
fn an_impossible_tolerance_stalls_and_says_so() {
    let mut chain = Chain::new(20, Law::Cosh, 5.0, [2.0, 1.0]);
    let mut x = vec![0.0; 40];
    let report = solve(&mut chain, &held(20), &mut x, &settings(1e-25));
    assert_eq!(report.stop, Stop::Stalled, "{report:?}");
    assert!(report.iterations < 50);
    assert!(distance(&x, &chain.solution()) < 1e-12);
}

/// A chain whose energy comes with errors.
struct Coarse {
    chain: Chain,
    says_so: bool,
}

const NOISE: f64 = 1e-10;

impl Energy for Coarse {
    fn dim(&self) -> usize {
        self.chain.dim()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        self.chain.value(x) + 0.5 * NOISE * (1e12 * x.iter().sum::<f64>()).sin()
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.chain.gradient(x, g);
    }

    fn linearize(&mut self, x: &[f64]) {
        self.chain.linearize(x);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.chain.hessian_apply(p, hp);
    }

    fn value_round_off(&self) -> f64 {
        if self.says_so { NOISE } else { 0.0 }
    }
}

impl BlockHessian<2> for Coarse {
    fn matrix(&self) -> &BlockCsr<2> {
        self.chain.matrix()
    }
}

/// Where energies are noise a search goes by the gradient, if it is told how much of them is.
#[test]
fn energies_of_known_rounding_errors_do_not_stop_a_search() {
    let searches = [
        LineSearch::Armijo(Armijo::default()),
        LineSearch::ApproximateWolfe(ApproximateWolfe::default()),
        LineSearch::GradientFirst,
    ];
    for search in searches {
        for load in [[1e-4, 2e-5], [1e-5, 1e-5], [1e-7, 1e-6]] {
            let mut coarse = Coarse { chain: Chain::new(20, Law::Cosh, 5.0, load), says_so: true };
            let (w, mut x, s) = (held(20), vec![0.0; 40], NewtonSettings { search, ..settings(1e-12) });
            let external = load[0].hypot(load[1]);
            let report = newton_cg(&mut coarse, &w, external, &mut x, &s, &mut NewtonWorkspace::new()).unwrap();
            assert_eq!(report.stop, Stop::Converged, "{search:?}, load {load:?}: {report:?}");
            let solution = coarse.chain.solution();
            assert!(distance(&x, &solution) < 1e-10 * norm2(&solution), "{search:?}, load {load:?}");
        }
    }
    // Told nothing, a search takes the noise for an energy.
    let run = |says_so: bool| {
        let mut coarse = Coarse { chain: Chain::new(20, Law::Cosh, 5.0, [1e-7, 1e-6]), says_so };
        let s = NewtonSettings { search: searches[0], max_iterations: 4, ..settings(1e-12) };
        newton_cg(&mut coarse, &held(20), 1e-6, &mut [0.0; 40], &s, &mut NewtonWorkspace::new()).unwrap().stop
    };
    assert_eq!(run(true), Stop::Converged);
    assert_ne!(run(false), Stop::Converged);
}

#[test]
fn the_budget_keeps_the_iterate() {
    let mut chain = Chain::new(20, Law::Cosh, 1.0, [50.0, 0.0]);
    let mut x = vec![0.0; 40];
    for max_iterations in [0, 1, 2] {
        let before = chain.value(&x);
        let report = solve(&mut chain, &held(20), &mut x, &NewtonSettings { max_iterations, ..settings(1e-9) });
        assert_eq!((report.stop, report.iterations), (Stop::IterationLimit, max_iterations));
        assert!(chain.value(&x) < before || max_iterations == 0);
    }
}

#[test]
fn bad_input_is_refused() {
    let mut chain = Chain::new(4, Law::Barrier, 5.0, [1.0, 0.0]);
    let w = held(4);
    let mut run = |x: &[f64], w: &Subspace<2>, external: f64, s: NewtonSettings| {
        newton_cg(&mut chain, w, external, &mut x.to_vec(), &s, &mut NewtonWorkspace::new()).unwrap_err()
    };
    let (x, good) = ([0.0; 8], settings(1e-6));
    assert_eq!(run(&x[1..], &w, 1.0, good), NonlinearError::Shape { what: "x", dim: 8, len: 7 });
    assert_eq!(run(&x, &held(5), 1.0, good), NonlinearError::Shape { what: "the subspace", dim: 8, len: 10 });
    assert!(matches!(run(&x, &w, f64::NAN, good), NonlinearError::StopRule(StopRuleError::ExternalNorm(_))));
    assert!(matches!(
        run(&x, &w, 1.0, NewtonSettings { stop: StopRule { tolerance: 0.0, ..good.stop }, ..good }),
        NonlinearError::StopRule(StopRuleError::Tolerance(_))
    ));
    assert!(matches!(
        run(&x, &w, 1.0, NewtonSettings { forcing: 1.5, ..good }),
        NonlinearError::Setting { name: "forcing", .. }
    ));
    let mut nan = x;
    nan[5] = f64::NAN;
    assert_eq!(run(&nan, &w, 1.0, good), NonlinearError::StartNotFinite { index: 5 });
    // Spring 1 at its barrier: infinite force.
    let singular = [0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0];
    assert_eq!(run(&singular, &w, 1.0, good), NonlinearError::GradientNotFinite { index: 2, iteration: 0 });
}
