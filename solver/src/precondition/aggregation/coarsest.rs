//! The coarsest level, solved directly.

use super::level::Problem;
use crate::dense::Cholesky;
use crate::memory::bytes_of;
use crate::precondition::PreconditionerError;
use crate::precondition::scratch::Scratch;
use crate::real::Real;

/// A small matrix and its dense Cholesky factor.
#[derive(Clone, Debug, Default)]
pub(super) struct Coarsest<const M: usize, T: Real = f64> {
    pub problem: Problem<M, M, T>,
    dense: Vec<f64>,
    factor: Cholesky,
    x: Scratch<Vec<f64>>,
}

impl<const M: usize, T: Real> Coarsest<M, T> {
    pub fn dim(&self) -> usize {
        self.problem.matrix.n_rows() * M
    }

    /// Factors the present matrix.
    pub fn factor(&mut self) -> Result<(), PreconditionerError> {
        let n = self.dim();
        self.x.get_mut().resize(n, 0.0);
        self.dense.clear();
        self.dense.resize(n * n, 0.0);
        for (i, j, block) in self.problem.matrix.blocks() {
            for (k, row) in block.iter().enumerate() {
                self.dense[(i * M + k) * n + j * M..][..M].copy_from_slice(row);
            }
        }
        self.factor
            .factor(n, |i, j| self.dense[i * n + j])
            .map_err(|error| PreconditionerError::Coarse { row: error.row, pivot: error.pivot })
    }

    /// `e ← A⁻¹ f`.
    pub fn solve(&self, f: &[T], e: &mut [T]) {
        let x = &mut *self.x.lock();
        for (x, f) in x.iter_mut().zip(f) {
            *x = f.to_f64();
        }
        self.factor.solve(x);
        for (e, x) in e.iter_mut().zip(x) {
            *e = T::from_f64(*x);
        }
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        // The factor is as large as the matrix that it is made from.
        self.problem.memory_bytes() + 2 * bytes_of(&self.dense) + bytes_of(&self.x.lock())
    }
}
