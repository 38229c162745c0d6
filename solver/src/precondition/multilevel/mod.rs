//! Preconditioners on the hierarchy that bisection leaves behind.
//!
//! ```text
//! level 2   l ---- p ---- r ---- s      smoothed: p (born in generation 2), l and r (its parents)
//! level 1   l ----------- r ---- s      smoothed: r, and its parents l and s
//! level 0   l ------------------ s      solved exactly
//! ```
//!
//! A mesh bisected from a start mesh has one new node `p` per patch, midway between two parents. Its hat function and those of
//! the two parents are all that changed, so that each level smooths those nodes alone, on top of one smoothing of all nodes
//! of the finest level. One application costs O(n) for n nodes, however deep and graded the mesh is, and the number of
//! iterations stays bounded.
//!
//! * [`Bpx`] adds up the corrections: cheap, and parallel within a level;
//! * [`VCycle`] makes them one after the other, with the residual kept up to date: a fifth of the iterations, but each reads the
//!   matrices of all levels twice, in an order that neither vector instructions nor threads help. Prefer it where products are
//!   dear or the start mesh does most of the work.
//!
//! A level takes a whole generation at once, where a generation is one above the greatest of the nodes of the bisected patch;
//! a parent of several births is smoothed once. Diagonal blocks are those of the exact Galerkin matrices `Pᵀ A P`, where `P`
//! interpolates and then projects on the allowed moves: a fixed node is absent from every level, a sliding one keeps its
//! direction. The moves of a level are hence combinations of allowed moves, and the V-cycle is symmetric positive definite
//! whatever the constraints. Nodes that are in no hierarchy, such as those of a remeshed region, are smoothed on the
//! finest level.
//!
//! Source: Chen, Nochetto & Xu, *Optimal multilevel methods for graded bisection grids*, Numer. Math. 120 (2012), sections 4
//! and 5.

mod bpx;
mod coarse;
mod galerkin;
mod hierarchy;
mod levels;
#[cfg(test)]
mod tests;
mod v_cycle;

pub use bpx::Bpx;
pub use hierarchy::BisectionHierarchy;
pub use v_cycle::VCycle;

/// A hierarchy that makes no sense, or a matrix that cannot be preconditioned on it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MultilevelError {
    /// One entry per node is expected of both.
    #[error("parents of {parents} nodes, generations of {generations}")]
    Lengths {
        /// Length of the list of parents.
        parents: usize,
        /// Length of the list of generations.
        generations: usize,
    },
    /// There is no such node.
    #[error("node {node} is out of range: there are {n_nodes} nodes")]
    NodeOutOfRange {
        /// The node listed.
        node: usize,
        /// Number of nodes.
        n_nodes: usize,
    },
    /// A node occurs twice.
    #[error("node {node} is listed twice")]
    Listed {
        /// The node.
        node: usize,
    },
    /// The parents are not two different nodes of the hierarchy, both of lower generation.
    #[error("node {node} of generation {generation} cannot halve the edge of nodes {} and {}", parents[0], parents[1])]
    Parents {
        /// The node.
        node: usize,
        /// Its parents.
        parents: [u32; 2],
        /// Its generation.
        generation: u16,
    },
    /// Matrix, subspace and hierarchy have different numbers of nodes.
    #[error("matrix has {rows} block rows, subspace has {nodes} nodes, hierarchy has {listed}")]
    Shape {
        /// Block rows of the matrix.
        rows: usize,
        /// Nodes of the subspace.
        nodes: usize,
        /// Nodes of the hierarchy.
        listed: usize,
    },
    /// A diagonal block of a level, restricted to the allowed moves, is not positive definite.
    #[error(
        "pivot {pivot:e} at node {node}, level {level} from the finest: not positive definite on the allowed moves"
    )]
    NotPositive {
        /// The node.
        node: usize,
        /// 0 for the finest level.
        level: usize,
        /// The pivot that should have been positive.
        pivot: f64,
    },
    /// The matrix of the start nodes is not positive definite.
    #[error("pivot {pivot:e} at start node {node}: the coarsest matrix is not positive definite on the allowed moves")]
    Coarse {
        /// The start node.
        node: usize,
        /// The pivot that should have been positive.
        pivot: f64,
    },
}
