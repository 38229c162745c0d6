//! Descent of the bisection forest: which cell contains a point, which cells a feature touches.
//!
//! If `l` are the barycentric coordinates in a node with refinement edge `(a, b)` and midpoint `z`, then
//! `l_a a + l_b b = (l_a - l_b) a + 2 l_b z`. So the coordinates in the child with `a` are `l_a - l_b` at `a` and `2 l_b`
//! at `z`, and are not negative if `l_a >= l_b`: one subtraction per level, and no coordinates below the start mesh.

use crate::{
    CellId, SimplexMesh,
    complex::{NONE, Node},
    geometry::{barycentric, combine, distance2, longest_edge2},
    search::{Touched, touch_tolerance},
};

/// How far outside, in barycentric coordinates of a start cell, a point still counts as within the mesh.
const SLACK: f64 = 1e-10;

/// Where a point lies: a cell and its coordinates there.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Location<const N: usize> {
    /// The live cell.
    pub cell: CellId,
    /// Not negative, of sum one up to rounding; in the order of [`SimplexMesh::cell`].
    pub barycentric: [f64; N],
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// The live cell that contains `p` (in rest coordinates); `None` outside the mesh, and if `p` is not finite.
    ///
    /// Closed: a point on the boundary, or outside by no more than 1e-10 of a start cell, is found. A point on a common
    /// face has one owner: the start cell of smallest id, below it the half whose end of the bisected edge has the smaller
    /// id. Costs the search among the start cells plus one subtraction per level.
    ///
    /// In a mesh with moved vertices, the owner is the cell of smallest id, and all cells within the farthest move are
    /// looked at.
    pub fn locate(&self, p: [f64; D]) -> Option<Location<N>> {
        if !p.iter().all(|x| x.is_finite()) {
            return None;
        }
        if !self.reference.is_empty() {
            return self.locate_among_moved(&p);
        }
        let (root, lambda) = self.locate_macro(&p)?;
        Some(self.descend(root, lambda))
    }

    /// The start cell that owns `p`: the first that contains it, or else the one it misses by the least within the slack.
    fn locate_macro(&self, p: &[f64; D]) -> Option<(u32, [f64; N])> {
        let mut best = Owner(None);
        self.macro_tree.visit(p, p, 0.0, |cell| {
            best.offer(cell, &self.corners_of(&self.nodes[cell as usize].v), p, SLACK);
        });
        best.take()
    }

    /// The leaf that owns `p` in a mesh with moved vertices.
    fn locate_among_moved(&self, p: &[f64; D]) -> Option<Location<N>> {
        let (mut queue, _) = self.macros_touching(&[*p]);
        let mut best = Owner(None);
        while let Some(Touched { slot, ends }) = queue.pop() {
            let node = &self.nodes[slot as usize];
            if node.child == NONE {
                best.offer(slot, &self.corners_of(&node.v), p, SLACK.max(touch_tolerance::<N>(node.level)));
            } else {
                self.push_touched(slot, &ends, &mut queue);
            }
        }
        best.take().map(|(slot, barycentric)| Location { cell: CellId(slot), barycentric })
    }

    /// The leaf below a node that owns the point with the given coordinates, none negative.
    fn descend(&self, root: u32, lambda: [f64; N]) -> Location<N> {
        let (mut slot, mut lambda) = (root as usize, lambda);
        loop {
            let node = &self.nodes[slot];
            if node.child == NONE {
                return Location { cell: CellId(slot as u32), barycentric: lambda };
            }
            let k = node.tag as usize;
            let second = lambda[k] > lambda[0] || lambda[k] == lambda[0] && node.v[k] < node.v[0];
            slot = node.child as usize + usize::from(second);
            lambda = child_coordinates(node, &self.nodes[slot], second, &lambda);
        }
    }
}

/// The best of the cells offered as owners of a point: how far inside (0 for all that contain it, negative for those that
/// miss it within their slack), the slot, the coordinates.
struct Owner<const N: usize>(Option<(f64, u32, [f64; N])>);

impl<const N: usize> Owner<N> {
    /// Considers a cell given by its corners.
    fn offer<const D: usize>(&mut self, slot: u32, corners: &[[f64; D]; N], p: &[f64; D], slack: f64) {
        let Some(lambda) = barycentric(corners, p) else { return };
        let mut inside = lambda.iter().fold(0.0_f64, |least, &l| least.min(l));
        if N < D + 1 {
            // Of a surface or a rod, how far it is away counts too.
            let away2 = distance2(p, &combine(corners, &lambda)) / longest_edge2(corners);
            inside = inside.min(-away2.sqrt());
        }
        let beats = |&(best, first, _): &(f64, u32, _)| inside > best || inside == best && slot < first;
        if inside >= -slack && self.0.as_ref().is_none_or(beats) {
            self.0 = Some((inside, slot, lambda));
        }
    }

    /// The owner, with coordinates of the nearest point where the point is outside: interpolation stays convex.
    fn take(self) -> Option<(u32, [f64; N])> {
        let (_, slot, lambda) = self.0?;
        if lambda.iter().all(|&l| l >= 0.0) {
            return Some((slot, lambda));
        }
        let sum: f64 = lambda.iter().map(|l| l.max(0.0)).sum();
        Some((slot, lambda.map(|l| l.max(0.0) / sum)))
    }
}

/// The barycentric coordinates in a child of the point with coordinates `lambda` in its parent.
#[inline]
pub(crate) fn child_coordinates<const N: usize>(
    parent: &Node<N>,
    child: &Node<N>,
    second: bool,
    lambda: &[f64; N],
) -> [f64; N] {
    let k = parent.tag as usize;
    let (l_a, l_b) = (lambda[0], lambda[k]);
    let mut next = *lambda;
    if second {
        next.copy_within(1..=k, 0);
        next[k - 1] = l_b - l_a;
        next[k] = 2.0 * l_a;
    } else {
        next[0] = l_a - l_b;
        next[k] = 2.0 * l_b;
    }
    if (child.level as usize) < N - 1 { reorder(parent, child, second, &next) } else { next }
}

/// In the first cycle a child's vertices were put into another order when it was made.
#[cold]
fn reorder<const N: usize>(parent: &Node<N>, child: &Node<N>, second: bool, lambda: &[f64; N]) -> [f64; N] {
    // Whatever vertex is not the parent's is the midpoint.
    let midpoint = child.v.iter().copied().find(|v| !parent.v.contains(v)).unwrap_or(NONE);
    let made = parent.children(child.parent, midpoint)[usize::from(second)].v;
    let place = |v: u32| made.iter().position(|&w| w == v).unwrap_or(0);
    std::array::from_fn(|i| lambda[place(child.v[i])])
}
