//! What does a product `A x` cost per block, from cache to main memory, and against scalar CSR on the same numbers?
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
use stylet_solver::sparse::BlockCsr;

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
    let mut y = vec![0.0; x.len()];
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(matrix.n_blocks() as u64));

    group
        .bench_function(BenchmarkId::new("apply", rows), |b| b.iter(|| matrix.apply(black_box(&x), black_box(&mut y))));
    group.bench_function(BenchmarkId::new("apply_dot", rows), |b| {
        b.iter(|| matrix.apply_dot(black_box(&x), black_box(&mut y)));
    });
    // Small matrices stay on one thread whatever they are allowed.
    let mut parallel = matrix.clone();
    parallel.set_threads(2);
    group.bench_function(BenchmarkId::new("apply_2_threads", rows), |b| {
        b.iter(|| parallel.apply(black_box(&x), black_box(&mut y)));
    });

    let (indptr, indices, values) = matrix.to_scalar_csr().into_parts();
    let scalar = sprs::CsMat::new((x.len(), x.len()), indptr, indices, values);
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
