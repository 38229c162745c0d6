//! Edges removed: the cells around an edge replaced by others without it, and the reverse for a facet.
//!
//! The ring of vertices around the edge is triangulated where that costs least, by dynamic programming, and each triangle is
//! joined to both ends of the edge. For a ring of three this is the 3-2 flip, for one of four the 4-4 flip.
//!
//! Source: Shewchuk, *Two discrete optimization algorithms for the topological improvement of tetrahedral meshes* (2002),
//! section 2 (Klincsek's algorithm), with a sum in place of a minimum.

use super::adjacency::{Complex, FACETS, NONE};
use super::cost::{Cost, Targets};

/// Longest ring considered: with the number of vertices grows the number of cells that replace those around the edge.
const RING: usize = 8;
/// A replacement must save this part of the cost.
const GAIN: f64 = 1e-3;

/// Replacements, with the tables of the search for them.
pub(super) struct Flipper {
    targets: Targets,
    /// Cells that are replaced, and what replaces them.
    old: Vec<u32>,
    new: Vec<[u32; 4]>,
    /// The best found at a cell.
    best_old: Vec<u32>,
    best_new: Vec<[u32; 4]>,
    ring: Vec<u32>,
}

impl Flipper {
    pub fn new(targets: Targets) -> Self {
        let (old, best_old, ring) = (Vec::with_capacity(RING), Vec::with_capacity(RING), Vec::with_capacity(RING));
        Self { targets, old, new: Vec::with_capacity(2 * RING), best_old, best_new: Vec::with_capacity(2 * RING), ring }
    }

    /// Carries out the replacement around an edge or a facet of cell `t` that saves most, if any saves enough.
    pub fn improve(&mut self, points: &[[f64; 3]], complex: &mut Complex, t: u32) -> bool {
        let mut most = 0.0;
        for i in 0..4 {
            for j in 0..4 {
                let saved = if i < j {
                    self.edge(points, complex, t, i, j)
                } else if i == j {
                    self.facet(points, complex, t, i)
                } else {
                    None
                };
                if saved.is_some_and(|saved| saved > most) {
                    most = saved.unwrap_or(0.0);
                    std::mem::swap(&mut self.old, &mut self.best_old);
                    std::mem::swap(&mut self.new, &mut self.best_new);
                }
            }
        }
        if most > 0.0 {
            complex.replace(&self.best_old, &self.best_new);
        }
        most > 0.0
    }

    /// What the removal of an edge saves; the cells are left in `old` and `new`.
    fn edge(&mut self, points: &[[f64; 3]], complex: &Complex, t: u32, i: usize, j: usize) -> Option<f64> {
        let ends = [complex.cells[t as usize][i], complex.cells[t as usize][j]];
        if !self.walk(complex, t, i, j) {
            return None;
        }
        let mut before = Cost::NONE;
        for &t in &self.old {
            before.add(&self.targets.cost_of(points, &complex.cells[t as usize]));
        }
        let n = self.ring.len();
        // Cost and last triangle of the polygon from corner i to corner k of the ring.
        let mut table = [[0.0; RING]; RING];
        let mut split = [[0_u8; RING]; RING];
        for span in 2..n {
            for i in 0..n - span {
                let k = i + span;
                (table[i][k], split[i][k]) = (f64::INFINITY, i as u8 + 1);
                for j in i + 1..k {
                    let inner = table[i][j] + table[j][k];
                    if inner >= table[i][k] {
                        continue;
                    }
                    let cost = inner + self.triangle(points, ends, [i, j, k], &before);
                    if cost < table[i][k] {
                        (table[i][k], split[i][k]) = (cost, j as u8);
                    }
                }
            }
        }
        let saved = before.sum - table[0][n - 1];
        // Infinite less infinite is no gain.
        if !(saved > GAIN * before.sum || before.sum.is_infinite() && table[0][n - 1].is_finite()) {
            return None;
        }
        self.new.clear();
        self.triangulate(&split, ends, 0, n - 1);
        Some(saved)
    }

    /// Cost of the two cells at a triangle of the ring; infinite if they are worse than all of the old ones.
    fn triangle(&self, points: &[[f64; 3]], ends: [u32; 2], corners: [usize; 3], before: &Cost) -> f64 {
        let mut cost = Cost::NONE;
        for cell in pair(ends, corners.map(|i| self.ring[i])) {
            cost.add(&self.targets.cost_of(points, &cell));
        }
        if cost.keeps(before, &self.targets.allowed) { cost.sum } else { f64::INFINITY }
    }

    fn triangulate(&mut self, split: &[[u8; RING]; RING], ends: [u32; 2], i: usize, k: usize) {
        if k - i < 2 {
            return;
        }
        let j = split[i][k] as usize;
        self.new.extend(pair(ends, [i, j, k].map(|i| self.ring[i])));
        self.triangulate(split, ends, i, j);
        self.triangulate(split, ends, j, k);
    }

    /// Collects the cells around an edge and the ring of the other vertices, counter-clockwise seen from its second end;
    /// whether the ring is closed, short and within one region.
    fn walk(&mut self, complex: &Complex, t: u32, i: usize, j: usize) -> bool {
        let region = complex.regions[t as usize];
        let cell = &complex.cells[t as usize];
        // [i, j, k, l] even: from k to l the cell lies counter-clockwise.
        let facet = FACETS[i];
        let at = (0..3).find(|&m| facet[m] == j).expect("a corner of the facet");
        let (k, l) = (cell[facet[(at + 1) % 3]], cell[facet[(at + 2) % 3]]);
        self.old.clear();
        self.ring.clear();
        self.old.push(t);
        self.ring.push(k);
        let (mut current, mut from, mut to) = (t, k, l);
        while to != k {
            if self.ring.len() == RING {
                return false;
            }
            self.ring.push(to);
            let next = complex.neighbours[current as usize][complex.corner(current, from)];
            if next == NONE || complex.regions[next as usize] != region {
                return false;
            }
            let beyond = complex.cells[next as usize].iter().find(|&&v| v != cell[i] && v != cell[j] && v != to);
            (current, from, to) = (next, to, *beyond.expect("a fourth corner"));
            self.old.push(current);
        }
        // The last cell, between the last vertex and the first, must be a neighbour of the first one.
        complex.neighbours[current as usize][complex.corner(current, from)] == t && self.ring.len() > 2
    }

    /// What a 2-3 flip at the facet opposite corner `i` saves; the cells are left in `old` and `new`.
    fn facet(&mut self, points: &[[f64; 3]], complex: &Complex, t: u32, i: usize) -> Option<f64> {
        let other = complex.neighbours[t as usize][i];
        if other == NONE || complex.regions[t as usize] != complex.regions[other as usize] {
            return None;
        }
        let (cell, across) = (&complex.cells[t as usize], &complex.cells[other as usize]);
        let back = complex.neighbours[other as usize].iter().position(|&s| s == t).expect("mutual neighbours");
        let (apex, far) = (cell[i], across[back]);
        let facet = FACETS[i].map(|j| cell[j]);
        let mut before = self.targets.cost_of(points, cell);
        before.add(&self.targets.cost_of(points, across));
        let mut after = Cost::NONE;
        self.new.clear();
        for m in 0..3 {
            // In [apex, facet] the far vertex takes the place of one of the facet.
            let new = [apex, facet[m], facet[(m + 1) % 3], far];
            after.add(&self.targets.cost_of(points, &new));
            self.new.push(new);
        }
        if !(after.sum < (1.0 - GAIN) * before.sum && after.keeps(&before, &self.targets.allowed)) {
            return None;
        }
        self.old.clear();
        self.old.extend([t, other]);
        Some(before.sum - after.sum)
    }
}

/// The cells that join a triangle of the ring, counter-clockwise seen from the second end, to both ends.
fn pair([a, b]: [u32; 2], [i, j, k]: [u32; 3]) -> [[u32; 4]; 2] {
    [[i, j, k, b], [i, k, j, a]]
}
