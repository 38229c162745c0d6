//! What a bad cell costs, and which way to move a corner to pay less.
//!
//! Each dihedral angle of cosine `c` has the two ratios `(1 - cos least) / (1 - c)` and `(1 + cos greatest) / (1 + c)`, and
//! each cell the third, `least quality / quality`: above one where a target is missed, infinite for a flat cell. The cost of
//! a cell is the sum of their fourth powers, smooth where the cell is not flat, and ruled by the worst of them.

use super::ImproveSettings;
use crate::geometry::{cross, dot, norm, subtract};

/// Scales that make the targets ratios of one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Targets {
    small: f64,
    large: f64,
    quality: f64,
    /// Ratios that any change may come to: those of the targets, or of the whole mesh at first, should it be better.
    pub allowed: [f64; 3],
}

/// The sum of fourth powers, and the largest of each kind of ratio: small angles, large angles, quality.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cost {
    pub sum: f64,
    pub worst: [f64; 3],
}

impl Cost {
    pub const NONE: Self = Self { sum: 0.0, worst: [0.0; 3] };
    pub const FLAT: Self = Self { sum: f64::INFINITY, worst: [f64::INFINITY; 3] };

    pub fn add(&mut self, other: &Self) {
        self.sum += other.sum;
        self.worst = std::array::from_fn(|k| self.worst[k].max(other.worst[k]));
    }

    /// The largest ratio of all.
    pub fn largest(&self) -> f64 {
        self.worst[0].max(self.worst[1]).max(self.worst[2])
    }

    /// Whether each kind of ratio is at most what it was, or at most `allowed`.
    pub fn keeps(&self, before: &Self, allowed: &[f64; 3]) -> bool {
        (0..3).all(|k| self.worst[k] <= before.worst[k].max(allowed[k]))
    }
}

/// A tetrahedron seen from corner `v`: edges to the others, inward area vectors of the faces opposite these and `v`.
struct Corner {
    edges: [[f64; 3]; 3],
    areas: [[f64; 3]; 4],
    lengths: [f64; 4],
    /// Six times the volume.
    volume6: f64,
    /// Mean of the squared edges.
    mean2: f64,
}

impl Corner {
    /// `None` for a flat or inverted one.
    #[inline]
    fn new(v: &[f64; 3], others: &[[f64; 3]; 3]) -> Option<Self> {
        let [a, b, c] = others.each_ref().map(|p| subtract(p, v));
        let faces = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
        let volume6 = dot(&a, &faces[0]);
        let base = std::array::from_fn(|k| -(faces[0][k] + faces[1][k] + faces[2][k]));
        let areas = [faces[0], faces[1], faces[2], base];
        let (ab, bc, ca) = (subtract(&b, &a), subtract(&c, &b), subtract(&a, &c));
        let sum2: f64 = [a, b, c, ab, bc, ca].iter().map(|e| dot(e, e)).sum();
        let lengths = areas.each_ref().map(norm);
        // A NaN fails this test too.
        (volume6 > 0.0 && volume6.is_finite()).then_some(Self {
            edges: [a, b, c],
            areas,
            lengths,
            volume6,
            mean2: sum2 / 6.0,
        })
    }

    /// `6 sqrt(2) V / l_rms³`.
    #[inline]
    fn quality(&self) -> f64 {
        std::f64::consts::SQRT_2 * self.volume6 / (self.mean2 * self.mean2.sqrt())
    }
}

/// The pairs of faces.
const PAIRS: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

impl Targets {
    pub fn new(settings: &ImproveSettings) -> Self {
        Self {
            small: 1.0 - settings.least_angle_deg.to_radians().cos(),
            large: 1.0 + settings.greatest_angle_deg.to_radians().cos(),
            quality: settings.least_quality,
            allowed: [1.0; 3],
        }
    }

    /// The cost of a cell.
    #[inline]
    pub fn cost_of(&self, points: &[[f64; 3]], cell: &[u32; 4]) -> Cost {
        let [v, a, b, c] = cell.map(|v| points[v as usize]);
        self.cost(&v, &[a, b, c])
    }

    /// The cost of a tetrahedron: `v`, then the others so that its volume is positive.
    #[inline]
    pub fn cost(&self, v: &[f64; 3], others: &[[f64; 3]; 3]) -> Cost {
        let Some(corner) = Corner::new(v, others) else { return Cost::FLAT };
        let quality = self.quality / corner.quality();
        let mut cost = Cost { sum: fourth(quality), worst: [0.0, 0.0, quality] };
        let inverse = corner.lengths.map(|l| 1.0 / l);
        for [i, j] in PAIRS {
            let c = -dot(&corner.areas[i], &corner.areas[j]) * (inverse[i] * inverse[j]);
            let (small, large) = self.ratios(c);
            cost.sum += fourth(small) + fourth(large);
            cost.worst[0] = cost.worst[0].max(small);
            cost.worst[1] = cost.worst[1].max(large);
        }
        // Rounding can make a needle's cosines leave their range.
        if cost.sum.is_finite() { cost } else { Cost::FLAT }
    }

    #[inline]
    fn ratios(&self, c: f64) -> (f64, f64) {
        let inverse = 1.0 / ((1.0 - c) * (1.0 + c)).max(0.0);
        (self.small * (1.0 + c) * inverse, self.large * (1.0 - c) * inverse)
    }

    /// The gradient of the cost by the place of `v`; zero for a flat tetrahedron.
    #[inline]
    pub fn gradient(&self, v: &[f64; 3], others: &[[f64; 3]; 3]) -> [f64; 3] {
        let Some(corner) = Corner::new(v, others) else { return [0.0; 3] };
        let inverse = corner.lengths.map(|l| 1.0 / l);
        let unit: [[f64; 3]; 4] = std::array::from_fn(|i| corner.areas[i].map(|x| x * inverse[i]));
        // By the area vectors of the three faces at `v`.
        let mut by_area = [[0.0; 3]; 4];
        for [i, j] in PAIRS {
            let c = -dot(&unit[i], &unit[j]);
            let (small, large) = self.ratios(c);
            let slope = 4.0 * (fourth(small) * small / self.small - fourth(large) * large / self.large);
            for (i, j) in [(i, j), (j, i)] {
                let factor = -slope * inverse[i];
                by_area[i] = std::array::from_fn(|k| by_area[i][k] + factor * (unit[j][k] + c * unit[i][k]));
            }
        }
        // Where `v` moves by d, the area vector of (v, p, q) changes by d x (p - q).
        let [a, b, c] = &corner.edges;
        let turns = [subtract(b, c), subtract(c, a), subtract(a, b)];
        let parts: [[f64; 3]; 3] = std::array::from_fn(|f| cross(&turns[f], &by_area[f]));
        let quality = -4.0 * fourth(self.quality / corner.quality());
        std::array::from_fn(|k| {
            let mean2 = -(a[k] + b[k] + c[k]) / 3.0;
            let relative = corner.areas[3][k] / corner.volume6 - 1.5 * mean2 / corner.mean2;
            parts[0][k] + parts[1][k] + parts[2][k] + quality * relative
        })
    }
}

#[inline]
fn fourth(x: f64) -> f64 {
    (x * x) * (x * x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality;

    const TET: [[f64; 3]; 4] = [[0.1, 0.2, -0.3], [1.3, 0.1, 0.2], [0.2, 1.7, 0.4], [-0.2, 0.3, 1.1]];

    fn targets() -> Targets {
        let settings = ImproveSettings {
            least_angle_deg: 30.0,
            greatest_angle_deg: 120.0,
            least_quality: 0.5,
            ..Default::default()
        };
        Targets::new(&settings)
    }

    #[test]
    fn ratios_are_those_of_the_angles_and_the_quality() {
        let cost = targets().cost(&TET[0], &[TET[1], TET[2], TET[3]]);
        let (least, most) = quality::angles_deg(&TET);
        let small = (1.0 - 30_f64.to_radians().cos()) / (1.0 - least.to_radians().cos());
        let large = (1.0 + 120_f64.to_radians().cos()) / (1.0 + most.to_radians().cos());
        let expected = [small, large, 0.5 / quality::normalized_volume(&TET)];
        for (found, expected) in cost.worst.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12 * expected, "{found} {expected}");
        }
        let sum: f64 = quality::each_angle_deg(&TET)
            .unwrap()
            .map(|angle| {
                let c = angle.to_radians().cos();
                (small * (1.0 - least.to_radians().cos()) / (1.0 - c)).powi(4)
                    + (large * (1.0 + most.to_radians().cos()) / (1.0 + c)).powi(4)
            })
            .sum();
        assert!((cost.sum - sum - expected[2].powi(4)).abs() < 1e-12 * cost.sum);
    }

    #[test]
    fn the_gradient_is_that_of_the_cost() {
        let (targets, others) = (targets(), [TET[1], TET[2], TET[3]]);
        let gradient = targets.gradient(&TET[0], &others);
        for k in 0..3 {
            let at = |x: f64| {
                let mut v = TET[0];
                v[k] += x;
                targets.cost(&v, &others).sum
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!((gradient[k] - slope).abs() < 1e-6 * norm(&gradient), "{} {slope}", gradient[k]);
        }
    }

    #[test]
    fn flat_and_inverted_cells_cost_infinitely_much() {
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        assert_eq!(targets().cost(&flat[0], &[flat[1], flat[2], flat[3]]), Cost::FLAT);
        assert_eq!(targets().cost(&TET[0], &[TET[2], TET[1], TET[3]]), Cost::FLAT);
        assert_eq!(targets().cost(&[f64::NAN; 3], &[TET[1], TET[2], TET[3]]), Cost::FLAT);
    }
}
