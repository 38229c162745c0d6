//! Start meshes of simple domains.

mod kuhn_box;

pub use kuhn_box::kuhn_box;
