//! The line search of CG_DESCENT.

use super::{End, Found, LineFunction, LineStart, Point, between};
use crate::nonlinear::progress::NonlinearError;
use std::ops::ControlFlow::{self, Break, Continue};

const MAX_TRIALS: usize = 80;

/// The Wolfe conditions `φ(t) ≤ φ(0) + δ t φ'(0)`, `φ'(t) ≥ σ φ'(0)`, or their approximation by slopes,
/// `(2δ − 1) φ'(0) ≥ φ'(t) ≥ σ φ'(0)` with `φ(t) ≤ φ(0) + ε |φ(0)|`, which keeps its meaning where energy differences drown
/// in rounding errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApproximateWolfe {
    /// `δ`, in `(0, 1/2)`.
    pub delta: f64,
    /// `σ`, in `[δ, 1)`.
    pub sigma: f64,
    /// `ε`: by which fraction of itself the energy may rise. Zero or more.
    pub epsilon: f64,
    /// `θ`, in `(0, 1)`: where an interval without a bracket is cut.
    pub theta: f64,
    /// `γ`, in `(0, 1)`: an interval that shrinks less is halved.
    pub gamma: f64,
    /// `ρ > 1`: growth of a step that is too short.
    pub rho: f64,
}

impl Default for ApproximateWolfe {
    /// The constants of CG_DESCENT: δ = 0.1, σ = 0.9, ε = 1e-6, θ = 0.5, γ = 0.66, ρ = 5.
    fn default() -> Self {
        Self { delta: 0.1, sigma: 0.9, epsilon: 1e-6, theta: 0.5, gamma: 0.66, rho: 5.0 }
    }
}

impl ApproximateWolfe {
    /// A step that satisfies the Wolfe conditions or their approximation: growing steps until the slope turns, then secants
    /// from both ends of the interval ("secant²") and bisection. Each trial costs a value and a slope.
    ///
    /// Promises either pair of conditions with [`End::Satisfied`], and Armijo's condition (with δ) with [`End::AtLimit`]
    /// and for a step that is not zero with [`End::Exhausted`].
    ///
    /// Source: Hager & Zhang, SIAM J. Optim. 16 (2005), section 4; initial bracket: Hager & Zhang, ACM TOMS 32 (2006),
    /// Algorithm 851. There the lower end of the interval that a too long step closes is 0; here it is the longest step that
    /// was not too long.
    pub fn search(&self, f: &mut impl LineFunction, start: &LineStart) -> Found {
        if let Some(nothing) = start.refused() {
            return nothing;
        }
        let mut search = Search { settings: self, f, start, trials: MAX_TRIALS, best: start.origin() };
        match search.run() {
            Break(found) => found,
            Continue(never) => match never {},
        }
    }

    pub(super) fn validate(&self) -> Result<(), NonlinearError> {
        between("delta", self.delta, 0.0, 0.5, "a number between 0 and 1/2")?;
        between("sigma", self.sigma, self.delta.next_down(), 1.0, "at least `delta` and below 1")?;
        between("epsilon", self.epsilon, -f64::MIN_POSITIVE, 1.0, "at least 0 and below 1")?;
        between("theta", self.theta, 0.0, 1.0, "a number between 0 and 1")?;
        between("gamma", self.gamma, 0.0, 1.0, "a number between 0 and 1")?;
        between("rho", self.rho, 1.0, f64::INFINITY, "a number above 1")
    }
}

enum Never {}

/// One search; `Break` ends it.
struct Search<'a, F> {
    settings: &'a ApproximateWolfe,
    f: &'a mut F,
    start: &'a LineStart,
    trials: usize,
    /// The lowest point so far that satisfies Armijo's condition, or the start.
    best: Point,
}

/// Ends of an interval with a minimum inside: at the first the function is low enough and falls, at the second it rises.
type Interval = (Point, Point);

impl<F: LineFunction> Search<'_, F> {
    fn run(&mut self) -> ControlFlow<Found, Never> {
        let (mut a, mut b) = self.bracket()?;
        loop {
            let width = b.t - a.t;
            if width <= 4.0 * f64::EPSILON * b.t {
                return Break(self.best.found(End::Exhausted));
            }
            (a, b) = self.double_secant(a, b)?;
            if b.t - a.t > self.settings.gamma * width {
                (a, b) = self.update(a, b, 0.5 * (a.t + b.t))?;
            }
        }
    }

    /// Evaluates a trial; ends the search with it if it satisfies the conditions.
    fn trial(&mut self, t: f64) -> ControlFlow<Found, Point> {
        if self.trials == 0 {
            return Break(self.best.found(End::Exhausted));
        }
        self.trials -= 1;
        let point = Point::at(self.f, t);
        let (start, s) = (self.start, self.settings);
        let decreases = point.value <= start.value + s.delta * t * start.slope;
        if decreases && point.value < self.best.value {
            self.best = point;
        }
        let gentle = point.slope <= (2.0 * s.delta - 1.0) * start.slope && self.is_low(&point);
        if point.slope >= s.sigma * start.slope && (decreases || gentle) {
            return Break(point.found(End::Satisfied));
        }
        Continue(point)
    }

    /// Not above the start, up to `ε`.
    fn is_low(&self, p: &Point) -> bool {
        p.value <= self.start.value + self.settings.epsilon * self.start.value.abs()
    }

    /// Steps B0 to B3.
    fn bracket(&mut self) -> ControlFlow<Found, Interval> {
        let mut low = self.start.origin();
        let mut t = self.start.first.min(self.start.limit);
        loop {
            let point = self.trial(t)?;
            if point.slope >= 0.0 {
                return Continue((low, point));
            }
            if !self.is_low(&point) {
                return self.squeeze(low, point);
            }
            if t >= self.start.limit {
                let end = if self.best.t == t { End::AtLimit } else { End::Exhausted };
                return Break(self.best.found(end));
            }
            low = point;
            t = (self.settings.rho * t).min(self.start.limit);
        }
    }

    /// Step U3: `b` is too high, or outside the domain.
    fn squeeze(&mut self, mut a: Point, mut b: Point) -> ControlFlow<Found, Interval> {
        loop {
            if b.t - a.t <= 4.0 * f64::EPSILON * b.t {
                return Break(self.best.found(End::Exhausted));
            }
            let theta = self.settings.theta;
            let point = self.trial((1.0 - theta) * a.t + theta * b.t)?;
            if point.slope >= 0.0 {
                return Continue((a, point));
            }
            if self.is_low(&point) {
                a = point;
            } else {
                b = point;
            }
        }
    }

    /// Steps U0 to U3.
    fn update(&mut self, a: Point, b: Point, t: f64) -> ControlFlow<Found, Interval> {
        if !(t > a.t && t < b.t) {
            return Continue((a, b));
        }
        let c = self.trial(t)?;
        if c.slope >= 0.0 {
            return Continue((a, c));
        }
        if self.is_low(&c) {
            return Continue((c, b));
        }
        self.squeeze(a, c)
    }

    /// Steps S1 to S4.
    fn double_secant(&mut self, a: Point, b: Point) -> ControlFlow<Found, Interval> {
        let c = secant(&a, &b);
        let (new_a, new_b) = self.update(a, b, c)?;
        if c == new_b.t {
            return self.update(new_a, new_b, secant(&b, &new_b));
        }
        if c == new_a.t {
            return self.update(new_a, new_b, secant(&a, &new_a));
        }
        Continue((new_a, new_b))
    }
}

/// The zero of the line through two slopes; not finite if they are equal.
fn secant(a: &Point, b: &Point) -> f64 {
    (a.t * b.slope - b.t * a.slope) / (b.slope - a.slope)
}
