//! The search for the best candidate: which cells are near, which operations are tried.

use super::{
    candidate::{Candidate, Near, Round, near},
    evaluate::{COVERED_WEIGHT, covered_around, is_forbidden},
    freedom::Freedom,
    measure::{Moving, Star, volume_gradient},
    needle::Needle,
    walk::Place,
};
use crate::{
    SimplexMesh,
    node::{NONE, is_interior, unlink},
};

/// Working memory and the best candidate so far.
#[derive(Clone, Debug)]
pub(super) struct Search<const D: usize, const N: usize> {
    pub best: Candidate<D, N>,
    pub(super) trial: Candidate<D, N>,
    /// The cells around the vertices of `t`, and around the follower.
    pub(super) patch: Vec<Near<N>>,
    pub(super) around: Vec<Near<N>>,
    /// The cells that an undone split had covered, and the shapes of those that it had made.
    pub(super) revived: Vec<Near<N>>,
    pub(super) lost: Vec<f64>,
    pub(super) star: Star<D>,
    /// The covered cells around the follower.
    pub(super) covered: Vec<Near<N>>,
    /// The cells around the face of the trial operation.
    pub(super) hit: Vec<Near<N>>,
    /// The cell whose vertices the patch is around.
    patch_of: u32,
    queue: Vec<u32>,
    stamps: Vec<u32>,
    stamp: u32,
}

impl<const D: usize, const N: usize> Default for Search<D, N> {
    fn default() -> Self {
        Self {
            best: Candidate::default(),
            trial: Candidate::default(),
            patch: Vec::new(),
            around: Vec::new(),
            revived: Vec::new(),
            lost: Vec::new(),
            star: Star::default(),
            covered: Vec::new(),
            hit: Vec::new(),
            patch_of: NONE,
            queue: Vec::new(),
            stamps: Vec::new(),
            stamp: 0,
        }
    }
}

impl<const D: usize, const N: usize> Search<D, N> {
    pub fn clear(&mut self) {
        self.best.len = 0;
        self.patch_of = NONE;
        self.revived.clear();
        self.lost.clear();
    }

    /// To be called before splits are undone for some rounds.
    pub fn begin_undo(&mut self) {
        self.revived.clear();
        self.lost.clear();
        self.patch_of = NONE;
    }

    /// To be called after these rounds, when the splits have been made again.
    pub fn end_undo(&mut self) {
        self.begin_undo();
    }

    /// To be called before a split is undone for some rounds: what it made will be lost, unless an undone one covered it.
    pub fn lose(&mut self, mesh: &SimplexMesh<D, N>, covered: &[u32], born: &[u32]) {
        debug_assert!(covered.iter().all(|slot| self.revived.iter().all(|r| r.slot != *slot)));
        for &slot in born {
            match self.revived.iter().position(|r| r.slot == slot) {
                Some(at) => {
                    self.revived.swap_remove(at);
                }
                None => self.lost.push(near(mesh, slot, &[]).shape),
            }
        }
    }

    /// To be called after it is undone: what it had covered is there again.
    pub fn revive(&mut self, mesh: &SimplexMesh<D, N>, covered: &[u32]) {
        self.revived.extend(covered.iter().map(|&slot| near(mesh, slot, &[])));
    }

    /// Tries the standard operations on the cell of a place whose faces pass `admit`, and keeps the best.
    pub fn round(
        &mut self,
        mesh: &SimplexMesh<D, N>,
        needles: &[Needle<D, N>],
        round: &Round<D>,
        place: &Place<N>,
        admit: impl Fn(&[u32]) -> bool,
    ) {
        let t = mesh.nodes[place.0 as usize].v;
        if self.patch_of != place.0 {
            self.gather(mesh, place.0, &t);
            self.patch_of = place.0;
        }
        let mut round = *round;
        self.gather_around(mesh, needles, &t, &mut round);
        for subset in 1..1_u8 << N {
            let (mut face, mut len) = ([NONE; N], 0);
            for i in (0..N).filter(|i| subset >> i & 1 == 1) {
                face[len] = t[i];
                len += 1;
            }
            if !admit(&face[..len]) || is_forbidden(needles, &round, &face[..len]) {
                continue;
            }
            self.trial.cell = place.0;
            self.trial.face = face;
            self.trial.len = len;
            if self.evaluate(mesh, needles, &round, subset) && self.trial.wins_against(&self.best) {
                std::mem::swap(&mut self.trial, &mut self.best);
            }
        }
    }

    /// Fills the patch with the cells around the vertices of `t`.
    fn gather(&mut self, mesh: &SimplexMesh<D, N>, start: u32, t: &[u32; N]) {
        self.walk_stars(mesh, start, t);
        self.patch.clear();
        self.patch.extend(self.queue.iter().map(|&slot| near(mesh, slot, t)));
    }

    /// Fills the list of cells around the follower, or takes the follower out of a round if it is on the boundary.
    fn gather_around(
        &mut self,
        mesh: &SimplexMesh<D, N>,
        needles: &[Needle<D, N>],
        t: &[u32; N],
        round: &mut Round<D>,
    ) {
        self.around.clear();
        let Some((o, _)) = round.follower else { return };
        if let Some(at) = t.iter().position(|&v| v == o) {
            let patch = self.patch.iter();
            self.around.extend(patch.filter(|cell| cell.mask >> at & 1 == 1).copied());
        } else {
            self.walk_stars(mesh, mesh.vertex_leaf[o as usize], &[o]);
            let queue = self.queue.iter();
            self.around.extend(queue.map(|&slot| near(mesh, slot, t)));
        }
        // A boundary facet of a cell that is not opposite the follower contains it.
        if self.around.iter().any(|cell| (0..N).any(|i| cell.boundary >> i & 1 == 1 && cell.v[i] != o)) {
            round.follower = None;
            self.around.clear();
            return;
        }
        self.covered.clear();
        self.covered.extend(covered_around(mesh, needles, round, o).map(|slot| near(mesh, slot, &[])));
    }

    /// Fills the queue with the live cells that have one of the vertices, which those of `start` are or contain.
    pub fn walk_stars(&mut self, mesh: &SimplexMesh<D, N>, start: u32, vertices: &[u32]) {
        self.stamps.resize(mesh.nodes.len(), 0);
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            self.stamps.fill(0);
            self.stamp = 1;
        }
        self.queue.clear();
        self.queue.push(start);
        self.stamps[start as usize] = self.stamp;
        let mut next = 0;
        while let Some(&slot) = self.queue.get(next) {
            next += 1;
            let (v, links) = (&mesh.nodes[slot as usize].v, &mesh.nodes[slot as usize].links);
            let (mut has, mut n_has) = ([0; N], 0);
            for i in 0..N {
                has[i] = usize::from(vertices.contains(&v[i]));
                n_has += has[i];
            }
            for i in 0..N {
                // The common facet must have one of the vertices.
                if !is_interior(links[i]) || n_has == has[i] {
                    continue;
                }
                let neighbor = unlink(links[i]).0;
                if self.stamps[neighbor] != self.stamp {
                    self.stamps[neighbor] = self.stamp;
                    self.queue.push(neighbor as u32);
                }
            }
        }
    }

    /// The cells around a vertex as functions of its position, and which way it may move; `None` if it may not.
    pub fn star_around(
        &mut self,
        mesh: &SimplexMesh<D, N>,
        needles: &[Needle<D, N>],
        v: u32,
    ) -> Option<(&Star<D>, Freedom<D>)> {
        self.walk_stars(mesh, mesh.vertex_leaf[v as usize], &[v]);
        self.star.cells.clear();
        let mut freedom = Freedom::full();
        for &slot in &self.queue {
            let (node, links) = (&mesh.nodes[slot as usize], &mesh.nodes[slot as usize].links);
            let at = node.v.iter().position(|&w| w == v)?;
            let corners = mesh.corners_of(&node.v);
            for i in (0..N).filter(|&i| i != at && !is_interior(links[i])) {
                freedom.restrict(&volume_gradient(&corners, i));
            }
            if freedom.is_none() {
                return None;
            }
            self.star.cells.push(Moving::of(&corners, if node.is_negative() { -1.0 } else { 1.0 }, at));
        }
        for slot in needles.iter().flat_map(|needle| needle.covered(0)) {
            let node = &mesh.nodes[slot as usize];
            if let Some(at) = node.v.iter().position(|&w| w == v) {
                let sign = if node.is_negative() { -1.0 } else { 1.0 };
                let cell = Moving::of(&mesh.corners_of(&node.v), sign, at);
                self.star.cells.push(cell.weighted(COVERED_WEIGHT));
            }
        }
        Some((&self.star, freedom))
    }

    /// The cells found last.
    pub fn found(&self) -> &[u32] {
        &self.queue
    }
}
