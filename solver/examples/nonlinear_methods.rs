//! A rod of stiffening springs, pulled at its end: `min E(x) = Σ k (cosh(x_{i+1} − x_i) − 1) − f x_{n−1}`, by every method.
//!
//! ```text
//!   |o-/\/-o-/\/-o-/\/-o  -> f        |  fixed node
//! ```
//!
//! The minimiser is known: every spring is longer by `asinh(f/k)`. Prints what each method asks of the energy for a residual
//! of 1e-8 of the forces, and fails if one of them misses the minimiser:
//!
//! ```text
//! cargo run --release -p stylet-solver --example nonlinear_methods
//! ```

use std::error::Error;
use stylet_solver::LinearOperator;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::nonlinear::line_search::{ApproximateWolfe, StrongWolfe};
use stylet_solver::nonlinear::{
    Direction, LbfgsSettings, LbfgsWorkspace, LineSearch, NewtonSettings, NewtonWorkspace, NonlinearCgSettings,
    NonlinearCgWorkspace, NonlinearReport, StepModel, lbfgs, newton_cg, nonlinear_cg,
};
use stylet_solver::precondition::Jacobi;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

const NODES: usize = 100;
/// Stiffness, N, and force at the end, N.
const K: f64 = 5.0;
const FORCE: f64 = 4.0;

struct Rod {
    hessian: BlockCsr<1>,
}

impl Energy for Rod {
    fn dim(&self) -> usize {
        NODES
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        x.windows(2).map(|x| K * ((x[1] - x[0]).cosh() - 1.0)).sum::<f64>() - FORCE * x[NODES - 1]
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        g.fill(0.0);
        g[NODES - 1] = -FORCE;
        for i in 0..NODES - 1 {
            let pull = K * (x[i + 1] - x[i]).sinh();
            g[i] -= pull;
            g[i + 1] += pull;
        }
    }

    fn linearize(&mut self, x: &[f64]) {
        let stiffness = |i: usize| K * (x[i + 1] - x[i]).cosh();
        for i in 0..NODES {
            let left = if i > 0 { stiffness(i - 1) } else { 0.0 };
            let right = if i + 1 < NODES { stiffness(i) } else { 0.0 };
            let all = [(i.wrapping_sub(1), -left), (i, left + right), (i + 1, -right)];
            let (cols, blocks): (Vec<u32>, Vec<_>) =
                all.into_iter().filter(|(j, _)| *j < NODES).map(|(j, k)| (j as u32, [[k]])).unzip();
            self.hessian.set_row(i, &cols, &blocks).expect("a row of the rod");
        }
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.hessian.apply(p, hp);
    }
}

impl BlockHessian<1> for Rod {
    fn matrix(&self) -> &BlockCsr<1> {
        &self.hessian
    }
}

fn row(method: &str, report: &NonlinearReport, x: &[f64]) -> Result<(), Box<dyn Error>> {
    let NonlinearReport { iterations, gradients, values, products, .. } = report;
    let stretch = (FORCE / K).asinh();
    let error = x.iter().enumerate().map(|(i, x)| (x - i as f64 * stretch).abs()).fold(0.0, f64::max);
    println!("{method:38} {iterations:10} {gradients:10} {values:10} {products:10} {error:10.1e}");
    if report.stop != Stop::Converged || error > 1e-4 {
        return Err(format!("{method} misses the minimiser by {error:e}: {report:?}").into());
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut rod = Rod { hessian: BlockCsr::new(NODES) };
    let mut w = Subspace::<1>::new(NODES);
    w.set(0, Constraint::Fixed)?;
    let start = [0.0; NODES];
    rod.linearize(&start);
    let m = Jacobi::new(&rod.hessian, &w)?;
    let stop = StopRule { tolerance: 1e-8, criterion: Criterion::Reaction, round_floor: 0.0 };
    println!("{:38} iterations  gradients     values   products      error", "");

    let directions = [
        Direction::FletcherReeves,
        Direction::PolakRibierePlus,
        Direction::HagerZhang { eta: 0.01 },
        Direction::DaiKou,
        Direction::Subspace,
    ];
    for direction in directions {
        let settings = NonlinearCgSettings { direction, ..NonlinearCgSettings::new(stop) };
        let mut x = start;
        let report = nonlinear_cg(&mut rod, &m, &w, FORCE, &mut x, &settings, &mut NonlinearCgWorkspace::new())?;
        row(&format!("CG, {direction:?}"), &report, &x)?;
    }
    let searches = [
        ("strong Wolfe", LineSearch::StrongWolfe(StrongWolfe::tight())),
        ("approximate Wolfe", LineSearch::ApproximateWolfe(ApproximateWolfe::default())),
    ];
    for (name, search) in searches {
        let direction = Direction::HagerZhang { eta: 0.01 };
        let settings =
            NonlinearCgSettings { direction, search, step: StepModel::Secant, ..NonlinearCgSettings::new(stop) };
        let mut x = start;
        let report = nonlinear_cg(&mut rod, &m, &w, FORCE, &mut x, &settings, &mut NonlinearCgWorkspace::new())?;
        row(&format!("CG, HagerZhang, {name}"), &report, &x)?;
    }
    for memory in [5, 20] {
        let settings = LbfgsSettings { memory, ..LbfgsSettings::new(stop) };
        let mut x = start;
        let report = lbfgs(&mut rod, &m, &w, FORCE, &mut x, &settings, &mut LbfgsWorkspace::new())?;
        row(&format!("L-BFGS, memory {memory}"), &report, &x)?;
    }
    let mut x = start;
    let settings = NewtonSettings::new(stop);
    let report = newton_cg(&mut rod, &w, FORCE, &mut x, &settings, &mut NewtonWorkspace::new())?;
    row("Newton-CG, block Jacobi", &report, &x)
}
