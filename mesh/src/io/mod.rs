//! Files: Gmsh, VTK, TetGen and STL, read and written with regions and fields, and ParaView's collections over time.
//!
//! [`read`] makes [`MeshData`] of a file and [`write()`] a file of them; each is checked against the other bit for bit. Readers
//! stop at what they do not understand, with an error that names the file, the line or byte, what was found and
//! what was expected; [`read_with_notes`] and [`write()`] say what they left out.
//!
//! | format | read | written as | regions | fields | lost when written |
//! |---|---|---|---|---|---|
//! | Gmsh 2.2, 4.1 (`.msh`) | text and binary of either byte order | text, binary | physical groups, names | node and element data | fields of more than 9 components; 2 become 3, and 4 to 8 become 9 |
//! | VTK XML (`.vtu`) | text, base64 and raw, inline or appended, plain or zlib, either byte order, many pieces | base64 | cell array `region` | yes | names of regions |
//! | legacy VTK (`.vtk`) | unstructured grids and polygonal data of versions 1 to 5, text and binary | text, binary of version 3.0 | cell array `region` | yes | names of regions |
//! | TetGen, Triangle (`.node`, `.ele`, `.face`, `.edge`) | numbered from 0 or 1, with comments | numbered from 0 | first attribute; boundary markers of faces | as attributes | names; cell fields of faces; the order of unlike cells |
//! | STL (`.stl`) | text and binary, vertices joined where equal | text, binary | a solid each (text) | none | fields; all but triangles; region numbers; in binary 29 bits of each coordinate, and regions |
//!
//! Only points, segments, triangles and tetrahedra of first order are read: anything else is an error that names the type
//! and the count. Text holds numbers in the shortest form that reads back as the same bits. A field entry that a file
//! leaves out (Gmsh, TetGen) is NaN. Memory is bounded by a small multiple of the file, whatever counts it states, but for
//! zlib, which can hold a thousand times its size.
//!
//! ```
//! use stylet_mesh::{SimplexMesh, io::{Format, read, write}};
//!
//! let folder = std::env::temp_dir().join("stylet-mesh-doc");
//! std::fs::create_dir_all(&folder)?;
//! let path = folder.join("square.msh");
//! std::fs::write(&path, "$MeshFormat\n2.2 0 8\n$EndMeshFormat
//! $Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n9 0 1 0\n$EndNodes
//! $Elements\n2\n1 2 2 7 1 1 2 3\n2 2 2 8 1 1 3 9\n$EndElements\n")?;
//!
//! let data = read(&path)?;
//! let triangles = data.submesh::<2, 3>();
//! assert_eq!(triangles.regions, [7, 8]);
//! let mesh = SimplexMesh::<2, 3>::new(triangles.points, triangles.cells)?;
//! assert_eq!(mesh.n_cells(), 2);
//!
//! let left_out = write(path.with_extension("vtk"), &data, Format::Vtk)?;
//! assert!(left_out.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`write_vtu`] writes a [`SimplexMesh`](crate::SimplexMesh) with fields for ParaView, [`Collection`] its frames.

mod atomic;
mod cursor;
mod data;
mod error;
mod fields;
mod format;
mod gmsh;
mod number;
mod pvd;
mod read;
mod stl;
mod tetgen;
mod vtk;
mod vtu;
mod write;

pub use data::{CellBlock, DataError, DataField, MeshData, RegionName, Submesh};
pub use error::{IoError, Place, Problem, ReadError};
pub use format::{Format, UnknownFormat};
pub use pvd::Collection;
pub use read::{read, read_bytes, read_tetgen, read_with_notes};
pub use tetgen::TetgenFiles;
pub use vtu::{Field, VtuData, write_vtu};
pub use write::write;
