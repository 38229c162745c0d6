//! Rectangular scalar matrices: what files hold and what other libraries take.

use super::{BlockCsr, SparseError};
use crate::Block;

/// A scalar matrix stored by rows, rectangular or square, with columns that ascend strictly within a row and numbers that are
/// finite. The form in which matrices come from files, go to other libraries, and in which constraints are given; a
/// solver wants a [`BlockCsr`].
#[derive(Clone, Debug, PartialEq)]
pub struct ScalarCsr {
    n_cols: usize,
    indptr: Vec<usize>,
    indices: Vec<usize>,
    values: Vec<f64>,
}

/// A scalar matrix that cannot be made, or that cannot be made into blocks.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConversionError {
    /// Row pointers do not ascend from 0 to the number of entries, or columns and numbers differ in number.
    #[error("row pointers from {first} to {last} over {n_rows} rows do not fit {indices} columns and {values} numbers")]
    Pointers {
        /// First pointer, which should be 0.
        first: usize,
        /// Last pointer, which should be the number of entries.
        last: usize,
        /// Number of rows.
        n_rows: usize,
        /// Number of column indices.
        indices: usize,
        /// Number of values.
        values: usize,
    },
    /// An entry outside the matrix.
    #[error("entry ({row}, {col}) lies outside a matrix of {n_rows} x {n_cols}")]
    OutOfRange {
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        col: usize,
        /// Number of rows.
        n_rows: usize,
        /// Number of columns.
        n_cols: usize,
    },
    /// Columns of a row do not ascend strictly.
    #[error("columns of row {row} do not ascend: {col} follows {before}")]
    NotAscending {
        /// Row, from 0.
        row: usize,
        /// A column, from 0.
        before: usize,
        /// What follows it.
        col: usize,
    },
    /// An entry, or the sum of entries at one place, is NaN or an infinity.
    #[error("entry ({row}, {col}) is {value}, expected was a finite number")]
    NotFinite {
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        col: usize,
        /// Its value.
        value: f64,
    },
    /// Only square matrices have square blocks.
    #[error("a matrix of {n_rows} x {n_cols} is not square")]
    NotSquare {
        /// Number of rows.
        n_rows: usize,
        /// Number of columns.
        n_cols: usize,
    },
    /// Blocks do not divide the matrix.
    #[error("{n_rows} rows are no multiple of the block size {block_size}")]
    BlockSize {
        /// Number of rows.
        n_rows: usize,
        /// Rows of a block.
        block_size: usize,
    },
    /// The blocks do not make a matrix.
    #[error(transparent)]
    Sparse(#[from] SparseError),
}

impl ConversionError {
    /// The same error, of the transposed matrix.
    #[cfg(any(feature = "sprs", feature = "direct"))]
    pub(super) fn transposed(self) -> Self {
        match self {
            Self::NotFinite { row, col, value } => Self::NotFinite { row: col, col: row, value },
            other => other,
        }
    }
}

impl ScalarCsr {
    /// A matrix of `indptr.len() - 1` rows from its arrays: row `i` has the columns `indices[indptr[i]..indptr[i + 1]]`, counted
    /// from 0.
    ///
    /// # Errors
    /// [`ConversionError`] if the arrays do not make a matrix as described above.
    pub fn new(
        n_cols: usize,
        indptr: Vec<usize>,
        indices: Vec<usize>,
        values: Vec<f64>,
    ) -> Result<Self, ConversionError> {
        let (first, last) = (indptr.first().copied().unwrap_or(1), indptr.last().copied().unwrap_or(0));
        let n_rows = indptr.len().saturating_sub(1);
        let fits = first == 0 && last == indices.len() && last == values.len() && indptr.is_sorted();
        if !fits {
            return Err(ConversionError::Pointers {
                first,
                last,
                n_rows,
                indices: indices.len(),
                values: values.len(),
            });
        }
        let matrix = Self { n_cols, indptr, indices, values };
        (0..n_rows).try_for_each(|row| matrix.check_row(row))?;
        Ok(matrix)
    }

    /// A matrix from entries `(row, column, value)` in any order, counted from 0. Entries at one place are added up in the
    /// order in which they come, so that mirrored lists give a matrix that is symmetric to the last bit.
    ///
    /// # Errors
    /// [`ConversionError::OutOfRange`], [`ConversionError::NotFinite`].
    pub fn from_triplets(n_rows: usize, n_cols: usize, triplets: &[(u32, u32, f64)]) -> Result<Self, ConversionError> {
        for &(row, col, _) in triplets {
            let (row, col) = (row as usize, col as usize);
            if row >= n_rows || col >= n_cols {
                return Err(ConversionError::OutOfRange { row, col, n_rows, n_cols });
            }
        }
        let starts = starts_of(n_rows, triplets.iter().map(|&(row, ..)| row as usize));
        let mut next = starts.clone();
        let mut sorted = vec![(0usize, 0.0); triplets.len()];
        for &(row, col, value) in triplets {
            let at = &mut next[row as usize];
            sorted[*at] = (col as usize, value);
            *at += 1;
        }
        let mut matrix = Self::with_capacity(n_rows, n_cols, triplets.len());
        for row in 0..n_rows {
            matrix.push_row(&mut sorted[starts[row]..starts[row + 1]])?;
        }
        Ok(matrix)
    }

    /// A matrix from the entries `(column, value)` of each row, in any order.
    #[cfg(any(feature = "sprs", feature = "direct"))]
    pub(super) fn from_rows<R: IntoIterator<Item = (usize, f64)>>(
        n_cols: usize,
        rows: impl Iterator<Item = R>,
    ) -> Result<Self, ConversionError> {
        let mut matrix = Self::with_capacity(rows.size_hint().0, n_cols, 0);
        let mut entries = Vec::new();
        for row in rows {
            entries.clear();
            entries.extend(row);
            matrix.push_row(&mut entries)?;
        }
        Ok(matrix)
    }

    fn with_capacity(n_rows: usize, n_cols: usize, n_entries: usize) -> Self {
        let mut indptr = Vec::with_capacity(n_rows + 1);
        indptr.push(0);
        Self { n_cols, indptr, indices: Vec::with_capacity(n_entries), values: Vec::with_capacity(n_entries) }
    }

    /// Appends a row of entries `(column, value)`, sorted by column and added up.
    fn push_row(&mut self, entries: &mut [(usize, f64)]) -> Result<(), ConversionError> {
        if !entries.is_sorted_by_key(|&(col, _)| col) {
            entries.sort_by_key(|&(col, _)| col); // stable: entries at one place keep their order
        }
        let start = self.indices.len();
        for &(col, value) in &*entries {
            match self.values.last_mut() {
                Some(sum) if self.indices.len() > start && self.indices.last() == Some(&col) => *sum += value,
                _ => {
                    self.indices.push(col);
                    self.values.push(value);
                }
            }
        }
        self.indptr.push(self.indices.len());
        self.check_row(self.n_rows() - 1)
    }

    fn check_row(&self, row: usize) -> Result<(), ConversionError> {
        let (cols, values) = self.row(row);
        let (n_rows, n_cols) = (self.n_rows(), self.n_cols);
        if let Some(pair) = cols.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(ConversionError::NotAscending { row, before: pair[0], col: pair[1] });
        }
        if let Some(&col) = cols.last().filter(|&&col| col >= n_cols) {
            return Err(ConversionError::OutOfRange { row, col, n_rows, n_cols });
        }
        match values.iter().position(|value| !value.is_finite()) {
            Some(at) => Err(ConversionError::NotFinite { row, col: cols[at], value: values[at] }),
            None => Ok(()),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.indptr.len() - 1
    }

    /// Number of columns.
    #[must_use]
    pub fn n_cols(&self) -> usize {
        self.n_cols
    }

    /// Number of stored entries, zeros included.
    #[must_use]
    pub fn n_entries(&self) -> usize {
        self.values.len()
    }

    /// Columns and values of a row, columns ascending.
    ///
    /// # Panics
    /// If there is no such row.
    #[must_use]
    pub fn row(&self, row: usize) -> (&[usize], &[f64]) {
        let range = self.indptr[row]..self.indptr[row + 1];
        (&self.indices[range.clone()], &self.values[range])
    }

    /// All stored entries `(row, column, value)`, row by row.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        (0..self.n_rows()).flat_map(|i| {
            let (cols, values) = self.row(i);
            cols.iter().zip(values).map(move |(&j, &value)| (i, j, value))
        })
    }

    /// Entry `(row, col)`, if it is stored.
    #[must_use]
    pub fn get(&self, row: usize, col: usize) -> Option<f64> {
        if row >= self.n_rows() {
            return None;
        }
        let (cols, values) = self.row(row);
        cols.binary_search(&col).ok().map(|at| values[at])
    }

    /// The arrays `(indptr, indices, values)`, as `sprs` and others take them.
    #[must_use]
    pub fn into_parts(self) -> (Vec<usize>, Vec<usize>, Vec<f64>) {
        (self.indptr, self.indices, self.values)
    }

    /// The matrix with rows and columns exchanged, in time linear in its size.
    #[must_use]
    pub fn transpose(&self) -> Self {
        let indptr = starts_of(self.n_cols, self.indices.iter().copied());
        let mut next = indptr.clone();
        let (mut indices, mut values) = (vec![0; self.n_entries()], vec![0.0; self.n_entries()]);
        for (i, j, value) in self.entries() {
            let at = next[j];
            next[j] += 1;
            (indices[at], values[at]) = (i, value);
        }
        Self { n_cols: self.n_rows(), indptr, indices, values }
    }

    /// The first pair of places `(i, j)` and `(j, i)`, `i > j`, in row order, whose entries differ by more than `tolerance` times
    /// the largest entry of their two rows; an entry that is not stored counts as zero. `None` for a symmetric matrix.
    ///
    /// # Panics
    /// If the matrix is not square.
    #[must_use]
    pub fn find_asymmetry(&self, tolerance: f64) -> Option<Asymmetry> {
        assert_eq!(self.n_rows(), self.n_cols, "only a square matrix can be symmetric");
        let mirrored = self.transpose();
        let largest = |row: usize| self.row(row).1.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let differs = |i: usize, j: usize| {
            let (below, above) = (self.get(i, j).unwrap_or(0.0), mirrored.get(i, j).unwrap_or(0.0));
            let allowed = tolerance * largest(i).max(largest(j));
            ((below - above).abs() > allowed).then_some(Asymmetry { row: i, col: j, below, above })
        };
        (0..self.n_rows()).filter(|&i| self.row(i) != mirrored.row(i)).find_map(|i| {
            let stored = self.row(i).0.iter().chain(mirrored.row(i).0);
            stored.filter(|&&j| j < i).find_map(|&j| differs(i, j))
        })
    }

    /// Whether the matrix equals its transpose, pattern and bits.
    #[must_use]
    pub fn is_symmetric(&self) -> bool {
        if self.n_rows() != self.n_cols {
            return false;
        }
        let other = self.transpose();
        let bits = |matrix: &Self| matrix.values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        self.indptr == other.indptr && self.indices == other.indices && bits(self) == bits(&other)
    }

    /// The square matrix in blocks of `B` rows and columns. A block is stored if one of its entries is; its other entries are
    /// zero.
    ///
    /// # Errors
    /// [`ConversionError::NotSquare`], [`ConversionError::BlockSize`], or [`ConversionError::Sparse`] for more rows than
    /// 32-bit indices can name.
    pub fn to_blocks<const B: usize>(&self) -> Result<BlockCsr<B>, ConversionError> {
        let (n_rows, n_cols) = (self.n_rows(), self.n_cols);
        if n_rows != n_cols {
            return Err(ConversionError::NotSquare { n_rows, n_cols });
        }
        if !n_rows.is_multiple_of(B) {
            return Err(ConversionError::BlockSize { n_rows, block_size: B });
        }
        let mut matrix = BlockCsr::new(0);
        matrix.resize(n_rows / B)?;
        let (mut cols, mut blocks) = (Vec::new(), Vec::new());
        for i in 0..n_rows / B {
            self.block_row(i, &mut cols, &mut blocks);
            matrix.set_row(i, &cols, &blocks)?;
        }
        Ok(matrix)
    }

    /// Merges the `B` rows of block row `i`, each sorted by column.
    fn block_row<const B: usize>(&self, i: usize, cols: &mut Vec<u32>, blocks: &mut Vec<Block<B>>) {
        let rows: [_; B] = std::array::from_fn(|k| self.row(i * B + k));
        cols.clear();
        cols.extend(rows.iter().flat_map(|(indices, _)| indices.iter().map(|&j| (j / B) as u32))); // resize checked n / B
        cols.sort_unstable();
        cols.dedup();
        blocks.clear();
        blocks.resize(cols.len(), [[0.0; B]; B]);
        for (k, (indices, values)) in rows.iter().enumerate() {
            let mut at = 0;
            for (&j, &value) in indices.iter().zip(*values) {
                at += cols[at..].iter().take_while(|&&col| (col as usize) < j / B).count();
                blocks[at][k][j % B] = value;
            }
        }
    }
}

/// Two entries that a symmetric matrix would have equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asymmetry {
    /// Row of the lower one, from 0.
    pub row: usize,
    /// Column of the lower one, from 0.
    pub col: usize,
    /// Entry `(row, col)`.
    pub below: f64,
    /// Entry `(col, row)`.
    pub above: f64,
}

impl<const B: usize> BlockCsr<B> {
    /// Scalar rows with ascending columns; stored zeros stay.
    #[must_use]
    pub fn to_scalar_csr(&self) -> ScalarCsr {
        let n = self.n_rows() * B;
        let mut indptr = Vec::with_capacity(n + 1);
        indptr.push(0);
        let mut indices = Vec::with_capacity(self.n_blocks() * B * B);
        let mut values = Vec::with_capacity(self.n_blocks() * B * B);
        for i in 0..self.n_rows() {
            let (cols, blocks) = self.row(i);
            for k in 0..B {
                for (&j, block) in cols.iter().zip(blocks) {
                    indices.extend((0..B).map(|l| j as usize * B + l));
                    values.extend_from_slice(&block[k]);
                }
                indptr.push(indices.len());
            }
        }
        ScalarCsr { n_cols: n, indptr, indices, values }
    }
}

/// Where each of `n` rows starts, one more at the end, if it holds the entries whose rows are given.
fn starts_of(n: usize, rows: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut starts = vec![0; n + 1];
    for row in rows {
        starts[row + 1] += 1;
    }
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    starts
}
