//! Who sums which rows of the stiffness matrix, and the forces on which vertices.
//!
//! Every vertex belongs to one part. A part visits the elements around its vertices in ascending order of their cells and
//! adds to its own rows alone: elements between parts are evaluated by each of them, so that no two parts write to the
//! same number and every row is summed in the order of the cells, whatever the parts are.

use super::element::ElementTable;
use super::star::Stars;
use stylet_solver::Block;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::team::Team;

/// Rows, elements and sums of one part.
#[derive(Clone, Debug, Default)]
pub(super) struct Part<const D: usize> {
    /// Vertices, ascending.
    pub rows: Vec<u32>,
    /// Slots of the elements around them, cells ascending.
    pub elements: Vec<u32>,
    /// Of given parts alone: where each of the rows begins among the values, the rows on their way to the matrix, and the
    /// forces of the vertices on theirs.
    pub starts: Vec<u32>,
    pub values: Vec<Block<D>>,
    pub forces: Vec<[f64; D]>,
}

/// The parts of a body, and where the row of each vertex is.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts<const D: usize> {
    pub parts: Vec<Part<D>>,
    /// The part of each vertex.
    pub owner: Vec<u16>,
    /// The place of each vertex among the rows of its part; of given parts alone.
    pub place: Vec<u32>,
    /// The first row of each part that is cut in order.
    bounds: Vec<usize>,
    /// Whether owners were given by the caller.
    given: bool,
    /// Whether the lists follow the mesh and the number of parts, and the starts the pattern of the matrix.
    current: bool,
    placed: bool,
}

impl<const D: usize> Parts<D> {
    /// The mesh has changed: the lists are made anew before they are next used.
    pub fn outdate(&mut self) {
        self.current = false;
    }

    /// The first row of each part and the number of rows beyond the last one; none if the caller has given the parts.
    pub fn bounds(&self) -> Option<[usize; Team::MAX_MEMBERS]> {
        let end = self.owner.len();
        (!self.given).then(|| std::array::from_fn(|k| self.bounds.get(k).copied().unwrap_or(end)))
    }

    /// Takes owners from the caller, or forgets those that it gave.
    pub fn give(&mut self, owner: Option<Vec<u16>>) {
        self.given = owner.is_some();
        self.owner = owner.unwrap_or_default();
        self.current = false;
    }

    /// A vertex is born of others: where owners were given, it joins the part of the first of these.
    pub fn adopt(&mut self, vertex: usize, parent: usize) {
        if !self.given {
            return;
        }
        let owner = self.owner.get(parent).copied().unwrap_or(0);
        if vertex >= self.owner.len() {
            self.owner.resize(vertex + 1, 0);
        }
        self.owner[vertex] = owner;
    }

    /// Brings the lists up to date, for `n_parts` parts unless the caller has given owners.
    pub fn follow<const N: usize>(&mut self, n_parts: usize, elements: &ElementTable<D, N>, stars: &Stars) {
        let n_parts = if self.given { self.count_given() } else { n_parts };
        if self.current && self.parts.len() == n_parts {
            return;
        }
        if self.given {
            self.owner.resize(stars.n_vertices(), 0);
        } else {
            self.cut(n_parts, stars);
        }
        self.parts.resize_with(n_parts, Part::default);
        for part in &mut self.parts {
            part.rows.clear();
            part.elements.clear();
        }
        self.list_rows(stars);
        for (_, slot) in elements.live() {
            let owners = elements.vertices(slot).map(|vertex| self.owner[vertex as usize]);
            for (a, &owner) in owners.iter().enumerate() {
                if !owners[..a].contains(&owner) {
                    self.parts[owner as usize].elements.push(slot as u32);
                }
            }
        }
        (self.current, self.placed) = (true, false);
    }

    /// Makes room for the rows of a matrix in given parts whose lists are up to date.
    pub fn place_rows(&mut self, matrix: &BlockCsr<D>) {
        if std::mem::replace(&mut self.placed, true) {
            return;
        }
        for part in &mut self.parts {
            part.starts.clear();
            let mut length = 0;
            for &vertex in &part.rows {
                part.starts.push(length as u32);
                length += matrix.row(vertex as usize).0.len();
            }
            part.values.clear();
            part.values.resize(length, [[0.0; D]; D]);
        }
    }

    fn count_given(&self) -> usize {
        1 + self.owner.iter().copied().max().unwrap_or(0) as usize
    }

    /// Cuts the vertices, in the order of their numbers, where the work is even.
    fn cut(&mut self, n_parts: usize, stars: &Stars) {
        let total: usize = (0..stars.n_vertices()).map(|vertex| stars.corners(vertex).len()).sum();
        let mut before = 0;
        self.owner.clear();
        self.owner.extend((0..stars.n_vertices()).map(|vertex| {
            let part = (before * n_parts / total.max(1)).min(n_parts - 1);
            before += stars.corners(vertex).len();
            part as u16
        }));
        self.bounds.clear();
        self.bounds.extend((0..n_parts).map(|part| self.owner.partition_point(|&owner| usize::from(owner) < part)));
    }

    fn list_rows(&mut self, stars: &Stars) {
        self.place = Vec::new();
        for vertex in 0..stars.n_vertices() {
            let rows = &mut self.parts[self.owner[vertex] as usize].rows;
            if self.given {
                self.place.push(rows.len() as u32);
            }
            rows.push(vertex as u32);
        }
        for part in &mut self.parts {
            (part.starts, part.values) = (Vec::new(), Vec::new());
            part.forces.clear();
            part.forces.resize(if self.given { part.rows.len() } else { 0 }, [0.0; D]);
        }
    }

    /// Bytes that the lists take.
    pub fn memory_bytes(&self) -> usize {
        let of_part = |part: &Part<D>| {
            4 * (part.rows.capacity() + part.elements.capacity() + part.starts.capacity())
                + size_of::<Block<D>>() * part.values.capacity()
                + size_of::<[f64; D]>() * part.forces.capacity()
        };
        2 * self.owner.capacity()
            + 4 * self.place.capacity()
            + 8 * self.bounds.capacity()
            + self.parts.iter().map(of_part).sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::Parts;

    #[test]
    fn newborns_join_their_parents() {
        let mut parts = Parts::<3>::default();
        parts.adopt(2, 1);
        assert!(parts.owner.is_empty(), "vertices are cut by their numbers");
        parts.give(Some(vec![0, 3]));
        parts.adopt(2, 1);
        parts.adopt(4, 2);
        parts.adopt(1, 0);
        assert_eq!(parts.owner, [0, 0, 3, 0, 3]);
    }
}
