//! Walking from cell to cell towards a point, and following a point from one step to the next.
//!
//! A *visibility walk* leaves a cell through a facet that has the point on its other side. Where several do, it takes the
//! one of the most negative barycentric coordinate. Such a walk can go round in circles in meshes that are not Delaunay;
//! after as many steps as a straight way would need, the choice among the facets is made by a fixed sequence of
//! pseudo-random numbers, as in a stochastic walk, which ends; and there is a last step.
//!
//! Source: Devillers, Pion & Teillaud, *Walking in a triangulation*, Int. J. Found. Comput. Sci. 13 (2002).

use super::{Configuration, Location, Owner, Positions, SLACK, configuration::barycentric, is_finite};
use crate::{CellId, SimplexMesh, geometry::longest_edge2, node::NONE, search::touch_tolerance};

/// Where a walk ended.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Walk<const N: usize> {
    /// At the point: in the cell of smallest id of those that contain it.
    Found(Location<N>),
    /// At the boundary: the point is beyond a facet without neighbour. In a mesh that is not convex it may be inside
    /// all the same.
    Left {
        /// The last cell.
        cell: CellId,
        /// Local index of the vertex opposite the facet.
        facet: usize,
    },
    /// Nowhere: the point is not finite, there is no cell to start from, a cell on the way is flat, or cells turned
    /// inside out led it round in circles.
    Lost,
}

impl<const D: usize, const N: usize, P: Positions<D> + ?Sized> Configuration<'_, D, N, P> {
    /// Walks from a cell to the point `p`. A start that was bisected stands for a cell within it.
    ///
    /// Closed, as [`SimplexMesh::locate`]; of the cells that contain a point on a common face, the one of smallest id is
    /// found. Costs some ten nanoseconds per cell on the way. Never more than a bounded number of steps.
    pub fn walk(&self, start: CellId, p: [f64; D]) -> Walk<N> {
        let Some(mut slot) = self.mesh.live_below(start) else { return Walk::Lost };
        if !is_finite(&p) {
            return Walk::Lost;
        }
        // The straight way through a mesh of cells of one size has some N n^(1/D) cells.
        let straight = 64 + 8 * N * (self.mesh.n_cells() as f64).powf(1.0 / (N - 1) as f64) as usize;
        let mut previous = NONE;
        for step in 0..4 * straight {
            let Some(lambda) = barycentric(&self.corners(CellId(slot)), &p) else { return Walk::Lost };
            let slack = self.mesh.slack(slot);
            let worst = (0..N).min_by(|&i, &j| lambda[i].total_cmp(&lambda[j])).unwrap_or(0);
            if lambda[worst] >= -slack {
                return self.owner_around(slot, lambda, &p).map_or(Walk::Lost, Walk::Found);
            }
            let first = if step < straight { worst } else { scatter(step) % N };
            match self.way_on(slot, &lambda, first, previous) {
                Some(next) => (previous, slot) = (slot, next),
                None => return Walk::Left { cell: CellId(slot), facet: worst },
            }
        }
        Walk::Lost
    }

    /// The neighbour across the first facet, from the `first` on, that has the point on its other side; back to the
    /// previous cell only if there is no other.
    fn way_on(&self, slot: u32, lambda: &[f64; N], first: usize, previous: u32) -> Option<u32> {
        let mut back = None;
        for facet in (0..N).map(|i| (first + i) % N).filter(|&facet| lambda[facet] < 0.0) {
            let Some(neighbor) = self.mesh.neighbor(CellId(slot), facet) else { continue };
            if neighbor.0 != previous {
                return Some(neighbor.0);
            }
            back = Some(neighbor.0);
        }
        back
    }

    /// The owner of a point, given a cell that it is in and its coordinates there: of the cells around the face that it
    /// is on, the one of smallest id.
    fn owner_around(&self, slot: u32, lambda: [f64; N], p: &[f64; D]) -> Option<Location<N>> {
        let slack = self.mesh.slack(slot);
        if N == D + 1 && lambda.iter().all(|&l| l > slack) {
            return Some(Location { cell: CellId(slot), barycentric: lambda });
        }
        let mut best = Owner::default();
        let mut around = vec![slot];
        let mut next = 0;
        while let Some(&slot) = around.get(next) {
            next += 1;
            let corners = self.corners(CellId(slot));
            let slack = self.mesh.slack(slot);
            let Some(lambda) = barycentric(&corners, p) else { continue };
            if lambda.iter().any(|&l| l < -slack) {
                continue;
            }
            best.offer(slot, lambda, slack, || corners, p);
            for facet in (0..N).filter(|&facet| lambda[facet] <= slack) {
                if let Some(neighbor) = self.mesh.neighbor(CellId(slot), facet)
                    && !around.contains(&neighbor.0)
                {
                    around.push(neighbor.0);
                }
            }
        }
        best.location()
    }
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// As [`locate`](Self::locate), for a point that is near a cell, live or bisected: that of an earlier step, say.
    ///
    /// Climbs the bisection forest from the cell to the first ancestor that contains the point, and descends; in a mesh
    /// with moved vertices, walks. Falls back to [`locate`](Self::locate) where that leads out of the start cell, or to
    /// a face of several cells, so that the owner is the same.
    pub fn locate_near(&self, near: CellId, p: [f64; D]) -> Option<Location<N>> {
        if near.index() >= self.nodes.len() || !is_finite(&p) {
            return self.locate(p);
        }
        let found = if self.is_moved() {
            match self.at_rest().walk(near, p) {
                Walk::Found(location) => Some(location),
                _ => None,
            }
        } else {
            self.climb_and_descend(near.0, &p)
        };
        found.or_else(|| self.locate(p))
    }

    /// The leaf that has `p` in its interior, by way of an ancestor of `slot`; `None` if there is none, or if `p` is
    /// nearer to a face than rounding can tell.
    fn climb_and_descend(&self, slot: u32, p: &[f64; D]) -> Option<Location<N>> {
        if N < D + 1 {
            return None;
        }
        let corners = self.corners_of(&self.nodes[slot as usize].v);
        let mut at = (slot, barycentric(&corners, p)?);
        while at.1.iter().any(|&l| l < 0.0) {
            at = self.climb(at.0, &at.1)?;
        }
        let (slot, barycentric) = self.descend(at.0, at.1);
        let size2 = longest_edge2(&self.corners_of(&self.nodes[slot as usize].v));
        let magnitude = p.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let doubt =
            touch_tolerance::<N>(self.nodes[slot as usize].level()) + 64.0 * f64::EPSILON * magnitude / size2.sqrt();
        barycentric.iter().all(|&l| l > doubt).then_some(Location { cell: CellId(slot), barycentric })
    }

    /// How far outside a cell, in its barycentric coordinates, a point still counts as inside.
    #[inline]
    pub(super) fn slack(&self, slot: u32) -> f64 {
        SLACK.max(touch_tolerance::<N>(self.nodes[slot as usize].level()))
    }

    /// A live cell within a cell, which may be that cell, or near it if it was remeshed; `None` if there is no such slot
    /// or nothing in it.
    fn live_below(&self, cell: CellId) -> Option<u32> {
        let (mut slot, mut node) = (cell.0, self.nodes.get(cell.index())?);
        while node.is_inner() {
            slot = node.child();
            node = &self.nodes[slot as usize];
        }
        if node.is_covered() {
            // Splits leave the vertices of what they cover alive.
            slot = self.vertex_leaf[node.v[0] as usize];
            node = self.nodes.get(slot as usize)?;
        }
        node.is_leaf().then_some(slot)
    }
}

/// A pseudo-random number for each step, the same ones for all walks (SplitMix64).
fn scatter(step: usize) -> usize {
    let z = (step as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (z >> 33) as usize
}
