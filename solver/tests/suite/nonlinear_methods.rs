//! All directions, line searches and methods side by side, on energies with known minimisers.

use crate::common::energies::{Chain, Dixmaana, Law, Quadratic, Rosenbrock};
use crate::common::{distance, from_dense, grid, rule};
use stylet_solver::LinearOperator;
use stylet_solver::check::taylor_gradient;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::nonlinear::line_search::{ApproximateWolfe, Armijo, StrongWolfe};
use stylet_solver::nonlinear::{
    Direction, Following, Forcing, Kept, LbfgsSettings, LbfgsWorkspace, LineSearch, Linearization, NewtonSettings,
    NewtonWorkspace, NonlinearCgSettings, NonlinearCgWorkspace, NonlinearReport, StepModel, lbfgs, newton_cg,
    newton_cg_with, nonlinear_cg,
};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;
use stylet_solver::vector::norm2;

pub const DIRECTIONS: [Direction; 5] = [
    Direction::FletcherReeves,
    Direction::PolakRibierePlus,
    Direction::HagerZhang { eta: 0.01 },
    Direction::DaiKou,
    Direction::Subspace,
];

pub fn searches() -> [LineSearch; 4] {
    [
        LineSearch::GradientFirst,
        LineSearch::Armijo(Armijo::default()),
        LineSearch::StrongWolfe(StrongWolfe::tight()),
        LineSearch::ApproximateWolfe(ApproximateWolfe::default()),
    ]
}

/// Conjugate gradients of every kind.
pub fn every_cg(stop: StopRule) -> Vec<NonlinearCgSettings> {
    let mut all = Vec::new();
    for direction in DIRECTIONS {
        for search in searches() {
            for step in [StepModel::Curvature, StepModel::Secant] {
                all.push(NonlinearCgSettings { direction, search, step, ..NonlinearCgSettings::new(stop) });
            }
        }
    }
    all
}

/// L-BFGS of every kind.
pub fn every_lbfgs(stop: StopRule) -> Vec<LbfgsSettings> {
    let mut all = Vec::new();
    for search in searches() {
        for (memory, scaled) in [(1, true), (5, true), (5, false), (20, true)] {
            all.push(LbfgsSettings { search, memory, scaled, max_iterations: 10_000, ..LbfgsSettings::new(stop) });
        }
    }
    all
}

fn held(n: usize) -> Subspace<2> {
    let mut w = Subspace::new(n);
    w.set(0, Constraint::Fixed).unwrap();
    w
}

#[test]
fn with_exact_steps_every_direction_is_linear_cg() {
    let s = grid(20);
    let stop = rule(1e-6, Criterion::Reaction);
    let m = BlockJacobi::new(&s.a, &s.w).unwrap();
    let mut linear = s.x0.clone();
    let cg = CgSettings { stop, max_iterations: 1_000 };
    let expected = projected_cg(&s.a, &m, &s.w, &s.b, &mut linear, &cg, &mut CgWorkspace::new()).unwrap();
    for settings in every_cg(stop).into_iter().filter(|s| s.step == StepModel::Curvature) {
        let mut energy = Quadratic { a: s.a.clone(), b: s.b.clone() };
        let mut x = s.x0.clone();
        let mut ws = NonlinearCgWorkspace::new();
        let report = nonlinear_cg(&mut energy, &m, &s.w, norm2(&s.b), &mut x, &settings, &mut ws).unwrap();
        assert_eq!((report.stop, report.iterations), (Stop::Converged, expected.iterations), "{settings:?}");
        assert_eq!(report.gradients, report.iterations + 1);
        assert!(distance(&x, &linear) <= 1e-9 * norm2(&linear), "{settings:?}");
        let products =
            if settings.direction == Direction::Subspace { 2 * report.iterations - 1 } else { report.iterations };
        assert_eq!(report.products, products);
    }
}

#[test]
fn as_many_steps_as_eigenvalues() {
    for distinct in 1..=6 {
        let a = from_dense::<2>(20, |i, j| if i == j { 1.0 + (i % distinct) as f64 } else { 0.0 });
        let b: Vec<f64> = (0..40).map(|k| 1.0 + (k as f64).sin()).collect();
        let exact: Vec<f64> = (0..40).map(|k| b[k] / (1.0 + (k % distinct) as f64)).collect();
        for settings in every_cg(rule(1e-10, Criterion::External)) {
            if settings.step == StepModel::Secant {
                continue;
            }
            let mut energy = Quadratic { a: a.clone(), b: b.clone() };
            let (mut x, mut ws) = (vec![0.0; 40], NonlinearCgWorkspace::new());
            let w = Subspace::<2>::new(20);
            let report = nonlinear_cg(&mut energy, &Identity, &w, norm2(&b), &mut x, &settings, &mut ws).unwrap();
            assert_eq!((report.stop, report.iterations), (Stop::Converged, distinct), "{settings:?} {report:?}");
            assert!(distance(&x, &exact) < 1e-8);
        }
    }
}

#[test]
fn chains_reach_their_analytic_shape_by_every_method() {
    let stop = rule(1e-8, Criterion::Reaction);
    for law in [Law::Cosh, Law::Barrier] {
        for load in [[2.0, 1.0], [-30.0, 0.5]] {
            let mut chain = Chain::new(12, law, 5.0, load);
            let (w, external, exact) = (held(12), load[0].hypot(load[1]), chain.solution());
            chain.linearize(&[0.0; 24]);
            let m = Jacobi::new(chain.matrix(), &w).unwrap();
            let mut newton = vec![0.0; 24];
            newton_cg(&mut chain, &w, external, &mut newton, &NewtonSettings::new(stop), &mut NewtonWorkspace::new())
                .unwrap();
            let check = |x: &[f64], report: NonlinearReport, what: String| {
                assert_eq!(report.stop, Stop::Converged, "{law:?} {load:?} {what} {report:?}");
                assert!(distance(x, &exact) <= 1e-5 * norm2(&exact), "{law:?} {load:?} {what}");
                assert!(distance(x, &newton) <= 1e-5 * norm2(&newton), "{law:?} {load:?} {what}");
            };
            for s in every_cg(stop) {
                let mut x = vec![0.0; 24];
                let report =
                    nonlinear_cg(&mut chain, &m, &w, external, &mut x, &s, &mut NonlinearCgWorkspace::new()).unwrap();
                check(&x, report, format!("{s:?}"));
            }
            // Without scaling the initial matrix has to have the size of the Hessian at the solution.
            chain.linearize(&exact);
            let near = Jacobi::new(chain.matrix(), &w).unwrap();
            for s in every_lbfgs(stop) {
                let mut x = vec![0.0; 24];
                let m = if s.scaled { &m } else { &near };
                let report = lbfgs(&mut chain, m, &w, external, &mut x, &s, &mut LbfgsWorkspace::new()).unwrap();
                check(&x, report, format!("{s:?}"));
                assert_eq!((report.products, report.linearizations), (0, 0));
            }
        }
    }
}

#[test]
fn rosenbrock_valleys_are_followed_by_every_method() {
    let stop = rule(1e-8, Criterion::External);
    for (n, coupling) in [(1, 0.0), (4, 1.0)] {
        let mut valley = Rosenbrock::new(n, coupling);
        let start: Vec<f64> = (0..n).flat_map(|_| [-1.2, 1.0]).collect();
        let w = Subspace::<2>::new(n);
        let check = |x: &[f64], report: NonlinearReport, what: String| {
            assert_eq!(report.stop, Stop::Converged, "{n} {what} {report:?}");
            assert!(distance(x, &vec![1.0; 2 * n]) < 1e-5, "{n} {what}");
        };
        for s in every_cg(stop) {
            let (mut x, mut ws) = (start.clone(), NonlinearCgWorkspace::new());
            let report = nonlinear_cg(&mut valley, &Identity, &w, 1.0, &mut x, &s, &mut ws).unwrap();
            check(&x, report, format!("{s:?}"));
        }
        for s in every_lbfgs(stop) {
            let (mut x, mut ws) = (start.clone(), LbfgsWorkspace::new());
            let report = lbfgs(&mut valley, &Identity, &w, 1.0, &mut x, &s, &mut ws).unwrap();
            check(&x, report, format!("{s:?}"));
        }
        for search in searches() {
            for forcing_rule in [Forcing::Constant, Forcing::Root, Forcing::Contraction] {
                let s = NewtonSettings { search, forcing_rule, ..NewtonSettings::new(stop) };
                let (mut x, mut ws) = (start.clone(), NewtonWorkspace::new());
                let report = newton_cg(&mut valley, &w, 1.0, &mut x, &s, &mut ws).unwrap();
                check(&x, report, format!("{s:?}"));
            }
        }
    }
}

/// Counts of SciPy 1.17.1 to `‖g‖_∞ ≤ 1e-6`: L-BFGS-B (Zhu et al., ACM TOMS 23, 1997) takes 36 iterations and 47
/// evaluations with `maxcor = 5` on the extended Rosenbrock function of 100 variables, and 11 and 12 on DIXMAANA of 300;
/// CG (Polak-Ribière+, strong Wolfe) takes 34 and 75, and 5 and 12.
#[test]
fn counts_are_those_of_established_codes() {
    let stop = StopRule { round_floor: 1e-6, ..rule(1e-6, Criterion::External) };
    let mut dixmaana = Dixmaana(100);
    let d: Vec<f64> = (0..300).map(|k| (k as f64).sin()).collect();
    assert!(taylor_gradient(&mut dixmaana, &[2.0; 300], &d) > 1.95);
    let valley_start: Vec<f64> = (0..50).flat_map(|_| [-1.2, 1.0]).collect();
    let (wide, narrow) = (Subspace::<1>::new(300), Subspace::<2>::new(50));

    let by_lbfgs = LbfgsSettings::new(stop);
    let mut x = valley_start.clone();
    let valley = &mut Rosenbrock::new(50, 0.0);
    let report = lbfgs(valley, &Identity, &narrow, 0.0, &mut x, &by_lbfgs, &mut LbfgsWorkspace::new()).unwrap();
    assert!((29..=43).contains(&report.iterations) && report.gradients <= 58, "{report:?}");
    let mut x = vec![2.0; 300];
    let ws = &mut LbfgsWorkspace::new();
    let report = lbfgs(&mut dixmaana, &Identity, &wide, 0.0, &mut x, &by_lbfgs, ws).unwrap();
    assert!((8..=12).contains(&report.iterations) && report.gradients <= 15, "{report:?}");
    assert!((dixmaana.value(&x) - 1.0).abs() < 1e-10);

    let hager_zhang = NonlinearCgSettings {
        direction: Direction::HagerZhang { eta: 0.01 },
        step: StepModel::Secant,
        search: LineSearch::ApproximateWolfe(ApproximateWolfe::default()),
        ..NonlinearCgSettings::new(stop)
    };
    let wolfe = LineSearch::StrongWolfe(StrongWolfe::tight());
    let polak = NonlinearCgSettings { direction: Direction::PolakRibierePlus, search: wolfe, ..hager_zhang };
    for settings in [hager_zhang, polak] {
        let (mut x, mut ws) = (valley_start.clone(), NonlinearCgWorkspace::new());
        let report = nonlinear_cg(valley, &Identity, &narrow, 0.0, &mut x, &settings, &mut ws).unwrap();
        assert_eq!(report.stop, Stop::Converged);
        assert!((20..=45).contains(&report.iterations) && report.gradients <= 100, "{settings:?} {report:?}");
        let mut x = vec![2.0; 300];
        let report = nonlinear_cg(&mut dixmaana, &Identity, &wide, 0.0, &mut x, &settings, &mut ws).unwrap();
        assert_eq!(report.stop, Stop::Converged);
        assert!((3..=10).contains(&report.iterations) && report.gradients <= 25, "{settings:?} {report:?}");
    }
}

/// A chain whose products are a team's.
struct OnTeam(Chain, Team);

impl Energy for OnTeam {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        self.0.value(x)
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.0.gradient(x, g);
    }

    fn linearize(&mut self, x: &[f64]) {
        self.0.linearize(x);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.0.matrix().apply_on(&self.1, p, hp);
    }
}

impl BlockHessian<2> for OnTeam {
    fn matrix(&self) -> &stylet_solver::sparse::BlockCsr<2> {
        self.0.matrix()
    }
}

#[test]
fn teams_give_the_same_bits() {
    let stop = rule(1e-2, Criterion::Reaction);
    let n = 9_000; // 18,000 entries: long enough for a team to share a vector
    let run = |threads: usize| -> Vec<Vec<u64>> {
        let team = Team::new(threads);
        let mut energy = OnTeam(Chain::new(n, Law::Cosh, 5.0, [0.0, 0.0]), team.clone());
        let (w, start) = (held(n), (0..2 * n).map(|k| (k as f64 * 0.7).sin()).collect::<Vec<f64>>());
        energy.linearize(&start);
        let m = BlockJacobi::new(energy.matrix(), &w).unwrap();
        let mut ends = Vec::new();
        for direction in DIRECTIONS {
            let mut x = start.clone();
            let s = NonlinearCgSettings { direction, max_iterations: 8, ..NonlinearCgSettings::new(stop) };
            nonlinear_cg(&mut energy, &m, &w, 1.0, &mut x, &s, &mut NonlinearCgWorkspace::on(&team)).unwrap();
            ends.push(x);
        }
        let mut x = start.clone();
        let s = LbfgsSettings { max_iterations: 8, ..LbfgsSettings::new(stop) };
        lbfgs(&mut energy, &m, &w, 1.0, &mut x, &s, &mut LbfgsWorkspace::on(&team)).unwrap();
        ends.push(x);
        let mut x = start.clone();
        let s = NewtonSettings { max_iterations: 4, ..NewtonSettings::new(stop) };
        newton_cg(&mut energy, &w, 1.0, &mut x, &s, &mut NewtonWorkspace::on(&team)).unwrap();
        ends.push(x);
        ends.iter().map(|x| x.iter().map(|v| v.to_bits()).collect()).collect()
    };
    let serial = run(1);
    for threads in [2, 8] {
        assert!(run(threads) == serial, "{threads} threads");
    }
}

#[test]
fn newton_takes_a_preconditioner_of_the_callers() {
    let stop = rule(1e-10, Criterion::Reaction);
    let w = held(20);
    let solve = |how: &dyn Fn(&mut Chain, &mut Vec<f64>) -> NonlinearReport| {
        let mut chain = Chain::new(20, Law::Cosh, 5.0, [2.0, 1.0]);
        let mut x = vec![0.0; 40];
        let report = how(&mut chain, &mut x);
        assert_eq!(report.stop, Stop::Converged);
        (report, x.iter().map(|v| v.to_bits()).collect::<Vec<u64>>())
    };
    for linearization in [Linearization::Every, Linearization::WhenSlow] {
        let s = NewtonSettings { linearization, ..NewtonSettings::new(stop) };
        let own = solve(&|chain, x| newton_cg(chain, &w, 2.2, x, &s, &mut NewtonWorkspace::new()).unwrap());
        // The same by a function of the caller's: called at every linearisation.
        let calls = std::sync::atomic::AtomicUsize::new(0);
        let following = solve(&|chain, x| {
            let mut m = BlockJacobi::default();
            let follow = |m: &mut BlockJacobi<2>, h: &_, w: &_| {
                calls.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                m.rebuild(h, w).is_ok()
            };
            let mut m = Following { m: &mut m, follow };
            newton_cg_with(chain, &mut m, &w, 2.2, x, &s, &mut NewtonWorkspace::new()).unwrap()
        });
        assert_eq!(own, following);
        assert_eq!(calls.into_inner(), own.0.linearizations);
        // One that stays as it is.
        let kept = solve(&|chain, x| {
            chain.linearize(&[0.0; 40]);
            let m = BlockJacobi::new(chain.matrix(), &w).unwrap();
            newton_cg_with(chain, &mut Kept(&m), &w, 2.2, x, &s, &mut NewtonWorkspace::new()).unwrap()
        });
        assert!(kept.0.iterations <= own.0.iterations + 2, "{kept:?}");
        // One that never can follow is none.
        let plain = NewtonSettings { preconditioning: stylet_solver::nonlinear::Preconditioning::None, ..s };
        let none = solve(&|chain, x| newton_cg(chain, &w, 2.2, x, &plain, &mut NewtonWorkspace::new()).unwrap());
        let helpless = solve(&|chain, x| {
            let mut m = Following { m: &mut Identity, follow: |_: &mut Identity, _: &_, _: &_| false };
            newton_cg_with(chain, &mut m, &w, 2.2, x, &s, &mut NewtonWorkspace::new()).unwrap()
        });
        assert_eq!(none, helpless);
    }
}

#[test]
fn accurate_solves_take_fewer_steps() {
    let count = |forcing_rule, forcing| {
        // Residuals of all wavelengths, so that conjugate gradients make headway in every iteration.
        let mut chain = Chain::new(200, Law::Cosh, 1.0, [0.0, 0.0]);
        let mut x: Vec<f64> = (0..400).map(|k| ((k * k) as f64 * 0.37).sin()).collect();
        x[0] = 0.0;
        let s = NewtonSettings { forcing_rule, forcing, ..NewtonSettings::new(rule(1e-10, Criterion::Reaction)) };
        let report = newton_cg(&mut chain, &held(200), 1.0, &mut x, &s, &mut NewtonWorkspace::new()).unwrap();
        assert_eq!(report.stop, Stop::Converged);
        (report.iterations, report.inner_iterations)
    };
    let (constant, root, contraction) =
        (count(Forcing::Constant, 0.5), count(Forcing::Root, 0.5), count(Forcing::Contraction, 0.5));
    assert!(constant.0 > root.0 && constant.0 > contraction.0, "{constant:?} {root:?} {contraction:?}");
}

/// The exact inverse of the Hessian: what a factorisation would give.
struct Inverse(Vec<f64>);

impl Preconditioner for Inverse {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        z.iter_mut().zip(r.iter().zip(&self.0)).for_each(|(z, (r, d))| *z = r / d);
    }
}

#[test]
fn lbfgs_around_an_exact_factor_takes_one_step() {
    let d: Vec<f64> = (0..40).map(|k| 10f64.powf(k as f64 / 20.0)).collect();
    let a = from_dense::<2>(20, |i, j| if i == j { d[i] } else { 0.0 });
    let mut energy = Quadratic { a, b: (0..40).map(|k| 1.0 + (k as f64).sin()).collect() };
    let w = Subspace::<2>::new(20);
    for mut s in every_lbfgs(rule(1e-10, Criterion::External)) {
        let (mut x, mut ws) = (vec![0.0; 40], LbfgsWorkspace::new());
        let report = lbfgs(&mut energy, &Inverse(d.clone()), &w, 1.0, &mut x, &s, &mut ws).unwrap();
        assert_eq!((report.stop, report.iterations, report.gradients), (Stop::Converged, 1, 2), "{s:?}");
        // Without it, more memory takes fewer steps.
        s.search = LineSearch::StrongWolfe(StrongWolfe::loose());
        let mut counts = [1, 40].map(|memory| {
            let (mut x, mut ws) = (vec![0.0; 40], LbfgsWorkspace::new());
            let s = LbfgsSettings { memory, scaled: true, stop: rule(1e-6, Criterion::External), ..s };
            let report = lbfgs(&mut energy, &Identity, &w, 1.0, &mut x, &s, &mut ws).unwrap();
            assert_eq!(report.stop, Stop::Converged);
            report.iterations
        });
        counts.reverse();
        assert!(counts[0] < counts[1], "{counts:?}");
    }
}
