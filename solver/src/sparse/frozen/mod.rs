//! A matrix laid out for products.

mod kernel;
mod layout;
mod many;

use super::BlockCsr;
use super::arena::{Arena, Slot};
use crate::memory::{bytes_of, bytes_of_all};
use crate::real::Real;
use crate::vector::CHUNK;

/// The most rows side by side in a slice; a format may use fewer.
const MOST_LANES: usize = 8;
/// Stands for no row.
const NONE: u32 = u32::MAX;

/// The blocks at one position of each row of a slice, `blocks[i][j]` holding entry `(i, j)` of all of them.
type Column<const B: usize, T> = [[<T as Real>::Lanes; B]; B];

/// Rows side by side, stored position by position.
#[derive(Clone, Copy, Debug, Default)]
struct Slice {
    /// Where its columns are.
    slot: Slot,
    /// The rows, [`NONE`] for none.
    rows: [u32; MOST_LANES],
}

/// The numbers of a [`BlockCsr`] laid out for products at the speed of memory, in `f64` or `f32`.
///
/// Sliced ELLPACK: four rows (eight in `f32`) side by side, each padded to the longest of them; rows of similar length share a slice, as
/// far as they come from the same chunk of the vector ([`CHUNK`] entries, a *window*). The product in `f64` has the bits of
/// [`BlockCsr`]'s.
///
/// [`refresh`](Self::refresh) follows the matrix at the cost of the rows that changed. Padding that gathers by such changes
/// is cleared a window at a time, so that the bytes that a product reads stay within a few percent of a fresh layout.
///
/// Source: Kreutzer, Hager, Wellein, Fehske & Bishop, *A unified sparse matrix data format (SELL-C-σ)*, SIAM J. Sci. Comput.
/// 36 (2014), with blocks.
#[derive(Clone, Debug, Default)]
pub struct Frozen<const B: usize, T: Real = f64> {
    n_rows: usize,
    slices: Vec<Slice>,
    /// Columns, lane by lane.
    cols: Vec<u32>,
    vals: Vec<Column<B, T>>,
    arena: Arena<1>,
    /// Where each row is: slice times [`Real::LANES`] plus lane.
    place: Vec<u32>,
    /// Stamp that each row had in the matrix when it was copied.
    stamps: Vec<u64>,
    /// Positions that a product reads, padding included, and those that hold a block of the matrix.
    streamed: usize,
    n_blocks: usize,
    /// Blocks of the row in each lane of each slice.
    lengths: Vec<u32>,
    /// By window, the positions that a product would read after a fresh layout.
    fresh: Vec<u32>,
    /// Working memory: rows that changed, rows by length.
    changed: Vec<u32>,
    order: Vec<(u32, u32)>,
    rows_copied: u64,
}

impl<const B: usize, T: Real> Frozen<B, T> {
    const SLICES_PER_WINDOW: usize = {
        assert!(B > 0 && CHUNK.is_multiple_of(B * MOST_LANES), "blocks of 1, 2, 3, 4, 6 or 8");
        CHUNK / B / T::LANES
    };
    const ROWS_PER_WINDOW: usize = CHUNK / B;

    /// The numbers of `matrix`.
    #[must_use]
    pub fn new(matrix: &BlockCsr<B>) -> Self {
        let mut frozen = Self::default();
        frozen.refresh(matrix);
        frozen
    }

    /// Number of block rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Number of blocks of the matrix.
    #[must_use]
    pub fn n_blocks(&self) -> usize {
        self.n_blocks
    }

    /// Number of blocks that a product reads: those of the matrix, and padding.
    #[must_use]
    pub fn streamed_blocks(&self) -> usize {
        self.streamed
    }

    /// Bytes that a product moves at least: each stored number and column index once, `x` and `y` once.
    #[must_use]
    pub fn bytes_moved(&self) -> usize {
        let block = B * B * size_of::<T>() + size_of::<u32>();
        self.streamed * block + 2 * self.n_rows * B * size_of::<T>() + self.slices.len() * size_of::<Slice>()
    }

    /// How many rows were copied from the matrix so far: what [`refresh`](Self::refresh) costs.
    #[must_use]
    pub fn rows_copied(&self) -> u64 {
        self.rows_copied
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let words = [&self.cols, &self.place, &self.lengths, &self.fresh, &self.changed];
        bytes_of(&self.vals)
            + bytes_of(&self.slices)
            + bytes_of(&self.stamps)
            + bytes_of(&self.order)
            + bytes_of_all(words)
    }
}

#[cfg(test)]
mod tests;
