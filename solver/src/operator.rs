//! What a solver knows of a matrix.

use crate::vector;

/// A dense `B x B` block, rows first: `block[i][j]` is row `i`, column `j`.
pub type Block<const B: usize> = [[f64; B]; B];

/// A square linear map, known only by what it does to a vector.
pub trait LinearOperator: Sync {
    /// Number of rows, equal to the number of columns.
    fn dim(&self) -> usize;

    /// Overwrites `y` with `A x`; both have length [`dim`](Self::dim).
    fn apply(&self, x: &[f64], y: &mut [f64]);

    /// Overwrites `y` with `A x` and returns `xᵀA x`, summed in the shape of [`vector::dot`].
    fn apply_dot(&self, x: &[f64], y: &mut [f64]) -> f64 {
        self.apply(x, y);
        vector::dot(x, y)
    }
}
