//! The prolongator `P`: rows of blocks, and the way through them by columns.

use super::aggregates::{Aggregates, NONE};
use crate::precondition::projected::Projected;
use crate::sparse::BlockCsr;
use crate::team::Team;
use pulp::Arch;
use std::ops::Range;

/// `P` from a coarse level with `M` numbers per node to a fine one with `B`.
#[derive(Clone, Debug, Default)]
pub(super) struct Transfer<const B: usize, const M: usize> {
    /// Entries of fine node `i` are those from `starts[i]` to `starts[i + 1]`, coarse nodes ascending.
    starts: Vec<usize>,
    coarse: Vec<u32>,
    blocks: Vec<[[f64; M]; B]>,
    /// Entries of coarse node `k` are those that `column_starts[k]..column_starts[k + 1]` of `entries` name, fine nodes
    /// ascending: the fine node, and its place in `blocks`.
    column_starts: Vec<usize>,
    entries: Vec<(u32, u32)>,
    /// Place of a coarse node in the row at hand.
    place: Vec<u32>,
}

impl<const B: usize, const M: usize> Transfer<B, M> {
    /// The pattern: a node gets its own aggregate and, if `smoothed`, those of its neighbours in `a`.
    pub fn set_pattern(&mut self, a: &BlockCsr<B>, aggregates: &Aggregates, smoothed: bool) {
        self.starts.clear();
        self.coarse.clear();
        self.starts.push(0);
        for (i, &own) in aggregates.of.iter().enumerate() {
            let start = self.coarse.len();
            if smoothed {
                self.coarse.extend(a.row(i).0.iter().map(|&j| aggregates.of[j as usize]));
            }
            self.coarse.push(own);
            self.coarse[start..].sort_unstable();
            let mut end = start;
            for at in start..self.coarse.len() {
                let aggregate = self.coarse[at];
                if aggregate != NONE && (end == start || self.coarse[end - 1] != aggregate) {
                    self.coarse[end] = aggregate;
                    end += 1;
                }
            }
            self.coarse.truncate(end);
            self.starts.push(end);
        }
        self.blocks.clear();
        self.blocks.resize(self.coarse.len(), [[0.0; M]; B]);
        self.place.clear();
        self.place.resize(aggregates.count(), 0);
        self.set_columns(aggregates.count());
    }

    fn set_columns(&mut self, count: usize) {
        self.column_starts.clear();
        self.column_starts.resize(count + 1, 0);
        self.coarse.iter().for_each(|&k| self.column_starts[k as usize + 1] += 1);
        (0..count).for_each(|k| self.column_starts[k + 1] += self.column_starts[k]);
        self.entries.clear();
        self.entries.resize(self.coarse.len(), (0, 0));
        let mut next = self.column_starts.clone();
        for i in 0..self.n_fine() {
            for at in self.starts[i]..self.starts[i + 1] {
                let k = self.coarse[at] as usize;
                self.entries[next[k]] = (i as u32, at as u32);
                next[k] += 1;
            }
        }
    }

    /// `P = (I − ω D⁺ A) Q`, where `Q` has the block `q[i]` for node `i` and its aggregate.
    pub fn set_numbers(&mut self, a: &Projected<B>, q: &[[[f64; M]; B]], aggregates: &Aggregates, omega: f64) {
        let Self { starts, coarse, blocks, place, .. } = self;
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for (i, &own) in aggregates.of.iter().enumerate() {
                    let range = starts[i]..starts[i + 1];
                    let row = &mut blocks[range.clone()];
                    row.fill([[0.0; M]; B]);
                    for (at, &k) in coarse[range].iter().enumerate() {
                        place[k as usize] = at as u32;
                    }
                    if omega != 0.0 {
                        let (cols, values) = a.matrix.row(i);
                        for (&j, value) in cols.iter().zip(values) {
                            let aggregate = aggregates.of[j as usize];
                            if aggregate != NONE {
                                let sum = &mut row[place[aggregate as usize] as usize];
                                add_product(value, &q[j as usize], sum);
                            }
                        }
                        let damped = a.inverses[i].map(|row| row.map(|v| -omega * v));
                        for block in row.iter_mut() {
                            let sum = std::mem::replace(block, [[0.0; M]; B]);
                            add_product(&damped, &sum, block);
                        }
                    }
                    if own != NONE {
                        let block = &mut row[place[own as usize] as usize];
                        for (sum, value) in block.as_flattened_mut().iter_mut().zip(q[i].as_flattened()) {
                            *sum += value;
                        }
                    }
                }
            },
        );
    }

    pub fn n_fine(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    pub fn n_coarse(&self) -> usize {
        self.column_starts.len().saturating_sub(1)
    }

    /// Coarse nodes of a fine one, ascending, and the blocks.
    #[inline(always)]
    pub fn row(&self, fine: usize) -> (&[u32], &[[[f64; M]; B]]) {
        let range = self.starts[fine]..self.starts[fine + 1];
        (&self.coarse[range.clone()], &self.blocks[range])
    }

    /// Fine nodes of a coarse one, ascending.
    pub fn column(&self, coarse: usize) -> impl Iterator<Item = usize> {
        self.entries[self.column_range(coarse)].iter().map(|(i, _)| *i as usize)
    }

    fn column_range(&self, coarse: usize) -> Range<usize> {
        self.column_starts[coarse]..self.column_starts[coarse + 1]
    }

    /// `f ← Pᵀ r`.
    pub fn restrict(&self, team: &Team, r: &[f64], f: &mut [f64]) {
        let n = f.len();
        let r = r.as_chunks::<B>().0;
        let mut parts = team.split(f);
        team.each(&mut parts[..team.size()], |member, f| {
            let first = team.share(n, member).start / M;
            Arch::new().dispatch(
                #[inline(always)]
                || {
                    for (k, f) in f.as_chunks_mut::<M>().0.iter_mut().enumerate() {
                        let mut sum = [0.0; M];
                        for &(i, at) in &self.entries[self.column_range(first + k)] {
                            let (block, r) = (&self.blocks[at as usize], &r[i as usize]);
                            for (row, r) in block.iter().zip(r) {
                                (0..M).for_each(|m| sum[m] += row[m] * r);
                            }
                        }
                        *f = sum;
                    }
                },
            );
        });
    }

    /// `x ← P e`.
    pub fn prolong(&self, team: &Team, e: &[f64], x: &mut [f64]) {
        let n = x.len();
        let e = e.as_chunks::<M>().0;
        let mut parts = team.split(x);
        team.each(&mut parts[..team.size()], |member, x| {
            let first = team.share(n, member).start / B;
            Arch::new().dispatch(
                #[inline(always)]
                || {
                    for (i, x) in x.as_chunks_mut::<B>().0.iter_mut().enumerate() {
                        let mut sums = [[0.0; M]; B];
                        let (coarse, blocks) = self.row(first + i);
                        for (&k, block) in coarse.iter().zip(blocks) {
                            let e = &e[k as usize];
                            for (sums, row) in sums.iter_mut().zip(block) {
                                (0..M).for_each(|m| sums[m] += row[m] * e[m]);
                            }
                        }
                        *x = sums.map(|row| row[1..].iter().fold(row[0], |sum, term| sum + term));
                    }
                },
            );
        });
    }
}

/// `c ← c + a b`.
#[inline(always)]
pub(super) fn add_product<const B: usize, const M: usize>(a: &[[f64; B]; B], b: &[[f64; M]; B], c: &mut [[f64; M]; B]) {
    for (c, a) in c.iter_mut().zip(a) {
        for (a, b) in a.iter().zip(b) {
            (0..M).for_each(|m| c[m] += a * b[m]);
        }
    }
}

/// `c ← c + aᵀ b`.
#[inline(always)]
pub(super) fn add_transposed<const B: usize, const M: usize>(
    a: &[[f64; M]; B],
    b: &[[f64; M]; B],
    c: &mut [[f64; M]; M],
) {
    for (a, b) in a.iter().zip(b) {
        for (c, a) in c.iter_mut().zip(a) {
            (0..M).for_each(|m| c[m] += a * b[m]);
        }
    }
}
