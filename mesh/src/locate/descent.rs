//! Barycentric coordinates up and down the bisection forest.
//!
//! If `l` are the barycentric coordinates in a node with refinement edge `(a, b)` and midpoint `z`, then
//! `l_a a + l_b b = (l_a - l_b) a + 2 l_b z`. So the coordinates in the child with `a` are `l_a - l_b` at `a` and `2 l_b`
//! at `z`, and are not negative if `l_a >= l_b`: one subtraction per level, and no coordinates below the start mesh. The
//! way up is `l_b = l_z / 2`, `l_a = l_a' + l_z / 2`.

use crate::{
    SimplexMesh,
    node::{NONE, Node},
};
use std::hint::select_unpredictable;

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// The leaf below a node that owns the point with the given coordinates, and the coordinates there. Where they are
    /// not negative, neither are those in the leaf.
    ///
    /// Tags run from `N - 1` to 1 and round again. So there is one step for each of them, in which all indices are
    /// constants and the coordinates stay in registers; and since the halves differ by a choice of numbers only, no branch
    /// depends on the point.
    #[inline]
    pub(super) fn descend(&self, root: u32, lambda: [f64; N]) -> (u32, [f64; N]) {
        let mut at = (root as usize, lambda);
        loop {
            // Steps of tags that cells of `N` vertices do not have are compiled to nothing.
            let leaf = self.step::<7>(&mut at)
                || self.step::<6>(&mut at)
                || self.step::<5>(&mut at)
                || self.step::<4>(&mut at)
                || self.step::<3>(&mut at)
                || self.step::<2>(&mut at)
                || self.step::<1>(&mut at);
            if leaf {
                return (at.0 as u32, at.1);
            }
        }
    }

    /// Goes down one level if the node has tag `K`; returns whether it is a leaf.
    #[inline(always)]
    fn step<const K: usize>(&self, (slot, lambda): &mut (usize, [f64; N])) -> bool {
        if K >= N {
            return false;
        }
        let node = &self.nodes[*slot];
        if !node.is_inner() {
            return true;
        }
        // Another tag is met only on the way to the tag of the node that the descent begins at.
        if node.tag() == K {
            let second = is_second(lambda, K, || second_wins(node, K));
            *slot = node.child() as usize + usize::from(second);
            *lambda = halve(lambda, K, second);
            if is_reordered::<N>(K, node.level()) {
                *lambda = reorder(node, &self.nodes[*slot], second, lambda);
            }
        }
        false
    }

    /// The coordinates in the parent of the point with coordinates `lambda` in the node `slot`, and the parent; `None` for
    /// a start cell.
    pub(super) fn climb(&self, slot: u32, lambda: &[f64; N]) -> Option<(u32, [f64; N])> {
        let child = &self.nodes[slot as usize];
        let above = child.parent;
        if above == NONE {
            return None;
        }
        let parent = &self.nodes[above as usize];
        let (k, second) = (parent.tag(), slot != parent.child());
        let made = if is_reordered::<N>(k, parent.level()) {
            let order = made_order(parent, child, second);
            let mut made = [0.0; N];
            for i in 0..N {
                made[order[i]] = lambda[i];
            }
            made
        } else {
            *lambda
        };
        let half = 0.5 * made[k];
        let mut next = made;
        if second {
            next.copy_within(0..k, 1);
            (next[0], next[k]) = (half, made[k - 1] + half);
        } else {
            (next[0], next[k]) = (made[0] + half, half);
        }
        Some((above, next))
    }
}

/// Whether a point in a node with tag `k` belongs to child 1, given who wins a tie.
#[inline(always)]
pub(super) fn is_second<const N: usize>(lambda: &[f64; N], k: usize, second_wins: impl FnOnce() -> bool) -> bool {
    let (l_a, l_b) = (lambda[0], lambda[k]);
    if l_a == l_b { second_wins() } else { l_b > l_a }
}

/// Whether child 1 of a node with tag `k` owns the points in the middle.
#[inline]
pub(super) fn second_wins<const N: usize>(node: &Node<N>, k: usize) -> bool {
    node.v[k] < node.v[0]
}

/// The coordinates in a child, in the order in which bisection makes it, of the point with coordinates `lambda` in a
/// parent with tag `k`; at the kept end they are negative in the half that the point is not in.
#[inline(always)]
pub(super) fn halve<const N: usize>(lambda: &[f64; N], k: usize, second: bool) -> [f64; N] {
    let (l_a, l_b) = (lambda[0], lambda[k]);
    let lost = select_unpredictable(second, l_a, l_b);
    let left = select_unpredictable(second, l_b, l_a) - lost;
    // Child 0 is `a, v[1], .., v[k - 1], z`, child 1 is `v[1], .., v[k - 1], b, z`.
    let mut next = *lambda;
    for i in 0..k {
        let in_first = if i == 0 { left } else { lambda[i] };
        let in_second = if i == k - 1 { left } else { lambda[i + 1] };
        next[i] = select_unpredictable(second, in_second, in_first);
    }
    next[k] = 2.0 * lost;
    next
}

/// Whether the children of a node with tag `k` may have been put into another order when they were made: in the first
/// cycle, if they have more than one edge to choose from.
#[inline(always)]
pub(super) fn is_reordered<const N: usize>(k: usize, level: u16) -> bool {
    k > 2 && (level as usize) + 1 < N - 1
}

/// The barycentric coordinates in a child of the point with coordinates `lambda` in its parent.
#[inline]
pub(crate) fn child_coordinates<const N: usize>(
    parent: &Node<N>,
    child: &Node<N>,
    second: bool,
    lambda: &[f64; N],
) -> [f64; N] {
    // A match on the tag would be a jump that is hard to predict, and so would be copies of varying length.
    let k = parent.tag();
    let mut made = *lambda;
    for tag in 1..N {
        if tag == k {
            made = halve(lambda, tag, second);
        }
    }
    if is_reordered::<N>(k, parent.level()) { reorder(parent, child, second, &made) } else { made }
}

/// Coordinates in the order in which bisection makes a child, put into the order that the child was given.
fn reorder<const N: usize>(parent: &Node<N>, child: &Node<N>, second: bool, lambda: &[f64; N]) -> [f64; N] {
    let order = made_order(parent, child, second);
    std::array::from_fn(|i| lambda[order[i]])
}

/// For each vertex of a child, its place in the order in which bisection makes the child.
pub(super) fn made_order<const N: usize>(parent: &Node<N>, child: &Node<N>, second: bool) -> [usize; N] {
    let k = parent.tag();
    let mut made = parent.v;
    if second {
        made.copy_within(1..=k, 0);
    }
    // Whatever vertex is not the parent's is the midpoint.
    made[k] = NONE;
    std::array::from_fn(|i| made.iter().position(|&v| v == child.v[i]).unwrap_or(k))
}
