//! The lower triangle of a matrix, in the order of elimination, as faer takes it.

use super::{DirectError, FactorNumber};
use crate::Block;
use crate::memory::bytes_of_all;
use crate::ordering::Permutation;
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace};

/// An entry that differs from its mirror image by more than this part of the largest entry of the two rows is an error;
/// sums in another order differ by some 1e-15.
const ASYMMETRY: f64 = 1e-10;

/// A block above the diagonal, in the order of elimination.
const ABOVE: u32 = u32::MAX;

/// Where the blocks of a matrix go in scalar columns, each from its diagonal entry down.
#[derive(Debug)]
pub(super) struct Lower<const B: usize> {
    order: Permutation,
    /// Pattern of the matrix, by block rows in the caller's order.
    row_starts: Vec<usize>,
    cols: Vec<u32>,
    /// Of each block: which one of its column it is, from the diagonal down, or [`ABOVE`].
    ordinals: Vec<u32>,
    /// Of each block: its place in the row of its mirror image.
    mirrors: Vec<u32>,
    /// Scalar columns.
    starts: Vec<usize>,
    rows: Vec<usize>,
}

impl<const B: usize> Lower<B> {
    pub(super) fn new(a: &BlockCsr<B>, order: Permutation) -> Result<Self, DirectError> {
        let n = a.n_rows();
        let mut this = Self {
            order,
            row_starts: vec![0],
            cols: Vec::with_capacity(a.n_blocks()),
            ordinals: vec![ABOVE; a.n_blocks()],
            mirrors: Vec::with_capacity(a.n_blocks()),
            starts: vec![0],
            rows: Vec::new(),
        };
        for row in 0..n {
            let cols = a.row(row).0;
            for &col in cols {
                let mirror = a.row(col as usize).0.binary_search(&(row as u32)); // a block row is a u32
                this.mirrors
                    .push(mirror.map_err(|_| DirectError::PatternNotSymmetric { row, col: col as usize })? as u32);
            }
            this.cols.extend_from_slice(cols);
            this.row_starts.push(this.cols.len());
        }
        this.lay_out_columns();
        Ok(this)
    }

    /// Blocks below the diagonal of each column, in ascending order of elimination.
    fn lay_out_columns(&mut self) {
        let n = self.order.len();
        let mut below: Vec<Vec<u32>> = vec![Vec::new(); n];
        for new in 0..n {
            let old = self.order.old_of(new);
            for at in self.row_starts[old]..self.row_starts[old + 1] {
                let col = self.order.new_of(self.cols[at] as usize);
                if col < new {
                    below[col].push(new as u32);
                    self.ordinals[at] = below[col].len() as u32;
                } else if col == new {
                    self.ordinals[at] = 0;
                }
            }
        }
        for (col, below) in below.iter().enumerate() {
            for l in 0..B {
                self.rows.extend(col * B + l..(col + 1) * B);
                for &row in below {
                    self.rows.extend(row as usize * B..(row as usize + 1) * B);
                }
                self.starts.push(self.rows.len());
            }
        }
    }

    pub(super) fn order(&self) -> &Permutation {
        &self.order
    }

    /// Offsets of the scalar columns, and the rows of their entries, ascending.
    pub(super) fn columns(&self) -> (&[usize], &[usize]) {
        (&self.starts, &self.rows)
    }

    /// The same pattern by rows: columns of the upper triangle, ascending.
    pub(super) fn upper_columns(&self) -> (Vec<usize>, Vec<usize>) {
        let n = self.starts.len() - 1;
        let mut starts = vec![0; n + 1];
        self.rows.iter().for_each(|&row| starts[row + 1] += 1);
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let (mut next, mut cols) = (starts.clone(), vec![0; self.rows.len()]);
        for col in 0..n {
            for &row in &self.rows[self.starts[col]..self.starts[col + 1]] {
                cols[next[row]] = col;
                next[row] += 1;
            }
        }
        (starts, cols)
    }

    /// Writes the lower triangle of `P A P + s (I − P)`; `largest` is memory for a number per block row.
    pub(super) fn gather<T: FactorNumber>(
        &self,
        a: &BlockCsr<B>,
        w: &Subspace<B>,
        largest: &mut [f64],
        values: &mut [T],
    ) -> Result<(), DirectError> {
        self.check_pattern(a)?;
        for (row, largest) in largest.iter_mut().enumerate() {
            let entries = a.row(row).1.as_flattened().as_flattened();
            *largest = entries.iter().fold(0.0, |largest, v| v.abs().max(largest));
        }
        values.fill(T::ZERO);
        for row in 0..a.n_rows() {
            let (cols, blocks) = a.row(row);
            for (k, (&col, block)) in cols.iter().zip(blocks).enumerate() {
                let (at, col) = (self.row_starts[row] + k, col as usize);
                let mirror = &a.row(col).1[self.mirrors[at] as usize];
                if self.ordinals[at] == ABOVE || row == col {
                    check_symmetry((row, col), block, mirror, largest[row].max(largest[col]))?;
                }
                if self.ordinals[at] != ABOVE {
                    self.put((row, col), self.ordinals[at], block, values)?;
                }
            }
        }
        self.constrain(a, w, values)
    }

    fn check_pattern(&self, a: &BlockCsr<B>) -> Result<(), DirectError> {
        let (expected, len) = (self.row_starts.len() - 1, a.n_rows());
        if len != expected {
            return Err(DirectError::Shape { what: "the matrix, in block rows,", expected, len });
        }
        let same = |row: usize| a.row(row).0 == &self.cols[self.row_starts[row]..self.row_starts[row + 1]];
        match (0..len).find(|&row| !same(row)) {
            Some(row) => Err(DirectError::PatternChanged { row }),
            None => Ok(()),
        }
    }

    /// Projects the blocks of constrained nodes, from both sides.
    fn constrain<T: FactorNumber>(
        &self,
        a: &BlockCsr<B>,
        w: &Subspace<B>,
        values: &mut [T],
    ) -> Result<(), DirectError> {
        for (node, constraint) in w.constrained() {
            let (cols, blocks) = a.row(node);
            for (k, (&col, block)) in cols.iter().zip(blocks).enumerate() {
                let (at, col) = (self.row_starts[node] + k, col as usize);
                let projected = project(constraint, block, &w.get(col));
                if self.ordinals[at] != ABOVE {
                    self.put((node, col), self.ordinals[at], &projected, values)?;
                } else {
                    let mirror = self.row_starts[col] + self.mirrors[at] as usize;
                    self.put((col, node), self.ordinals[mirror], &transposed(&projected), values)?;
                }
            }
            let diagonal = a.diagonal(node);
            let trace: f64 = (0..B).map(|k| diagonal[k][k]).sum();
            let scale = if trace > 0.0 { trace / B as f64 } else { 1.0 };
            let held = project(constraint, &diagonal, constraint);
            let identity = project(constraint, &block(|i, j| f64::from(i == j)), constraint);
            let filled = block(|i, j| held[i][j] + scale * (f64::from(i == j) - identity[i][j]));
            self.put((node, node), 0, &filled, values)?;
        }
        Ok(())
    }

    /// Writes one block at or below the diagonal.
    #[inline]
    fn put<T: FactorNumber>(
        &self,
        (row, col): (usize, usize),
        ordinal: u32,
        block: &Block<B>,
        values: &mut [T],
    ) -> Result<(), DirectError> {
        let first_col = self.order.new_of(col) * B;
        for l in 0..B {
            // Of the diagonal block, a column holds the entries from the diagonal down.
            let first = if ordinal == 0 { l } else { 0 };
            let start = self.starts[first_col + l] + ordinal as usize * B - l;
            for k in first..B {
                let value = <T as crate::real::Real>::from_f64(block[k][l]);
                if !crate::real::Real::is_finite(value) {
                    return Err(DirectError::NotFinite { row: row * B + k, col: col * B + l });
                }
                values[start + k] = value;
            }
        }
        Ok(())
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        bytes_of_all([&self.cols, &self.ordinals, &self.mirrors])
            + bytes_of_all([&self.row_starts, &self.starts, &self.rows])
    }
}

fn check_symmetry<const B: usize>(
    (row, col): (usize, usize),
    block: &Block<B>,
    mirror: &Block<B>,
    largest: f64,
) -> Result<(), DirectError> {
    for k in 0..B {
        for l in 0..B {
            let difference = (block[k][l] - mirror[l][k]).abs();
            if difference > ASYMMETRY * largest {
                return Err(DirectError::NotSymmetric { row: row * B + k, col: col * B + l, difference });
            }
        }
    }
    Ok(())
}

/// `P D Q`, with the projections of the row's and the column's constraint.
fn project<const B: usize>(row: &Constraint<B>, d: &Block<B>, col: &Constraint<B>) -> Block<B> {
    let right = d.map(|row| col.project(row));
    transposed(&transposed(&right).map(|col| row.project(col)))
}

fn transposed<const B: usize>(d: &Block<B>) -> Block<B> {
    block(|i, j| d[j][i])
}

fn block<const B: usize>(entry: impl Fn(usize, usize) -> f64) -> Block<B> {
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}
