//! What does an iteration of preconditioned conjugate gradients cost beyond its product, in f64 and in f32, on one thread and
//! two?
//!
//! A cube of tetrahedra, clamped on one side, is pulled at the other; every solve stops after the same number of iterations,
//! well before it converges. Throughput counts iterations, so its inverse is the time of one. `products` are the products of
//! such a solve alone, the floor of the others.
//!
//! ```text
//! cargo bench -p stylet-benches --bench cg_iteration [-- --quick]
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_solver::LinearOperator;
use stylet_solver::linear::{CgReport, CgSettings, CgWorkspace, MixedWorkspace, mixed_cg, projected_cg};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::sparse::Frozen;
use stylet_solver::stop::{Criterion as Residual, Stop, StopRule};
use stylet_solver::team::Team;
use support::Clamped;

/// Iterations of a solve, one product each, after the one that evaluates the first residual.
const ITERATIONS: usize = 20;
/// Parts along the side: 1,000 to 15,625 nodes.
const CUBES: [usize; 3] = [9, 13, 24];

/// A problem and who solves it.
struct Problem {
    body: Clamped,
    frozen: Frozen<3>,
    team: Team,
}

impl Problem {
    fn settings() -> CgSettings {
        // Not so tight that the solver distrusts its recurrence and evaluates residuals afresh.
        let stop = StopRule { tolerance: 1e-6, criterion: Residual::External, round_floor: 0.0 };
        CgSettings { stop, max_iterations: ITERATIONS }
    }

    fn measure(&self, c: &mut Criterion, name: &str, mut solve: impl FnMut(&mut [f64]) -> CgReport) {
        let mut x = vec![0.0; self.body.load.len()];
        let report = solve(&mut x);
        assert_eq!((report.stop, report.iterations), (Stop::IterationLimit, ITERATIONS), "{name}: {report:?}");
        self.time(c, name, || {
            x.fill(0.0);
            black_box(solve(black_box(&mut x)));
        });
    }

    fn time(&self, c: &mut Criterion, name: &str, work: impl FnMut()) {
        let mut group = c.benchmark_group(format!("cg_iteration/{}", self.team.size()));
        group.throughput(Throughput::Elements(ITERATIONS as u64));
        let mut work = work;
        group.bench_function(BenchmarkId::new(name, self.body.matrix.n_rows()), |b| b.iter(&mut work));
        group.finish();
    }

    fn cg(&self, c: &mut Criterion, name: &str, m: &impl Preconditioner) {
        let Clamped { subspace, load, .. } = &self.body;
        let mut ws = CgWorkspace::on(&self.team);
        self.measure(c, name, |x| {
            projected_cg(&self.frozen, m, subspace, load, x, &Self::settings(), &mut ws).expect("positive definite")
        });
    }
}

fn solves(c: &mut Criterion) {
    for (n, threads) in CUBES.into_iter().flat_map(|n| [(n, 1), (n, 2)]) {
        let body = support::clamped_cube(n);
        let problem = Problem { frozen: Frozen::new(&body.matrix), team: Team::new(threads), body };
        let Clamped { matrix, subspace, load } = &problem.body;
        let mut y = vec![0.0; load.len()];
        problem.time(c, "products", || {
            (0..=ITERATIONS).for_each(|_| problem.frozen.apply_on(&problem.team, black_box(load), black_box(&mut y)));
        });
        problem.cg(c, "none", &Identity);
        problem.cg(c, "jacobi", &Jacobi::new(matrix, subspace).expect("positive diagonals"));
        problem.cg(c, "block_jacobi", &BlockJacobi::new(matrix, subspace).expect("positive definite blocks"));

        let single = Frozen::<3, f32>::new(matrix);
        let m = BlockJacobi::in_single_precision(matrix, subspace).expect("positive definite blocks");
        let mut ws = MixedWorkspace::on(&problem.team);
        problem.measure(c, "block_jacobi_mixed", |x| {
            mixed_cg(&problem.frozen, &single, &m, subspace, load, x, &Problem::settings(), &mut ws)
                .expect("positive definite")
        });
    }
}

criterion_group! { name = benches; config = support::criterion(); targets = solves }
criterion_main!(benches);
