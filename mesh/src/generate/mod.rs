//! Start meshes of simple domains.

mod delaunay;
pub mod implicit;
mod kuhn_box;

pub use delaunay::random_delaunay;
pub use kuhn_box::{kuhn_box, kuhn_box_with_rule};
