//! The change log: what one operation did to a mesh, as a value.

use crate::{CellId, VertexId};
use serde::{Deserialize, Serialize};

/// The most vertices that an [`Origin`] combines: a 4-simplex has five.
pub const MAX_PARENTS: usize = 5;

/// Where a vertex came from: a convex combination of older vertices.
///
/// Displacement, velocity, friction state or any user field moves across a mesh change by this one rule.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Origin {
    len: u8,
    vertices: [VertexId; MAX_PARENTS],
    weights: [f64; MAX_PARENTS],
}

impl Origin {
    /// The midpoint of the edge between `a` and `b`.
    pub fn midpoint(a: VertexId, b: VertexId) -> Self {
        let (mut vertices, mut weights) = ([VertexId(0); MAX_PARENTS], [0.0; MAX_PARENTS]);
        (vertices[0], vertices[1]) = (a, b);
        (weights[0], weights[1]) = (0.5, 0.5);
        Self { len: 2, vertices, weights }
    }

    /// The point with some barycentric coordinates in a cell with the given vertices; parents of weight 0 are left out.
    ///
    /// # Panics
    /// If more than [`MAX_PARENTS`] weights are not zero.
    pub fn combination<const N: usize>(cell: &[VertexId; N], weights: &[f64; N]) -> Self {
        let mut origin = Self { len: 0, vertices: [VertexId(0); MAX_PARENTS], weights: [0.0; MAX_PARENTS] };
        for (&vertex, &weight) in cell.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            let at = origin.len as usize;
            (origin.vertices[at], origin.weights[at]) = (vertex, weight);
            origin.len += 1;
        }
        origin
    }

    /// The parents and their weights, which sum to one.
    pub fn parents(&self) -> impl Iterator<Item = (VertexId, f64)> + '_ {
        (0..self.len as usize).map(|k| (self.vertices[k], self.weights[k]))
    }

    /// The value of a field with `WIDTH` numbers per vertex (flat, vertex id times `WIDTH`) at this origin.
    ///
    /// # Panics
    /// If a parent lies beyond the end of `field`.
    pub fn interpolate<const WIDTH: usize>(&self, field: &[f64]) -> [f64; WIDTH] {
        let mut value = [0.0; WIDTH];
        for (vertex, weight) in self.parents() {
            let at = &field[vertex.index() * WIDTH..][..WIDTH];
            for k in 0..WIDTH {
                value[k] += weight * at[k];
            }
        }
        value
    }
}

/// A vertex born of others, or moved among them.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct VertexBirth {
    /// The new vertex, which may take over the id of one that was removed; or an old one that was moved.
    pub vertex: VertexId,
    /// The older vertices it is a combination of; a moved vertex may be one of its own.
    pub origin: Origin,
    /// Whether this happened together with the entry before it: the origins of a group are of the values from before
    /// the group. Bisections happen one after the other; a remeshing step may move several vertices at once.
    pub with_previous: bool,
}

/// The net difference that one operation made: what was alive before and is not after, and the reverse.
///
/// Operations add to the change that they are given, and keep it net: filled by several in turn, it is the difference
/// between before the first and after the last. [`clear`](Self::clear) it to start afresh.
#[derive(Clone, Default, PartialEq, Debug, Serialize, Deserialize)]
pub struct MeshChange {
    /// Cells that were alive before and are not any more, ascending. A cell whose slot another cell took over, or whose
    /// vertices moved, is among the dead and among the born.
    pub died: Vec<CellId>,
    /// Cells that are alive now and were not before, ascending.
    pub born: Vec<CellId>,
    /// New and moved vertices in the order in which it happened, so parents before children. Vertices that were removed
    /// again are among them, because later ones may stem from them.
    pub vertices: Vec<VertexBirth>,
    /// Vertices that were removed and whose ids no other vertex has taken over, ascending.
    pub removed: Vec<VertexId>,
    /// Those of `died` whose slots were given to other cells since, ascending: should a slot be revived later, it is not
    /// with the cell that died.
    pub taken_over: Vec<CellId>,
}

impl MeshChange {
    /// Empties the lists and keeps their memory.
    pub fn clear(&mut self) {
        self.died.clear();
        self.born.clear();
        self.vertices.clear();
        self.removed.clear();
        self.taken_over.clear();
    }

    /// The change of cells whose vertices were moved, all else being as it was: each died and was born.
    pub fn moved(mut cells: Vec<CellId>) -> Self {
        cells.sort_unstable();
        cells.dedup();
        Self { taken_over: cells.clone(), died: cells.clone(), born: cells, ..Self::default() }
    }

    /// Adds to this change a later one, given as its deaths and its births (both ascending) and whether a slot was taken
    /// over by another cell in it: what was born here and dies there, or died here and is revived there as the same cell,
    /// is in neither list any more.
    pub(crate) fn compose(&mut self, died: &[CellId], mut born: Vec<CellId>, reused: impl Fn(CellId) -> bool) {
        if self.died.is_empty() && self.born.is_empty() {
            self.died.extend_from_slice(died);
            self.born = born;
            let taken_over = self.died.iter().copied().filter(|&cell| reused(cell));
            self.taken_over.extend(taken_over);
            return;
        }
        let is_in = |list: &[CellId], cell: &CellId| list.binary_search(cell).is_ok();
        // Revived as what they were.
        let is_revived = |cell: &CellId| {
            let same = !reused(*cell) && !is_in(&self.taken_over, cell);
            same && is_in(&self.died, cell) && !is_in(&self.born, cell)
        };
        let revived: Vec<CellId> = born.iter().copied().filter(is_revived).collect();
        let newly_dead = died.iter().copied().filter(|cell| !is_in(&self.born, cell));
        let newly_dead: Vec<CellId> = newly_dead.collect();
        self.died.extend(newly_dead);
        self.born.retain(|cell| !is_in(died, cell));
        self.born.append(&mut born);
        for list in [&mut self.died, &mut self.born] {
            if !list.is_sorted() {
                list.sort_unstable();
            }
            if !revived.is_empty() {
                list.retain(|cell| !is_in(&revived, cell));
            }
        }
        let taken_over = self.died.iter().copied().filter(|&cell| reused(cell) || is_in(&self.taken_over, &cell));
        self.taken_over = taken_over.collect();
    }

    /// Whether nothing happened.
    pub fn is_empty(&self) -> bool {
        self.died.is_empty() && self.born.is_empty() && self.vertices.is_empty() && self.removed.is_empty()
    }

    /// Carries `field` (flat, `WIDTH` numbers per vertex slot) across the change: new and moved vertices get the values
    /// of their origins, all others keep theirs. The field grows if there are new slots.
    ///
    /// # Panics
    /// If the field is shorter than the mesh had slots before the change.
    pub fn carry_field<const WIDTH: usize>(&self, field: &mut Vec<f64>) {
        let mut values: Vec<[f64; WIDTH]> = Vec::new();
        for group in self.vertices.chunk_by(|_, next| next.with_previous) {
            values.clear();
            values.extend(group.iter().map(|birth| birth.origin.interpolate::<WIDTH>(field)));
            for (birth, value) in group.iter().zip(&values) {
                let at = birth.vertex.index() * WIDTH;
                if field.len() < at + WIDTH {
                    field.resize(at + WIDTH, 0.0);
                }
                field[at..at + WIDTH].copy_from_slice(value);
            }
        }
    }
}
