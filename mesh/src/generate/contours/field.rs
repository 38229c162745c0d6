//! The signed distance to a few closed contours in the plane, looked up in a grid of candidates.

use super::polygon::{bounding_box, cross, edges};
use crate::geometry::{distance2, dot, subtract};
use std::ops::Range;

/// Grid cells per edge: more cells, fewer candidates in each.
const CELLS_PER_EDGE: usize = 16;
/// A grid has at most this many cells.
const MOST_CELLS: usize = 16_384;
/// A cell with more candidates lists none; there the blocks are searched.
const MOST_CANDIDATES: usize = 64;
/// Edges in a row whose common box is looked at first.
const BLOCK: usize = 16;
/// The deepest point is looked for from this many samples a side, in so many steps.
const SAMPLES: usize = 32;
const CLIMBS: usize = 20;

/// The signed distance, negative to the left of the edges: inside contours that run counterclockwise around their area, and
/// clockwise around the holes in it.
///
/// A lookup costs the candidates of one grid cell: the edges that are nearest to any point in it.
pub(super) struct Field {
    edges: Vec<Edge>,
    blocks: Vec<Block>,
    grid: Grid,
}

struct Edge {
    from: [f64; 2],
    along: [f64; 2],
    inverse_length: f64,
    /// The edges before and after on the same contour.
    previous: u32,
    next: u32,
}

struct Block {
    bounds: [[f64; 2]; 2],
    edges: Range<usize>,
}

struct Grid {
    low: [f64; 2],
    high: [f64; 2],
    size: [usize; 2],
    per_metre: [f64; 2],
    /// Candidates of each cell in `candidates`: from its number to the next one's; none where there are too many.
    starts: Vec<u32>,
    candidates: Vec<u32>,
}

/// The nearest edge so far: its squared distance, and where along it the nearest point is, from 0 to 1.
#[derive(Clone, Copy)]
struct Nearest {
    distance2: f64,
    edge: usize,
    t: f64,
}

impl Field {
    /// The field of some contours, quick within `cover` (lowest, highest corner). Neighbouring points differ.
    pub(super) fn new<'a>(contours: impl Iterator<Item = &'a [[f64; 2]]>, cover: [[f64; 2]; 2]) -> Self {
        let (mut all, mut blocks) = (Vec::new(), Vec::new());
        for contour in contours {
            let (start, n) = (all.len(), contour.len());
            for (i, (a, b)) in edges(contour).enumerate() {
                let number = |i: usize| (start + i % n) as u32;
                let (previous, next) = (number(i + n - 1), number(i + 1));
                let inverse_length = 1.0 / distance2(&a, &b).sqrt();
                all.push(Edge { from: a, along: subtract(&b, &a), inverse_length, previous, next });
            }
            for first in (0..n).step_by(BLOCK) {
                let last = (first + BLOCK).min(n);
                let bounds = bounding_box((first..=last).map(|i| &contour[i % n]));
                blocks.push(Block { bounds, edges: start + first..start + last });
            }
        }
        let mut field = Self { edges: all, blocks, grid: Grid::empty(cover) };
        field.fill_grid();
        field
    }

    /// The signed distance at `p`, m.
    #[inline]
    pub(super) fn distance(&self, p: &[f64; 2]) -> f64 {
        let mut nearest = Nearest { distance2: f64::INFINITY, edge: 0, t: 0.0 };
        match self.grid.candidates(p) {
            Some(candidates) => candidates.iter().for_each(|&i| self.look_at(i as usize, p, &mut nearest)),
            None => nearest = self.search(p),
        }
        self.signed(p, nearest)
    }

    /// The depth of the deepest point inside, and that point: of those on a grid the deepest, then uphill from there. In
    /// odd shapes another place may be deeper, by less than the spacing of the samples.
    pub(super) fn deepest(&self) -> (f64, [f64; 2]) {
        let bounds = bounding_box(self.blocks.iter().flat_map(|block| &block.bounds));
        let mut step: [f64; 2] = std::array::from_fn(|k| (bounds[1][k] - bounds[0][k]) / SAMPLES as f64);
        let sample = |i: usize| {
            let at = [i % SAMPLES, i / SAMPLES].map(|n| n as f64 + 0.5);
            std::array::from_fn(|k| bounds[0][k] + at[k] * step[k])
        };
        // What is too thin for the grid is met beside the middles of its edges.
        let beside = |edge: &Edge| {
            let inwards = [-edge.along[1], edge.along[0]];
            std::array::from_fn(|k| edge.from[k] + 0.5 * edge.along[k] + 0.1 * inwards[k])
        };
        let starts = (0..SAMPLES * SAMPLES).map(sample).chain(self.edges.iter().map(beside));
        let deeper = |a: (f64, [f64; 2]), p: [f64; 2]| {
            let d = self.distance(&p);
            if d < a.0 { (d, p) } else { a }
        };
        let mut best = starts.fold((f64::INFINITY, self.grid.low), deeper);
        for _ in 0..CLIMBS {
            let [x, y] = best.1;
            let around = [[x - step[0], y], [x + step[0], y], [x, y - step[1]], [x, y + step[1]]];
            best = around.into_iter().fold(best, deeper);
            if best.1 == [x, y] {
                step = step.map(|s| s / 2.0);
            }
        }
        ((-best.0).max(0.0), best.1)
    }

    /// The nearest edge of all, block by block.
    fn search(&self, p: &[f64; 2]) -> Nearest {
        let mut nearest = Nearest { distance2: f64::INFINITY, edge: 0, t: 0.0 };
        for block in &self.blocks {
            if distance2_to_box(&block.bounds, p) < nearest.distance2 {
                block.edges.clone().for_each(|i| self.look_at(i, p, &mut nearest));
            }
        }
        nearest
    }

    #[inline]
    fn look_at(&self, i: usize, p: &[f64; 2], nearest: &mut Nearest) {
        let edge = &self.edges[i];
        let w = subtract(p, &edge.from);
        let t = (dot(&w, &edge.along) * edge.inverse_length * edge.inverse_length).clamp(0.0, 1.0);
        let apart = [w[0] - t * edge.along[0], w[1] - t * edge.along[1]];
        let distance2 = dot(&apart, &apart);
        if distance2 < nearest.distance2 {
            *nearest = Nearest { distance2, edge: i, t };
        }
    }

    /// The distance with its sign. Near a corner the edge whose line is farther tells the side.
    #[inline]
    fn signed(&self, p: &[f64; 2], nearest: Nearest) -> f64 {
        let edge = &self.edges[nearest.edge];
        let mut left = edge.left(p);
        let other = match nearest.t {
            0.0 => Some(edge.previous),
            1.0 => Some(edge.next),
            _ => None,
        };
        if let Some(other) = other {
            let beside = self.edges[other as usize].left(p);
            left = if beside.abs() > left.abs() { beside } else { left };
        }
        if left > 0.0 { -nearest.distance2.sqrt() } else { nearest.distance2.sqrt() }
    }

    fn fill_grid(&mut self) {
        let mut grid = Grid::new([self.grid.low, self.grid.high], self.edges.len());
        let half = (0..2).map(|k| 0.5 / grid.per_metre[k]).fold(0.0, f64::hypot);
        for cell in 0..grid.size[0] * grid.size[1] {
            let centre = grid.centre(cell);
            // Whatever is nearest to a point of the cell is at most twice its half diagonal farther from the centre than
            // what is nearest to that; a little more, for rounding.
            let reach = self.search(&centre).distance2.sqrt() + 2.0 * half * (1.0 + 1e-9);
            let start = grid.candidates.len();
            for block in self.blocks.iter().filter(|b| distance2_to_box(&b.bounds, &centre) <= reach * reach) {
                for i in block.edges.clone() {
                    let mut nearest = Nearest { distance2: f64::INFINITY, edge: 0, t: 0.0 };
                    self.look_at(i, &centre, &mut nearest);
                    if nearest.distance2 <= reach * reach {
                        grid.candidates.push(i as u32);
                    }
                }
            }
            if grid.candidates.len() - start > MOST_CANDIDATES {
                grid.candidates.truncate(start);
            }
            grid.starts.push(grid.candidates.len() as u32);
        }
        self.grid = grid;
    }
}

impl Edge {
    /// How far `p` is to the left of the edge's line, m.
    #[inline]
    fn left(&self, p: &[f64; 2]) -> f64 {
        cross(&self.along, &subtract(p, &self.from)) * self.inverse_length
    }
}

impl Grid {
    fn empty([low, high]: [[f64; 2]; 2]) -> Self {
        Self { low, high, size: [0; 2], per_metre: [0.0; 2], starts: vec![0], candidates: Vec::new() }
    }

    /// A grid of nearly square cells, their lists yet empty.
    fn new(cover: [[f64; 2]; 2], n_edges: usize) -> Self {
        let mut grid = Self::empty(cover);
        let extent: [f64; 2] = std::array::from_fn(|k| grid.high[k] - grid.low[k]);
        let wanted = (CELLS_PER_EDGE * n_edges).clamp(1, MOST_CELLS) as f64;
        for k in 0..2 {
            let n = (wanted * extent[k] / extent[1 - k]).sqrt();
            grid.size[k] = (n as usize).clamp(1, MOST_CELLS);
            grid.per_metre[k] = grid.size[k] as f64 / extent[k];
        }
        grid
    }

    fn centre(&self, cell: usize) -> [f64; 2] {
        let at = [cell % self.size[0], cell / self.size[0]];
        std::array::from_fn(|k| self.low[k] + (at[k] as f64 + 0.5) / self.per_metre[k])
    }

    /// The candidates at `p`; `None` outside the grid, and where there are too many.
    #[inline]
    fn candidates(&self, p: &[f64; 2]) -> Option<&[u32]> {
        if !(0..2).all(|k| self.low[k] <= p[k] && p[k] < self.high[k]) {
            return None;
        }
        let at = |k: usize| (((p[k] - self.low[k]) * self.per_metre[k]) as usize).min(self.size[k].wrapping_sub(1));
        let cell = at(1) * self.size[0] + at(0);
        let (from, to) = (*self.starts.get(cell)?, *self.starts.get(cell + 1)?);
        if from == to { None } else { self.candidates.get(from as usize..to as usize) }
    }
}

#[inline]
fn distance2_to_box(bounds: &[[f64; 2]; 2], p: &[f64; 2]) -> f64 {
    let outside = |k: usize| (bounds[0][k] - p[k]).max(p[k] - bounds[1][k]).max(0.0);
    let [x, y] = [outside(0), outside(1)];
    x * x + y * y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::contours::polygon::{contains, distance2_to_segment};
    use proptest::prelude::*;

    /// A star around the origin: its radii at even angles.
    fn star(radii: &[f64]) -> Vec<[f64; 2]> {
        let angle = |i: usize| i as f64 / radii.len() as f64 * std::f64::consts::TAU;
        radii.iter().enumerate().map(|(i, r)| [r * angle(i).cos(), r * angle(i).sin()]).collect()
    }

    #[test]
    fn the_deepest_points_of_a_disk_and_of_a_ring() {
        let disk = star(&[2.0; 200]);
        let field = Field::new([disk.as_slice()].into_iter(), [[-3.0; 2], [3.0; 2]]);
        let (depth, at) = field.deepest();
        assert!((depth - 2.0).abs() < 1e-3 && at.iter().all(|x| x.abs() < 1e-3), "{depth} at {at:?}");
        let mut hole = star(&[1.0; 100]);
        hole.reverse();
        let field = Field::new([disk.as_slice(), hole.as_slice()].into_iter(), [[-3.0; 2], [3.0; 2]]);
        assert!((field.deepest().0 - 0.5).abs() < 1e-3);
        assert!((field.distance(&[0.0, 0.0]) - 1.0).abs() < 1e-3);
    }

    proptest! {
        /// In the grid and outside it, distance and sign are those of all edges and of the crossing number.
        #[test]
        fn lookups_agree_with_brute_force(
            radii in proptest::collection::vec(0.2_f64..2.0, 3..80),
            probes in proptest::collection::vec((-4.0_f64..4.0, -4.0_f64..4.0), 50),
        ) {
            let polygon = star(&radii);
            let field = Field::new([polygon.as_slice()].into_iter(), [[-2.5; 2], [2.5; 2]]);
            for (x, y) in probes {
                let p = [x, y];
                let nearest2 = edges(&polygon).map(|(a, b)| distance2_to_segment(&a, &b, &p)).fold(f64::INFINITY, f64::min);
                let d = field.distance(&p);
                prop_assert!((d.abs() - nearest2.sqrt()).abs() < 1e-12);
                prop_assert!(d.abs() < 1e-9 || (d < 0.0) == contains(&polygon, &p), "{d} at {p:?}");
            }
        }
    }
}
