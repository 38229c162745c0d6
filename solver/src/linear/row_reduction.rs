//! Row reduction of sparse constraints: which entries of a vector follow from the others.

use super::constraints::{ConstraintError, Constraints};
use crate::subspace::{Constraint, Subspace};

/// A row whose largest coefficient falls below this, relative to what it was reduced from, depends on earlier ones.
const RANK: f64 = 1e-12;
/// A dependent row whose right side is off by more than this, relative to what it was reduced from, contradicts them.
const GAP: f64 = 1e-9;
/// A pivot must be at least this fraction of the largest coefficient of its row.
const PIVOT: f64 = 0.5;

/// `x[col] = d − Σ coefficient · x[other]`, no other being a pivot itself.
#[derive(Clone, Debug)]
pub(super) struct Pivot {
    pub col: usize,
    /// Row whose right side is `d` after [`RowReduction::reduce`].
    pub row: usize,
    pub others: Vec<(usize, f64)>,
}

/// `target ← target + factor · source` on right sides, or a scaling where both are the same row.
#[derive(Clone, Copy, Debug)]
struct Step {
    target: usize,
    source: usize,
    factor: f64,
}

/// The reduced row echelon form of the constraints, those of the subspace first, and how to bring a right side there.
#[derive(Clone, Debug)]
pub(super) struct RowReduction {
    /// Rows that hold the subspace, as `(node, direction)`; they come before those of `C`.
    n_held: usize,
    pub pivots: Vec<Pivot>,
    steps: Vec<Step>,
    dependent: Vec<usize>,
}

impl RowReduction {
    pub fn new<const B: usize>(w: &Subspace<B>, c: &Constraints) -> Self {
        let mut uses = vec![0u32; c.dim()];
        (0..c.n_rows()).flat_map(|row| c.row(row).0).for_each(|&col| uses[col] += 1);
        let mut work = Elimination {
            reduced: Self { n_held: 0, pivots: Vec::new(), steps: Vec::new(), dependent: Vec::new() },
            pivot_of: vec![usize::MAX; c.dim()],
            dense: vec![0.0; c.dim()],
            uses,
        };
        for (node, direction) in held(w) {
            let entries: Vec<(usize, f64)> = (0..B).map(|k| (node * B + k, direction[k])).collect();
            work.add(work.reduced.n_held, &entries);
            work.reduced.n_held += 1;
        }
        let n_held = work.reduced.n_held;
        for row in 0..c.n_rows() {
            let (cols, values) = c.row(row);
            let entries: Vec<(usize, f64)> = cols.iter().copied().zip(values.iter().copied()).collect();
            if !work.add(n_held + row, &entries) {
                work.reduced.dependent.push(row);
            }
        }
        work.reduced.pivots.sort_by_key(|pivot| pivot.col);
        work.reduced
    }

    /// Constraints that say nothing new, ascending.
    pub fn dependent(&self) -> &[usize] {
        &self.dependent
    }

    /// Writes the right sides of the reduced rows: those of the subspace hold `x` where it is.
    pub fn reduce<const B: usize>(
        &self,
        w: &Subspace<B>,
        c: &Constraints,
        x: &[f64],
        (d, size): (&mut Vec<f64>, &mut Vec<f64>),
    ) -> Result<(), ConstraintError> {
        let n = self.n_held + c.n_rows();
        d.resize(n, 0.0);
        size.resize(n, 0.0);
        for (row, (node, direction)) in held(w).enumerate() {
            let terms = (0..B).map(|k| direction[k] * x[node * B + k]);
            d[row] = terms.clone().sum();
            size[row] = terms.map(f64::abs).sum();
        }
        for (row, &value) in c.right_side().iter().enumerate() {
            (d[self.n_held + row], size[self.n_held + row]) = (value, value.abs());
        }
        for step in &self.steps {
            if step.source == step.target {
                d[step.target] *= step.factor;
                size[step.target] *= step.factor.abs();
                continue;
            }
            d[step.target] += step.factor * d[step.source];
            size[step.target] += (step.factor * size[step.source]).abs();
        }
        for &row in &self.dependent {
            let gap = d[self.n_held + row];
            if gap.abs() > GAP * size[self.n_held + row] || gap.is_nan() {
                return Err(ConstraintError::Contradictory { row, gap });
            }
        }
        Ok(())
    }
}

/// Directions in which the subspace holds a node, `B` for a fixed one.
fn held<const B: usize>(w: &Subspace<B>) -> impl Iterator<Item = (usize, [f64; B])> {
    w.constrained().flat_map(|(node, constraint)| {
        let (basis, count) = complement(constraint).basis();
        basis.into_iter().take(count).map(move |direction| (node, direction))
    })
}

/// The constraint whose allowed moves are the forbidden ones of this.
fn complement<const B: usize>(constraint: &Constraint<B>) -> Constraint<B> {
    match *constraint {
        Constraint::Free => Constraint::Fixed,
        Constraint::Fixed => Constraint::Free,
        Constraint::Line(t) => Constraint::Plane(t),
        Constraint::Plane(n) => Constraint::Line(n),
    }
}

/// State of the reduction.
struct Elimination {
    reduced: RowReduction,
    /// Pivot row of a column.
    pivot_of: Vec<usize>,
    /// The row at work, by column.
    dense: Vec<f64>,
    /// Rows of `C` that have a column.
    uses: Vec<u32>,
}

impl Elimination {
    /// Reduces a row by the pivots so far, and these by it; `false` if nothing is left of it.
    fn add(&mut self, row: usize, entries: &[(usize, f64)]) -> bool {
        // Reduce.
        let mut touched: Vec<usize> = Vec::with_capacity(entries.len());
        let mut size = 0.0f64;
        for &(col, value) in entries {
            size = size.max(value.abs());
            if self.pivot_of[col] == usize::MAX {
                self.dense[col] += value;
                touched.push(col);
                continue;
            }
            let pivot = &self.reduced.pivots[self.pivot_of[col]];
            if value == 0.0 {
                continue;
            }
            self.reduced.steps.push(Step { target: row, source: pivot.row, factor: -value });
            for &(other, coefficient) in &pivot.others {
                self.dense[other] -= value * coefficient;
                size = size.max((value * coefficient).abs());
                touched.push(other);
            }
        }
        touched.sort_unstable();
        touched.dedup();
        let mut rest: Vec<(usize, f64)> = Vec::with_capacity(touched.len());
        for col in touched {
            let value = std::mem::take(&mut self.dense[col]);
            if value.abs() > f64::EPSILON * size {
                rest.push((col, value));
            }
        }

        // Pivot: among the large coefficients the one that the fewest rows use.
        let largest = rest.iter().fold(0.0f64, |max, entry| max.max(entry.1.abs()));
        if largest <= RANK * size {
            return false;
        }
        let large = rest.iter().filter(|entry| entry.1.abs() >= PIVOT * largest);
        let Some(&(col, value)) = large.min_by_key(|entry| self.uses[entry.0]) else {
            return false;
        };
        self.reduced.steps.push(Step { target: row, source: row, factor: 1.0 / value });
        let mut others: Vec<(usize, f64)> = rest.into_iter().filter(|entry| entry.0 != col).collect();
        others.iter_mut().for_each(|entry| entry.1 /= value);

        // Reduce the earlier rows.
        for pivot in &mut self.reduced.pivots {
            let Ok(at) = pivot.others.binary_search_by_key(&col, |entry| entry.0) else {
                continue;
            };
            let factor = pivot.others.remove(at).1;
            self.reduced.steps.push(Step { target: pivot.row, source: row, factor: -factor });
            add_scaled(&mut pivot.others, -factor, &others);
        }
        self.pivot_of[col] = self.reduced.pivots.len();
        self.reduced.pivots.push(Pivot { col, row, others });
        true
    }
}

/// `row ← row + factor · other`, both sorted by column.
fn add_scaled(row: &mut Vec<(usize, f64)>, factor: f64, other: &[(usize, f64)]) {
    for &(col, value) in other {
        match row.binary_search_by_key(&col, |entry| entry.0) {
            Ok(at) => row[at].1 += factor * value,
            Err(at) => row.insert(at, (col, factor * value)),
        }
    }
}
