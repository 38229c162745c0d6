//! Following the needle's tip through a deforming triangle mesh.
//!
//! The tip is known by the triangle it is in and its barycentric coordinates there, so it has a place both in space and
//! in the undeformed body. When it moves, or when the tissue moves past it, it walks from triangle to triangle in the
//! deformed mesh; of each edge on its way it takes note of the closest node (section 6.4 of Nienhuys, 2003).

use crate::needle::{Vec2, along, cross, dot, minus};
use serde::{Deserialize, Serialize};
use stylet_mesh::geometry::combine;
use stylet_mesh::{CellId, SimplexMesh, VertexId};

/// A triangle mesh.
pub type TriMesh = SimplexMesh<2, 3>;

/// How far outside a triangle (in barycentric coordinates) a point still counts as inside: a tip that runs along an edge
/// does not cross it by rounding errors.
const SLACK: f64 = 1e-9;

/// A point of the body.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Inside {
    /// The triangle.
    pub cell: CellId,
    /// Barycentric coordinates, in the order of the triangle's vertices.
    pub barycentric: [f64; 3],
}

/// Where a tip is: in the body, or at a point of space outside it.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub enum Tip {
    /// Outside the body, at this point.
    Outside(Vec2),
    /// In a triangle.
    Inside(Inside),
}

/// Position of a vertex in the deformed body, m.
#[inline]
pub fn deformed(mesh: &TriMesh, u: &[f64], vertex: VertexId) -> Vec2 {
    let rest = mesh.point(vertex);
    let at = 2 * vertex.index();
    [rest[0] + u[at], rest[1] + u[at + 1]]
}

/// Corners of a triangle in the deformed body, m.
#[inline]
pub fn deformed_corners(mesh: &TriMesh, u: &[f64], cell: CellId) -> [Vec2; 3] {
    mesh.cell(cell).map(|vertex| deformed(mesh, u, vertex))
}

/// Barycentric coordinates of `p`; not finite if the triangle is flat.
#[inline]
pub fn barycentric(corners: [Vec2; 3], p: Vec2) -> [f64; 3] {
    let (a, b, c) = (minus(corners[0], p), minus(corners[1], p), minus(corners[2], p));
    let (u, v, w) = (cross(b, c), cross(c, a), cross(a, b));
    let sum = u + v + w;
    [u / sum, v / sum, w / sum]
}

fn contains(barycentric: [f64; 3]) -> bool {
    barycentric.iter().all(|&l| l >= -SLACK)
}

impl Inside {
    /// The point in space, m.
    pub fn in_space(&self, mesh: &TriMesh, u: &[f64]) -> Vec2 {
        combine(&deformed_corners(mesh, u, self.cell), &self.barycentric)
    }

    /// The point in the undeformed body, m.
    pub fn in_reference(&self, mesh: &TriMesh) -> Vec2 {
        combine(&mesh.corners(self.cell), &self.barycentric)
    }

    /// The triangles that this point touches: its own, and those around the edge or vertex that it lies on.
    pub fn touching(&self, mesh: &TriMesh, out: &mut Vec<CellId>) {
        out.clear();
        out.push(self.cell);
        let near = self.barycentric.map(|l| l.abs() <= SLACK);
        let vertices = mesh.cell(self.cell);
        match near.iter().filter(|&&n| n).count() {
            0 => {}
            1 => {
                let facet = near.iter().position(|&n| n).unwrap_or(0);
                out.extend(mesh.neighbor(self.cell, facet));
            }
            _ => {
                let corner = near.iter().position(|&n| !n).unwrap_or(0);
                mesh.star(vertices[corner], out);
            }
        }
    }
}

/// The live triangle of the undeformed body that holds `point`, the first by id. Visits all triangles.
pub fn find_in_reference(mesh: &TriMesh, cells: impl Iterator<Item = CellId>, point: Vec2) -> Option<Inside> {
    find(cells, |cell| mesh.corners(cell), point)
}

/// The live triangle of the deformed body that holds `point`, the first by id. Visits all triangles.
pub fn find_in_space(mesh: &TriMesh, u: &[f64], point: Vec2) -> Option<Inside> {
    find(mesh.cells(), |cell| deformed_corners(mesh, u, cell), point)
}

fn find(cells: impl Iterator<Item = CellId>, corners: impl Fn(CellId) -> [Vec2; 3], point: Vec2) -> Option<Inside> {
    let mut found: Option<Inside> = None;
    for cell in cells {
        let barycentric = barycentric(corners(cell), point);
        if contains(barycentric) && found.is_none_or(|f| cell < f.cell) {
            found = Some(Inside { cell, barycentric });
        }
    }
    found
}

/// Moves a tip to the point `to` of space in the deformed body, and appends the closest node of each edge that it crosses
/// to `crossed`, each once.
pub fn follow(mesh: &TriMesh, u: &[f64], tip: Tip, to: Vec2, crossed: &mut Vec<VertexId>) -> Tip {
    let start = match tip {
        Tip::Inside(inside) => inside,
        Tip::Outside(from) => match enter(mesh, u, from, to, crossed) {
            Some(inside) => inside,
            None => return Tip::Outside(to),
        },
    };
    walk(mesh, u, start, to, crossed)
}

/// The first boundary edge that a tip crosses on its way in, as a point on that edge.
fn enter(mesh: &TriMesh, u: &[f64], from: Vec2, to: Vec2, crossed: &mut Vec<VertexId>) -> Option<Inside> {
    let way = minus(to, from);
    let length = dot(way, way).sqrt();
    if length == 0.0 {
        return None;
    }
    let mut first: Option<(f64, Inside, VertexId)> = None;
    for (cell, facet) in mesh.boundary_facets() {
        let vertices = mesh.cell(cell);
        let (i, j) = ((facet + 1) % 3, (facet + 2) % 3);
        let (a, b) = (deformed(mesh, u, vertices[i]), deformed(mesh, u, vertices[j]));
        let edge = minus(b, a);
        let across = cross(way, edge);
        // The way must lead to the side of the edge where the triangle is.
        let inner = cross(edge, minus(deformed(mesh, u, vertices[facet]), a));
        if across == 0.0 || (across < 0.0) == (inner < 0.0) {
            continue;
        }
        let on_edge = cross(way, minus(from, a)) / across;
        let on_way = cross(edge, minus(from, a)) / across;
        let slack = SLACK * dot(edge, edge).sqrt() / length;
        if !(-SLACK..=1.0 + SLACK).contains(&on_edge) || on_way < -slack || on_way > 1.0 {
            continue;
        }
        if first.is_none_or(|f| on_way < f.0 - slack) {
            let mut weights = [0.0; 3];
            (weights[i], weights[j]) = (1.0 - on_edge, on_edge);
            let nearest = if on_edge <= 0.5 { vertices[i] } else { vertices[j] };
            first = Some((on_way, Inside { cell, barycentric: weights }, nearest));
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

/// Walks in short straight steps, so that a visibility walk from each to the next crosses the edges that the way crosses.
fn walk(mesh: &TriMesh, u: &[f64], start: Inside, to: Vec2, crossed: &mut Vec<VertexId>) -> Tip {
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

enum Hop {
    Inside(Inside),
    Left,
    Lost,
}

/// One short step from `from` in `cell` to `to`.
fn hop(mesh: &TriMesh, u: &[f64], mut cell: CellId, from: Vec2, to: Vec2, crossed: &mut Vec<VertexId>) -> Hop {
    // Inverted triangles (large linear deformations) can send a visibility walk round in circles.
    for _ in 0..64 {
        let corners = deformed_corners(mesh, u, cell);
        let barycentric = barycentric(corners, to);
        if barycentric.iter().any(|l| !l.is_finite()) {
            return Hop::Lost;
        }
        if contains(barycentric) {
            return Hop::Inside(Inside { cell, barycentric });
        }
        let facet = (0..3).min_by(|&i, &j| barycentric[i].total_cmp(&barycentric[j])).unwrap_or(0);
        let vertices = mesh.cell(cell);
        let (i, j) = ((facet + 1) % 3, (facet + 2) % 3);
        note(crossed, if nearer_first(corners[i], corners[j], from, to) { vertices[i] } else { vertices[j] });
        match mesh.neighbor(cell, facet) {
            Some(next) => cell = next,
            None => return Hop::Left,
        }
    }
    Hop::Lost
}

/// Whether the way from `from` to `to` crosses the edge `a b` nearer to `a`.
fn nearer_first(a: Vec2, b: Vec2, from: Vec2, to: Vec2) -> bool {
    let (way, edge) = (minus(to, from), minus(b, a));
    let across = cross(way, edge);
    let size = dot(way, way).sqrt() * dot(edge, edge).sqrt();
    let on_edge = if across.abs() > 1e-12 * size {
        cross(way, minus(from, a)) / across
    } else {
        dot(minus(to, a), edge) / dot(edge, edge)
    };
    on_edge <= 0.5
}
