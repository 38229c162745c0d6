//! What a needle carries, and how it is read at other nodes.

use super::akima::{Akima, hermite, point_slopes};
use super::error::ReparameteriseError;
use super::linear::Linear;
use super::table::{Place, check_finite, check_increasing, check_len, place};
use crate::coupling::{SlipState, guess};
use serde::{Deserialize, Serialize};

/// What a needle of `n` nodes carries along its length, base first, tip last.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Profile {
    /// Positions of the nodes, m; `3 n` numbers.
    pub positions: Vec<f64>,
    /// Rest lengths of the edges, m; `n − 1` positive numbers.
    pub rest_lengths: Vec<f64>,
    /// Twist angles of the edges from the Bishop frame, rad; `n − 1` numbers.
    pub angles: Vec<f64>,
    /// Rest curvature at the inner nodes, two components each; `2 (n − 2)` numbers. Per length (1/m): a curvature that is
    /// integrated over the edges beside a node depends on their lengths, and must be divided by half their sum before.
    pub rest_curvature: Vec<f64>,
    /// Velocities of the nodes, m/s; `3 n` numbers.
    pub velocity: Vec<f64>,
    /// Accelerations of the nodes, m/s²; `3 n` numbers.
    pub acceleration: Vec<f64>,
    /// States of the nodes in the tissue, which are the last ones, entry first.
    pub states: Vec<SlipState>,
}

impl Profile {
    /// Number of nodes.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.positions.len() / 3
    }

    /// Distances of the nodes from the base, m: sums of the lengths that the edges have.
    #[must_use]
    pub fn arc_lengths(&self) -> Vec<f64> {
        arc_lengths(&self.positions)
    }

    /// Whether all lists have the lengths that belong together, and hold what they should.
    ///
    /// # Errors
    /// [`ReparameteriseError`] that names the list, what it has, and what was expected.
    pub fn check(&self) -> Result<(), ReparameteriseError> {
        check_nodes(&self.positions, self.states.len())?;
        let n = self.n_nodes();
        let lists = [
            ("rest lengths", &self.rest_lengths, n - 1),
            ("angles", &self.angles, n - 1),
            ("rest curvature", &self.rest_curvature, 2 * (n - 2)),
            ("velocity", &self.velocity, 3 * n),
            ("acceleration", &self.acceleration, 3 * n),
        ];
        for (what, list, expected) in lists {
            check_len(what, list, expected)?;
            check_finite(what, list)?;
        }
        check_positive("rest length", &self.rest_lengths)
    }
}

/// Reads what a needle carries at the nodes that it has after a step, `3 n` coordinates, of which the last `coupled` nodes are in
/// the tissue.
///
/// Nodes before and after correspond by their distances from the base; those after are scaled so that the tips agree. Angles
/// (at the middles of the edges) and rest curvature follow [`Akima`], velocity and acceleration are [`Linear`]; beyond the first
/// and the last value all are constant. The rest length from the base to a distance follows Akima's interpolation of the sums of
/// rest lengths, and straight lines between nodes where that would not be monotone: an edge has the difference of its ends,
/// which is positive, and the total does not change. A node in the tissue has the state of the nearest one before.
///
/// Nodes that have not moved keep what they carry to the last bit.
///
/// # Errors
/// If [`Profile::check`] fails, or there are fewer than three nodes after, two of them coincide or are too close for a rest length
/// between them, or `coupled` is more than there are.
///
/// Source: Chentanez et al. (2009), section 3.4.2.
pub fn reparameterise(before: &Profile, positions: &[f64], coupled: usize) -> Result<Profile, ReparameteriseError> {
    before.check()?;
    check_nodes(positions, coupled)?;
    let old = before.arc_lengths();
    let mut new = arc_lengths(positions);
    scale(&mut new, old[old.len() - 1]);
    check_increasing("distances of the nodes from the base after scaling", &new)?;
    let inner = |arc: &[f64]| arc[1..arc.len() - 1].to_vec();
    let mut after = Profile { positions: positions.to_vec(), ..Profile::default() };
    after.rest_lengths = rest_lengths(&old, &before.rest_lengths, &new);
    check_positive("rest length after the step", &after.rest_lengths)?;
    let angles = Akima::new(&middles(&old), &before.angles)?;
    after.angles = sample(&middles(&new), 1, |x, out| angles.evaluate(x, out));
    let curvature = Akima::new(&inner(&old), &before.rest_curvature)?;
    after.rest_curvature = sample(&inner(&new), 2, |x, out| curvature.evaluate(x, out));
    let velocity = Linear::new(&old, &before.velocity)?;
    after.velocity = sample(&new, 3, |x, out| velocity.evaluate(x, out));
    let acceleration = Linear::new(&old, &before.acceleration)?;
    after.acceleration = sample(&new, 3, |x, out| acceleration.evaluate(x, out));
    let (old, new) = (&old[old.len() - before.states.len()..], &new[new.len() - coupled..]);
    guess(old, &before.states, new, &mut after.states);
    Ok(after)
}

/// At least three nodes, in three dimensions, not more of them in the tissue than there are, and none at the place of the next.
fn check_nodes(positions: &[f64], coupled: usize) -> Result<(), ReparameteriseError> {
    let n = positions.len() / 3;
    check_len("positions", positions, 3 * n)?;
    if n < 3 {
        return Err(ReparameteriseError::TooFew { what: "nodes of the needle", count: n, least: 3 });
    }
    if coupled > n {
        return Err(ReparameteriseError::Coupled { coupled, nodes: n, most: n });
    }
    check_finite("positions", positions)?;
    check_increasing("distances of the nodes from the base", &arc_lengths(positions))
}

fn arc_lengths(positions: &[f64]) -> Vec<f64> {
    let mut arc = vec![0.0; positions.len() / 3];
    for i in 1..arc.len() {
        arc[i] = arc[i - 1] + distance(positions, i - 1, i);
    }
    arc
}

fn check_positive(what: &'static str, lengths: &[f64]) -> Result<(), ReparameteriseError> {
    match lengths.iter().position(|&length| length <= 0.0) {
        Some(index) => Err(ReparameteriseError::Length { what, index, value: lengths[index] }),
        None => Ok(()),
    }
}

/// Distance between two nodes.
pub(super) fn distance(positions: &[f64], i: usize, j: usize) -> f64 {
    let along = |k: usize| positions[3 * j + k] - positions[3 * i + k];
    along(0).hypot(along(1)).hypot(along(2))
}

/// Scales distances so that the last one is `length`.
fn scale(arc: &mut [f64], length: f64) {
    if let Some((last, others)) = arc.split_last_mut() {
        let factor = length / *last;
        for value in others {
            *value *= factor;
        }
        *last = length;
    }
}

fn middles(arc: &[f64]) -> Vec<f64> {
    arc.windows(2).map(|ends| 0.5 * (ends[0] + ends[1])).collect()
}

fn sample(x: &[f64], components: usize, evaluate: impl Fn(f64, &mut [f64])) -> Vec<f64> {
    let mut values = vec![0.0; components * x.len()];
    for (x, value) in x.iter().zip(values.chunks_exact_mut(components)) {
        evaluate(*x, value);
    }
    values
}

/// Rest lengths between the distances `new`, from those between the distances `old`.
///
/// A rest length from the base is kept as a number of whole old edges and a part of the next: nothing cancels, and old nodes
/// keep their edges to the last bit.
fn rest_lengths(old: &[f64], lengths: &[f64], new: &[f64]) -> Vec<f64> {
    let slopes = point_slopes(old.len(), |i| lengths[i] / (old[i + 1] - old[i]));
    let split = |x: f64| match place(old, x) {
        Place::Point(i) => (i, 0.0),
        Place::After(i) => {
            let h = old[i + 1] - old[i];
            (i, monotone((x - old[i]) / h, lengths[i], h * slopes[i], h * slopes[i + 1]))
        }
    };
    let ends = new.iter().map(|&x| split(x)).collect::<Vec<_>>();
    ends.windows(2)
        .map(|ends| {
            let [(i, start), (j, end)] = [ends[0], ends[1]];
            lengths[i..j].iter().sum::<f64>() + (end - start)
        })
        .collect()
}

/// The cubic with these slopes if it is monotone, otherwise the straight line. Slopes from zero to three times that of the line
/// suffice (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980), 238-246).
fn monotone(u: f64, rise: f64, start: f64, end: f64) -> f64 {
    let bounded = |slope: f64| slope >= 0.0 && slope <= 3.0 * rise;
    if bounded(start) && bounded(end) { hermite(u, rise, start, end) } else { u * rise }
}
