//! Orders of the nodes: narrow bands for a product that stays in the cache, little fill for a factor.
//!
//! * [`reverse_cuthill_mckee`] narrows the band, [`bandwidth`] and [`profile`] measure it;
//! * `nested_dissection` (feature `metis`) and `minimum_degree` (feature `direct`) keep the factor of a matrix sparse.
//!
//! All of them read an [`Adjacency`]: the pattern of a [`BlockCsr`](crate::sparse::BlockCsr) as it stands, or two index
//! slices. What they return is a [`Permutation`], which renumbers vectors, matrices and subspaces.

mod adjacency;
mod band;
mod cuthill_mckee;
#[cfg(feature = "direct")]
mod minimum_degree;
#[cfg(feature = "metis")]
mod nested_dissection;
mod permutation;

#[cfg(feature = "metis")]
pub use crate::metis_graph::MetisError;
pub use adjacency::{Adjacency, AdjacencyError, AdjacencySlices};
pub use band::{bandwidth, profile};
pub use cuthill_mckee::reverse_cuthill_mckee;
#[cfg(feature = "direct")]
pub use minimum_degree::{MinimumDegreeError, minimum_degree};
#[cfg(feature = "metis")]
pub use nested_dissection::{NestedDissectionError, nested_dissection};
pub use permutation::{Permutation, PermutationError};
