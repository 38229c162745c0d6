//! Cholesky factors of small matrices whose rows begin late: bands, arrows, what a chain of bodies makes.

use crate::dense::NotPositiveDefinite;
use crate::vector;

/// A symmetric positive definite matrix in the envelope of its lower triangle, and its Cholesky factor in the same place.
///
/// Row `i` holds the columns from its first one to the diagonal; the factor fills the envelope and nothing beyond. Memory is that
/// of the largest matrix so far.
///
/// Source: George & Liu, *Computer Solution of Large Sparse Positive Definite Systems* (1981), chapter 4.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skyline {
    /// By row, its first column and where that is in `values`.
    rows: Vec<(usize, usize)>,
    values: Vec<f64>,
}

impl Skyline {
    /// An empty matrix.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A zero matrix whose row `i` begins at column `first(i)`.
    ///
    /// # Panics
    /// If a row begins behind its diagonal.
    pub fn reset(&mut self, n: usize, first: impl Fn(usize) -> usize) {
        self.rows.clear();
        let mut end = 0;
        for i in 0..n {
            let column = first(i);
            assert!(column <= i, "row {i} begins at column {column}");
            self.rows.push((column, end));
            end += i - column + 1;
        }
        self.values.clear();
        self.values.resize(end, 0.0);
    }

    /// Number of rows.
    #[must_use]
    pub fn n(&self) -> usize {
        self.rows.len()
    }

    /// Entries of the envelope.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether it has no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Adds to entry `(i, j)`, `j <= i`, before the matrix is factored.
    ///
    /// # Panics
    /// If the entry lies outside the envelope.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (first, at) = self.rows[i];
        assert!(first <= j && j <= i, "entry ({i}, {j}) of a row from {first} on");
        self.values[at + j - first] += value;
    }

    /// Replaces the matrix by its factor.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if a pivot is not above `n ε` times its diagonal entry; what is left is of no use.
    pub fn factor(&mut self) -> Result<(), NotPositiveDefinite> {
        let least = self.n() as f64 * f64::EPSILON;
        for i in 0..self.rows.len() {
            let (first, at) = self.rows[i];
            let (above, row) = self.values.split_at_mut(at);
            let row = &mut row[..=i - first];
            for j in first..i {
                let (other_first, other_at) = self.rows[j];
                let other = &above[other_at..=other_at + j - other_first];
                let from = first.max(other_first);
                let sum = vector::dot(&row[from - first..j - first], &other[from - other_first..j - other_first]);
                row[j - first] = (row[j - first] - sum) / other[j - other_first];
            }
            let diagonal = row[i - first];
            let pivot = diagonal - vector::dot(&row[..i - first], &row[..i - first]);
            if !(pivot > least * diagonal.abs() && pivot.is_finite()) {
                return Err(NotPositiveDefinite { row: i, pivot });
            }
            row[i - first] = pivot.sqrt();
        }
        Ok(())
    }

    /// `x ← A⁻¹ x`, once factored.
    ///
    /// # Panics
    /// If `x` does not have [`n`](Self::n) entries.
    pub fn solve(&self, x: &mut [f64]) {
        assert_eq!(x.len(), self.n(), "right side of a factor");
        for (i, &(first, at)) in self.rows.iter().enumerate() {
            let row = &self.values[at..=at + i - first];
            x[i] = (x[i] - vector::dot(&row[..i - first], &x[first..i])) / row[i - first];
        }
        for (i, &(first, at)) in self.rows.iter().enumerate().rev() {
            let row = &self.values[at..=at + i - first];
            x[i] /= row[i - first];
            let value = x[i];
            vector::axpy(-value, &row[..i - first], &mut x[first..i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::Cholesky;
    use proptest::prelude::*;

    proptest! {
        /// The same solution as that of a dense factor, whatever the envelope.
        #[test]
        fn a_factor_solves_its_matrix((n, entries, b, reach) in (1usize..25).prop_flat_map(|n| {
            let numbers = |len| proptest::collection::vec(-1.0..1.0f64, len);
            (Just(n), numbers(n * n), numbers(n), proptest::collection::vec(0usize..6, n))
        })) {
            let first = |i: usize| i.saturating_sub(reach[i]);
            let entry = |i: usize, j: usize| match i == j {
                true => 8.0 + entries[i * n + i],
                false if j >= first(i) => entries[i * n + j],
                false => 0.0,
            };
            let mut a = Skyline::new();
            a.reset(n, first);
            for i in 0..n {
                for j in first(i)..=i {
                    a.add(i, j, entry(i, j));
                }
            }
            a.factor().unwrap();
            let (mut x, mut exact) = (b.clone(), b);
            a.solve(&mut x);
            let mut dense = Cholesky::new();
            dense.factor(n, entry).unwrap();
            dense.solve(&mut exact);
            for (x, exact) in x.iter().zip(&exact) {
                prop_assert!((x - exact).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_names_its_row() {
        let mut a = Skyline::new();
        a.reset(3, |i| i.saturating_sub(1));
        for (i, j, value) in [(0, 0, 1.0), (1, 1, 1.0), (1, 0, 2.0), (2, 2, 1.0)] {
            a.add(i, j, value);
        }
        let error = a.factor().unwrap_err();
        assert_eq!((error.row, error.pivot), (1, -3.0));
    }
}
