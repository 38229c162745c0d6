//! The coarse matrix `Pᵀ A P`.
//!
//! Only its upper triangle is computed. Fine rows come one after the other: `(A P)_i` stays in the first-level cache, and is
//! added to the coarse rows that `P_i` reaches. The coarse pattern is found once; as long as those of `A` and of `P` stay,
//! only numbers are redone.

use super::transfer::{Transfer, add_product, add_transposed};
use crate::Block;
use crate::sparse::BlockCsr;
use crate::team::Team;
use pulp::Arch;
use std::ops::Range;

const ABSENT: u32 = u32::MAX;

/// Upper triangle of the coarse matrix, diagonal included, and working memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Galerkin<const B: usize, const M: usize> {
    starts: Vec<usize>,
    cols: Vec<u32>,
    vals: Vec<Block<M>>,
    /// One for each member of a team.
    workers: Vec<Worker<B, M>>,
    /// Next free place in each row of the lower triangle.
    next: Vec<u32>,
}

impl<const B: usize, const M: usize> Galerkin<B, M> {
    /// Finds the pattern, and gives it to `coarse`.
    pub fn set_pattern(&mut self, a: &BlockCsr<B>, p: &Transfer<B, M>, coarse: &mut BlockCsr<M>) {
        let n = p.n_coarse();
        self.workers.clear();
        let mut met_by = vec![ABSENT; n];
        self.cols.clear();
        self.starts.clear();
        self.starts.push(0);
        let mut lower: Vec<u32> = vec![0; n];
        for k in 0..n {
            let start = self.cols.len();
            for i in p.column(k) {
                for &j in a.row(i).0 {
                    for &l in p.row(j as usize).0 {
                        if l as usize >= k && met_by[l as usize] != k as u32 {
                            met_by[l as usize] = k as u32;
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

    /// Redoes the numbers of `coarse`, whose pattern is that of the last [`set_pattern`](Self::set_pattern). Each member of the
    /// team takes some coarse rows; every number is summed over the fine rows in their order, whoever does it.
    pub fn set_numbers(&mut self, team: &Team, a: &BlockCsr<B>, p: &Transfer<B, M>, coarse: &mut BlockCsr<M>) {
        self.vals.fill([[0.0; M]; M]);
        let Self { starts, cols, vals, workers, .. } = self;
        let size = team.size();
        if workers.len() < size {
            workers.resize_with(size, Worker::default);
        }
        let (mut workers, mut rest) = (workers.iter_mut(), &mut vals[..]);
        let (n, total) = (starts.len() - 1, cols.len());
        let bound = |member: usize| starts.partition_point(|s| *s < total * member / size).min(n);
        let mut parts: [Option<Part<B, M>>; Team::MAX_MEMBERS] = std::array::from_fn(|member| {
            let rows = if member < size { bound(member)..bound(member + 1) } else { return None };
            let (vals, after) = std::mem::take(&mut rest).split_at_mut(starts[rows.end] - starts[rows.start]);
            rest = after;
            let worker = workers.next()?;
            worker.place.resize(n, ABSENT);
            Some(Part { rows, starts, cols, vals, worker })
        });
        team.each(&mut parts[..size], |_, part| {
            if let Some(part) = part {
                part.run(a, p);
            }
        });
        self.write(coarse);
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

/// Coarse rows, and who computes them.
struct Part<'a, const B: usize, const M: usize> {
    rows: Range<usize>,
    starts: &'a [usize],
    cols: &'a [u32],
    /// Of `rows` alone.
    vals: &'a mut [Block<M>],
    worker: &'a mut Worker<B, M>,
}

/// Memory for one row of `A P`.
#[derive(Clone, Debug, Default)]
struct Worker<const B: usize, const M: usize> {
    /// Place of a coarse node in the row at hand, or [`ABSENT`].
    place: Vec<u32>,
    cols: Vec<u32>,
    row: Vec<[[f64; M]; B]>,
}

impl<const B: usize, const M: usize> Part<'_, B, M> {
    fn run(&mut self, a: &BlockCsr<B>, p: &Transfer<B, M>) {
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for i in 0..p.n_fine() {
                    let (coarse, blocks) = p.row(i);
                    let from = coarse.partition_point(|k| (*k as usize) < self.rows.start);
                    let to = coarse.partition_point(|k| (*k as usize) < self.rows.end);
                    if from < to {
                        self.worker.multiply(a, p, i, coarse[from]);
                        self.add(&coarse[from..to], &blocks[from..to]);
                    }
                }
            },
        );
    }

    /// Adds `P_iᵀ (A P)_i`, where `P_i` has `blocks` in the columns `coarse`.
    #[inline(always)]
    fn add(&mut self, coarse: &[u32], blocks: &[[[f64; M]; B]]) {
        let Worker { cols: row_cols, row, .. } = &*self.worker;
        let before = self.starts[self.rows.start];
        for (&k, block) in coarse.iter().zip(blocks) {
            let range = self.starts[k as usize]..self.starts[k as usize + 1];
            let cols = &self.cols[range.clone()];
            let vals = &mut self.vals[range.start - before..range.end - before];
            let from = row_cols.partition_point(|&l| l < k);
            let mut at = 0;
            for (&l, product) in row_cols[from..].iter().zip(&row[from..]) {
                while cols[at] < l {
                    at += 1;
                }
                add_transposed(block, product, &mut vals[at]);
            }
        }
    }
}

impl<const B: usize, const M: usize> Worker<B, M> {
    /// `(A P)_i` in the coarse columns from `first` on, ascending: what lies before matters for the lower triangle alone.
    #[inline(always)]
    fn multiply(&mut self, a: &BlockCsr<B>, p: &Transfer<B, M>, i: usize, first: u32) {
        let Self { place, cols, row } = self;
        cols.clear();
        let (neighbours, values) = a.row(i);
        for &j in neighbours {
            for &l in p.row(j as usize).0 {
                if l >= first && place[l as usize] == ABSENT {
                    place[l as usize] = 0;
                    cols.push(l);
                }
            }
        }
        cols.sort_unstable();
        for (at, &l) in cols.iter().enumerate() {
            place[l as usize] = at as u32;
        }
        row.clear();
        row.resize(cols.len(), [[0.0; M]; B]);
        for (&j, value) in neighbours.iter().zip(values) {
            let (coarse, blocks) = p.row(j as usize);
            for (&l, block) in coarse.iter().zip(blocks) {
                if l >= first {
                    add_product(value, block, &mut row[place[l as usize] as usize]);
                }
            }
        }
        for &l in &*cols {
            place[l as usize] = ABSENT;
        }
    }
}
