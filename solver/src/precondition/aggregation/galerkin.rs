//! The coarse matrix `Pᵀ A P`.
//!
//! Only its upper triangle is computed. Fine rows come one after the other: `(A P)_i` stays in the first-level cache, and is
//! added to the coarse rows that `P_i` reaches. The coarse pattern is found once; as long as those of `A` and of `P` stay,
//! only numbers are redone.

use super::transfer::{Transfer, add_product, add_transposed};
use crate::Block;
use crate::memory::bytes_of;
use crate::precondition::projected::ProjectedRows;
use crate::real::Real;
use crate::simd;
use crate::sparse::{BlockCsr, Rows, RowsMut};
use crate::team::Team;

const ABSENT: u32 = u32::MAX;

/// Patterns, and working memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Galerkin<const B: usize, const M: usize> {
    /// That of the upper triangle of the coarse matrix.
    upper: Pattern,
    /// The pattern of `A P`.
    product: Pattern,
    /// One for each member of a team.
    workers: Vec<Worker<B, M>>,
}

/// Columns of rows, ascending.
#[derive(Clone, Debug, Default)]
struct Pattern {
    starts: Vec<usize>,
    cols: Vec<u32>,
}

impl Pattern {
    #[inline(always)]
    fn row(&self, row: usize) -> &[u32] {
        &self.cols[self.starts[row]..self.starts[row + 1]]
    }

    /// `n` rows; `append(row, met, cols)` appends the columns of a row, ascending. `met` has a place for each of `n_cols`
    /// columns, which no row finds holding its own number.
    fn make(
        &mut self,
        team: &Team,
        (n, n_cols): (usize, usize),
        append: impl Fn(usize, &mut [u32], &mut Vec<u32>) + Sync,
    ) {
        let mut parts: [Self; Team::MAX_MEMBERS] = std::array::from_fn(|_| Self::default());
        team.each(&mut parts[..team.size()], |member, part| {
            let mut met = vec![ABSENT; n_cols];
            for row in n * member / team.size()..n * (member + 1) / team.size() {
                append(row, &mut met, &mut part.cols);
                part.starts.push(part.cols.len());
            }
        });
        self.starts.clear();
        self.cols.clear();
        self.starts.push(0);
        for part in &parts {
            let before = self.cols.len();
            self.starts.extend(part.starts.iter().map(|end| before + end));
            self.cols.extend_from_slice(&part.cols);
        }
    }

    /// That of `A P`.
    fn of_product<const B: usize, const M: usize, T: Real>(
        &mut self,
        team: &Team,
        a: ProjectedRows<B>,
        p: &Transfer<B, M, T>,
    ) {
        self.make(team, (p.n_fine(), p.n_coarse()), |i, met, cols| {
            let start = cols.len();
            for &j in a.row(i).0 {
                add_new(i, p.row(j as usize).0, met, cols);
            }
            cols[start..].sort_unstable();
        });
    }
}

/// Appends those columns that row `row` has not met.
#[inline(always)]
fn add_new(row: usize, candidates: &[u32], met: &mut [u32], cols: &mut Vec<u32>) {
    for &l in candidates {
        if met[l as usize] != row as u32 {
            met[l as usize] = row as u32;
            cols.push(l);
        }
    }
}

impl<const B: usize, const M: usize> Galerkin<B, M> {
    /// Finds the pattern, and gives it to `coarse`.
    pub fn set_pattern<T: Real>(
        &mut self,
        team: &Team,
        a: ProjectedRows<B>,
        p: &Transfer<B, M, T>,
        coarse: &mut BlockCsr<M>,
    ) {
        let n = p.n_coarse();
        self.product.of_product(team, a, p);
        let Self { upper, product, .. } = self;
        upper.make(team, (n, n), |k, met, cols| {
            let start = cols.len();
            for i in p.column(k) {
                let row = product.row(i);
                add_new(k, &row[row.partition_point(|&l| (l as usize) < k)..], met, cols);
            }
            if cols.len() == start {
                cols.push(k as u32); // a coarse node that nothing reaches keeps a diagonal
            }
            cols[start..].sort_unstable();
        });
        *coarse = symmetric(upper);
    }

    /// Redoes the numbers of `coarse`, whose pattern is that of the last [`set_pattern`](Self::set_pattern). Each member of the
    /// team takes some coarse rows; every number is summed over the fine rows in their order, whoever does it.
    pub fn set_numbers<T: Real>(
        &mut self,
        team: &Team,
        a: ProjectedRows<B>,
        p: &Transfer<B, M, T>,
        coarse: &mut BlockCsr<M>,
    ) {
        let Self { upper, workers, product } = self;
        let (n, size) = (p.n_coarse(), team.size());
        workers.resize_with(workers.len().max(size), Worker::default);
        let total = upper.cols.len();
        let bound = |member: usize| upper.starts.partition_point(|s| *s < total * member.min(size) / size).min(n);
        let bounds: [usize; Team::MAX_MEMBERS] = std::array::from_fn(bound);
        let parts = coarse.parts(bounds, n).expect("rows as from_pattern laid them out");
        let mut workers = workers.iter_mut();
        let mut parts = parts.map(|rows| (rows, workers.next()));
        let product = &*product;
        team.each(&mut parts[..size], |_, (rows, worker)| {
            if let Some(worker) = worker {
                worker.place.resize(n, 0);
                Part { rows, product, worker }.run(a, p);
            }
        });
        mirror_between(&bounds, coarse);
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        let patterns = [&self.upper, &self.product];
        let workers: usize =
            self.workers.iter().map(|w| bytes_of(&w.place) + bytes_of(&w.row) + bytes_of(&w.next)).sum();
        patterns.iter().map(|p| bytes_of(&p.starts) + bytes_of(&p.cols)).sum::<usize>() + workers
    }
}

/// Coarse rows, and who computes them.
struct Part<'a, 'b, const B: usize, const M: usize> {
    rows: &'a mut RowsMut<'b, M>,
    /// Of `A P`.
    product: &'a Pattern,
    worker: &'a mut Worker<B, M>,
}

/// Memory for one row of `A P`.
#[derive(Clone, Debug, Default)]
struct Worker<const B: usize, const M: usize> {
    /// Place of a coarse node in the row at hand.
    place: Vec<u32>,
    row: Vec<[[f64; M]; B]>,
    /// By row of the part, the next free place in its lower triangle.
    next: Vec<u32>,
}

impl<const B: usize, const M: usize> Part<'_, '_, B, M> {
    fn run<T: Real>(&mut self, a: ProjectedRows<B>, p: &Transfer<B, M, T>) {
        let mine = self.rows.rows();
        for k in mine.clone() {
            self.rows.row_mut(k).1.fill([[0.0; M]; M]);
        }
        simd::run(
            #[inline(always)]
            || {
                for i in 0..p.n_fine() {
                    let (coarse, blocks) = p.row(i);
                    let from = coarse.partition_point(|k| (*k as usize) < mine.start);
                    let to = coarse.partition_point(|k| (*k as usize) < mine.end);
                    if from < to {
                        let cols = self.product.row(i);
                        // What lies before the first coarse row matters for the lower triangle alone.
                        let cols = &cols[cols.partition_point(|&l| l < coarse[from])..];
                        self.worker.multiply(a, p, i, cols);
                        self.add(cols, &coarse[from..to], &blocks[from..to]);
                    }
                }
            },
        );
        self.mirror();
    }

    /// Adds `P_iᵀ (A P)_i`, where `P_i` has `blocks` in the columns `coarse`, to the upper triangle.
    #[inline(always)]
    fn add<T: Real>(&mut self, product_cols: &[u32], coarse: &[u32], blocks: &[[[T; M]; B]]) {
        for (&k, block) in coarse.iter().zip(blocks) {
            let (cols, row) = self.rows.row_mut(k as usize);
            let mut at = cols.partition_point(|&l| l < k);
            let from = product_cols.partition_point(|&l| l < k);
            for (&l, product) in product_cols[from..].iter().zip(&self.worker.row[from..]) {
                while cols[at] < l {
                    at += 1;
                }
                add_transposed(block, product, &mut row[at]);
            }
        }
    }

    /// Makes the diagonal symmetric, and copies the upper triangle to the lower one as far as both are in this part.
    fn mirror(&mut self) {
        let mine = self.rows.rows();
        let next = &mut self.worker.next;
        next.clear();
        next.extend(mine.clone().map(|l| self.rows.cols(l).partition_point(|&k| (k as usize) < mine.start) as u32));
        for k in mine.clone() {
            let (cols, row) = self.rows.row_mut(k);
            let diagonal = cols.partition_point(|&l| (l as usize) < k);
            let end = cols.partition_point(|&l| (l as usize) < mine.end);
            let block = row[diagonal];
            row[diagonal] = std::array::from_fn(|i| std::array::from_fn(|j| block[i.min(j)][i.max(j)]));
            for at in diagonal + 1..end {
                let (cols, row) = self.rows.row_mut(k);
                let (l, block) = (cols[at] as usize, transposed(&row[at]));
                let place = &mut next[l - mine.start];
                self.rows.row_mut(l).1[*place as usize] = block;
                *place += 1;
            }
        }
    }
}

/// Copies those blocks of the upper triangle to the lower one that lie between two parts.
fn mirror_between<const M: usize>(bounds: &[usize], coarse: &mut BlockCsr<M>) {
    for (part, &start) in bounds.iter().enumerate() {
        let end = bounds.get(part + 1).copied().unwrap_or(coarse.n_rows());
        for k in start..end {
            let from = coarse.row(k).0.partition_point(|&l| (l as usize) < end);
            for at in from..coarse.row(k).0.len() {
                let (cols, row) = coarse.row(k);
                let (l, block) = (cols[at] as usize, transposed(&row[at]));
                *coarse.get_mut(l, k).expect("a symmetric pattern") = block;
            }
        }
    }
}

fn transposed<const M: usize>(block: &Block<M>) -> Block<M> {
    std::array::from_fn(|i| std::array::from_fn(|j| block[j][i]))
}

/// The symmetric matrix of zeros with this upper triangle, whose rows begin with the diagonal.
fn symmetric<const M: usize>(upper: &Pattern) -> BlockCsr<M> {
    let n = upper.starts.len() - 1;
    let mut starts = vec![0; n + 1];
    for k in 0..n {
        starts[k + 1] += upper.row(k).len();
        upper.row(k)[1..].iter().for_each(|&l| starts[l as usize + 1] += 1);
    }
    (0..n).for_each(|k| starts[k + 1] += starts[k]);
    let mut cols = vec![0; starts[n]];
    let mut next = starts.clone();
    for k in 0..n {
        for &l in &upper.row(k)[1..] {
            cols[next[l as usize]] = k as u32;
            next[l as usize] += 1;
        }
        // Those before `k` have all been written: the rest of the row is its upper part.
        cols[next[k]..starts[k + 1]].copy_from_slice(upper.row(k));
    }
    BlockCsr::from_pattern(&starts, &cols).expect("ascending columns of a square matrix")
}

impl<const B: usize, const M: usize> Worker<B, M> {
    /// `(A P)_i` in the coarse columns `cols`, the last ones of its row.
    #[inline(always)]
    fn multiply<T: Real>(&mut self, a: ProjectedRows<B>, p: &Transfer<B, M, T>, i: usize, cols: &[u32]) {
        let Self { place, row, .. } = self;
        let Some(&first) = cols.first() else { return };
        for (at, &l) in cols.iter().enumerate() {
            place[l as usize] = at as u32;
        }
        row.clear();
        row.resize(cols.len(), [[0.0; M]; B]);
        let (neighbours, values) = a.row(i);
        for (&j, value) in neighbours.iter().zip(values) {
            let (coarse, blocks) = p.row(j as usize);
            for (&l, block) in coarse.iter().zip(blocks) {
                if l >= first {
                    add_product(value, block, &mut row[place[l as usize] as usize]);
                }
            }
        }
    }
}
