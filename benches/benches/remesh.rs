//! What does a step of the needle remesher cost, on paths of three kinds, and does it depend on the size of the mesh?
//!
//! Throughput counts steps: a needle is driven in and out of a box, by 0.2 mean edges a step.
//!
//! ```text
//! cargo bench -p stylet-benches --bench remesh [-- --quick]
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use stylet_mesh::{
    generate::kuhn_box,
    remesh::{
        CycleSettings, Remesher, drive,
        paths::{PathKind, path},
    },
};

fn cycles(c: &mut Criterion) {
    let mut group = c.benchmark_group("remesh");
    for parts in [7, 13, 20] {
        let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [parts; 3]).expect("a box");
        // Per vertex 3 edges, 3 diagonals of faces and 1 of the part.
        let edge = (3.0 + 3.0 * 2_f64.sqrt() + 3_f64.sqrt()) / 7.0 / parts as f64;
        let settings = CycleSettings { step: 0.2 * edge, measure_angles: false, shallow_steps: 0 };
        for kind in [PathKind::Straight, PathKind::Curved, PathKind::Random] {
            let path = path(kind, [0.0; 3], [1.0; 3], edge, 1);
            let mut cycle = || {
                let report = drive(&mut mesh, &mut Remesher::new(), &path, &settings, |_, _, _, _, _| ());
                report.expect("a path through the box")
            };
            let steps = cycle().steps as u64;
            group.throughput(Throughput::Elements(steps));
            let name = format!("{kind:?}").to_lowercase();
            group.bench_function(BenchmarkId::new(name, 6 * parts * parts * parts), |b| b.iter(&mut cycle));
        }
    }
    group.finish();
}

criterion_group! { name = benches; config = support::criterion().sample_size(20); targets = cycles }
criterion_main!(benches);
