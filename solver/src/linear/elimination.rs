//! Null-space conjugate gradients for general constraints: entries that follow from others are eliminated.

use super::constraints::{ConstraintError, Constraints};
use super::krylov::{VectorError, check_length, finite};
use super::row_reduction::RowReduction;
use super::{CgError, CgReport, CgSettings, CgWorkspace, projected_cg};
use crate::precondition::{BlockJacobi, PreconditionerError};
use crate::sparse::{BlockCsr, SparseError};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::norm2;
use crate::{Block, LinearOperator};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Why an elimination could not be set up, or a solve not be carried out. `x` then holds the last iterate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EliminationError {
    /// A vector does not fit, or holds what is not a number.
    #[error(transparent)]
    Vector(#[from] VectorError),
    /// The constraints do not fit, or contradict each other.
    #[error(transparent)]
    Constraint(#[from] ConstraintError),
    /// A diagonal block of the eliminated system has no inverse.
    #[error(transparent)]
    Preconditioner(#[from] PreconditionerError),
    /// A diagonal block of the eliminated system is not finite.
    #[error(transparent)]
    Matrix(#[from] SparseError),
    /// Conjugate gradients on the eliminated system failed; curvatures are those on the kernel of the constraints.
    #[error(transparent)]
    Cg(#[from] CgError),
}

/// A basis of the vectors that satisfy constraints and subspace: `x = Z x + Y d`, where `Z` writes the eliminated entries as
/// combinations of the kept ones.
///
/// Pivots are chosen row by row, the least used of the large coefficients first. Constraints that depend on earlier ones are
/// left out, and listed.
#[derive(Debug)]
pub struct Elimination<const B: usize> {
    w: Subspace<B>,
    c: Constraints,
    rows: RowReduction,
    m: BlockJacobi<B>,
}

/// Vectors of a solve; sized by the first one, so that a second one of the same size allocates nothing.
#[derive(Debug, Default)]
pub struct EliminationWorkspace {
    cg: CgWorkspace,
    all: Vec<f64>,
    right_side: Vec<f64>,
    kept: Vec<f64>,
    scratch: Mutex<Vec<f64>>,
    d: Vec<f64>,
    size: Vec<f64>,
}

impl EliminationWorkspace {
    /// An empty workspace; solves run on the calling thread.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// The vectors of these conjugate gradients, and their team.
impl From<CgWorkspace> for EliminationWorkspace {
    fn from(cg: CgWorkspace) -> Self {
        Self { cg, ..Self::default() }
    }
}

impl<const B: usize> Elimination<B> {
    /// Reduces the constraints to echelon form, and inverts the diagonal blocks of `Zᵀ A Z`.
    ///
    /// # Errors
    /// [`ConstraintError`] if constraints and subspace differ in length; [`PreconditionerError`] names a node whose block in
    /// `Zᵀ A Z` is not positive definite.
    pub fn new(matrix: &BlockCsr<B>, w: &Subspace<B>, c: &Constraints) -> Result<Self, EliminationError> {
        c.check(w)?;
        if matrix.n_rows() != w.n_nodes() {
            let (rows, nodes) = (matrix.n_rows(), w.n_nodes());
            return Err(PreconditionerError::Shape { rows, nodes }.into());
        }
        let rows = RowReduction::new(w, c);
        let m = BlockJacobi::new(&diagonal(matrix, &rows)?, &Subspace::new(w.n_nodes()))?;
        Ok(Self { w: w.clone(), c: c.clone(), rows, m })
    }

    /// Constraints that depend on earlier ones, or on the subspace; as long as their right sides agree they are left out.
    #[must_use]
    pub fn dependent(&self) -> &[usize] {
        self.rows.dependent()
    }

    /// Entries that are written as combinations of others, ascending; those held by the subspace are among them.
    pub fn eliminated(&self) -> impl ExactSizeIterator<Item = usize> {
        self.rows.pivots.iter().map(|pivot| pivot.col)
    }

    /// Replaces `d`; the basis does not depend on it.
    ///
    /// # Errors
    /// [`VectorError::Length`]; [`ConstraintError::RightSide`]. The old right side then stays.
    pub fn set_right_side(&mut self, d: &[f64]) -> Result<(), EliminationError> {
        check_length("the right side", d.len(), self.c.n_rows())?;
        if let Some(row) = crate::vector::first_not_finite(d) {
            return Err(ConstraintError::RightSide { row, value: d[row] }.into());
        }
        self.c.right_side_mut().copy_from_slice(d);
        Ok(())
    }

    /// Writes the eliminated entries of `Z x`, plus `d` where it is given by row.
    fn complete(&self, x: &mut [f64], d: Option<&[f64]>) {
        for pivot in &self.rows.pivots {
            let sum: f64 = pivot.others.iter().map(|&(col, coefficient)| coefficient * x[col]).sum();
            x[pivot.col] = d.map_or(0.0, |d| d[pivot.row]) - sum;
        }
    }

    /// `y ← Zᵀ y`, eliminated entries zero.
    fn restrict(&self, y: &mut [f64]) {
        for pivot in &self.rows.pivots {
            let value = std::mem::take(&mut y[pivot.col]);
            for &(col, coefficient) in &pivot.others {
                y[col] -= coefficient * value;
            }
        }
    }
}

/// Minimises `½ xᵀA x − bᵀx` subject to `C x = d`, the subspace holding what it holds of the `x` given, by conjugate gradients
/// on `Zᵀ A Z`, with the block diagonal of that matrix as preconditioner.
///
/// The kept entries of `x` are the start. `A` must be symmetric, and positive definite on the kernel of `C` within the
/// subspace. The stop rule sees the eliminated system: residual `Zᵀ(b − A x)`, external forces `Zᵀ(b − A Y d)`, no reactions.
///
/// # Errors
/// See [`EliminationError`]; [`ConstraintError::Contradictory`] names a constraint whose left side depends on others and whose
/// right side does not follow.
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), sections 15.3 and 16.3.
pub fn elimination_cg<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    e: &Elimination<B>,
    b: &[f64],
    x: &mut [f64],
    settings: &CgSettings,
    ws: &mut EliminationWorkspace,
) -> Result<CgReport, EliminationError> {
    let n = e.c.dim();
    check_length("the operator", a.dim(), n)?;
    check_length("b", b.len(), n)?;
    check_length("x", x.len(), n)?;
    finite(norm2(b), "b", b, 0)?;
    finite(norm2(x), "x", x, 0)?;
    e.rows.reduce(&e.w, &e.c, x, (&mut ws.d, &mut ws.size))?;
    for v in [&mut ws.all, &mut ws.right_side, &mut ws.kept] {
        v.resize(n, 0.0);
    }
    // Right side Zᵀ(b − A Y d).
    ws.all.fill(0.0);
    e.complete(&mut ws.all, Some(&ws.d));
    a.apply(&ws.all, &mut ws.right_side);
    for (r, b) in ws.right_side.iter_mut().zip(b) {
        *r = b - *r;
    }
    e.restrict(&mut ws.right_side);
    ws.kept.copy_from_slice(x);
    for pivot in &e.rows.pivots {
        ws.kept[pivot.col] = 0.0;
    }

    ws.scratch.get_mut().unwrap_or_else(PoisonError::into_inner).resize(n, 0.0);
    let reduced = Reduced { a, e, scratch: &ws.scratch };
    let free = Subspace::<B>::new(e.w.n_nodes());
    let report = projected_cg(&reduced, &e.m, &free, &ws.right_side, &mut ws.kept, settings, &mut ws.cg);
    x.copy_from_slice(&ws.kept);
    e.complete(x, Some(&ws.d));
    Ok(report?)
}

/// `Zᵀ A Z` on vectors of the whole length whose eliminated entries are zero.
struct Reduced<'a, const B: usize, A: ?Sized> {
    a: &'a A,
    e: &'a Elimination<B>,
    scratch: &'a Mutex<Vec<f64>>,
}

impl<const B: usize, A: LinearOperator + ?Sized> LinearOperator for Reduced<'_, B, A> {
    fn dim(&self) -> usize {
        self.e.c.dim()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.apply_on(&Team::serial(), x, y);
    }

    fn apply_on(&self, team: &Team, x: &[f64], y: &mut [f64]) {
        let mut whole = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        whole.copy_from_slice(x);
        self.e.complete(&mut whole, None);
        self.a.apply_on(team, &whole, y);
        self.e.restrict(y);
    }
}

/// The block diagonal of `Zᵀ A Z`, ones in the place of eliminated entries.
fn diagonal<const B: usize>(matrix: &BlockCsr<B>, rows: &RowReduction) -> Result<BlockCsr<B>, SparseError> {
    // Columns of Z at the nodes where they are not columns of the identity.
    let mut columns: BTreeMap<usize, [Vec<(usize, f64)>; B]> = BTreeMap::new();
    let unit = |node: usize| std::array::from_fn(|k| vec![(node * B + k, 1.0)]);
    for pivot in &rows.pivots {
        columns.entry(pivot.col / B).or_insert_with(|| unit(pivot.col / B))[pivot.col % B].clear();
    }
    for pivot in &rows.pivots {
        for &(col, coefficient) in &pivot.others {
            let node = columns.entry(col / B).or_insert_with(|| unit(col / B));
            node[col % B].push((pivot.col, -coefficient));
        }
    }
    let mut diagonal = BlockCsr::new(matrix.n_rows());
    for node in 0..matrix.n_rows() {
        let mut block = matrix.diagonal(node);
        if let Some(z) = columns.get(&node) {
            block = std::array::from_fn(|k| std::array::from_fn(|l| form(matrix, &z[k], &z[l], k == l)));
        }
        diagonal.set_row(node, &[node as u32], &[block])?;
    }
    Ok(diagonal)
}

/// `zᵀ A z'`; an empty column stands for an eliminated entry.
fn form<const B: usize>(matrix: &BlockCsr<B>, z: &[(usize, f64)], other: &[(usize, f64)], same: bool) -> f64 {
    if z.is_empty() || other.is_empty() {
        return f64::from(same);
    }
    let entry = |i: usize, j: usize| matrix.get(i / B, j / B).map_or(0.0, |block: &Block<B>| block[i % B][j % B]);
    let row = |i: usize| other.iter().map(|&(j, value)| entry(i, j) * value).sum::<f64>();
    z.iter().map(|&(i, value)| value * row(i)).sum()
}
