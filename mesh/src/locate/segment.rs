//! The cells that a segment runs through, in order.

use super::is_finite;
use crate::{
    CellId, SimplexMesh,
    geometry::distance2,
    search::{Touched, clip, interval, touch_tolerance},
    start::coordinate_limit,
};

/// A cell that a segment from `a` to `b` touches: from `a + from (b - a)` to `a + to (b - a)`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Crossing {
    /// The live cell.
    pub cell: CellId,
    /// Parameter of the entry, `0..=1`.
    pub from: f64,
    /// Parameter of the exit, `from..=1`.
    pub to: f64,
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// Overwrites `out` with the live cells that the closed segment from `a` to `b` (in rest coordinates) touches, each
    /// once: by entry, then exit, then cell.
    ///
    /// Touching is that of [`refine_along`](Self::refine_along): closed, up to 1e-12 of a start cell. So a segment along
    /// an edge lists all cells around the edge, one through a vertex all cells around it; intervals of cells that follow
    /// each other overlap by about so much, and leave no gap. A segment without length touches from 0 to 1. Nothing is
    /// listed for ends that are not finite, or larger than coordinates of a mesh may be.
    ///
    /// The cost is that of finding the start cells, plus a step for each touched node of the forest, plus a sort.
    pub fn leaves_along(&self, a: [f64; D], b: [f64; D], out: &mut Vec<Crossing>) {
        out.clear();
        if !is_segment(&a, &b) {
            return;
        }
        let feature = [a, b];
        let (mut starts, mut stack) = (Vec::new(), Vec::new());
        self.visit_start_cells(&a, &b, self.farthest_move, |slot| starts.push(slot));
        for start in starts {
            let corners = self.reference_corners(&self.nodes[start as usize].v);
            let Some((first, last, ends)) = clip(&corners, &feature, self.touch_of_start(&corners)) else { continue };
            // The descent carries the ends of the part within the start cell.
            let parameter = |t: f64| first + t * (last - first);
            stack.push(Touched { slot: start, ends });
            while let Some(Touched { slot, ends }) = stack.pop() {
                let node = &self.nodes[slot as usize];
                if node.is_inner() {
                    self.push_touched(slot, &ends, &mut stack);
                    continue;
                }
                if node.is_covered() {
                    continue;
                }
                let tolerance = touch_tolerance::<N>(node.level());
                let found = if self.is_moved() {
                    clip(&self.corners_of(&node.v), &feature, tolerance).map(|(from, to, _)| (from, to))
                } else {
                    interval(&ends[0], &ends[1], tolerance).map(|(from, to)| (parameter(from), parameter(to)))
                };
                out.extend(found.map(|(from, to)| Crossing { cell: CellId(slot), from, to }));
            }
        }
        for slot in self.overlay_cells() {
            let node = &self.nodes[slot as usize];
            let found = clip(&self.corners_of(&node.v), &feature, touch_tolerance::<N>(node.level()));
            out.extend(found.map(|(from, to, _)| Crossing { cell: CellId(slot), from, to }));
        }
        put_in_order(out);
    }
}

/// Whether the ends of a segment are such that a mesh can be near.
pub(super) fn is_segment<const D: usize>(a: &[f64; D], b: &[f64; D]) -> bool {
    let limit = coordinate_limit::<D>();
    is_finite(a) && is_finite(b) && a.iter().chain(b).all(|x| x.abs() <= limit) && distance2(a, b).is_finite()
}

/// By entry, then exit, then cell.
pub(super) fn put_in_order(crossings: &mut [Crossing]) {
    let order = |c: &Crossing, d: &Crossing| c.from.total_cmp(&d.from).then(c.to.total_cmp(&d.to));
    crossings.sort_unstable_by(|c, d| order(c, d).then(c.cell.cmp(&d.cell)));
}
