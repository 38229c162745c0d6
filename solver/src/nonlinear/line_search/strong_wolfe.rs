//! The strong Wolfe conditions.

use super::{End, Found, LineFunction, LineStart, Point, between, within_rounding};
use crate::nonlinear::progress::NonlinearError;

const MAX_TRIALS: usize = 60;
/// A step grows by such a factor while the function falls.
const GROWTH: (f64, f64) = (1.1, 10.0);
/// Interpolation stays this far from the ends of an interval, relative to its length.
const MARGIN: f64 = 0.1;

/// `φ(t) ≤ φ(0) + c₁ t φ'(0)` and `|φ'(t)| ≤ c₂ |φ'(0)|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrongWolfe {
    /// `c₁`, in `(0, 1/2)`.
    pub decrease: f64,
    /// `c₂`, in `(c₁, 1)`; below 1/2 for Fletcher-Reeves directions.
    pub curvature: f64,
}

impl StrongWolfe {
    /// `c₁ = 1e-4`, `c₂ = 0.1`: for conjugate gradients, which want nearly exact steps.
    #[must_use]
    pub fn tight() -> Self {
        Self { decrease: 1e-4, curvature: 0.1 }
    }

    /// `c₁ = 1e-4`, `c₂ = 0.9`: for Newton and quasi-Newton steps, whose length one is usually right.
    #[must_use]
    pub fn loose() -> Self {
        Self { decrease: 1e-4, curvature: 0.9 }
    }

    /// A step that satisfies both conditions: growing steps until one is too long, then cubic interpolation in the interval
    /// between. Each trial costs a value and a slope.
    ///
    /// Promises both conditions with [`End::Satisfied`], the first one in its form for rounding errors where these decide,
    /// and the first one with [`End::AtLimit`].
    ///
    /// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithms 3.5 and 3.6 and eq. (3.59).
    pub fn search(&self, f: &mut impl LineFunction, start: &LineStart) -> Found {
        if let Some(nothing) = start.refused() {
            return nothing;
        }
        let mut previous = start.origin();
        let mut t = start.first.min(start.limit);
        for trial in 1..=MAX_TRIALS {
            let point = Point::at(f, t);
            if !start.decreases(&point, self.decrease) || higher(&point, &previous) {
                return self.zoom(f, start, previous, point, MAX_TRIALS - trial);
            }
            if self.is_flat(start, &point) {
                return point.found(End::Satisfied);
            }
            if point.slope >= 0.0 {
                return self.zoom(f, start, point, previous, MAX_TRIALS - trial);
            }
            if t >= start.limit {
                return point.found(End::AtLimit);
            }
            let beyond = cubic_minimum(&previous, &point);
            let longer = if beyond > t { beyond.clamp(GROWTH.0 * t, GROWTH.1 * t) } else { GROWTH.1 * t };
            t = longer.min(start.limit);
            previous = point;
        }
        previous.found(End::Exhausted)
    }

    pub(super) fn validate(&self) -> Result<(), NonlinearError> {
        between("decrease", self.decrease, 0.0, 0.5, "a number between 0 and 1/2")?;
        between("curvature", self.curvature, self.decrease, 1.0, "a number between `decrease` and 1")
    }

    fn is_flat(&self, start: &LineStart, point: &Point) -> bool {
        point.slope.abs() <= -self.curvature * start.slope
    }

    /// `low` decreases the function sufficiently (or is the start) and falls towards `high`.
    fn zoom(
        &self,
        f: &mut impl LineFunction,
        start: &LineStart,
        mut low: Point,
        mut high: Point,
        trials: usize,
    ) -> Found {
        let mut width = f64::INFINITY;
        for _ in 0..trials {
            let before = std::mem::replace(&mut width, (high.t - low.t).abs());
            if width <= 4.0 * f64::EPSILON * low.t.max(high.t) {
                break;
            }
            // Where interpolation leaves most of the interval, halving is faster.
            let t = if width <= 2.0 / 3.0 * before { interpolate(&low, &high) } else { 0.5 * (low.t + high.t) };
            let point = Point::at(f, t);
            if !start.decreases(&point, self.decrease) || higher(&point, &low) {
                high = point;
                continue;
            }
            if self.is_flat(start, &point) {
                return point.found(End::Satisfied);
            }
            if point.slope * (high.t - low.t) >= 0.0 {
                high = low;
            }
            low = point;
        }
        low.found(End::Exhausted)
    }
}

/// Whether `a` lies above `b` beyond rounding errors.
fn higher(a: &Point, b: &Point) -> bool {
    a.value > b.value && !within_rounding(a.value, b.value)
}

/// A step between two points.
fn interpolate(low: &Point, high: &Point) -> f64 {
    let (left, right) = (low.t.min(high.t), low.t.max(high.t));
    let middle = 0.5 * (left + right);
    if !high.is_inside() {
        return middle;
    }
    let t = if within_rounding(low.value, high.value) {
        low.t - low.slope * (high.t - low.t) / (high.slope - low.slope) // values are noise: the zero of the slope
    } else {
        cubic_minimum(low, high)
    };
    let margin = MARGIN * (right - left);
    if t.is_finite() { t.clamp(left + margin, right - margin) } else { middle }
}

/// The minimiser of the cubic with the values and slopes of two points; NaN if it has none.
fn cubic_minimum(a: &Point, b: &Point) -> f64 {
    let d1 = a.slope + b.slope - 3.0 * (a.value - b.value) / (a.t - b.t);
    let d2 = (d1 * d1 - a.slope * b.slope).sqrt().copysign(b.t - a.t);
    b.t - (b.t - a.t) * (b.slope + d2 - d1) / (b.slope - a.slope + 2.0 * d2)
}
