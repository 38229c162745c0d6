//! Random graphs, and their patterns as matrices.

use proptest::prelude::*;
use stylet_solver::ordering::AdjacencySlices;
use stylet_solver::sparse::BlockCsr;

/// A simple undirected graph in two index slices.
#[derive(Clone, Debug)]
pub struct Graph {
    pub offsets: Vec<usize>,
    pub neighbours: Vec<u32>,
}

impl Graph {
    /// From edges; loops and repetitions are dropped.
    pub fn new(n: usize, edges: &[(usize, usize)]) -> Self {
        let mut rows = vec![Vec::new(); n];
        for &(i, j) in edges.iter().filter(|(i, j)| i != j) {
            rows[i].push(j as u32);
            rows[j].push(i as u32);
        }
        let (mut offsets, mut neighbours) = (vec![0], Vec::new());
        for row in &mut rows {
            row.sort_unstable();
            row.dedup();
            neighbours.extend_from_slice(row);
            offsets.push(neighbours.len());
        }
        Self { offsets, neighbours }
    }

    pub fn view(&self) -> AdjacencySlices<'_> {
        AdjacencySlices::new(&self.offsets, &self.neighbours).unwrap()
    }

    /// Every edge once.
    pub fn edges(&self) -> Vec<(usize, usize)> {
        let row =
            |i: usize| self.neighbours[self.offsets[i]..self.offsets[i + 1]].iter().map(move |&j| (i, j as usize));
        (0..self.offsets.len() - 1).flat_map(row).filter(|(i, j)| i < j).collect()
    }

    /// Its Laplacian plus the identity.
    pub fn laplacian(&self) -> BlockCsr<1> {
        let n = self.offsets.len() - 1;
        let mut a = BlockCsr::new(n);
        for i in 0..n {
            let neighbours = &self.neighbours[self.offsets[i]..self.offsets[i + 1]];
            let mut row: Vec<(u32, [[f64; 1]; 1])> = neighbours.iter().map(|&j| (j, [[-1.0]])).collect();
            row.push((i as u32, [[1.0 + neighbours.len() as f64]]));
            row.sort_by_key(|(j, _)| *j);
            let (cols, blocks): (Vec<u32>, Vec<_>) = row.into_iter().unzip();
            a.set_row(i, &cols, &blocks).unwrap();
        }
        a
    }
}

/// Up to 60 nodes and 120 edges: several components, isolated nodes and no nodes at all among them.
pub fn graph() -> impl Strategy<Value = Graph> {
    (0usize..60).prop_flat_map(|n| {
        let ends = 0..n.max(1);
        let edges = proptest::collection::vec((ends.clone(), ends), 0..if n == 0 { 1 } else { 120 });
        edges.prop_map(move |edges| Graph::new(n, &edges))
    })
}
