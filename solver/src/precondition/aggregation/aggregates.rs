//! Aggregates: disjoint groups of strongly coupled nodes, each of which becomes one node of the coarse level.

use super::graph::Graph;
use crate::memory::{bytes_of, bytes_of_all};
use std::collections::VecDeque;

/// A node outside of all aggregates.
pub(super) const NONE: u32 = u32::MAX;

/// Rounds of moving the seeds of [`Aggregates::balls`] to the middle.
const ROUNDS: usize = 5;

/// Every node with a neighbour lies in one aggregate. Nodes without one lie in none: fixed nodes have nothing to correct,
/// and for others the smoother alone does.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Aggregates {
    /// Aggregate of every node, or [`NONE`].
    pub of: Vec<u32>,
    starts: Vec<usize>,
    nodes: Vec<u32>,
}

impl Aggregates {
    /// Nodes and all their neighbours: in the order of the nodes, a node none of whose neighbourhood is taken founds an
    /// aggregate with it; then each node left joins its strongest neighbour; what is still left founds aggregates with the
    /// neighbours that are left as well.
    ///
    /// Source: Vaněk, Mandel & Brezina, *Algebraic multigrid by smoothed aggregation*, Computing 56 (1996), Algorithm 5.1.
    pub fn neighbourhoods(graph: &Graph) -> Self {
        let n = graph.n_nodes();
        let mut of = vec![NONE; n];
        let mut count = 0;
        for i in 0..n {
            let around = graph.neighbours(i);
            if !around.is_empty() && of[i] == NONE && around.iter().all(|&j| of[j as usize] == NONE) {
                of[i] = count;
                around.iter().for_each(|&j| of[j as usize] = count);
                count += 1;
            }
        }
        let founded = of.clone();
        for i in (0..n).filter(|&i| founded[i] == NONE) {
            let taken = graph.neighbours(i).iter().zip(graph.weights(i)).filter(|(j, _)| founded[**j as usize] != NONE);
            // The first of equally strong ones.
            let strongest = taken.reduce(|best, next| if next.1 > best.1 { next } else { best });
            of[i] = strongest.map_or(NONE, |(j, _)| founded[*j as usize]);
        }
        for i in 0..n {
            if of[i] == NONE && !graph.neighbours(i).is_empty() {
                of[i] = count;
                for &j in graph.neighbours(i).iter().filter(|j| of[**j as usize] == NONE).collect::<Vec<_>>() {
                    of[j as usize] = count;
                }
                count += 1;
            }
        }
        Self::from_assignment(of, count as usize)
    }

    /// About `count` compact aggregates of similar size, at least one per connected part: nodes go to the nearest of some
    /// seeds, in steps along the graph; seeds start far from each other, and move to the middle of their aggregate a few
    /// times.
    ///
    /// Source: Lloyd's algorithm on graphs, Bell, *Algebraic multigrid for discrete differential forms*, PhD thesis,
    /// University of Illinois (2008), chapter 4.
    pub fn balls(graph: &Graph, count: usize) -> Self {
        let mut seeds = distant_seeds(graph, count);
        let mut of = Vec::new();
        for round in 0..=ROUNDS {
            of = nearest_seed(graph, &seeds);
            if round < ROUNDS {
                seeds = middles(graph, &of, seeds.len());
            }
        }
        Self::from_assignment(of, seeds.len())
    }

    /// From the aggregate of every node, or [`NONE`].
    pub fn from_assignment(of: Vec<u32>, count: usize) -> Self {
        let mut starts = vec![0; count + 1];
        for &aggregate in of.iter().filter(|a| **a != NONE) {
            starts[aggregate as usize + 1] += 1;
        }
        (0..count).for_each(|k| starts[k + 1] += starts[k]);
        let mut next = starts.clone();
        let mut nodes = vec![0; starts[count]];
        for (node, &aggregate) in of.iter().enumerate().filter(|(_, a)| **a != NONE) {
            nodes[next[aggregate as usize]] = node as u32;
            next[aggregate as usize] += 1;
        }
        Self { of, starts, nodes }
    }

    pub fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Nodes of an aggregate, ascending.
    pub fn nodes(&self, aggregate: usize) -> &[u32] {
        &self.nodes[self.starts[aggregate]..self.starts[aggregate + 1]]
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        bytes_of_all([&self.of, &self.nodes]) + bytes_of(&self.starts)
    }
}

/// Each seed is the first of the nodes that are farthest from those before it; parts of the graph without a seed are
/// farther than any other.
fn distant_seeds(graph: &Graph, count: usize) -> Vec<u32> {
    const FAR: u32 = u32::MAX;
    let mut distance: Vec<u32> =
        (0..graph.n_nodes()).map(|i| if graph.neighbours(i).is_empty() { 0 } else { FAR }).collect();
    let mut seeds = Vec::new();
    let mut queue = VecDeque::new();
    // The largest distance, lowest index first.
    while let Some((_, seed)) = distance.iter().enumerate().map(|(i, &d)| (d, std::cmp::Reverse(i))).max() {
        let seed = seed.0;
        if distance[seed] == 0 || (seeds.len() >= count && distance[seed] != FAR) {
            break;
        }
        seeds.push(seed as u32);
        distance[seed] = 0;
        queue.push_back(seed);
        while let Some(i) = queue.pop_front() {
            let next = distance[i] + 1;
            for &j in graph.neighbours(i) {
                if next < distance[j as usize] {
                    distance[j as usize] = next;
                    queue.push_back(j as usize);
                }
            }
        }
    }
    seeds
}

/// The aggregate of the nearest seed, breadth first; of equally near ones that which comes first in the queue.
fn nearest_seed(graph: &Graph, seeds: &[u32]) -> Vec<u32> {
    let mut of = vec![NONE; graph.n_nodes()];
    let mut queue: VecDeque<u32> = seeds.iter().copied().collect();
    for (aggregate, &seed) in seeds.iter().enumerate() {
        of[seed as usize] = aggregate as u32;
    }
    while let Some(i) = queue.pop_front() {
        for &j in graph.neighbours(i as usize) {
            if of[j as usize] == NONE {
                of[j as usize] = of[i as usize];
                queue.push_back(j);
            }
        }
    }
    of
}

/// The node of each aggregate that is farthest from its border: the last that a breadth-first walk inwards reaches, the
/// lowest index of several.
fn middles(graph: &Graph, of: &[u32], count: usize) -> Vec<u32> {
    let mut depth = vec![u32::MAX; of.len()];
    let mut queue = VecDeque::new();
    for i in 0..of.len() {
        if graph.neighbours(i).iter().any(|&j| of[j as usize] != of[i]) {
            depth[i] = 0;
            queue.push_back(i);
        }
    }
    while let Some(i) = queue.pop_front() {
        for &j in graph.neighbours(i) {
            if depth[j as usize] == u32::MAX {
                depth[j as usize] = depth[i] + 1;
                queue.push_back(j as usize);
            }
        }
    }
    let mut middles: Vec<Option<u32>> = vec![None; count];
    for (i, &aggregate) in of.iter().enumerate().filter(|(_, a)| **a != NONE) {
        let middle = &mut middles[aggregate as usize];
        if middle.is_none_or(|m| depth[i] > depth[m as usize]) {
            *middle = Some(i as u32);
        }
    }
    // Every aggregate holds its seed, so none is empty.
    middles.into_iter().flatten().collect()
}
