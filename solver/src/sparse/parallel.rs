//! Rows spread over threads. Rows do not share sums, so the bits are those of the serial product.

use super::BlockCsr;

/// Blocks below which waking a second thread costs more than it saves: the hand-over takes about 10 µs, this many 2x2
/// blocks about 40 µs.
pub(super) const CROSSOVER_BLOCKS: usize = 60_000;

/// `y ← A x` on as many threads as the matrix was given.
pub(super) fn apply<const B: usize>(a: &BlockCsr<B>, x: &[f64], y: &mut [f64]) {
    apply_range(a, 0, x, y, a.threads);
}

fn apply_range<const B: usize>(a: &BlockCsr<B>, first: usize, x: &[f64], y: &mut [f64], parts: usize) {
    let n_rows = y.len() / B;
    if parts <= 1 || n_rows < 2 {
        return a.apply_rows(first, x, y);
    }
    let left_parts = parts / 2;
    let left_rows = n_rows * left_parts / parts;
    let (left, right) = y.split_at_mut(left_rows * B);
    rayon::join(
        || apply_range(a, first, x, left, left_parts),
        || apply_range(a, first + left_rows, x, right, parts - left_parts),
    );
}
