//! The matrix that a preconditioner approximates: `P_W A P_W`, and the inverses of its diagonal blocks.

use super::PreconditionerError;
use super::restricted::{check_shape, restricted_inverse};
use crate::memory::bytes_of;
use crate::real::Real;
use crate::sparse::{BlockCsr, Frozen, Rows, SparseError};
use crate::subspace::{Constraint, Subspace};
use crate::team::Team;
use crate::{Block, LinearOperator};

/// `P_W A P_W` with the pattern of `A`, and `D⁺`: its diagonal blocks inverted on the allowed moves of their nodes. Both map
/// `W` into `W`, and so does whatever is made of their sums and products; rows of fixed nodes are zero.
///
/// Only rows that a constraint changes are written out; the others are read from `A` itself.
#[derive(Clone, Debug, Default)]
pub(super) struct Projected<const B: usize, T: Real = f64> {
    /// The rows that differ from those of `A`; the others are empty here.
    edited: BlockCsr<B>,
    /// `D⁺`, one block per node.
    pub inverses: Vec<Block<B, T>>,
    /// One per node, so that a pass over all blocks need not search for them.
    pub constraints: Vec<Constraint<B>>,
    /// Whether any of them is not free.
    constrained: bool,
    /// The pattern: row `i` has the columns `cols[starts[i]..starts[i + 1]]`.
    starts: Vec<usize>,
    cols: Vec<u32>,
    row: Vec<Block<B>>,
}

/// The rows of `P_W A P_W`.
#[derive(Clone, Copy)]
pub(super) struct ProjectedRows<'a, const B: usize> {
    a: &'a BlockCsr<B>,
    /// `None` if all are those of `A`.
    edited: Option<&'a BlockCsr<B>>,
}

impl<const B: usize> Rows<B> for ProjectedRows<'_, B> {
    #[inline(always)]
    fn n_rows(&self) -> usize {
        self.a.n_rows()
    }

    #[inline(always)]
    fn n_blocks(&self) -> usize {
        self.a.n_blocks()
    }

    #[inline(always)]
    fn row(&self, row: usize) -> (&[u32], &[Block<B>]) {
        self.owner(row).row(row)
    }

    #[inline(always)]
    fn stamp(&self, row: usize) -> u64 {
        Rows::stamp(self.owner(row), row)
    }
}

impl<const B: usize> ProjectedRows<'_, B> {
    #[inline(always)]
    fn owner(&self, row: usize) -> &BlockCsr<B> {
        self.edited.filter(|edited| !edited.row(row).0.is_empty()).unwrap_or(self.a)
    }

    /// The diagonal block of a row, zero if it is not stored.
    pub fn diagonal(&self, row: usize) -> Block<B> {
        self.owner(row).diagonal(row)
    }
}

impl<const B: usize, T: Real> Projected<B, T> {
    /// Follows `a` and `w`; returns whether the pattern and the set of fixed nodes are those of before, in which case nothing
    /// is allocated.
    pub fn rebuild(&mut self, team: &Team, a: &BlockCsr<B>, w: &Subspace<B>) -> Result<bool, PreconditionerError> {
        check_shape(a, w)?;
        let n = a.n_rows();
        let same_size = self.constraints.len() == n;
        self.constraints.resize(n, Constraint::Free);
        let same = self.constrain(w) & same_size & self.follow_pattern(a);
        check_finite(team, a)?;
        self.edit(a)?;
        self.invert(team, a)?;
        Ok(same)
    }

    /// Follows `a`, all moves being allowed.
    pub fn rebuild_free(&mut self, team: &Team, a: &BlockCsr<B>) -> Result<(), PreconditionerError> {
        self.constraints.clear();
        self.constraints.resize(a.n_rows(), Constraint::Free);
        self.constrained = false;
        self.invert(team, a)
    }

    /// The rows, of the matrix that was followed last.
    pub fn rows<'a>(&'a self, a: &'a BlockCsr<B>) -> ProjectedRows<'a, B> {
        ProjectedRows { a, edited: self.constrained.then_some(&self.edited) }
    }

    pub fn dim(&self) -> usize {
        self.constraints.len() * B
    }

    /// Takes over the constraints; returns whether the same nodes are fixed as before.
    fn constrain(&mut self, w: &Subspace<B>) -> bool {
        let mut same = true;
        let mut constrained = w.constrained().peekable();
        self.constrained = constrained.peek().is_some();
        for (node, now) in self.constraints.iter_mut().enumerate() {
            let next = constrained.next_if(|(at, _)| *at == node).map_or(Constraint::Free, |(_, c)| *c);
            same &= (now.dofs() == 0) == (next.dofs() == 0);
            *now = next;
        }
        same
    }

    /// Takes over the pattern; returns whether it is that of before.
    fn follow_pattern(&mut self, a: &BlockCsr<B>) -> bool {
        let n = a.n_rows();
        let Self { starts, cols, .. } = self;
        let same = starts.len() == n + 1 && (0..n).all(|i| cols[starts[i]..starts[i + 1]] == *a.row(i).0);
        if !same {
            starts.clear();
            cols.clear();
            starts.push(0);
            for i in 0..n {
                cols.extend_from_slice(a.row(i).0);
                starts.push(cols.len());
            }
        }
        same
    }

    /// Writes out the rows that constraints change.
    fn edit(&mut self, a: &BlockCsr<B>) -> Result<(), PreconditionerError> {
        let n = a.n_rows();
        if !self.constrained {
            return Ok(());
        }
        if self.edited.n_rows() != n {
            self.edited = BlockCsr::new(n);
        }
        for i in 0..n {
            self.edit_row(a, i).map_err(|error| match error {
                SparseError::NotFinite { row, col } => PreconditionerError::NotFinite { row, col },
                error => unreachable!("a row of another matrix of the same size: {error}"),
            })?;
        }
        Ok(())
    }

    fn edit_row(&mut self, a: &BlockCsr<B>, i: usize) -> Result<(), SparseError> {
        let (cols, blocks) = a.row(i);
        let left = &self.constraints[i];
        let is_free = |j: &u32| self.constraints[*j as usize] == Constraint::Free;
        if *left == Constraint::Free && cols.iter().all(is_free) {
            return if self.edited.row(i).0.is_empty() { Ok(()) } else { self.edited.set_row(i, &[], &[]) };
        }
        self.row.clear();
        self.row.extend(cols.iter().zip(blocks).map(|(&j, block)| {
            let right = &self.constraints[j as usize];
            let free = matches!((left, right), (Constraint::Free, Constraint::Free));
            if free { *block } else { project_block(left, block, right) }
        }));
        self.edited.set_row(i, cols, &self.row)
    }

    /// `D⁺` of the matrix.
    fn invert(&mut self, team: &Team, a: &BlockCsr<B>) -> Result<(), PreconditionerError> {
        let Self { edited, inverses, constraints, constrained, .. } = self;
        let (n, constraints) = (constraints.len(), &constraints[..]);
        let rows = ProjectedRows { a, edited: constrained.then_some(&*edited) };
        inverses.resize(n, [[T::ZERO; B]; B]);
        let mut parts = team.split(inverses).map(|part| (part, Ok(())));
        team.each(&mut parts[..team.size()], |member, (inverses, outcome)| {
            let share = team.share(n, member);
            for (row, inverse) in share.zip(inverses.iter_mut()) {
                match restricted_inverse(&rows.diagonal(row), &constraints[row]) {
                    Ok(block) => *inverse = block.map(|row| row.map(T::from_f64)),
                    Err(pivot) => {
                        *outcome = Err(PreconditionerError::NotPositive { row, pivot });
                        return;
                    }
                }
            }
        });
        parts.into_iter().try_for_each(|(_, outcome)| outcome)
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        self.edited.memory_bytes()
            + bytes_of(&self.inverses)
            + bytes_of(&self.constraints)
            + bytes_of(&self.starts)
            + bytes_of(&self.cols)
            + bytes_of(&self.row)
    }
}

/// Refuses a number that is not finite, wherever it stands: behind a constraint it would be lost.
fn check_finite<const B: usize>(team: &Team, a: &BlockCsr<B>) -> Result<(), PreconditionerError> {
    let n = a.n_rows();
    let mut found = [None; Team::MAX_MEMBERS];
    team.each(&mut found[..team.size()], |member, found| {
        let rows = n * member / team.size()..n * (member + 1) / team.size();
        *found = rows.into_iter().find(|&row| {
            // Zero times what is not finite is NaN.
            let zero: f64 = a.row(row).1.as_flattened().as_flattened().iter().map(|v| 0.0 * v).sum();
            zero.is_nan()
        });
    });
    let Some(row) = found.into_iter().flatten().next() else { return Ok(()) };
    let (cols, blocks) = a.row(row);
    let at = blocks.iter().position(|block| block.as_flattened().iter().any(|v| !v.is_finite()));
    Err(PreconditionerError::NotFinite { row, col: at.map_or(row, |at| cols[at] as usize) })
}

/// [`Projected`], laid out for products in the format `T`.
#[derive(Clone, Debug, Default)]
pub(super) struct ProjectedOperator<const B: usize, T: Real = f64> {
    pub projected: Projected<B, T>,
    frozen: Frozen<B, T>,
}

impl<const B: usize, T: Real> ProjectedOperator<B, T> {
    /// As [`Projected::rebuild`].
    pub fn rebuild(&mut self, team: &Team, a: &BlockCsr<B>, w: &Subspace<B>) -> Result<bool, PreconditionerError> {
        let same = self.projected.rebuild(team, a, w)?;
        self.frozen.follow(&self.projected.rows(a));
        Ok(same)
    }

    /// As [`Projected::rebuild_free`].
    pub fn rebuild_free(&mut self, team: &Team, a: &BlockCsr<B>) -> Result<(), PreconditionerError> {
        self.projected.rebuild_free(team, a)?;
        self.frozen.refresh(a);
        Ok(())
    }

    /// `v ← P_W v`: what rounding leaves of sums whose terms cancel.
    pub fn project(&self, v: &mut [T]) {
        if !self.projected.constrained {
            return;
        }
        for (v, constraint) in v.as_chunks_mut::<B>().0.iter_mut().zip(&self.projected.constraints) {
            if *constraint != Constraint::Free {
                *v = constraint.project(v.map(T::to_f64)).map(T::from_f64);
            }
        }
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        self.projected.memory_bytes() + self.frozen.memory_bytes()
    }
}

/// Products, of all that is made from `P_W A P_W`, go through here.
impl<const B: usize, T: Real> LinearOperator<T> for ProjectedOperator<B, T> {
    fn dim(&self) -> usize {
        self.projected.dim()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.frozen.apply(x, y);
    }

    fn apply_dot(&self, x: &[T], y: &mut [T]) -> f64 {
        self.frozen.apply_dot(x, y)
    }

    fn apply_on(&self, team: &Team, x: &[T], y: &mut [T]) {
        self.frozen.apply_on(team, x, y);
    }

    fn apply_dot_on(&self, team: &Team, x: &[T], y: &mut [T]) -> f64 {
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
