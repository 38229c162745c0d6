//! The quality that candidates are compared by, and its maximisation over the position of one vertex.
//!
//! Quality is [`normalized_volume`](crate::quality::normalized_volume), volume over the `D`-th power of the root mean
//! square edge; what is compared is its square with its sign, which orders cells alike and takes no root:
//!
//! ```text
//!   V |V| k / S^D,   S = sum of the squared edges,   k = (D!)^2 2^D (D (D + 1) / 2)^D / (D + 1)
//! ```
//!
//! As one vertex moves, `V` is linear and `S` quadratic in its position. Where `V > 0`, `V / S^(D/2)` is a linear over a
//! convex positive function: quasiconcave, and so is the least over several cells. A line therefore has one maximum, and
//! a search by sections finds it.
//!
//! Source of the measure: Parthasarathy, Graichen & Hathaway, Finite Elem. Anal. Des. 15 (1994); of the quasiconcave
//! view: Amenta, Bern & Eppstein, J. Algorithms 30 (1999).

use crate::{
    geometry::{self, distance2, dot, factorial, subtract},
    quality,
};

/// `k` of the module text.
#[inline]
fn scale<const D: usize>() -> f64 {
    let n_edges = (D * (D + 1) / 2) as f64;
    (factorial(D) * factorial(D)) * (2.0 * n_edges).powi(D as i32) / (D as f64 + 1.0)
}

#[inline]
fn power<const D: usize>(s: f64) -> f64 {
    match D {
        2 => s * s,
        3 => s * s * s,
        _ => s.powi(D as i32),
    }
}

/// The square, with its sign, of the normalised volume of a simplex whose corners have orientation `sign`.
#[inline]
pub(super) fn shape<const D: usize, const N: usize>(corners: &[[f64; D]; N], sign: f64) -> f64 {
    let volume = sign * geometry::signed_measure(corners);
    let mut sum = 0.0;
    for i in 1..N {
        for j in 0..i {
            sum += distance2(&corners[i], &corners[j]);
        }
    }
    scale::<D>() * volume * volume.abs() / power::<D>(sum)
}

/// The gradient of the signed volume with respect to the position of corner `at`: the normal of the opposite facet.
#[inline]
pub(super) fn volume_gradient<const D: usize, const N: usize>(corners: &[[f64; D]; N], at: usize) -> [f64; D] {
    // The corners after `at`, cyclically; turning N corners through one place has the sign of (-1)^D.
    let others: [[f64; D]; N] = std::array::from_fn(|i| corners[(at + 1 + i) % N]);
    let sign = if D % 2 == 1 && at.is_multiple_of(2) { -1.0 } else { 1.0 } / factorial(D);
    let (e, f) = (subtract(&others[1], &others[0]), subtract(&others[2 % N], &others[0]));
    std::array::from_fn(|k| match D {
        2 => sign * if k == 0 { -e[1] } else { e[0] },
        3 => sign * (e[(k + 1) % D] * f[(k + 2) % D] - e[(k + 2) % D] * f[(k + 1) % D]),
        _ => {
            // The volume is linear in the corner: a unit step from the facet.
            let mut raised = *corners;
            raised[at] = others[0];
            raised[at][k] += 1.0;
            geometry::signed_measure(&raised)
        }
    })
}

/// The shape of a cell as a function of how far one corner moves from where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moving<const D: usize> {
    /// What the shape is multiplied by.
    factor: f64,
    volume: f64,
    gradient: [f64; D],
    sum: f64,
    /// Half the gradient of the sum of squared edges.
    slope: [f64; D],
}

impl<const D: usize> Moving<D> {
    /// Of a simplex whose corner `at` moves.
    pub fn of<const N: usize>(corners: &[[f64; D]; N], sign: f64, at: usize) -> Self {
        let gradient = volume_gradient(corners, at).map(|x| sign * x);
        let base = &corners[usize::from(at == 0)];
        let volume = dot(&gradient, &subtract(&corners[at], base));
        let (mut sum, mut slope) = (0.0, [0.0; D]);
        for i in 0..N {
            for j in 0..i {
                sum += distance2(&corners[i], &corners[j]);
            }
            if i != at {
                let edge = subtract(&corners[at], &corners[i]);
                (0..D).for_each(|k| slope[k] += edge[k]);
            }
        }
        Self { factor: scale::<D>(), volume, gradient, sum, slope }
    }

    /// With the shape multiplied by `weight`: of less weight in a maximisation of the least, if that is above one.
    pub fn weighted(self, weight: f64) -> Self {
        Self { factor: weight * self.factor, ..self }
    }

    /// The shape after a move by `d`.
    #[inline]
    pub fn at(&self, d: &[f64; D]) -> f64 {
        let volume = self.volume + dot(&self.gradient, d);
        let sum = self.sum + 2.0 * dot(&self.slope, d) + D as f64 * dot(d, d);
        self.factor * volume * volume.abs() / power::<D>(sum)
    }

    /// The sum of the squared edges.
    pub fn sum(&self) -> f64 {
        self.sum
    }

    /// The gradient of the logarithm of the shape after a move by `d`, of the sign of the volume.
    pub fn ascent(&self, d: &[f64; D]) -> [f64; D] {
        let volume = self.volume + dot(&self.gradient, d);
        let sum = self.sum + 2.0 * dot(&self.slope, d) + D as f64 * dot(d, d);
        let (a, b) = (2.0 / volume.abs(), 2.0 * D as f64 / sum);
        std::array::from_fn(|k| a * self.gradient[k] - b * (self.slope[k] + D as f64 * d[k]))
    }
}

/// The shape of a cell along a line.
#[derive(Clone, Copy, Debug)]
struct Along {
    factor: f64,
    volume: [f64; 2],
    sum: [f64; 3],
}

impl Along {
    #[inline]
    fn of<const D: usize>(cell: &Moving<D>, from: &[f64; D], along: &[f64; D]) -> Self {
        let d = D as f64;
        Self {
            factor: cell.factor,
            volume: [cell.volume + dot(&cell.gradient, from), dot(&cell.gradient, along)],
            sum: [
                cell.sum + 2.0 * dot(&cell.slope, from) + d * dot(from, from),
                2.0 * (dot(&cell.slope, along) + d * dot(from, along)),
                d * dot(along, along),
            ],
        }
    }

    #[inline]
    fn at<const D: usize>(&self, s: f64) -> f64 {
        let volume = self.volume[0] + s * self.volume[1];
        let sum = self.sum[0] + s * (self.sum[1] + s * self.sum[2]);
        self.factor * volume * volume.abs() / power::<D>(sum)
    }
}

/// The cells around a vertex as functions of its position, and working memory for their optimisation.
#[derive(Clone, Debug)]
pub(super) struct Star<const D: usize> {
    pub cells: Vec<Moving<D>>,
    lines: Vec<Along>,
}

impl<const D: usize> Default for Star<D> {
    fn default() -> Self {
        Self { cells: Vec::new(), lines: Vec::new() }
    }
}

impl<const D: usize> Star<D> {
    /// The least shape after a move by `d`.
    pub fn least(&self, d: &[f64; D]) -> f64 {
        self.cells.iter().fold(f64::INFINITY, |least, cell| least.min(cell.at(d)))
    }

    /// The least shape at a place of the line; or something not above `floor`, if it is not above it.
    ///
    /// Whichever cell falls below the floor comes first the next time, since it will do so again.
    fn least_above(&mut self, s: f64, floor: f64) -> f64 {
        let mut least = f64::INFINITY;
        for i in 0..self.lines.len() {
            let value = self.lines[i].at::<D>(s);
            if value <= floor {
                self.lines.swap(0, i);
                return value;
            }
            if value < least {
                least = value;
            }
        }
        least
    }

    fn set_line(&mut self, from: &[f64; D], along: &[f64; D]) {
        self.lines.clear();
        self.lines.extend(self.cells.iter().map(|cell| Along::of(cell, from, along)));
    }

    /// Golden sections between `low` and `high`, from the place `best.0` of shape `best.1`, which stays within.
    fn golden_sections(&mut self, n: usize, (mut low, mut high): (f64, f64), mut best: (f64, f64)) -> (f64, f64) {
        const GOLDEN: f64 = 0.381_966_011_250_105;
        for _ in 0..n {
            let to_low = best.0 - low > high - best.0;
            let s = if to_low { best.0 - GOLDEN * (best.0 - low) } else { best.0 + GOLDEN * (high - best.0) };
            let found = self.least_above(s, best.1);
            let better = found > best.1;
            match (to_low, better) {
                (true, true) => high = best.0,
                (true, false) => low = s,
                (false, true) => low = best.0,
                (false, false) => high = s,
            }
            if better {
                best = (s, found);
            }
        }
        best
    }

    /// The move `from + s * along` with `s` within `range` that maximises the least shape, and this shape; `None` if
    /// no place found is better than `least`.
    pub fn best_on_line(
        &mut self,
        from: &[f64; D],
        along: &[f64; D],
        range: (f64, f64),
        least: f64,
    ) -> Option<([f64; D], f64)> {
        const SAMPLES: usize = 4;
        const SECTIONS: usize = 6;
        self.set_line(from, along);
        let step = (range.1 - range.0) / SAMPLES as f64;
        let mut best = (f64::NAN, least);
        for i in 0..SAMPLES {
            let s = range.0 + (i as f64 + 0.5) * step;
            let found = self.least_above(s, best.1);
            if found > best.1 {
                best = (s, found);
            }
        }
        if best.0.is_nan() {
            return None;
        }
        // The maximum lies between the neighbours of the best sample.
        let bracket = ((best.0 - step).max(range.0), (best.0 + step).min(range.1));
        let best = self.golden_sections(SECTIONS, bracket, best);
        Some((std::array::from_fn(|k| from[k] + best.0 * along[k]), best.1))
    }
}

/// The extreme angles between facets of some simplices: `(180, 0)` of none.
///
/// Cosines tell which simplices have them; only of these are the angles computed.
pub(super) fn extreme_angles_deg<const D: usize, const N: usize>(
    simplices: impl Iterator<Item = [[f64; D]; N]>,
) -> (f64, f64) {
    let (mut widest, mut narrowest) = ((f64::INFINITY, None), (f64::NEG_INFINITY, None));
    for corners in simplices {
        // The normals of the facets all point inwards, or all outwards.
        let g: [[f64; D]; N] = std::array::from_fn(|i| volume_gradient(&corners, i));
        let norms2 = g.map(|g| dot(&g, &g));
        for j in 1..N {
            for i in 0..j {
                // The square of the cosine, with its sign.
                let product = -dot(&g[i], &g[j]);
                let cosine = product * product.abs() / (norms2[i] * norms2[j]);
                if cosine.is_nan() {
                    return (0.0, 180.0);
                }
                if cosine < widest.0 {
                    widest = (cosine, Some(corners));
                }
                if cosine > narrowest.0 {
                    narrowest = (cosine, Some(corners));
                }
            }
        }
    }
    let min = narrowest.1.map_or(180.0, |corners| quality::angles_deg(&corners).0);
    let max = widest.1.map_or(0.0, |corners| quality::angles_deg(&corners).1);
    (min, max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality::normalized_volume;

    const TET: [[f64; 3]; 4] = [[0.1, 0.2, -0.3], [1.3, 0.1, 0.2], [0.2, 1.7, 0.4], [-0.2, 0.3, 2.1]];

    #[test]
    fn a_shape_is_the_square_of_the_normalised_volume() {
        let q = normalized_volume(&TET);
        assert!((shape(&TET, 1.0) - q * q.abs()).abs() < 1e-14);
        assert!((shape(&TET, -1.0) + q * q.abs()).abs() < 1e-14);
        let triangle = [[0.0, 0.0], [3.0, 0.5], [1.0, 2.0]];
        let q = normalized_volume(&triangle);
        assert!((shape(&triangle, 1.0) - q * q).abs() < 1e-14);
    }

    #[test]
    fn a_moving_corner_is_followed() {
        let d = [0.3, -0.2, 0.11];
        for at in 0..4 {
            let mut moved = TET;
            (0..3).for_each(|k| moved[at][k] += d[k]);
            assert!((Moving::of(&TET, 1.0, at).at(&d) - shape(&moved, 1.0)).abs() < 1e-13);
        }
    }

    #[test]
    fn the_ascent_is_the_gradient_of_the_logarithm() {
        let (cell, d, h) = (Moving::of(&TET, 1.0, 2), [0.1, 0.05, -0.1], 1e-6);
        for k in 0..3 {
            let (mut up, mut down) = (d, d);
            up[k] += h;
            down[k] -= h;
            let slope = (cell.at(&up).ln() - cell.at(&down).ln()) / (2.0 * h);
            assert!((slope - cell.ascent(&d)[k]).abs() < 1e-7 * slope.abs().max(1.0));
        }
    }

    #[test]
    fn the_apex_over_a_regular_base_rises_to_the_regular_simplex() {
        let h = 3.0_f64.sqrt() / 2.0;
        let triangle = [[0.0, 0.0], [1.0, 0.0], [0.3, 0.2]];
        let mut star = Star { cells: vec![Moving::of(&triangle, 1.0, 2)], ..Star::default() };
        let (d, best) = star.best_on_line(&[0.2, -0.2], &[0.0, 2.0], (0.0, 1.0), 0.0).unwrap();
        assert!((best - 1.0).abs() < 1e-2 && (d[1] - (h - 0.2)).abs() < 0.05, "{d:?} {best}");
    }

    #[test]
    fn extreme_angles_are_those_of_the_simplices() {
        let flat = TET.map(|[x, y, z]| [x, y, 0.2 * z]);
        let (a, b) = (quality::angles_deg(&TET), quality::angles_deg(&flat));
        assert_eq!(extreme_angles_deg([TET, flat].into_iter()), (a.0.min(b.0), a.1.max(b.1)));
        assert_eq!(extreme_angles_deg::<3, 4>(std::iter::empty()), (180.0, 0.0));
    }
}
