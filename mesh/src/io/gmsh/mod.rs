//! Gmsh's MSH format, versions 2 and 4.1.
//!
//! Source: Geuzaine & Remacle, *Gmsh reference manual*, chapter on file formats. Physical groups are regions: an element
//! without one has region 0, and in version 4.1, where an entity may be in several groups, the first one counts.

mod elements;
mod ids;
mod names;
mod read;
mod read2;
mod read4;
mod read_fields;
mod stream;
mod write;
mod write2;
mod write4;
mod write_fields;

pub(super) use read::read;
pub(super) use write2::write as write_2;
pub(super) use write4::write as write_4;
