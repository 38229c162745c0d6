//! Cells with their neighbours, and some of them replaced by others that fill the same space.

use super::ImproveError;
use crate::generate::Tets;

/// No neighbour; in place of a region, no cell.
pub(super) const NONE: u32 = u32::MAX;

/// The corners of the facet opposite each corner of a tetrahedron of positive volume, counter-clockwise seen from
/// inside: `[corner, facet]` is an even permutation.
pub(super) const FACETS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Cells that know their neighbours.
pub(super) struct Complex {
    pub cells: Vec<[u32; 4]>,
    pub regions: Vec<u32>,
    /// Across the facet opposite each corner.
    pub neighbours: Vec<[u32; 4]>,
    /// Slots without a cell.
    free: Vec<u32>,
    /// Facets of the cells that are being replaced, or put in place: corners ascending, cell, facet.
    open: Vec<([u32; 3], u32, u8)>,
}

impl Complex {
    /// Finds the neighbours.
    pub fn new(tets: &Tets) -> Result<Self, ImproveError> {
        let mut facets = Vec::with_capacity(4 * tets.cells.len());
        for (t, cell) in tets.cells.iter().enumerate() {
            facets.extend((0..4).map(|i| (key(cell, i), t as u32, i as u8)));
        }
        facets.sort_unstable();
        let mut neighbours = vec![[NONE; 4]; tets.cells.len()];
        for group in facets.chunk_by(|a, b| a.0 == b.0) {
            let &[(_, s, i), ref others @ ..] = group else { continue };
            let Some(&(_, t, j)) = others.first() else { continue };
            let same_side = turn(&tets.cells[s as usize], i) == turn(&tets.cells[t as usize], j);
            if others.len() > 1 || same_side {
                return Err(ImproveError::Facet { first: s as usize, second: t as usize });
            }
            neighbours[s as usize][i as usize] = t;
            neighbours[t as usize][j as usize] = s;
        }
        let (cells, regions) = (tets.cells.clone(), tets.regions.clone());
        Ok(Self { cells, regions, neighbours, free: Vec::new(), open: Vec::with_capacity(64) })
    }

    /// Whether a slot holds a cell.
    pub fn lives(&self, t: u32) -> bool {
        self.regions[t as usize] != NONE
    }

    /// The cells.
    pub fn live(&self) -> impl Iterator<Item = &[u32; 4]> {
        self.cells.iter().zip(&self.regions).filter(|(_, region)| **region != NONE).map(|(cell, _)| cell)
    }

    /// The corner of cell `t` that vertex `v` is.
    pub fn corner(&self, t: u32, v: u32) -> usize {
        self.cells[t as usize].iter().position(|&w| w == v).expect("a vertex of the cell")
    }

    /// Puts cells `new` of one region in place of `old`, which fill the same space; both are few.
    pub fn replace(&mut self, old: &[u32], new: &[[u32; 4]]) {
        let region = self.regions[old[0] as usize];
        self.open.clear();
        for &t in old {
            for i in 0..4 {
                let outside = self.neighbours[t as usize][i];
                if outside != NONE && !old.contains(&outside) {
                    let back =
                        self.neighbours[outside as usize].iter().position(|&s| s == t).expect("mutual neighbours");
                    self.open.push((key(&self.cells[t as usize], i), outside, back as u8));
                }
            }
        }
        for &t in old {
            self.regions[t as usize] = NONE;
            self.free.push(t);
        }
        // Taken from the end: the first of the old ones is used first.
        let n_free = self.free.len();
        self.free[n_free - old.len()..].reverse();
        for cell in new {
            let t = self.slot();
            self.cells[t as usize] = *cell;
            self.regions[t as usize] = region;
            self.neighbours[t as usize] = [NONE; 4];
            for i in 0..4 {
                self.close(key(cell, i), t, i as u8);
            }
        }
    }

    /// Joins a facet to the same one seen before, or keeps it until that one comes.
    fn close(&mut self, key: [u32; 3], t: u32, i: u8) {
        match self.open.iter().position(|open| open.0 == key) {
            Some(at) => {
                let (_, other, j) = self.open.swap_remove(at);
                self.neighbours[t as usize][i as usize] = other;
                self.neighbours[other as usize][j as usize] = t;
            }
            None => self.open.push((key, t, i)),
        }
    }

    fn slot(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.cells.push([0; 4]);
            self.regions.push(NONE);
            self.neighbours.push([NONE; 4]);
            (self.cells.len() - 1) as u32
        })
    }

    /// The cells and their regions, without gaps.
    pub fn into_cells(self) -> (Vec<[u32; 4]>, Vec<u32>) {
        self.cells.into_iter().zip(self.regions).filter(|&(_, region)| region != NONE).unzip()
    }
}

/// The vertices of a facet, ascending.
fn key(cell: &[u32; 4], opposite: usize) -> [u32; 3] {
    let mut key = FACETS[opposite].map(|i| cell[i]);
    key.sort_unstable();
    key
}

/// Whether the vertices of a facet as listed are an even permutation of the ascending ones.
fn turn(cell: &[u32; 4], opposite: u8) -> bool {
    let [a, b, c] = FACETS[opposite as usize].map(|i| cell[i]);
    (usize::from(a > b) + usize::from(b > c) + usize::from(a > c)).is_multiple_of(2)
}

/// For each vertex the facets opposite it, as `FACETS` order them, one after another.
#[derive(Default)]
pub(super) struct Stars {
    starts: Vec<u32>,
    facets: Vec<[u32; 3]>,
}

impl Stars {
    /// Found anew, in the memory of the old ones.
    pub fn rebuild(&mut self, n_points: usize, complex: &Complex) {
        self.starts.clear();
        self.starts.resize(n_points + 1, 0);
        complex.live().flatten().for_each(|&v| self.starts[v as usize] += 1);
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.facets.clear();
        self.facets.resize(end as usize, [0; 3]);
        // Filled from the end, so that `starts` end up where they should.
        for cell in complex.live() {
            for i in 0..4 {
                let start = &mut self.starts[cell[i] as usize];
                *start -= 1;
                self.facets[*start as usize] = FACETS[i].map(|j| cell[j]);
            }
        }
    }

    pub fn of(&self, v: u32) -> &[[u32; 3]] {
        &self.facets[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
    }
}
