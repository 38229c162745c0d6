//! Which start cells a point or a segment may be in.

use super::Owner;
use crate::{
    SimplexMesh,
    bounds::{BoundingTree, Bounds},
    geometry::{self, dot, subtract},
};

/// Boxes of cells are grown by this part of their extent, so that rounding cannot lose a touching cell.
const MARGIN: f64 = 1e-9;

/// The start cells in a search tree, made when it is first asked. Made of reference positions, which never change.
#[derive(Clone, Debug)]
pub(crate) struct StartIndex<const D: usize, const N: usize> {
    tree: BoundingTree<D>,
    /// In the order of the tree, so that what is looked at together lies together.
    cells: Vec<StartCell<D, N>>,
}

/// The map from points to barycentric coordinates in a start cell.
#[derive(Clone, Copy, Debug)]
struct StartCell<const D: usize, const N: usize> {
    /// Corner 0, then the gradients of the coordinates 1, 2, ...
    rows: [[f64; D]; N],
    slot: u32,
}

impl<const D: usize, const N: usize> StartCell<D, N> {
    /// As [`geometry::barycentric`], bit for bit.
    #[inline]
    fn barycentric(&self, p: &[f64; D]) -> [f64; N] {
        let d = subtract(p, &self.rows[0]);
        let mut lambda: [f64; N] = std::array::from_fn(|i| if i == 0 { 0.0 } else { dot(&self.rows[i], &d) });
        lambda[0] = 1.0 - lambda[1..].iter().sum::<f64>();
        lambda
    }
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// The search tree over the start cells.
    #[inline]
    fn start_index(&self) -> &StartIndex<D, N> {
        self.start_index.get_or_init(|| StartIndex::new(self))
    }

    /// The start cell that owns `p` and the coordinates there: the first that contains it, or else the one it misses by
    /// the least within the slack.
    pub(super) fn locate_start(&self, p: &[f64; D]) -> Option<(u32, [f64; N])> {
        let index = self.start_index();
        let mut best = Owner::default();
        index.tree.visit_at(p, |range| {
            for cell in &index.cells[range] {
                let lambda = cell.barycentric(p);
                best.offer(
                    cell.slot,
                    lambda,
                    super::SLACK,
                    || self.reference_corners(&self.nodes[cell.slot as usize].v),
                    p,
                );
            }
        });
        best.take()
    }

    /// Calls `visit` with every start cell whose reference position may be within `reach` of the closed segment from `a`
    /// to `b`, in no order to rely on.
    pub(crate) fn visit_start_cells(&self, a: &[f64; D], b: &[f64; D], reach: f64, mut visit: impl FnMut(u32)) {
        let index = self.start_index();
        index.tree.visit(a, b, reach, |range| index.cells[range].iter().for_each(|cell| visit(cell.slot)));
    }
}

impl<const D: usize, const N: usize> StartIndex<D, N> {
    fn new(mesh: &SimplexMesh<D, N>) -> Self {
        let corners = |slot: u32| mesh.reference_corners(&mesh.nodes[slot as usize].v);
        let boxes: Vec<Bounds<D>> = (0..mesh.n_macros as u32).map(|slot| Bounds::of(&corners(slot), MARGIN)).collect();
        let (tree, order) = BoundingTree::new(&boxes);
        let cell = |slot: u32| {
            let corners = corners(slot);
            // Start cells are not flat; one that rounding flattens all the same contains nothing.
            let mut rows = geometry::gradients(&corners).unwrap_or([[f64::NAN; D]; N]);
            rows[0] = corners[0];
            StartCell { rows, slot }
        };
        Self { tree, cells: order.into_iter().map(cell).collect() }
    }

    /// The memory that the index takes: entries times size.
    pub(crate) fn bytes(&self) -> usize {
        self.tree.bytes() + size_of_val(&self.cells[..])
    }
}
