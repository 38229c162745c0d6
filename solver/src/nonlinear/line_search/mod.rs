//! Line searches: how far to go along a descent direction.
//!
//! Each search is a method of its settings and works on any [`LineFunction`]; the minimisations of this crate choose one by
//! [`LineSearch`]. No search tries a step beyond [`LineStart::limit`], and each backs away from points where the function is
//! infinite or NaN.
//!
//! Close to a minimiser the differences of energies drown in rounding errors long before the slopes do. Where two energies
//! differ by less than [`ROUNDING`] of their size, the searches therefore let slopes decide: the decrease that Armijo's
//! condition asks for is then replaced by `φ'(t) ≤ (2δ − 1) φ'(0)` with δ = 0.1, which says the same of a parabola.
//!
//! Source of that idea: Hager & Zhang, SIAM J. Optim. 16 (2005), section 4.

mod approximate_wolfe;
mod armijo;
mod gradient_first;
mod ray;
mod strong_wolfe;

pub use approximate_wolfe::ApproximateWolfe;
pub use armijo::Armijo;
pub use strong_wolfe::StrongWolfe;

pub(super) use ray::{Idle, Line, Trial, advance};

use super::progress::NonlinearError;

/// Energies that differ by less than this fraction of their size count as equal.
pub const ROUNDING: f64 = 1e-10;

/// δ of the approximate Wolfe condition `φ'(t) ≤ (2δ − 1) φ'(0)`.
const DELTA: f64 = 0.1;

/// A function `φ(t) = E(x + t d)` of the step length.
pub trait LineFunction {
    /// `φ(t)`; infinite or NaN outside the domain.
    fn value(&mut self, t: f64) -> f64;

    /// `φ'(t)`; not finite outside the domain.
    fn slope(&mut self, t: f64) -> f64;
}

/// Where a search starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineStart {
    /// `φ(0)`, finite.
    pub value: f64,
    /// `φ'(0) < 0`.
    pub slope: f64,
    /// First step to try, positive.
    pub first: f64,
    /// Largest step to try, positive, perhaps infinite.
    pub limit: f64,
}

/// The step that a search found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Its length; zero if no step was found to decrease the function.
    pub t: f64,
    /// `φ(t)`.
    pub value: f64,
    /// `φ'(t)`.
    pub slope: f64,
    /// Why the search ended.
    pub end: End,
}

/// Why a line search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The step satisfies the conditions of the search.
    Satisfied,
    /// The step is [`LineStart::limit`]: it decreases the function sufficiently, which falls on too steeply there.
    AtLimit,
    /// The trials are used up, or rounding errors leave no shorter interval; the step is the best one that decreases the
    /// function sufficiently, or zero.
    Exhausted,
    /// There is nothing to search: value, slope, first step or limit do not describe a descent.
    NoDescent,
}

/// The line search of a minimisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineSearch {
    /// Gradients first, energies in doubt. Accepts a step by its gradient alone if `φ'(t) ≤ (2δ − 1) φ'(0)` and the residual
    /// shrinks (or, in conjugate gradients, `|φ'(t)| ≤ 0.1 |φ'(0)|`); otherwise Armijo's condition decides. The cheapest for
    /// elastic bodies: a good first step costs one gradient and no energy.
    GradientFirst,
    /// Backtracking to Armijo's condition.
    Armijo(Armijo),
    /// The strong Wolfe conditions.
    StrongWolfe(StrongWolfe),
    /// The Wolfe conditions, or their approximation by slopes.
    ApproximateWolfe(ApproximateWolfe),
}

impl LineSearch {
    pub(super) fn validate(&self) -> Result<(), NonlinearError> {
        match self {
            Self::GradientFirst => Ok(()),
            Self::Armijo(s) => s.validate(),
            Self::StrongWolfe(s) => s.validate(),
            Self::ApproximateWolfe(s) => s.validate(),
        }
    }
}

/// The minimiser `−φ'(0) / φ''(0)` of the parabola with this slope and curvature; `None` unless it is positive and finite.
#[must_use]
pub fn exact_step(slope: f64, curvature: f64) -> Option<f64> {
    let step = -slope / curvature;
    (curvature > 0.0 && step > 0.0 && step.is_finite()).then_some(step)
}

/// A setting that must lie strictly between two numbers.
fn between(name: &'static str, value: f64, low: f64, high: f64, expected: &'static str) -> Result<(), NonlinearError> {
    if value > low && value < high {
        return Ok(());
    }
    Err(NonlinearError::Setting { name, value, expected })
}

/// Whether rounding errors may explain the difference of two energies.
fn within_rounding(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

/// A trial step and what was found there.
#[derive(Clone, Copy, Debug)]
struct Point {
    t: f64,
    /// Infinite outside the domain.
    value: f64,
    /// NaN outside the domain.
    slope: f64,
}

impl Point {
    fn at(f: &mut impl LineFunction, t: f64) -> Self {
        let outside = Self { t, value: f64::INFINITY, slope: f64::NAN };
        let value = f.value(t);
        if !value.is_finite() {
            return outside;
        }
        let slope = f.slope(t);
        if slope.is_finite() { Self { t, value, slope } } else { outside }
    }

    fn is_inside(&self) -> bool {
        self.value.is_finite()
    }

    fn found(self, end: End) -> Found {
        let Self { t, value, slope } = self;
        Found { t, value, slope, end }
    }
}

impl LineStart {
    fn origin(&self) -> Point {
        Point { t: 0.0, value: self.value, slope: self.slope }
    }

    /// What to return where there is nothing to search.
    fn refused(&self) -> Option<Found> {
        let finite = self.value.is_finite() && self.slope.is_finite() && self.first.is_finite();
        let descent = finite && self.slope < 0.0 && self.first > 0.0 && self.limit > 0.0;
        (!descent).then(|| self.origin().found(End::NoDescent))
    }

    /// Armijo's condition, where rounding does not reduce it to equality.
    fn lowers(&self, t: f64, value: f64, constant: f64) -> bool {
        value < self.value && value <= self.value + constant * t * self.slope
    }

    /// Armijo's condition, or its form for energies that differ by rounding errors.
    fn decreases(&self, p: &Point, constant: f64) -> bool {
        p.is_inside()
            && (self.lowers(p.t, p.value, constant)
                || (within_rounding(p.value, self.value) && p.slope <= (2.0 * DELTA - 1.0) * self.slope))
    }
}

#[cfg(test)]
mod tests;
