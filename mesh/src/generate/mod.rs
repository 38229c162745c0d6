//! Start meshes of simple domains, and of solids given by functions of space.

pub mod contours;
mod delaunay;
pub mod implicit;
pub mod improve;
mod kuhn_box;
pub mod stuff;
mod tets;

pub use delaunay::random_delaunay;
pub use kuhn_box::{kuhn_box, kuhn_box_with_rule, mirrored_kuhn_box};
pub use tets::Tets;
