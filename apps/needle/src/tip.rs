//! Following the needle's tip through a deforming mesh of triangles or tetrahedra.
//!
//! The tip is known by the cell it is in and its barycentric coordinates there, so it has a place both in space and in the
//! undeformed body. When it moves, or when the tissue moves past it, it walks from cell to cell in the deformed mesh; of
//! each facet (edge of a triangle, face of a tetrahedron) on its way it takes note of the closest node (section 6.4 of
//! Nienhuys, 2003).
//!
//! A way through a vertex, along an edge or along a face is no exception: a point on a facet counts as inside either cell,
//! so that the tip stays in the cell it is in as long as it can.

use crate::facet::{barycentric, crossing_inwards, nearest_to_way};
use crate::needle::{along, dot, minus};
use serde::{Deserialize, Serialize};
use stylet_mesh::geometry::combine;
use stylet_mesh::{CellId, SimplexMesh, VertexId};

/// A triangle mesh.
pub type TriMesh = SimplexMesh<2, 3>;

/// How far outside a cell (in barycentric coordinates) a point still counts as inside: a tip that runs along a facet does
/// not cross it by rounding errors.
const SLACK: f64 = 1e-9;

/// A point of the body.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Inside<const N: usize> {
    /// The cell.
    pub cell: CellId,
    /// Barycentric coordinates, in the order of the cell's vertices.
    #[serde(with = "crate::array")]
    pub barycentric: [f64; N],
}

/// Where a tip is: in the body, or at a point of space outside it.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub enum Tip<const D: usize, const N: usize> {
    /// Outside the body, at this point.
    Outside(#[serde(with = "crate::array")] [f64; D]),
    /// In a cell.
    Inside(Inside<N>),
}

/// Position of a vertex in the deformed body, m.
#[inline]
pub fn deformed<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, u: &[f64], vertex: VertexId) -> [f64; D] {
    let rest = mesh.point(vertex);
    let u = &u[D * vertex.index()..][..D];
    std::array::from_fn(|k| rest[k] + u[k])
}

/// Corners of a cell in the deformed body, m.
#[inline]
pub fn deformed_corners<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    cell: CellId,
) -> [[f64; D]; N] {
    mesh.cell(cell).map(|vertex| deformed(mesh, u, vertex))
}

fn contains<const N: usize>(barycentric: [f64; N]) -> bool {
    barycentric.iter().all(|&l| l >= -SLACK)
}

impl<const N: usize> Inside<N> {
    /// The point in space, m.
    pub fn in_space<const D: usize>(&self, mesh: &SimplexMesh<D, N>, u: &[f64]) -> [f64; D] {
        combine(&deformed_corners(mesh, u, self.cell), &self.barycentric)
    }

    /// The point in the undeformed body, m.
    pub fn in_reference<const D: usize>(&self, mesh: &SimplexMesh<D, N>) -> [f64; D] {
        combine(&mesh.corners(self.cell), &self.barycentric)
    }

    /// The cells that this point touches: its own, and those around the facet, edge or vertex that it lies on.
    pub fn touching<const D: usize>(&self, mesh: &SimplexMesh<D, N>, out: &mut Vec<CellId>) {
        out.clear();
        out.push(self.cell);
        let vertices = mesh.cell(self.cell);
        let near = self.barycentric.map(|l| l.abs() <= SLACK);
        let of_face = || (0..N).filter(|&corner| !near[corner]);
        match N - of_face().count() {
            0 => {}
            1 => {
                let facet = near.iter().position(|&n| n).unwrap_or(0);
                out.extend(mesh.neighbor(self.cell, facet));
            }
            _ => {
                mesh.star(vertices[of_face().next().unwrap_or(0)], out);
                out.retain(|&cell| of_face().all(|corner| mesh.cell(cell).contains(&vertices[corner])));
            }
        }
    }
}

/// The live cell of the undeformed body that holds `point`, the first by id. Visits all cells.
pub fn find_in_reference<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    cells: impl Iterator<Item = CellId>,
    point: [f64; D],
) -> Option<Inside<N>> {
    find(cells, |cell| mesh.corners(cell), point)
}

/// The live cell of the deformed body that holds `point`, the first by id. Visits all cells.
pub fn find_in_space<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    point: [f64; D],
) -> Option<Inside<N>> {
    find(mesh.cells(), |cell| deformed_corners(mesh, u, cell), point)
}

fn find<const D: usize, const N: usize>(
    cells: impl Iterator<Item = CellId>,
    corners: impl Fn(CellId) -> [[f64; D]; N],
    point: [f64; D],
) -> Option<Inside<N>> {
    let mut found: Option<Inside<N>> = None;
    for cell in cells {
        let barycentric = barycentric(corners(cell), point);
        if contains(barycentric) && found.is_none_or(|f| cell < f.cell) {
            found = Some(Inside { cell, barycentric });
        }
    }
    found
}

/// Moves a tip to the point `to` of space in the deformed body, and appends the closest node of each facet that it crosses
/// to `crossed`, each once.
pub fn follow<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    tip: Tip<D, N>,
    to: [f64; D],
    crossed: &mut Vec<VertexId>,
) -> Tip<D, N> {
    let start = match tip {
        Tip::Inside(inside) => inside,
        Tip::Outside(from) => match enter(mesh, u, from, to, crossed) {
            Some(inside) => inside,
            None => return Tip::Outside(to),
        },
    };
    walk(mesh, u, start, to, crossed)
}

/// The first boundary facet that a tip crosses on its way in, as a point on that facet.
fn enter<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    from: [f64; D],
    to: [f64; D],
    crossed: &mut Vec<VertexId>,
) -> Option<Inside<N>> {
    let way = minus(to, from);
    let length = dot(way, way).sqrt();
    if length == 0.0 {
        return None;
    }
    let mut first: Option<(f64, Inside<N>, VertexId)> = None;
    for (cell, facet) in mesh.boundary_facets() {
        let corners = deformed_corners(mesh, u, cell);
        let Some(crossing) = crossing_inwards(&corners, facet, from, way, SLACK) else { continue };
        let [a, b] = [corners[(facet + 1) % N], corners[(facet + 2) % N]];
        let edge = minus(b, a);
        let slack = SLACK * dot(edge, edge).sqrt() / length;
        if crossing.on_way < -slack || crossing.on_way > 1.0 {
            continue;
        }
        if first.is_none_or(|f| crossing.on_way < f.0 - slack) {
            let inside = Inside { cell, barycentric: crossing.weights };
            first = Some((crossing.on_way, inside, mesh.cell(cell)[crossing.nearest]));
        }
    }
    let (_, inside, nearest) = first?;
    note(crossed, nearest);
    Some(inside)
}

fn note(crossed: &mut Vec<VertexId>, vertex: VertexId) {
    if !crossed.contains(&vertex) {
        crossed.push(vertex);
    }
}

/// Walks in short straight steps, so that a visibility walk from each to the next crosses the facets that the way crosses.
fn walk<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    start: Inside<N>,
    to: [f64; D],
    crossed: &mut Vec<VertexId>,
) -> Tip<D, N> {
    let mut at = start;
    let mut here = start.in_space(mesh, u);
    // A way of more than this many steps crosses a body inside out; then only its end counts.
    for _ in 0..100_000 {
        let way = minus(to, here);
        let distance = dot(way, way).sqrt();
        let stride = 0.25 * mesh.longest_edge(at.cell);
        let next = if distance <= stride { to } else { along(here, stride / distance, way) };
        match hop(mesh, u, at.cell, here, next, crossed) {
            Hop::Inside(inside) => at = inside,
            Hop::Left => return Tip::Outside(to),
            Hop::Lost => return find_in_space(mesh, u, to).map_or(Tip::Outside(to), Tip::Inside),
        }
        if next == to {
            return Tip::Inside(at);
        }
        here = next;
    }
    find_in_space(mesh, u, to).map_or(Tip::Outside(to), Tip::Inside)
}

enum Hop<const N: usize> {
    Inside(Inside<N>),
    Left,
    Lost,
}

/// One short step from `from` in `cell` to `to`.
fn hop<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    mut cell: CellId,
    from: [f64; D],
    to: [f64; D],
    crossed: &mut Vec<VertexId>,
) -> Hop<N> {
    // Inverted cells (large linear deformations) can send a visibility walk round in circles.
    for _ in 0..64 {
        let corners = deformed_corners(mesh, u, cell);
        let barycentric = barycentric(corners, to);
        if barycentric.iter().any(|l| !l.is_finite()) {
            return Hop::Lost;
        }
        if contains(barycentric) {
            return Hop::Inside(Inside { cell, barycentric });
        }
        let facet = (0..N).min_by(|&i, &j| barycentric[i].total_cmp(&barycentric[j])).unwrap_or(0);
        note(crossed, mesh.cell(cell)[nearest_to_way(&corners, facet, from, to)]);
        match mesh.neighbor(cell, facet) {
            Some(next) => cell = next,
            None => return Hop::Left,
        }
    }
    Hop::Lost
}
