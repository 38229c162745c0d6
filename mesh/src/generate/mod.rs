//! Start meshes of simple domains, and of solids given by functions of space.

pub mod contours;
mod delaunay;
pub mod implicit;
mod kuhn_box;
mod tets;

pub use delaunay::random_delaunay;
pub use kuhn_box::{kuhn_box, kuhn_box_with_rule};
pub use tets::Tets;
