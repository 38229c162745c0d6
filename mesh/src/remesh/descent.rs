//! The position of one vertex that is best for all cells around it together.
//!
//! Sought is the least sum, over the cells, of the reciprocals of their shapes: of their qualities to the power of -2. Bad
//! cells weigh most in it, and one that is turned over would make it infinite. It is smooth, so that moving vertices in
//! turn goes on improving where maximising the least quality has come to a stop: there, two cells that are equally bad
//! hold each vertex, and it takes two vertices to get better.
//!
//! Source, for sums of an inverse measure over the cells around a vertex: Freitag & Knupp, *Tetrahedral mesh improvement via
//! optimization of the element condition number*, Int. J. Numer. Methods Eng. 53 (2002).

use super::{freedom::Freedom, measure::Star};
use crate::geometry::norm;

/// Searches along lines.
const ROUNDS: usize = 5;
/// The first search goes this far, in root mean square edges, ...
const REACH: f64 = 0.3;
/// ... and halves that so often at most.
const HALVINGS: usize = 7;

impl<const D: usize> Star<D> {
    /// The sum of the reciprocal shapes after a move by `d`; infinite if one is not positive.
    pub fn badness(&self, d: &[f64; D]) -> f64 {
        let mut sum = 0.0;
        for cell in &self.cells {
            let shape = cell.at(d);
            if shape.is_nan() || shape <= 0.0 {
                return f64::INFINITY;
            }
            sum += 1.0 / shape;
        }
        sum
    }

    /// A free move that makes the [badness](Self::badness) as small as a few searches along its gradient can, and that
    /// badness; no move if none is better.
    pub fn descend(&self, freedom: &Freedom<D>) -> ([f64; D], f64) {
        let mut at = [0.0; D];
        let mut best = self.badness(&at);
        let mut reach = REACH * self.rms_edge();
        for _ in 0..ROUNDS {
            let along = freedom.project(&self.downhill(&at));
            let length = norm(&along);
            if !(length > 0.0 && length.is_finite()) {
                break;
            }
            let step = along.map(|x| x * reach / length);
            let Some((part, value)) = self.best_part(&at, &step, best) else { break };
            (0..D).for_each(|k| at[k] += part * step[k]);
            reach *= (2.0 * part).min(1.0);
            best = value;
        }
        (at, best)
    }

    /// The best of the parts 1, 1/2, 1/4, ... of a step, and its badness, if that is below `least`. Beyond the first
    /// minimum nothing is sought.
    fn best_part(&self, at: &[f64; D], step: &[f64; D], least: f64) -> Option<(f64, f64)> {
        let mut best = None;
        let (mut part, mut limit) = (1.0, least);
        for _ in 0..HALVINGS {
            let value = self.badness(&std::array::from_fn(|k| at[k] + part * step[k]));
            if value < limit {
                (best, limit) = (Some((part, value)), value);
            } else if best.is_some() {
                break;
            }
            part *= 0.5;
        }
        best
    }

    /// The direction in which the badness falls fastest; a cell that is turned over is turned back.
    fn downhill(&self, at: &[f64; D]) -> [f64; D] {
        let mut along = [0.0; D];
        for cell in &self.cells {
            let (weight, ascent) = (1.0 / cell.at(at).abs(), cell.ascent(at));
            (0..D).for_each(|k| along[k] += weight * ascent[k]);
        }
        along
    }

    /// The best of some moves to parts of the way `along`, and its badness; none if none is better than `least`.
    pub fn best_slide(&self, along: &[f64; D], least: f64) -> Option<([f64; D], f64)> {
        const PARTS: [f64; 5] = [0.05, 0.1, 0.2, 0.4, 0.6];
        let moves = PARTS.map(|part| along.map(|x| part * x));
        let tried = moves.map(|d| (d, self.badness(&d)));
        tried.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).filter(|best| best.1 < least)
    }

    fn rms_edge(&self) -> f64 {
        let sum: f64 = self.cells.iter().map(super::measure::Moving::sum).sum();
        (sum / (self.cells.len() * D * (D + 1) / 2) as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geometry::distance2, remesh::measure::Moving};

    /// A fan of triangles around a vertex, closed by a regular polygon.
    fn fan(centre: [f64; 2]) -> Star<2> {
        let corner = |i: usize| {
            let (sin, cos) = (i as f64 * std::f64::consts::FRAC_PI_3).sin_cos();
            [cos, sin]
        };
        let mut star = Star::default();
        star.cells.extend((0..6).map(|i| Moving::of(&[centre, corner(i), corner(i + 1)], 1.0, 0)));
        star
    }

    #[test]
    fn the_centre_of_a_polygon_is_best() {
        for centre in [[0.5, 0.3], [-0.1, 0.75], [1.2, 0.1]] {
            let star = fan(centre);
            let (d, best) = star.descend(&Freedom::full());
            let end = [centre[0] + d[0], centre[1] + d[1]];
            // The triangles are regular then: each has shape one.
            assert!(distance2(&end, &[0.0; 2]).sqrt() < 0.05 && (best - 6.0).abs() < 0.1, "{centre:?}: {end:?} {best}");
            assert_eq!(best, star.badness(&d));
        }
    }

    #[test]
    fn a_vertex_keeps_to_its_line() {
        let mut freedom = Freedom::full();
        freedom.restrict(&[0.0, 2.0]);
        let star = fan([0.5, 0.3]);
        let (d, best) = star.descend(&freedom);
        assert!(d[1] == 0.0 && d[0] < -0.3 && best < star.badness(&[0.0; 2]), "{d:?}");
    }

    #[test]
    fn downhill_is_against_the_gradient() {
        let (star, d, h) = (fan([0.2, 0.1]), [0.1, -0.05], 1e-6);
        let along = star.downhill(&d);
        for k in 0..2 {
            let (mut up, mut down) = (d, d);
            up[k] += h;
            down[k] -= h;
            let slope = (star.badness(&up) - star.badness(&down)) / (2.0 * h);
            assert!((slope + along[k]).abs() < 1e-6 * slope.abs().max(1.0), "{slope} {along:?}");
        }
    }

    #[test]
    fn slides_are_taken_if_they_gain() {
        let star = fan([0.5, 0.0]);
        let now = star.badness(&[0.0; 2]);
        let (d, best) = star.best_slide(&[-1.0, 0.0], now).unwrap();
        assert!(d == [-0.4, 0.0] && best < now);
        assert!(star.best_slide(&[1.0, 0.0], now).is_none());
    }
}
