//! For each vertex, the corners of elements that meet there, in ascending order of their cells.
//!
//! Sums over a star run in this order, which depends on the mesh alone: not on the slots that elements happen to have,
//! and not on threads.

/// A local vertex of the element in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner(u32);

impl Corner {
    #[inline]
    pub fn new<const N: usize>(slot: usize, local: usize) -> Self {
        Self((slot * N + local) as u32)
    }

    #[inline]
    pub fn slot<const N: usize>(self) -> usize {
        self.0 as usize / N
    }

    #[inline]
    pub fn local<const N: usize>(self) -> usize {
        self.0 as usize % N
    }
}

/// Where the star of a vertex lies in the arrays.
#[derive(Clone, Copy, Debug, Default)]
struct Range {
    start: u32,
    len: u32,
    capacity: u32,
}

impl Range {
    fn indices(self) -> std::ops::Range<usize> {
        self.start as usize..self.start as usize + self.len as usize
    }
}

/// The stars of all vertices, in one array. A star that outgrows its place moves to the end; when more than half of the
/// array is abandoned it is packed again, so that the cost per change stays in proportion to what it touched.
#[derive(Clone, Debug, Default)]
pub(super) struct Stars {
    ranges: Vec<Range>,
    corners: Vec<Corner>,
    abandoned: usize,
}

impl Stars {
    pub fn n_vertices(&self) -> usize {
        self.ranges.len()
    }

    /// Makes room for vertices without elements.
    pub fn resize(&mut self, n_vertices: usize) {
        self.ranges.resize(n_vertices, Range::default());
    }

    #[inline]
    pub fn corners(&self, vertex: usize) -> &[Corner] {
        &self.corners[self.ranges[vertex].indices()]
    }

    /// Replaces the star of a vertex.
    pub fn set(&mut self, vertex: usize, corners: &[Corner]) {
        let old = self.ranges[vertex];
        let len = corners.len() as u32;
        if len > old.capacity {
            self.abandoned += old.capacity as usize;
            let start = self.corners.len();
            // Room to grow by a bisection or two.
            let capacity = (corners.len() + 1).next_multiple_of(4);
            self.corners.resize(start + capacity, Corner(0));
            self.ranges[vertex] = Range { start: start as u32, len, capacity: capacity as u32 };
        }
        self.ranges[vertex].len = len;
        let range = self.ranges[vertex].indices();
        self.corners[range].copy_from_slice(corners);
        if 2 * self.abandoned > self.corners.len() {
            self.pack();
        }
    }

    /// Bytes that the stars take.
    pub fn memory_bytes(&self) -> usize {
        self.ranges.capacity() * size_of::<Range>() + self.corners.capacity() * size_of::<Corner>()
    }

    fn pack(&mut self) {
        let mut corners = Vec::with_capacity(self.corners.len());
        for range in &mut self.ranges {
            let old = range.indices();
            range.start = corners.len() as u32;
            range.capacity = range.capacity.min((range.len + 1).next_multiple_of(4));
            let end = corners.len() + range.capacity as usize;
            corners.extend_from_slice(&self.corners[old]);
            corners.resize(end, Corner(0));
        }
        (self.corners, self.abandoned) = (corners, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_names_its_slot_and_vertex() {
        for slot in [0, 1, 3, 4, 30] {
            for local in 0..4 {
                let corner = Corner::new::<4>(slot, local);
                assert_eq!((corner.slot::<4>(), corner.local::<4>()), (slot, local));
            }
        }
    }

    #[test]
    fn stars_survive_growth_and_packing() {
        let mut stars = Stars::default();
        stars.resize(5);
        let star = |vertex: usize, len: usize| (0..len).map(|k| Corner((100 * vertex + k) as u32)).collect::<Vec<_>>();
        for len in 1..200 {
            for vertex in 0..5 {
                stars.set(vertex, &star(vertex, len));
            }
            for vertex in 0..5 {
                assert_eq!(stars.corners(vertex), star(vertex, len));
            }
        }
        assert!(stars.corners.len() <= 5 * 2 * 208, "{} places for {} corners", stars.corners.len(), 5 * 199);
    }
}
