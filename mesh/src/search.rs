//! Which nodes of the bisection forest a point or a segment touches.
//!
//! A feature is carried down the forest by the barycentric coordinates of its ends, which cost one subtraction per level
//! (see [`locate`](crate::SimplexMesh::locate)), so that only nodes it touches are ever looked at.
//!
//! Halves of a node fill it only as long as midpoints stay where they are. In a mesh with moved vertices the descent takes
//! place among reference positions, which are never moved, with a tolerance of the farthest move; leaves are then tested
//! where they really are.

use crate::{
    SimplexMesh,
    geometry::{self, barycentric, combine, distance2, dot, longest_edge2, subtract},
    locate::child_coordinates,
    node::Node,
};

/// How far outside a start cell, in its barycentric coordinates, a feature still touches it.
const TOUCH: f64 = 1e-12;
/// The same distance is a greater part of a smaller cell, up to this part.
const TOUCH_MOST: f64 = 1e-4;

/// A node of the forest that a feature with `K` ends touches, and the coordinates of the ends in it: a point has one
/// end, a segment two, and the feature without ends is everywhere.
#[derive(Clone, Copy)]
pub(crate) struct Touched<const N: usize, const K: usize> {
    pub slot: u32,
    pub ends: [[f64; N]; K],
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// The start cells that a point (`K = 1`) or a closed segment (`K = 2`) touches, ascending, each with the ends of the
    /// part within it, and the sum of the lengths of these parts.
    pub(crate) fn macros_touching<const K: usize>(&self, feature: &[[f64; D]; K]) -> (Vec<Touched<N, K>>, f64) {
        let (a, b) = (&feature[0], &feature[K - 1]);
        let (mut touched, mut length) = (Vec::new(), 0.0);
        self.visit_start_cells(a, b, self.farthest_move, |slot| {
            let corners = self.reference_corners(&self.nodes[slot as usize].v);
            if let Some((from, to, ends)) = clip(&corners, feature, self.touch_of_start(&corners)) {
                length += (to - from) * distance2(a, b).sqrt();
                touched.push(Touched { slot, ends });
            }
        });
        touched.sort_unstable_by_key(|t| t.slot);
        (touched, length)
    }

    /// The tolerance of touching a start cell given by its reference corners, in its barycentric coordinates.
    pub(crate) fn touch_of_start(&self, corners: &[[f64; D]; N]) -> f64 {
        TOUCH + self.move_tolerance(corners)
    }

    /// Appends those children of a bisected node that the feature touches.
    #[inline]
    pub(crate) fn push_touched<const K: usize>(&self, slot: u32, ends: &[[f64; N]; K], queue: &mut Vec<Touched<N, K>>) {
        let child = self.nodes[slot as usize].child();
        let touched = Touched { slot, ends: *ends };
        queue.extend([child, child + 1].into_iter().filter_map(|child| self.touch_child(&touched, child)));
    }

    /// The feature in a child of a bisected node, if it touches it.
    #[inline]
    pub(crate) fn touch_child<const K: usize>(&self, parent: &Touched<N, K>, slot: u32) -> Option<Touched<N, K>> {
        let (node, child) = (&self.nodes[parent.slot as usize], &self.nodes[slot as usize]);
        let second = slot != node.child();
        let ends = parent.ends.map(|l| child_coordinates(node, child, second, &l));
        meets(&ends, self.tolerance(child)).then_some(Touched { slot, ends })
    }

    /// Whether a feature that touches the node of a leaf touches the leaf where it really is.
    #[inline]
    pub(crate) fn really_touches<const K: usize>(&self, node: &Node<N>, feature: &[[f64; D]; K]) -> bool {
        K == 0
            || self.reference.is_empty()
            || clip(&self.corners_of(&node.v), feature, touch_tolerance::<N>(node.level())).is_some()
    }

    /// The tolerance of the descent at a node, in its barycentric coordinates.
    #[inline]
    fn tolerance(&self, node: &Node<N>) -> f64 {
        let touch = touch_tolerance::<N>(node.level());
        if self.reference.is_empty() { touch } else { touch + self.move_tolerance(&self.reference_corners(&node.v)) }
    }

    /// By how much a barycentric coordinate can differ between the reference and the real position of a point.
    fn move_tolerance(&self, corners: &[[f64; D]; N]) -> f64 {
        if self.farthest_move == 0.0 {
            return 0.0;
        }
        self.farthest_move * steepest(corners)
    }
}

/// The greatest slope of a barycentric coordinate, 1/length; infinite for a flat simplex.
pub(crate) fn steepest<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> f64 {
    let slope = |g: [[f64; D]; N]| g.iter().map(|g| dot(g, g).sqrt()).fold(0.0, f64::max);
    geometry::gradients(corners).map_or(f64::INFINITY, slope)
}

/// The tolerance of touching in barycentric coordinates at a level: one distance everywhere. Rounding of a coordinate,
/// too, doubles whenever the cells halve.
#[inline]
pub(crate) fn touch_tolerance<const N: usize>(level: u16) -> f64 {
    let halvings = u32::from(level).div_ceil(N as u32 - 1).min(40);
    (TOUCH * (1_u64 << halvings) as f64).min(TOUCH_MOST)
}

/// Whether a feature meets the simplex in which its ends have the given coordinates.
#[inline]
fn meets<const N: usize, const K: usize>(ends: &[[f64; N]; K], tolerance: f64) -> bool {
    match K {
        0 => true,
        1 => ends[0].iter().all(|&l| l >= -tolerance),
        _ => interval(&ends[0], &ends[K - 1], tolerance).is_some(),
    }
}

/// The part `from..=to` of `0..=1` in which all coordinates, linear in between, are at least `-tolerance`.
///
/// Source: Liang & Barsky, *A new concept and method for line clipping*, ACM Trans. Graph. 3 (1984).
pub(crate) fn interval<const N: usize>(a: &[f64; N], b: &[f64; N], tolerance: f64) -> Option<(f64, f64)> {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for i in 0..N {
        let (at_a, at_b) = (a[i] + tolerance, b[i] + tolerance);
        match (at_a >= 0.0, at_b >= 0.0) {
            (true, true) => {}
            (false, false) => return None,
            (true, false) => to = to.min(at_a / (at_a - at_b)),
            (false, true) => from = from.max(at_a / (at_a - at_b)),
        }
    }
    (from <= to).then_some((from, to))
}

/// The part `from..=to` of a feature that touches a simplex, and the barycentric coordinates of its ends.
pub(crate) fn clip<const D: usize, const N: usize, const K: usize>(
    corners: &[[f64; D]; N],
    feature: &[[f64; D]; K],
    tolerance: f64,
) -> Option<(f64, f64, [[f64; N]; K])> {
    let (a, b) = (&feature[0], &feature[K - 1]);
    let (at_a, at_b) = (barycentric(corners, a)?, barycentric(corners, b)?);
    let (mut from, mut to) = interval(&at_a, &at_b, tolerance)?;
    if N < D + 1 {
        let off = |p: &[f64; D], at: &[f64; N]| subtract(p, &combine(corners, at));
        let reach = tolerance * longest_edge2(corners).sqrt();
        (from, to) = near_hull(&off(a, &at_a), &off(b, &at_b), reach, from, to)?;
    }
    let at = |t: f64| match t {
        0.0 => at_a,
        1.0 => at_b,
        _ => std::array::from_fn(|i| at_a[i] + t * (at_b[i] - at_a[i])),
    };
    Some((from, to, std::array::from_fn(|end| at(if end == 0 { from } else { to }))))
}

/// The part of `from..=to` in which a vector, linear from `off_a` at 0 to `off_b` at 1, is no longer than `reach`: where a
/// segment is near the affine hull of a cell of a surface or a rod.
fn near_hull<const D: usize>(off_a: &[f64; D], off_b: &[f64; D], reach: f64, from: f64, to: f64) -> Option<(f64, f64)> {
    let slope = subtract(off_b, off_a);
    let steep = dot(&slope, &slope);
    let nearest = if steep > 0.0 { (-dot(off_a, &slope) / steep).clamp(from, to) } else { from };
    let rest: [f64; D] = std::array::from_fn(|k| off_a[k] + nearest * slope[k]);
    let room = reach * reach - dot(&rest, &rest);
    if room < 0.0 {
        return None;
    }
    let half = if steep > 0.0 { (room / steep).sqrt() } else { f64::INFINITY };
    Some(((nearest - half).max(from), (nearest + half).min(to)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    #[test]
    fn a_segment_is_clipped_to_a_triangle() {
        let (from, to, ends) = clip(&TRIANGLE, &[[-1.0, 0.25], [1.0, 0.25]], 0.0).unwrap();
        assert_eq!((from, to), (0.5, 0.875));
        assert_eq!(ends, [[0.75, 0.0, 0.25], [0.0, 0.75, 0.25]]);
    }

    #[test]
    fn touching_is_closed() {
        for touching in
            [[[1.0, 0.0]; 2], [[0.5, -1.0], [0.5, 0.0]], [[-1.0, 2.0], [2.0, -1.0]], [[0.0, 1.0], [5.0, 1.0]]]
        {
            assert!(clip(&TRIANGLE, &touching, TOUCH).is_some(), "{touching:?}");
        }
        for apart in [[[1.0, 0.1]; 2], [[0.5, -1.0], [0.5, -1e-9]], [[-1.0, 2.1], [2.1, -1.0]]] {
            assert!(clip(&TRIANGLE, &apart, TOUCH).is_none(), "{apart:?}");
        }
    }

    #[test]
    fn a_segment_pierces_a_surface_in_a_point() {
        let lifted = TRIANGLE.map(|[x, y]| [x, y, 1.0]);
        let (from, to, ends) = clip(&lifted, &[[0.25, 0.25, 0.0], [0.25, 0.25, 4.0]], TOUCH).unwrap();
        assert!((from - 0.25).abs() < 1e-11 && (to - 0.25).abs() < 1e-11);
        assert_eq!(ends[0], [0.5, 0.25, 0.25]);
        assert!(clip(&lifted, &[[0.25, 0.25, 0.0], [0.25, 0.25, 0.9]], TOUCH).is_none());
    }
}
