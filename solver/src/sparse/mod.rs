//! A block sparse matrix that follows a changing mesh.
//!
//! [`BlockCsr`] keeps every row in a slot of its own. Rewriting a row touches that slot alone; a row that outgrows its
//! slot moves to another one and leaves the old one to later rows. Nothing else ever moves, so a mesh change costs the
//! rows it touches, whatever the size of the matrix. [`Frozen`] is a second copy of its numbers, laid out for products, that
//! follows it.

mod arena;
mod block_csr;
mod contributions;
mod convert;
mod frozen;
mod kernel;
mod rows;
mod scalar_csr;
mod views;

pub use block_csr::{BlockCsr, RowsMut, SparseError};
pub use contributions::{ContributionError, ElementBlocks, ElementContributions, LazyReport, RefreshRule};
pub use frozen::Frozen;
pub(crate) use rows::Rows;
pub use scalar_csr::{Asymmetry, ConversionError, ScalarCsr};
