//! Vertices moved, one at a time, to where the cells around them cost least.
//!
//! The local problem is that of Freitag & Ollivier-Gooch (1997), *Tetrahedral mesh improvement using swapping and
//! smoothing*, Int. J. Numer. Meth. Eng. 40, section 3; a sum of high powers stands in for their worst angle, so that a
//! descent along the gradient does not stick where two angles are equally bad.

use super::adjacency::{NONE, Stars};
use super::cost::{Cost, Targets};
use super::footing::Footing;
use super::freedom::{Freedom, shortest_edge};
use crate::generate::implicit::Implicit;
use crate::geometry::norm;

/// Descents at one vertex in one sweep.
const DESCENTS: usize = 3;
/// Trial steps of a descent.
const TRIALS: usize = 4;
/// First step, as part of the shortest edge.
const FIRST_STEP: f64 = 0.1;
/// Longest step, as part of the shortest edge.
const LONGEST_STEP: f64 = 0.5;
/// A vertex with steps shorter than this part of the shortest edge is where it should be.
const SHORTEST_STEP: f64 = 1e-3;
/// How far a moved vertex may be from its surface, as part of the shortest edge.
const ON_SURFACE: f64 = 1e-7;
/// Differences for normals, as part of the shortest edge.
const DIFFERENCE: f64 = 1e-4;

/// Moves of vertices, with the lengths of step that served each best.
pub(super) struct Smoother<'a> {
    targets: Targets,
    solids: &'a [Box<dyn Implicit>],
    freedoms: &'a [Freedom],
    /// For each vertex, as part of the shortest edge.
    steps: Vec<f64>,
    /// Corners of the star at hand.
    star: Vec<[[f64; 3]; 3]>,
}

impl<'a> Smoother<'a> {
    pub fn new(targets: Targets, solids: &'a [Box<dyn Implicit>], freedoms: &'a [Freedom]) -> Self {
        Self { targets, solids, freedoms, steps: vec![FIRST_STEP; freedoms.len()], star: Vec::with_capacity(64) }
    }

    /// Moves vertex `v` to where its star costs less, if it can; whether it did.
    pub fn relax(&mut self, points: &mut [[f64; 3]], v: u32, stars: &Stars) -> bool {
        let freedom = &self.freedoms[v as usize];
        if !freedom.moves() || stars.of(v).is_empty() {
            return false;
        }
        let edge = shortest_edge(points, v, stars);
        self.star.clear();
        self.star.extend(stars.of(v).iter().map(|facet| facet.map(|w| points[w as usize])));
        let start = points[v as usize];
        let (mut at, mut cost) = (start, self.cost(&start));
        for _ in 0..DESCENTS {
            let Some(footing) = Footing::new(freedom, self.solids, &at, DIFFERENCE * edge) else { break };
            let uphill = footing.along(self.gradient(&at));
            let slope = norm(&uphill);
            // A NaN fails this test too.
            if !(slope > 0.0 && slope.is_finite()) {
                break;
            }
            let direction = uphill.map(|x| -x / slope);
            let Some(next) = self.descend(v, &at, &cost, &direction, &footing, edge) else { break };
            (at, cost) = next;
        }
        points[v as usize] = at;
        at != start
    }

    /// The first of some trial steps that costs less.
    fn descend(
        &mut self,
        v: u32,
        at: &[f64; 3],
        cost: &Cost,
        direction: &[f64; 3],
        footing: &Footing,
        edge: f64,
    ) -> Option<([f64; 3], Cost)> {
        for trial in 0..TRIALS {
            let step = self.steps[v as usize];
            let there = std::array::from_fn(|k| at[k] + step * edge * direction[k]);
            let next = footing.project(there, ON_SURFACE * edge).map(|p| (p, self.cost_below(&p, cost)));
            if let Some((p, Some(less))) = next {
                if trial == 0 {
                    self.steps[v as usize] = (1.6 * step).min(LONGEST_STEP);
                }
                return Some((p, less));
            }
            if step < SHORTEST_STEP {
                break;
            }
            self.steps[v as usize] = 0.35 * step;
        }
        self.steps[v as usize] = self.steps[v as usize].max(SHORTEST_STEP);
        None
    }

    fn cost(&self, v: &[f64; 3]) -> Cost {
        let mut sum = Cost::NONE;
        self.star.iter().for_each(|others| sum.add(&self.targets.cost(v, others)));
        sum
    }

    /// The cost with the vertex at `v`, if it is less than `limit` and no worst angle falls short of its target that did
    /// not before. Most trials fail at one of the first cells.
    fn cost_below(&self, v: &[f64; 3], limit: &Cost) -> Option<Cost> {
        let mut sum = Cost::NONE;
        for others in &self.star {
            sum.add(&self.targets.cost(v, others));
            if sum.sum >= limit.sum {
                return None;
            }
        }
        sum.keeps(limit, &self.targets.allowed).then_some(sum)
    }

    fn gradient(&self, v: &[f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for others in &self.star {
            let gradient = self.targets.gradient(v, others);
            sum = std::array::from_fn(|k| sum[k] + gradient[k]);
        }
        sum
    }
}

/// The largest distance of a vertex from a surface it keeps to, m; not a number if one is not.
pub(super) fn border_error(points: &[[f64; 3]], freedoms: &[Freedom], solids: &[Box<dyn Implicit>]) -> f64 {
    let on = freedoms.iter().zip(points).flat_map(|(freedom, p)| freedom.solids.map(|s| (s, p)));
    let distances = on.filter(|(s, _)| *s != NONE).map(|(s, p)| solids[s as usize].distance(p).abs());
    distances.fold(0.0, |most: f64, d| if d > most || d.is_nan() { d } else { most })
}
