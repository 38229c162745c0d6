//! How far a numbering spreads the neighbours.

use super::{Adjacency, Permutation};

/// Largest `|i − j|` over all pairs of neighbours, in the new numbering: 0 for a diagonal matrix.
///
/// # Panics
/// If the permutation does not have as many nodes as the graph.
#[must_use]
pub fn bandwidth(graph: &(impl Adjacency + ?Sized), order: &Permutation) -> usize {
    let spread = |new: usize| {
        let neighbours = graph.neighbours(order.old_of(new)).iter();
        neighbours.map(|&j| order.new_of(j as usize).abs_diff(new)).max().unwrap_or(0)
    };
    check(graph, order);
    (0..order.len()).map(spread).max().unwrap_or(0)
}

/// Sum over the rows of the distance from the first neighbour to the diagonal, in the new numbering: the blocks below the
/// diagonal of a factor that is stored as an envelope.
///
/// # Panics
/// If the permutation does not have as many nodes as the graph.
#[must_use]
pub fn profile(graph: &(impl Adjacency + ?Sized), order: &Permutation) -> usize {
    let reach = |new: usize| {
        let neighbours = graph.neighbours(order.old_of(new)).iter();
        new - neighbours.map(|&j| order.new_of(j as usize)).fold(new, usize::min)
    };
    check(graph, order);
    (0..order.len()).map(reach).sum()
}

fn check(graph: &(impl Adjacency + ?Sized), order: &Permutation) {
    assert_eq!(graph.n_nodes(), order.len(), "a permutation has as many nodes as the graph");
}
