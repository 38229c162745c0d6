//! From cubes to tetrahedra: the graded body-centred cubic lattice.
//!
//! Every cube has a vertex at its centre. Across each of its square faces:
//!
//! - a cube of the same size: for each edge of the face, the tetrahedron of the edge and both centres, or two where the
//!   edge has a vertex in its middle;
//! - a larger cube: for either half of the square, one tetrahedron to each centre. The halves meet in the diagonal from the
//!   middle of the larger face, which is a vertex, to its corner;
//! - the boundary of the box: for each edge of the face, the tetrahedron of the edge, the centre, and the middle of the
//!   face: half of that of two equal cubes.
//!
//! Source: Labelle & Shewchuk, *Isosurface stuffing*, ACM Trans. Graph. 26(3) (2007), section 3; the boundary is ours.

use super::complex::{Complex, Vertex};
use super::grid::{Grid, Site};
use super::octree::{Octant, Octree};
use std::collections::HashMap;

/// The tetrahedra of the cubes, without solids yet.
pub(super) fn lattice(grid: &Grid, octree: &Octree) -> Complex {
    let mut lattice = Lattice {
        grid,
        octree,
        ids: HashMap::with_capacity(2 * octree.n_leaves + 1),
        complex: Complex::with_capacity(2 * octree.n_leaves, super::grid::estimate(octree.n_leaves as f64) as usize),
    };
    let leaves = || octree.octants.iter().filter(|o| o.is_leaf());
    // All corners first: later, a vertex in the middle of an edge is the corner of a smaller cube.
    for leaf in leaves() {
        let side = lattice.side(leaf);
        for i in 0..8 {
            lattice.vertex(std::array::from_fn(|k| 2 * leaf.origin[k] as i32 + (i >> k & 1) * side));
        }
    }
    // Then the centres: of edges of one length the one with the greater id is bisected first, here that between centres.
    for leaf in leaves() {
        let centre = lattice.vertex(lattice.centre(leaf));
        lattice.complex.vertices[centre as usize].is_centre = true;
    }
    for leaf in leaves() {
        for axis in 0..3 {
            lattice.face(leaf, axis, -1);
            lattice.face(leaf, axis, 1);
        }
    }
    lattice.complex
}

struct Lattice<'a> {
    grid: &'a Grid,
    octree: &'a Octree,
    ids: HashMap<u64, u32>,
    complex: Complex,
}

impl Lattice<'_> {
    /// The edge of a cube in the unit of sites.
    fn side(&self, octant: &Octant) -> i32 {
        2 * self.octree.side(octant.level) as i32
    }

    fn centre(&self, octant: &Octant) -> Site {
        octant.origin.map(|x| 2 * x as i32 + self.octree.side(octant.level) as i32)
    }

    /// The vertex at a site, made if need be.
    fn vertex(&mut self, site: Site) -> u32 {
        let (grid, complex) = (self.grid, &mut self.complex);
        *self.ids.entry(key(site)).or_insert_with(|| {
            complex.add_vertex(
                grid.position(site),
                Vertex { site: Some(site), is_centre: false, faces: grid.faces(site), on: 0 },
            )
        })
    }

    fn existing(&self, site: Site) -> Option<u32> {
        self.ids.get(&key(site)).copied()
    }

    /// The tetrahedra across a face of a leaf, if they are this leaf's to make: of two equal cubes the lower one makes
    /// them, of two different ones the smaller.
    fn face(&mut self, leaf: &Octant, axis: usize, direction: i32) {
        let mut step = [0; 3];
        step[axis] = direction;
        let centre = self.centre(leaf);
        let Some(other) = self.octree.neighbour(leaf, step) else {
            let mut middle = centre;
            middle[axis] += direction * self.side(leaf) / 2;
            let middle = self.vertex(middle);
            return self.ring(leaf, axis, direction, middle);
        };
        let other = self.octree.octants[other];
        if other.level < leaf.level {
            self.step_of_size(leaf, axis, direction, &other);
        } else if other.is_leaf() && direction > 0 {
            let other = self.vertex(self.centre(&other));
            self.ring(leaf, axis, direction, other);
        }
    }

    /// The corners of a leaf's face in cyclic order.
    fn corners(&self, leaf: &Octant, axis: usize, direction: i32) -> [Site; 4] {
        let (centre, half) = (self.centre(leaf), self.side(leaf) / 2);
        [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(|[u, v]| {
            let mut corner = centre;
            corner[axis] += direction * half;
            corner[(axis + 1) % 3] += u * half;
            corner[(axis + 2) % 3] += v * half;
            corner
        })
    }

    /// One or two tetrahedra per edge of a face, between the leaf's centre and another vertex.
    fn ring(&mut self, leaf: &Octant, axis: usize, direction: i32, other: u32) {
        let corners = self.corners(leaf, axis, direction);
        let centre = self.vertex(self.centre(leaf));
        for i in 0..4 {
            let (p, q) = (corners[i], corners[(i + 1) % 4]);
            let (a, b) = (self.vertex(p), self.vertex(q));
            match self.existing(std::array::from_fn(|k| (p[k] + q[k]) / 2)) {
                Some(middle) => {
                    self.complex.add_oriented_cell([centre, other, a, middle]);
                    self.complex.add_oriented_cell([centre, other, middle, b]);
                }
                None => self.complex.add_oriented_cell([centre, other, a, b]),
            }
        }
    }

    /// The four tetrahedra between a leaf and a larger cube.
    fn step_of_size(&mut self, leaf: &Octant, axis: usize, direction: i32, larger: &Octant) {
        let corners = self.corners(leaf, axis, direction);
        let mut middle = self.centre(larger);
        middle[axis] -= direction * self.side(larger) / 2;
        let first = corners.iter().position(|c| *c == middle).expect("the middle of the larger face is a corner");
        let [from, left, to, right] = std::array::from_fn(|i| self.vertex(corners[(first + i) % 4]));
        for centre in [self.centre(leaf), self.centre(larger)] {
            let centre = self.vertex(centre);
            self.complex.add_oriented_cell([centre, from, left, to]);
            self.complex.add_oriented_cell([centre, from, to, right]);
        }
    }
}

/// A site in one number.
fn key(site: Site) -> u64 {
    site.iter().fold(0, |key, x| key << 21 | *x as u64)
}
