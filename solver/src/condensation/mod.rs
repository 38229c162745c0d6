//! Small dense matrices that stand for a whole body: its response at a few nodes, and exact changes of it.
//!
//! * [`CondensedMatrix`]: the response at the dofs kept, of which each has either its force or its displacement prescribed, and
//!   which exchanges one for the other in O(m²);
//! * [`Woodbury`]: a solve, or an inverse, of a matrix that differs from a known one by a term of low rank;
//! * [`rotate_node`], [`rotate_nodes`]: the same matrix with nodes in frames of their own.
//!
//! Matrices are square, dense, and stored by rows.

mod lu;
mod rotation;
mod swap;
#[cfg(test)]
mod tests;
mod woodbury;

pub use rotation::{RotationError, rotate_node, rotate_nodes};
pub use swap::{CondensedMatrix, Prescribed, SwapError};
pub use woodbury::{Woodbury, WoodburyError};
