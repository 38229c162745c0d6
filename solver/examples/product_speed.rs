//! Time of one product `A x` with the stiffness matrix of a tetrahedral cube: dynamic and frozen, `f64` and `f32`, one thread
//! and two, beside scalar CSR of `sprs` and the time that memory needs for the same bytes.
//!
//! ```text
//! cargo run --release -p stylet-solver --example product_speed
//! ```

#[path = "../tests/suite/common/elasticity.rs"]
mod elasticity;

use std::hint::black_box;
use std::time::Instant;
use stylet_solver::LinearOperator;
use stylet_solver::sparse::Frozen;
use stylet_solver::team::Team;

/// Median time of one call, in seconds, over batches of at least a millisecond.
fn seconds(mut f: impl FnMut()) -> f64 {
    let start = Instant::now();
    (0..3).for_each(|_| f());
    let per_batch = (3e-3 / start.elapsed().as_secs_f64().max(1e-7)).ceil() as usize;
    let mut times: Vec<f64> = (0..60)
        .map(|_| {
            let start = Instant::now();
            (0..per_batch).for_each(|_| f());
            start.elapsed().as_secs_f64() / per_batch as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Bytes per second of `a ← b + s c` on arrays that hold `bytes` together.
fn triad(team: &Team, bytes: usize) -> f64 {
    let n = bytes / 24;
    let (b, c, mut a) = (vec![1.0f64; n], vec![2.0f64; n], vec![0.0f64; n]);
    let cut = n / team.size();
    let time = seconds(|| {
        let mut parts: Vec<&mut [f64]> = a.chunks_mut(cut.max(1)).collect();
        team.each(&mut parts, |k, a| {
            let from = k * cut;
            for ((a, b), c) in a.iter_mut().zip(&b[from..]).zip(&c[from..]) {
                *a = b + 3.0 * c;
            }
        });
        black_box(&a);
    });
    (24 * n) as f64 / time
}

fn main() {
    for cells in [13, 36] {
        let system = elasticity::cube(cells, 0.34);
        let a = &system.a;
        let x: Vec<f64> = (0..a.dim()).map(|k| (k % 17) as f64).collect();
        let x32: Vec<f32> = x.iter().map(|&v| v as f32).collect();
        let (mut y, mut y32) = (vec![0.0; x.len()], vec![0.0f32; x.len()]);
        let (frozen, frozen32) = (Frozen::<3>::new(a), Frozen::<3, f32>::new(a));
        println!(
            "{} rows, {} blocks, {} streamed, {:.2} MB in f64, {:.2} MB in f32",
            a.n_rows(),
            a.n_blocks(),
            frozen.streamed_blocks(),
            frozen.bytes_moved() as f64 * 1e-6,
            frozen32.bytes_moved() as f64 * 1e-6
        );
        for threads in [1, 2] {
            let team = Team::new(threads);
            let us = |time: f64| 1e6 * time;
            let dynamic = us(seconds(|| a.apply_on(&team, black_box(&x), &mut y)));
            let f64s = us(seconds(|| frozen.apply_on(&team, black_box(&x), &mut y)));
            let f32s = us(seconds(|| frozen32.apply_on(&team, black_box(&x32), &mut y32)));
            let fused = us(seconds(|| _ = black_box(frozen.apply_dot_on(&team, black_box(&x), &mut y))));
            let (limit, limit32) = (
                1e6 * frozen.bytes_moved() as f64 / triad(&team, frozen.bytes_moved()),
                1e6 * frozen32.bytes_moved() as f64 / triad(&team, frozen32.bytes_moved()),
            );
            println!(
                "  {threads} threads, us: dynamic {dynamic:8.1}  f64 {f64s:8.1} = {:.2} of memory time {limit:8.1}  with dot {fused:8.1}  \
                 f32 {f32s:8.1} = {:.2} of f64, {:.2} of memory time",
                f64s / limit,
                f32s / f64s,
                f32s / limit32
            );
        }
        let (indptr, indices, values) = a.to_scalar_csr().into_parts();
        let scalar = sprs::CsMat::new((x.len(), x.len()), indptr, indices, values);
        let sprs = seconds(|| {
            y.fill(0.0);
            sprs::prod::mul_acc_mat_vec_csr(scalar.view(), black_box(&x[..]), &mut y[..]);
        });
        println!("  sprs {:.1} us", 1e6 * sprs);
    }
}
