//! Which nodes are strongly coupled.

use crate::Block;
use crate::sparse::BlockCsr;

/// Neighbours of every node, ascending, without the node itself.
#[derive(Clone, Debug, Default)]
pub(super) struct Graph {
    starts: Vec<usize>,
    neighbours: Vec<u32>,
    /// Squared Frobenius norms of the blocks.
    weights: Vec<f64>,
}

impl Graph {
    /// Nodes `i` and `j` are neighbours if `‖A_ij‖ > strength √(‖A_ii‖ ‖A_jj‖)` in the Frobenius norm.
    pub fn new<const B: usize>(a: &BlockCsr<B>, strength: f64) -> Self {
        let diagonal: Vec<f64> = (0..a.n_rows()).map(|i| square(&a.diagonal(i)).sqrt()).collect();
        let mut graph = Self { starts: vec![0], ..Self::default() };
        for i in 0..a.n_rows() {
            let (cols, blocks) = a.row(i);
            for (&j, block) in cols.iter().zip(blocks) {
                let weight = square(block);
                let threshold = strength * strength * diagonal[i] * diagonal[j as usize];
                if j as usize != i && weight > threshold {
                    graph.neighbours.push(j);
                    graph.weights.push(weight);
                }
            }
            graph.starts.push(graph.neighbours.len());
        }
        graph
    }

    pub fn n_nodes(&self) -> usize {
        self.starts.len() - 1
    }

    pub fn neighbours(&self, node: usize) -> &[u32] {
        &self.neighbours[self.starts[node]..self.starts[node + 1]]
    }

    /// Weights of [`neighbours`](Self::neighbours).
    pub fn weights(&self, node: usize) -> &[f64] {
        &self.weights[self.starts[node]..self.starts[node + 1]]
    }
}

fn square<const B: usize>(block: &Block<B>) -> f64 {
    block.as_flattened().iter().map(|v| v * v).sum()
}
