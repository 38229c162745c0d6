//! The serial form of a mesh: its start cells, and its history.
//!
//! One cell of each patch, in the order of their midpoints, is enough to run the same bisections again: the mesh read
//! back has the same identifiers and the same bits. Bisections do not depend on where vertices were moved, so moved
//! positions are put in afterwards. Whatever the data, what comes out is a valid mesh or an error.

use crate::{
    BisectError, InvariantError, MeshError, SimplexMesh, bisect::Recorder, complex::NONE, geometry,
    start::coordinate_limit,
};
use serde::{Deserialize, Serialize};

/// The form that is written.
#[derive(Serialize, Deserialize)]
pub(crate) struct MeshState {
    dimension: u32,
    vertices_per_cell: u32,
    slot_limit: u64,
    /// Coordinates of the start vertices, flat.
    points: Vec<f64>,
    /// Vertices of the start cells in Maubach order, flat.
    cells: Vec<u32>,
    regions: Vec<u32>,
    negative: Vec<bool>,
    /// The first cell of each patch.
    seeds: Vec<u32>,
    /// Coordinates of all vertices, flat; empty if none was moved.
    moved: Vec<f64>,
    farthest_move: f64,
}

/// Why data are not a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum StateError {
    #[error("the mesh has cells of {n} vertices in {d} dimensions, expected were {expected_n} in {expected_d}")]
    Dimension { d: u32, n: u32, expected_d: usize, expected_n: usize },
    #[error("the mesh has {0} numbers that do not make up whole vertices or cells")]
    Ragged(usize),
    #[error("bisection {step} of the mesh's history is of cell {cell}, which cannot be bisected then")]
    History { step: usize, cell: u32 },
    #[error("vertex {vertex} was moved to a coordinate of {value:e}, or farther than {farthest:e}")]
    Moved { vertex: usize, value: f64, farthest: f64 },
    #[error(transparent)]
    Turned(#[from] InvariantError),
    #[error(transparent)]
    Start(#[from] MeshError),
    #[error(transparent)]
    Bisect(#[from] BisectError),
}

impl<const D: usize, const N: usize> From<SimplexMesh<D, N>> for MeshState {
    fn from(mesh: SimplexMesh<D, N>) -> Self {
        let macros = &mesh.nodes[..mesh.n_macros];
        let is_start = |&(v, parents): &(usize, &[u32; 2])| *parents == [v as u32; 2];
        let n_start = mesh.parents.iter().enumerate().take_while(is_start).count();
        Self {
            dimension: D as u32,
            vertices_per_cell: N as u32,
            slot_limit: mesh.slot_limit as u64,
            points: mesh.reference_points()[..n_start].as_flattened().to_vec(),
            cells: macros.iter().flat_map(|node| node.v).collect(),
            regions: macros.iter().map(|node| node.region).collect(),
            negative: macros.iter().map(|node| node.negative).collect(),
            seeds: mesh.seeds(),
            moved: if mesh.reference.is_empty() { Vec::new() } else { mesh.points.as_flattened().to_vec() },
            farthest_move: mesh.farthest_move,
        }
    }
}

impl<const D: usize, const N: usize> TryFrom<MeshState> for SimplexMesh<D, N> {
    type Error = StateError;

    fn try_from(state: MeshState) -> Result<Self, StateError> {
        if (state.dimension as usize, state.vertices_per_cell as usize) != (D, N) {
            let (d, n) = (state.dimension, state.vertices_per_cell);
            return Err(StateError::Dimension { d, n, expected_d: D, expected_n: N });
        }
        let mut mesh = Self::with_regions(whole(&state.points)?, whole(&state.cells)?, state.regions)?;
        if state.negative.len() != mesh.nodes.len() {
            return Err(StateError::Ragged(state.negative.len()));
        }
        if N < D + 1 {
            // Only here is the orientation a choice that the geometry does not tell.
            for (node, negative) in mesh.nodes.iter_mut().zip(state.negative) {
                node.negative = negative;
            }
        }
        mesh.set_slot_limit(usize::MAX);
        mesh.replay(&state.seeds)?;
        if !state.moved.is_empty() {
            mesh.put(whole(&state.moved)?, state.farthest_move)?;
        }
        mesh.set_slot_limit(usize::try_from(state.slot_limit).unwrap_or(usize::MAX));
        Ok(mesh)
    }
}

/// Cuts flat data into arrays.
fn whole<T: Copy, const K: usize>(flat: &[T]) -> Result<Vec<[T; K]>, StateError> {
    let (arrays, rest) = flat.as_chunks::<K>();
    if rest.is_empty() { Ok(arrays.to_vec()) } else { Err(StateError::Ragged(flat.len())) }
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// The first cell of each patch, by the vertex that it made. Slots were handed out patch by patch.
    fn seeds(&self) -> Vec<u32> {
        let mut seeds = Vec::new();
        let mut latest = NONE;
        for pair in self.nodes[self.n_macros..].chunks_exact(2) {
            let parent = &self.nodes[pair[0].parent as usize];
            let midpoint = pair[0].v.into_iter().find(|v| !parent.v.contains(v)).unwrap_or(NONE);
            if midpoint != latest {
                seeds.push(pair[0].parent);
                latest = midpoint;
            }
        }
        seeds
    }

    /// Bisects the patches around the given cells, none of which may need a closure.
    fn replay(&mut self, seeds: &[u32]) -> Result<(), StateError> {
        let mut recorder = Recorder::default();
        for (step, &cell) in seeds.iter().enumerate() {
            let is_leaf = self.nodes.get(cell as usize).is_some_and(|node| node.child == NONE);
            if !is_leaf || !self.bisect_patch(cell, &mut recorder)? {
                return Err(StateError::History { step, cell });
            }
        }
        Ok(())
    }

    /// Puts all vertices where moves had brought them, none farther than `farthest`.
    fn put(&mut self, points: Vec<[f64; D]>, farthest: f64) -> Result<(), StateError> {
        if points.len() != self.points.len() {
            return Err(StateError::Ragged(points.len()));
        }
        let limit = coordinate_limit::<D>();
        for (vertex, (p, q)) in points.iter().zip(&self.points).enumerate() {
            let value = p.iter().fold(0.0_f64, |m, x| if m.abs() <= x.abs() || x.is_nan() { *x } else { m });
            let near = geometry::distance2(p, q).sqrt() <= farthest * (1.0 + 1e-9);
            if !(near && value.abs() <= limit && farthest <= 10.0 * limit) {
                return Err(StateError::Moved { vertex, value, farthest });
            }
        }
        self.reference = std::mem::replace(&mut self.points, points);
        self.farthest_move = farthest;
        Ok(self.check_orientations()?)
    }
}
