//! Backtracking.

use super::{DELTA, End, Found, LineFunction, LineStart, Point, between, within_rounding};
use crate::nonlinear::progress::NonlinearError;

const MAX_TRIALS: usize = 60;

/// Backtracking to `φ(t) ≤ φ(0) + c₁ t φ'(0)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Armijo {
    /// `c₁`, in `(0, 1/2)`.
    pub decrease: f64,
}

impl Default for Armijo {
    /// `c₁ = 1e-4`.
    fn default() -> Self {
        Self { decrease: 1e-4 }
    }
}

impl Armijo {
    /// The first step of a falling sequence that decreases the function sufficiently. From one trial to the next the step
    /// goes to the minimum of the parabola through `φ(0)`, `φ'(0)` and `φ(t)`, within `[0.1 t, 0.5 t]`; outside the domain
    /// it is halved. Each trial costs a value, the accepted one a slope too.
    ///
    /// Promises, with [`End::Satisfied`], Armijo's condition or its form for rounding errors; never ends as
    /// [`End::AtLimit`].
    ///
    /// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithm 3.1 and eq. (3.58).
    pub fn search(&self, f: &mut impl LineFunction, start: &LineStart) -> Found {
        if let Some(nothing) = start.refused() {
            return nothing;
        }
        let mut t = start.first.min(start.limit);
        for _ in 0..MAX_TRIALS {
            let value = f.value(t);
            if let Some(point) = self.accepts(f, start, t, value) {
                return point.found(End::Satisfied);
            }
            // A parabola through an infinity, or one that is no parabola, has its minimum at 0 or NaN.
            let minimum = -0.5 * start.slope * t * t / (value - start.value - start.slope * t);
            t = if value.is_finite() { minimum.max(0.1 * t).min(0.5 * t) } else { 0.5 * t };
        }
        start.origin().found(End::Exhausted)
    }

    pub(super) fn validate(&self) -> Result<(), NonlinearError> {
        between("decrease", self.decrease, 0.0, 0.5, "a number between 0 and 1/2")
    }

    /// The point at `t`, unless it has to be shortened; looks at the slope only where the value makes it worth while.
    fn accepts(&self, f: &mut impl LineFunction, start: &LineStart, t: f64, value: f64) -> Option<Point> {
        let lower = start.lowers(t, value, self.decrease);
        if !value.is_finite() || !(lower || within_rounding(value, start.value)) {
            return None;
        }
        let slope = f.slope(t);
        let gentle = slope <= (2.0 * DELTA - 1.0) * start.slope;
        (slope.is_finite() && (lower || gentle)).then_some(Point { t, value, slope })
    }
}
