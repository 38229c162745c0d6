//! What do an ordering, an analysis, a factorisation and a solution cost, and in f32?
//!
//! A cube of tetrahedra, one face held. Throughput counts nodes.
//!
//! ```text
//! cargo bench -p stylet-benches --bench factorisation [-- --quick]
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::sync::Arc;
use stylet_solver::linear::direct::{Factor, FactorNumber, FillOrder, Method, Symbolic};
use stylet_solver::ordering::{minimum_degree, nested_dissection, reverse_cuthill_mckee};
use support::Clamped;

/// Parts along the side: 512 to 2,744 nodes.
const CUBES: [usize; 2] = [7, 13];

fn factors(c: &mut Criterion) {
    for n in CUBES {
        let body = support::clamped_cube(n);
        let size = body.matrix.n_rows();
        let mut group = c.benchmark_group("ordering");
        group.throughput(Throughput::Elements(size as u64));
        group.bench_function(BenchmarkId::new("reverse_cuthill_mckee", size), |b| {
            b.iter(|| reverse_cuthill_mckee(black_box(&body.matrix)));
        });
        group.bench_function(BenchmarkId::new("minimum_degree", size), |b| {
            b.iter(|| minimum_degree(black_box(&body.matrix)).expect("a graph"));
        });
        group.bench_function(BenchmarkId::new("nested_dissection", size), |b| {
            b.iter(|| nested_dissection(black_box(&body.matrix)).expect("a graph"));
        });
        group.finish();

        let order = FillOrder::NestedDissection;
        let symbolic = Arc::new(Symbolic::new(&body.matrix, order).expect("a symmetric pattern"));
        let mut group = c.benchmark_group("factorisation");
        group.throughput(Throughput::Elements(size as u64));
        group.bench_function(BenchmarkId::new("analysis", size), |b| {
            b.iter(|| Symbolic::new(black_box(&body.matrix), order).expect("a symmetric pattern"));
        });
        group.finish();
        measure::<f64>(c, "f64", &body, &symbolic);
        measure::<f32>(c, "f32", &body, &symbolic);
    }
}

fn measure<T: FactorNumber>(c: &mut Criterion, format: &str, body: &Clamped, symbolic: &Arc<Symbolic<3>>) {
    let Clamped { matrix, subspace, load } = body;
    let mut factor = Factor::<3, T>::new(symbolic.clone(), Method::Llt, matrix, subspace).expect("positive definite");
    let size = matrix.n_rows();
    let mut group = c.benchmark_group("factorisation");
    group.throughput(Throughput::Elements(size as u64));
    group.bench_function(BenchmarkId::new(format!("refactor_{format}"), size), |b| {
        b.iter(|| factor.refactor(black_box(matrix), subspace).expect("positive definite"));
    });
    let mut x = load.clone();
    group.bench_function(BenchmarkId::new(format!("solve_{format}"), size), |b| {
        b.iter(|| {
            x.copy_from_slice(load);
            factor.solve(black_box(&mut x)).expect("finite");
        });
    });
    group.finish();
}

criterion_group! { name = benches; config = support::criterion().sample_size(20); targets = factors }
criterion_main!(benches);
