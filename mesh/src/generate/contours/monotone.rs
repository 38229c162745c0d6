//! Monotone cubic interpolation of a function of one variable.
//!
//! Source: Fritsch & Carlson, SIAM J. Numer. Anal. 17 (1980) 238-246; slopes within by the weighted harmonic mean of Fritsch
//! & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300-304; slopes at the ends by three points, limited to keep the shape.

/// The slope at a knot between intervals of lengths `h0` and `h1` with secants `s0` and `s1`.
#[inline]
pub(super) fn inner_slope(h0: f64, h1: f64, s0: f64, s1: f64) -> f64 {
    if s0 * s1 <= 0.0 {
        return 0.0;
    }
    let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
    (w0 + w1) / (w0 / s0 + w1 / s1)
}

/// The slope at the outer end of an interval of length `h0` and secant `s0`, whose inner neighbour has `h1` and `s1`.
#[inline]
pub(super) fn end_slope(h0: f64, h1: f64, s0: f64, s1: f64) -> f64 {
    let slope = ((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1);
    if slope * s0 <= 0.0 {
        return 0.0;
    }
    if s0 * s1 <= 0.0 && slope.abs() > 3.0 * s0.abs() { 3.0 * s0 } else { slope }
}

/// The slopes at all knots `x`, which increase, of values `y`; two knots or more.
pub(super) fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let secant = |i: usize| (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    let length = |i: usize| x[i + 1] - x[i];
    let last = x.len() - 1;
    if last == 1 {
        return vec![secant(0); 2];
    }
    let slope = |i: usize| match i {
        0 => end_slope(length(0), length(1), secant(0), secant(1)),
        i if i == last => end_slope(length(i - 1), length(i - 2), secant(i - 1), secant(i - 2)),
        i => inner_slope(length(i - 1), length(i), secant(i - 1), secant(i)),
    };
    (0..=last).map(slope).collect()
}

/// Value and derivative at the fraction `t` of an interval of length `h`, from the values and slopes at its ends.
#[inline]
pub(super) fn hermite(h: f64, t: f64, y: [f64; 2], slope: [f64; 2]) -> (f64, f64) {
    let (rise, u) = (y[1] - y[0], 1.0 - t);
    let value = y[0] + t * t * (3.0 - 2.0 * t) * rise + h * t * u * (u * slope[0] - t * slope[1]);
    let derivative = 6.0 * t * u * rise / h + u * (1.0 - 3.0 * t) * slope[0] + t * (3.0 * t - 2.0) * slope[1];
    (value, derivative)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn straight_lines_are_exact() {
        let x = [0.0, 1.0, 4.0, 4.5];
        let y = x.map(|x| 2.0 - 3.0 * x);
        assert!(slopes(&x, &y).iter().all(|s| (s + 3.0).abs() < 1e-12));
        assert_eq!(slopes(&x[..2], &y[..2]), [-3.0, -3.0]);
        let (value, derivative) = hermite(3.0, 0.25, [y[1], y[2]], [-3.0, -3.0]);
        assert!((value - (2.0 - 3.0 * 1.75)).abs() < 1e-12 && (derivative + 3.0).abs() < 1e-12);
    }

    proptest! {
        /// Between two knots the interpolant stays between their values, and its derivative is that of its value.
        #[test]
        fn it_keeps_within_the_values(steps in proptest::collection::vec((0.1_f64..3.0, -5.0_f64..5.0), 2..9), t in 0.0_f64..1.0) {
            let mut x = vec![0.0];
            steps.iter().for_each(|s| x.push(x.last().unwrap() + s.0));
            let mut y = vec![1.0];
            y.extend(steps.iter().map(|s| s.1));
            let m = slopes(&x, &y);
            for i in 0..steps.len() {
                let h = x[i + 1] - x[i];
                let at = |t: f64| hermite(h, t, [y[i], y[i + 1]], [m[i], m[i + 1]]);
                let (value, derivative) = at(t);
                prop_assert!(value >= y[i].min(y[i + 1]) - 1e-12 && value <= y[i].max(y[i + 1]) + 1e-12);
                let difference = (at(t + 1e-6).0 - at(t - 1e-6).0) / (2e-6 * h);
                prop_assert!((difference - derivative).abs() < 1e-6 * (1.0 + derivative.abs() + 1.0 / h));
            }
        }
    }
}
