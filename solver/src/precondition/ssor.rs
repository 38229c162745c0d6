//! Block SSOR, whose sweeps a team can share.
//!
//! Rows are cut into a fixed number of domains of consecutive rows, and domains are coloured so that those of one colour are
//! not coupled. A sweep takes the colours one after the other, and the domains of a colour at the same time: that is the
//! sequential sweep in another order, the same on any number of threads. With nodes ordered for a small bandwidth there are
//! two colours. On the model systems eight domains cost about a tenth more iterations than the order of the rows (79 against
//! 72 static, 44 against 39 at 20 ms), and can be shared by as many threads as a colour has domains: four.

use super::projected::Projected;
use super::scratch::Scratch;
use super::{Preconditioner, PreconditionerError};
use crate::Block;
use crate::memory::{bytes_of, bytes_of_all};
use crate::sparse::{BlockCsr, Rows};
use crate::subspace::Subspace;
use crate::team::Team;
use std::ops::Range;

/// How the sweeps go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SsorSettings {
    /// Relaxation, between 0 and 2.
    pub omega: f64,
    /// Domains that are swept at the same time, 1 to [`Self::MAX_DOMAINS`]; 1 keeps the order of the rows. Systems of a few
    /// rows have fewer.
    pub domains: usize,
}

impl SsorSettings {
    /// More domains than this are not made.
    pub const MAX_DOMAINS: usize = 16;
}

impl Default for SsorSettings {
    fn default() -> Self {
        Self { omega: 1.2, domains: 8 }
    }
}

/// Domains of fewer rows than this are not worth a thread.
const MIN_ROWS: usize = 64;

/// `M = (D/ω + L) (ω/(2 − ω)) D⁺ (D/ω + Lᵀ)`, where `A = L + D + Lᵀ` in the order of the sweep. One application reads each
/// block once, as a product does.
///
/// Source: Saad, *Iterative Methods for Sparse Linear Systems*, 2nd ed. (2003), section 10.2.
#[derive(Clone, Debug, Default)]
pub struct Ssor<const B: usize> {
    a: Projected<B>,
    omega: f64,
    /// Rows of each domain.
    domains: Vec<Range<usize>>,
    /// Colour of each domain, below `n_colours`.
    colours: Vec<usize>,
    n_colours: usize,
    before: Half<B>,
    after: Half<B>,
    /// What domains know of each other.
    shared: Scratch<Vec<f64>>,
}

/// The blocks of every row that come before it in the sweep, or after it.
#[derive(Clone, Debug, Default)]
struct Half<const B: usize> {
    /// Row `i` has the blocks `starts[i]..starts[i + 1]`, those from `inside[i]` on in columns of its own domain.
    starts: Vec<usize>,
    inside: Vec<usize>,
    cols: Vec<u32>,
    vals: Vec<Block<B>>,
}

impl<const B: usize> Ssor<B> {
    /// The preconditioner of `P_W A P_W`; `matrix` must be symmetric.
    ///
    /// # Errors
    /// [`PreconditionerError::Parameter`] if the settings make no sense, [`PreconditionerError::Shape`],
    /// [`PreconditionerError::NotFinite`], [`PreconditionerError::NotPositive`] names a diagonal block without an inverse.
    pub fn new(
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        settings: SsorSettings,
    ) -> Result<Self, PreconditionerError> {
        let mut this = Self::default();
        this.rebuild(matrix, subspace, settings)?;
        Ok(this)
    }

    /// As [`new`](Self::new), in the memory at hand.
    ///
    /// # Errors
    /// As [`new`](Self::new); the preconditioner is then of no use until a rebuild succeeds.
    pub fn rebuild(
        &mut self,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        settings: SsorSettings,
    ) -> Result<(), PreconditionerError> {
        let SsorSettings { omega, domains } = settings;
        if !(omega > 0.0 && omega < 2.0) {
            return Err(PreconditionerError::Parameter { name: "omega", value: omega });
        }
        if !(1..=SsorSettings::MAX_DOMAINS).contains(&domains) {
            return Err(PreconditionerError::Parameter { name: "domains", value: domains as f64 });
        }
        self.a.rebuild(&Team::serial(), matrix, subspace)?;
        self.omega = omega;
        self.shared.get_mut().resize(self.a.dim(), 0.0);
        self.divide(domains);
        self.colour(matrix);
        self.order(matrix);
        Ok(())
    }

    /// Cuts the rows.
    fn divide(&mut self, wanted: usize) {
        let n = self.a.constraints.len();
        let count = wanted.min(n / MIN_ROWS).max(1);
        self.domains.clear();
        self.domains.extend((0..count).map(|d| n * d / count..n * (d + 1) / count));
    }

    /// Gives each domain the first colour that no domain before it which it is coupled with has.
    fn colour(&mut self, matrix: &BlockCsr<B>) {
        self.colours.clear();
        self.n_colours = 0;
        for (d, rows) in self.domains.iter().enumerate() {
            let mut taken = [false; SsorSettings::MAX_DOMAINS];
            for i in rows.clone() {
                for &j in matrix.row(i).0 {
                    // The mirror block may not be stored: both directions count.
                    let e = domain_of(&self.domains, j as usize);
                    if e < d {
                        taken[self.colours[e]] = true;
                    }
                }
            }
            for (e, &colour) in self.colours.iter().enumerate() {
                let reaches = |i: usize| matrix.row(i).0.iter().any(|&j| rows.contains(&(j as usize)));
                taken[colour] |= !taken[colour] && self.domains[e].clone().any(reaches);
            }
            let colour = taken.iter().position(|t| !t).unwrap_or(0); // there are no more domains than colours
            self.colours.push(colour);
            self.n_colours = self.n_colours.max(colour + 1);
        }
    }

    /// Sorts the blocks of every row into those before and after it in the sweep.
    fn order(&mut self, matrix: &BlockCsr<B>) {
        let Self { a, domains, colours, before, after, .. } = self;
        let matrix = a.rows(matrix);
        before.clear();
        after.clear();
        for (d, rows) in domains.iter().enumerate() {
            for i in rows.clone() {
                let (cols, blocks) = matrix.row(i);
                for own in [false, true] {
                    if own {
                        before.inside.push(before.cols.len());
                        after.inside.push(after.cols.len());
                    }
                    for (&j, block) in cols.iter().zip(blocks) {
                        let node = j as usize;
                        if rows.contains(&node) != own || node == i {
                            continue;
                        }
                        let earlier = if own { node < i } else { colours[domain_of(domains, node)] < colours[d] };
                        let half = if earlier { &mut *before } else { &mut *after };
                        half.cols.push(j);
                        half.vals.push(*block);
                    }
                }
                before.starts.push(before.cols.len());
                after.starts.push(after.cols.len());
            }
        }
    }

    /// One colour's part of a sweep: with a right side forward, `z_i ← ω D⁺ ((2 − ω) r_i − Σ A_ij z_j)` over the columns before
    /// `i`; without one backward, `z_i ← z_i − ω D⁺ Σ A_ij z_j` over those after it.
    fn sweep(
        &self,
        team: &Team,
        colour: usize,
        half: &Half<B>,
        forward: Option<&[f64]>,
        z: &mut [f64],
        shared: &[f64],
    ) {
        let mut parts: [(usize, &mut [f64]); SsorSettings::MAX_DOMAINS] = std::array::from_fn(|_| (0, &mut [][..]));
        let mut count = 0;
        let mut rest = z;
        for (d, rows) in self.domains.iter().enumerate() {
            let (part, after) = std::mem::take(&mut rest).split_at_mut(rows.len() * B);
            rest = after;
            if self.colours[d] == colour {
                parts[count] = (d, part);
                count += 1;
            }
        }
        let shared = shared.as_chunks::<B>().0;
        team.each(&mut parts[..count], |_, (d, z)| {
            let (rows, z) = (self.domains[*d].clone(), z.as_chunks_mut::<B>().0);
            // Not compiled for wider vectors: a tenth slower, blocks of nine numbers being shuffled for longer than multiplied.
            match forward {
                Some(r) => {
                    let r = r.as_chunks::<B>().0;
                    for i in rows.clone() {
                        let sum = half.row_times(i, rows.start, shared, z);
                        let scaled = std::array::from_fn(|k| (2.0 - self.omega) * r[i][k] - sum[k]);
                        z[i - rows.start] = self.relax(i, &scaled);
                    }
                }
                None => {
                    for i in rows.clone().rev() {
                        let sum = half.row_times(i, rows.start, shared, z);
                        let change = self.relax(i, &sum);
                        (0..B).for_each(|k| z[i - rows.start][k] -= change[k]);
                    }
                }
            }
        });
    }

    /// `ω D⁺ r` of one node.
    #[inline(always)]
    fn relax(&self, i: usize, r: &[f64; B]) -> [f64; B] {
        let inverse = &self.a.inverses[i];
        std::array::from_fn(|k| self.omega * (1..B).fold(inverse[k][0] * r[0], |sum, l| sum + inverse[k][l] * r[l]))
    }

    /// Lets other domains know what the domains of a colour have found.
    fn publish(&self, colour: usize, z: &[f64], shared: &mut [f64]) {
        if self.domains.len() == 1 {
            return;
        }
        for (rows, of) in self.domains.iter().zip(&self.colours) {
            if *of != colour {
                continue;
            }
            let range = rows.start * B..rows.end * B;
            shared[range.clone()].copy_from_slice(&z[range]);
        }
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let domains = bytes_of(&self.domains) + bytes_of(&self.colours) + bytes_of(&self.shared.lock());
        self.a.memory_bytes() + domains + self.before.memory_bytes() + self.after.memory_bytes()
    }
}

fn domain_of(domains: &[Range<usize>], node: usize) -> usize {
    domains.partition_point(|rows| rows.end <= node)
}

impl<const B: usize> Half<B> {
    fn clear(&mut self) {
        self.starts.clear();
        self.starts.push(0);
        self.inside.clear();
        self.cols.clear();
        self.vals.clear();
    }

    /// The sum of a row: columns of its own domain, which starts at `first`, from `own`, others from `shared`.
    #[inline(always)]
    fn row_times(&self, i: usize, first: usize, shared: &[[f64; B]], own: &[[f64; B]]) -> [f64; B] {
        let mut sums = [[0.0; B]; B];
        let mut add = |range: Range<usize>, x: &[[f64; B]], first: usize| {
            for (&j, block) in self.cols[range.clone()].iter().zip(&self.vals[range]) {
                let x = &x[j as usize - first];
                for k in 0..B {
                    (0..B).for_each(|l| sums[k][l] += block[k][l] * x[l]);
                }
            }
        };
        add(self.starts[i]..self.inside[i], shared, 0);
        add(self.inside[i]..self.starts[i + 1], own, first);
        sums.map(|row| row[1..].iter().fold(row[0], |sum, term| sum + term))
    }

    /// Bytes that it keeps, spare room included.
    fn memory_bytes(&self) -> usize {
        bytes_of_all([&self.starts, &self.inside]) + bytes_of(&self.cols) + bytes_of(&self.vals)
    }
}

impl<const B: usize> Preconditioner for Ssor<B> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.apply_on(&Team::serial(), r, z);
    }

    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        let n = self.a.dim();
        assert!(r.len() == n && z.len() == n, "SSOR of {n} rows");
        let shared = &mut *self.shared.lock();
        for colour in 0..self.n_colours {
            self.sweep(team, colour, &self.before, Some(r), z, shared);
            self.publish(colour, z, shared);
        }
        for colour in (0..self.n_colours).rev() {
            self.sweep(team, colour, &self.after, None, z, shared);
            self.publish(colour, z, shared);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::norm2;

    /// A band matrix of 2x2 blocks, diagonally dominant, and a few couplings far away.
    fn band(n: usize) -> BlockCsr<2> {
        let mut a = BlockCsr::new(n);
        for i in 0..n {
            let mut cols: Vec<usize> = (i.saturating_sub(7)..(i + 8).min(n)).collect();
            if i % 97 == 3 {
                cols.push(n - 1 - i);
            }
            if (n - 1 - i) % 97 == 3 {
                cols.push(n - 1 - i);
            }
            cols.sort_unstable();
            cols.dedup();
            let block = |j: usize| {
                let s = ((i + j) as f64).sin();
                if i == j { [[20.0, 1.0], [1.0, 18.0]] } else { [[s, 0.5], [0.5, -s]] }
            };
            let blocks: Vec<Block<2>> = cols.iter().map(|&j| block(j)).collect();
            let cols: Vec<u32> = cols.into_iter().map(|j| j as u32).collect();
            a.set_row(i, &cols, &blocks).unwrap();
        }
        assert_eq!(a.asymmetry(), 0.0);
        a
    }

    /// `M z = r` by the definition, dense, in the order in which the sweep takes the rows.
    #[test]
    fn agrees_with_the_dense_formula() {
        let n = 400;
        let a = band(n);
        for domains in [1, 2, 6] {
            let omega = 1.3;
            let m = Ssor::new(&a, &Subspace::new(n), SsorSettings { omega, domains }).unwrap();
            assert_eq!(m.domains.len(), domains);
            assert!(domains == 1 || m.n_colours > 1);
            let place = |i: usize| (m.colours[domain_of(&m.domains, i)], i);
            let r: Vec<f64> = (0..2 * n).map(|k| (k as f64 * 0.7).cos()).collect();
            let mut z = vec![f64::NAN; 2 * n];
            m.apply(&r, &mut z);
            let times = |x: &[f64], keep: &dyn Fn(usize, usize) -> Option<f64>| {
                let mut y = vec![0.0; 2 * n];
                for (i, j, block) in a.blocks() {
                    if let Some(scale) = keep(i, j) {
                        (0..2).for_each(|k| (0..2).for_each(|l| y[2 * i + k] += scale * block[k][l] * x[2 * j + l]));
                    }
                }
                y
            };
            let triangle = |i: usize, j: usize, after: bool| match i == j {
                true => Some(1.0 / omega),
                false => ((place(j) > place(i)) == after).then_some(1.0),
            };
            let upper = times(&z, &|i, j| triangle(i, j, true));
            let mut scaled = vec![0.0; 2 * n];
            for i in 0..n {
                let ([[a, b], [c, d]], [x, y]) = (a.diagonal(i), [upper[2 * i], upper[2 * i + 1]]);
                let det = (a * d - b * c) * (2.0 - omega) / omega;
                (scaled[2 * i], scaled[2 * i + 1]) = ((d * x - b * y) / det, (a * y - c * x) / det);
            }
            let mz = times(&scaled, &|i, j| triangle(i, j, false));
            let error: Vec<f64> = mz.iter().zip(&r).map(|(mz, r)| mz - r).collect();
            assert!(norm2(&error) < 1e-12 * norm2(&r), "{domains}: {}", norm2(&error));
        }
    }

    #[test]
    fn domains_of_one_colour_are_not_coupled() {
        let a = band(700);
        let m = Ssor::new(&a, &Subspace::new(700), SsorSettings { omega: 1.0, domains: 8 }).unwrap();
        for (i, j, _) in a.blocks() {
            let (d, e) = (domain_of(&m.domains, i), domain_of(&m.domains, j));
            assert!(d == e || m.colours[d] != m.colours[e]);
        }
    }
}
