//! The prolongator `P`: rows of blocks, and the way through them by columns.

use super::aggregates::{Aggregates, NONE};
use crate::Block;
use crate::memory::{bytes_of, bytes_of_all};
use crate::precondition::projected::ProjectedRows;
use crate::real::Real;
use crate::simd;
use crate::sparse::Rows;
use crate::team::Team;
use std::ops::Range;

/// `P` from a coarse level with `M` numbers per node to a fine one with `B`.
#[derive(Clone, Debug, Default)]
pub(super) struct Transfer<const B: usize, const M: usize, T: Real = f64> {
    /// Entries of fine node `i` are those from `starts[i]` to `starts[i + 1]`, coarse nodes ascending.
    starts: Vec<usize>,
    coarse: Vec<u32>,
    blocks: Vec<[[T; M]; B]>,
    /// Entries of coarse node `k` are those that `column_starts[k]..column_starts[k + 1]` of `entries` name, fine nodes
    /// ascending: the fine node, and its place in `blocks`.
    column_starts: Vec<usize>,
    entries: Vec<(u32, u32)>,
    /// One for each member of a team.
    workers: Vec<Worker<B, M>>,
}

/// Memory for one row.
#[derive(Clone, Debug, Default)]
struct Worker<const B: usize, const M: usize> {
    /// Place of a coarse node in the row at hand.
    place: Vec<u32>,
    row: Vec<[[f64; M]; B]>,
}

impl<const B: usize, const M: usize, T: Real> Transfer<B, M, T> {
    /// The pattern: a node gets its own aggregate and, if `smoothed`, those of its neighbours in `a`.
    pub fn set_pattern(&mut self, a: ProjectedRows<B>, aggregates: &Aggregates, smoothed: bool) {
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
        self.blocks.resize(self.coarse.len(), [[T::ZERO; M]; B]);
        self.workers.clear();
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
    pub fn set_numbers(&mut self, team: &Team, step: JacobiStep<B, T>, q: &[[[f64; M]; B]], aggregates: &Aggregates) {
        let Self { starts, coarse, blocks, workers, .. } = self;
        let (size, n) = (team.size(), aggregates.of.len());
        if workers.len() < size {
            workers.resize_with(size, Worker::default);
        }
        let (mut workers, mut rest) = (workers.iter_mut(), &mut blocks[..]);
        let bound = |member: usize| n * member / size;
        let mut parts: [Option<_>; Team::MAX_MEMBERS] = std::array::from_fn(|member| {
            let rows = if member < size { bound(member)..bound(member + 1) } else { return None };
            let (blocks, after) = std::mem::take(&mut rest).split_at_mut(starts[rows.end] - starts[rows.start]);
            rest = after;
            let worker = workers.next()?;
            worker.place.resize(aggregates.count(), 0);
            Some((rows, blocks, worker))
        });
        let (starts, coarse) = (&starts[..], &coarse[..]);
        team.each(&mut parts[..size], |_, part| {
            let Some((rows, blocks, worker)) = part else { return };
            simd::run(
                #[inline(always)]
                || {
                    let first = starts[rows.start];
                    for i in rows.clone() {
                        let range = starts[i]..starts[i + 1];
                        worker.row(&step, q, aggregates, i, &coarse[range.clone()]);
                        for (block, sum) in blocks[range.start - first..range.end - first].iter_mut().zip(&worker.row) {
                            *block = sum.map(|row| row.map(T::from_f64));
                        }
                    }
                },
            );
        });
    }

    pub fn n_fine(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    pub fn n_coarse(&self) -> usize {
        self.column_starts.len().saturating_sub(1)
    }

    /// Coarse nodes of a fine one, ascending, and the blocks.
    #[inline(always)]
    pub fn row(&self, fine: usize) -> (&[u32], &[[[T; M]; B]]) {
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
    pub fn restrict(&self, team: &Team, r: &[T], f: &mut [T]) {
        let n = f.len();
        let r = r.as_chunks::<B>().0;
        let mut parts = team.split(f);
        team.each(&mut parts[..team.size()], |member, f| {
            let first = team.share(n, member).start / M;
            simd::run(
                #[inline(always)]
                || {
                    for (k, f) in f.as_chunks_mut::<M>().0.iter_mut().enumerate() {
                        let mut sum = [T::ZERO; M];
                        for &(i, at) in &self.entries[self.column_range(first + k)] {
                            let (block, r) = (&self.blocks[at as usize], &r[i as usize]);
                            for (row, r) in block.iter().zip(r) {
                                (0..M).for_each(|m| sum[m] += row[m] * *r);
                            }
                        }
                        *f = sum;
                    }
                },
            );
        });
    }

    /// `x ← P e`.
    pub fn prolong(&self, team: &Team, e: &[T], x: &mut [T]) {
        let n = x.len();
        let e = e.as_chunks::<M>().0;
        let mut parts = team.split(x);
        team.each(&mut parts[..team.size()], |member, x| {
            let first = team.share(n, member).start / B;
            simd::run(
                #[inline(always)]
                || {
                    for (i, x) in x.as_chunks_mut::<B>().0.iter_mut().enumerate() {
                        let mut sums = [[T::ZERO; M]; B];
                        let (coarse, blocks) = self.row(first + i);
                        for (&k, block) in coarse.iter().zip(blocks) {
                            let e = &e[k as usize];
                            for (sums, row) in sums.iter_mut().zip(block) {
                                (0..M).for_each(|m| sums[m] += row[m] * e[m]);
                            }
                        }
                        *x = sums.map(|row| row[1..].iter().fold(row[0], |sum, term| sum + *term));
                    }
                },
            );
        });
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        let workers: usize = self.workers.iter().map(|w| bytes_of(&w.place) + bytes_of(&w.row)).sum();
        bytes_of_all([&self.starts, &self.column_starts])
            + bytes_of(&self.coarse)
            + bytes_of(&self.blocks)
            + bytes_of(&self.entries)
            + workers
    }
}

/// What smooths the prolongator: a step of damped Jacobi, `I − ω D⁺ A`.
#[derive(Clone, Copy)]
pub(super) struct JacobiStep<'a, const B: usize, T: Real> {
    pub a: ProjectedRows<'a, B>,
    /// `D⁺`.
    pub inverses: &'a [Block<B, T>],
    /// `ω`; 0 leaves the prolongator tentative.
    pub omega: f64,
}

impl<const B: usize, const M: usize> Worker<B, M> {
    /// Row `i` of `(I − ω D⁺ A) Q`, which has the columns `coarse`.
    #[inline(always)]
    fn row<T: Real>(
        &mut self,
        step: &JacobiStep<B, T>,
        q: &[[[f64; M]; B]],
        aggregates: &Aggregates,
        i: usize,
        coarse: &[u32],
    ) {
        let Self { place, row } = self;
        row.clear();
        row.resize(coarse.len(), [[0.0; M]; B]);
        for (at, &k) in coarse.iter().enumerate() {
            place[k as usize] = at as u32;
        }
        if step.omega != 0.0 {
            let (cols, values) = step.a.row(i);
            for (&j, value) in cols.iter().zip(values) {
                let aggregate = aggregates.of[j as usize];
                if aggregate != NONE {
                    add_product(value, &q[j as usize], &mut row[place[aggregate as usize] as usize]);
                }
            }
            let damped = step.inverses[i].map(|row| row.map(|v| -step.omega * v.to_f64()));
            for block in row.iter_mut() {
                let sum = std::mem::replace(block, [[0.0; M]; B]);
                add_product(&damped, &sum, block);
            }
        }
        let own = aggregates.of[i];
        if own != NONE {
            let block = &mut row[place[own as usize] as usize];
            for (sum, value) in block.as_flattened_mut().iter_mut().zip(q[i].as_flattened()) {
                *sum += value;
            }
        }
    }
}

/// `c ← c + a b`.
#[inline(always)]
pub(super) fn add_product<const B: usize, const M: usize, T: Real>(
    a: &[[f64; B]; B],
    b: &[[T; M]; B],
    c: &mut [[f64; M]; B],
) {
    let b = b.map(|row| row.map(T::to_f64));
    for i in 0..B {
        for j in 0..B {
            (0..M).for_each(|m| c[i][m] += a[i][j] * b[j][m]);
        }
    }
}

/// `c ← c + aᵀ b`.
#[inline(always)]
pub(super) fn add_transposed<const B: usize, const M: usize, T: Real>(
    a: &[[T; M]; B],
    b: &[[f64; M]; B],
    c: &mut [[f64; M]; M],
) {
    for i in 0..M {
        for j in 0..B {
            let a = a[j][i].to_f64();
            (0..M).for_each(|m| c[i][m] += a * b[j][m]);
        }
    }
}
