//! From labels of cells to regions.

use super::complex::{Complex, OPEN};
use super::surface::Surface;
use super::{Border, GenerateError, Settings};
use crate::generate::Tets;
use crate::generate::implicit::Strata;

/// Regions of all cells, those of solids without a conforming border by the cells' centroids; without a background its cells
/// are left out.
pub(super) fn regions(
    complex: Complex,
    strata: &Strata,
    surfaces: &[Surface],
    settings: &Settings,
) -> Result<Tets, GenerateError> {
    let background = strata.background();
    let by_element: Vec<Surface> = (0..background)
        .filter(|i| settings.border(*i) == Border::ByElement)
        .map(|i| Surface::new(i, &*strata.solids()[i]))
        .collect();
    let mut regions = Vec::with_capacity(complex.cells.len());
    for (cell, label) in complex.cells.iter().zip(&complex.labels) {
        let mut region = if *label == OPEN { background } else { surfaces[*label as usize].solid };
        if by_element.first().is_some_and(|s| s.solid < region) {
            let centroid = complex.centroid(cell);
            for solid in by_element.iter().take_while(|s| s.solid < region) {
                if solid.side(&centroid, 0.0)? < 0.0 {
                    region = solid.solid;
                    break;
                }
            }
        }
        regions.push(region as u32);
    }
    let tets = Tets { points: complex.points, cells: complex.cells, regions };
    Ok(if settings.background { tets } else { without(tets, background as u32) })
}

/// The cells of other regions, with the vertices that they use in the order that they had.
fn without(tets: Tets, region: u32) -> Tets {
    let keeps = |i: &usize| tets.regions[*i] != region;
    let kept: Vec<usize> = (0..tets.cells.len()).filter(keeps).collect();
    let mut ids = vec![u32::MAX; tets.points.len()];
    kept.iter().flat_map(|i| tets.cells[*i]).for_each(|v| ids[v as usize] = 0);
    let mut points = Vec::new();
    for (id, point) in ids.iter_mut().zip(&tets.points).filter(|(id, _)| **id == 0) {
        *id = points.len() as u32;
        points.push(*point);
    }
    let cells = kept.iter().map(|i| tets.cells[*i].map(|v| ids[v as usize])).collect();
    Tets { points, cells, regions: kept.iter().map(|i| tets.regions[*i]).collect() }
}
