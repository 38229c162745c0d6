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
