//! Improvement of the vertices near the tip that are no needle nodes.
//!
//! The operations of the paper leave flat cells beside the shaft, which nothing improves once the tip has gone on. So,
//! after each operation, the worst of the cells that it changed are taken in turn, and their vertices moved, one by one,
//! to where the worst cell around each is best. They are put back with the others when the needle is withdrawn.

use super::{
    Remesher,
    candidate::near,
    commit::{corner, origin_at},
    walk::locate_from,
};
use crate::SimplexMesh;

/// Searches along lines for each vertex.
const ROUNDS: usize = 5;
/// A move must improve the worst shape by this part.
const GAIN: f64 = 0.02;

impl<const D: usize, const N: usize> Remesher<D, N> {
    /// Improves vertices of the cells around what the running substep moved or made.
    pub(super) fn smooth(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize) {
        let settings = self.settings;
        let mut cells = std::mem::take(&mut self.worst);
        let mut tried = std::mem::take(&mut self.tried);
        self.cells_around_changes(mesh);
        cells.clear();
        cells.extend(self.around.iter().map(|&slot| (near(mesh, slot, &[]).shape, slot)));
        cells.retain(|&(shape, _)| shape < settings.good_quality * settings.good_quality);
        cells.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        tried.clear();
        'cells: for &(_, slot) in &cells {
            for v in mesh.nodes[slot as usize].v {
                if tried.len() >= settings.smoothed_vertices as usize {
                    break 'cells;
                }
                if !tried.contains(&v) && self.may_move(k, v) {
                    tried.push(v);
                    self.improve(mesh, k, v);
                }
            }
        }
        self.worst = cells;
        self.tried = tried;
    }

    /// Whether a vertex is neither a node of a needle nor one that another needle moved.
    fn may_move(&self, k: usize, v: u32) -> bool {
        self.needles.iter().enumerate().all(|(l, needle)| !needle.nodes.contains(&v) && (l == k || !needle.moved(v)))
    }

    /// Moves a vertex inside to where the worst cell around it is best, if that gains enough.
    fn improve(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize, v: u32) {
        let Some((star, reach)) = self.search.star_around(mesh, &self.needles, v) else { return };
        let stay = star.least(&[0.0; D]);
        let (d, best) = star.best_anywhere(reach, ROUNDS);
        if best <= stay * (1.0 + GAIN) || best.is_nan() {
            return;
        }
        let to = std::array::from_fn(|i| mesh.points[v as usize][i] + d[i]);
        let place = locate_from(mesh, mesh.vertex_leaf[v as usize], &to).unwrap_or_else(|| corner(mesh, v));
        self.record.birth(v, origin_at(mesh, &place));
        self.record.end_group();
        self.move_vertex(mesh, k, v, to);
    }
}
