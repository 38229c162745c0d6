//! The coarse matrix `Pᵀ A P`.
//!
//! Only its upper triangle is computed. Fine rows come one after the other: `(A P)_i` stays in the first-level cache, and is
//! added to the coarse rows that `P_i` reaches. The coarse pattern is found once; as long as those of `A` and of `P` stay,
//! only numbers are redone.

use super::transfer::{Transfer, add_product, add_transposed};
use crate::Block;
use crate::sparse::BlockCsr;
use pulp::Arch;

const ABSENT: u32 = u32::MAX;

/// Upper triangle of the coarse matrix, diagonal included, and working memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Galerkin<const B: usize, const M: usize> {
    starts: Vec<usize>,
    cols: Vec<u32>,
    vals: Vec<Block<M>>,
    /// Place of a coarse node in the row of `A P` at hand, or [`ABSENT`].
    place: Vec<u32>,
    /// The row of `A P` at hand.
    row_cols: Vec<u32>,
    row: Vec<[[f64; M]; B]>,
    /// Next free place in each row of the lower triangle.
    next: Vec<u32>,
}

impl<const B: usize, const M: usize> Galerkin<B, M> {
    /// Finds the pattern, and gives it to `coarse`.
    pub fn set_pattern(&mut self, a: &BlockCsr<B>, p: &Transfer<B, M>, coarse: &mut BlockCsr<M>) {
        let n = p.n_coarse();
        self.place.clear();
        self.place.resize(n, ABSENT);
        self.cols.clear();
        self.starts.clear();
        self.starts.push(0);
        let mut lower: Vec<u32> = vec![0; n];
        for k in 0..n {
            let start = self.cols.len();
            for i in p.column(k) {
                for &j in a.row(i).0 {
                    for &l in p.row(j as usize).0 {
                        if l as usize >= k && self.place[l as usize] != k as u32 {
                            self.place[l as usize] = k as u32;
                            self.cols.push(l);
                        }
                    }
                }
            }
            if self.cols.len() == start {
                self.cols.push(k as u32); // a coarse node that nothing reaches keeps a diagonal
            }
            self.cols[start..].sort_unstable();
            self.cols[start + 1..].iter().for_each(|&l| lower[l as usize] += 1);
            self.starts.push(self.cols.len());
        }
        self.place.fill(ABSENT);
        self.vals.clear();
        self.vals.resize(self.cols.len(), [[0.0; M]; M]);
        self.next = lower;
        self.set_rows(coarse);
    }

    /// Writes the whole rows of the coarse pattern, with zeros.
    fn set_rows(&mut self, coarse: &mut BlockCsr<M>) {
        let n = self.starts.len() - 1;
        *coarse = BlockCsr::new(n);
        let mut starts = vec![0; n + 1];
        for k in 0..n {
            starts[k + 1] = starts[k] + self.next[k] as usize + self.starts[k + 1] - self.starts[k];
        }
        let mut cols = vec![0; starts[n]];
        let mut next = starts.clone();
        for k in 0..n {
            for &l in &self.cols[self.starts[k]..self.starts[k + 1]] {
                if l as usize != k {
                    cols[next[l as usize]] = k as u32;
                    next[l as usize] += 1;
                }
            }
            // Those before `k` have all been written: the rest of the row is its upper part.
            cols[next[k]..starts[k + 1]].copy_from_slice(&self.cols[self.starts[k]..self.starts[k + 1]]);
        }
        let longest = starts.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(0);
        let zeros = vec![[[0.0; M]; M]; longest];
        for k in 0..n {
            let row = &cols[starts[k]..starts[k + 1]];
            coarse.set_row(k, row, &zeros[..row.len()]).expect("ascending columns, and finite blocks");
        }
    }

    /// Redoes the numbers of `coarse`, whose pattern is that of the last [`set_pattern`](Self::set_pattern).
    pub fn set_numbers(&mut self, a: &BlockCsr<B>, p: &Transfer<B, M>, coarse: &mut BlockCsr<M>) {
        self.vals.fill([[0.0; M]; M]);
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for i in 0..p.n_fine() {
                    self.multiply_row(a, p, i);
                    self.add_row(p, i);
                }
            },
        );
        self.write(coarse);
    }

    /// `(A P)_i`, coarse nodes ascending; those below the first of `P_i` only matter for the lower triangle.
    #[inline(always)]
    fn multiply_row(&mut self, a: &BlockCsr<B>, p: &Transfer<B, M>, i: usize) {
        self.row_cols.clear();
        let Some(&first) = p.row(i).0.first() else { return };
        let (neighbours, values) = a.row(i);
        for &j in neighbours {
            for &l in p.row(j as usize).0 {
                if l >= first && self.place[l as usize] == ABSENT {
                    self.place[l as usize] = 0;
                    self.row_cols.push(l);
                }
            }
        }
        self.row_cols.sort_unstable();
        for (at, &l) in self.row_cols.iter().enumerate() {
            self.place[l as usize] = at as u32;
        }
        self.row.clear();
        self.row.resize(self.row_cols.len(), [[0.0; M]; B]);
        for (&j, value) in neighbours.iter().zip(values) {
            let (coarse, blocks) = p.row(j as usize);
            for (&l, block) in coarse.iter().zip(blocks) {
                if l >= first {
                    add_product(value, block, &mut self.row[self.place[l as usize] as usize]);
                }
            }
        }
        for &l in &self.row_cols {
            self.place[l as usize] = ABSENT;
        }
    }

    /// Adds `P_iᵀ (A P)_i`.
    #[inline(always)]
    fn add_row(&mut self, p: &Transfer<B, M>, i: usize) {
        let (coarse, blocks) = p.row(i);
        for (&k, block) in coarse.iter().zip(blocks) {
            let range = self.starts[k as usize]..self.starts[k as usize + 1];
            let (cols, vals) = (&self.cols[range.clone()], &mut self.vals[range]);
            let from = self.row_cols.partition_point(|&l| l < k);
            let mut at = 0;
            for (&l, product) in self.row_cols[from..].iter().zip(&self.row[from..]) {
                while cols[at] < l {
                    at += 1;
                }
                add_transposed(block, product, &mut vals[at]);
            }
        }
    }

    /// Copies the upper triangle to its places and, transposed, to the lower ones.
    fn write(&mut self, coarse: &mut BlockCsr<M>) {
        self.next.fill(0);
        for k in 0..self.next.len() {
            let upper = self.starts[k]..self.starts[k + 1];
            let (cols, row) = coarse.row_mut(k);
            let lower = cols.len() - upper.len();
            row[lower..].copy_from_slice(&self.vals[upper.clone()]);
            let diagonal = &mut row[lower];
            *diagonal = std::array::from_fn(|i| std::array::from_fn(|j| diagonal[i.min(j)][i.max(j)]));
            for at in upper.start + 1..upper.end {
                let (l, block) = (self.cols[at] as usize, &self.vals[at]);
                coarse.row_mut(l).1[self.next[l] as usize] =
                    std::array::from_fn(|i| std::array::from_fn(|j| block[j][i]));
                self.next[l] += 1;
            }
        }
    }
}
