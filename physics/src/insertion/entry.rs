//! Where a tip that flies freely meets the skin.

use crate::coupling::{difference, inner, length, triple};
use stylet_mesh::geometry::cross;
use stylet_mesh::{CellId, SimplexMesh};

/// A tip is outside until it is this part of the height of a cell behind the skin.
const ON_SKIN: f64 = 1e-6;

/// A point of the skin, in the deformed and in the undeformed body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contact {
    /// Part of the way to it.
    pub part: f64,
    /// In the undeformed body.
    pub material: [f64; 3],
    /// The direction inwards there, of unit length.
    pub inwards: [f64; 3],
    /// Longest edge of the cell beneath, m.
    pub edge: f64,
}

/// The first facet of the skin that the way from `a` to `b` crosses inwards, in the body displaced by `u`.
pub(super) fn contact(mesh: &SimplexMesh<3, 4>, u: &[f64], a: &[f64; 3], b: &[f64; 3]) -> Option<Contact> {
    let points = mesh.points();
    let (low, high): ([f64; 3], [f64; 3]) =
        (std::array::from_fn(|k| a[k].min(b[k])), std::array::from_fn(|k| a[k].max(b[k])));
    let mut first: Option<Contact> = None;
    for (cell, facet) in mesh.boundary_facets() {
        let vertices = mesh.cell(cell);
        let place = |i: usize| -> [f64; 3] {
            let (x, u) = (points[vertices[i].index()], triple(u, vertices[i].index()));
            std::array::from_fn(|k| x[k] + u[k])
        };
        let corners: [usize; 3] = std::array::from_fn(|i| (facet + 1 + i) % 4);
        let triangle = corners.map(place);
        let beside = |k: usize| triangle.iter().all(|p| p[k] < low[k]) || triangle.iter().all(|p| p[k] > high[k]);
        if (0..3).any(beside) {
            continue;
        }
        let Some((part, weights)) = crossing(&triangle, &place(facet), a, b) else { continue };
        if first.as_ref().is_none_or(|found| part < found.part) {
            first = Some(at_rest(mesh, cell, corners, facet, &weights, part));
        }
    }
    first
}

/// Where a segment crosses a triangle towards the side of `apex`: part of the way, and weights of the corners.
fn crossing(triangle: &[[f64; 3]; 3], apex: &[f64; 3], a: &[f64; 3], b: &[f64; 3]) -> Option<(f64, [f64; 3])> {
    let [p, q, r] = triangle;
    let mut normal = cross(&difference(q, p), &difference(r, p));
    if inner(&normal, &difference(apex, p)) < 0.0 {
        normal = normal.map(|n| -n);
    }
    // A tip on the skin is outside, whichever way it is rounded.
    let skin = ON_SKIN * inner(&normal, &difference(apex, p)).abs();
    let (from, to) = (inner(&normal, &difference(a, p)) - skin, inner(&normal, &difference(b, p)) - skin);
    if !(from <= 0.0 && to > 0.0) {
        return None;
    }
    let part = from / (from - to);
    let x: [f64; 3] = std::array::from_fn(|k| a[k] + part * (b[k] - a[k]));
    let square = inner(&normal, &normal);
    let area = |s: &[f64; 3], t: &[f64; 3]| inner(&cross(&difference(s, &x), &difference(t, &x)), &normal) / square;
    let mut weights = [area(q, r), area(r, p), area(p, q)];
    if weights.iter().sum::<f64>() < 0.0 {
        weights = weights.map(|w| -w);
    }
    weights.iter().all(|&w| w >= -1e-9).then_some((part, weights))
}

fn at_rest(
    mesh: &SimplexMesh<3, 4>,
    cell: CellId,
    corners: [usize; 3],
    facet: usize,
    weights: &[f64; 3],
    part: f64,
) -> Contact {
    let x = mesh.corners(cell);
    let sum: f64 = weights.iter().map(|w| w.max(0.0)).sum();
    let material = std::array::from_fn(|k| (0..3).map(|i| weights[i].max(0.0) / sum * x[corners[i]][k]).sum());
    let [p, q, r] = corners.map(|i| x[i]);
    let normal = cross(&difference(&q, &p), &difference(&r, &p));
    let side = inner(&normal, &difference(&x[facet], &p)).signum();
    let inwards = normal.map(|n| side * n / length(&normal));
    Contact { part, material, inwards, edge: mesh.longest_edge(cell) }
}
