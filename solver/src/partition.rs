//! Nodes in parts of about equal size with few edges between them, and how a partition ages.
//!
//! A fresh [`partition`] (feature `metis`) costs more than a remesh; a mesh that changes under an old one keeps it, new nodes
//! joining the part that most of their neighbours are in. [`Partition::drift`] says when a fresh one is due.

#[cfg(feature = "metis")]
mod kway;

#[cfg(feature = "metis")]
pub use kway::{PartitionError, partition};

use crate::ordering::Adjacency;

/// A part has not been chosen yet.
const NONE: u32 = u32::MAX;

/// Which part each node is in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Partition {
    parts: Vec<u32>,
    sizes: Vec<usize>,
    /// Of the edges, the share that was cut when the partition was made.
    first_cut: f64,
}

/// A partition that its graph does not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartsError {
    /// The graph has another number of nodes.
    #[error("a partition of {parts} nodes does not fit a graph of {nodes}")]
    Shape {
        /// Nodes with a part.
        parts: usize,
        /// Nodes of the graph.
        nodes: usize,
    },
    /// There is no such part.
    #[error("node {node} is in part {part}: there are {n_parts} parts")]
    NoSuchPart {
        /// The node.
        node: usize,
        /// Its part.
        part: u32,
        /// Number of parts.
        n_parts: usize,
    },
    /// There is no such node.
    #[error("node {node} is out of range: there are {n_nodes} nodes")]
    NodeOutOfRange {
        /// The node asked for.
        node: usize,
        /// Number of nodes.
        n_nodes: usize,
    },
}

/// How far a partition is from a good one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Size of the largest part over the mean size; 1 is perfect.
    pub imbalance: f64,
    /// Of all edges, the share that joins two parts.
    pub cut: f64,
    /// That share when the partition was made.
    pub first_cut: f64,
}

impl Drift {
    /// Whether the largest part exceeds the mean by the factor `imbalance`, or the cut what it was by the factor `cut` and by
    /// one edge in a hundred. 1.2 and 1.5 are good limits: a pass waits for its largest part, and the nodes of cut edges are
    /// worked on twice.
    #[must_use]
    pub fn is_due(&self, imbalance: f64, cut: f64) -> bool {
        self.imbalance > imbalance || self.cut > (cut * self.first_cut).max(self.first_cut + 0.01)
    }
}

impl Partition {
    /// From the part of each node, each below `n_parts`.
    ///
    /// # Errors
    /// [`PartsError::Shape`] or [`PartsError::NoSuchPart`].
    pub fn new(graph: &(impl Adjacency + ?Sized), parts: Vec<u32>, n_parts: usize) -> Result<Self, PartsError> {
        if parts.len() != graph.n_nodes() {
            return Err(PartsError::Shape { parts: parts.len(), nodes: graph.n_nodes() });
        }
        let mut sizes = vec![0; n_parts];
        for (node, &part) in parts.iter().enumerate() {
            *sizes.get_mut(part as usize).ok_or(PartsError::NoSuchPart { node, part, n_parts })? += 1;
        }
        let mut this = Self { parts, sizes, first_cut: 0.0 };
        this.first_cut = this.cut_share(graph);
        Ok(this)
    }

    /// The part of each node.
    #[must_use]
    pub fn parts(&self) -> &[u32] {
        &self.parts
    }

    /// Number of parts, empty ones included.
    #[must_use]
    pub fn n_parts(&self) -> usize {
        self.sizes.len()
    }

    /// Number of nodes in each part.
    #[must_use]
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Size of the largest part over the mean size: 1 is perfect, also for no nodes at all.
    #[must_use]
    pub fn imbalance(&self) -> f64 {
        let largest = self.sizes.iter().copied().max().unwrap_or(0);
        if largest == 0 { 1.0 } else { (largest * self.n_parts()) as f64 / self.parts.len() as f64 }
    }

    /// Number of edges that join two parts.
    ///
    /// # Panics
    /// If the graph has more nodes than the partition.
    #[must_use]
    pub fn edge_cut(&self, graph: &(impl Adjacency + ?Sized)) -> usize {
        self.count(graph).0
    }

    /// How far the partition has come from what it was when it was made.
    ///
    /// # Panics
    /// If the graph has more nodes than the partition.
    #[must_use]
    pub fn drift(&self, graph: &(impl Adjacency + ?Sized)) -> Drift {
        Drift { imbalance: self.imbalance(), cut: self.cut_share(graph), first_cut: self.first_cut }
    }

    /// Follows a change of the graph: nodes that the partition has not seen, and those `born` in place of others, join the part
    /// that most of their neighbours are in, the smaller one of two. Those without a neighbour in any part join the smallest.
    /// Nodes beyond the end of the graph are dropped. Costs the nodes that changed, not their number in all.
    ///
    /// # Errors
    /// [`PartsError::NodeOutOfRange`]; the partition is then unchanged.
    pub fn follow(&mut self, graph: &(impl Adjacency + ?Sized), born: &[usize]) -> Result<(), PartsError> {
        let n_nodes = graph.n_nodes();
        if let Some(&node) = born.iter().find(|&&node| node >= n_nodes) {
            return Err(PartsError::NodeOutOfRange { node, n_nodes });
        }
        if self.sizes.is_empty() && n_nodes > 0 {
            self.sizes.push(0);
        }
        let known = self.parts.len().min(n_nodes);
        for node in known..self.parts.len() {
            self.sizes[self.parts[node] as usize] -= 1;
        }
        self.parts.resize(n_nodes, NONE);
        let mut waiting: Vec<usize> = born.iter().copied().filter(|&node| node < known).collect();
        waiting.sort_unstable();
        waiting.dedup();
        for &node in &waiting {
            self.sizes[self.parts[node] as usize] -= 1;
            self.parts[node] = NONE;
        }
        waiting.extend(known..n_nodes);
        self.assign(graph, waiting);
        Ok(())
    }

    /// Gives each waiting node a part, those next to a node with a part first.
    fn assign(&mut self, graph: &(impl Adjacency + ?Sized), waiting: Vec<usize>) {
        let mut votes = vec![0; self.n_parts()];
        let mut queue = waiting.clone();
        self.spread(graph, &mut queue, &mut votes);
        for founder in waiting {
            if self.parts[founder] != NONE {
                continue;
            }
            // Not connected to any part: a new island.
            let smallest = (0..self.n_parts()).min_by_key(|&part| self.sizes[part]).unwrap_or(0);
            self.join(founder, smallest as u32); // fewer parts than nodes have numbers
            queue.clear();
            queue.extend(graph.neighbours(founder).iter().map(|&j| j as usize));
            self.spread(graph, &mut queue, &mut votes);
        }
    }

    /// Gives a part to the nodes of the queue that are next to one, and to those that thereby come to be so.
    fn spread(&mut self, graph: &(impl Adjacency + ?Sized), queue: &mut Vec<usize>, votes: &mut [usize]) {
        let mut head = 0;
        while head < queue.len() {
            let node = queue[head];
            head += 1;
            if self.parts[node] != NONE {
                continue;
            }
            if let Some(part) = self.majority(graph.neighbours(node), votes) {
                self.join(node, part);
                let unassigned = |&&j: &&u32| self.parts[j as usize] == NONE;
                queue.extend(graph.neighbours(node).iter().filter(unassigned).map(|&j| j as usize));
            }
        }
    }

    fn join(&mut self, node: usize, part: u32) {
        self.parts[node] = part;
        self.sizes[part as usize] += 1;
    }

    /// The part that most of `neighbours` are in; of two, the smaller one. `votes` is zero before and after.
    fn majority(&self, neighbours: &[u32], votes: &mut [usize]) -> Option<u32> {
        let parts = || neighbours.iter().map(|&j| self.parts[j as usize]).filter(|&part| part != NONE);
        parts().for_each(|part| votes[part as usize] += 1);
        let rank = |part: &u32| (votes[*part as usize], std::cmp::Reverse((self.sizes[*part as usize], *part)));
        let best = parts().max_by_key(rank);
        parts().for_each(|part| votes[part as usize] = 0);
        best
    }

    fn cut_share(&self, graph: &(impl Adjacency + ?Sized)) -> f64 {
        let (cut, edges) = self.count(graph);
        if edges == 0 { 0.0 } else { cut as f64 / edges as f64 }
    }

    /// Edges that are cut, and all edges.
    fn count(&self, graph: &(impl Adjacency + ?Sized)) -> (usize, usize) {
        let (mut cut, mut edges) = (0, 0);
        for i in 0..graph.n_nodes() {
            for &j in graph.neighbours(i) {
                let j = j as usize;
                if i < j {
                    edges += 1;
                    cut += usize::from(self.parts[i] != self.parts[j]);
                }
            }
        }
        (cut, edges)
    }
}
