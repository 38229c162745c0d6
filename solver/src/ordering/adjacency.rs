//! Who is next to whom.

use crate::sparse::BlockCsr;

/// The neighbours of each node of an undirected graph. A node may be listed as its own neighbour; that means nothing.
pub trait Adjacency {
    /// Number of nodes, at most `u32::MAX`.
    fn n_nodes(&self) -> usize;

    /// Neighbours of `node`, each once, in any order.
    fn neighbours(&self, node: usize) -> &[u32];
}

/// The pattern of the matrix, read in place.
impl<const B: usize> Adjacency for BlockCsr<B> {
    fn n_nodes(&self) -> usize {
        self.n_rows()
    }

    fn neighbours(&self, node: usize) -> &[u32] {
        self.row(node).0
    }
}

/// An adjacency in two index slices: the neighbours of node `i` are `neighbours[offsets[i]..offsets[i + 1]]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdjacencySlices<'a> {
    offsets: &'a [usize],
    neighbours: &'a [u32],
}

/// Index slices that describe no graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AdjacencyError {
    /// Offsets start with 0, do not descend and end with the number of neighbours.
    #[error("offset {value} at position {position} does not fit {n_neighbours} neighbours")]
    Offsets {
        /// Index of the first offset that is wrong.
        position: usize,
        /// The offset there; the length of the slice is zero if there is none.
        value: usize,
        /// Length of the neighbours.
        n_neighbours: usize,
    },
    /// A node is next to one that does not exist.
    #[error("neighbour {neighbour} of node {node} is out of range: there are {n_nodes} nodes")]
    NeighbourOutOfRange {
        /// The node.
        node: usize,
        /// Its neighbour.
        neighbour: u32,
        /// Number of nodes.
        n_nodes: usize,
    },
}

impl<'a> AdjacencySlices<'a> {
    /// Checks the slices; `offsets` has one entry more than there are nodes.
    ///
    /// # Errors
    /// [`AdjacencyError`] names the first offset or neighbour that is wrong.
    pub fn new(offsets: &'a [usize], neighbours: &'a [u32]) -> Result<Self, AdjacencyError> {
        let n_neighbours = neighbours.len();
        let wrong = |position: usize| {
            let value = offsets.get(position).copied().unwrap_or_default();
            AdjacencyError::Offsets { position, value, n_neighbours }
        };
        if offsets.first() != Some(&0) {
            return Err(wrong(0));
        }
        if let Some(position) = offsets.windows(2).position(|w| w[0] > w[1]) {
            return Err(wrong(position + 1));
        }
        if offsets.last() != Some(&n_neighbours) {
            return Err(wrong(offsets.len() - 1));
        }
        let slices = Self { offsets, neighbours };
        let n_nodes = slices.n_nodes();
        for node in 0..n_nodes {
            let outside = |j: &&u32| **j as usize >= n_nodes;
            if let Some(&neighbour) = slices.neighbours(node).iter().find(outside) {
                return Err(AdjacencyError::NeighbourOutOfRange { node, neighbour, n_nodes });
            }
        }
        Ok(slices)
    }
}

impl Adjacency for AdjacencySlices<'_> {
    fn n_nodes(&self) -> usize {
        self.offsets.len() - 1
    }

    fn neighbours(&self, node: usize) -> &[u32] {
        &self.neighbours[self.offsets[node]..self.offsets[node + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_are_checked() {
        let path = AdjacencySlices::new(&[0, 1, 3, 4], &[1, 0, 2, 1]).unwrap();
        assert_eq!((path.n_nodes(), path.neighbours(1)), (3, &[0, 2][..]));
        assert_eq!(AdjacencySlices::new(&[0], &[]).unwrap().n_nodes(), 0);
        let offsets = |position, value, n_neighbours| Err(AdjacencyError::Offsets { position, value, n_neighbours });
        assert_eq!(AdjacencySlices::new(&[], &[]), offsets(0, 0, 0));
        assert_eq!(AdjacencySlices::new(&[1, 1], &[0]), offsets(0, 1, 1));
        assert_eq!(AdjacencySlices::new(&[0, 2, 1], &[0]), offsets(2, 1, 1));
        assert_eq!(AdjacencySlices::new(&[0, 1, 1], &[0, 1]), offsets(2, 1, 2));
        let outside = AdjacencyError::NeighbourOutOfRange { node: 1, neighbour: 2, n_nodes: 2 };
        assert_eq!(AdjacencySlices::new(&[0, 1, 2], &[1, 2]), Err(outside));
    }
}
