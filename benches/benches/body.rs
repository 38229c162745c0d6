//! What do forces, a linearisation and the safe step cost per element, and does following refinements cost what they
//! touch or what the body holds?
//!
//! Plane stress; a linear body has no linearisation and no safe step, and its gradient is a matrix product. Throughput
//! counts elements, those born in `apply_change`, of six refinements in a row.
//!
//! ```text
//! cargo bench -p stylet-benches --bench body [-- --quick] [-- neo_hookean]
//! ```

mod support;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_mesh::{MeshChange, SimplexMesh};
use stylet_physics::body::Body;
use stylet_physics::material::Hyperelastic;
use stylet_solver::energy::Energy;
use support::SIDE;

/// Refinements in a row, as the tip of a needle makes them.
const REFINEMENTS: usize = 6;
/// Parts along the side: 512 to 131 072 elements.
const SQUARES: [usize; 4] = [16, 64, 128, 256];

fn measure<M: Hyperelastic<2>>(c: &mut Criterion, material: &M, name: &str) {
    let mut group = c.benchmark_group(format!("body/{name}"));
    for n in SQUARES {
        let mesh = support::cube::<2, 3>(n);
        let mut body = Body::new(&mesh, material.clone(), support::TISSUE.2).expect("a body");
        let (u, p) = (support::smooth(&mesh, 0.05), support::smooth(&mesh, -0.02));
        let mut g = vec![0.0; u.len()];
        body.linearize(&u);
        let elements = body.n_elements();

        group.throughput(Throughput::Elements(elements as u64));
        group.bench_function(BenchmarkId::new("gradient", elements), |b| {
            b.iter(|| body.gradient(black_box(&u), black_box(&mut g)));
        });
        if !M::IS_LINEAR {
            group.bench_function(BenchmarkId::new("value", elements), |b| b.iter(|| body.value(black_box(&u))));
            group.bench_function(BenchmarkId::new("linearize", elements), |b| b.iter(|| body.linearize(black_box(&u))));
            for (step, limit) in [("max_step_1", 1.0), ("max_step_unlimited", f64::INFINITY)] {
                assert!(body.max_step(&u, &p, limit) > 0.9, "the step starts inverted");
                group.bench_function(BenchmarkId::new(step, elements), |b| {
                    b.iter(|| body.max_step(black_box(&u), black_box(&p), limit));
                });
            }
        }

        // A clone has no room to grow: the first change copies its arrays, so that those that are timed need not.
        let size = 0.26 * 2f64.sqrt() * SIDE / n as f64;
        let mut steps = vec![refine(&mesh, [0.913 * SIDE; 2], size)];
        for k in 0..REFINEMENTS {
            let next = refine(&steps[k].0, [(0.31 + 1.5 * k as f64 / n as f64) * SIDE, 0.38 * SIDE], size);
            steps.push(next);
        }
        let warm = || {
            let mut body = body.clone();
            body.apply_change(&steps[0].0, &steps[0].1).expect("a change of this mesh");
            body
        };
        let follow = |body: &mut Body<2, 3, M>| {
            for (mesh, change) in &steps[1..] {
                body.apply_change(mesh, change).expect("a change of this mesh");
            }
        };
        group.throughput(Throughput::Elements(steps[1..].iter().map(|(_, change)| change.born.len() as u64).sum()));
        group.bench_function(BenchmarkId::new("apply_change", elements), |b| {
            b.iter_batched_ref(warm, follow, BatchSize::PerIteration);
        });
    }
    group.finish();
}

/// The mesh refined around a point, and what that changed.
fn refine(mesh: &SimplexMesh<2, 3>, at: [f64; 2], size: f64) -> (SimplexMesh<2, 3>, MeshChange) {
    let (mut mesh, mut change) = (mesh.clone(), MeshChange::default());
    mesh.refine_around(at, size, &mut change).expect("room");
    assert!(!change.is_empty(), "nothing to refine");
    (mesh, change)
}

fn linear(c: &mut Criterion) {
    measure(c, &support::linear_slab(), "linear");
}

fn neo_hookean(c: &mut Criterion) {
    measure(c, &support::neo_hookean_slab(), "neo_hookean");
}

criterion_group! { name = benches; config = support::criterion().sample_size(20); targets = linear, neo_hookean }
criterion_main!(benches);
