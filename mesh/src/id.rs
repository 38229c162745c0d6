//! Identifiers of vertices and cells.

use serde::{Deserialize, Serialize};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The identifier of slot `index`.
            ///
            /// # Panics
            /// If `index` does not fit in 32 bits; meshes refuse to grow that far.
            #[inline]
            pub fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("mesh slots fit in 32 bits"))
            }

            /// The slot, for indexing into arrays with one entry per slot.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id!(
    /// A vertex; stable for the life of the vertex.
    VertexId
);
id!(
    /// A simplex of the mesh; stable while the simplex is alive.
    CellId
);
