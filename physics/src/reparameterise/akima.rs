//! Akima's interpolation: piecewise cubic, local, and free of the wiggles of splines.

use super::error::ReparameteriseError;
use super::table::{Place, Table, check_finite};

/// A function with several components, piecewise cubic and continuously differentiable, constant beyond its ends.
///
/// With the slopes `m_i` of the chords, the slope at point `i` is
///
/// ```text
/// t_i = (|m_{i+1} − m_i| m_{i−1} + |m_{i−1} − m_{i−2}| m_i) / (|m_{i+1} − m_i| + |m_{i−1} − m_{i−2}|)
/// ```
///
/// or the mean of `m_{i−1}` and `m_i` where the weights vanish; two chords beyond each end have slopes that continue those of
/// the last two linearly. A value depends on the three points to either side. One point makes a constant, two a
/// straight line. Straight lines are reproduced, and parabolas over equidistant points.
///
/// Source: Akima, *A new method of interpolation and smooth curve fitting based on local procedures*, J. ACM 17 (1970), 589-602.
#[derive(Clone, Debug, PartialEq)]
pub struct Akima {
    table: Table,
    /// `dy/dx` at the points, laid out as the ordinates.
    slopes: Vec<f64>,
}

impl Akima {
    /// Through the points `(x[i], y[i c..(i + 1) c])`, with `c` components, the ratio of the lengths.
    ///
    /// # Errors
    /// If there is no point, a number is not finite or a slope overflows, the abscissae do not increase strictly, or the lengths do not fit.
    pub fn new(x: &[f64], y: &[f64]) -> Result<Self, ReparameteriseError> {
        let table = Table::new(x, y)?;
        let c = table.components;
        let mut slopes = vec![0.0; y.len()];
        for k in 0..c {
            let chord = |i: usize| (y[(i + 1) * c + k] - y[i * c + k]) / (x[i + 1] - x[i]);
            for (i, slope) in point_slopes(x.len(), chord).into_iter().enumerate() {
                slopes[i * c + k] = slope;
            }
        }
        check_finite("slopes between the ordinates", &slopes)?;
        Ok(Self { table, slopes })
    }

    /// Overwrites `out`, one number for each component, by the value at `x`; at a point of the table that is its very ordinate.
    ///
    /// # Panics
    /// If `out` does not have one place for each component.
    pub fn evaluate(&self, x: f64, out: &mut [f64]) {
        let table = &self.table;
        match table.place(x) {
            Place::Point(i) => out.copy_from_slice(&table.y[table.point(i)]),
            Place::After(i) => {
                assert_eq!(out.len(), table.components, "one place for each component");
                let h = table.x[i + 1] - table.x[i];
                let u = (x - table.x[i]) / h;
                for (k, out) in out.iter_mut().enumerate() {
                    let (a, b) = (i * table.components + k, (i + 1) * table.components + k);
                    let rise = table.y[b] - table.y[a];
                    *out = table.y[a] + hermite(u, rise, h * self.slopes[a], h * self.slopes[b]);
                }
            }
        }
    }
}

/// The cubic that rises from 0 to `rise` over `0 ≤ u ≤ 1`, with these slopes in `u` at the ends.
pub(super) fn hermite(u: f64, rise: f64, start: f64, end: f64) -> f64 {
    u * (start + u * (3.0 * rise - 2.0 * start - end + u * (start + end - 2.0 * rise)))
}

/// Akima's slopes at `n` points with these slopes of the `n - 1` chords.
pub(super) fn point_slopes(n: usize, chord: impl Fn(usize) -> f64) -> Vec<f64> {
    if n < 2 {
        return vec![0.0; n];
    }
    // Chord i is m[i + 2].
    let mut m = vec![0.0; n + 3];
    for i in 0..n - 1 {
        m[i + 2] = chord(i);
    }
    // A single chord continues as itself.
    let (second, before_last) = if n > 2 { (m[3], m[n - 1]) } else { (m[2], m[2]) };
    m[1] = 2.0 * m[2] - second;
    m[0] = 2.0 * m[1] - m[2];
    m[n + 1] = 2.0 * m[n] - before_last;
    m[n + 2] = 2.0 * m[n + 1] - m[n];
    (0..n).map(|i| point_slope([m[i], m[i + 1], m[i + 2], m[i + 3]])).collect()
}

/// Two chords before the point, two after.
fn point_slope([m1, m2, m3, m4]: [f64; 4]) -> f64 {
    let (before, after) = ((m2 - m1).abs(), (m4 - m3).abs());
    let sum = before + after;
    if sum > 0.0 { (after * m2 + before * m3) / sum } else { 0.5 * (m2 + m3) }
}
