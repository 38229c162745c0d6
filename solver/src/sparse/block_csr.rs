//! Storage and editing of the matrix; products are in [`kernel`](super::kernel).

mod parts;

use super::arena::{Arena, Slot};
use crate::Block;
use crate::memory::bytes_of;
pub use parts::RowsMut;
use std::sync::atomic::{AtomicU64, Ordering};

/// Slot sizes are multiples of this.
const GRAIN: usize = 4;

/// Number of the last write to any row of any matrix: rows with the same stamp hold the same numbers, in clones too.
static WRITES: AtomicU64 = AtomicU64::new(0);

/// A square matrix of dense `B x B` blocks, stored by rows, whose rows are rewritten one at a time.
///
/// Columns of a row ascend, so that two matrices with the same rows give the same bits in every product, however the
/// rows came about. Rows live in slots of one array (see the [module](super)); a row that outgrows its slot moves, no
/// other row does, and there is no compaction.
#[derive(Clone, Debug, Default)]
pub struct BlockCsr<const B: usize> {
    pub(super) slots: Vec<Slot>,
    pub(super) cols: Vec<u32>,
    pub(super) vals: Vec<Block<B>>,
    arena: Arena<GRAIN>,
    /// By row, the number of its last write; zero for an empty row.
    stamps: Vec<u64>,
    n_blocks: usize,
    rows_written: u64,
}

/// An edit that would not leave a valid matrix; the matrix is then unchanged.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SparseError {
    /// There is no such row.
    #[error("row {row} is out of range: there are {n_rows} block rows")]
    RowOutOfRange {
        /// The row asked for.
        row: usize,
        /// Number of block rows.
        n_rows: usize,
    },
    /// A row refers to a column that does not exist.
    #[error("column {col} of row {row} is out of range: there are {n_rows} block columns")]
    ColumnOutOfRange {
        /// Block row.
        row: usize,
        /// Block column.
        col: usize,
        /// Number of block columns.
        n_rows: usize,
    },
    /// Columns of a row do not ascend strictly.
    #[error("columns of row {row} do not ascend at position {position}")]
    NotAscending {
        /// Block row.
        row: usize,
        /// Index of the first column that is not above its predecessor.
        position: usize,
    },
    /// Different numbers of columns and blocks.
    #[error("row {row} has {cols} columns but {blocks} blocks")]
    Shape {
        /// Block row.
        row: usize,
        /// Number of column indices given.
        cols: usize,
        /// Number of blocks given.
        blocks: usize,
    },
    /// A block holds NaN or an infinity.
    #[error("block ({row}, {col}) holds a number that is not finite")]
    NotFinite {
        /// Block row.
        row: usize,
        /// Block column.
        col: usize,
    },
    /// The block is not part of the pattern.
    #[error("block ({row}, {col}) is not stored")]
    NotStored {
        /// Block row.
        row: usize,
        /// Block column.
        col: usize,
    },
    /// Rows that are not empty, or to which another row refers, cannot be dropped.
    #[error("cannot shrink to {n_rows} rows: row {row} still refers to column {col}")]
    InUse {
        /// Number of rows asked for.
        n_rows: usize,
        /// A row that stands in the way.
        row: usize,
        /// One of its columns.
        col: usize,
    },
    /// More rows or blocks than 32-bit indices can name.
    #[error("{0} rows or blocks are more than 32-bit indices can name")]
    TooLarge(usize),
}

impl<const B: usize> BlockCsr<B> {
    /// `n_rows` empty block rows, and as many block columns.
    #[must_use]
    pub fn new(n_rows: usize) -> Self {
        Self { slots: vec![Slot::default(); n_rows], stamps: vec![0; n_rows], ..Self::default() }
    }

    /// Number of block rows, equal to the number of block columns.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.slots.len()
    }

    /// Number of stored blocks.
    #[must_use]
    pub fn n_blocks(&self) -> usize {
        self.n_blocks
    }

    /// How many times a row was rewritten or lent for writing, since the matrix was made: counts
    /// [`set_row`](Self::set_row), [`clear_row`](Self::clear_row) and [`row_mut`](Self::row_mut).
    #[must_use]
    pub fn rows_written(&self) -> u64 {
        self.rows_written
    }

    /// Places in the array that holds the rows, used or not. Stays below a small multiple of [`n_blocks`](Self::n_blocks)
    /// while the lengths of rows keep their distribution.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.arena.end()
    }

    /// Gives back the room that growing left at the ends of the arrays.
    pub fn shrink_to_fit(&mut self) {
        self.slots.shrink_to_fit();
        self.stamps.shrink_to_fit();
        self.cols.shrink_to_fit();
        self.vals.shrink_to_fit();
    }

    /// Appends empty rows, or drops empty rows at the end. Growing costs the number of new rows.
    ///
    /// # Errors
    /// [`SparseError::InUse`] if a dropped row is not empty or another row refers to it; [`SparseError::TooLarge`].
    pub fn resize(&mut self, n_rows: usize) -> Result<(), SparseError> {
        if u32::try_from(n_rows).is_err() || n_rows.checked_mul(B).is_none() {
            return Err(SparseError::TooLarge(n_rows));
        }
        if n_rows < self.n_rows() {
            self.check_unused_from(n_rows)?;
        }
        self.slots.resize(n_rows, Slot::default());
        self.stamps.resize(n_rows, 0);
        Ok(())
    }

    /// Changes with every write to the row, and is never given to other numbers.
    pub(crate) fn stamp(&self, row: usize) -> u64 {
        self.stamps[row]
    }

    fn note_write(&mut self, row: usize) {
        self.stamps[row] = match self.slots[row].len {
            0 => 0,
            _ => 1 + WRITES.fetch_add(1, Ordering::Relaxed),
        };
    }

    fn check_unused_from(&self, n_rows: usize) -> Result<(), SparseError> {
        for row in 0..self.n_rows() {
            if let Some(&col) = self.row(row).0.last()
                && (row >= n_rows || col as usize >= n_rows)
            {
                let col = col as usize;
                return Err(SparseError::InUse { n_rows, row, col });
            }
        }
        Ok(())
    }

    /// Replaces a row by `blocks` in the strictly ascending columns `cols`.
    ///
    /// # Errors
    /// [`SparseError`] if the row or a column does not exist, the columns do not ascend, the lengths differ or a number
    /// is not finite. The matrix is then unchanged.
    pub fn set_row(&mut self, row: usize, cols: &[u32], blocks: &[Block<B>]) -> Result<(), SparseError> {
        self.check_row(row, cols, blocks)?;
        let len = cols.len();
        let old = self.slots[row];
        let mut slot = old;
        if len > old.capacity as usize {
            slot = self.arena.allocate(len).ok_or(SparseError::TooLarge(len))?;
            self.arena.release(old);
            let end = self.arena.end();
            self.cols.resize(end.max(self.cols.len()), 0);
            self.vals.resize(end.max(self.vals.len()), [[0.0; B]; B]);
        }
        self.n_blocks = self.n_blocks - old.len as usize + len;
        slot.len = len as u32; // at most the capacity, a u32
        self.slots[row] = slot;
        self.cols[slot.range()].copy_from_slice(cols);
        self.vals[slot.range()].copy_from_slice(blocks);
        self.rows_written += 1;
        self.note_write(row);
        Ok(())
    }

    fn check_row(&self, row: usize, cols: &[u32], blocks: &[Block<B>]) -> Result<(), SparseError> {
        let n_rows = self.n_rows();
        if row >= n_rows {
            return Err(SparseError::RowOutOfRange { row, n_rows });
        }
        if cols.len() != blocks.len() {
            let (cols, blocks) = (cols.len(), blocks.len());
            return Err(SparseError::Shape { row, cols, blocks });
        }
        self.check_columns(row, cols)?;
        let finite = |block: &Block<B>| block.as_flattened().iter().all(|v| v.is_finite());
        match blocks.iter().position(|block| !finite(block)) {
            Some(at) => Err(SparseError::NotFinite { row, col: cols[at] as usize }),
            None => Ok(()),
        }
    }

    fn check_columns(&self, row: usize, cols: &[u32]) -> Result<(), SparseError> {
        let n_rows = self.n_rows();
        if let Some(position) = cols.windows(2).position(|w| w[0] >= w[1]) {
            let position = position + 1;
            return Err(SparseError::NotAscending { row, position });
        }
        match cols.last() {
            Some(&col) if col as usize >= n_rows => {
                Err(SparseError::ColumnOutOfRange { row, col: col as usize, n_rows })
            }
            _ => Ok(()),
        }
    }

    /// Empties a row and gives its slot back.
    ///
    /// # Errors
    /// [`SparseError::RowOutOfRange`].
    pub fn clear_row(&mut self, row: usize) -> Result<(), SparseError> {
        let n_rows = self.n_rows();
        let slot = self.slots.get_mut(row).ok_or(SparseError::RowOutOfRange { row, n_rows })?;
        let old = std::mem::take(slot);
        self.n_blocks -= old.len as usize;
        self.arena.release(old);
        self.rows_written += 1;
        self.note_write(row);
        Ok(())
    }

    /// Columns and blocks of a row, columns ascending.
    ///
    /// # Panics
    /// If there is no such row.
    #[must_use]
    #[inline]
    pub fn row(&self, row: usize) -> (&[u32], &[Block<B>]) {
        let range = self.slots[row].range();
        (&self.cols[range.clone()], &self.vals[range])
    }

    /// Columns of a row, and its blocks for writing. What is written must be finite: a product would spread a NaN.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row_mut(&mut self, row: usize) -> (&[u32], &mut [Block<B>]) {
        let range = self.slots[row].range();
        self.rows_written += 1;
        self.note_write(row);
        (&self.cols[range.clone()], &mut self.vals[range])
    }

    /// Block `(i, j)`, if it is stored.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> Option<&Block<B>> {
        self.find(i, j).map(|at| &self.vals[at])
    }

    /// Block `(i, j)` for writing, if it is stored.
    pub fn get_mut(&mut self, i: usize, j: usize) -> Option<&mut Block<B>> {
        let at = self.find(i, j)?;
        self.note_write(i);
        Some(&mut self.vals[at])
    }

    /// The diagonal block of row `i`; zero if it is not stored.
    #[must_use]
    pub fn diagonal(&self, i: usize) -> Block<B> {
        self.get(i, i).copied().unwrap_or([[0.0; B]; B])
    }

    /// Adds `block` to block `(i, j)`.
    ///
    /// # Errors
    /// [`SparseError::NotStored`] if the pattern has no such block, [`SparseError::NotFinite`] if `block` is not finite.
    pub fn add_to_block(&mut self, i: usize, j: usize, block: &Block<B>) -> Result<(), SparseError> {
        let Some(at) = self.find(i, j) else {
            return Err(SparseError::NotStored { row: i, col: j });
        };
        if block.as_flattened().iter().any(|v| !v.is_finite()) {
            return Err(SparseError::NotFinite { row: i, col: j });
        }
        self.note_write(i);
        for (old, new) in self.vals[at].as_flattened_mut().iter_mut().zip(block.as_flattened()) {
            *old += new;
        }
        Ok(())
    }

    fn find(&self, i: usize, j: usize) -> Option<usize> {
        let range = self.slots.get(i)?.range();
        let at = self.cols[range.clone()].binary_search(&u32::try_from(j).ok()?);
        at.ok().map(|at| range.start + at)
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        bytes_of(&self.slots) + bytes_of(&self.cols) + bytes_of(&self.vals) + bytes_of(&self.stamps)
    }
}

/// Equal rows; how they are laid out does not matter.
impl<const B: usize> PartialEq for BlockCsr<B> {
    fn eq(&self, other: &Self) -> bool {
        self.n_rows() == other.n_rows() && (0..self.n_rows()).all(|i| self.row(i) == other.row(i))
    }
}

#[cfg(test)]
mod tests;
