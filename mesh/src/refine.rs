//! Refinement to a target size: everywhere, around a point, along a segment.
//!
//! Only cells that the feature touches are looked at: a call that finds nothing to do costs about as much as locating the
//! feature.

use crate::{
    BisectError, MeshChange, SimplexMesh,
    geometry::{self, distance2, longest_edge2},
    node::Node,
    search::Touched,
    start::coordinate_limit,
};

/// A longest edge may exceed the target size by this part: sizes and edges are rounded.
const SIZE_SLACK: f64 = 1e-9;
/// A part of a segment along a common face is counted by every start cell there; hardly more than so many.
const SHARED_BY: f64 = 64.0;

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// Bisects until no longest edge exceeds `size` (up to a part of 1e-9); composes `change` as
    /// [`bisect`](Self::bisect) does.
    ///
    /// # Errors
    /// [`BisectError::Size`] unless `size` is positive and finite; [`BisectError::SlotLimit`] at once if so many cells
    /// would be needed; otherwise as [`bisect`](Self::bisect).
    pub fn refine_everywhere(&mut self, size: f64, change: &mut MeshChange) -> Result<(), BisectError> {
        check_size(size)?;
        // The regular simplex is the largest of its diameter.
        let largest = geometry::regular_measure(N - 1) * size.powi(N as i32 - 1);
        self.check_cells(0.9 * self.total_volume() / largest)?;
        let size2 = slack(size);
        self.record(change, |mesh, recorder| {
            loop {
                // Children come after their parents, except in slots that had been freed.
                let in_order = mesh.free_pairs.is_empty();
                let before = recorder.bisections;
                let mut slot = 0;
                while let Some(node) = mesh.nodes.get(slot) {
                    if node.is_leaf() && mesh.is_longer(node, size2) {
                        mesh.mark(slot as u32, recorder)?;
                    }
                    slot += 1;
                }
                if in_order || recorder.bisections == before {
                    return Ok(());
                }
            }
        })
    }

    /// Bisects until no cell that touches `point` (in rest coordinates) has an edge longer than `size` (up to a part of
    /// 1e-9); composes `change` as [`bisect`](Self::bisect) does.
    ///
    /// Touching is closed: all cells around a vertex, edge or facet that the point lies on, up to 1e-12 of a start cell,
    /// are refined. A point outside the mesh touches nothing, and nothing is done.
    ///
    /// # Errors
    /// [`BisectError::Size`] or [`BisectError::Point`] for arguments that are not finite or too large, otherwise as
    /// [`bisect`](Self::bisect).
    pub fn refine_around(&mut self, point: [f64; D], size: f64, change: &mut MeshChange) -> Result<(), BisectError> {
        check_size(size)?;
        check_point(&point)?;
        let (touched, _) = self.macros_touching(&[point]);
        self.refine_touched(&[point], touched, size, change)
    }

    /// As [`refine_around`](Self::refine_around), for the cells that touch the closed segment from `a` to `b`. Parts of
    /// the segment outside the mesh are ignored.
    ///
    /// # Errors
    /// As [`refine_around`](Self::refine_around), and [`BisectError::SlotLimit`] at once if the segment is too long for
    /// the size.
    pub fn refine_along(
        &mut self,
        a: [f64; D],
        b: [f64; D],
        size: f64,
        change: &mut MeshChange,
    ) -> Result<(), BisectError> {
        check_size(size)?;
        check_point(&a)?;
        check_point(&b)?;
        let (touched, length) = self.macros_touching(&[a, b]);
        self.check_cells(length / SHARED_BY / size)?;
        self.refine_touched(&[a, b], touched, size, change)
    }

    /// Whether the longest edge of a cell, squared, exceeds `size2`. The refinement edge is the likeliest to do so.
    #[inline]
    pub(crate) fn is_longer(&self, node: &Node<N>, size2: f64) -> bool {
        let [a, b] = [node.v[0], node.v[node.tag()]].map(|v| &self.points[v as usize]);
        distance2(a, b) > size2 || longest_edge2(&self.corners_of(&node.v)) > size2
    }

    /// Refuses at once what would need more cells than there may be.
    fn check_cells(&self, cells: f64) -> Result<(), BisectError> {
        if cells > self.slot_limit as f64 {
            return Err(BisectError::SlotLimit { needed: cells as usize, limit: self.slot_limit });
        }
        Ok(())
    }

    /// Bisects below the nodes given until every leaf that is touched is small enough.
    ///
    /// First come, first served: uniform refinement proceeds level by level, where hardly any closure is needed. The
    /// final mesh, as a set of simplices, does not depend on the order.
    fn refine_touched<const K: usize>(
        &mut self,
        feature: &[[f64; D]; K],
        mut queue: Vec<Touched<N, K>>,
        size: f64,
        change: &mut MeshChange,
    ) -> Result<(), BisectError> {
        let size2 = slack(size);
        self.record(change, |mesh, recorder| {
            let mut next = 0;
            while next < queue.len() {
                let Touched { slot, ends } = queue[next];
                next += 1;
                let node = &mesh.nodes[slot as usize];
                if !node.is_inner() {
                    if !mesh.is_longer(node, size2) || !mesh.really_touches(node, feature) {
                        continue;
                    }
                    mesh.mark(slot, recorder)?;
                }
                mesh.push_touched(slot, &ends, &mut queue);
            }
            Ok(())
        })
    }
}

/// The square of the longest edge that passes for `size`.
pub(crate) fn slack(size: f64) -> f64 {
    (size * (1.0 + SIZE_SLACK)).powi(2)
}

pub(crate) fn check_size(size: f64) -> Result<(), BisectError> {
    if size > 0.0 && size.is_finite() { Ok(()) } else { Err(BisectError::Size { size }) }
}

pub(crate) fn check_point<const D: usize>(point: &[f64; D]) -> Result<(), BisectError> {
    let limit = coordinate_limit::<D>();
    match point.iter().enumerate().find(|(_, x)| x.is_nan() || x.abs() > limit) {
        None => Ok(()),
        Some((axis, &value)) => Err(BisectError::Point { axis, value, limit }),
    }
}
