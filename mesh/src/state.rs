//! The serial form of a mesh: its arrays as they are, free slots included, so that what is read back goes on with the
//! same identifiers and the same bits.
//!
//! Whatever the data, what comes out is a valid mesh or an error: the start cells are built anew, which checks them and
//! makes their search tree, and all else must pass the checks of
//! [`check_invariants`](crate::SimplexMesh::check_invariants).

use crate::{
    InvariantError, MeshError, Rule, SimplexMesh, geometry,
    node::{MAX_SLOTS, Node},
    start::{check_coordinates, coordinate_limit},
};
use serde::{Deserialize, Serialize};

/// By how much a stored midpoint may differ from that of its parents, over their coordinates: text is read to an ulp.
const MIDPOINT: f64 = 1e-15;

/// The form that is written. Arrays of points and of nodes are flat.
#[derive(Serialize, Deserialize)]
pub(crate) struct MeshState {
    dimension: u32,
    vertices_per_cell: u32,
    rule: Rule,
    slot_limit: u64,
    bisection_limit: u64,
    n_macros: u64,
    points: Vec<f64>,
    /// Empty if no vertex was moved.
    reference: Vec<f64>,
    farthest_move: f64,
    vertex_parents: Vec<u32>,
    generations: Vec<u16>,
    vertex_cells: Vec<u32>,
    free_vertices: Vec<u32>,
    cells: Vec<u32>,
    links: Vec<u32>,
    cell_parents: Vec<u32>,
    info: Vec<u32>,
    free_pairs: Vec<u32>,
    regions: Vec<u32>,
    /// Of the needle remesher: single free slots, and the vertices that it moved.
    free_slots: Vec<u32>,
    remeshed: Vec<u32>,
}

/// Why data are not a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum StateError {
    #[error("the mesh has cells of {n} vertices in {d} dimensions, expected were {expected_n} in {expected_d}")]
    Dimension { d: u32, n: u32, expected_d: usize, expected_n: usize },
    #[error("{what}: {found} numbers, expected were {expected}")]
    Length { what: &'static str, found: usize, expected: usize },
    #[error("start cell {0} is not what the start mesh makes of it")]
    StartCell(usize),
    #[error("vertex {0} does not halve the edge between its parents")]
    Midpoint(usize),
    #[error("vertex {vertex} was moved by {distance:e}, farther than {farthest:e}")]
    Moved { vertex: usize, distance: f64, farthest: f64 },
    #[error(transparent)]
    Invalid(#[from] InvariantError),
    #[error(transparent)]
    Start(#[from] MeshError),
}

impl<const D: usize, const N: usize> From<SimplexMesh<D, N>> for MeshState {
    fn from(mesh: SimplexMesh<D, N>) -> Self {
        Self {
            dimension: D as u32,
            vertices_per_cell: N as u32,
            rule: mesh.rule,
            slot_limit: mesh.slot_limit as u64,
            bisection_limit: mesh.bisection_limit as u64,
            n_macros: mesh.n_macros as u64,
            points: mesh.points.into_flattened(),
            reference: mesh.reference.into_flattened(),
            farthest_move: mesh.farthest_move,
            vertex_parents: mesh.parents.into_flattened(),
            generations: mesh.generations,
            vertex_cells: mesh.vertex_leaf,
            free_vertices: mesh.free_vertices,
            cells: mesh.nodes.iter().flat_map(|node| node.v).collect(),
            links: mesh.nodes.iter().flat_map(|node| node.links).collect(),
            cell_parents: mesh.nodes.iter().map(|node| node.parent).collect(),
            info: mesh.nodes.iter().map(|node| node.info).collect(),
            free_pairs: mesh.free_pairs,
            regions: mesh.regions,
            free_slots: mesh.overlay.free_slots,
            remeshed: mesh.overlay.moved,
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
        let (n_slots, n_vertices) = (state.info.len(), state.generations.len());
        if n_slots > MAX_SLOTS {
            return Err(MeshError::TooManyCells { count: n_slots, limit: MAX_SLOTS }.into());
        }
        let moved = !state.reference.is_empty();
        let points = whole::<f64, D>("coordinates", &state.points, n_vertices)?;
        let reference = whole::<f64, D>("reference coordinates", &state.reference, if moved { n_vertices } else { 0 })?;
        let parents = whole::<u32, 2>("parents of vertices", &state.vertex_parents, n_vertices)?;
        let cells = whole::<u32, N>("vertices of cells", &state.cells, n_slots)?;
        let links = whole::<u32, N>("neighbours of cells", &state.links, n_slots)?;
        whole::<u32, 1>("cells of vertices", &state.vertex_cells, n_vertices)?;
        whole::<u32, 1>("parents of cells", &state.cell_parents, n_slots)?;
        check_coordinates(&points)?;
        check_coordinates(&reference)?;

        let node = |i: usize| Node { v: cells[i], links: links[i], parent: state.cell_parents[i], info: state.info[i] };
        let nodes: Vec<Node<N>> = (0..n_slots).map(node).collect();
        let n_macros = usize::try_from(state.n_macros).unwrap_or(usize::MAX).min(n_slots);
        // Every vertex of the start mesh is one of a start cell; those that the remesher made follow.
        let last = nodes[..n_macros].iter().flat_map(|node| node.v).max();
        let n_start = last.map_or(0, |v| v as usize + 1).min(n_vertices);
        let first_points = if moved { &reference } else { &points }[..n_start].to_vec();
        let mut mesh = start(first_points, &nodes[..n_macros], &state.regions, state.rule)?;

        mesh.n_live = nodes.iter().filter(|node| node.is_leaf()).count();
        (mesh.points, mesh.reference, mesh.parents) = (points, reference, parents);
        (mesh.generations, mesh.vertex_leaf, mesh.free_vertices) =
            (state.generations, state.vertex_cells, state.free_vertices);
        (mesh.nodes, mesh.free_pairs, mesh.regions) = (nodes, state.free_pairs, state.regions);
        mesh.farthest_move = state.farthest_move;
        (mesh.overlay.free_slots, mesh.overlay.moved) = (state.free_slots, state.remeshed);
        mesh.overlay.n_overlays = mesh.nodes.iter().filter(|node| node.is_overlay() && !node.is_free()).count();
        mesh.set_slot_limit(usize::try_from(state.slot_limit).unwrap_or(usize::MAX));
        mesh.bisection_limit = usize::try_from(state.bisection_limit).unwrap_or(usize::MAX);
        mesh.check_invariants()?;
        mesh.check_midpoints()?;
        mesh.check_moves()?;
        Ok(mesh)
    }
}

/// Cuts flat data into arrays, as many as expected.
fn whole<T: Copy, const K: usize>(what: &'static str, flat: &[T], expected: usize) -> Result<Vec<[T; K]>, StateError> {
    let (arrays, rest) = flat.as_chunks::<K>();
    if rest.is_empty() && arrays.len() == expected {
        return Ok(arrays.to_vec());
    }
    Err(StateError::Length { what, found: flat.len(), expected: expected.saturating_mul(K) })
}

/// The start mesh of some start cells, which must be as it makes them.
fn start<const D: usize, const N: usize>(
    points: Vec<[f64; D]>,
    macros: &[Node<N>],
    regions: &[u32],
    rule: Rule,
) -> Result<SimplexMesh<D, N>, StateError> {
    let cells: Vec<[u32; N]> = macros.iter().map(|node| node.v).collect();
    let region = |node: &Node<N>| regions.get(node.region()).copied().unwrap_or_default();
    let mesh = SimplexMesh::with_rule(points, cells, macros.iter().map(region).collect(), rule)?;
    for (cell, (made, found)) in mesh.nodes.iter().zip(macros).enumerate() {
        // Only where cells have a volume does the geometry tell the orientation.
        let turned = N == D + 1 && made.is_negative() != found.is_negative();
        if made.v != found.v || made.tag() != found.tag() || found.level() != 0 || turned || found.is_free() {
            return Err(StateError::StartCell(cell));
        }
    }
    Ok(mesh)
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    fn check_midpoints(&self) -> Result<(), StateError> {
        let points = self.reference_points();
        for v in self.vertices().map(|v| v.index()) {
            let [p, q] = self.parents[v].map(|parent| &points[parent as usize]);
            let halves = |k: usize| {
                let magnitude = p[k].abs().max(q[k].abs());
                (0.5 * p[k] + 0.5 * q[k] - points[v][k]).abs() <= MIDPOINT * magnitude
            };
            if !(0..D).all(halves) {
                return Err(StateError::Midpoint(v));
            }
        }
        Ok(())
    }

    fn check_moves(&self) -> Result<(), StateError> {
        let farthest = self.farthest_move;
        let sane = (0.0..=10.0 * coordinate_limit::<D>()).contains(&farthest);
        for (vertex, (p, q)) in self.points.iter().zip(&self.reference).enumerate() {
            let distance = geometry::distance2(p, q).sqrt();
            if !sane || distance > farthest * (1.0 + 1e-9) {
                return Err(StateError::Moved { vertex, distance, farthest });
            }
        }
        if sane { Ok(()) } else { Err(StateError::Moved { vertex: 0, distance: 0.0, farthest }) }
    }
}
