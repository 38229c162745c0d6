//! What does an iteration of projected conjugate gradients cost beyond its product, and what does a preconditioner add?
//!
//! A square clamped on its right side is pulled to the left; every solve stops after the same number of iterations, well
//! before it converges. Throughput counts iterations, so its inverse is the time of one. `products` are the products of
//! such a solve alone, the floor of the others.
//!
//! ```text
//! cargo bench -p stylet-benches --bench cg_iteration [-- --quick]
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_physics::body::Body;
use stylet_solver::LinearOperator;
use stylet_solver::linear::{CgReport, CgSettings, CgWorkspace, projected_cg};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion as Residual, Stop, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// Iterations of a solve, one product each, after the one that evaluates the first residual.
const ITERATIONS: usize = 20;
/// Parts along the side: 289 to 66 049 nodes.
const SQUARES: [usize; 4] = [16, 64, 128, 256];

/// A load and supports for a matrix.
struct Problem<'a> {
    matrix: &'a BlockCsr<2>,
    subspace: Subspace<2>,
    load: Vec<f64>,
}

impl Problem<'_> {
    fn solve(&self, m: &impl Preconditioner, x: &mut [f64], ws: &mut CgWorkspace) -> CgReport {
        // Not so tight that the solver distrusts its recurrence and evaluates residuals afresh.
        let stop = StopRule { tolerance: 1e-6, criterion: Residual::External, round_floor: 0.0 };
        let settings = CgSettings { stop, max_iterations: ITERATIONS };
        x.fill(0.0);
        projected_cg(self.matrix, m, &self.subspace, &self.load, x, &settings, ws).expect("a positive definite matrix")
    }

    fn measure(&self, c: &mut Criterion, name: &str, m: &impl Preconditioner) {
        let mut x = vec![0.0; self.load.len()];
        let mut ws = CgWorkspace::new();
        let report = self.solve(m, &mut x, &mut ws);
        assert_eq!((report.stop, report.iterations), (Stop::IterationLimit, ITERATIONS), "{name}: {report:?}");
        let mut group = c.benchmark_group("cg_iteration");
        group.throughput(Throughput::Elements(ITERATIONS as u64));
        group.bench_function(BenchmarkId::new(name, self.matrix.n_rows()), |b| {
            b.iter(|| self.solve(m, black_box(&mut x), &mut ws));
        });
        group.finish();
    }

    fn measure_products(&self, c: &mut Criterion) {
        let mut y = vec![0.0; self.load.len()];
        let mut group = c.benchmark_group("cg_iteration");
        group.throughput(Throughput::Elements(ITERATIONS as u64));
        group.bench_function(BenchmarkId::new("products", self.matrix.n_rows()), |b| {
            b.iter(|| (0..=ITERATIONS).for_each(|_| self.matrix.apply(black_box(&self.load), black_box(&mut y))));
        });
        group.finish();
    }
}

fn solves(c: &mut Criterion) {
    for n in SQUARES {
        let mesh = support::cube::<2, 3>(n);
        let body = Body::new(&mesh, support::linear_slab(), support::TISSUE.2).expect("a body");
        let mut subspace = Subspace::new(mesh.n_vertex_slots());
        let mut load = vec![0.0; 2 * mesh.n_vertex_slots()];
        for (v, x) in mesh.points().iter().enumerate() {
            if x[0] == support::SIDE {
                subspace.set(v, Constraint::Fixed).expect("a vertex of the mesh");
            } else {
                load[2 * v] = -1.0 / mesh.n_vertices() as f64;
            }
        }
        let problem = Problem { matrix: body.stiffness(), subspace, load };
        problem.measure_products(c);
        problem.measure(c, "none", &Identity);
        let jacobi = Jacobi::new(problem.matrix, &problem.subspace).expect("positive diagonals");
        problem.measure(c, "jacobi", &jacobi);
        let block_jacobi = BlockJacobi::new(problem.matrix, &problem.subspace).expect("positive definite blocks");
        problem.measure(c, "block_jacobi", &block_jacobi);
    }
}

criterion_group! { name = benches; config = support::criterion(); targets = solves }
criterion_main!(benches);
