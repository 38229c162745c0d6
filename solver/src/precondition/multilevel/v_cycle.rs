//! The multiplicative preconditioner.

use super::MultilevelError;
use super::hierarchy::BisectionHierarchy;
use super::levels::{Level, Levels, product};
use crate::Block;
use crate::precondition::Preconditioner;
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;
use std::sync::{Mutex, PoisonError};

/// Local V-cycle: Gauss-Seidel forwards on the way down, backwards on the way up, on the smoothed nodes of each level; the
/// start mesh is solved exactly.
///
/// See the [module](super) for the method and its cost. Gauss-Seidel is a recurrence: one thread does it.
#[derive(Debug, Default)]
pub struct VCycle<const B: usize> {
    levels: Levels<B>,
    /// Of each smoothed node, its row in the matrix of the level: `starts[k]..starts[k + 1]` of `cols` and `blocks`.
    starts: Vec<usize>,
    cols: Vec<u32>,
    blocks: Vec<Block<B>>,
    scratch: Mutex<Scratch<B>>,
}

#[derive(Debug, Default)]
struct Scratch<const B: usize> {
    r: Vec<[f64; B]>,
    /// Of each smoothed node, the residual before its level is smoothed.
    before: Vec<[f64; B]>,
    /// Of each smoothed node, its correction on the way down.
    corrections: Vec<[f64; B]>,
    coarse: Vec<f64>,
}

impl<const B: usize> VCycle<B> {
    /// The preconditioner of `P_W A P_W`.
    ///
    /// # Errors
    /// [`MultilevelError`] if the sizes differ, or names the node and level at which the matrix is not positive definite.
    pub fn new(
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        hierarchy: &BisectionHierarchy,
    ) -> Result<Self, MultilevelError> {
        let mut this = Self::default();
        this.rebuild(matrix, subspace, hierarchy)?;
        Ok(this)
    }

    /// As [`new`](Self::new), in the memory at hand: O(n).
    ///
    /// # Errors
    /// As [`new`](Self::new); the preconditioner is then of no use until a rebuild succeeds.
    pub fn rebuild(
        &mut self,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        hierarchy: &BisectionHierarchy,
    ) -> Result<(), MultilevelError> {
        let Self { levels, starts, cols, blocks, scratch } = self;
        starts.clear();
        starts.push(0);
        cols.clear();
        blocks.clear();
        levels.rebuild(matrix, subspace, hierarchy, |galerkin, node| {
            for (col, block) in galerkin.row(node) {
                cols.push(col);
                blocks.push(*block);
            }
            starts.push(cols.len());
        })?;
        let scratch = scratch.get_mut().unwrap_or_else(PoisonError::into_inner);
        scratch.r.resize(levels.n_nodes, [0.0; B]);
        scratch.before.resize(levels.smoothed.len(), [0.0; B]);
        scratch.corrections.resize(levels.smoothed.len(), [0.0; B]);
        scratch.coarse.resize(levels.coarse.dim(), 0.0);
        Ok(())
    }

    /// Number of levels: one of all nodes and one for each generation that bisection made.
    #[must_use]
    pub fn n_levels(&self) -> usize {
        self.levels.levels.len()
    }

    /// Blocks of the rows kept, over all levels.
    #[must_use]
    pub fn n_blocks(&self) -> usize {
        self.blocks.len()
    }

    fn row(&self, k: usize) -> impl Iterator<Item = (usize, &Block<B>)> {
        let range = self.starts[k]..self.starts[k + 1];
        self.cols[range.clone()].iter().map(|&col| col as usize).zip(&self.blocks[range])
    }

    /// Gauss-Seidel from zero; `r` becomes the residual. Column `k` is row `k` transposed.
    fn smooth_forwards(&self, level: &Level, r: &mut [[f64; B]], corrections: &mut [[f64; B]]) {
        for k in level.smoothed.clone() {
            let s = &self.levels.smoothed[k];
            let correction = product(&s.inverse, &r[s.node as usize]);
            corrections[k] = correction;
            for (col, block) in self.row(k) {
                for j in 0..B {
                    r[col][j] -= (1..B).fold(block[0][j] * correction[0], |sum, i| sum + block[i][j] * correction[i]);
                }
            }
        }
    }

    /// Gauss-Seidel from `z` in the opposite order, for the right side `before`.
    fn smooth_backwards(&self, level: &Level, before: &[[f64; B]], z: &mut [[f64; B]]) {
        for k in level.smoothed.clone().rev() {
            let s = &self.levels.smoothed[k];
            let mut residual = before[k];
            for (col, block) in self.row(k) {
                let product = product(block, &z[col]);
                for (r, p) in residual.iter_mut().zip(product) {
                    *r -= p;
                }
            }
            let correction = product(&s.inverse, &residual);
            for (z, c) in z[s.node as usize].iter_mut().zip(correction) {
                *z += c;
            }
        }
    }
}

impl<const B: usize> Preconditioner for VCycle<B> {
    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        let levels = &self.levels;
        let n = levels.n_nodes * B;
        assert!(r.len() == n && z.len() == n, "V-cycle of {n} rows");
        let z = z.as_chunks_mut::<B>().0;
        let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let Scratch { r: residual, before, corrections, coarse } = &mut *scratch;

        residual.copy_from_slice(r.as_chunks::<B>().0);
        for level in &levels.levels {
            for k in level.smoothed.clone() {
                before[k] = residual[levels.smoothed[k].node as usize];
            }
            self.smooth_forwards(level, residual, corrections);
            levels.restrict(level, residual);
        }
        z.fill([0.0; B]);
        levels.coarse.solve(residual, z, coarse);
        for level in levels.levels.iter().rev() {
            levels.prolong(level, z);
            for k in level.smoothed.clone() {
                for (z, c) in z[levels.smoothed[k].node as usize].iter_mut().zip(corrections[k]) {
                    *z += c;
                }
            }
            self.smooth_backwards(level, before, z);
        }
    }
}
