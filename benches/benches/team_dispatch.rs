//! What does it cost to hand a pass to a team, and to cut a sum among its members?
//!
//! `each` calls nothing on one part per member; `dot` is the inner product of vectors of a few lengths, on one thread and two.
//! Throughput counts passes and entries.
//!
//! ```text
//! cargo bench -p stylet-benches --bench team_dispatch [-- --quick]
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_solver::team::Team;

const LENGTHS: [usize; 3] = [1_000, 8_000, 150_000];

fn dispatch(c: &mut Criterion) {
    let mut group = c.benchmark_group("team_dispatch");
    for threads in [1, 2] {
        let team = Team::new(threads);
        let mut parts = vec![0_usize; threads];
        group.throughput(Throughput::Elements(1));
        group.bench_function(BenchmarkId::new("each", threads), |b| {
            b.iter(|| team.each(&mut parts, |k, part| *part = black_box(k)));
        });
        for length in LENGTHS {
            let x = vec![1.0_f64; length];
            group.throughput(Throughput::Elements(length as u64));
            group.bench_function(BenchmarkId::new(format!("dot_{threads}"), length), |b| {
                b.iter(|| black_box(team.dot(black_box(&x), &x)));
            });
        }
    }
    group.finish();
}

criterion_group! { name = benches; config = support::criterion(); targets = dispatch }
criterion_main!(benches);
