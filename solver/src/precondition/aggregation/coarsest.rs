//! The coarsest level, solved directly.

use super::level::Problem;
use crate::dense::Cholesky;
use crate::precondition::PreconditionerError;

/// A small matrix and its dense Cholesky factor.
#[derive(Clone, Debug, Default)]
pub(super) struct Coarsest<const M: usize> {
    pub problem: Problem<M, M>,
    dense: Vec<f64>,
    factor: Cholesky,
}

impl<const M: usize> Coarsest<M> {
    pub fn dim(&self) -> usize {
        self.problem.a.matrix.n_rows() * M
    }

    /// Factors the present matrix.
    pub fn factor(&mut self) -> Result<(), PreconditionerError> {
        let n = self.dim();
        self.dense.clear();
        self.dense.resize(n * n, 0.0);
        for (i, j, block) in self.problem.a.matrix.blocks() {
            for (k, row) in block.iter().enumerate() {
                self.dense[(i * M + k) * n + j * M..][..M].copy_from_slice(row);
            }
        }
        self.factor
            .factor(n, |i, j| self.dense[i * n + j])
            .map_err(|error| PreconditionerError::Coarse { row: error.row, pivot: error.pivot })
    }

    /// `e ← A⁻¹ f`.
    pub fn solve(&self, f: &[f64], e: &mut [f64]) {
        e.copy_from_slice(f);
        self.factor.solve(e);
    }
}
