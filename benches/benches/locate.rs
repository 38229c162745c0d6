//! What does the location of a point cost, by the mesh itself, by a locator, by a search in deformed positions; how long
//! does it take to make what is searched; what does a step of a walk cost, and a leaf along a segment?
//!
//! Meshes of half a million triangles and 196,608 tetrahedra, refined from a few start cells (`deep`) or given as start
//! cells (`start`). Throughput counts points, cells walked through (a walk's cells are counted by the segment between its
//! ends), cells along a segment, or cells of the mesh where an index is made.
//!
//! ```text
//! cargo bench -p stylet-benches --bench locate [-- --quick]
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_mesh::{Crossing, MeshChange, SimplexMesh, SpatialIndex, generate::kuhn_box};

/// Points of one round: more than caches hold the surroundings of.
const POINTS: usize = 200_000;
/// Segments, and walks, of one round.
const WAYS: usize = 64;

fn measure<const D: usize, const N: usize>(c: &mut Criterion, kind: &str, mesh: &SimplexMesh<D, N>) {
    let n = mesh.n_cells();
    let points: Vec<[f64; D]> =
        support::spread::<D>(POINTS).into_iter().map(|p| p.map(|x| x / support::SIDE)).collect();
    assert!(mesh.locate_many(&points).iter().all(Option::is_some), "a point was missed");
    let mut group = c.benchmark_group(format!("locate/{D}d/{kind}"));
    let id = |what: &str| BenchmarkId::new(what, n);

    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function(id("mesh"), |b| b.iter(|| points.iter().filter(|&&p| mesh.locate(p).is_some()).count()));
    let locator = mesh.locator();
    group.bench_function(id("locator"), |b| b.iter(|| points.iter().filter(|&&p| locator.locate(p).is_some()).count()));
    group.bench_function(id("many"), |b| b.iter(|| mesh.locate_many(black_box(&points)).len()));
    let rest = mesh.configuration(mesh.points()).expect("positions");
    let mut index = SpatialIndex::new(&rest).expect("finite");
    group.bench_function(id("index"), |b| {
        b.iter(|| points.iter().filter(|&&p| index.locate(&rest, p).is_some()).count());
    });

    // Steps of the size of a cell.
    let step = (n as f64).powf(-1.0 / D as f64);
    let starts: Vec<_> = points.iter().map(|&p| mesh.locate(p).expect("inside").cell).collect();
    let moved: Vec<[f64; D]> = points.iter().map(|p| p.map(|x| (x + step).min(1.0))).collect();
    group.bench_function(id("near"), |b| {
        b.iter(|| starts.iter().zip(&moved).filter(|&(&c, &p)| mesh.locate_near(c, p).is_some()).count());
    });
    group.bench_function(id("near_by_walk"), |b| {
        b.iter(|| starts.iter().zip(&moved).filter(|&(&c, &p)| index.locate_near(&rest, c, p).is_some()).count());
    });

    let mut along: Vec<Crossing> = Vec::new();
    let ways: Vec<_> = points.chunks_exact(2).take(WAYS).map(|way| (way[0], way[1])).collect();
    let mut touched = 0;
    for &(p, q) in &ways {
        mesh.leaves_along(p, q, &mut along);
        touched += along.len();
    }
    group.throughput(Throughput::Elements(touched as u64));
    group.bench_function(id("along"), |b| {
        b.iter(|| ways.iter().for_each(|&(p, q)| mesh.leaves_along(p, q, black_box(&mut along))));
    });
    group.bench_function(id("walk"), |b| {
        b.iter(|| {
            ways.iter().for_each(|&(p, q)| {
                black_box(rest.walk(mesh.locate(p).expect("inside").cell, q));
            })
        });
    });

    group.throughput(Throughput::Elements(n as u64));
    group.bench_function(id("make_locator"), |b| b.iter(|| mesh.locator()));
    group.bench_function(id("make_index"), |b| b.iter(|| SpatialIndex::new(&rest)));
    group.bench_function(id("refit_index"), |b| b.iter(|| index.refit(&rest)));
    group.finish();
}

fn unit_box<const D: usize, const N: usize>(parts: usize) -> SimplexMesh<D, N> {
    kuhn_box([0.0; D], [1.0; D], [parts; D]).expect("a box")
}

fn refined<const D: usize, const N: usize>(size: f64) -> SimplexMesh<D, N> {
    let mut mesh = unit_box(1);
    mesh.refine_everywhere(size, &mut MeshChange::default()).expect("room");
    mesh
}

fn triangles(c: &mut Criterion) {
    measure::<2, 3>(c, "deep", &refined(2_f64.sqrt() / 512.0));
    measure::<2, 3>(c, "start", &unit_box(512));
}

fn tetrahedra(c: &mut Criterion) {
    measure::<3, 4>(c, "deep", &refined(3_f64.sqrt() / 32.0));
    measure::<3, 4>(c, "start", &unit_box(32));
}

criterion_group! { name = benches; config = support::criterion().sample_size(10); targets = triangles, tetrahedra }
criterion_main!(benches);
