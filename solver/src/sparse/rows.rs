//! Rows of blocks, wherever they are kept.

use super::BlockCsr;
use crate::Block;

/// Block rows that can be told apart from what they were before.
pub(crate) trait Rows<const B: usize> {
    fn n_rows(&self) -> usize;

    /// Blocks of all rows.
    fn n_blocks(&self) -> usize;

    /// Columns, ascending, and blocks of a row.
    fn row(&self, row: usize) -> (&[u32], &[Block<B>]);

    /// Changes with the numbers of the row, and is never given to others.
    fn stamp(&self, row: usize) -> u64;
}

impl<const B: usize> Rows<B> for BlockCsr<B> {
    #[inline(always)]
    fn n_rows(&self) -> usize {
        self.n_rows()
    }

    #[inline(always)]
    fn n_blocks(&self) -> usize {
        self.n_blocks()
    }

    #[inline(always)]
    fn row(&self, row: usize) -> (&[u32], &[Block<B>]) {
        self.row(row)
    }

    #[inline(always)]
    fn stamp(&self, row: usize) -> u64 {
        self.stamp(row)
    }
}
