//! Cholesky factors of small dense matrices, up to a few hundred rows, in memory that is kept.

use crate::vector;

/// `A = L Lᵀ` of a symmetric positive definite matrix. A second factorisation of the same size allocates nothing.
///
/// Larger or sparse matrices are the business of the direct methods.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cholesky {
    n: usize,
    /// Rows of `L`, `n` places each; what lies above the diagonal is not used.
    l: Vec<f64>,
}

/// A matrix that has no Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("pivot {pivot:e} in row {row}: not positive definite")]
pub struct NotPositiveDefinite {
    /// The row at which the factorisation ended.
    pub row: usize,
    /// The pivot that should have been positive.
    pub pivot: f64,
}

impl Cholesky {
    /// An empty factor.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Factors the matrix with the entries `a(i, j)`, `j <= i < n`; only that lower triangle is read.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if a pivot is not above `n ε` times its diagonal entry; the factor is then of no use.
    pub fn factor(&mut self, n: usize, a: impl Fn(usize, usize) -> f64) -> Result<(), NotPositiveDefinite> {
        self.n = n;
        self.l.resize(n * n, 0.0);
        for i in 0..n {
            let (above, row) = self.l.split_at_mut(i * n);
            let row = &mut row[..n];
            for j in 0..i {
                let other = &above[j * n..j * n + j + 1];
                row[j] = (a(i, j) - vector::dot(&row[..j], &other[..j])) / other[j];
            }
            let diagonal = a(i, i);
            let pivot = diagonal - vector::dot(&row[..i], &row[..i]);
            if !(pivot > n as f64 * f64::EPSILON * diagonal.abs() && pivot.is_finite()) {
                return Err(NotPositiveDefinite { row: i, pivot });
            }
            row[i] = pivot.sqrt();
        }
        Ok(())
    }

    /// Number of rows.
    #[must_use]
    pub fn n(&self) -> usize {
        self.n
    }

    /// `x ← A⁻¹ x`.
    ///
    /// # Panics
    /// If `x` does not have [`n`](Self::n) entries.
    pub fn solve(&self, x: &mut [f64]) {
        let n = self.n;
        assert_eq!(x.len(), n, "right side of a factor of {n} rows");
        for i in 0..n {
            let row = &self.l[i * n..i * n + i + 1];
            x[i] = (x[i] - vector::dot(&row[..i], &x[..i])) / row[i];
        }
        for i in (0..n).rev() {
            let row = &self.l[i * n..i * n + i + 1];
            x[i] /= row[i];
            let value = x[i];
            vector::axpy(-value, &row[..i], &mut x[..i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_factor_solves_its_matrix((n, g, x) in (1usize..20).prop_flat_map(|n| {
            let numbers = |len| proptest::collection::vec(-1.0..1.0f64, len);
            (Just(n), numbers(n * n), numbers(n))
        })) {
            let a = |i: usize, j: usize| {
                (0..n).map(|k| g[i * n + k] * g[j * n + k]).sum::<f64>() + 0.5 * f64::from(i == j)
            };
            let mut b: Vec<f64> = (0..n).map(|i| (0..n).map(|j| a(i, j) * x[j]).sum()).collect();
            let mut factor = Cholesky::new();
            factor.factor(n, a).unwrap();
            factor.solve(&mut b);
            for (b, x) in b.iter().zip(&x) {
                prop_assert!((b - x).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_names_its_row() {
        let a = [[1.0, 2.0], [2.0, 1.0]];
        let error = Cholesky::new().factor(2, |i, j| a[i][j]).unwrap_err();
        assert_eq!((error.row, error.pivot), (1, -3.0));
    }
}
