//! Coarsening: bisections undone, patch by patch.
//!
//! A vertex can be removed once it is the newest of every leaf around it: these leaves are then the halves of the cells of
//! one patch, which become leaves again. The newest vertex of a leaf is the one of greatest generation, since a midpoint
//! is given a greater one than any vertex of its patch. Removing a vertex can set free only the newest vertices of the
//! cells that it revives; so a queue by generation, youngest first, meets every vertex that can go, once.
//!
//! Which vertices can go does not depend on the order: what is left is the smallest refinement of the start mesh in which
//! every bisection that must be kept is done.
//!
//! Source of the test: Chen & Zhang, *A coarsening algorithm on adaptive grids by newest vertex bisection and its
//! applications*, J. Comput. Math. 28 (2010), in two dimensions; here in any.

use crate::{
    BisectError, CellId, MeshChange, SimplexMesh, geometry,
    node::{NONE, is_interior, link, unlink},
    recorder::Recorder,
};
use std::collections::BinaryHeap;

/// Vertices that might be removed, youngest first: generation, id.
pub(crate) type Candidates = BinaryHeap<(u16, u32)>;

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// Undoes the latest bisection of the marked cells where all cells around its midpoint are marked, composes `change`
    /// with what was done, and returns the number of vertices removed.
    ///
    /// One round: cells that are revived are not marked. A mark on a cell that is not alive, or of the start mesh, does
    /// nothing. Cells made by a needle remesher and their neighbours are left alone, as are vertices between boundary
    /// facets with different tags, and vertices without which a cell whose corners were moved would be inverted.
    ///
    /// # Errors
    /// [`BisectError::UnknownCell`] before anything is done.
    pub fn coarsen(&mut self, marked: &[CellId], change: &mut MeshChange) -> Result<usize, BisectError> {
        self.check_marks(marked)?;
        let mut marked: Vec<CellId> = marked.iter().copied().filter(|&cell| self.is_live(cell)).collect();
        marked.sort_unstable();
        marked.dedup();
        // A marked cell counts for one vertex only, so that a star is marked if as many as it has do.
        let mut newest: Vec<u32> = marked.iter().filter_map(|&cell| self.newest(cell.0)).collect();
        newest.sort_unstable();
        self.record(change, |mesh, recorder| {
            let mut removed = 0;
            for votes in newest.chunk_by(|a, b| a == b) {
                if mesh.collect_removable(votes[0], recorder) && recorder.patch.len() == votes.len() {
                    mesh.remove_vertex(votes[0], recorder);
                    removed += 1;
                }
            }
            Ok(removed)
        })
    }

    /// Undoes all bisections that can be undone, composes `change` with that, and returns the number of vertices removed:
    /// back to the start mesh, save what [`coarsen`](Self::coarsen) leaves alone.
    pub fn coarsen_everywhere(&mut self, change: &mut MeshChange) -> usize {
        self.coarsen_unless(|_, _| false, change)
    }

    /// Undoes, youngest first, all bisections of which `keep` says of no bisected cell that it must stay bisected;
    /// composes `change` with that, and returns the number of vertices removed. `keep` is asked with cells that are not
    /// alive (yet), of which [`corners`](Self::corners), [`region`](Self::region), [`level`](Self::level) and
    /// [`longest_edge`](Self::longest_edge) are known.
    pub fn coarsen_unless(&mut self, mut keep: impl FnMut(&Self, CellId) -> bool, change: &mut MeshChange) -> usize {
        // All are candidates from the start, so that none need be looked for.
        let mut vertices: Vec<(u16, u32)> = self.vertices().map(|v| (self.generations[v.index()], v.0)).collect();
        vertices.sort_unstable();
        let outcome = self.record(change, |mesh, recorder| {
            let mut keep = |mesh: &Self, _, parent| keep(mesh, CellId(parent));
            let removed = vertices.iter().rev().filter(|&&(_, v)| mesh.try_to_remove(v, &mut keep, recorder));
            Ok(removed.count())
        });
        outcome.unwrap_or_default()
    }

    /// Removes those of the candidates, and of the vertices that this sets free, that can be removed and for which `keep`,
    /// called with the vertex and a cell that it bisected, holds of none of these cells.
    pub(crate) fn coarsen_from(
        &mut self,
        mut candidates: Candidates,
        mut keep: impl FnMut(&Self, u32, u32) -> bool,
        recorder: &mut Recorder,
    ) {
        let mut latest = None;
        while let Some(candidate) = candidates.pop() {
            if latest.replace(candidate) == Some(candidate) || !self.try_to_remove(candidate.1, &mut keep, recorder) {
                continue;
            }
            for &parent in &recorder.stack {
                candidates.extend(self.newest(parent).map(|v| (self.generations[v as usize], v)));
            }
        }
    }

    fn try_to_remove(
        &mut self,
        vertex: u32,
        keep: &mut impl FnMut(&Self, u32, u32) -> bool,
        recorder: &mut Recorder,
    ) -> bool {
        let goes = self.collect_removable(vertex, recorder)
            && !recorder.stack.iter().any(|&parent| keep(self, vertex, parent));
        if goes {
            self.remove_vertex(vertex, recorder);
        }
        goes
    }

    /// The newest vertex of a leaf: the one that bisection gave it; `None` for a cell that bisection did not make.
    #[inline]
    pub(crate) fn newest(&self, slot: u32) -> Option<u32> {
        let node = &self.nodes[slot as usize];
        let newest = node.v.into_iter().max_by_key(|&v| self.generations[v as usize]);
        newest.filter(|_| node.parent != NONE)
    }

    /// Gathers the leaves around a vertex into the patch, and the cells whose halves they are into the stack; or returns
    /// false if the vertex cannot be removed.
    fn collect_removable(&mut self, vertex: u32, recorder: &mut Recorder) -> bool {
        let Recorder { patch, stack, .. } = recorder;
        patch.clear();
        stack.clear();
        let leaf = self.vertex_leaf[vertex as usize];
        if leaf == NONE || self.generations[vertex as usize] == 0 {
            return false;
        }
        patch.push(leaf);
        self.nodes[leaf as usize].visit();
        let (mut next, mut removable) = (0, true);
        while let Some(&slot) = patch.get(next) {
            next += 1;
            let node = self.nodes[slot as usize];
            let generation = self.generations[vertex as usize];
            let is_newest = node.v.iter().all(|&v| v == vertex || self.generations[v as usize] < generation);
            if !is_newest || node.parent == NONE || self.overlay.holds(&node.v) {
                removable = false;
                break;
            }
            if self.nodes[node.parent as usize].child() == slot {
                stack.push(node.parent);
            }
            for facet in 0..N {
                if node.v[facet] == vertex || !is_interior(node.links[facet]) {
                    continue;
                }
                let at = unlink(node.links[facet]).0;
                if !self.nodes[at].is_visited() {
                    self.nodes[at].visit();
                    patch.push(at as u32);
                }
            }
        }
        for &slot in &*patch {
            self.nodes[slot as usize].unvisit();
        }
        removable && stack.iter().all(|&parent| self.can_be_revived(parent))
    }

    /// Whether nothing is lost with the halves of a cell but their common face.
    fn can_be_revived(&self, parent: u32) -> bool {
        let node = &self.nodes[parent as usize];
        let (lower, upper) = (&self.nodes[node.child() as usize], &self.nodes[node.child() as usize + 1]);
        let same_tags = (1..N).filter(|&facet| facet != node.tag()).all(|facet| {
            let [one, other] = [lower, upper].map(|half| half.position(node.v[facet]).map(|at| half.links[at]));
            one == other || one.is_none_or(is_interior)
        });
        if self.reference.is_empty() || !same_tags {
            return same_tags;
        }
        let measure = geometry::signed_measure(&self.corners_of(&node.v));
        if node.is_negative() && N == D + 1 { measure < 0.0 } else { measure > 0.0 }
    }

    /// Removes the vertex whose leaves are in the patch and whose bisected cells are in the stack.
    fn remove_vertex(&mut self, vertex: u32, recorder: &mut Recorder) {
        for i in 0..recorder.stack.len() {
            self.revive(recorder.stack[i], vertex, recorder);
        }
        self.n_live -= recorder.stack.len();
        self.vertex_leaf[vertex as usize] = NONE;
        self.free_vertices.push(vertex);
        recorder.remove(vertex);
    }

    /// Makes a leaf of a bisected cell: links it as its halves were, and frees them. Of the other cells of the patch, the
    /// vertices and parents of the halves are still read afterwards.
    fn revive(&mut self, parent: u32, vertex: u32, recorder: &mut Recorder) {
        let node = self.nodes[parent as usize];
        let first = node.child();
        let across = |half: u32, opposite: u32| {
            let half = &self.nodes[half as usize];
            half.position(opposite).map_or(NONE, |at| half.links[at])
        };
        let mut links = [NONE; N];
        for facet in 0..N {
            links[facet] = if facet == 0 {
                across(first + 1, vertex)
            } else if facet == node.tag() {
                across(first, vertex)
            } else {
                self.link_of_parent(across(first, node.v[facet]))
            };
        }
        for facet in [0, node.tag()] {
            if is_interior(links[facet]) {
                let (neighbor, there) = unlink(links[facet]);
                self.nodes[neighbor].links[there] = link(parent, facet);
            }
        }
        for half in [first, first + 1] {
            let half_node = &mut self.nodes[half as usize];
            recorder.kill(half, half_node);
            half_node.free();
        }
        self.free_pairs.push(first);
        let node = &mut self.nodes[parent as usize];
        node.revive(links);
        recorder.revive(parent, node);
        for v in node.v {
            self.vertex_leaf[v as usize] = parent;
        }
    }

    /// The link to the cell that was bisected into the one that `link` names; a boundary link as it is.
    fn link_of_parent(&self, across: u32) -> u32 {
        if !is_interior(across) {
            return across;
        }
        let (half, facet) = unlink(across);
        let half = &self.nodes[half];
        let place = self.nodes[half.parent as usize].position(half.v[facet]);
        link(half.parent, place.unwrap_or_default())
    }
}
