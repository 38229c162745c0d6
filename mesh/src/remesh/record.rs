//! What one substep does to the mesh, gathered for the change log.

use crate::{CellId, MeshChange, Origin, SimplexMesh, VertexBirth, VertexId, remesh::measure::extreme_angles_deg};

/// A substep: the cells it touched with their vertices before it, the vertices it made, moved and removed.
#[derive(Clone, Debug, Default)]
pub(super) struct Record<const N: usize> {
    /// Slots and what was alive in them.
    touched: Vec<(u32, Option<[u32; N]>)>,
    /// Vertices that are not where they were, or new: a split may take the place of one undone, with the same names.
    moved: Vec<u32>,
    births: Vec<(u32, Origin, bool)>,
    in_group: bool,
    removed: Vec<u32>,
    died: Vec<CellId>,
    pub born: Vec<CellId>,
}

impl<const N: usize> Record<N> {
    pub fn clear(&mut self) {
        self.touched.clear();
        self.moved.clear();
        self.births.clear();
        self.in_group = false;
        self.removed.clear();
    }

    /// Notes cells that are going to change.
    pub fn note<const D: usize>(&mut self, mesh: &SimplexMesh<D, N>, slots: &[u32]) {
        for &slot in slots {
            if !self.touched.iter().any(|entry| entry.0 == slot) {
                let node = &mesh.nodes[slot as usize];
                self.touched.push((slot, node.is_leaf().then_some(node.v)));
            }
        }
    }

    /// Notes cells that have just been made in slots that were free, as far as they were not noted before.
    pub fn note_new(&mut self, slots: &[u32]) {
        for &slot in slots {
            if !self.touched.iter().any(|entry| entry.0 == slot) {
                self.touched.push((slot, None));
            }
        }
    }

    /// Notes a vertex that is made or moved, with its origin in the mesh before the substep.
    pub fn birth(&mut self, vertex: u32, origin: Origin) {
        self.removed.retain(|&v| v != vertex);
        self.births.push((vertex, origin, self.in_group));
        self.in_group = true;
        self.moved.push(vertex);
    }

    /// What follows is of the mesh after what was noted so far.
    pub fn end_group(&mut self) {
        self.in_group = false;
    }

    pub fn moved(&self) -> &[u32] {
        &self.moved
    }

    pub fn removal(&mut self, vertex: u32) {
        self.removed.push(vertex);
    }

    /// Adds the substep to a change. `around` are the live cells around the new and moved vertices, each once.
    pub fn finish<const D: usize>(&mut self, mesh: &SimplexMesh<D, N>, around: &[u32], change: &mut MeshChange) {
        // They are distinct, so that only what was noted before has to be searched.
        let n_noted = self.touched.len();
        for &slot in around {
            if !self.touched[..n_noted].iter().any(|entry| entry.0 == slot) {
                self.touched.push((slot, Some(mesh.nodes[slot as usize].v)));
            }
        }
        let moved = &self.moved;
        self.died.clear();
        self.born.clear();
        for &(slot, before) in &self.touched {
            let node = mesh.nodes.get(slot as usize);
            let after = node.filter(|node| node.is_leaf()).map(|node| node.v);
            let is_same = before == after && !after.is_some_and(|v| v.iter().any(|v| moved.contains(v)));
            if is_same {
                continue;
            }
            if before.is_some() {
                self.died.push(CellId(slot));
            }
            if after.is_some() {
                self.born.push(CellId(slot));
            }
        }
        self.died.sort_unstable();
        self.born.sort_unstable();
        // A slot that is in both lists holds another cell, or one whose vertices moved.
        let died = &self.died;
        change.compose(died, self.born.clone(), |cell| died.binary_search(&cell).is_ok());

        for &(vertex, origin, with_previous) in &self.births {
            let vertex = VertexId(vertex);
            change.vertices.push(VertexBirth { vertex, origin, with_previous });
            if let Ok(at) = change.removed.binary_search(&vertex) {
                change.removed.remove(at);
            }
        }
        for &vertex in &self.removed {
            if let Err(at) = change.removed.binary_search(&VertexId(vertex)) {
                change.removed.insert(at, VertexId(vertex));
            }
        }
    }

    /// The extreme angles of the cells that the substep made or changed.
    pub fn angles_deg<const D: usize>(&self, mesh: &SimplexMesh<D, N>) -> (f64, f64) {
        extreme_angles_deg(self.born.iter().map(|&cell| mesh.corners(cell)))
    }
}
