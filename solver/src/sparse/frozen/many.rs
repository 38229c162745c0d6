//! Products with several vectors at once: the matrix is read once for eight of them.

use super::{Frozen, NONE};
use crate::real::Real;
use crate::simd;
use crate::team::Team;
use crate::vector::CHUNK;
use std::ops::Range;

impl<const B: usize, T: Real> Frozen<B, T> {
    /// `y ← A x` for `k` interleaved vectors: entry `i` of vector `c` is `x[i * k + c]`.
    pub(super) fn multiply_many(&self, team: &Team, k: usize, x: &[T], y: &mut [T]) {
        let n = self.n_rows * B;
        assert!(x.len() == n * k && y.len() == n * k, "{k} vectors for a matrix of {n} rows");
        let mut rest = y;
        let mut parts: [(Range<usize>, &mut [T]); Team::MAX_MEMBERS] = std::array::from_fn(|member| {
            let share = if member < team.size() { team.share(n, member) } else { 0..0 };
            let (part, after) = std::mem::take(&mut rest).split_at_mut(share.len() * k);
            rest = after;
            (share, part)
        });
        team.each(&mut parts[..team.size()], |_, (share, y)| {
            simd::run(
                #[inline(always)]
                || {
                    let mut first = 0;
                    while first < k {
                        first += match k - first {
                            8.. => self.columns::<8>(k, first, share.clone(), x, y),
                            4.. => self.columns::<4>(k, first, share.clone(), x, y),
                            _ => self.columns::<1>(k, first, share.clone(), x, y),
                        };
                    }
                },
            );
        });
    }

    /// The product of vectors `first..first + W`, for the rows that hold the entries `share`; returns `W`.
    #[inline(always)]
    fn columns<const W: usize>(&self, k: usize, first: usize, share: Range<usize>, x: &[T], y: &mut [T]) -> usize {
        let windows = share.start / CHUNK..share.end.div_ceil(CHUNK);
        let slices = windows.start * Self::SLICES_PER_WINDOW..windows.end * Self::SLICES_PER_WINDOW;
        for slice in &self.slices[slices] {
            let range = slice.slot.range();
            let cols = &self.cols[range.start * T::LANES..range.end * T::LANES];
            for (lane, &row) in slice.rows[..T::LANES].iter().enumerate() {
                if row == NONE {
                    continue;
                }
                // A sum for each place of a block, as in the product with one vector.
                let mut sums = [[[T::ZERO; W]; B]; B];
                for (cols, block) in cols.chunks_exact(T::LANES).zip(&self.vals[range.clone()]) {
                    let node = cols[lane] as usize * B;
                    for j in 0..B {
                        let at = (node + j) * k + first;
                        let x: &[T; W] = x[at..at + W].try_into().expect("of this length");
                        for i in 0..B {
                            let a = block[i][j][lane];
                            (0..W).for_each(|c| sums[i][j][c] += a * x[c]);
                        }
                    }
                }
                for i in 0..B {
                    let at = (row as usize * B + i - share.start) * k + first;
                    for c in 0..W {
                        y[at + c] = (1..B).fold(sums[i][0][c], |sum, j| sum + sums[i][j][c]);
                    }
                }
            }
        }
        W
    }
}
