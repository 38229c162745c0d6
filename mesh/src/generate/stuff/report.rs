//! What was made, beside what was asked for.

use super::complex::Complex;
use super::grid::Grid;
use super::surface::Surface;
use super::{GenerateError, Settings};
use crate::generate::Tets;
use crate::generate::implicit::Strata;
use crate::geometry::signed_measure;

/// Points at which the volume of one solid is sampled.
const SAMPLES: u32 = 4096;
/// By what part of the sampled volume that of the mesh may differ without a warning, beside four standard deviations.
const TOLERANCE: f64 = 0.1;

/// Figures of a stuffed mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Cubes of the octree.
    pub n_cubes: usize,
    /// Edges of the cubes at conforming borders, m.
    pub cube: [f64; 3],
    /// By how many levels the largest cubes are coarser than those.
    pub coarser_levels: u8,
    /// By how many levels the smallest cubes are finer than those.
    pub finer_levels: u8,
    /// Volume of each region in the mesh, m^3; the last is the background's.
    pub volumes: Vec<f64>,
    /// Volume of each region from 4096 points in its solid's bounds, m^3; the background's is what is left of the box.
    pub sampled_volumes: Vec<f64>,
    /// The largest distance from a conforming surface of a vertex that stands for it, m.
    pub border_error: f64,
    /// What a user should look at.
    pub warnings: Vec<Warning>,
}

/// Something that the mesh does not show as it is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// The lattice is too coarse for a region.
    #[error(
        "solid {solid} has {in_mesh:.3e} m^3 in the mesh and {sampled:.3e} m^3 by sampling: the size is too coarse for its shape"
    )]
    Volume {
        /// The solid, by its place in the order.
        solid: usize,
        /// Volume of its cells, m^3.
        in_mesh: f64,
        /// Volume from sampling, m^3.
        sampled: f64,
    },
}

/// Measures a mesh.
pub(super) fn report(
    tets: &Tets,
    strata: &Strata,
    grid: &Grid,
    n_cubes: usize,
    border_error: f64,
    settings: &Settings,
) -> Result<Report, GenerateError> {
    let n = strata.background();
    let mut volumes = vec![0.0; n + 1];
    for (cell, region) in tets.cells.iter().zip(&tets.regions) {
        volumes[*region as usize] += signed_measure(&cell.map(|v| tets.points[v as usize]));
    }
    let (mut sampled_volumes, mut warnings) = (Vec::with_capacity(n + 1), Vec::new());
    for solid in 0..n {
        let (sampled, deviation) = sample(strata, solid, grid.corners());
        sampled_volumes.push(sampled);
        if volumes[solid] == 0.0 {
            return Err(GenerateError::NoCells { solid, size: settings.size });
        }
        if (volumes[solid] - sampled).abs() > TOLERANCE * sampled + 4.0 * deviation {
            warnings.push(Warning::Volume { solid, in_mesh: volumes[solid], sampled });
        }
    }
    sampled_volumes.push(grid.volume() - sampled_volumes.iter().sum::<f64>());
    Ok(Report {
        n_cubes,
        cube: grid.edges(grid.border),
        coarser_levels: grid.border,
        finer_levels: grid.depth - grid.border,
        volumes,
        sampled_volumes,
        border_error,
        warnings,
    })
}

/// The volume of a region and the standard deviation of that estimate, m^3, from points spread evenly over the part of its
/// solid's bounds in a box: multiples of the powers of the plastic constant's sister in three dimensions.
///
/// Source: Roberts, *The unreasonable effectiveness of quasirandom sequences* (2018).
fn sample(strata: &Strata, solid: usize, [mut lower, mut upper]: [[f64; 3]; 2]) -> (f64, f64) {
    // The root of x^4 = x + 1.
    const G: f64 = 1.220_744_084_605_759_5;
    if let Some([low, high]) = strata.solids()[solid].bounds() {
        lower = std::array::from_fn(|k| lower[k].max(low[k]));
        upper = std::array::from_fn(|k| upper[k].min(high[k]));
    }
    if (0..3).any(|k| lower[k] >= upper[k]) {
        return (0.0, 0.0);
    }
    let volume: f64 = (0..3).map(|k| upper[k] - lower[k]).product();
    let holds = |i: u32| {
        let p = std::array::from_fn(|k| {
            let part = (0.5 + f64::from(i) * G.powi(-(k as i32) - 1)).fract();
            lower[k] + part * (upper[k] - lower[k])
        });
        strata.region(&p) == solid
    };
    let part = (0..SAMPLES).filter(|i| holds(*i)).count() as f64 / f64::from(SAMPLES);
    (part * volume, (part * (1.0 - part) / f64::from(SAMPLES)).sqrt() * volume)
}

/// The largest distance of a vertex from a surface that it stands for, m.
pub(super) fn border_error(complex: &Complex, surfaces: &[Surface]) -> Result<f64, GenerateError> {
    let mut largest = 0.0_f64;
    for (point, vertex) in complex.points.iter().zip(&complex.vertices).filter(|(_, v)| v.on != 0) {
        for (i, surface) in surfaces.iter().enumerate() {
            if vertex.on >> i & 1 == 1 {
                largest = largest.max(surface.value(point)?.abs());
            }
        }
    }
    Ok(largest)
}
