//! Which cell a point near a known cell is in, and where a segment crosses the boundary.

use crate::{
    SimplexMesh,
    geometry::{barycentric, combine, distance2, longest_edge2},
    node::{is_interior, unlink},
};

/// How far outside, in barycentric coordinates, a cell still contains a point.
const SLACK: f64 = 1e-12;
/// How far ahead of a crossing, in longest edges, a path must be inside.
const AHEAD: f64 = 1e-7;
/// Cells that a walk may pass.
const LONGEST_WALK: usize = 200;

/// A live cell and coordinates in it, none negative.
pub(super) type Place<const N: usize> = (u32, [f64; N]);

/// The live cell that contains `p`, found by a walk from the live cell `start`, and by a scan where the walk meets the
/// boundary or its own traces; `None` outside the mesh.
pub(super) fn locate_from<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    start: u32,
    p: &[f64; D],
) -> Option<Place<N>> {
    let mut slot = start as usize;
    for _ in 0..LONGEST_WALK {
        let lambda = barycentric(&mesh.corners_of(&mesh.nodes[slot].v), p)?;
        let links = &mesh.nodes[slot].links;
        let exits = (0..N).filter(|&i| lambda[i] < -SLACK && is_interior(links[i]));
        match exits.min_by(|&i, &j| lambda[i].total_cmp(&lambda[j])) {
            Some(facet) => slot = unlink(links[facet]).0,
            None if lambda.iter().all(|&l| l >= -SLACK) => return Some((slot as u32, clamp(lambda))),
            None => break,
        }
    }
    scan(mesh, p)
}

/// The first live cell that contains `p`.
pub(super) fn scan<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, p: &[f64; D]) -> Option<Place<N>> {
    mesh.cells().find_map(|cell| {
        let corners = mesh.corners(cell);
        let beside = (0..D).any(|k| corners.iter().all(|x| x[k] < p[k]) || corners.iter().all(|x| x[k] > p[k]));
        let lambda = if beside { None } else { barycentric(&corners, p) }?;
        lambda.iter().all(|&l| l >= -SLACK).then(|| (cell.0, clamp(lambda)))
    })
}

/// Coordinates of the nearest point with none negative.
fn clamp<const N: usize>(lambda: [f64; N]) -> [f64; N] {
    let sum: f64 = lambda.iter().map(|l| l.max(0.0)).sum();
    lambda.map(|l| l.max(0.0) / sum)
}

/// Where a segment crosses the boundary.
pub(super) struct Crossing<const D: usize, const N: usize> {
    /// The part of the segment before it.
    pub t: f64,
    pub point: [f64; D],
    pub place: Place<N>,
    /// The local index of the vertex opposite the boundary facet.
    pub facet: usize,
}

/// The first place at which the segment from `a` to `b` crosses the boundary, inwards or outwards. A segment that
/// runs along the boundary crosses it nowhere; of one that meets it in the common vertex or edge of several facets, the
/// facet of the smallest cell id is returned.
pub(super) fn crossing<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    a: &[f64; D],
    b: &[f64; D],
    inwards: bool,
) -> Option<Crossing<D, N>> {
    let mut first: Option<Crossing<D, N>> = None;
    for (slot, node) in mesh.nodes.iter().enumerate() {
        if !node.is_leaf() || node.links.iter().all(|&link| is_interior(link)) {
            continue;
        }
        let corners = mesh.corners_of(&node.v);
        let beside = (0..D).any(|k| {
            let (low, high) = (a[k].min(b[k]), a[k].max(b[k]));
            corners.iter().all(|x| x[k] < low) || corners.iter().all(|x| x[k] > high)
        });
        if beside {
            continue;
        }
        let (Some(from), Some(to)) = (barycentric(&corners, a), barycentric(&corners, b)) else { continue };
        for facet in (0..N).filter(|&facet| !is_interior(node.links[facet])) {
            let (from_i, to_i) = (from[facet], to[facet]);
            let crosses = if inwards { from_i <= SLACK && to_i > SLACK } else { from_i >= -SLACK && to_i < -SLACK };
            if !crosses {
                continue;
            }
            let t = (from_i / (from_i - to_i)).clamp(0.0, 1.0);
            let mut lambda: [f64; N] = std::array::from_fn(|i| from[i] + t * (to[i] - from[i]));
            lambda[facet] = 0.0;
            if lambda.iter().all(|&l| l >= -SLACK) && first.as_ref().is_none_or(|c| t < c.t) {
                let lambda = clamp(lambda);
                let point = combine(&corners, &lambda);
                // Through an edge or a vertex, a path may come in and go out again at one point.
                let length = distance2(a, b).sqrt();
                let ahead = (1.0 - t).min(AHEAD * longest_edge2(&corners).sqrt() / length);
                let next = std::array::from_fn(|k| point[k] + ahead * (b[k] - a[k]));
                if !inwards || locate_from(mesh, slot as u32, &next).is_some() {
                    first = Some(Crossing { t, point, place: (slot as u32, lambda), facet });
                }
            }
        }
    }
    first
}

/// A point within `depth`, in barycentric coordinates, of boundary facets of its cell is put onto these.
pub(super) fn put_on_skin<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    place: &mut Place<N>,
    p: &mut [f64; D],
    depth: f64,
) {
    let links = &mesh.nodes[place.0 as usize].links;
    let is_close = |i: &usize| !is_interior(links[*i]) && place.1[*i] < depth;
    let close = (0..N).filter(is_close).fold(0_u32, |bits, i| bits | 1 << i);
    if close == 0 {
        return;
    }
    place.1 = clamp(std::array::from_fn(|i| if close >> i & 1 == 1 { 0.0 } else { place.1[i] }));
    *p = combine(&mesh.corners_of(&mesh.nodes[place.0 as usize].v), &place.1);
}

/// Whether a point lies strictly inside the mesh, and in which cell: no boundary facet contains it.
pub(super) fn strictly_inside<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, p: &[f64; D]) -> Option<u32> {
    let (cell, _) = scan(mesh, p)?;
    let on_skin = mesh.boundary_facets().any(|(c, facet)| {
        barycentric(&mesh.corners(c), p).is_some_and(|l| l[facet].abs() <= SLACK && l.iter().all(|&x| x >= -SLACK))
    });
    (!on_skin).then_some(cell)
}
