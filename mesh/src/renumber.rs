//! Which vertices are neighbours, and the same start mesh under other numbers.

use crate::{
    MeshError, SimplexMesh,
    node::{NONE, Node, is_interior},
};

/// Why a mesh cannot be renumbered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenumberError {
    /// Cells were bisected or remeshed, or vertices moved: identifiers are then in use elsewhere.
    #[error("only a mesh as it was made can be renumbered, this one has changed since")]
    Changed,
    /// One entry per vertex is needed.
    #[error("found an order of {found} vertices, expected {expected}")]
    Length {
        /// Number of vertices.
        expected: usize,
        /// Number of entries given.
        found: usize,
    },
    /// An entry names a vertex that does not exist, or one that an earlier entry names.
    #[error("entry {position} of the order is {vertex}: expected each vertex from 0 to {last} once")]
    Entry {
        /// Index of the entry.
        position: usize,
        /// The vertex it names.
        vertex: u32,
        /// The last vertex.
        last: usize,
    },
    /// The cells do not make a mesh under other numbers: rounding has them flat in another order, say.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// The graph of the edges of live cells in two index slices, as a method for matrices wants it: the neighbours of vertex
    /// `v`, ascending, are `neighbours[offsets[v]..offsets[v + 1]]`. An id that is free has none.
    pub fn vertex_graph(&self) -> (Vec<usize>, Vec<u32>) {
        let pairs = |c: usize| {
            let v: [u32; N] = self.nodes[c].v;
            (0..N).flat_map(move |a| (0..N).filter(move |&b| b != a).map(move |b| (v[a], v[b])))
        };
        let live = || self.cells().map(|c| c.index());
        let mut starts = vec![0; self.n_vertex_slots() + 1];
        live().flat_map(pairs).for_each(|(v, _)| starts[v as usize + 1] += 1);
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        // Each edge as often as cells have it.
        let mut lists = vec![0; starts[starts.len() - 1]];
        let mut next = starts.clone();
        for (v, w) in live().flat_map(pairs) {
            lists[next[v as usize]] = w;
            next[v as usize] += 1;
        }
        let (mut offsets, mut neighbours) = (vec![0], Vec::new());
        for range in starts.windows(2) {
            let list = &mut lists[range[0]..range[1]];
            list.sort_unstable();
            let first = neighbours.len();
            for &w in &*list {
                if neighbours[first..].last() != Some(&w) {
                    neighbours.push(w);
                }
            }
            offsets.push(neighbours.len());
        }
        (offsets, neighbours)
    }

    /// The same mesh with vertex `new_to_old[k]` as vertex `k`, and the cells in the order of their vertices: by the lowest,
    /// then the next one. Places, regions and tags of the boundary stay. Cells are made anew under their rule, so that which of
    /// several edges of one length is bisected first goes by the new numbers, like in cells that are made of them later.
    ///
    /// # Errors
    /// [`RenumberError`]: the mesh is not as it was made, or `new_to_old` does not name each vertex once.
    pub fn renumbered(&self, new_to_old: &[u32]) -> Result<Self, RenumberError> {
        let as_made = self.n_slots() == self.n_macros && self.n_live == self.n_macros;
        if !(as_made && self.n_vertex_slots() == self.n_vertices() && self.reference.is_empty()) {
            return Err(RenumberError::Changed);
        }
        let old_to_new = inverse(new_to_old, self.points.len())?;
        let renamed = |node: &Node<N>| node.v.map(|v| old_to_new[v as usize]);
        let mut order: Vec<([u32; N], u32)> = Vec::with_capacity(self.n_macros);
        for (slot, node) in self.nodes.iter().enumerate() {
            let mut sorted = renamed(node);
            sorted.sort_unstable();
            order.push((sorted, slot as u32));
        }
        order.sort_unstable();
        let olds = || order.iter().map(|&(_, old)| &self.nodes[old as usize]);
        let cells = olds().map(|node| {
            let mut v = renamed(node);
            // Of a surface or a rod the order is the orientation.
            if node.is_negative() {
                v.swap(0, 1);
            }
            v
        });
        let regions = olds().map(|node| self.regions.get(node.region()).copied().unwrap_or_default());
        let points = new_to_old.iter().map(|&v| self.points[v as usize]).collect();
        let mut mesh = Self::assemble(points, cells.collect(), regions.collect(), self.rule)?;
        for (node, old) in mesh.nodes.iter_mut().zip(olds()) {
            let names = renamed(old);
            for (vertex, link) in node.v.iter().zip(&mut node.links) {
                let facet = names.iter().position(|name| name == vertex);
                if let Some(&tag) = facet.map(|facet| &old.links[facet]).filter(|&&tag| !is_interior(tag)) {
                    *link = tag;
                }
            }
        }
        (mesh.slot_limit, mesh.bisection_limit) = (self.slot_limit, self.bisection_limit);
        Ok(mesh)
    }
}

/// The new number of each of `n` vertices.
fn inverse(new_to_old: &[u32], n: usize) -> Result<Vec<u32>, RenumberError> {
    if new_to_old.len() != n {
        return Err(RenumberError::Length { expected: n, found: new_to_old.len() });
    }
    let mut old_to_new = vec![NONE; n];
    for (position, &vertex) in new_to_old.iter().enumerate() {
        match old_to_new.get_mut(vertex as usize) {
            Some(new) if *new == NONE => *new = position as u32,
            _ => return Err(RenumberError::Entry { position, vertex, last: n.saturating_sub(1) }),
        }
    }
    Ok(old_to_new)
}
