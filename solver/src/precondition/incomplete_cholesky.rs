//! Block incomplete Cholesky factors without fill.

use super::projected::Projected;
use super::restricted::{product, restricted_inverse};
use super::{Preconditioner, PreconditionerError};
use crate::Block;
use crate::memory::{bytes_of, bytes_of_all};
use crate::sparse::{BlockCsr, Rows};
use crate::subspace::Subspace;
use crate::team::Team;

/// The first shift that is tried when the factorisation breaks down, relative to the diagonal blocks.
const FIRST_SHIFT: f64 = 1e-3;
/// How shifts grow.
const SHIFT_GROWTH: f64 = 4.0;
/// Shifts above this are not tried: little of the matrix would be left.
const LAST_SHIFT: f64 = 20.0;

/// `M = (I + G) D (I + G)ᵀ`, where `G` has the pattern of the lower triangle of `A`, in the order of the nodes given, and `M`
/// agrees with `A` on the pattern of `A`.
///
/// A pivot block that is not positive definite on the allowed moves of its node ends an attempt; the next one factors
/// `A + s D_A` with a larger shift `s`, which [`shift`](Self::shift) reports. Solves go node by node, so a team leaves them to
/// the calling thread.
///
/// Source: Meijerink & van der Vorst, Math. Comp. 31 (1977); the shift is that of Manteuffel, Math. Comp. 34 (1980).
#[derive(Clone, Debug, Default)]
pub struct IncompleteCholesky<const B: usize> {
    a: Projected<B>,
    /// Row `i` of `G` has the blocks `starts[i]..starts[i + 1]`.
    starts: Vec<usize>,
    cols: Vec<u32>,
    g: Vec<Block<B>>,
    /// `D⁺`.
    inverses: Vec<Block<B>>,
    /// The row of `G D` at hand.
    row: Vec<Block<B>>,
    shift: f64,
}

impl<const B: usize> IncompleteCholesky<B> {
    /// The preconditioner of `P_W A P_W`; of `matrix`, which must be symmetric, the lower triangle is read.
    ///
    /// # Errors
    /// [`PreconditionerError::Shape`], [`PreconditionerError::NotFinite`], [`PreconditionerError::NotPositive`] names a
    /// diagonal block without an inverse, [`PreconditionerError::Breakdown`] if no shift helps.
    pub fn new(matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<Self, PreconditionerError> {
        let mut this = Self::default();
        this.rebuild(matrix, subspace)?;
        Ok(this)
    }

    /// As [`new`](Self::new), in the memory at hand.
    ///
    /// # Errors
    /// As [`new`](Self::new); the preconditioner is then of no use until a rebuild succeeds.
    pub fn rebuild(&mut self, matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<(), PreconditionerError> {
        self.a.rebuild(&Team::serial(), matrix, subspace)?;
        self.set_pattern(matrix);
        self.shift = 0.0;
        while let Err((row, pivot)) = self.factor(matrix) {
            let shift = self.shift;
            self.shift = if shift == 0.0 { FIRST_SHIFT } else { SHIFT_GROWTH * shift };
            if self.shift > LAST_SHIFT {
                return Err(PreconditionerError::Breakdown { row, pivot, shift });
            }
        }
        Ok(())
    }

    /// The `s` of the matrix `A + s D_A` that was factored; 0 unless `A` itself has no such factor.
    #[must_use]
    pub fn shift(&self) -> f64 {
        self.shift
    }

    fn set_pattern(&mut self, matrix: &BlockCsr<B>) {
        let n = matrix.n_rows();
        self.starts.clear();
        self.starts.push(0);
        self.cols.clear();
        for i in 0..n {
            self.cols.extend(matrix.row(i).0.iter().take_while(|j| (**j as usize) < i));
            self.starts.push(self.cols.len());
        }
        self.g.resize(self.cols.len(), [[0.0; B]; B]);
        self.inverses.resize(n, [[0.0; B]; B]);
    }

    /// One attempt; `Err` holds the row and the pivot that ended it.
    fn factor(&mut self, matrix: &BlockCsr<B>) -> Result<(), (usize, f64)> {
        let Self { a, starts, cols, g, inverses, row, shift } = self;
        let rows = a.rows(matrix);
        for i in 0..rows.n_rows() {
            let own = starts[i]..starts[i + 1];
            let lower = &cols[own.clone()];
            row.clear();
            row.extend_from_slice(&rows.row(i).1[..lower.len()]);
            // (G D)_ij = A_ij − Σ_k (G D)_ik G_jkᵀ
            for (at, &j) in lower.iter().enumerate() {
                let range = starts[j as usize]..starts[j as usize + 1];
                let (done, rest) = row.split_at_mut(at);
                for_common(&lower[..at], &cols[range.clone()], |k, l| {
                    subtract_product_transposed(&done[k], &g[range.start + l], &mut rest[0]);
                });
            }
            // D_i = (1 + s) A_ii − Σ_j (G D)_ij G_ijᵀ
            let mut pivot = rows.diagonal(i).map(|row| row.map(|v| (1.0 + *shift) * v));
            for ((&j, gd), g) in lower.iter().zip(&*row).zip(&mut g[own]) {
                *g = product(gd, &inverses[j as usize]);
                subtract_product_transposed(gd, g, &mut pivot);
            }
            inverses[i] = restricted_inverse(&pivot, &a.constraints[i]).map_err(|pivot| (i, pivot))?;
        }
        Ok(())
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.a.memory_bytes()
            + bytes_of(&self.starts)
            + bytes_of(&self.cols)
            + bytes_of_all([&self.g, &self.inverses, &self.row])
    }
}

/// Calls `f` with the places of every column that both ascending lists have.
#[inline(always)]
fn for_common(left: &[u32], right: &[u32], mut f: impl FnMut(usize, usize)) {
    let (mut k, mut l) = (0, 0);
    while k < left.len() && l < right.len() {
        match left[k].cmp(&right[l]) {
            std::cmp::Ordering::Less => k += 1,
            std::cmp::Ordering::Greater => l += 1,
            std::cmp::Ordering::Equal => {
                f(k, l);
                (k, l) = (k + 1, l + 1);
            }
        }
    }
}

/// `c ← c − a bᵀ`.
#[inline(always)]
fn subtract_product_transposed<const B: usize>(a: &Block<B>, b: &Block<B>, c: &mut Block<B>) {
    for i in 0..B {
        for j in 0..B {
            c[i][j] -= (0..B).map(|k| a[i][k] * b[j][k]).sum::<f64>();
        }
    }
}

impl<const B: usize> Preconditioner for IncompleteCholesky<B> {
    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        let n = self.a.dim();
        assert!(r.len() == n && z.len() == n, "incomplete Cholesky factor of {n} rows");
        z.copy_from_slice(r);
        let z = z.as_chunks_mut::<B>().0;
        // Not compiled for wider vectors: a tenth slower, blocks of nine numbers being shuffled for longer than multiplied.
        for i in 0..z.len() {
            let mut sums = [[0.0; B]; B];
            for at in self.starts[i]..self.starts[i + 1] {
                let (g, x) = (&self.g[at], z[self.cols[at] as usize]);
                for k in 0..B {
                    (0..B).for_each(|l| sums[k][l] += g[k][l] * x[l]);
                }
            }
            for (z, row) in z[i].iter_mut().zip(sums) {
                *z -= row[1..].iter().fold(row[0], |sum, term| sum + term);
            }
        }
        for (z, inverse) in z.iter_mut().zip(&self.inverses) {
            let x = *z;
            *z = std::array::from_fn(|k| (0..B).map(|l| inverse[k][l] * x[l]).sum());
        }
        for i in (0..z.len()).rev() {
            let x = z[i];
            for at in self.starts[i]..self.starts[i + 1] {
                let (g, z) = (&self.g[at], &mut z[self.cols[at] as usize]);
                for k in 0..B {
                    (0..B).for_each(|l| z[l] -= g[k][l] * x[k]);
                }
            }
        }
    }
}
