//! The nearest point of a surface.

use super::ClosedSurface;
use super::triangle::{self, Feature};
use crate::geometry::distance2;

/// Halving makes no deeper tree of as many triangles as can be numbered.
const DEPTH: usize = 40;

/// A point of the surface.
pub(super) struct Nearest {
    pub point: [f64; 3],
    pub triangle: u32,
    pub feature: Feature,
}

impl ClosedSurface {
    /// The point of the surface nearest to `p`; `None` for a point that is not a number.
    pub(super) fn nearest(&self, p: &[f64; 3]) -> Option<Nearest> {
        let (mut best, mut found) = (f64::INFINITY, None);
        // Nodes still to be looked at, with their squared distances.
        let (mut stack, mut depth) = ([(0.0, 0_u32); DEPTH], 1);
        while depth > 0 {
            depth -= 1;
            let (distance, at) = stack[depth];
            let node = &self.tree.nodes[at as usize];
            if distance >= best {
                continue;
            }
            for t in node.first..node.first + node.count {
                let (point, feature) = triangle::nearest(p, &self.corners(t));
                let d2 = distance2(p, &point);
                if d2 < best {
                    best = d2;
                    found = Some(Nearest { point, triangle: t, feature });
                }
            }
            if node.count == 0 {
                let mut children = [at + 1, node.first].map(|c| (self.tree.nodes[c as usize].distance2(p), c));
                // The nearer one is taken first, from the end.
                if children[0].0 <= children[1].0 {
                    children.swap(0, 1);
                }
                stack[depth..depth + 2].copy_from_slice(&children);
                depth += 2;
            }
        }
        found
    }
}
