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

/// A vertex born of others.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct VertexBirth {
    /// The new vertex.
    pub vertex: VertexId,
    /// The older vertices it is a combination of.
    pub origin: Origin,
}

/// The net difference that one operation made: what was alive before and is not after, and the reverse.
///
/// Operations add to the change that they are given, and keep it net: filled by several in turn, it is the difference
/// between before the first and after the last. [`clear`](Self::clear) it to start afresh.
#[derive(Clone, Default, PartialEq, Debug, Serialize, Deserialize)]
pub struct MeshChange {
    /// Cells that were alive before and are not any more, ascending.
    pub died: Vec<CellId>,
    /// Cells that are alive now and were not before, ascending.
    pub born: Vec<CellId>,
    /// New vertices, parents before children.
    pub vertices: Vec<VertexBirth>,
}

impl MeshChange {
    /// Empties the lists and keeps their memory.
    pub fn clear(&mut self) {
        self.died.clear();
        self.born.clear();
        self.vertices.clear();
    }

    /// Adds to this change a later one, given as its deaths and its births (both ascending): what was born here and
    /// dies there appears in neither list any more.
    pub(crate) fn compose(&mut self, died: &[CellId], born: impl Iterator<Item = CellId>) {
        let alive_before = self.died.len();
        if self.born.is_empty() {
            self.died.extend_from_slice(died);
        } else {
            let newborn = &self.born;
            self.died.extend(died.iter().filter(|cell| newborn.binary_search(cell).is_err()));
            self.born.retain(|cell| died.binary_search(cell).is_err());
        }
        if alive_before > 0 {
            self.died.sort_unstable();
        }
        self.born.extend(born);
    }

    /// Whether nothing happened.
    pub fn is_empty(&self) -> bool {
        self.died.is_empty() && self.born.is_empty() && self.vertices.is_empty()
    }

    /// Appends to `field` (flat, `WIDTH` numbers per vertex) the values at the new vertices, whose ids follow on its end.
    ///
    /// # Panics
    /// If a vertex id is not the next slot of `field`.
    pub fn extend_field<const WIDTH: usize>(&self, field: &mut Vec<f64>) {
        for birth in &self.vertices {
            assert_eq!(birth.vertex.index() * WIDTH, field.len(), "vertex births follow on the field's end");
            let value: [f64; WIDTH] = birth.origin.interpolate(field);
            field.extend_from_slice(&value);
        }
    }
}
