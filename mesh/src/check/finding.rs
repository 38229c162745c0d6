//! What can be wrong with a mesh, by ids.

use serde::Serialize;
use std::fmt;

/// Lists are shown up to this many ids.
const SHOWN: usize = 12;

/// One fault of a raw mesh. Vertices and cells are named by their positions in the arrays given.
#[derive(Clone, PartialEq, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Finding {
    /// There is nothing to mesh.
    NoCells,
    /// More points or cells than ids can count; nothing else was looked for.
    TooMany {
        /// Points or cells.
        count: usize,
        /// The most that there may be.
        limit: usize,
    },
    /// A mesh was refused for a reason that has no name here.
    Refused {
        /// What was said.
        reason: String,
    },
    /// A coordinate that is not a number, infinite, or so large that volumes overflow.
    Coordinate {
        /// The vertex.
        vertex: u32,
        /// Axis, from zero.
        axis: usize,
        /// The coordinate.
        value: f64,
    },
    /// A cell names a vertex that does not exist.
    Index {
        /// The cell.
        cell: u32,
        /// The vertex that it names.
        vertex: u32,
        /// Number of vertices.
        n_vertices: usize,
    },
    /// A cell names a vertex twice.
    RepeatedVertex {
        /// The cell.
        cell: u32,
        /// The vertex.
        vertex: u32,
    },
    /// A cell without volume.
    Flat {
        /// The cell.
        cell: u32,
        /// The determinant of its edge vectors over the power of its longest edge: free of scale.
        relative_volume: f64,
    },
    /// A cell with the vertices of an earlier one.
    Duplicate {
        /// The later cell.
        cell: u32,
        /// The first with these vertices.
        of: u32,
    },
    /// A cell that winds against the majority: of all cells if they fill space, of those that it is joined with by facets
    /// if they are a surface or a rod.
    Inverted {
        /// The cell.
        cell: u32,
    },
    /// Most cells have a negative volume: the mesh is a mirror image, or follows another convention.
    Mirrored {
        /// How many cells do.
        cells: usize,
    },
    /// A surface with one side only, like Moebius' strip.
    NotOrientable {
        /// Two neighbours that wind differently however the cells of the surface are turned.
        cells: [u32; 2],
    },
    /// A facet with more than two cells.
    SharedFacet {
        /// Its vertices, ascending.
        facet: Vec<u32>,
        /// Its cells, ascending.
        cells: Vec<u32>,
    },
    /// Two cells on one side of their common facet.
    Overlap {
        /// Vertices of the facet, ascending.
        facet: Vec<u32>,
        /// The cells.
        cells: [u32; 2],
    },
    /// A vertex, an edge, ... in which parts of the mesh meet that larger faces do not join around it.
    Pinched {
        /// The vertices of the face, ascending.
        face: Vec<u32>,
        /// The cells around it, by parts that larger faces join.
        parts: Vec<Vec<u32>>,
    },
    /// A vertex that lies on the facet of a cell without being one of its vertices.
    Hanging {
        /// The vertex.
        vertex: u32,
        /// The cell.
        cell: u32,
        /// Vertices of the facet, ascending.
        facet: Vec<u32>,
    },
    /// A vertex that no cell names.
    Unused {
        /// The vertex.
        vertex: u32,
    },
    /// Several vertices in one place.
    Coincident {
        /// The vertices, ascending.
        vertices: Vec<u32>,
    },
    /// A part of the mesh that has no vertex in common with the largest part, nor with any other.
    Disconnected {
        /// Its cells, ascending.
        cells: Vec<u32>,
    },
}

impl Finding {
    /// Its sort, in a word or two.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::NoCells => "no cells",
            Self::TooMany { .. } => "too many",
            Self::Refused { .. } => "refused",
            Self::Coordinate { .. } => "coordinate",
            Self::Index { .. } => "index",
            Self::RepeatedVertex { .. } => "repeated vertex",
            Self::Flat { .. } => "flat",
            Self::Duplicate { .. } => "duplicate",
            Self::Inverted { .. } => "inverted",
            Self::Mirrored { .. } => "mirrored",
            Self::NotOrientable { .. } => "not orientable",
            Self::SharedFacet { .. } => "shared facet",
            Self::Overlap { .. } => "overlap",
            Self::Pinched { .. } => "pinched",
            Self::Hanging { .. } => "hanging",
            Self::Unused { .. } => "unused vertex",
            Self::Coincident { .. } => "coincident vertices",
            Self::Disconnected { .. } => "disconnected",
        }
    }

    /// Whether [`SimplexMesh::new`](crate::SimplexMesh::new) refuses a mesh for it.
    pub fn is_fatal(&self) -> bool {
        !matches!(
            self,
            Self::Inverted { .. }
                | Self::Mirrored { .. }
                | Self::NotOrientable { .. }
                | Self::Hanging { .. }
                | Self::Coincident { .. }
                | Self::Disconnected { .. }
        )
    }
}

/// One line. Of a long list of ids it names the first and counts the others.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoCells => write!(f, "there are no cells"),
            Self::TooMany { count, limit } => write!(f, "{count} points or cells: the limit is {limit}"),
            Self::Refused { reason } => write!(f, "{reason}"),
            Self::Coordinate { vertex, axis, value } => {
                write!(f, "vertex {vertex}: coordinate {axis} is {value:e}, not a finite number of a usual size")
            }
            Self::Index { cell, vertex, n_vertices } => {
                write!(f, "cell {cell}: names vertex {vertex}, but there are {n_vertices}")
            }
            Self::RepeatedVertex { cell, vertex } => write!(f, "cell {cell}: names vertex {vertex} twice"),
            Self::Flat { cell, relative_volume } => {
                write!(f, "cell {cell}: is flat, relative volume {relative_volume:e}")
            }
            Self::Duplicate { cell, of } => write!(f, "cell {cell}: has the same vertices as cell {of}"),
            Self::Inverted { cell } => write!(f, "cell {cell}: winds against the others"),
            Self::Mirrored { cells } => write!(f, "{cells} cells, most of them, have a negative volume"),
            Self::NotOrientable { cells: [a, b] } => {
                write!(f, "cells {a} and {b}: belong to a surface with one side only")
            }
            Self::SharedFacet { facet, cells } => write!(f, "cells {}: share facet {}", ids(cells), ids(facet)),
            Self::Overlap { facet, cells: [a, b] } => {
                write!(f, "cells {a} and {b}: lie on the same side of their facet {}", ids(facet))
            }
            Self::Pinched { face, parts } => {
                let what = if face.len() == 1 { "vertex" } else { "face" };
                write!(f, "{what} {}: {} parts meet only there:", ids(face), parts.len())?;
                let shown = parts.iter().take(SHOWN).enumerate();
                shown.into_iter().try_for_each(|(i, part)| {
                    let before = if i == 0 { " cells" } else { "; cells" };
                    write!(f, "{before} {}", ids(part))
                })
            }
            Self::Hanging { vertex, cell, facet } => {
                write!(f, "vertex {vertex}: lies on facet {} of cell {cell}, which does not name it", ids(facet))
            }
            Self::Unused { vertex } => write!(f, "vertex {vertex}: no cell names it"),
            Self::Coincident { vertices } => write!(f, "vertices {}: are in one place", ids(vertices)),
            Self::Disconnected { cells } => {
                write!(f, "cells {}: are a part apart from the largest", ids(cells))
            }
        }
    }
}

/// Ids with blanks between them, the first few of many.
pub(super) fn ids(list: &[u32]) -> String {
    let mut text: Vec<String> = list.iter().take(SHOWN).map(u32::to_string).collect();
    if list.len() > SHOWN {
        text.push(format!("and {} more", list.len() - SHOWN));
    }
    text.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_name_ids_and_stay_short() {
        let finding = Finding::Pinched { face: vec![3], parts: vec![vec![0, 1], vec![7]] };
        assert_eq!(finding.to_string(), "vertex 3: 2 parts meet only there: cells 0 1; cells 7");
        let cells = (0..100).collect();
        let line = Finding::Disconnected { cells }.to_string();
        assert_eq!(line, "cells 0 1 2 3 4 5 6 7 8 9 10 11 and 88 more: are a part apart from the largest");
    }
}
