//! Where the nonlinear methods cannot converge, or should not have been called: what they say.

use crate::common::energies::{Chain, Law, Rosenbrock};
use crate::common::rule;
use crate::nonlinear_methods::{every_cg, every_lbfgs, searches};
use proptest::prelude::*;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::nonlinear::line_search::{ApproximateWolfe, Armijo, StrongWolfe};
use stylet_solver::nonlinear::{
    Direction, Kept, LbfgsSettings, LbfgsWorkspace, LineSearch, NewtonSettings, NewtonWorkspace, NonlinearCgSettings,
    NonlinearCgWorkspace, NonlinearError, NonlinearReport, lbfgs, newton_cg, newton_cg_with, nonlinear_cg,
};
use stylet_solver::precondition::{Identity, Preconditioner};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// A method with its settings.
#[derive(Clone, Debug)]
enum Method {
    Cg(NonlinearCgSettings),
    Lbfgs(LbfgsSettings),
    Newton(NewtonSettings),
}

fn every_method(stop: StopRule) -> Vec<Method> {
    let newton = searches().map(|search| Method::Newton(NewtonSettings { search, ..NewtonSettings::new(stop) }));
    let cg = every_cg(stop).into_iter().map(Method::Cg);
    cg.chain(every_lbfgs(stop).into_iter().map(Method::Lbfgs)).chain(newton).collect()
}

impl Method {
    fn run<E: BlockHessian<2>>(
        &self,
        energy: &mut E,
        w: &Subspace<2>,
        external: f64,
        x: &mut [f64],
    ) -> Result<NonlinearReport, NonlinearError> {
        match self {
            Self::Cg(s) => nonlinear_cg(energy, &Identity, w, external, x, s, &mut NonlinearCgWorkspace::new()),
            Self::Lbfgs(s) => lbfgs(energy, &Identity, w, external, x, s, &mut LbfgsWorkspace::new()),
            Self::Newton(s) => newton_cg(energy, w, external, x, s, &mut NewtonWorkspace::new()),
        }
    }

    fn with_budget(&self, max_iterations: usize) -> Self {
        match *self {
            Self::Cg(s) => Self::Cg(NonlinearCgSettings { max_iterations, ..s }),
            Self::Lbfgs(s) => Self::Lbfgs(LbfgsSettings { max_iterations, ..s }),
            Self::Newton(s) => Self::Newton(NewtonSettings { max_iterations, ..s }),
        }
    }

    fn search(&self) -> &LineSearch {
        match self {
            Self::Cg(s) => &s.search,
            Self::Lbfgs(s) => &s.search,
            Self::Newton(s) => &s.search,
        }
    }
}

fn held(n: usize) -> Subspace<2> {
    let mut w = Subspace::new(n);
    w.set(0, Constraint::Fixed).unwrap();
    w
}

#[test]
fn a_start_outside_the_domain_is_an_error() {
    let start = [0.0, 0.0, 0.1, 0.0, -2.0, 0.0, -2.0, 0.0]; // the second spring is beyond its barrier
    for method in every_method(rule(1e-6, Criterion::Reaction)) {
        let mut x = start;
        let mut chain = Chain::new(4, Law::Barrier, 5.0, [1.0, 0.0]);
        let error = method.run(&mut chain, &held(4), 1.0, &mut x).unwrap_err();
        assert!(matches!(error, NonlinearError::EnergyNotFinite { iteration: 0, .. }), "{method:?} {error}");
        assert_eq!(x, start);
    }
}

#[test]
fn a_budget_of_none_only_looks() {
    for method in every_method(rule(1e-6, Criterion::Reaction)) {
        let mut chain = Chain::new(4, Law::Cosh, 5.0, [1.0, 0.0]);
        let mut x = [0.0; 8];
        let report = method.with_budget(0).run(&mut chain, &held(4), 1.0, &mut x).unwrap();
        assert_eq!((report.stop, report.iterations, report.gradients), (Stop::IterationLimit, 0, 1));
        assert_eq!((report.values, report.products, report.linearizations), (0, 0, 0));
        assert_eq!((report.residual_norm, x), (1.0, [0.0; 8]));
    }
}

#[test]
fn where_nothing_pulls_nothing_moves() {
    for method in every_method(rule(1e-6, Criterion::Reaction)) {
        // No force at all, on a residual rule without a floor: zero is small enough.
        let mut chain = Chain::new(4, Law::Cosh, 5.0, [0.0, 0.0]);
        let mut x = [0.0; 8];
        let report = method.run(&mut chain, &held(4), 0.0, &mut x).unwrap();
        assert_eq!((report.stop, report.iterations, report.residual_norm), (Stop::Converged, 0, 0.0));
        // Nothing is free to move.
        let mut chain = Chain::new(4, Law::Cosh, 5.0, [3.0, 0.0]);
        let mut w = held(4);
        (1..4).for_each(|node| w.set(node, Constraint::Fixed).unwrap());
        let report = method.run(&mut chain, &w, 3.0, &mut x).unwrap();
        assert_eq!((report.stop, report.reaction_norm), (Stop::Converged, 3.0));
    }
}

#[test]
fn a_tolerance_too_small_stalls() {
    for method in every_method(rule(1e-25, Criterion::Reaction)) {
        let mut chain = Chain::new(6, Law::Cosh, 5.0, [2.0, 1.0]);
        let mut x = [0.0; 12];
        let report = method.with_budget(500).run(&mut chain, &held(6), 2.0, &mut x).unwrap();
        // Conjugate gradients that trust slopes may go round in the noise until the budget ends.
        let by_slopes = *method.search() == LineSearch::GradientFirst && report.stop == Stop::IterationLimit;
        assert!(report.stop == Stop::Stalled || by_slopes || report.residual_norm == 0.0, "{method:?} {report:?}");
        let error = x.iter().zip(chain.solution()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-5, "{method:?} {report:?} {error}");
    }
}

/// `Σ ¼ x⁴ − ½ x² + ½ y²`: a saddle at 0 and minima at `x = ±1`.
struct Saddle(BlockCsr<2>);

impl Energy for Saddle {
    fn dim(&self) -> usize {
        2 * self.0.n_rows()
    }

    fn value(&mut self, v: &[f64]) -> f64 {
        v.chunks(2).map(|v| 0.25 * v[0].powi(4) - 0.5 * v[0] * v[0] + 0.5 * v[1] * v[1]).sum()
    }

    fn gradient(&mut self, v: &[f64], g: &mut [f64]) {
        for (g, v) in g.chunks_mut(2).zip(v.chunks(2)) {
            g[0] = v[0].powi(3) - v[0];
            g[1] = v[1];
        }
    }

    fn linearize(&mut self, v: &[f64]) {
        for (i, v) in v.chunks(2).enumerate() {
            self.0.set_row(i, &[i as u32], &[[[3.0 * v[0] * v[0] - 1.0, 0.0], [0.0, 1.0]]]).unwrap();
        }
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        stylet_solver::LinearOperator::apply(&self.0, p, hp);
    }
}

impl BlockHessian<2> for Saddle {
    fn matrix(&self) -> &BlockCsr<2> {
        &self.0
    }
}

#[test]
fn saddles_are_left_unless_one_stands_on_them() {
    let stop = StopRule { round_floor: 1e-8, ..rule(1e-8, Criterion::External) };
    let w = Subspace::new(3);
    for method in every_method(stop) {
        let mut energy = Saddle(BlockCsr::new(3));
        // The gradient is zero: no method of descent can tell it from a minimum.
        let mut x = [0.0; 6];
        let report = method.run(&mut energy, &w, 0.0, &mut x).unwrap();
        assert_eq!((report.stop, report.iterations, x), (Stop::Converged, 0, [0.0; 6]));
        let mut x = [1e-3, 1.0, -2e-3, 0.5, 3e-3, -1.0];
        let report = method.run(&mut energy, &w, 0.0, &mut x).unwrap();
        assert_eq!(report.stop, Stop::Converged, "{method:?} {report:?}");
        assert!((energy.value(&x) + 0.75).abs() < 1e-12, "{method:?} {x:?}");
    }
}

/// A chain whose energies are NaN.
struct Nameless(Chain);

impl Energy for Nameless {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn value(&mut self, _: &[f64]) -> f64 {
        f64::NAN
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.0.gradient(x, g);
    }

    fn linearize(&mut self, x: &[f64]) {
        self.0.linearize(x);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.0.hessian_apply(p, hp);
    }
}

impl BlockHessian<2> for Nameless {
    fn matrix(&self) -> &BlockCsr<2> {
        self.0.matrix()
    }
}

#[test]
fn energies_that_are_nan_are_an_error_where_they_are_needed() {
    for method in every_method(rule(1e-6, Criterion::Reaction)) {
        let mut energy = Nameless(Chain::new(4, Law::Quadratic, 5.0, [1.0, 0.0]));
        let mut x = [0.0; 8];
        match method.run(&mut energy, &held(4), 1.0, &mut x) {
            Ok(report) => assert!(*method.search() == LineSearch::GradientFirst && report.values == 0, "{method:?}"),
            Err(NonlinearError::EnergyNotFinite { value, .. }) => assert!(value.is_nan()),
            Err(other) => panic!("{method:?} {other}"),
        }
    }
}

struct Times(f64);

impl Preconditioner for Times {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        z.iter_mut().zip(r).for_each(|(z, r)| *z = self.0 * r);
    }
}

#[test]
fn a_preconditioner_that_is_not_positive_is_an_error() {
    let stop = rule(1e-6, Criterion::Reaction);
    for factor in [-1.0, f64::NAN, f64::INFINITY] {
        let (m, w) = (Times(factor), held(4));
        let mut chain = Chain::new(4, Law::Cosh, 5.0, [1.0, 0.0]);
        let mut x = [0.0; 8];
        let cg = NonlinearCgSettings::new(stop);
        let errors = [
            nonlinear_cg(&mut chain, &m, &w, 1.0, &mut x, &cg, &mut NonlinearCgWorkspace::new()),
            lbfgs(&mut chain, &m, &w, 1.0, &mut x, &LbfgsSettings::new(stop), &mut LbfgsWorkspace::new()),
            newton_cg_with(
                &mut chain,
                &mut Kept(&m),
                &w,
                1.0,
                &mut x,
                &NewtonSettings::new(stop),
                &mut NewtonWorkspace::new(),
            ),
        ];
        for error in errors {
            let error = error.unwrap_err();
            assert!(
                matches!(error, NonlinearError::PreconditionerNotPositive { value, iteration: 0 } if !(value > 0.0 && value.is_finite())),
                "{error}"
            );
        }
        assert_eq!(x, [0.0; 8]);
    }
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let stop = rule(1e-6, Criterion::Reaction);
    let (w, mut chain) = (held(4), Chain::new(4, Law::Cosh, 5.0, [1.0, 0.0]));
    let hz = ApproximateWolfe::default();
    let bad = [
        (LineSearch::Armijo(Armijo { decrease: 0.5 }), "decrease"),
        (LineSearch::Armijo(Armijo { decrease: f64::NAN }), "decrease"),
        (LineSearch::StrongWolfe(StrongWolfe { decrease: 0.1, curvature: 0.1 }), "curvature"),
        (LineSearch::StrongWolfe(StrongWolfe { decrease: 0.1, curvature: 1.0 }), "curvature"),
        (LineSearch::ApproximateWolfe(ApproximateWolfe { delta: 0.0, ..hz }), "delta"),
        (LineSearch::ApproximateWolfe(ApproximateWolfe { sigma: 0.05, ..hz }), "sigma"),
        (LineSearch::ApproximateWolfe(ApproximateWolfe { epsilon: -1.0, ..hz }), "epsilon"),
        (LineSearch::ApproximateWolfe(ApproximateWolfe { theta: 1.0, ..hz }), "theta"),
        (LineSearch::ApproximateWolfe(ApproximateWolfe { gamma: 1.0, ..hz }), "gamma"),
        (LineSearch::ApproximateWolfe(ApproximateWolfe { rho: 1.0, ..hz }), "rho"),
    ];
    for (search, expected) in bad {
        for method in [
            Method::Cg(NonlinearCgSettings { search, ..NonlinearCgSettings::new(stop) }),
            Method::Lbfgs(LbfgsSettings { search, ..LbfgsSettings::new(stop) }),
            Method::Newton(NewtonSettings { search, ..NewtonSettings::new(stop) }),
        ] {
            let error = method.run(&mut chain, &w, 1.0, &mut [0.0; 8]).unwrap_err();
            assert!(matches!(error, NonlinearError::Setting { name, .. } if name == expected), "{error}");
        }
    }
    let eta = Direction::HagerZhang { eta: 0.0 };
    let method = Method::Cg(NonlinearCgSettings { direction: eta, ..NonlinearCgSettings::new(stop) });
    let error = method.run(&mut chain, &w, 1.0, &mut [0.0; 8]).unwrap_err();
    assert!(matches!(error, NonlinearError::Setting { name: "eta", .. }));
    let method = Method::Lbfgs(LbfgsSettings { memory: 0, ..LbfgsSettings::new(stop) });
    let error = method.run(&mut chain, &w, 1.0, &mut [0.0; 8]).unwrap_err();
    assert_eq!(error.to_string(), "memory is 0: at least 1");
}

/// Runs a method with budgets of 0, 1, 2, ... steps: the energy never rises, no step leaves `W` or the domain.
fn descends<E: BlockHessian<2>>(
    make: impl Fn() -> E,
    w: &Subspace<2>,
    start: &[f64],
    method: &Method,
) -> Result<(), TestCaseError> {
    let mut last = make().value(start);
    for budget in 1..12 {
        let (mut energy, mut x) = (make(), start.to_vec());
        let report = method.with_budget(budget).run(&mut energy, w, 1.0, &mut x);
        let report = report.map_err(|e| TestCaseError::fail(format!("{method:?} {e}")))?;
        let value = energy.value(&x);
        // ε of CG_DESCENT is what its approximate conditions take for rounding errors.
        let epsilon = if matches!(method.search(), LineSearch::ApproximateWolfe(_)) { 1e-6 } else { 1e-10 };
        // A step that is accepted by its gradient alone lowers the residual instead.
        let blind = *method.search() == LineSearch::GradientFirst;
        prop_assert!(value.is_finite());
        prop_assert!(blind || value <= last + epsilon * last.abs(), "{:?} {} {}", method, value, last);
        let moved: Vec<f64> = x.iter().zip(start).map(|(a, b)| a - b).collect();
        let mut allowed = moved.clone();
        w.project(&mut allowed);
        for (m, a) in moved.iter().zip(&allowed) {
            prop_assert!((m - a).abs() <= 1e-12 * (1.0 + m.abs()), "{:?} left W", method);
        }
        last = value;
        if report.stop != Stop::IterationLimit {
            break;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn steps_descend_within_the_subspace_and_the_domain(
        start in proptest::collection::vec(-0.2..0.2f64, 16),
        load in [-40.0..4.0f64, -5.0..5.0f64],
        angle in 0.0..std::f64::consts::TAU, law in prop_oneof![Just(Law::Cosh), Just(Law::Barrier)],
        node in 1usize..7,
    ) {
        let mut w = held(8);
        w.set(node, Constraint::Line([angle.cos(), angle.sin()])).unwrap();
        w.set(7, Constraint::Plane([angle.sin(), angle.cos()])).unwrap();
        for method in every_method(rule(1e-9, Criterion::Reaction)) {
            descends(|| Chain::new(8, law, 5.0, load), &w, &start, &method)?;
        }
    }

    #[test]
    fn steps_descend_where_the_energy_is_not_convex(start in proptest::collection::vec(-2.0..2.0f64, 8)) {
        let mut w = Subspace::new(4);
        w.set(2, Constraint::Line([0.6, 0.8])).unwrap();
        for method in every_method(rule(1e-9, Criterion::Reaction)) {
            descends(|| Rosenbrock::new(4, 1.0), &w, &start, &method)?;
        }
    }
}
