//! Isosurface stuffing.

mod complex;
mod cut;
mod error;
mod grid;
mod lattice;
mod octree;
mod settings;
mod sizing;
mod split;
mod surface;
mod warp;

#[cfg(test)]
mod tests;

pub use error::GenerateError;
pub use settings::{Border, Refinement, Settings, SolidSettings};

use super::Tets;
use super::implicit::Strata;
use complex::{Complex, OPEN};
use grid::Grid;
use surface::Surface;

/// Solids whose borders conform, at most: one bit each.
const MAX_BORDERS: usize = 64;

/// Meshes a box of solids.
pub fn stuff(strata: &Strata, domain: [[f64; 3]; 2], settings: &Settings) -> Result<Tets, GenerateError> {
    settings.check(strata.solids().len())?;
    let grid = Grid::new(domain, settings)?;
    let surfaces: Vec<Surface> = strata
        .solids()
        .iter()
        .enumerate()
        .filter(|(i, _)| settings.border(*i) == Border::Conforming)
        .map(|(i, solid)| Surface::new(i, &**solid))
        .collect();
    if surfaces.len() > MAX_BORDERS {
        return Err(GenerateError::TooManyBorders { count: surfaces.len(), limit: MAX_BORDERS });
    }
    let octree = sizing::cubes(&grid, strata, &surfaces, settings)?;
    let mut complex = lattice::lattice(&grid, &octree);
    drop(octree);
    let scale = grid.edges(grid.border).into_iter().fold(f64::INFINITY, f64::min);
    for number in 0..surfaces.len() {
        cut::cut(&mut complex, &surfaces, number, scale)?;
    }
    Ok(finish(complex, strata, &surfaces))
}

fn finish(complex: Complex, strata: &Strata, surfaces: &[Surface]) -> Tets {
    let regions = complex
        .labels
        .iter()
        .map(|l| if *l == OPEN { strata.background() as u32 } else { surfaces[*l as usize].solid as u32 })
        .collect();
    Tets { points: complex.points, cells: complex.cells, regions }
}
