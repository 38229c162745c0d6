//! Linear constraints `C x = d` on a vector, few compared with its length.

use crate::subspace::Subspace;

/// `C x = d`: rows of a sparse rectangular matrix over the entries of a whole vector, and their right side.
///
/// What can be seen in one row is checked when it is added. Whether rows depend on each other is found where a method has to
/// know: see [`ConstraintError::Dependent`] and [`ConstraintError::Contradictory`].
#[derive(Clone, Debug, PartialEq)]
pub struct Constraints {
    dim: usize,
    offsets: Vec<usize>,
    cols: Vec<usize>,
    values: Vec<f64>,
    right_side: Vec<f64>,
}

/// Constraints that cannot be imposed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConstraintError {
    /// As many columns as values are needed.
    #[error("constraint {row} has {cols} columns and {values} values")]
    Lengths {
        /// Number of the constraint, from 0.
        row: usize,
        /// Columns given.
        cols: usize,
        /// Values given.
        values: usize,
    },
    /// The vector has no such entry.
    #[error("constraint {row}: column {col} is out of range, the vector has {dim} entries")]
    ColumnOutOfRange {
        /// Number of the constraint.
        row: usize,
        /// The column asked for.
        col: usize,
        /// Length of the vector.
        dim: usize,
    },
    /// Columns of a row must ascend strictly.
    #[error("constraint {row}: column {col} does not come after the one before it")]
    NotAscending {
        /// Number of the constraint.
        row: usize,
        /// The first column out of order.
        col: usize,
    },
    /// A coefficient is NaN or infinite.
    #[error("constraint {row}: the coefficient of column {col} is not finite")]
    NotFinite {
        /// Number of the constraint.
        row: usize,
        /// Column of the coefficient.
        col: usize,
    },
    /// The right side of a row is NaN or infinite.
    #[error("constraint {row}: the right side {value} is not finite")]
    RightSide {
        /// Number of the constraint.
        row: usize,
        /// The right side.
        value: f64,
    },
    /// All coefficients are zero.
    #[error("constraint {row} has no coefficient other than zero")]
    Empty {
        /// Number of the constraint.
        row: usize,
    },
    /// The row is a combination of others on the allowed moves, and says nothing new.
    #[error("constraint {row} depends on the others")]
    Dependent {
        /// Number of the constraint.
        row: usize,
    },
    /// The row's left side is a combination of others on the allowed moves, and its right side is not.
    #[error("constraint {row} contradicts the others: they leave its left side {gap:e} off")]
    Contradictory {
        /// Number of the constraint.
        row: usize,
        /// Right side less what the others imply, in the unit of the right side.
        gap: f64,
    },
    /// There is no sparse factorisation in this build.
    #[error("{rows} constraints are more than the {limit} that are factored densely: build with the feature `direct`")]
    TooMany {
        /// Number of constraints.
        rows: usize,
        /// Number of constraints that are factored densely.
        limit: usize,
    },
    /// Constraints and operator differ in their length.
    #[error("the constraints are for {dim} entries, {what} has {len}")]
    Shape {
        /// What they are compared with.
        what: &'static str,
        /// Entries of the vector that is constrained.
        dim: usize,
        /// Entries that the other side has.
        len: usize,
    },
}

impl Constraints {
    /// No constraints on a vector of `dim` entries.
    #[must_use]
    pub fn new(dim: usize) -> Self {
        Self { dim, offsets: vec![0], cols: Vec::new(), values: Vec::new(), right_side: Vec::new() }
    }

    /// Adds `Σ valuesₖ x[colsₖ] = right_side`; columns ascend strictly.
    ///
    /// # Errors
    /// [`ConstraintError`] says what is wrong with the row, which is then not added.
    pub fn push(&mut self, cols: &[usize], values: &[f64], right_side: f64) -> Result<(), ConstraintError> {
        let row = self.n_rows();
        if cols.len() != values.len() {
            let (cols, values) = (cols.len(), values.len());
            return Err(ConstraintError::Lengths { row, cols, values });
        }
        if let Some(pair) = cols.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(ConstraintError::NotAscending { row, col: pair[1] });
        }
        if let Some(&col) = cols.last()
            && col >= self.dim
        {
            return Err(ConstraintError::ColumnOutOfRange { row, col, dim: self.dim });
        }
        if let Some(k) = values.iter().position(|v| !v.is_finite()) {
            return Err(ConstraintError::NotFinite { row, col: cols[k] });
        }
        if !right_side.is_finite() {
            return Err(ConstraintError::RightSide { row, value: right_side });
        }
        if values.iter().all(|v| *v == 0.0) {
            return Err(ConstraintError::Empty { row });
        }
        self.cols.extend_from_slice(cols);
        self.values.extend_from_slice(values);
        self.right_side.push(right_side);
        self.offsets.push(self.cols.len());
        Ok(())
    }

    /// Removes all rows, and keeps their memory.
    pub fn clear(&mut self) {
        self.offsets.truncate(1);
        self.cols.clear();
        self.values.clear();
        self.right_side.clear();
    }

    /// Entries of the vector that is constrained.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Number of constraints.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.right_side.len()
    }

    /// Columns and coefficients of a constraint.
    ///
    /// # Panics
    /// If there is no such constraint.
    #[must_use]
    pub fn row(&self, row: usize) -> (&[usize], &[f64]) {
        let range = self.offsets[row]..self.offsets[row + 1];
        (&self.cols[range.clone()], &self.values[range])
    }

    /// `d`, one entry per constraint.
    #[must_use]
    pub fn right_side(&self) -> &[f64] {
        &self.right_side
    }

    /// `d`, for writing: numbers that are not finite are refused by the methods.
    pub fn right_side_mut(&mut self) -> &mut [f64] {
        &mut self.right_side
    }

    /// `out ← C x`.
    ///
    /// # Panics
    /// If `x` does not have [`dim`](Self::dim) entries or `out` not [`n_rows`](Self::n_rows).
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        assert_eq!((x.len(), out.len()), (self.dim, self.n_rows()), "vectors do not fit the constraints");
        for (row, out) in out.iter_mut().enumerate() {
            let (cols, values) = self.row(row);
            *out = cols.iter().zip(values).map(|(&col, value)| value * x[col]).sum();
        }
    }

    /// `y ← y + α Cᵀ v`.
    ///
    /// # Panics
    /// As [`apply`](Self::apply).
    pub fn add_transposed(&self, alpha: f64, v: &[f64], y: &mut [f64]) {
        assert_eq!((y.len(), v.len()), (self.dim, self.n_rows()), "vectors do not fit the constraints");
        for (row, v) in v.iter().enumerate() {
            let (cols, values) = self.row(row);
            for (&col, value) in cols.iter().zip(values) {
                y[col] += alpha * v * value;
            }
        }
    }

    /// `out ← d − C x`.
    ///
    /// # Panics
    /// As [`apply`](Self::apply).
    pub fn gap(&self, x: &[f64], out: &mut [f64]) {
        self.apply(x, out);
        for (out, d) in out.iter_mut().zip(&self.right_side) {
            *out = d - *out;
        }
    }

    /// Refuses a subspace of another length, and a right side that is not finite.
    pub(super) fn check<const B: usize>(&self, w: &Subspace<B>) -> Result<(), ConstraintError> {
        if w.dim() != self.dim {
            return Err(ConstraintError::Shape { what: "the subspace", dim: self.dim, len: w.dim() });
        }
        match self.right_side.iter().position(|d| !d.is_finite()) {
            Some(row) => Err(ConstraintError::RightSide { row, value: self.right_side[row] }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_checked_one_by_one() {
        let mut c = Constraints::new(4);
        assert_eq!(c.push(&[0, 2], &[1.0, -2.0], 3.0), Ok(()));
        let row = 1;
        assert_eq!(c.push(&[0], &[1.0, 2.0], 0.0), Err(ConstraintError::Lengths { row, cols: 1, values: 2 }));
        assert_eq!(c.push(&[2, 2], &[1.0, 2.0], 0.0), Err(ConstraintError::NotAscending { row, col: 2 }));
        assert_eq!(c.push(&[1, 4], &[1.0, 2.0], 0.0), Err(ConstraintError::ColumnOutOfRange { row, col: 4, dim: 4 }));
        assert_eq!(c.push(&[1, 3], &[1.0, f64::NAN], 0.0), Err(ConstraintError::NotFinite { row, col: 3 }));
        assert!(matches!(c.push(&[1], &[1.0], f64::NAN), Err(ConstraintError::RightSide { row: 1, .. })));
        assert_eq!(c.push(&[], &[], 0.0), Err(ConstraintError::Empty { row }));
        assert_eq!(c.push(&[1], &[0.0], 0.0), Err(ConstraintError::Empty { row }));
        assert_eq!((c.n_rows(), c.row(0)), (1, (&[0, 2][..], &[1.0, -2.0][..])));
        c.clear();
        assert_eq!(c, Constraints::new(4));
    }

    #[test]
    fn products_are_those_of_the_matrix() {
        let mut c = Constraints::new(3);
        c.push(&[0, 2], &[1.0, -2.0], 3.0).unwrap();
        c.push(&[1], &[4.0], 5.0).unwrap();
        let (mut out, mut y) = ([0.0; 2], [1.0; 3]);
        c.apply(&[1.0, 2.0, 3.0], &mut out);
        assert_eq!(out, [-5.0, 8.0]);
        c.gap(&[1.0, 2.0, 3.0], &mut out);
        assert_eq!(out, [8.0, -3.0]);
        c.add_transposed(2.0, &[1.0, 10.0], &mut y);
        assert_eq!(y, [3.0, 81.0, -3.0]);
    }
}
