//! The matrix `S = C G⁻¹ Cᵀ` of constraints and a block diagonal `G`, and its Cholesky factor.

use super::constraints::{ConstraintError, Constraints};
use crate::Block;
use crate::dense::Cholesky;

/// How far the smallest pivot of `S`, scaled to a unit diagonal, must be from zero.
const RANK: f64 = 1e-12;

/// A factor of `D S D`, the scaling `D` giving it a unit diagonal.
#[derive(Debug)]
pub(super) struct Schur {
    scale: Vec<f64>,
    factor: Factor,
}

#[derive(Debug)]
enum Factor {
    Dense(Cholesky),
    #[cfg(feature = "direct")]
    Sparse(Box<sparse::SparseFactor>),
}

impl Schur {
    /// Up to this many constraints the factor is dense: 5 MB, and 0.1 s at most.
    pub const DENSE_LIMIT: usize = 800;

    /// `inverse(node)` is the block of `G⁻¹`.
    pub fn new<const B: usize>(c: &Constraints, inverse: impl Fn(usize) -> Block<B>) -> Result<Self, ConstraintError> {
        let m = c.n_rows();
        let entries = assemble(c, inverse);
        let mut scale = vec![0.0; m];
        for &(i, j, value) in &entries {
            if i == j {
                scale[i] = value;
            }
        }
        for (row, s) in scale.iter_mut().enumerate() {
            if !(*s > 0.0 && s.is_finite()) {
                return Err(ConstraintError::Dependent { row }); // all of its entries are held
            }
            *s = 1.0 / s.sqrt();
        }
        let scaled: Vec<_> =
            entries.into_iter().map(|(i, j, v)| (i, j, if i == j { 1.0 } else { v * scale[i] * scale[j] })).collect();
        let factor = if m <= Self::DENSE_LIMIT { dense(m, &scaled)? } else { large(m, &scaled)? };
        Ok(Self { scale, factor })
    }

    /// `v ← S⁻¹ v`.
    pub fn solve(&self, v: &mut [f64]) {
        v.iter_mut().zip(&self.scale).for_each(|(v, s)| *v *= s);
        match &self.factor {
            Factor::Dense(factor) => factor.solve(v),
            #[cfg(feature = "direct")]
            Factor::Sparse(factor) => factor.solve(v),
        }
        v.iter_mut().zip(&self.scale).for_each(|(v, s)| *v *= s);
    }
}

/// Entries `(i, j, value)` of the lower triangle, sorted, each once.
fn assemble<const B: usize>(c: &Constraints, inverse: impl Fn(usize) -> Block<B>) -> Vec<(usize, usize, f64)> {
    // Parts of the rows at each node: the node, the row and its B coefficients.
    let mut parts: Vec<(usize, usize, [f64; B])> = Vec::new();
    for row in 0..c.n_rows() {
        let (cols, values) = c.row(row);
        let first = parts.len();
        for (&col, &value) in cols.iter().zip(values) {
            if parts.len() == first || parts[parts.len() - 1].0 != col / B {
                parts.push((col / B, row, [0.0; B]));
            }
            let at = parts.len() - 1;
            parts[at].2[col % B] = value;
        }
    }
    parts.sort_by_key(|part| (part.0, part.1));
    let mut entries = Vec::new();
    for group in parts.chunk_by(|a, b| a.0 == b.0) {
        let inverse = inverse(group[0].0);
        for (k, (_, i, ci)) in group.iter().enumerate() {
            let image: [f64; B] = inverse.map(|row| row.iter().zip(ci).map(|(g, c)| g * c).sum());
            for (_, j, cj) in &group[..=k] {
                entries.push((*i, *j, image.iter().zip(cj).map(|(a, b)| a * b).sum()));
            }
        }
    }
    entries.sort_by_key(|entry| (entry.0, entry.1)); // stable: sums in the order of the nodes
    entries.dedup_by(|next, kept| {
        let same = (next.0, next.1) == (kept.0, kept.1);
        if same {
            kept.2 += next.2;
        }
        same
    });
    entries
}

fn dense(m: usize, entries: &[(usize, usize, f64)]) -> Result<Factor, ConstraintError> {
    let mut matrix = vec![0.0; m * m];
    for &(i, j, value) in entries {
        matrix[i * m + j] = value;
    }
    let mut factor = Cholesky::new();
    // A matrix whose shift by `RANK` has no factor is as good as singular.
    for shift in [RANK, 0.0] {
        factor
            .factor(m, |i, j| matrix[i * m + j] - if i == j { shift } else { 0.0 })
            .map_err(|e| ConstraintError::Dependent { row: e.row })?;
    }
    Ok(Factor::Dense(factor))
}

#[cfg(feature = "direct")]
fn large(m: usize, entries: &[(usize, usize, f64)]) -> Result<Factor, ConstraintError> {
    Ok(Factor::Sparse(Box::new(sparse::SparseFactor::new(m, entries, RANK)?)))
}

#[cfg(not(feature = "direct"))]
fn large(rows: usize, _: &[(usize, usize, f64)]) -> Result<Factor, ConstraintError> {
    Err(ConstraintError::TooMany { rows, limit: Schur::DENSE_LIMIT })
}

#[cfg(feature = "direct")]
mod sparse {
    use super::ConstraintError;
    use faer::dyn_stack::{MemBuffer, MemStack};
    use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
    use faer::sparse::linalg::cholesky::{
        CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
    };
    use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
    use faer::{Conj, MatMut, Par, Side, Spec};
    use std::sync::{Mutex, PoisonError};

    /// A sparse Cholesky factor under approximate minimum degree.
    pub struct SparseFactor {
        symbolic: SymbolicCholesky<usize>,
        values: Vec<f64>,
        scratch: Mutex<MemBuffer>,
    }

    impl std::fmt::Debug for SparseFactor {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.debug_struct("SparseFactor").field("entries", &self.values.len()).finish_non_exhaustive()
        }
    }

    impl SparseFactor {
        /// From the lower triangle by rows, which is the upper triangle by columns.
        pub fn new(m: usize, entries: &[(usize, usize, f64)], rank: f64) -> Result<Self, ConstraintError> {
            let mut offsets = vec![0; m + 1];
            for &(i, ..) in entries {
                offsets[i + 1] += 1;
            }
            for i in 0..m {
                offsets[i + 1] += offsets[i];
            }
            let rows: Vec<usize> = entries.iter().map(|entry| entry.1).collect();
            let pattern = SymbolicSparseColMatRef::new_checked(m, m, &offsets, None, &rows);
            let (ordering, params) = (SymmetricOrdering::Amd, CholeskySymbolicParams::default());
            let too_many = |_| ConstraintError::TooMany { rows: m, limit: m };
            let symbolic = factorize_symbolic_cholesky(pattern, Side::Upper, ordering, params).map_err(too_many)?;
            let mut values = vec![0.0; symbolic.len_val()];
            let (par, spec) = (Par::Seq, Spec::default());
            let mut scratch = MemBuffer::new(
                symbolic
                    .factorize_numeric_llt_scratch::<f64>(par, spec)
                    .or(symbolic.solve_in_place_scratch::<f64>(1, par)),
            );
            for shift in [rank, 0.0] {
                let shifted = |&(i, j, value): &(usize, usize, f64)| value - if i == j { shift } else { 0.0 };
                let shifted: Vec<f64> = entries.iter().map(shifted).collect();
                let matrix = SparseColMatRef::new(pattern, &shifted);
                let (regular, stack) = (LltRegularization::default(), MemStack::new(&mut scratch));
                symbolic.factorize_numeric_llt(&mut values, matrix, Side::Upper, regular, par, stack, spec).map_err(
                    |LltError::NonPositivePivot { index }| {
                        let row = symbolic.perm().map_or(index, |p| p.arrays().0[index.min(m - 1)]);
                        ConstraintError::Dependent { row }
                    },
                )?;
            }
            Ok(Self { symbolic, values, scratch: Mutex::new(scratch) })
        }

        pub fn solve(&self, v: &mut [f64]) {
            let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
            let rows = v.len();
            let right_side = MatMut::from_column_major_slice_mut(v, rows, 1);
            let stack = MemStack::new(&mut scratch);
            LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(Conj::No, right_side, Par::Seq, stack);
        }
    }
}
