//! A forest of octrees over the roots of a grid.

use super::grid::Grid;

/// Steps to the cubes across the 6 faces and the 12 edges of a cube.
const NEIGHBOURS: [[i32; 3]; 18] = [
    [-1, 0, 0],
    [1, 0, 0],
    [0, -1, 0],
    [0, 1, 0],
    [0, 0, -1],
    [0, 0, 1],
    [-1, -1, 0],
    [-1, 1, 0],
    [1, -1, 0],
    [1, 1, 0],
    [-1, 0, -1],
    [-1, 0, 1],
    [1, 0, -1],
    [1, 0, 1],
    [0, -1, -1],
    [0, -1, 1],
    [0, 1, -1],
    [0, 1, 1],
];

/// A cube of the forest.
#[derive(Clone, Copy)]
pub(super) struct Octant {
    /// Lowest corner, in edges of the finest cubes.
    pub origin: [u32; 3],
    pub level: u8,
    /// The first of eight children in a row; 0 for a leaf, as no root is a child.
    child: u32,
}

impl Octant {
    pub fn is_leaf(&self) -> bool {
        self.child == 0
    }
}

/// Cubes by index: the roots, axis 0 first, then children in rows of eight.
pub(super) struct Octree {
    pub octants: Vec<Octant>,
    pub n_leaves: usize,
    roots: [u32; 3],
    depth: u8,
}

impl Octree {
    /// The roots of a grid.
    pub fn new(grid: &Grid) -> Self {
        let [nx, ny, nz] = grid.roots;
        let mut octants = Vec::with_capacity((nx * ny * nz) as usize);
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    octants.push(Octant { origin: [x, y, z].map(|i| i << grid.depth), level: 0, child: 0 });
                }
            }
        }
        Self { n_leaves: octants.len(), octants, roots: grid.roots, depth: grid.depth }
    }

    /// The edge of a cube, in edges of the finest cubes.
    pub fn side(&self, level: u8) -> u32 {
        1 << (self.depth - level)
    }

    /// Divides a leaf into eight.
    pub fn split(&mut self, leaf: usize) {
        let Octant { origin, level, child } = self.octants[leaf];
        debug_assert!(child == 0 && level < self.depth);
        self.octants[leaf].child = self.octants.len() as u32;
        let half = self.side(level + 1);
        for i in 0..8 {
            let origin = std::array::from_fn(|k| origin[k] + (i >> k & 1) * half);
            self.octants.push(Octant { origin, level: level + 1, child: 0 });
        }
        self.n_leaves += 7;
    }

    /// The cube across a face or an edge of a cube: of the same size where there is one, or else the leaf that covers its
    /// place. `None` outside the box.
    pub fn neighbour(&self, of: &Octant, step: [i32; 3]) -> Option<usize> {
        let side = self.side(of.level) as i32;
        let mut at = [0; 3];
        for k in 0..3 {
            let x = of.origin[k] as i32 + step[k] * side;
            if x < 0 || x as u32 >= self.roots[k] << self.depth {
                return None;
            }
            at[k] = x as u32;
        }
        let root = at.map(|x| x >> self.depth);
        let mut found = (root[0] + self.roots[0] * (root[1] + self.roots[1] * root[2])) as usize;
        while !self.octants[found].is_leaf() && self.octants[found].level < of.level {
            let shift = self.depth - self.octants[found].level - 1;
            let [x, y, z] = at.map(|x| x >> shift & 1);
            found = (self.octants[found].child + x + 2 * y + 4 * z) as usize;
        }
        Some(found)
    }

    /// Divides leaves until any two that share a face or part of an edge differ by one level at most: the weak balance of
    /// Labelle and Shewchuk (2007), section 3.
    pub fn balance(&mut self) {
        // A leaf divides larger ones only: from the finest level to the coarsest, each is looked at once.
        for level in (2..=self.depth).rev() {
            let mut i = 0;
            while i < self.octants.len() {
                let octant = self.octants[i];
                if octant.level == level && octant.is_leaf() {
                    self.divide_around(&octant);
                }
                i += 1;
            }
        }
    }

    /// Divides the neighbours of a leaf that are too large beside it.
    fn divide_around(&mut self, octant: &Octant) {
        for step in NEIGHBOURS {
            while let Some(n) = self.neighbour(octant, step) {
                if self.octants[n].level + 1 >= octant.level {
                    break;
                }
                self.split(n);
            }
        }
    }
}
