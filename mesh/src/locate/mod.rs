//! Location: which cell contains a point, which cells a segment runs through, in rest and in deformed positions.
//!
//! | file | what it does |
//! |---|---|
//! | `start_index` | the start cell of a point |
//! | `descent` | coordinates down and up the bisection forest |
//! | `locator` | many points in one mesh |
//! | `segment` | the cells along a segment, in order |
//! | `configuration` | a mesh with its vertices at other positions |
//! | `walk` | from cell to cell; a point followed between steps |
//! | `spatial_index` | a search tree that follows deformation and refinement |

mod configuration;
mod descent;
mod locator;
mod segment;
mod spatial_index;
mod start_index;
mod walk;

pub use configuration::{Configuration, Displaced, Positions};
pub(crate) use descent::child_coordinates;
pub use locator::Locator;
pub use segment::Crossing;
pub use spatial_index::SpatialIndex;
pub(crate) use start_index::StartIndex;
pub use walk::Walk;

use crate::{
    CellId, SimplexMesh,
    geometry::{combine, distance2, longest_edge2},
    search::Touched,
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

/// Why positions are not those of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LocateError {
    /// Vertices without position.
    #[error("{found} positions for {expected} vertices")]
    Positions {
        /// Positions given.
        found: usize,
        /// Vertices of the mesh.
        expected: usize,
    },
    /// A position that is not finite.
    #[error("coordinate {axis} of vertex {vertex} is {value}: it must be finite")]
    Coordinate {
        /// The vertex.
        vertex: u32,
        /// Axis, from zero.
        axis: usize,
        /// The value.
        value: f64,
    },
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// The live cell that contains `p` (in rest coordinates); `None` outside the mesh, and if `p` is not finite.
    ///
    /// Closed: a point on the boundary, or outside by no more than 1e-10 of a start cell, is found. A point on a common
    /// face has one owner: the start cell of smallest id, below it the half whose end of the bisected edge has the smaller
    /// id. Costs the search among the start cells plus one subtraction per level.
    ///
    /// In a mesh with moved vertices the owner is the cell of smallest id. It is found by a walk from where the point would
    /// be had none been moved; where the walk does not arrive, by looking at all cells within the farthest move.
    pub fn locate(&self, p: [f64; D]) -> Option<Location<N>> {
        if !is_finite(&p) {
            return None;
        }
        if self.is_moved() {
            return self.locate_among_moved(&p);
        }
        let (root, lambda) = self.locate_start(&p)?;
        let (slot, barycentric) = self.descend(root, lambda);
        Some(Location { cell: CellId(slot), barycentric })
    }

    /// Whether vertices were moved or cells remeshed, so that halves need not fill a node any more.
    #[inline]
    pub(crate) fn is_moved(&self) -> bool {
        !self.reference.is_empty() || self.overlay.is_active()
    }

    /// The leaf that owns `p` in a mesh with moved vertices.
    fn locate_among_moved(&self, p: &[f64; D]) -> Option<Location<N>> {
        // Where it would be had no vertex been moved is hardly ever far away.
        if let Some((root, lambda)) = self.locate_start(p)
            && let Walk::Found(location) = self.at_rest().walk(CellId(self.descend(root, lambda).0), *p)
        {
            return Some(location);
        }
        let (mut queue, _) = self.macros_touching(&[*p]);
        let mut best = Owner::default();
        while let Some(Touched { slot, ends }) = queue.pop() {
            let node = &self.nodes[slot as usize];
            if node.is_inner() {
                self.push_touched(slot, &ends, &mut queue);
            } else if node.is_leaf() {
                self.offer(&mut best, slot, p);
            }
        }
        // These are in no start cell's tree.
        self.overlay_cells().for_each(|slot| self.offer(&mut best, slot, p));
        best.location()
    }

    /// Considers a live cell as owner of a point.
    fn offer(&self, best: &mut Owner<N>, slot: u32, p: &[f64; D]) {
        let corners = self.corners_of(&self.nodes[slot as usize].v);
        if let Some(lambda) = configuration::barycentric(&corners, p) {
            best.offer(slot, lambda, self.slack(slot), || corners, p);
        }
    }
}

/// The best of the cells offered as owners of a point: how far inside (0 for all that contain it, negative for those that
/// miss it within their slack), the slot, the coordinates.
struct Owner<const N: usize>(Option<(f64, u32, [f64; N])>);

impl<const N: usize> Default for Owner<N> {
    fn default() -> Self {
        Self(None)
    }
}

impl<const N: usize> Owner<N> {
    /// Considers a cell in which `p` has the coordinates `lambda`.
    #[inline]
    fn offer<const D: usize>(
        &mut self,
        slot: u32,
        lambda: [f64; N],
        slack: f64,
        corners: impl FnOnce() -> [[f64; D]; N],
        p: &[f64; D],
    ) {
        let mut inside = lambda.iter().fold(0.0_f64, |least, &l| least.min(l));
        // A coordinate that is not a number fails, which `min` would pass over.
        if !(inside >= -slack && lambda[0].is_finite()) {
            return;
        }
        if N < D + 1 {
            // Of a surface or a rod, how far it is away counts too.
            let corners = corners();
            let away2 = distance2(p, &combine(&corners, &lambda)) / longest_edge2(&corners);
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

    fn location(self) -> Option<Location<N>> {
        self.take().map(|(slot, barycentric)| Location { cell: CellId(slot), barycentric })
    }
}

#[inline]
fn is_finite<const D: usize>(p: &[f64; D]) -> bool {
    p.iter().all(|x| x.is_finite())
}
