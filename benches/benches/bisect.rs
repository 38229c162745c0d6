//! What do bisection and coarsening cost per cell, what does a needle cost that advances by one cell, does refinement around a point cost what it changes or what the mesh holds, and how
//! far below that are a call that finds nothing to do and the location of a point?
//!
//! Throughput counts cells born (dead for `coarsen`; steps for `step`; points for `locate` and `nothing_to_do`).
//!
//! ```text
//! cargo bench -p stylet-benches --bench bisect [-- --quick]
//! ```

mod support;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_mesh::{MeshChange, SimplexMesh, Sweep};
use support::SIDE;

/// Longest edges of the finest cells around a point, as parts of those of the start mesh.
const FINER: f64 = 1.0 / 16.0;
/// Points of one round of location.
const POINTS: usize = 1000;

/// All questions on a box in `n` parts along each side.
fn measure<const D: usize, const N: usize>(c: &mut Criterion, n: usize) {
    let start = support::cube::<D, N>(n);
    let cells = start.n_cells();
    let edge = SIDE / n as f64 * (D as f64).sqrt();
    let name = format!("bisect/{D}d");
    let mut group = c.benchmark_group(&name);

    // Two levels of the box in D steps each.
    let size = 0.26 * edge;
    let whole = refined(&start, |mesh, change| mesh.refine_everywhere(size, change).expect("room"));
    group.throughput(Throughput::Elements((whole.n_cells() - cells) as u64));
    group.bench_function(BenchmarkId::new("everywhere", cells), |b| {
        let work = |mesh: &mut SimplexMesh<D, N>| mesh.refine_everywhere(size, &mut MeshChange::default());
        b.iter_batched_ref(|| start.clone(), work, BatchSize::PerIteration);
    });

    // A clone has no room to grow: the first refinement copies its arrays, so that the one that is timed need not.
    let (warm_up, point) = ([0.913 * SIDE; D], std::array::from_fn(|k| (0.31 + 0.07 * k as f64) * SIDE));
    let size = FINER * edge * (1.0 + 1e-6);
    let around = |mesh: &mut SimplexMesh<D, N>, at| {
        let mut change = MeshChange::default();
        mesh.refine_around(at, size, &mut change).expect("room");
        change
    };
    let warm = || {
        let mut mesh = start.clone();
        around(&mut mesh, warm_up);
        mesh
    };
    let born = around(&mut warm(), point).born.len();
    group.throughput(Throughput::Elements(born as u64));
    group.bench_function(BenchmarkId::new("around", cells), |b| {
        b.iter_batched_ref(warm, |mesh| around(mesh, point), BatchSize::PerIteration);
    });

    let mut fine = warm();
    around(&mut fine, point);
    let mut change = MeshChange::default();
    group.throughput(Throughput::Elements(1));
    group.bench_function(BenchmarkId::new("nothing_to_do", cells), |b| {
        b.iter(|| fine.refine_around(black_box(point), size, &mut change));
    });
    assert!(change.is_empty(), "there was something to do");

    let points = support::spread::<D>(POINTS);
    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function(BenchmarkId::new("locate", cells), |b| {
        b.iter(|| points.iter().filter(|&&p| fine.locate(black_box(p)).is_some()).count());
    });
    group.finish();
}

fn refined<const D: usize, const N: usize>(
    start: &SimplexMesh<D, N>,
    refine: impl FnOnce(&mut SimplexMesh<D, N>, &mut MeshChange),
) -> SimplexMesh<D, N> {
    let mut mesh = start.clone();
    refine(&mut mesh, &mut MeshChange::default());
    mesh
}

/// Uniform refinement of one square, cube or tesseract to about a hundred thousand cells, in one call.
fn uniform<const D: usize, const N: usize>(c: &mut Criterion, size: f64) {
    let start = support::cube::<D, N>(1);
    let whole = refined(&start, |mesh, change| mesh.refine_everywhere(size * SIDE, change).expect("room"));
    let mut group = c.benchmark_group(format!("bisect/{D}d"));
    group.throughput(Throughput::Elements(whole.n_cells() as u64));
    group.bench_function(BenchmarkId::new("uniform", whole.n_cells()), |b| {
        let work = |mesh: &mut SimplexMesh<D, N>| mesh.refine_everywhere(size * SIDE, &mut MeshChange::default());
        b.iter_batched_ref(|| start.clone(), work, BatchSize::PerIteration);
    });
    group.bench_function(BenchmarkId::new("coarsen", whole.n_cells()), |b| {
        let work = |mesh: &mut SimplexMesh<D, N>| mesh.coarsen_everywhere(&mut MeshChange::default());
        b.iter_batched_ref(|| whole.clone(), work, BatchSize::PerIteration);
    });
    group.finish();
}

/// A needle in a cube: refinement, coarsening, and a step by the size of its cells with the tail following.
fn needle(c: &mut Criterion) {
    let start = support::cube::<3, 4>(1);
    let size = SIDE / 128.0;
    let (entry, tip) = ([-0.01, 0.431, 0.527], [0.713, 0.489, 0.561]);
    // By parts of the path, of which a size is 1/93.
    let at = |t: f64| -> [f64; 3] { std::array::from_fn(|k| SIDE * (entry[k] + t * (tip[k] - entry[k]))) };
    let fine = refined(&start, |mesh, change| mesh.refine_along(at(0.0), at(1.0), size, change).expect("room"));
    let mut group = c.benchmark_group("bisect/needle");
    group.throughput(Throughput::Elements(fine.n_cells() as u64));
    group.bench_function("refine", |b| {
        let work = |mesh: &mut SimplexMesh<3, 4>| mesh.refine_along(at(0.0), at(1.0), size, &mut MeshChange::default());
        b.iter_batched_ref(|| start.clone(), work, BatchSize::PerIteration);
    });
    group.bench_function("coarsen", |b| {
        let work = |mesh: &mut SimplexMesh<3, 4>| mesh.coarsen_everywhere(&mut MeshChange::default());
        b.iter_batched_ref(|| fine.clone(), work, BatchSize::PerIteration);
    });
    group.throughput(Throughput::Elements(1));
    group.bench_function("step", |b| {
        let (mut mesh, mut sweep, mut change) = (start.clone(), Sweep::new(size), MeshChange::default());
        let mut step = 0;
        b.iter(|| {
            // Half of the path long, to and fro along the other half.
            let t = f64::from((step % 92_i32 - 46).abs()) / 93.0;
            step += 1;
            change.clear();
            sweep.follow(&mut mesh, at(t), at(t + 0.5), &mut change).expect("room");
        });
    });
    group.finish();
}

fn triangles(c: &mut Criterion) {
    uniform::<2, 3>(c, 1.0 / 256.0);
    for n in [8, 32, 128] {
        measure::<2, 3>(c, n);
    }
}

fn tetrahedra(c: &mut Criterion) {
    uniform::<3, 4>(c, 3_f64.sqrt() / 32.0);
    needle(c);
    for n in [4, 8, 16] {
        measure::<3, 4>(c, n);
    }
}

fn four_dimensions(c: &mut Criterion) {
    uniform::<4, 5>(c, 0.25);
}

criterion_group! { name = benches; config = support::criterion().sample_size(20); targets = triangles, tetrahedra, four_dimensions }
criterion_main!(benches);
