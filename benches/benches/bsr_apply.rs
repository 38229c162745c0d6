//! What does a product `A x` cost per block, from cache to main memory: dynamic and frozen, in f64 and f32, on one thread and
//! two, and against scalar CSR on the same numbers?
//!
//! Stiffness matrices of a triangulated square (7 blocks of 2x2 a row) and a cube of tetrahedra (15 blocks of 3x3 a row).
//! Throughput counts blocks. `sprs` adds to its output, which must be cleared first, as our product does.
//!
//! ```text
//! cargo bench -p stylet-benches --bench bsr_apply [-- --quick] [-- '2x2/sprs']
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_physics::body::Body;
use stylet_solver::LinearOperator;
use stylet_solver::sparse::{BlockCsr, Frozen};
use stylet_solver::team::Team;

/// Parts along the side of the square: 289 to 66 049 rows.
const SQUARES: [usize; 5] = [16, 32, 64, 128, 256];
/// Parts along the side of the cube: 343 to 68 921 rows.
const CUBES: [usize; 4] = [6, 12, 25, 40];

fn squares(c: &mut Criterion) {
    for n in SQUARES {
        let mesh = support::cube::<2, 3>(n);
        let body = Body::new(&mesh, support::linear_slab(), support::TISSUE.2).expect("a body");
        measure(c, "bsr_apply/2x2", body.stiffness());
    }
}

fn cubes(c: &mut Criterion) {
    for n in CUBES {
        let mesh = support::cube::<3, 4>(n);
        let body = Body::new(&mesh, support::linear(), 1.0).expect("a body");
        measure(c, "bsr_apply/3x3", body.stiffness());
    }
}

/// Times every kind of product with one matrix.
fn measure<const B: usize>(c: &mut Criterion, name: &str, matrix: &BlockCsr<B>) {
    let rows = matrix.n_rows();
    let x: Vec<f64> = (0..matrix.dim()).map(|i| 1.0 + 1e-3 * (i % 7) as f64).collect();
    let x32: Vec<f32> = x.iter().map(|&x| x as f32).collect();
    let (mut y, mut y32) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    let (frozen, frozen32) = (Frozen::<B>::new(matrix), Frozen::<B, f32>::new(matrix));
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(matrix.n_blocks() as u64));

    group.bench_function(BenchmarkId::new("dynamic", rows), |b| {
        b.iter(|| matrix.apply(black_box(&x), black_box(&mut y)));
    });
    for threads in [1, 2] {
        let team = Team::new(threads);
        group.bench_function(BenchmarkId::new(format!("frozen_f64_{threads}"), rows), |b| {
            b.iter(|| frozen.apply_on(&team, black_box(&x), black_box(&mut y)));
        });
        group.bench_function(BenchmarkId::new(format!("frozen_f64_dot_{threads}"), rows), |b| {
            b.iter(|| frozen.apply_dot_on(&team, black_box(&x), black_box(&mut y)));
        });
        group.bench_function(BenchmarkId::new(format!("frozen_f32_{threads}"), rows), |b| {
            b.iter(|| frozen32.apply_on(&team, black_box(&x32), black_box(&mut y32)));
        });
    }
    let scalar = sprs::CsMat::<f64>::from(matrix);
    group.bench_function(BenchmarkId::new("sprs", rows), |b| {
        b.iter(|| {
            y.fill(0.0);
            sprs::prod::mul_acc_mat_vec_csr(scalar.view(), black_box(&x[..]), black_box(&mut y[..]));
        });
    });
    group.finish();
}

criterion_group! { name = benches; config = support::criterion(); targets = squares, cubes }
criterion_main!(benches);
