//! LU factors of a small dense matrix.

use crate::vector::{axpy, dot};

/// `P A = L U` with rows exchanged for the largest pivot; a second factorisation of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Lu {
    n: usize,
    lu: Vec<f64>,
    /// `exchanges[k]`: the row that came to place `k` in step `k`.
    exchanges: Vec<usize>,
}

impl Lu {
    /// Factors the matrix that `fill` writes, by rows, into zeros. `Err` holds the column and the pivot that is not above `n ε`
    /// times the largest entry.
    pub fn factor(&mut self, n: usize, fill: impl FnOnce(&mut [f64])) -> Result<(), (usize, f64)> {
        self.n = n;
        self.exchanges.clear();
        self.lu.clear();
        self.lu.resize(n * n, 0.0);
        fill(&mut self.lu);
        let largest = self.lu.iter().fold(0.0, |max: f64, v| max.max(v.abs()));
        for k in 0..n {
            let size = |i: &usize| self.lu[i * n + k].abs();
            let best = (k..n).max_by(|i, j| size(i).total_cmp(&size(j)).then(j.cmp(i))).unwrap_or(k);
            let pivot = self.lu[best * n + k];
            if !(pivot.abs() > n as f64 * f64::EPSILON * largest && pivot.is_finite()) {
                return Err((k, pivot));
            }
            self.exchanges.push(best);
            let (above, below) = self.lu.split_at_mut((k + 1) * n);
            let row = &mut above[k * n..];
            if best != k {
                row.swap_with_slice(&mut below[(best - k - 1) * n..][..n]);
            }
            for lower in below.chunks_exact_mut(n) {
                lower[k] /= pivot;
                let factor = lower[k];
                axpy(-factor, &row[k + 1..], &mut lower[k + 1..]);
            }
        }
        Ok(())
    }

    /// `x ← A⁻¹ x`.
    pub fn solve(&self, x: &mut [f64]) {
        let n = self.n;
        for (k, &other) in self.exchanges.iter().enumerate() {
            x.swap(k, other);
        }
        for i in 0..n {
            x[i] -= dot(&self.lu[i * n..i * n + i], &x[..i]);
        }
        for i in (0..n).rev() {
            let row = &self.lu[i * n..(i + 1) * n];
            x[i] = (x[i] - dot(&row[i + 1..], &x[i + 1..])) / row[i];
        }
    }
}
