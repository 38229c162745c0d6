//! The matrix that a preconditioner approximates: `P_W A P_W`, written out, and the inverses of its diagonal blocks.

use super::PreconditionerError;
use super::restricted::{check_shape, restricted_inverse};
use crate::sparse::{BlockCsr, Frozen, SparseError};
use crate::subspace::{Constraint, Subspace};
use crate::team::Team;
use crate::{Block, LinearOperator};

/// `P_W A P_W` with the pattern of `A`, and `D⁺`: its diagonal blocks inverted on the allowed moves of their nodes. Both map
/// `W` into `W`, and so does whatever is made of their sums and products; rows of fixed nodes are zero.
#[derive(Clone, Debug, Default)]
pub(super) struct Projected<const B: usize> {
    pub matrix: BlockCsr<B>,
    /// The same, laid out for products.
    frozen: Frozen<B>,
    /// `D⁺`, one block per node.
    pub inverses: Vec<Block<B>>,
    /// One per node, so that a pass over all blocks need not search for them.
    pub constraints: Vec<Constraint<B>>,
    row: Vec<Block<B>>,
}

impl<const B: usize> Projected<B> {
    /// Follows `a` and `w`; returns whether the pattern and the set of fixed nodes are those of before, in which case nothing
    /// is allocated.
    pub fn rebuild(&mut self, a: &BlockCsr<B>, w: &Subspace<B>) -> Result<bool, PreconditionerError> {
        check_shape(a, w)?;
        let n = a.n_rows();
        let mut same = self.matrix.n_rows() == n && self.constraints.len() == n;
        if !same {
            self.matrix = BlockCsr::new(n);
            self.constraints.clear();
            self.constraints.resize(n, Constraint::Free);
        }
        same &= self.constrain(w);
        for i in 0..n {
            same &= self.matrix.row(i).0 == a.row(i).0;
            self.set_row(a, i)?;
        }
        self.complete()?;
        Ok(same)
    }

    /// Takes over the constraints; returns whether the same nodes are fixed as before.
    fn constrain(&mut self, w: &Subspace<B>) -> bool {
        let mut same = true;
        let mut constrained = w.constrained().peekable();
        for (node, now) in self.constraints.iter_mut().enumerate() {
            let next = constrained.next_if(|(at, _)| *at == node).map_or(Constraint::Free, |(_, c)| *c);
            same &= (now.dofs() == 0) == (next.dofs() == 0);
            *now = next;
        }
        same
    }

    fn set_row(&mut self, a: &BlockCsr<B>, i: usize) -> Result<(), PreconditionerError> {
        let (cols, blocks) = a.row(i);
        self.row.clear();
        self.row.extend_from_slice(blocks);
        for (block, &j) in self.row.iter_mut().zip(cols) {
            let (left, right) = (&self.constraints[i], &self.constraints[j as usize]);
            if !matches!((left, right), (Constraint::Free, Constraint::Free)) {
                // A number that is not finite is an error, wherever it stands: zero times it would be none.
                if block.as_flattened().iter().any(|v| !v.is_finite()) {
                    return Err(PreconditionerError::NotFinite { row: i, col: j as usize });
                }
                *block = project_block(left, block, right);
            }
        }
        self.matrix.set_row(i, cols, &self.row).map_err(|error| match error {
            SparseError::NotFinite { row, col } => PreconditionerError::NotFinite { row, col },
            error => unreachable!("a row of another matrix of the same size: {error}"),
        })
    }

    /// `v ← P_W v`: what rounding leaves of sums whose terms cancel.
    pub fn project(&self, v: &mut [f64]) {
        for (v, constraint) in v.as_chunks_mut::<B>().0.iter_mut().zip(&self.constraints) {
            if *constraint != Constraint::Free {
                *v = constraint.project(*v);
            }
        }
    }

    /// `D⁺` of the present matrix, and its layout for products.
    pub fn complete(&mut self) -> Result<(), PreconditionerError> {
        let n = self.matrix.n_rows();
        self.constraints.resize(n, Constraint::Free);
        self.inverses.resize(n, [[0.0; B]; B]);
        for (row, inverse) in self.inverses.iter_mut().enumerate() {
            *inverse = restricted_inverse(&self.matrix.diagonal(row), &self.constraints[row])
                .map_err(|pivot| PreconditionerError::NotPositive { row, pivot })?;
        }
        self.frozen.refresh(&self.matrix);
        Ok(())
    }
}

/// Products, of all that is made from `P_W A P_W`, go through here.
impl<const B: usize> LinearOperator for Projected<B> {
    fn dim(&self) -> usize {
        self.matrix.n_rows() * B
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.frozen.apply(x, y);
    }

    fn apply_dot(&self, x: &[f64], y: &mut [f64]) -> f64 {
        self.frozen.apply_dot(x, y)
    }

    fn apply_on(&self, team: &Team, x: &[f64], y: &mut [f64]) {
        self.frozen.apply_on(team, x, y);
    }

    fn apply_dot_on(&self, team: &Team, x: &[f64], y: &mut [f64]) -> f64 {
        self.frozen.apply_dot_on(team, x, y)
    }
}

/// `P_i A P_j`.
fn project_block<const B: usize>(left: &Constraint<B>, a: &Block<B>, right: &Constraint<B>) -> Block<B> {
    let rows = a.map(|row| right.project(row)); // P_j is symmetric
    let mut result = [[0.0; B]; B];
    for j in 0..B {
        let column = left.project(std::array::from_fn(|i| rows[i][j]));
        (0..B).for_each(|i| result[i][j] = column[i]);
    }
    result
}
