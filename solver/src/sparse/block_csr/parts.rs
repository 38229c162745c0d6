//! Rows of a matrix made at once, and written by several threads.

use super::{Arena, BlockCsr, GRAIN, SparseError, WRITES};
use crate::Block;
use crate::sparse::arena::Slot;
use std::ops::Range;
use std::sync::atomic::Ordering;

impl<const B: usize> BlockCsr<B> {
    /// The matrix of zeros with the strictly ascending columns `cols[starts[i]..starts[i + 1]]` in row `i`, one `starts` more
    /// than rows. The memory of the zeros is touched when they are first written.
    ///
    /// # Errors
    /// [`SparseError`] for a column that does not exist or does not ascend, [`SparseError::TooLarge`].
    ///
    /// # Panics
    /// If `starts` does not ascend from 0 to the number of columns.
    pub fn from_pattern(starts: &[usize], cols: &[u32]) -> Result<Self, SparseError> {
        assert!(starts.first() == Some(&0) && starts.last() == Some(&cols.len()) && starts.is_sorted(), "row starts");
        let n_rows = starts.len() - 1;
        if u32::try_from(n_rows).is_err() || n_rows.checked_mul(B).is_none() {
            return Err(SparseError::TooLarge(n_rows));
        }
        let mut matrix = Self::new(n_rows);
        let mut arena = Arena::<GRAIN>::default();
        for row in 0..n_rows {
            let len = starts[row + 1] - starts[row];
            let slot = arena.allocate(len).ok_or(SparseError::TooLarge(len))?;
            matrix.slots[row] = Slot { len: len as u32, ..slot };
        }
        matrix.cols = vec![0; arena.end()];
        matrix.vals = vec![[[0.0; B]; B]; arena.end()];
        matrix.arena = arena;
        matrix.n_blocks = cols.len();
        for row in 0..n_rows {
            let of_row = &cols[starts[row]..starts[row + 1]];
            matrix.check_columns(row, of_row)?;
            matrix.cols[matrix.slots[row].range()].copy_from_slice(of_row);
            matrix.note_write(row);
        }
        Ok(matrix)
    }

    /// Lends the rows from `bounds[k]` to `bounds[k + 1]`, those of the last part to `end`, for writing by a thread each.
    /// `None` unless the rows lie one behind the other, as those of [`from_pattern`](Self::from_pattern), or rows set in
    /// ascending order, do as long as none outgrows its place.
    ///
    /// All rows count as lent; followers of the matrix copy those alone that [`RowsMut::row_mut`] was called for.
    ///
    /// # Panics
    /// If the bounds do not ascend to `end`, or `end` is beyond the last row.
    pub fn parts<'a, const PARTS: usize>(
        &'a mut self,
        bounds: [usize; PARTS],
        end: usize,
    ) -> Option<[RowsMut<'a, B>; PARTS]> {
        let mut place = 0;
        for slot in self.slots.iter().filter(|slot| slot.capacity > 0) {
            if slot.start < place {
                return None;
            }
            place = slot.start + slot.capacity;
        }
        assert!(bounds.is_sorted() && bounds.last().is_none_or(|&last| last <= end), "bounds {bounds:?} up to {end}");
        self.rows_written += self.n_rows() as u64;
        // One number for all: each row takes on one content under it.
        let stamp = 1 + WRITES.fetch_add(1, Ordering::Relaxed);
        let (mut rest, mut offset) = (&mut self.vals[..], 0);
        let first = bounds.first().copied().unwrap_or(end);
        let mut rest_stamps = &mut self.stamps[first..end];
        Some(std::array::from_fn(|k| {
            let rows = bounds[k]..bounds.get(k + 1).copied().unwrap_or(end);
            let (stamps, after_stamps) = std::mem::take(&mut rest_stamps).split_at_mut(rows.len());
            rest_stamps = after_stamps;
            let last = self.slots[rows.clone()].iter().rfind(|slot| slot.capacity > 0);
            let place = last.map_or(offset, |slot| (slot.start + slot.capacity) as usize);
            let (vals, after) = std::mem::take(&mut rest).split_at_mut(place - offset);
            let part = RowsMut { rows, slots: &self.slots, cols: &self.cols, vals, offset, stamps, stamp };
            (rest, offset) = (after, place);
            part
        }))
    }
}

/// Some rows of a matrix, lent for writing by [`BlockCsr::parts`]; the columns of all rows can be read.
#[derive(Debug)]
pub struct RowsMut<'a, const B: usize> {
    rows: Range<usize>,
    slots: &'a [Slot],
    cols: &'a [u32],
    /// Blocks from place `offset` on.
    vals: &'a mut [Block<B>],
    offset: usize,
    /// Of `rows`, and the stamp of those that are written.
    stamps: &'a mut [u64],
    stamp: u64,
}

impl<const B: usize> RowsMut<'_, B> {
    /// The rows that may be written.
    #[must_use]
    pub fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// Columns of a row, whoever writes it.
    ///
    /// # Panics
    /// If the matrix has no such row.
    #[must_use]
    #[inline(always)]
    pub fn cols(&self, row: usize) -> &[u32] {
        &self.cols[self.slots[row].range()]
    }

    /// Columns and blocks of one of [`rows`](Self::rows). What is written must be finite: a product would spread a NaN.
    ///
    /// # Panics
    /// If `row` is not one of them.
    #[inline(always)]
    pub fn row_mut(&mut self, row: usize) -> (&[u32], &mut [Block<B>]) {
        self.stamps[row - self.rows.start] = if self.slots[row].len == 0 { 0 } else { self.stamp };
        let range = self.slots[row].range();
        if range.is_empty() {
            return (&[], &mut []); // wherever it lies: a row that was emptied has no place of its own
        }
        (&self.cols[range.clone()], &mut self.vals[range.start - self.offset..range.end - self.offset])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_is_filled_by_parts() {
        let mut a = BlockCsr::<2>::from_pattern(&[0, 2, 2, 5, 6], &[0, 3, 0, 1, 2, 3]).unwrap();
        assert_eq!((a.n_rows(), a.n_blocks()), (4, 6));
        for (k, part) in a.parts([0, 2], 4).unwrap().iter_mut().enumerate() {
            assert_eq!(part.cols(2), [0, 1, 2]);
            for row in part.rows() {
                let (cols, blocks) = part.row_mut(row);
                for (col, block) in cols.iter().zip(blocks) {
                    *block = [[row as f64, f64::from(*col)], [k as f64, 1.0]];
                }
            }
        }
        let mut expected = BlockCsr::<2>::new(4);
        for (row, cols) in [(0, vec![0, 3]), (2, vec![0, 1, 2]), (3, vec![3])] {
            let block = |col: &u32| [[f64::from(row), f64::from(*col)], [f64::from(row / 2), 1.0]];
            let blocks: Vec<_> = cols.iter().map(block).collect();
            expected.set_row(row as usize, &cols, &blocks).unwrap();
        }
        assert!((0..4).all(|row| a.row(row) == expected.row(row)));
        let before: Vec<u64> = (0..4).map(|row| a.stamp(row)).collect();
        for part in a.parts([0, 2], 4).as_mut().unwrap() {
            part.row_mut(part.rows().start);
        }
        let changed = [0, 1, 2, 3].map(|row| a.stamp(row) != before[row]);
        assert_eq!(changed, [true, false, true, false], "only rows that were asked for count as written");
        // A row that has moved to the end stands in the way.
        a.set_row(0, &[0, 1, 2, 3], &[[[1.0; 2]; 2]; 4]).unwrap();
        assert!(a.parts([0], 4).is_some(), "four blocks have room where there were two");
        let mut grown = BlockCsr::<1>::from_pattern(&[0, 1, 2, 3, 4, 5], &[0, 1, 2, 3, 4]).unwrap();
        grown.set_row(0, &[0, 1, 2, 3, 4], &[[[1.0]]; 5]).unwrap();
        assert!(grown.parts([0], 5).is_none());
        // One that was emptied does not.
        let mut emptied = BlockCsr::<1>::from_pattern(&[0, 2, 4, 4], &[0, 1, 0, 1]).unwrap();
        emptied.set_row(1, &[], &[]).unwrap();
        for part in emptied.parts([0, 1], 3).as_mut().unwrap() {
            for row in part.rows() {
                assert_eq!(part.row_mut(row).1.len(), if row == 0 { 2 } else { 0 });
            }
        }
        assert!(BlockCsr::<1>::from_pattern(&[0, 2], &[0, 0]).is_err());
        assert!(BlockCsr::<1>::from_pattern(&[0, 1], &[1]).is_err());
    }
}
