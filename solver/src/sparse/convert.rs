//! Views of the matrix for tests, and its serialised form.

use super::{BlockCsr, SparseError};
use crate::Block;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

impl<const B: usize> BlockCsr<B> {
    /// All entries, row by row: `dim * dim` numbers.
    #[must_use]
    pub fn to_dense(&self) -> Vec<f64> {
        let n = self.n_rows() * B;
        let mut dense = vec![0.0; n * n];
        for (i, j, block) in self.blocks() {
            for (k, row) in block.iter().enumerate() {
                let at = (i * B + k) * n + j * B;
                dense[at..at + B].copy_from_slice(row);
            }
        }
        dense
    }

    /// Largest `|a_ij − a_ji|`; entries that are not stored count as zero.
    #[must_use]
    pub fn asymmetry(&self) -> f64 {
        let mut largest = 0.0f64;
        for (i, j, block) in self.blocks() {
            let mirror = self.get(j, i).copied().unwrap_or([[0.0; B]; B]);
            for k in 0..B {
                for l in 0..B {
                    largest = largest.max((block[k][l] - mirror[l][k]).abs());
                }
            }
        }
        largest
    }

    /// All stored blocks `(row, column, block)`, row by row.
    pub fn blocks(&self) -> impl Iterator<Item = (usize, usize, &Block<B>)> {
        (0..self.n_rows()).flat_map(|i| {
            let (cols, blocks) = self.row(i);
            cols.iter().zip(blocks).map(move |(&j, block)| (i, j as usize, block))
        })
    }
}

/// Serialised form: the rows in order, whatever their slots.
#[derive(Serialize, Deserialize)]
struct Rows {
    block_size: usize,
    lengths: Vec<u32>,
    cols: Vec<u32>,
    vals: Vec<f64>,
}

impl<const B: usize> Serialize for BlockCsr<B> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut rows = Rows {
            block_size: B,
            lengths: Vec::with_capacity(self.n_rows()),
            cols: Vec::with_capacity(self.n_blocks()),
            vals: Vec::with_capacity(self.n_blocks() * B * B),
        };
        for i in 0..self.n_rows() {
            let (cols, blocks) = self.row(i);
            rows.lengths.push(cols.len() as u32);
            rows.cols.extend_from_slice(cols);
            rows.vals.extend_from_slice(blocks.as_flattened().as_flattened());
        }
        rows.serialize(serializer)
    }
}

impl<'de, const B: usize> Deserialize<'de> for BlockCsr<B> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let rows = Rows::deserialize(deserializer)?;
        from_rows(&rows).map_err(serde::de::Error::custom)
    }
}

fn from_rows<const B: usize>(rows: &Rows) -> Result<BlockCsr<B>, String> {
    if rows.block_size != B {
        return Err(format!("blocks of size {}, not {B}", rows.block_size));
    }
    let total: usize = rows.lengths.iter().map(|&len| len as usize).sum();
    if rows.cols.len() != total || rows.vals.len() != total * B * B {
        let (cols, vals) = (rows.cols.len(), rows.vals.len());
        return Err(format!("{total} blocks announced, {cols} columns and {vals} numbers given"));
    }
    let values: Vec<Block<B>> =
        rows.vals.chunks_exact(B * B).map(|v| std::array::from_fn(|i| std::array::from_fn(|j| v[i * B + j]))).collect();
    let mut matrix = BlockCsr::new(rows.lengths.len());
    let mut at = 0;
    for (i, &len) in rows.lengths.iter().enumerate() {
        let range = at..at + len as usize;
        at = range.end;
        matrix.set_row(i, &rows.cols[range.clone()], &values[range]).map_err(|e: SparseError| e.to_string())?;
    }
    Ok(matrix)
}
