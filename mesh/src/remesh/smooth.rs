//! Improvement of the vertices near the tip.
//!
//! The operations of the paper leave flat cells beside the shaft, which nothing improves once the tip has gone on. So,
//! after each operation, the worst of the cells that it changed are taken in turn, and their vertices moved, one by one,
//! to where the cells around each are [best together](super::descent):
//!
//! - inside, anywhere;
//! - on the boundary, along the planes of its facets, which keeps the boundary's shape: within flat patches and along
//!   straight creases;
//! - between other nodes of the needle, along the needle; the entry and the tip stay.
//!
//! They are put back with the others when the needle is withdrawn.

use super::{
    Remesher,
    candidate::near,
    commit::{corner, origin_at},
    needle::Needle,
    walk::locate_from,
};
use crate::{SimplexMesh, geometry::subtract};

/// How often the vertices are gone through.
const PASSES: usize = 2;
/// A move must make the cells together less bad by this part.
const GAIN: f64 = 0.01;

impl<const D: usize, const N: usize> Remesher<D, N> {
    /// Improves vertices of the cells around what the running substep moved or made.
    pub(super) fn smooth(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize) {
        let mut moved = true;
        for _ in 0..PASSES {
            moved = moved && self.smooth_once(mesh, k);
        }
    }

    /// Whether a vertex was moved.
    fn smooth_once(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize) -> bool {
        let settings = self.settings;
        let mut cells = std::mem::take(&mut self.worst);
        let mut tried = std::mem::take(&mut self.tried);
        self.cells_around_changes(mesh);
        cells.clear();
        cells.extend(self.around.iter().map(|&slot| (near(mesh, slot, &[]).shape, slot)));
        cells.retain(|&(shape, _)| shape < settings.good_quality * settings.good_quality);
        cells.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        tried.clear();
        let mut moved = false;
        'cells: for &(_, slot) in &cells {
            for v in mesh.nodes[slot as usize].v {
                if tried.len() >= settings.smoothed_vertices as usize {
                    break 'cells;
                }
                if !tried.contains(&v) && self.may_move(k, v) {
                    tried.push(v);
                    moved |= self.improve(mesh, k, v);
                }
            }
        }
        self.worst = cells;
        self.tried = tried;
        moved
    }

    /// Whether a vertex is neither a node of another needle nor moved by it, nor the entry or the tip of its own.
    fn may_move(&self, k: usize, v: u32) -> bool {
        let nodes = &self.needles[k].nodes;
        let is_end = nodes.first() == Some(&v) || nodes.last() == Some(&v);
        let holds = |(l, needle): (usize, &Needle<D, N>)| l != k && (needle.nodes.contains(&v) || needle.moved(v));
        !is_end && !self.needles.iter().enumerate().any(holds)
    }

    /// Moves a vertex to where the cells around it are best together, if that gains enough; whether it did.
    fn improve(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize, v: u32) -> bool {
        let Some((star, freedom)) = self.search.star_around(mesh, &self.needles, v) else { return false };
        let nodes = &self.needles[k].nodes;
        let stay = star.badness(&[0.0; D]);
        let (d, best) = match nodes.iter().position(|&node| node == v) {
            None => star.descend(&freedom),
            Some(at) if freedom.is_full() => {
                let way = |to: u32| subtract(&mesh.points[to as usize], &mesh.points[v as usize]);
                let back = star.best_slide(&way(nodes[at - 1]), stay).unwrap_or(([0.0; D], stay));
                star.best_slide(&way(nodes[at + 1]), back.1).unwrap_or(back)
            }
            Some(_) => return false,
        };
        if best.is_nan() || best > stay * (1.0 - GAIN) {
            return false;
        }
        let to = std::array::from_fn(|i| mesh.points[v as usize][i] + d[i]);
        let place = locate_from(mesh, mesh.vertex_leaf[v as usize], &to).unwrap_or_else(|| corner(mesh, v));
        self.record.birth(v, origin_at(mesh, &place));
        self.record.end_group();
        self.move_vertex(mesh, k, v, to);
        true
    }
}
