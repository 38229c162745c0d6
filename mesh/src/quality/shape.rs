//! Similarity classes: how many shapes a mesh has.

use super::cell::pairs;
use crate::{
    SimplexMesh,
    geometry::{distance2, longest_edge2},
};
use std::collections::BTreeMap;

/// Squared edges, over the longest, that differ by less than this count as equal.
const SAME: f64 = 1e-6;

/// The squared distances of the corners of a simplex over its longest edge.
type Distances<const N: usize> = [[f64; N]; N];

/// The number of shapes among the live cells: two cells have one shape if a motion, a reflection and a change of scale
/// take one to the other, up to a part of 1e-6 in the squared edges.
///
/// Bisection of a cube yields 1, 3 and 4 in 2, 3 and 4 dimensions; more give away a wrong order of vertices, which no
/// other check finds.
pub fn shapes<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> usize {
    // Classes by the sum of their squared edges in steps of more than the tolerance of a sum.
    let step = SAME * (N * N) as f64;
    let mut classes: BTreeMap<i64, Vec<Distances<N>>> = BTreeMap::new();
    for cell in mesh.cells() {
        let (distances, sum) = distances(&mesh.corners(cell));
        let key = (sum / step) as i64;
        let known = classes.range(key - 1..=key + 1).flat_map(|(_, list)| list);
        if !known.into_iter().any(|class| similar(class, &distances)) {
            classes.entry(key).or_default().push(distances);
        }
    }
    classes.values().map(Vec::len).sum()
}

fn distances<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> (Distances<N>, f64) {
    let longest = longest_edge2(corners);
    let at = |i: usize, j: usize| distance2(&corners[i], &corners[j]) / longest;
    let matrix = std::array::from_fn(|i| std::array::from_fn(|j| at(i, j)));
    (matrix, pairs::<N>().map(|(i, j)| at(i, j)).sum())
}

/// Whether some order of the vertices of `b` gives the distances of `a`.
fn similar<const N: usize>(a: &Distances<N>, b: &Distances<N>) -> bool {
    matches(a, b, &mut [0; N], 0)
}

/// Extends a partial order of `length` vertices, if it can be done.
fn matches<const N: usize>(a: &Distances<N>, b: &Distances<N>, order: &mut [usize; N], length: usize) -> bool {
    if length == N {
        return true;
    }
    for next in 0..N {
        let fits = |k: usize| order[k] != next && (a[length][k] - b[next][order[k]]).abs() <= SAME;
        if (0..length).all(fits) {
            order[length] = next;
            if matches(a, b, order, length + 1) {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_edge_lengths_do_not_make_tetrahedra_similar() {
        // Both have squared edges 1, 1, 1, 2, 2, 2: the corner of a cube, and a path with three edges of length 1 ...
        let corner = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        // ... bent so that its end points lie sqrt(2) apart.
        let path = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 1.0, 0.75_f64.sqrt()]];
        let ((a, _), (b, _)) = (distances(&corner), distances(&path));
        assert!(similar(&a, &a) && similar(&b, &b) && !similar(&a, &b));
    }

    #[test]
    fn mirror_images_and_scales_are_one_shape() {
        let tet = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.3, 0.2, 0.7]];
        let mirrored = [tet[2], tet[0], tet[3], tet[1]].map(|[x, y, z]| [-3.0 * y, 3.0 * x, -3.0 * z]);
        assert!(similar(&distances(&tet).0, &distances(&mirrored).0));
    }
}
