//! TetGen and Triangle: points in `.node`, cells in `.ele`, boundary faces in `.face`, segments in `.edge`.
//!
//! Source of the formats: Si, *TetGen, a quality tetrahedral mesh generator, version 1.6 user's manual* (2020), section
//! on file formats; Shewchuk's Triangle writes the same files in two dimensions, with triangles in `.ele`.
//!
//! | in the files | in [`MeshData`](super::MeshData) |
//! |---|---|
//! | attributes of points | point fields `attribute 1`, ... of one component |
//! | boundary markers of points | the point field `boundary marker` |
//! | the first attribute of cells, if all are whole numbers | regions of the cells |
//! | other attributes of cells | cell fields `attribute 1`, ...; NaN for faces and segments |
//! | boundary markers of faces and segments | regions of these |

mod read;
mod write;

pub(super) use read::read;
pub(super) use write::write;

/// What a point's boundary marker is called as a field.
const MARKER: &str = "boundary marker";

/// The contents of the files of one mesh, for [`read_tetgen`](super::read_tetgen).
#[derive(Clone, Copy, Debug, Default)]
pub struct TetgenFiles<'a> {
    /// The points.
    pub node: &'a [u8],
    /// Tetrahedra, or triangles in two dimensions.
    pub ele: Option<&'a [u8]>,
    /// Triangles in three dimensions.
    pub face: Option<&'a [u8]>,
    /// Segments.
    pub edge: Option<&'a [u8]>,
}

/// The extensions, in the order of the fields of [`TetgenFiles`].
pub(super) const EXTENSIONS: [&str; 4] = ["node", "ele", "face", "edge"];
