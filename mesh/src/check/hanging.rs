//! Vertices that hang on the facets of other cells.
//!
//! Where a mesh does not conform, both sides are boundary facets, so only these, and the vertices of these, are looked at.

use super::{Finding, Raw};
use crate::{
    bounds::{BoundingTree, Bounds},
    geometry::{barycentric, combine, distance2, longest_edge2},
    manifold::Facet,
};

/// A vertex is on a facet if it is no farther from it, in barycentric coordinates and in parts of the longest edge.
const ON: f64 = 1e-9;
/// Pairs of vertex and facet that are looked at per facet, on average, before the search is given up.
const MOST_PAIRS: usize = 200;
/// ... and so many in any case.
const FEW_PAIRS: usize = 1_000_000;

/// Finds hanging vertices; returns false if the search was given up.
pub(super) fn find<const D: usize, const N: usize>(raw: &Raw<'_, D, N>, findings: &mut Vec<Finding>) -> bool {
    // The facets of segments are vertices.
    let facets: Vec<&Facet<N>> = match N {
        0..3 => Vec::new(),
        _ => raw.facet_groups().filter(|g| g.len() == 1 && raw.solid[g[0].cell as usize]).map(|g| &g[0]).collect(),
    };
    let mut vertices: Vec<u32> = facets.iter().flat_map(|f| &f.vertices[..N - 1]).copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    let boxes: Vec<Bounds<D>> = facets
        .iter()
        .map(|f| {
            let mut corners = raw.corners(f.cell);
            corners.swap(f.local as usize, N - 1);
            Bounds::of(&corners[..N - 1], ON)
        })
        .collect();
    let (tree, order) = BoundingTree::new(&boxes);
    let mut pairs = 0;
    let mut candidates = Vec::new();
    for vertex in vertices {
        let p = &raw.points[vertex as usize];
        candidates.clear();
        tree.visit_at(p, |range| candidates.extend_from_slice(&order[range]));
        pairs += candidates.len();
        if pairs > FEW_PAIRS + MOST_PAIRS * facets.len() {
            return false;
        }
        candidates.sort_unstable();
        for f in candidates.iter().map(|&item| facets[item as usize]) {
            if !f.vertices.contains(&vertex) && is_on(&raw.corners(f.cell), f.local as usize, p) {
                let facet = f.vertices[..N - 1].to_vec();
                findings.push(Finding::Hanging { vertex, cell: f.cell, facet });
            }
        }
    }
    true
}

/// Whether `p` lies on the facet opposite corner `local`, and not in one of the corners.
fn is_on<const D: usize, const N: usize>(corners: &[[f64; D]; N], local: usize, p: &[f64; D]) -> bool {
    let Some(lambda) = barycentric(corners, p) else { return false };
    let on = lambda[local].abs() <= ON && lambda.iter().all(|&l| (-ON..=1.0 - ON).contains(&l));
    // Of a surface, how far the point is away counts too.
    on && distance2(p, &combine(corners, &lambda)) <= ON * ON * longest_edge2(corners)
}
