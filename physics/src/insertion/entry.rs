//! Where a tip that flies freely meets the skin.

use crate::coupling::{difference, inner, length, triple};
use stylet_mesh::geometry::cross;
use stylet_mesh::{CellId, SimplexMesh};

/// A tip is outside until it is this part of the height of a cell behind the skin.
const ON_SKIN: f64 = 1e-6;

/// How far beside a facet a point still counts as on it, so that none gets through between two: in barycentric coordinates.
const ON_EDGE: f64 = 1e-9;

/// A point of the skin of the undeformed body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contact {
    /// Its place.
    pub material: [f64; 3],
    /// The direction inwards there, of unit length.
    pub inwards: [f64; 3],
    /// Longest edge of the cell beneath, m.
    pub edge: f64,
}

/// The first facet of the skin that a tip on its way from `a` to `b` crosses inwards, while the body goes from one displacement
/// to another: the skin may as well come to the tip.
pub(super) fn contact(
    mesh: &SimplexMesh<3, 4>,
    [before, after]: [&[f64]; 2],
    a: &[f64; 3],
    b: &[f64; 3],
) -> Option<Contact> {
    let mut first: Option<(f64, Facet, [f64; 3])> = None;
    for facet in skin(mesh) {
        let (from, to) = (facet.at(mesh, before), facet.at(mesh, after));
        let corners = || from.triangle.iter().chain(&to.triangle);
        let beside = |k: usize| corners().all(|p| p[k] < a[k].min(b[k])) || corners().all(|p| p[k] > a[k].max(b[k]));
        if (0..3).any(beside) {
            continue;
        }
        let (outside, inside) = (from.coordinates(a), to.coordinates(b));
        if !(outside.height <= ON_SKIN && inside.height > ON_SKIN) {
            continue;
        }
        let part = (ON_SKIN - outside.height) / (inside.height - outside.height);
        let weights: [f64; 3] =
            std::array::from_fn(|i| outside.weights[i] + part * (inside.weights[i] - outside.weights[i]));
        let is_first = first.as_ref().is_none_or(|(known, ..)| part < *known);
        if is_first && weights.iter().all(|&w| w >= -ON_EDGE) {
            first = Some((part, facet, weights));
        }
    }
    first.map(|(_, facet, weights)| facet.at_rest(mesh, &weights))
}

/// Where the straight line behind a tip goes through the skin for the last time, if the tip is inside the body.
pub(super) fn entered(mesh: &SimplexMesh<3, 4>, u: &[f64], tip: &[f64; 3], tangent: &[f64; 3]) -> Option<Contact> {
    let mut inside = 0;
    let mut last: Option<(f64, Facet, [f64; 3])> = None;
    for facet in skin(mesh) {
        let here = facet.at(mesh, u);
        // Along the line the height grows by its share of the tangent.
        let end = here.coordinates(tip);
        let start = here.coordinates(&std::array::from_fn(|k| tip[k] - tangent[k]));
        let rise = end.height - start.height;
        let back = (end.height - ON_SKIN) / rise;
        if !(back.is_finite() && back > 0.0) {
            continue;
        }
        let weights: [f64; 3] = std::array::from_fn(|i| end.weights[i] - back * (end.weights[i] - start.weights[i]));
        if weights.iter().any(|&w| w < 0.0) {
            continue;
        }
        inside += if rise > 0.0 { 1 } else { -1 };
        if rise > 0.0 && last.as_ref().is_none_or(|(known, ..)| back < *known) {
            last = Some((back, facet, weights));
        }
    }
    let (_, facet, weights) = last.filter(|_| inside > 0)?;
    Some(facet.at_rest(mesh, &weights))
}

/// A facet of the skin by the vertices of its cell: three corners, and the one behind them.
#[derive(Clone, Copy)]
struct Facet {
    cell: CellId,
    corners: [usize; 3],
    apex: usize,
}

/// The same in the deformed body.
struct Placed {
    triangle: [[f64; 3]; 3],
    /// With the length of twice the area, as the corners go round.
    normal: [f64; 3],
    /// Height of the cell over the facet, by that length; negative where the normal looks out of the body.
    height: f64,
}

/// Height of a point over a facet, inwards, as part of that of the cell; weights of the corners beneath it.
struct Coordinates {
    height: f64,
    weights: [f64; 3],
}

fn skin(mesh: &SimplexMesh<3, 4>) -> impl Iterator<Item = Facet> {
    mesh.boundary_facets().map(|(cell, facet)| Facet {
        cell,
        corners: std::array::from_fn(|i| (facet + 1 + i) % 4),
        apex: facet,
    })
}

impl Facet {
    fn at(&self, mesh: &SimplexMesh<3, 4>, u: &[f64]) -> Placed {
        let (points, vertices) = (mesh.points(), mesh.cell(self.cell));
        let place = |i: usize| -> [f64; 3] {
            let (x, u) = (points[vertices[i].index()], triple(u, vertices[i].index()));
            std::array::from_fn(|k| x[k] + u[k])
        };
        let triangle = self.corners.map(place);
        let [p, q, r] = &triangle;
        let normal = cross(&difference(q, p), &difference(r, p));
        Placed { triangle, normal, height: inner(&normal, &difference(&place(self.apex), p)) }
    }

    fn at_rest(&self, mesh: &SimplexMesh<3, 4>, weights: &[f64; 3]) -> Contact {
        let x = mesh.corners(self.cell);
        let sum: f64 = weights.iter().map(|w| w.max(0.0)).sum();
        let [p, q, r] = self.corners.map(|i| x[i]);
        let material = std::array::from_fn(|k| {
            (weights[0].max(0.0) * p[k] + weights[1].max(0.0) * q[k] + weights[2].max(0.0) * r[k]) / sum
        });
        let normal = cross(&difference(&q, &p), &difference(&r, &p));
        let side = inner(&normal, &difference(&x[self.apex], &p)).signum();
        let inwards = normal.map(|n| side * n / length(&normal));
        Contact { material, inwards, edge: mesh.longest_edge(self.cell) }
    }
}

impl Placed {
    fn coordinates(&self, x: &[f64; 3]) -> Coordinates {
        let [p, q, r] = &self.triangle;
        let square = inner(&self.normal, &self.normal);
        let area =
            |s: &[f64; 3], t: &[f64; 3]| inner(&cross(&difference(s, x), &difference(t, x)), &self.normal) / square;
        Coordinates {
            height: inner(&self.normal, &difference(x, p)) / self.height,
            weights: [area(q, r), area(r, p), area(p, q)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_mesh::generate::kuhn_box;

    const AHEAD: [f64; 3] = [1.0, 0.0, 0.0];

    fn close(contact: Option<Contact>, place: [f64; 3]) {
        let contact = contact.expect("a contact");
        assert!((0..3).all(|k| (contact.material[k] - place[k]).abs() < 1e-6), "{contact:?} {place:?}");
        assert!((contact.inwards[0] - 1.0).abs() < 1e-12, "{contact:?}");
    }

    /// Whether the tip or the skin moves, or both, it is met where they cross; skin that yields is not.
    #[test]
    fn a_tip_and_a_skin_that_move_meet() {
        let mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [3; 3]).unwrap();
        let shifted = |by: f64| -> Vec<f64> { (0..mesh.n_vertex_slots()).flat_map(|_| [by, 0.0, 0.0]).collect() };
        let at = |x: f64| [x, 0.41, 0.57];
        let [still, towards, away] = [0.0, -0.3, 0.3].map(shifted);
        close(contact(&mesh, [&still, &still], &at(-0.1), &at(0.1)), at(0.0));
        close(contact(&mesh, [&still, &towards], &at(-0.1), &at(-0.1)), at(0.0));
        close(contact(&mesh, [&away, &towards], &at(0.1), &at(-0.1)), at(0.0));
        for (u, a, b) in [([&still, &away], -0.1, 0.1), ([&still, &still], 0.1, -0.1), ([&still, &still], -0.2, -0.1)] {
            assert_eq!(contact(&mesh, [&u[0][..], &u[1][..]], &at(a), &at(b)), None);
        }
        assert_eq!(contact(&mesh, [&still, &still], &[-0.1, 1.2, 0.5], &[0.1, 1.2, 0.5]), None);
    }

    /// Inside the line behind the tip has gone through the skin, wherever the needle was; outside it has not.
    #[test]
    fn a_tip_inside_has_entered() {
        let mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [3; 3]).unwrap();
        let still = vec![0.0; 3 * mesh.n_vertex_slots()];
        for x in [0.01, 0.5, 0.99] {
            close(entered(&mesh, &still, &[x, 0.41, 0.57], &AHEAD), [0.0, 0.41, 0.57]);
        }
        for outside in [[-0.01, 0.41, 0.57], [1.01, 0.41, 0.57], [0.5, 1.2, 0.57]] {
            assert_eq!(entered(&mesh, &still, &outside, &AHEAD), None);
        }
    }
}
