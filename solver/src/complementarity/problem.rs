//! The problem, what is said about its solution, and the parts that both methods share.

use crate::dense::{Cholesky, NotPositiveDefinite};
use crate::stop::Stop;
use crate::vector::{dot, first_not_finite};
use serde::{Deserialize, Serialize};

/// How far `W` may be from symmetric, relative to its largest entry.
const SYMMETRY: f64 = 1e-9;

/// Which of the three conditions a component satisfies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum BoxState {
    /// `λ = l`, `w ≥ 0`.
    Lower,
    /// `w = 0`.
    #[default]
    Between,
    /// `λ = u`, `w ≤ 0`.
    Upper,
}

/// `W`, `q` and the bounds; see the [module](super).
#[derive(Clone, Copy, Debug)]
pub struct BoxProblem<'a> {
    /// Symmetric positive definite, `q.len()` squared entries, by rows.
    pub matrix: &'a [f64],
    /// `w` at `λ = 0`.
    pub q: &'a [f64],
    /// Lower bounds; may be negative infinity.
    pub lower: &'a [f64],
    /// Upper bounds, none below its lower one; may be infinity.
    pub upper: &'a [f64],
}

/// How a solve went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxReport {
    /// Why it ended.
    pub stop: Stop,
    /// Pivots, each of which may change many components, or sweeps.
    pub iterations: usize,
    /// Factorisations of the matrix of the components between their bounds.
    pub factorisations: usize,
    /// The largest `|λ_i − clamp(λ_i − w_i / W_ii)|` of the `λ` returned: the natural residual, in the unit of `λ`.
    pub residual: f64,
}

/// A problem that cannot be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoxError {
    /// A part of the problem has the wrong length.
    #[error("{what} has {len} entries, not {expected}")]
    Shape {
        /// Which part.
        what: &'static str,
        /// Its length.
        len: usize,
        /// The length it should have.
        expected: usize,
    },
    /// NaN, or an infinity where none may be.
    #[error("entry {index} of {what} is not finite")]
    NotFinite {
        /// Which part.
        what: &'static str,
        /// Its first bad entry.
        index: usize,
    },
    /// No number lies within the bounds.
    #[error("component {index} cannot lie between {lower} and {upper}")]
    Bounds {
        /// The component.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// `W` is not symmetric.
    #[error("entries ({row}, {col}) and ({col}, {row}) of the matrix differ by {difference:e}")]
    NotSymmetric {
        /// Row of the one.
        row: usize,
        /// Column of the one.
        col: usize,
        /// Their difference.
        difference: f64,
    },
    /// `W` is not positive definite on the components that were free at some time.
    #[error("pivot {pivot:e} at component {index}: the matrix is not positive definite")]
    NotPositiveDefinite {
        /// The component.
        index: usize,
        /// The pivot that should have been positive.
        pivot: f64,
    },
    /// A number of the settings makes no sense.
    #[error("setting {what} is {value}")]
    Settings {
        /// Which one.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Memory of a solve, and the states that it found; a second solve of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct BoxWorkspace {
    /// The state of each component.
    pub(super) states: Vec<BoxState>,
    pub(super) w: Vec<f64>,
    pub(super) factor: Cholesky,
    /// Components between their bounds, ascending.
    pub(super) free: Vec<usize>,
    pub(super) rhs: Vec<f64>,
    pub(super) best: Vec<f64>,
}

impl BoxWorkspace {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The states of the last solve. They are where [`block_pivoting`](super::block_pivoting) starts from next.
    #[must_use]
    pub fn states(&self) -> &[BoxState] {
        &self.states
    }

    /// Where the next solve starts from: components beyond the list, or at a bound that is infinite, are between.
    pub fn set_states(&mut self, states: &[BoxState]) {
        self.states.clear();
        self.states.extend_from_slice(states);
    }

    /// `w = W λ + q` of the last solve.
    #[must_use]
    pub fn w(&self) -> &[f64] {
        &self.w
    }

    pub(super) fn resize(&mut self, n: usize) {
        self.states.resize(n, BoxState::Between);
        self.free.clear();
        self.free.reserve(n);
        for v in [&mut self.w, &mut self.rhs, &mut self.best] {
            v.resize(n, 0.0);
        }
    }
}

impl BoxProblem<'_> {
    pub(super) fn n(&self) -> usize {
        self.q.len()
    }

    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.matrix[i * self.n()..(i + 1) * self.n()]
    }

    pub(super) fn diagonal(&self, i: usize) -> f64 {
        self.matrix[i * self.n() + i]
    }

    pub(super) fn clamp(&self, i: usize, value: f64) -> f64 {
        value.max(self.lower[i]).min(self.upper[i])
    }

    pub(super) fn check(&self, lambda: &[f64]) -> Result<(), BoxError> {
        let n = self.n();
        let lengths = [
            ("the matrix", self.matrix.len(), n * n),
            ("the list of lower bounds", self.lower.len(), n),
            ("the list of upper bounds", self.upper.len(), n),
            ("λ", lambda.len(), n),
        ];
        for (what, len, expected) in lengths {
            if len != expected {
                return Err(BoxError::Shape { what, len, expected });
            }
        }
        for (what, v) in [("the matrix", self.matrix), ("q", self.q), ("λ", lambda)] {
            if let Some(index) = first_not_finite(v) {
                return Err(BoxError::NotFinite { what, index });
            }
        }
        for (index, (&lower, &upper)) in self.lower.iter().zip(self.upper).enumerate() {
            if !(lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY) {
                return Err(BoxError::Bounds { index, lower, upper });
            }
        }
        self.check_matrix()
    }

    fn check_matrix(&self) -> Result<(), BoxError> {
        let largest = self.matrix.iter().fold(0.0, |max: f64, v| max.max(v.abs()));
        for row in 0..self.n() {
            for col in 0..row {
                let difference = (self.row(row)[col] - self.row(col)[row]).abs();
                if difference > SYMMETRY * largest {
                    return Err(BoxError::NotSymmetric { row, col, difference });
                }
            }
            let pivot = self.diagonal(row);
            if pivot <= 0.0 {
                return Err(BoxError::NotPositiveDefinite { index: row, pivot });
            }
        }
        Ok(())
    }

    /// `w = W λ + q`.
    pub(super) fn evaluate(&self, lambda: &[f64], w: &mut [f64]) {
        for (i, w) in w.iter_mut().enumerate() {
            *w = dot(self.row(i), lambda) + self.q[i];
        }
    }

    /// What rounding makes of `w_i`, at most.
    pub(super) fn rounding(&self, i: usize, lambda: &[f64]) -> f64 {
        let terms: f64 = self.row(i).iter().zip(lambda).map(|(a, x)| (a * x).abs()).sum();
        (self.n() + 1) as f64 * f64::EPSILON * (terms + self.q[i].abs())
    }

    pub(super) fn natural_residual(&self, lambda: &[f64], w: &[f64]) -> f64 {
        let residual = |i: usize| (lambda[i] - self.clamp(i, lambda[i] - w[i] / self.diagonal(i))).abs();
        (0..self.n()).map(residual).fold(0.0, f64::max)
    }

    /// Puts the components at their bounds, and solves `w = 0` for those between.
    pub(super) fn solve_states(&self, ws: &mut BoxWorkspace, lambda: &mut [f64]) -> Result<(), BoxError> {
        let BoxWorkspace { states, factor, free, rhs, .. } = ws;
        free.clear();
        for (i, state) in states.iter().enumerate() {
            lambda[i] = match state {
                BoxState::Lower => self.lower[i],
                BoxState::Upper => self.upper[i],
                BoxState::Between => {
                    free.push(i);
                    0.0
                }
            };
        }
        let m = free.len();
        factor
            .factor(m, |i, j| self.row(free[i])[free[j]])
            .map_err(|NotPositiveDefinite { row, pivot }| BoxError::NotPositiveDefinite { index: free[row], pivot })?;
        let rhs = &mut rhs[..m];
        for (rhs, &i) in rhs.iter_mut().zip(&*free) {
            *rhs = -(dot(self.row(i), lambda) + self.q[i]);
        }
        factor.solve(rhs);
        for (value, &i) in rhs.iter().zip(&*free) {
            lambda[i] = *value;
        }
        match first_not_finite(lambda) {
            Some(index) => Err(BoxError::NotFinite { what: "the solution", index }),
            None => Ok(()),
        }
    }
}
