//! What do forces, a full linearisation and a lazy one of a tissue in 3D cost, in products with its matrix?
//!
//! The cube of the prostate's size, 13,182 tetrahedra, on one thread and on two. `product` is the yardstick: forces are to
//! take 20 of them, a full assembly 60, a lazy linearisation after a small motion 25 with its forces.
//!
//! ```text
//! cargo bench -p stylet-benches --bench body3d [-- --quick]
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_physics::body::{Body, LazyRule};
use stylet_physics::material::{Corotated, Hyperelastic, NeoHookean};
use stylet_solver::LinearOperator;
use stylet_solver::energy::Energy;
use stylet_solver::sparse::Frozen;
use stylet_solver::team::Team;

/// Cells along the side.
const CELLS: usize = 13;

fn measure<M: Hyperelastic<3>>(c: &mut Criterion, material: M, name: &str) {
    let mut group = c.benchmark_group(format!("body3d/{name}"));
    let mesh = support::cube::<3, 4>(CELLS);
    let u = support::smooth(&mesh, 0.05);
    // A needle's worth of motion: strains of some per cent around a point.
    let bump = |x: &[f64; 3]| 4e-4 * (-x.iter().map(|x| ((x - 0.05) / 0.012).powi(2)).sum::<f64>()).exp();
    let moved: Vec<f64> =
        mesh.points().iter().zip(u.as_chunks::<3>().0).flat_map(|(x, u)| [u[0] + bump(x), u[1], u[2]]).collect();
    let mut out = vec![0.0; u.len()];
    for threads in [1, 2] {
        let team = Team::new(threads);
        let mut body = Body::new(&mesh, material.clone(), 1.0).expect("a body");
        body.set_threads(threads);
        body.linearize(&u);
        let frozen = Frozen::<3>::new(body.stiffness());
        group.throughput(Throughput::Elements(body.n_elements() as u64));
        group.bench_function(BenchmarkId::new("product", threads), |b| {
            b.iter(|| frozen.apply_on(&team, black_box(&u), black_box(&mut out)));
        });
        group.bench_function(BenchmarkId::new("forces", threads), |b| {
            b.iter(|| body.gradient(black_box(&u), black_box(&mut out)));
        });
        group.bench_function(BenchmarkId::new("value", threads), |b| b.iter(|| body.value(black_box(&u))));
        group.bench_function(BenchmarkId::new("linearize", threads), |b| b.iter(|| body.linearize(black_box(&u))));
        for (name, rule) in [
            ("lazy_strain", LazyRule::Strain(0.003)),
            ("lazy_stiffness", LazyRule::Stiffness(2.0)),
            ("lazy_rotation", LazyRule::Rotation(0.5)),
        ] {
            body.set_lazy_rule(rule);
            let mut there = false;
            group.bench_function(BenchmarkId::new(name, threads), |b| {
                b.iter(|| {
                    there = !there;
                    body.linearize(black_box(if there { &moved } else { &u }));
                });
            });
            println!("{name}: {} of {} elements", body.elements_updated(), body.n_elements());
            body.set_lazy_rule(LazyRule::Always);
        }
    }
    group.finish();
}

fn neo_hookean(c: &mut Criterion) {
    measure(c, NeoHookean::from_young_poisson(support::TISSUE.0, 0.45).expect("a material"), "neo_hookean");
}

fn corotated(c: &mut Criterion) {
    measure(c, Corotated::from_young_poisson(support::TISSUE.0, 0.45).expect("a material"), "corotated");
}

criterion_group! { name = benches; config = support::criterion().sample_size(20); targets = neo_hookean, corotated }
criterion_main!(benches);
