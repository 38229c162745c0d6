//! Isosurface stuffing: tetrahedra that fill solids given by functions of space, and the space around them.
//!
//! A box is divided into cubes of an octree, these into the tetrahedra of a graded body-centred cubic lattice, and the
//! tetrahedra along the surfaces of the solids. Both sides of a surface are kept, so that borders inside a body conform.
//!
//! ```text
//! Settings, box -> Grid      cubes per axis, levels
//!     + Strata  -> Octree    small cubes at borders and in named places, weak 2:1 balance
//!               -> Complex   vertices, tetrahedra of the lattice
//!               -> cut       for each conforming solid in order: cut points, warp, split, label
//!               -> Tets      regions of all cells, those of other solids by centroids
//! ```
//!
//! **Angles.** In a cubic lattice away from the faces of the box, a cell of one surface that has a vertex off that surface has
//! dihedral angles between 8.9 and 160 degrees, whatever the surface: an exhaustive search over the stencils of both sides
//! proves it, and is a test. A cell with all four vertices on the surface could be flat; a vertex is not moved onto the
//! surface where that would leave such a cell outside these bounds, and the cells around it may then have smaller angles.
//! Nothing is proved where lattice cells are stretched, at faces of the box that a surface crosses, where sizes change
//! across a border, and where several surfaces meet.
//!
//! **Several solids.** The surfaces are cut one after the other, each through what the solids before it have left. A vertex
//! in the surface of two solids, or in that of a solid and a face of the box, lies on both: it is found by Newton's method.
//! What is not exact there is in [`Report::border_error`]. Border facets are flat, so that a surface is met in vertices.
//!
//! Sources: Labelle & Shewchuk, *Isosurface stuffing: fast tetrahedral meshes with good dihedral angles*, ACM Trans. Graph.
//! 26(3) (2007). Two sides, faces of the box, several solids and the limits of warping are ours.

#[cfg(test)]
mod angles;
mod complex;
mod cut;
mod error;
mod grid;
mod label;
mod lattice;
mod octree;
mod report;
mod settings;
mod sizing;
mod split;
mod surface;
mod warp;

pub use error::GenerateError;
pub use report::{Report, Warning};
pub use settings::{Border, Refinement, Settings, SolidSettings};

use super::Tets;
use super::implicit::Strata;
use grid::Grid;
use std::ops::ControlFlow;
use surface::Surface;

/// Solids whose borders conform, at most: one bit each.
const MAX_BORDERS: usize = 64;

/// A mesh and its figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Stuffed {
    /// The mesh: conforming, of positive volumes. Regions are numbered as in [`Strata`].
    pub tets: Tets,
    /// What was made.
    pub report: Report,
}

/// What stuffing is about to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Step {
    /// Dividing the box into cubes of this level, the first of all being 0.
    Cubes {
        /// The level.
        level: u8,
    },
    /// Making the tetrahedra of the lattice.
    Lattice {
        /// Number of cubes.
        cubes: usize,
    },
    /// Cutting along the surface of a solid.
    Border {
        /// The solid, by its place in the order.
        solid: usize,
    },
    /// Finding regions and measuring.
    Regions,
}

/// Meshes the solids of `strata` in a box given by its lowest and highest corner, m.
///
/// Before each step `hook` is called and may stop the run. Where a surface passes through a vertex or between all vertices of
/// the lattice it is not seen: see [`Warning::Volume`] and [`GenerateError::NoCells`].
///
/// # Errors
/// [`GenerateError`], which names what was given and what is accepted.
pub fn stuff(
    strata: &Strata,
    domain: [[f64; 3]; 2],
    settings: &Settings,
    hook: &mut dyn FnMut(Step) -> ControlFlow<()>,
) -> Result<Stuffed, GenerateError> {
    settings.check(strata.solids().len())?;
    let grid = Grid::new(domain, settings)?;
    let conforms = |i: &usize| settings.border(*i) == Border::Conforming;
    let solids = (0..strata.background()).filter(conforms);
    let surfaces: Vec<Surface> = solids.map(|i| Surface::new(i, &*strata.solids()[i])).collect();
    if surfaces.len() > MAX_BORDERS {
        return Err(GenerateError::TooManyBorders { count: surfaces.len(), limit: MAX_BORDERS });
    }
    let mut begin = |step: Step| match hook(step) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(GenerateError::Cancelled),
    };
    let octree = sizing::cubes(&grid, strata, &surfaces, settings, &mut begin)?;
    begin(Step::Lattice { cubes: octree.n_leaves })?;
    let mut complex = lattice::lattice(&grid, &octree);
    let n_cubes = octree.n_leaves;
    drop(octree);
    let scale = grid.edges(grid.border).into_iter().fold(f64::INFINITY, f64::min);
    for number in 0..surfaces.len() {
        begin(Step::Border { solid: surfaces[number].solid })?;
        cut::cut(&mut complex, &surfaces, number, scale)?;
    }
    begin(Step::Regions)?;
    let border_error = report::border_error(&complex, &surfaces)?;
    let tets = label::regions(complex, strata, &surfaces, settings)?;
    let report = report::report(&tets, strata, &grid, n_cubes, border_error, settings)?;
    Ok(Stuffed { tets, report })
}
