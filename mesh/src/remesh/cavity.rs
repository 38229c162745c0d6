//! Every write of the remesher to the internals of a mesh: splits of the cells around a face, their exact inverse, and
//! moves of vertices.
//!
//! A split *covers* the cells around a face: they keep their slot, vertices, region and the links among themselves, but
//! are not live. Their replacements are *overlay* cells: live, without parent or children, never bisected. Neighbours
//! outside the cavity are linked with whatever is live. Undoing a split uncovers the cells, takes the outer links from
//! the overlay cells, which may have changed, and frees the slots and the vertex, last freed first taken.

use crate::{
    SimplexMesh,
    node::{MAX_SLOTS, NONE, Node, is_interior, link, unlink},
};

/// What remeshing has added to a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Overlay {
    /// Single slots to be used again, last in first out; bisection frees and takes pairs.
    pub free_slots: Vec<u32>,
    /// Vertices that are not where they belong, ascending.
    pub moved: Vec<u32>,
    /// Cells of the overlay, live or covered by others.
    pub n_overlays: usize,
}

impl Overlay {
    /// Whether one of some vertices was moved by remeshing.
    #[inline]
    pub fn holds(&self, vertices: &[u32]) -> bool {
        !self.moved.is_empty() && vertices.iter().any(|v| self.moved.binary_search(v).is_ok())
    }

    /// Whether there is anything of a needle in the mesh.
    #[inline]
    pub fn is_active(&self) -> bool {
        self.n_overlays > 0 || !self.moved.is_empty()
    }
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// Whether bisection must leave a cell alone: it is covered or an overlay cell, or one of its vertices was moved by
    /// remeshing.
    #[inline]
    pub(crate) fn is_remeshed(&self, node: &Node<N>) -> bool {
        node.is_overlay() || node.is_covered() || self.overlay.holds(&node.v)
    }

    /// The live overlay cells.
    pub(crate) fn overlay_cells(&self) -> impl Iterator<Item = u32> + '_ {
        let slots = if self.overlay.n_overlays > 0 { self.nodes.len() } else { 0 };
        let is_overlay = |node: &Node<N>| node.is_leaf() && node.is_overlay();
        (0..slots as u32).filter(move |&slot| is_overlay(&self.nodes[slot as usize]))
    }

    /// The slots needed for some more overlay cells, if that is more than there may be.
    pub(crate) fn lacks_slots(&self, n_cells: usize) -> Option<usize> {
        let needed = self.nodes.len() + n_cells.saturating_sub(self.overlay.free_slots.len());
        (needed > self.slot_limit.min(MAX_SLOTS)).then_some(needed)
    }

    /// Makes a vertex of no cell, for [`split_face`](Self::split_face) to use.
    pub(crate) fn push_vertex(&mut self, point: [f64; D]) -> u32 {
        let vertex = self.free_vertices.pop().unwrap_or_else(|| {
            self.points.push(point);
            self.parents.push([0; 2]);
            self.generations.push(0);
            self.vertex_leaf.push(NONE);
            if !self.reference.is_empty() {
                self.reference.push(point);
            }
            self.points.len() as u32 - 1
        });
        let at = vertex as usize;
        self.points[at] = point;
        (self.parents[at], self.generations[at], self.vertex_leaf[at]) = ([vertex; 2], 0, NONE);
        if !self.reference.is_empty() {
            self.reference[at] = point;
        }
        vertex
    }

    /// Replaces each of the `covered` cells, which are all the cells around `face`, by as many as the face has vertices,
    /// with `z` in place of one of these; appends the slots of the new cells, cell by cell in the order of `face`.
    pub(crate) fn split_face(&mut self, face: &[u32], z: u32, covered: &[u32], born: &mut Vec<u32>) {
        let (first, m) = (born.len(), face.len());
        for &cell in covered {
            for &a in face {
                let mut node = self.nodes[cell as usize].as_overlay();
                node.v[place(&node.v, a)] = z;
                born.push(self.push_overlay(node));
            }
        }
        let made = &born[first..];
        for (k, &cell) in covered.iter().enumerate() {
            let Node { v, links: old, .. } = self.nodes[cell as usize];
            for (r, &a) in face.iter().enumerate() {
                let (slot, at) = (made[k * m + r], place(&v, a));
                for j in 0..N {
                    self.nodes[slot as usize].links[j] = match face.iter().position(|&b| b == v[j]) {
                        _ if j == at => old[j],
                        Some(other) => link(made[k * m + other], at),
                        None if !is_interior(old[j]) => old[j],
                        None => {
                            let (neighbor, there) = unlink(old[j]);
                            let l = covered.iter().position(|&c| c as usize == neighbor).unwrap_or(k);
                            link(made[l * m + r], there)
                        }
                    };
                }
                self.answer(slot, at);
                for v in self.nodes[slot as usize].v {
                    self.vertex_leaf[v as usize] = slot;
                }
            }
            self.nodes[cell as usize].cover();
        }
        self.n_live += covered.len() * (m - 1);
        self.overlay.n_overlays += covered.len() * m;
    }

    /// The inverse of [`split_face`](Self::split_face), given the same cells and all the slots that it made, which must
    /// be live. The vertex `z` is freed.
    pub(crate) fn unsplit_face(&mut self, face: &[u32], z: u32, covered: &[u32], born: &[u32]) {
        let m = face.len();
        for (k, &cell) in covered.iter().enumerate() {
            let v = self.nodes[cell as usize].v;
            self.nodes[cell as usize].uncover();
            for (r, &a) in face.iter().enumerate() {
                let at = place(&v, a);
                self.nodes[cell as usize].links[at] = self.nodes[born[k * m + r] as usize].links[at];
                self.answer(cell, at);
            }
            for v in v {
                self.vertex_leaf[v as usize] = cell;
            }
        }
        for &slot in born.iter().rev() {
            self.nodes[slot as usize].free();
            self.overlay.free_slots.push(slot);
        }
        self.vertex_leaf[z as usize] = NONE;
        self.free_vertices.push(z);
        self.n_live -= covered.len() * (m - 1);
        self.overlay.n_overlays -= covered.len() * m;
    }

    /// Moves a vertex of the mesh as it was without remeshing, which until it is [put back](Self::put_back) counts as
    /// moved.
    pub(crate) fn displace(&mut self, vertex: u32, point: [f64; D]) {
        if self.reference.is_empty() {
            self.reference = self.points.clone();
        }
        if let Err(at) = self.overlay.moved.binary_search(&vertex) {
            self.overlay.moved.insert(at, vertex);
        }
        self.shift(vertex, point);
    }

    /// Moves a vertex that counts as moved anyway, or that a split made.
    pub(crate) fn shift(&mut self, vertex: u32, point: [f64; D]) {
        let at = vertex as usize;
        self.points[at] = point;
        if let Some(home) = self.reference.get(at) {
            let distance = crate::geometry::distance2(&point, home).sqrt();
            self.farthest_move = self.farthest_move.max(distance);
        }
    }

    /// Moves a vertex back to where it was before it was [displaced](Self::displace).
    pub(crate) fn put_back(&mut self, vertex: u32, point: [f64; D]) {
        self.points[vertex as usize] = point;
        if let Ok(at) = self.overlay.moved.binary_search(&vertex) {
            self.overlay.moved.remove(at);
        }
    }

    /// Gives back, when no overlay cell is left, the free slots and vertices at the ends of the arrays, and forgets the
    /// reference positions if no vertex differs from its own.
    pub(crate) fn trim(&mut self) {
        if self.overlay.is_active() {
            return;
        }
        while self.nodes.last().is_some_and(|node| node.is_free()) {
            self.nodes.pop();
        }
        let n_slots = self.nodes.len();
        self.overlay.free_slots.retain(|&slot| (slot as usize) < n_slots);
        self.free_pairs.retain(|&slot| (slot as usize) < n_slots);
        let n = self.vertex_leaf.iter().rposition(|&leaf| leaf != NONE).map_or(0, |last| last + 1);
        self.free_vertices.retain(|&v| (v as usize) < n);
        self.points.truncate(n);
        self.parents.truncate(n);
        self.generations.truncate(n);
        self.vertex_leaf.truncate(n);
        self.reference.truncate(n);
        if self.reference == self.points {
            self.reference.clear();
            self.farthest_move = 0.0;
        }
    }

    fn push_overlay(&mut self, node: Node<N>) -> u32 {
        if let Some(slot) = self.overlay.free_slots.pop() {
            self.nodes[slot as usize] = node;
            return slot;
        }
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    /// Tells the neighbour across a facet who is there now.
    fn answer(&mut self, slot: u32, facet: usize) {
        let there = self.nodes[slot as usize].links[facet];
        if is_interior(there) {
            let (neighbor, across) = unlink(there);
            self.nodes[neighbor].links[across] = link(slot, facet);
        }
    }
}

/// The local index of a vertex.
#[inline]
fn place<const N: usize>(v: &[u32; N], a: u32) -> usize {
    v.iter().position(|&b| b == a).unwrap_or(0)
}
