//! Where the rows of a frozen matrix are, and how they follow the dynamic one.

use super::{Column, Frozen, MOST_LANES, NONE, Slice, Slot};
use crate::Block;
use crate::real::Real;
use crate::sparse::{BlockCsr, Rows};
use std::ops::Range;

/// Share of the streamed positions that padding takes beyond a fresh layout before windows are laid out anew, a few by one
/// refresh, so that its cost stays that of its changes.
const SLACK: f64 = 0.02;
const FEW: usize = 2;
/// The share that is never left.
const MOST_SLACK: f64 = 0.04;

impl<const B: usize, T: Real> Frozen<B, T> {
    /// Follows `matrix`: copies the rows that were written since they were copied last. A row that outgrows its slice moves
    /// the slice to another place. Allocates only where the matrix grew.
    ///
    /// Any matrix can be followed: rows are told apart by stamps that no two writes share.
    ///
    /// # Panics
    /// If the matrix has more blocks than 32-bit indices can name with padding.
    pub fn refresh(&mut self, matrix: &BlockCsr<B>) {
        self.follow(matrix);
    }

    /// [`refresh`](Self::refresh) from rows wherever they are kept.
    pub(crate) fn follow(&mut self, matrix: &impl Rows<B>) {
        let mut changed = std::mem::take(&mut self.changed);
        changed.clear();
        let new_from = self.resize(matrix.n_rows());
        if self.vals.is_empty() {
            // With a little padding; without this, growing would copy and touch everything twice.
            let positions = matrix.n_blocks() / T::LANES;
            let positions = positions + positions / 16;
            self.vals.reserve(positions);
            self.cols.reserve(positions * T::LANES);
        }
        let mut pattern_changed = new_from < self.n_windows();
        for window in 0..self.n_windows() {
            changed.clear();
            changed.extend(
                self.rows_of(window).filter(|&row| self.stamps[row] != matrix.stamp(row)).map(|row| row as u32),
            );
            self.rows_copied += changed.len() as u64;
            for &row in &changed {
                self.stamps[row as usize] = matrix.stamp(row as usize);
            }
            if window >= new_from || 2 * changed.len() > self.rows_of(window).len() {
                self.lay_out(window, matrix);
                pattern_changed = true;
                continue;
            }
            let mut lengths_differ = false;
            for &row in &changed {
                lengths_differ |= self.follow_row(row as usize, matrix);
            }
            if lengths_differ {
                self.fresh[window] = self.fresh_layout(window, matrix);
                pattern_changed = true;
            }
        }
        self.n_blocks = matrix.n_blocks();
        if pattern_changed {
            self.tidy(matrix);
        }
        self.changed = changed;
    }

    /// Takes on the number of rows; returns the first window with other rows than before.
    fn resize(&mut self, n_rows: usize) -> usize {
        let old = self.n_rows;
        if n_rows == old {
            return self.n_windows();
        }
        let windows = n_rows.div_ceil(Self::ROWS_PER_WINDOW);
        for slice in (windows * Self::SLICES_PER_WINDOW..self.slices.len()).rev() {
            self.release(slice);
        }
        self.slices.resize(windows * Self::SLICES_PER_WINDOW, Slice { rows: [NONE; MOST_LANES], ..Slice::default() });
        self.lengths.resize(self.slices.len() * T::LANES, 0);
        self.fresh.resize(windows, 0);
        self.n_rows = n_rows;
        self.place.resize(n_rows, 0);
        self.stamps.resize(n_rows, 0);
        old.min(n_rows) / Self::ROWS_PER_WINDOW
    }

    /// Where the columns of a range of positions are.
    fn lanes_of(positions: &Range<usize>) -> Range<usize> {
        positions.start * T::LANES..positions.end * T::LANES
    }

    fn n_windows(&self) -> usize {
        self.fresh.len()
    }

    fn rows_of(&self, window: usize) -> Range<usize> {
        window * Self::ROWS_PER_WINDOW..((window + 1) * Self::ROWS_PER_WINDOW).min(self.n_rows)
    }

    fn slices_of(window: usize) -> Range<usize> {
        window * Self::SLICES_PER_WINDOW..(window + 1) * Self::SLICES_PER_WINDOW
    }

    /// Rows of a window, longest first, and places of the same length in ascending order.
    fn by_length(&mut self, window: usize, matrix: &impl Rows<B>) {
        let rows = self.rows_of(window);
        self.order.clear();
        self.order.extend(rows.map(|row| (u32::MAX - matrix.row(row).0.len() as u32, row as u32)));
        self.order.sort_unstable();
    }

    /// Positions that a product would read if the window were laid out anew.
    fn fresh_layout(&mut self, window: usize, matrix: &impl Rows<B>) -> u32 {
        self.by_length(window, matrix);
        self.order.iter().step_by(T::LANES).map(|(length, _)| (u32::MAX - length) * T::LANES as u32).sum()
    }

    /// Sorts the rows of a window by length and copies all of them; slices whose place has the right size stay there.
    fn lay_out(&mut self, window: usize, matrix: &impl Rows<B>) {
        self.fresh[window] = self.fresh_layout(window, matrix);
        let order = std::mem::take(&mut self.order);
        let width = |k: usize| order.get(k * T::LANES).map_or(0, |(length, _)| u32::MAX - length);
        for (k, slice) in Self::slices_of(window).enumerate() {
            if self.slices[slice].slot.capacity != width(k) {
                self.release(slice);
            }
        }
        for (k, slice) in Self::slices_of(window).enumerate() {
            self.allocate(slice, width(k) as usize);
            let rows = order.get(k * T::LANES..).unwrap_or_default();
            for (lane, &(_, row)) in rows.iter().take(T::LANES).enumerate() {
                self.slices[slice].rows[lane] = row;
                self.place[row as usize] = (slice * T::LANES + lane) as u32;
                self.copy_row(row as usize, matrix);
            }
        }
        self.order = order;
    }

    /// Copies a row to where it is, its slice made wider or narrower as needed; whether the length of the row changed.
    fn follow_row(&mut self, row: usize, matrix: &impl Rows<B>) -> bool {
        let slice = self.place[row] as usize / T::LANES;
        let (len, width) = (matrix.row(row).0.len(), self.slices[slice].slot.len as usize);
        if len > width {
            self.widen(slice, len);
        }
        let before = self.copy_row(row, matrix);
        if before != len && before == width {
            self.narrow(slice);
        }
        before != len
    }

    /// Writes a row into its lane, the rest of which becomes padding; returns the length it had there.
    fn copy_row(&mut self, row: usize, matrix: &impl Rows<B>) -> usize {
        let (slice, lane) = (self.place[row] as usize / T::LANES, self.place[row] as usize % T::LANES);
        let (cols, blocks) = matrix.row(row);
        let range = self.slices[slice].slot.range();
        let before = std::mem::replace(&mut self.lengths[slice * T::LANES + lane], cols.len() as u32) as usize;
        let columns = self.cols[Self::lanes_of(&range)].chunks_exact_mut(T::LANES).zip(&mut self.vals[range]);
        for (k, (col, column)) in columns.enumerate() {
            // Padding multiplies the row's own entry by zero: it is in the cache, and finite where the row's is.
            let block = blocks.get(k).unwrap_or(&[[0.0; B]; B]);
            col[lane] = cols.get(k).copied().unwrap_or(row as u32);
            set_lane::<B, T>(column, lane, block);
        }
        before
    }

    /// Gives a slice `width` positions, in another place if its own is too small.
    fn widen(&mut self, slice: usize, width: usize) {
        let old = self.slices[slice].slot;
        let rows = self.slices[slice].rows;
        let mut slot = Slot { len: width as u32, ..old };
        if width > old.capacity as usize {
            slot = self.take(width);
            self.cols.copy_within(Self::lanes_of(&old.range()), slot.start as usize * T::LANES);
            self.vals.copy_within(old.range(), slot.start as usize);
            self.arena.release(old);
        }
        let to = slot.start as usize;
        let added = to + old.len as usize..to + width;
        let padding = rows.map(|row| if row == NONE { self.padding_row(slice) } else { row });
        for cols in self.cols[Self::lanes_of(&added)].chunks_exact_mut(T::LANES) {
            cols.copy_from_slice(&padding[..T::LANES]);
        }
        self.vals[added].fill(no_blocks::<B, T>());
        self.streamed += (width - old.len as usize) * T::LANES;
        self.slices[slice].slot = slot;
    }

    /// Leaves out positions at the end that hold padding alone.
    fn narrow(&mut self, slice: usize) {
        let width = self.lengths[slice * T::LANES..(slice + 1) * T::LANES].iter().copied().max().unwrap_or(0);
        self.streamed -= (self.slices[slice].slot.len - width) as usize * T::LANES;
        self.slices[slice].slot.len = width;
    }

    /// A row that exists, for lanes that have none.
    fn padding_row(&self, slice: usize) -> u32 {
        (slice / Self::SLICES_PER_WINDOW * Self::ROWS_PER_WINDOW) as u32
    }

    fn release(&mut self, slice: usize) {
        let Slice { slot, .. } =
            std::mem::replace(&mut self.slices[slice], Slice { rows: [NONE; MOST_LANES], ..Slice::default() });
        self.streamed -= slot.len as usize * T::LANES;
        self.arena.release(slot);
    }

    /// Makes a slice, in its place or in a new one if it has none, all padding.
    fn allocate(&mut self, slice: usize, width: usize) {
        self.streamed -= self.slices[slice].slot.len as usize * T::LANES;
        if self.slices[slice].slot.capacity as usize != width {
            self.slices[slice].slot = self.take(width);
        }
        let slot = &mut self.slices[slice].slot;
        slot.len = width as u32;
        let range = slot.range();
        self.slices[slice].rows = [NONE; MOST_LANES];
        self.lengths[slice * T::LANES..(slice + 1) * T::LANES].fill(0);
        let padding = self.padding_row(slice);
        self.cols[Self::lanes_of(&range)].fill(padding);
        self.vals[range].fill(no_blocks::<B, T>());
        self.streamed += width * T::LANES;
    }

    fn take(&mut self, width: usize) -> Slot {
        let mut slot = self.arena.allocate(width).expect("a frozen matrix has fewer than 2^32 positions");
        slot.len = width as u32;
        let end = self.arena.end();
        if end > self.vals.len() {
            self.cols.resize(end * T::LANES, 0);
            self.vals.resize(end, no_blocks::<B, T>());
        }
        slot
    }

    /// Lays out anew the windows with the most padding to spare, if there is too much of it.
    fn tidy(&mut self, matrix: &impl Rows<B>) {
        for tidied in 0.. {
            let fresh: usize = self.fresh.iter().map(|&positions| positions as usize).sum();
            let slack = if tidied < FEW { SLACK } else { MOST_SLACK };
            if self.streamed as f64 <= (1.0 + slack) * fresh as f64 {
                return;
            }
            let excess = |window: &usize| {
                let streamed: u32 = self.slices[Self::slices_of(*window)].iter().map(|slice| slice.slot.len).sum();
                streamed * T::LANES as u32 - self.fresh[*window]
            };
            let Some(worst) = (0..self.n_windows()).max_by_key(excess) else { return };
            self.lay_out(worst, matrix);
        }
    }
}

fn no_blocks<const B: usize, T: Real>() -> Column<B, T> {
    [[T::Lanes::default(); B]; B]
}

fn set_lane<const B: usize, T: Real>(column: &mut Column<B, T>, lane: usize, block: &Block<B>) {
    for i in 0..B {
        for j in 0..B {
            column[i][j][lane] = T::from_f64(block[i][j]);
        }
    }
}
