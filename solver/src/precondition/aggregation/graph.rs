//! Which nodes are strongly coupled.

use crate::Block;
use crate::precondition::projected::ProjectedRows;
use crate::sparse::Rows;
use crate::team::Team;

/// Neighbours of every node, ascending, without the node itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Graph {
    starts: Vec<usize>,
    neighbours: Vec<u32>,
    /// Squared Frobenius norms of the blocks.
    weights: Vec<f64>,
}

impl Graph {
    /// Nodes `i` and `j` are neighbours if `‖A_ij‖ > strength √(‖A_ii‖ ‖A_jj‖)` in the Frobenius norm.
    pub fn new<const B: usize>(team: &Team, a: ProjectedRows<B>, strength: f64) -> Self {
        let n = a.n_rows();
        let size = |i: usize| square(&a.diagonal(i)).sqrt();
        let diagonal: Vec<f64> = if strength > 0.0 { (0..n).map(size).collect() } else { Vec::new() };
        let mut parts: [Self; Team::MAX_MEMBERS] = std::array::from_fn(|_| Self::default());
        team.each(&mut parts[..team.size()], |member, part| {
            part.neighbours.reserve(a.n_blocks() / team.size());
            part.weights.reserve(a.n_blocks() / team.size());
            for i in n * member / team.size()..n * (member + 1) / team.size() {
                let (cols, blocks) = a.row(i);
                for (&j, block) in cols.iter().zip(blocks) {
                    let weight = square(block);
                    let pair = || diagonal[i] * diagonal[j as usize];
                    let threshold = if strength > 0.0 { strength * strength * pair() } else { 0.0 };
                    if j as usize != i && weight > threshold {
                        part.neighbours.push(j);
                        part.weights.push(weight);
                    }
                }
                part.starts.push(part.neighbours.len());
            }
        });
        let mut graph = Self { starts: vec![0], ..Self::default() };
        for part in &parts {
            let before = graph.neighbours.len();
            graph.starts.extend(part.starts.iter().map(|end| before + end));
            graph.neighbours.extend_from_slice(&part.neighbours);
            graph.weights.extend_from_slice(&part.weights);
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
