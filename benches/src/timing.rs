//! Times that mean something on a shared machine: medians, and pairs measured in turns.

use std::time::Instant;
use stylet_solver::LinearOperator;
use stylet_solver::sparse::BlockCsr;

/// The median; NaN of nothing.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

/// Seconds of one product with a matrix, ours and that of `sprs` on the same numbers.
#[derive(Clone, Copy, Debug)]
pub struct Product {
    /// Ours.
    pub ours: f64,
    /// That of `sprs`.
    pub sprs: f64,
}

/// Times one product, the median of `batches` batches of about 20 microseconds or one product each.
pub fn product_seconds(matrix: &BlockCsr<2>, batches: usize) -> f64 {
    let n = matrix.dim();
    let x = input(n);
    let mut y = vec![0.0; n];
    let mut work = || {
        matrix.apply(std::hint::black_box(&x), &mut y);
        std::hint::black_box(&mut y);
    };
    batch(&mut work, batches)
}

fn input(n: usize) -> Vec<f64> {
    (0..n).map(|i| 1.0 + 1e-3 * (i % 7) as f64).collect()
}

fn batch(work: &mut dyn FnMut(), batches: usize) -> f64 {
    let since = Instant::now();
    work();
    work();
    let once = since.elapsed().as_secs_f64() / 2.0;
    let repeats = (20e-6 / once.max(1e-9)).ceil().clamp(1.0, 1e4) as usize;
    let mut times: Vec<f64> = (0..batches)
        .map(|_| {
            let since = Instant::now();
            (0..repeats).for_each(|_| work());
            since.elapsed().as_secs_f64() / repeats as f64
        })
        .collect();
    median(&mut times)
}

/// Times of several works done in turns, so that what disturbs the machine disturbs all of them: one time per work and turn,
/// after a warm-up. A work is repeated until it fills `fill` seconds.
pub(crate) fn in_turns(turns: usize, fill: f64, works: &mut [&mut dyn FnMut()]) -> Vec<Vec<f64>> {
    let repeats: Vec<usize> = works
        .iter_mut()
        .map(|work| {
            work();
            let since = Instant::now();
            work();
            (fill / since.elapsed().as_secs_f64().max(1e-9)).ceil().clamp(1.0, 1e4) as usize
        })
        .collect();
    let mut times = vec![Vec::with_capacity(turns); works.len()];
    for _ in 0..turns {
        for ((work, &repeats), times) in works.iter_mut().zip(&repeats).zip(&mut times) {
            let since = Instant::now();
            (0..repeats).for_each(|_| work());
            times.push(since.elapsed().as_secs_f64() / repeats as f64);
        }
    }
    times
}

/// Median of the ratios of times that were taken in turns.
pub(crate) fn ratio(above: &[f64], below: &[f64]) -> f64 {
    let mut ratios: Vec<f64> = above.iter().zip(below).map(|(above, below)| above / below).collect();
    median(&mut ratios)
}

impl Product {
    /// Times both products in turns, the median of `turns`.
    pub fn of(matrix: &BlockCsr<2>, turns: usize) -> Self {
        let n = matrix.dim();
        let (indptr, indices, values) = matrix.to_scalar_csr().into_parts();
        let scalar = sprs::CsMat::new((n, n), indptr, indices, values);
        let x = input(n);
        let mut y = vec![0.0; n];
        let mut z = vec![0.0; n];
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for _ in 0..turns {
            ours.push(batch(
                &mut || {
                    matrix.apply(std::hint::black_box(&x), &mut y);
                    std::hint::black_box(&mut y);
                },
                1,
            ));
            theirs.push(batch(
                &mut || {
                    // It adds to its output, so that must be cleared, as our product does.
                    z.fill(0.0);
                    sprs::prod::mul_acc_mat_vec_csr(scalar.view(), std::hint::black_box(&x[..]), &mut z[..]);
                    std::hint::black_box(&mut z);
                },
                1,
            ));
        }
        Self { ours: median(&mut ours), sprs: median(&mut theirs) }
    }
}
