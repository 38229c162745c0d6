//! What does a cycle of the interaction loop cost, all stages together, with a linear and with a neo-Hookean tissue?
//!
//! The first 20 mm of the two built-in insertions, without the start of the scene and the settling at the end; throughput
//! counts cycles. What error such a time buys is the question of `stylet bench`, not of this target.
//!
//! ```text
//! cargo bench -p stylet-benches --bench insertion_cycle [-- --quick]
//! ```

mod support;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use stylet_needle::builtin;
use stylet_needle::scene::Scene;
use stylet_needle::simulation::{self, Simulation};

/// Scene and the `mesh.h_ref` it is measured with.
const CASES: [(&str, i64); 4] =
    [("slab2d-insertion", 6), ("slab2d-insertion", 7), ("slab2d-sideways", 6), ("slab2d-sideways", 7)];

fn open(name: &str, h_ref: i64) -> Scene {
    let keys = ["needle.depth=0.02", "needle.speed=0.1"].map(str::to_owned);
    builtin::open(name, &[&keys[..], &[format!("mesh.h_ref={h_ref}")]].concat()).expect("a built-in scene")
}

fn start(scene: &Scene) -> Box<dyn Simulation> {
    simulation::start(scene, 1).expect("a scene that was checked")
}

/// Runs until the needle has come as far as it goes: how many cycles its friction then takes to settle is chance.
fn insert(run: &mut dyn Simulation) {
    while run.progress() < 1.0 {
        run.step().expect("an equilibrium");
    }
}

fn insertions(c: &mut Criterion) {
    let mut group = c.benchmark_group("insertion_cycle");
    for (name, h_ref) in CASES {
        let scene = open(name, h_ref);
        let mut once = start(&scene);
        insert(&mut *once);
        assert_eq!(once.summary(&[]).solver.unconverged_solves, 0, "{name} h{h_ref}");
        group.throughput(Throughput::Elements(once.steps() as u64));
        group.bench_function(BenchmarkId::new(name, format!("h{h_ref}")), |b| {
            b.iter_batched_ref(|| start(&scene), |run| insert(&mut **run), BatchSize::PerIteration);
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = support::criterion().sample_size(10); targets = insertions }
criterion_main!(benches);
