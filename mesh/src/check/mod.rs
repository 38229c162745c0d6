//! Raw meshes: everything that is wrong with points and cells given as arrays, and what can be put right.
//!
//! [`SimplexMesh::new`](crate::SimplexMesh::new) refuses a mesh at its first fault; [`check`] lists all of them by their
//! ids, together with faults that `new` does not look for, and [`repair`] removes those that have one remedy.
//!
//! | finding | a mesh can be made | [`repair`] |
//! |---|---|---|
//! | coordinate, index, repeated vertex, flat, duplicate | no | removes the cell |
//! | unused vertex | no | drops the vertex |
//! | shared facet, overlap, pinched | no | - |
//! | inverted, mirrored | yes | turns the winding |
//! | coincident vertices | yes | merges them if asked to |
//! | not orientable, hanging, disconnected | yes | - |
//!
//! ```
//! use stylet_mesh::check::{CheckSettings, Finding, RepairSettings, check, repair};
//!
//! let points = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [9.0, 9.0]];
//! let cells = vec![[0, 1, 2], [1, 2, 3], [1, 1, 3]]; // the second winds the other way
//! let report = check(&points, &cells, &CheckSettings::default());
//! let expected = [
//!     Finding::RepeatedVertex { cell: 2, vertex: 1 },
//!     Finding::Inverted { cell: 1 },
//!     Finding::Unused { vertex: 4 },
//! ];
//! assert_eq!(report.findings, expected);
//!
//! let repaired = repair(&points, &cells, &RepairSettings::default());
//! assert_eq!(repaired.cells, [[0, 1, 2], [1, 3, 2]]);
//! assert!(check(&repaired.points, &repaired.cells, &CheckSettings::default()).is_clean());
//! ```

mod cells;
mod coincide;
mod finding;
mod groups;
mod hanging;
mod joints;
mod parts;
mod repair;
mod winding;

pub use finding::Finding;
pub use repair::{Repair, RepairSettings, Repaired, repair};

use crate::geometry::longest_edge2;
use crate::manifold::{self, Facet};
use crate::node::MAX_SLOTS;
use serde::Serialize;
use std::fmt;

/// How closely to look.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CheckSettings {
    /// Vertices nearer to each other than this part of the longest edge of the smallest cell coincide; at 0 only those with
    /// equal coordinates do.
    pub coincidence: f64,
}

impl Default for CheckSettings {
    fn default() -> Self {
        Self { coincidence: 1e-9 }
    }
}

/// What [`check`] found.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// Number of points given.
    pub n_points: usize,
    /// Number of cells given.
    pub n_cells: usize,
    /// Parts of the mesh that have no vertex in common; cells with indices out of range count in none.
    pub n_parts: usize,
    /// Everything found, one kind after the other in the order of [`Finding`], ascending by ids within a kind.
    pub findings: Vec<Finding>,
    /// Whether the search for hanging vertices came to its end. It is given up where boundary facets overlap so much that
    /// it would take time in the square of their number.
    pub hanging_searched: bool,
}

impl Report {
    /// Whether nothing was found.
    pub fn is_clean(&self) -> bool {
        self.findings.is_empty()
    }

    /// Whether [`SimplexMesh::new`](crate::SimplexMesh::new) makes a mesh of it.
    pub fn is_mesh(&self) -> bool {
        !self.findings.iter().any(Finding::is_fatal)
    }

    /// How many findings there are of each kind, in the order of [`findings`](Self::findings).
    pub fn counts(&self) -> Vec<(&'static str, usize)> {
        let same_kind = self.findings.chunk_by(|a, b| a.kind() == b.kind());
        same_kind.map(|group| (group[0].kind(), group.len())).collect()
    }
}

/// A line for each finding.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.findings.iter().try_for_each(|finding| writeln!(f, "{finding}"))
    }
}

/// Points and cells with what is known of them.
struct Raw<'a, const D: usize, const N: usize> {
    points: &'a [[f64; D]],
    cells: &'a [[u32; N]],
    /// Cells whose indices are in range and distinct, and that are not the repetition of another: they have facets.
    whole: Vec<bool>,
    /// Cells, among those, with finite coordinates and a volume: they have a shape.
    solid: Vec<bool>,
    /// The facets of the whole cells, sorted.
    facets: Vec<Facet<N>>,
}

impl<const D: usize, const N: usize> Raw<'_, D, N> {
    fn corners(&self, cell: u32) -> [[f64; D]; N] {
        self.cells[cell as usize].map(|v| self.points[v as usize])
    }

    /// The facets, by groups with the same vertices.
    fn facet_groups(&self) -> impl Iterator<Item = &[Facet<N>]> {
        self.facets.chunk_by(|f, g| f.vertices == g.vertices)
    }
}

/// Looks for everything that can be wrong with points and cells, given as indices of points.
///
/// Takes time in proportion to `n log n`. Flatness is judged as in [`SimplexMesh::new`](crate::SimplexMesh::new),
/// without regard to scale. Of a cell that cannot be one (an index out of range, a vertex twice, a repetition of another
/// cell) nothing further is said.
pub fn check<const D: usize, const N: usize>(
    points: &[[f64; D]],
    cells: &[[u32; N]],
    settings: &CheckSettings,
) -> Report {
    let mut report =
        Report { n_points: points.len(), n_cells: cells.len(), n_parts: 0, findings: vec![], hanging_searched: true };
    let findings = &mut report.findings;
    let count = cells.len().max(points.len());
    if count > MAX_SLOTS {
        findings.push(Finding::TooMany { count, limit: MAX_SLOTS });
        return report;
    }
    if cells.is_empty() {
        findings.push(Finding::NoCells);
    }
    let raw = inspect(points, cells, findings);
    winding::find(&raw, findings);
    joints::find(&raw, findings);
    report.hanging_searched = hanging::find(&raw, findings);
    parts::find_unused(&raw, findings);
    coincide::find(points, settings.coincidence * smallest_cell(&raw), findings);
    report.n_parts = parts::find_disconnected(&raw, findings);
    report
}

/// What can be said of cells one by one, and their facets.
fn inspect<'a, const D: usize, const N: usize>(
    points: &'a [[f64; D]],
    cells: &'a [[u32; N]],
    findings: &mut Vec<Finding>,
) -> Raw<'a, D, N> {
    let finite = cells::check_coordinates(points, findings);
    let mut whole = cells::check_indices(points.len(), cells, findings);
    let mut duplicates = cells::check_duplicates(cells, &mut whole);
    let solid = cells::check_flat(points, cells, &finite, &whole, findings);
    findings.append(&mut duplicates);
    let named = cells.iter().enumerate().filter(|&(cell, _)| whole[cell]);
    let facets = manifold::facets(named.map(|(cell, &v)| (cell as u32, v)));
    Raw { points, cells, whole, solid, facets }
}

/// The least among the longest edges of the solid cells; 0 without any.
fn smallest_cell<const D: usize, const N: usize>(raw: &Raw<'_, D, N>) -> f64 {
    let solid = (0..raw.cells.len() as u32).filter(|&cell| raw.solid[cell as usize]);
    let least = solid.map(|cell| longest_edge2(&raw.corners(cell))).reduce(f64::min);
    least.map_or(0.0, f64::sqrt)
}
