//! Where each vertex may go: anywhere, along faces of the box, along surfaces, or nowhere.

use super::adjacency::{Complex, FACETS, NONE, Stars};
use crate::generate::implicit::Implicit;
use crate::geometry::distance2;

/// Part of the size of the box within which a vertex lies on a face.
const ON_FACE: f64 = 1e-12;
/// Part of the shortest edge within which a vertex of a border lies on the surface.
const ON_SURFACE: f64 = 1e-3;

/// What one vertex may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Freedom {
    /// Axes along which it may move.
    pub free: [bool; 3],
    /// Solids in whose surface it stays; `NONE` for none.
    pub solids: [u32; 2],
    stays: bool,
}

impl Freedom {
    const ALL: Self = Self { free: [true; 3], solids: [NONE; 2], stays: false };

    /// The solids in whose surface it lies.
    pub fn surfaces(&self) -> impl Iterator<Item = u32> {
        self.solids.into_iter().filter(|&s| s != NONE)
    }

    /// Whether there is anywhere to go.
    pub fn moves(&self) -> bool {
        !self.stays && self.surfaces().count() < self.free.iter().filter(|free| **free).count()
    }

    fn keep_to(&mut self, solid: u32) {
        if self.solids.contains(&solid) {
            return;
        }
        match self.solids.iter_mut().find(|s| **s == NONE) {
            Some(slot) => *slot = solid,
            // Three surfaces meet in a point.
            None => self.stays = true,
        }
    }
}

/// Freedoms of all vertices, and the number of those that lie off the surface of their border.
pub(super) struct Freedoms {
    pub of: Vec<Freedom>,
    pub astray: usize,
}

impl Freedoms {
    /// A vertex of a border between regions `i < k` keeps to the surface of solid `i` if this conforms and the vertex is
    /// there already; otherwise it stays. So does a vertex of the mesh's own boundary that is on no face of the box, as to
    /// the solid of its region.
    pub fn new(
        points: &[[f64; 3]],
        complex: &Complex,
        stars: &Stars,
        solids: &[Box<dyn Implicit>],
        conforming: impl Fn(u32) -> bool,
        [low, high]: &[[f64; 3]; 2],
    ) -> Self {
        let mut of = vec![Freedom::ALL; points.len()];
        for (freedom, p) in of.iter_mut().zip(points) {
            for k in 0..3 {
                let near = ON_FACE * (high[k] - low[k]);
                freedom.free[k] = (p[k] - low[k]).abs() > near && (p[k] - high[k]).abs() > near;
            }
        }
        for t in (0..complex.cells.len() as u32).filter(|&t| complex.lives(t)) {
            for (i, &other) in complex.neighbours[t as usize].iter().enumerate() {
                let facet = FACETS[i].map(|j| complex.cells[t as usize][j]);
                let solid = match other {
                    NONE if shares_face(points, facet, low, high) => continue,
                    NONE => complex.regions[t as usize],
                    other => complex.regions[t as usize].min(complex.regions[other as usize]),
                };
                if other != NONE && complex.regions[t as usize] == complex.regions[other as usize] {
                    continue;
                }
                for v in facet {
                    if (solid as usize) < solids.len() && conforming(solid) {
                        of[v as usize].keep_to(solid);
                    } else {
                        of[v as usize].stays = true;
                    }
                }
            }
        }
        let mut astray = 0;
        for (v, freedom) in of.iter_mut().enumerate() {
            let near = ON_SURFACE * shortest_edge(points, v as u32, stars);
            let on = |s: u32| solids[s as usize].distance(&points[v]).abs() <= near;
            if !freedom.surfaces().all(on) {
                freedom.stays = true;
                astray += 1;
            }
        }
        Self { of, astray }
    }
}

/// Whether the vertices of a facet lie on one face of the box.
fn shares_face(points: &[[f64; 3]], facet: [u32; 3], low: &[f64; 3], high: &[f64; 3]) -> bool {
    (0..3).any(|k| {
        let near = ON_FACE * (high[k] - low[k]);
        [low[k], high[k]].iter().any(|side| facet.iter().all(|&v| (points[v as usize][k] - side).abs() <= near))
    })
}

/// The shortest edge at a vertex.
pub(super) fn shortest_edge(points: &[[f64; 3]], v: u32, stars: &Stars) -> f64 {
    let others = stars.of(v).iter().flatten();
    others.map(|&w| distance2(&points[v as usize], &points[w as usize])).fold(f64::INFINITY, f64::min).sqrt()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A vertex on surfaces that may move along some axes.
    pub fn bound(solids: [u32; 2], free: [bool; 3]) -> Freedom {
        Freedom { free, solids, stays: false }
    }

    #[test]
    fn a_vertex_moves_if_it_has_more_axes_than_surfaces() {
        assert!(Freedom::ALL.moves() && bound([4, 5], [true; 3]).moves());
        assert!(!bound([4, 5], [true, false, true]).moves() && bound([4, NONE], [true, false, true]).moves());
        assert!(!bound([NONE; 2], [false; 3]).moves() && bound([NONE; 2], [false, false, true]).moves());
        let mut corner = bound([4, 5], [true; 3]);
        corner.keep_to(5);
        assert!(corner.moves());
        corner.keep_to(6);
        assert!(!corner.moves());
    }
}
