//! Reverse Cuthill-McKee.

use super::{Adjacency, Permutation};

/// Breadth-first searches for one start node at most: a bound that keeps the whole linear. Meshes need three or four.
const MAX_SEARCHES: usize = 10;

/// Numbers the nodes outwards from an end of the graph, level by level, and turns the numbering round.
///
/// Each component starts at a pseudo-peripheral node: one of least degree in the last level of a breadth-first search, as long
/// as that makes the search deeper. Time is linear in the entries, but for sorting the neighbours of each node by degree. A
/// pattern that is not symmetric gives a permutation all the same, only not a good one.
///
/// Source: George & Liu, *Computer Solution of Large Sparse Positive Definite Systems* (1981), sections 4.3 and 4.4.
#[must_use]
pub fn reverse_cuthill_mckee(graph: &(impl Adjacency + ?Sized)) -> Permutation {
    let n = graph.n_nodes();
    let mut search = Search { graph, seen: vec![0; n], stamp: 0, queue: Vec::with_capacity(n) };
    let mut order: Vec<u32> = Vec::with_capacity(n);
    let mut placed = vec![false; n];
    for seed in 0..n {
        if !placed[seed] {
            let start = search.pseudo_peripheral(seed, &placed);
            number_component(graph, start, &mut placed, &mut order);
        }
    }
    order.reverse();
    Permutation::from_checked(order)
}

/// Appends what can be reached from `start`: the neighbours of each node in ascending degree, then index.
fn number_component(graph: &(impl Adjacency + ?Sized), start: usize, placed: &mut [bool], order: &mut Vec<u32>) {
    let mut head = order.len();
    placed[start] = true;
    order.push(start as u32); // below the number of nodes, a u32
    while head < order.len() {
        let first = order.len();
        for &j in graph.neighbours(order[head] as usize) {
            if !placed[j as usize] {
                placed[j as usize] = true;
                order.push(j);
            }
        }
        order[first..].sort_unstable_by_key(|&j| (graph.neighbours(j as usize).len(), j));
        head += 1;
    }
}

/// Breadth-first searches that share their memory.
struct Search<'a, A: ?Sized> {
    graph: &'a A,
    /// The last search that came by.
    seen: Vec<u32>,
    stamp: u32,
    queue: Vec<u32>,
}

impl<A: Adjacency + ?Sized> Search<'_, A> {
    fn pseudo_peripheral(&mut self, seed: usize, placed: &[bool]) -> usize {
        let mut start = seed;
        let (mut depth, mut end) = self.levels(start, placed);
        for _ in 1..MAX_SEARCHES {
            let (next_depth, next_end) = self.levels(end, placed);
            if next_depth <= depth {
                break;
            }
            (start, depth, end) = (end, next_depth, next_end);
        }
        start
    }

    /// Number of levels behind `start`, and the node of least degree in the last one.
    fn levels(&mut self, start: usize, placed: &[bool]) -> (usize, usize) {
        self.stamp = self.stamp.wrapping_add(1);
        self.queue.clear();
        self.queue.push(start as u32); // below the number of nodes, a u32
        self.seen[start] = self.stamp;
        let (mut depth, mut level) = (0, 0..1);
        loop {
            for at in level.clone() {
                for &j in self.graph.neighbours(self.queue[at] as usize) {
                    let j = j as usize;
                    if self.seen[j] != self.stamp && !placed[j] {
                        self.seen[j] = self.stamp;
                        self.queue.push(j as u32);
                    }
                }
            }
            if level.end == self.queue.len() {
                break;
            }
            level = level.end..self.queue.len();
            depth += 1;
        }
        let degree = |&&j: &&u32| self.graph.neighbours(j as usize).len();
        let end = self.queue[level].iter().min_by_key(degree);
        (depth, end.map_or(start, |&j| j as usize))
    }
}
