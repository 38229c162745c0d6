//! An ellipsoid.

use super::{Implicit, ShapeError, error};

/// Newton steps at most; four or five are usual.
const STEPS: usize = 64;

/// An ellipsoid with its axes along the coordinates, by its true distance; see [`Placed`](super::Placed) for others.
#[derive(Clone, Debug, PartialEq)]
pub struct Ellipsoid {
    centre: [f64; 3],
    /// Semi-axes.
    axes: [f64; 3],
    shortest: f64,
    /// `(a_i² - a_min²) / a_min²`.
    excess: [f64; 3],
}

impl Ellipsoid {
    /// An ellipsoid by its semi-axes along x, y and z, m.
    ///
    /// # Errors
    /// A centre that is not finite, a semi-axis that is not positive, all within 1e12 m.
    pub fn new(centre: [f64; 3], semi_axes: [f64; 3]) -> Result<Self, ShapeError> {
        let names = ["the semi-axis along x", "the semi-axis along y", "the semi-axis along z"];
        for (name, &length) in names.into_iter().zip(&semi_axes) {
            error::length(name, length)?;
        }
        let shortest = semi_axes.into_iter().fold(f64::INFINITY, f64::min);
        let excess = semi_axes.map(|a| (a - shortest) * (a + shortest) / (shortest * shortest));
        Ok(Self { centre: error::point("the centre", centre)?, axes: semi_axes, shortest, excess })
    }

    /// Signed distance over the shortest semi-axis of a point in the first octant, in that unit.
    ///
    /// The nearest point is `x_i = a_i² y_i / (t + a_i²)`, with the `t > -a_min²` for which it lies on the ellipsoid.
    /// With `s = t + a_min²`, and `g(s)` the length of the vector of `x_i / a_i`, Newton's method solves `1 / g = 1`,
    /// which is nearly linear; from the left it comes nearer at every step and never steps across.
    ///
    /// Source: Eberly, *Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid* (2013), section 3; the
    /// iteration is that of Moré & Sorensen (1983), SIAM J. Sci. Stat. Comput. 4(3), section 3.
    fn scaled_distance(&self, y: [f64; 3]) -> f64 {
        let a = self.axes.map(|a| a / self.shortest);
        // Left of the root: there one term of the sum alone is one.
        let mut s = (0..3).map(|i| a[i] * y[i] - self.excess[i]).fold(0.0, f64::max);
        if s == 0.0 {
            let ratio = |i: usize| if y[i] == 0.0 { 0.0 } else { y[i] / self.excess[i] };
            let g2: f64 = (0..3).map(|i| (a[i] * ratio(i)).powi(2)).sum();
            if g2 <= 1.0 {
                // On the sheet where two points are nearest, one on each side of it.
                let along2 = 1.0 - g2;
                return -(along2 + (0..3).map(|i| ratio(i).powi(2)).sum::<f64>()).sqrt();
            }
        }
        for _ in 0..STEPS {
            let (mut g2, mut slope) = (0.0, 0.0);
            for i in 0..3 {
                let d = s + self.excess[i];
                if y[i] > 0.0 {
                    let term = (a[i] * y[i] / d).powi(2);
                    g2 += term;
                    slope += term / d;
                }
            }
            let g = g2.sqrt();
            let next = s + g2 * (g - 1.0) / slope;
            // Rounding alone makes it fall or stand, and so does a NaN.
            if next <= s || next.is_nan() {
                break;
            }
            s = next;
        }
        let ratio = |i: usize| if y[i] == 0.0 { 0.0 } else { y[i] / (s + self.excess[i]) };
        (s - 1.0) * (0..3).map(|i| ratio(i).powi(2)).sum::<f64>().sqrt()
    }
}

impl Implicit for Ellipsoid {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let y = std::array::from_fn(|i| ((p[i] - self.centre[i]) / self.shortest).abs());
        self.shortest * self.scaled_distance(y)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let side = |sign: f64| std::array::from_fn(|i| self.centre[i] + sign * self.axes[i]);
        Some([side(-1.0), side(1.0)])
    }
}
