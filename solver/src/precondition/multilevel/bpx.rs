//! The additive preconditioner.

use super::MultilevelError;
use super::hierarchy::BisectionHierarchy;
use super::levels::{Level, Levels, product};
use crate::precondition::Preconditioner;
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::CHUNK;
use std::sync::{Mutex, PoisonError};

/// Smoothed nodes of a level below which waking the team costs more than it saves.
const CROSSOVER: usize = 4096;

/// Local BPX: the sum of all one-node corrections of all levels, and of the exact solution on the start mesh.
///
/// See the [module](super) for the method and its cost.
#[derive(Debug, Default)]
pub struct Bpx<const B: usize> {
    levels: Levels<B>,
    scratch: Mutex<Scratch<B>>,
}

#[derive(Debug, Default)]
struct Scratch<const B: usize> {
    r: Vec<[f64; B]>,
    /// The correction of each smoothed node.
    corrections: Vec<f64>,
    coarse: Vec<f64>,
}

impl<const B: usize> Bpx<B> {
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
        self.levels.rebuild(matrix, subspace, hierarchy, |_, _| {})?;
        let scratch = self.scratch.get_mut().unwrap_or_else(PoisonError::into_inner);
        scratch.r.resize(self.levels.n_nodes, [0.0; B]);
        scratch.corrections.resize(self.levels.smoothed.len() * B, 0.0);
        scratch.coarse.resize(self.levels.coarse.dim(), 0.0);
        Ok(())
    }

    /// Number of levels: one of all nodes and one for each generation that bisection made.
    #[must_use]
    pub fn n_levels(&self) -> usize {
        self.levels.levels.len()
    }

    /// One-node corrections in an application, over all levels: at most four per node.
    #[must_use]
    pub fn n_corrections(&self) -> usize {
        self.levels.smoothed.len()
    }

    /// The corrections of one level.
    fn smooth(&self, team: &Team, level: &Level, r: &[[f64; B]], corrections: &mut [f64]) {
        let smoothed = &self.levels.smoothed[level.smoothed.clone()];
        let corrections = &mut corrections[level.smoothed.start * B..level.smoothed.end * B];
        let pass = |first: usize, part: &mut [f64]| {
            let part = part.as_chunks_mut::<B>().0;
            for (correction, s) in part.iter_mut().zip(&smoothed[first..]) {
                *correction = product(&s.inverse, &r[s.node as usize]);
            }
        };
        if smoothed.len() < CROSSOVER || team.size() == 1 || !CHUNK.is_multiple_of(B) {
            return pass(0, corrections);
        }
        let len = corrections.len();
        let mut parts = team.split(corrections);
        team.each(&mut parts[..team.size()], |member, part| pass(team.share(len, member).start / B, part));
    }
}

impl<const B: usize> Preconditioner for Bpx<B> {
    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.apply_on(&Team::serial(), r, z);
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        let levels = &self.levels;
        let n = levels.n_nodes * B;
        assert!(r.len() == n && z.len() == n, "BPX of {n} rows");
        let z = z.as_chunks_mut::<B>().0;
        let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let Scratch { r: coarser, corrections, coarse } = &mut *scratch;

        coarser.copy_from_slice(r.as_chunks::<B>().0);
        for level in &levels.levels {
            self.smooth(team, level, coarser, corrections);
            levels.restrict(level, coarser);
        }
        z.fill([0.0; B]);
        levels.coarse.solve(coarser, z, coarse);
        for level in levels.levels.iter().rev() {
            levels.prolong(level, z);
            let corrections = corrections.as_chunks::<B>().0;
            for (s, correction) in
                levels.smoothed[level.smoothed.clone()].iter().zip(&corrections[level.smoothed.clone()])
            {
                for (z, c) in z[s.node as usize].iter_mut().zip(correction) {
                    *z += c;
                }
            }
        }
    }
}
