//! The vertices by generation, for multilevel solvers.

use crate::{MeshChange, SimplexMesh, VertexId};

/// The vertices of a mesh in groups of one generation, ascending within a group, kept up to date with each change.
///
/// Vertices of one group never share a cell, so that a group can be worked through in any order or in parallel; the parents
/// of a vertex ([`SimplexMesh::parents`]) are in earlier groups. Group 0 is the start mesh.
///
/// Source: Chen, Nochetto & Xu, *Optimal multilevel methods for graded bisection grids*, Numer. Math. 120 (2012).
#[derive(Clone, Default, PartialEq, Debug)]
pub struct Hierarchy {
    groups: Vec<Vec<VertexId>>,
    /// By vertex slot, the group that it is in.
    group_of: Vec<Option<u16>>,
}

impl Hierarchy {
    /// The groups of a mesh.
    pub fn new<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Self {
        let mut hierarchy = Self::default();
        hierarchy.update(mesh, mesh.vertices().collect());
        hierarchy
    }

    /// Follows a change, to the same result as [`new`](Self::new) of the changed mesh. Looks at the vertices that the
    /// change names, and moves the entries behind them in their groups.
    pub fn apply<const D: usize, const N: usize>(&mut self, mesh: &SimplexMesh<D, N>, change: &MeshChange) {
        let named = change.vertices.iter().map(|birth| birth.vertex).chain(change.removed.iter().copied());
        self.update(mesh, named.collect());
    }

    /// Number of generations.
    pub fn n_groups(&self) -> usize {
        self.groups.len()
    }

    /// The vertices of a generation, ascending; empty for one that the mesh does not have.
    pub fn group(&self, generation: usize) -> &[VertexId] {
        self.groups.get(generation).map_or(&[], |group| group)
    }

    /// The groups, oldest first.
    pub fn groups(&self) -> impl DoubleEndedIterator<Item = &[VertexId]> {
        self.groups.iter().map(|group| &group[..])
    }

    fn update<const D: usize, const N: usize>(&mut self, mesh: &SimplexMesh<D, N>, mut vertices: Vec<VertexId>) {
        self.group_of.resize(mesh.n_vertex_slots().max(self.group_of.len()), None);
        vertices.sort_unstable();
        vertices.dedup();
        // What leaves a group and what enters one: group, vertex, whether it enters.
        let mut edits: Vec<(u16, VertexId, bool)> = Vec::new();
        for v in vertices {
            let new = mesh.is_vertex(v).then(|| mesh.generation(v));
            let Some(place) = self.group_of.get_mut(v.index()) else { continue };
            let old = std::mem::replace(place, new);
            if old != new {
                edits.extend(old.map(|group| (group, v, false)));
                edits.extend(new.map(|group| (group, v, true)));
            }
        }
        edits.sort_unstable();
        for edits in edits.chunk_by(|a, b| a.0 == b.0) {
            let group = usize::from(edits[0].0);
            if group >= self.groups.len() {
                self.groups.resize(group + 1, Vec::new());
            }
            merge(&mut self.groups[group], edits);
        }
        while self.groups.last().is_some_and(Vec::is_empty) {
            self.groups.pop();
        }
    }
}

/// Applies edits, ascending by vertex, to an ascending list, from the first place that they change.
fn merge(list: &mut Vec<VertexId>, edits: &[(u16, VertexId, bool)]) {
    let from = list.partition_point(|&v| v < edits[0].1);
    let tail = list.split_off(from);
    let mut old = tail.into_iter().peekable();
    for &(_, v, enters) in edits {
        while let Some(before) = old.next_if(|&w| w < v) {
            list.push(before);
        }
        old.next_if_eq(&v);
        if enters {
            list.push(v);
        }
    }
    list.extend(old);
}
