//! Iterations that preconditioners need on the model systems, and what every one of them must be: symmetric, positive on the
//! subspace, the same on any number of threads.

use crate::common::elasticity::cube;
use crate::common::rule;
use std::time::Instant;
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::precondition::aggregation::{
    Form, Modes, SmoothedAggregation, SmoothedAggregationSettings, TwoLevel,
};
use stylet_solver::precondition::{BlockJacobi, Chebyshev, ChebyshevSettings, Preconditioner};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::subspace::Subspace;

/// Iterations until `‖b − A x‖ ≤ 1e-5 ‖b‖`.
fn iterations(a: &BlockCsr<3>, m: &impl Preconditioner, b: &[f64]) -> usize {
    let settings = CgSettings { stop: rule(1e-5, Criterion::External), max_iterations: 5000 };
    let w = Subspace::<3>::new(a.n_rows());
    let mut x = vec![0.0; b.len()];
    let report = projected_cg(a, m, &w, b, &mut x, &settings, &mut CgWorkspace::new()).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    report.iterations
}

fn timed<T>(f: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = f();
    (start.elapsed().as_secs_f64() * 1e3, result)
}

fn show<M: Preconditioner>(name: &str, a: &BlockCsr<3>, b: &[f64], make: impl FnOnce() -> M) {
    let (set_up, m) = timed(make);
    let (solve, count) = timed(|| iterations(a, &m, b));
    println!("{name:30} {count:5} iterations, set-up {set_up:8.1} ms, solve {solve:8.1} ms");
}

#[test]
#[ignore = "prints a table"]
fn table() {
    let cells = std::env::var("CELLS").map_or(13, |c| c.parse().unwrap());
    for (nu, dt) in [(0.34, 0.0), (0.45, 0.0), (0.49, 0.0), (0.34, 1e-3), (0.49, 1e-3), (0.34, 0.02), (0.49, 0.02)] {
        if cells > 20 && (dt > 0.0 || nu == 0.45) {
            continue;
        }
        let s = cube(cells, nu);
        let a = if dt == 0.0 { s.a.clone() } else { s.dynamic(dt) };
        let (b, w) = (&s.load, Subspace::new(a.n_rows()));
        println!("-- nu {nu}, dt {dt}");
        show("block Jacobi", &a, b, || BlockJacobi::new(&a, &w).unwrap());
        for degree in [2, 3, 4] {
            for ratio in [10.0, 30.0, 100.0] {
                let settings = ChebyshevSettings { degree, ratio };
                show(&format!("Chebyshev {degree} {ratio}"), &a, b, || Chebyshev::new(&a, &w, settings).unwrap());
            }
        }
        let modes = || Modes::<3, 6>::rigid(&s.coordinates).unwrap();
        show("two-level additive", &a, b, || TwoLevel::new(&a, &w, modes(), Form::Additive, None).unwrap());
        for (degree, ratio) in [(1, 2.0), (1, 4.0), (1, 10.0), (2, 10.0)] {
            let form = Form::VCycle(ChebyshevSettings { degree, ratio });
            show(&format!("two-level V {degree} {ratio}"), &a, b, || TwoLevel::new(&a, &w, modes(), form, None).unwrap());
        }
        for strength in [0.0, 0.08] {
            for (degree, ratio) in [(1, 4.0), (2, 4.0), (2, 10.0), (2, 20.0), (3, 10.0), (3, 20.0)] {
                let smoother = ChebyshevSettings { degree, ratio };
                let settings = SmoothedAggregationSettings { strength, smoother, ..Default::default() };
                let mut dims = Vec::new();
                show(&format!("SA {strength} {degree} {ratio}"), &a, b, || {
                    let m = SmoothedAggregation::new(&a, &w, modes(), settings).unwrap();
                    dims = m.dims().map(|d| d as f64).collect();
                    dims.push(m.operator_complexity());
                    m
                });
                println!("        {dims:.2?}");
            }
        }
    }
}
