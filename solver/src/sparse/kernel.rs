//! The product `A x`, the hot kernel of every solver here.
//!
//! A row keeps `B²` running sums, one per place of a block, and adds them up at its end: for `B = 2` one block is one
//! four-lane multiplication and addition. The order of operations is written out, so every SIMD level gives the same bits.

use super::BlockCsr;
use super::arena::Slot;
use crate::simd;
use crate::team::Team;
use crate::vector::{self, CHUNK};
use crate::{Block, LinearOperator};
#[cfg(target_arch = "x86_64")]
use {
    pulp::bytemuck::{cast, cast_slice},
    pulp::x86::V3,
    pulp::{NullaryFnOnce, f64x4},
    std::arch::x86_64::__m128d,
};

/// Products with fewer numbers in the matrix are left to the calling thread.
pub(super) const CROSSOVER: usize = 20_000;

impl<const B: usize> LinearOperator for BlockCsr<B> {
    fn dim(&self) -> usize {
        self.n_rows() * B
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.check_lengths(x, y);
        self.apply_rows(0, x, y);
    }

    fn apply_dot(&self, x: &[f64], y: &mut [f64]) -> f64 {
        self.check_lengths(x, y);
        self.apply(x, y);
        vector::dot(x, y)
    }

    fn apply_on(&self, team: &Team, x: &[f64], y: &mut [f64]) {
        self.check_lengths(x, y);
        if team.size() == 1 || self.n_blocks() * B * B < CROSSOVER || !CHUNK.is_multiple_of(B) {
            return self.apply_rows(0, x, y);
        }
        let n = y.len();
        let mut parts = team.split(y);
        team.each(&mut parts[..team.size()], |member, y| self.apply_rows(team.share(n, member).start / B, x, y));
    }
}

impl<const B: usize> BlockCsr<B> {
    fn check_lengths(&self, x: &[f64], y: &[f64]) {
        let n = self.dim();
        assert!(x.len() == n && y.len() == n, "matrix of {n} rows applied to {} and {} entries", x.len(), y.len());
    }

    /// `y ← A x` for the rows from `first` on, as many as `y` has blocks.
    pub(super) fn apply_rows(&self, first: usize, x: &[f64], y: &mut [f64]) {
        let rows = self.rows(first);
        #[cfg(target_arch = "x86_64")]
        if B == 2
            && let Some(simd) = V3::try_new()
        {
            return simd.vectorize(Product2x2 { simd, rows, x, y });
        }
        simd::run(
            #[inline(always)]
            || rows.product(x, y),
        );
    }

    fn rows(&self, first: usize) -> Rows<'_, B> {
        Rows { slots: &self.slots[first..], cols: &self.cols, vals: &self.vals }
    }
}

/// What runs inside [`V3::vectorize`]: a named type, because a closure here was not inlined into it.
#[cfg(target_arch = "x86_64")]
struct Product2x2<'a, const B: usize> {
    simd: V3,
    rows: Rows<'a, B>,
    x: &'a [f64],
    y: &'a mut [f64],
}

#[cfg(target_arch = "x86_64")]
impl<const B: usize> NullaryFnOnce for Product2x2<'_, B> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.rows.product_2x2(self.simd, self.x, self.y);
    }
}

/// Consecutive rows of a matrix.
#[derive(Clone, Copy)]
struct Rows<'a, const B: usize> {
    slots: &'a [Slot],
    cols: &'a [u32],
    vals: &'a [Block<B>],
}

impl<const B: usize> Rows<'_, B> {
    /// `y ← A x` for any block size and processor.
    #[inline(always)]
    fn product(self, x: &[f64], y: &mut [f64]) {
        let x = x.as_chunks::<B>().0;
        for (slot, y) in self.slots.iter().zip(y.as_chunks_mut::<B>().0) {
            let range = slot.range();
            let mut sums = [[0.0; B]; B];
            for (&col, block) in self.cols[range.clone()].iter().zip(&self.vals[range]) {
                let x = x[col as usize];
                for i in 0..B {
                    for j in 0..B {
                        sums[i][j] += block[i][j] * x[j];
                    }
                }
            }
            *y = sums.map(|row| row[1..].iter().fold(row[0], |sum, term| sum + term));
        }
    }

    /// The same for 2x2 blocks, four lanes at a time: compilers do not find the broadcast of `x` by themselves.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn product_2x2(self, simd: V3, x: &[f64], y: &mut [f64]) {
        let vals: &[f64x4] = cast_slice(self.vals.as_flattened().as_flattened());
        let x = x.as_chunks::<2>().0;
        for (slot, y) in self.slots.iter().zip(y.as_chunks_mut::<2>().0) {
            let range = slot.range();
            let mut sums = simd.splat_f64x4(0.0);
            for (&col, &block) in self.cols[range.clone()].iter().zip(&vals[range]) {
                let pair: __m128d = cast(x[col as usize]); // by value: `x` is aligned for f64 only
                let x = cast(simd.avx._mm256_broadcast_pd(&pair));
                sums = simd.add_f64x4(sums, simd.mul_f64x4(block, x));
            }
            let sums: [f64; 4] = cast(sums);
            *y = [sums[0] + sums[1], sums[2] + sums[3]];
        }
    }
}
