//! Files: VTK XML meshes and collections of them over time, as ParaView reads them.

mod atomic;
mod data;
mod pvd;
mod vtu;

pub use data::{CellBlock, DataField, MeshData, RegionName};
pub use pvd::Collection;
pub use vtu::{Field, VtuData, write_vtu};

use std::path::{Path, PathBuf};

/// Why a file could not be written. No file was left half written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IoError {
    /// The system refused.
    #[error("{}: {source}", path.display())]
    System {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The VTK writer refused.
    #[error("{}: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the writer said.
        reason: String,
    },
    /// VTK knows cells with two to four vertices in up to three dimensions.
    #[error("{}: VTK has no cells with {n} vertices in {d} dimensions", path.display())]
    Dimension {
        /// The file.
        path: PathBuf,
        /// Dimension of space.
        d: usize,
        /// Vertices per cell.
        n: usize,
    },
    /// A field without a name, or two fields of one name on points or on cells.
    #[error("{}: field name {name:?} is empty or taken", path.display())]
    Name {
        /// The file.
        path: PathBuf,
        /// The name.
        name: String,
    },
    /// A field of the wrong length.
    #[error("{}: field {name:?} has {found} numbers, expected were {entries} times {components}", path.display())]
    Length {
        /// The file.
        path: PathBuf,
        /// The field.
        name: String,
        /// Its length.
        found: usize,
        /// Vertices or live cells.
        entries: usize,
        /// Numbers per entry.
        components: usize,
    },
    /// A position that is not a finite number.
    #[error("{}: the displacement of vertex {vertex} is not finite", path.display())]
    Position {
        /// The file.
        path: PathBuf,
        /// The vertex.
        vertex: usize,
    },
    /// A time that is not a finite number.
    #[error("{}: time {time} of {file:?} is not finite", path.display())]
    Time {
        /// The collection.
        path: PathBuf,
        /// The file at that time.
        file: String,
        /// The time.
        time: f64,
    },
}

impl IoError {
    fn system(path: &Path, source: std::io::Error) -> Self {
        Self::System { path: path.to_path_buf(), source }
    }
}
