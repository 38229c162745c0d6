//! The order of elimination: postordered, so that columns of one supernode come one after the other.

use crate::ordering::{Adjacency, Permutation};

const NONE: u32 = u32::MAX;

/// Renumbers `order` by a postorder of its elimination tree. The fill stays the same, entry by entry.
///
/// Source: Liu, *The role of elimination trees in sparse factorization*, SIAM J. Matrix Anal. Appl. 11 (1990).
pub(super) fn postordered(graph: &impl Adjacency, order: &Permutation) -> Vec<u32> {
    let parents = elimination_tree(graph, order);
    let n = parents.len();
    // Children of each node as a linked list, ascending.
    let (mut first_child, mut next_sibling) = (vec![NONE; n], vec![NONE; n]);
    for child in (0..n).rev().filter(|&child| parents[child] != NONE) {
        let parent = parents[child] as usize;
        next_sibling[child] = std::mem::replace(&mut first_child[parent], child as u32);
    }
    let mut result = Vec::with_capacity(n);
    let mut stack = Vec::new();
    for root in (0..n).filter(|&root| parents[root] == NONE) {
        stack.push(root);
        while let Some(&node) = stack.last() {
            match std::mem::replace(&mut first_child[node], NONE) {
                NONE => {
                    result.push(order.new_to_old()[node]);
                    stack.pop();
                    // The next one of this node's family, if its parent is still open.
                    if next_sibling[node] != NONE && !stack.is_empty() {
                        stack.push(next_sibling[node] as usize);
                    }
                }
                child => stack.push(child as usize),
            }
        }
    }
    result
}

/// Parent of each node, in the new numbers: the first one that its elimination fills in.
fn elimination_tree(graph: &impl Adjacency, order: &Permutation) -> Vec<u32> {
    let n = order.len();
    let (mut parents, mut ancestors) = (vec![NONE; n], vec![NONE; n]);
    for node in 0..n {
        for &j in graph.neighbours(order.old_of(node)) {
            // Climb from each lower neighbour, shortening the way for the next one.
            let mut at = order.new_of(j as usize);
            while at < node {
                let above = std::mem::replace(&mut ancestors[at], node as u32);
                if above == NONE {
                    parents[at] = node as u32;
                    break;
                }
                at = above as usize;
            }
        }
    }
    parents
}

/// Moves each late node to just behind the last of its neighbours that are not late.
///
/// A late node has a diagonal that is zero or negative: a constraint of a saddle-point system. Behind its neighbours its pivot
/// is `−C (H⁻¹) Cᵀ`, which is not zero where the rows of `C` are independent.
pub(super) fn with_late_nodes(graph: &impl Adjacency, order: &Permutation, late: impl Fn(usize) -> bool) -> Vec<u32> {
    let place = |node: usize| {
        let others = graph.neighbours(node).iter().map(|&j| j as usize).filter(|&j| !late(j));
        others.map(|j| order.new_of(j)).max().unwrap_or(order.new_of(node))
    };
    let key =
        |node: usize| if late(node) { (place(node), true, order.new_of(node)) } else { (order.new_of(node), false, 0) };
    let mut nodes: Vec<u32> = order.new_to_old().to_vec();
    nodes.sort_by_cached_key(|&node| key(node as usize));
    nodes
}
