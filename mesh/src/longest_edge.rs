//! Longest edge first: which edge a cell of the first cycle bisects.
//!
//! Maubach's rule needs start cells whose orders of vertices match across facets. Instead, as long as a node has been
//! bisected fewer than `N - 1` times, the first and last of its vertices that stem from the start mesh are chosen to be
//! the ends of the longest edge among these. Length is compared under a strict total order of edges (length, then ids),
//! which a shared face sees alike from both sides; so the closure ends and the mesh conforms, whatever the start mesh.
//! The order is chosen once, when a node is made, from reference positions, which do not change when a vertex is moved.

use crate::{geometry, node::Node};
use std::cmp::Ordering;

/// Moves the longest edge among `v[0..=tag]` to `(v[0], v[tag])`, and permutes the links alike, in the first cycle; does
/// nothing later. Returns whether anything moved.
pub(crate) fn arrange<const D: usize, const N: usize>(points: &[[f64; D]], node: &mut Node<N>) -> bool {
    if usize::from(node.level()) >= N - 1 {
        return false;
    }
    let tag = node.tag();
    let (first, last) = longest(points, &node.v[..=tag]);
    let mut swap = |i: usize, j: usize| {
        if i != j {
            node.v.swap(i, j);
            node.links.swap(i, j);
            node.flip();
        }
        i != j
    };
    // `first < last <= tag`, so that the first exchange leaves `first` in its place.
    let moved_last = swap(last, tag);
    let moved_first = swap(first, 0);
    moved_last || moved_first
}

/// The positions, ascending, of the ends of the longest edge among some vertices.
fn longest<const D: usize>(points: &[[f64; D]], v: &[u32]) -> (usize, usize) {
    let mut best = (0, 1);
    for j in 1..v.len() {
        for i in 0..j {
            if compare(points, [v[i], v[j]], [v[best.0], v[best.1]]) == Ordering::Greater {
                best = (i, j);
            }
        }
    }
    best
}

/// The strict total order of edges: by length, then by the greater id, then by the smaller.
fn compare<const D: usize>(points: &[[f64; D]], e: [u32; 2], f: [u32; 2]) -> Ordering {
    let length = |[a, b]: [u32; 2]| geometry::distance2(&points[a as usize], &points[b as usize]);
    let ids = |[a, b]: [u32; 2]| (a.max(b), a.min(b));
    length(e).total_cmp(&length(f)).then(ids(e).cmp(&ids(f)))
}
