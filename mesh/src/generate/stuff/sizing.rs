//! How small each cube has to be.

use super::grid::{Grid, estimate};
use super::octree::{Octant, Octree};
use super::surface::{Surface, holder};
use super::{Border, GenerateError, Settings, Step};
use crate::generate::implicit::Strata;
use crate::geometry::dot;

/// How many times too large an estimate of the final number of cubes may be that is extrapolated from large cubes.
const DOUBT: f64 = 8.0;
/// Cubes that a surface misses by no more than this factor of their width count as met: surfaces are curved.
const MARGIN: f64 = 1.1;

/// Divides the box into cubes: at borders of conforming solids and in named places as small as asked for, elsewhere as
/// large as the balance allows.
pub(super) fn cubes(
    grid: &Grid,
    strata: &Strata,
    surfaces: &[Surface],
    settings: &Settings,
    begin: &mut dyn FnMut(Step) -> Result<(), GenerateError>,
) -> Result<Octree, GenerateError> {
    let sizing = Sizing::new(grid, strata, surfaces, settings);
    let mut octree = Octree::new(grid);
    for level in 0..grid.depth {
        begin(Step::Cubes { level })?;
        let mut marked = Vec::new();
        for (i, octant) in octree.octants.iter().enumerate() {
            if octant.level == level && sizing.level(octant)? > level {
                marked.push(i);
            }
        }
        sizing.check_count(&octree, marked.len(), level)?;
        marked.into_iter().for_each(|i| octree.split(i));
    }
    octree.balance();
    // Where the distance is too large, a surface may have been missed: then the labels of some sites of a cube differ.
    loop {
        let mut marked = Vec::new();
        for (i, octant) in octree.octants.iter().enumerate() {
            if octant.is_leaf() && octant.level < grid.border && sizing.is_divided(octant)? {
                marked.push(i);
            }
        }
        sizing.check_count(&octree, marked.len(), grid.border.saturating_sub(1))?;
        if marked.is_empty() {
            return Ok(octree);
        }
        marked.into_iter().for_each(|i| octree.split(i));
        octree.balance();
    }
}

/// What asks for a size.
struct Sizing<'a> {
    grid: &'a Grid,
    settings: &'a Settings,
    /// All solids in order: does the border conform, and the level asked for inside.
    solids: Vec<(Surface<'a>, bool, u8)>,
    conforming: &'a [Surface<'a>],
    refinements: Vec<(Surface<'a>, u8)>,
}

impl<'a> Sizing<'a> {
    fn new(grid: &'a Grid, strata: &'a Strata, conforming: &'a [Surface<'a>], settings: &'a Settings) -> Self {
        let inside = |i: usize| settings.solids.get(i).and_then(|s| s.size).map_or(0, |size| grid.level(size));
        let solids = strata.solids().iter().enumerate();
        let solids = solids.map(|(i, s)| (Surface::new(i, &**s), settings.border(i) == Border::Conforming, inside(i)));
        let refinements = settings.refinements.iter().enumerate();
        let refinements = refinements.map(|(i, r)| (Surface::new(i, &*r.shape), grid.level(r.size)));
        Self { grid, settings, solids: solids.collect(), conforming, refinements: refinements.collect() }
    }

    /// The level that a cube's place asks for.
    fn level(&self, octant: &Octant) -> Result<u8, GenerateError> {
        let (centre, reach) = (self.grid.position(self.centre(octant)), self.grid.reach(octant.level));
        let mut level = 0;
        for (refinement, wanted) in &self.refinements {
            if *wanted > octant.level && refinement.value(&centre)? <= reach {
                level = level.max(*wanted);
            }
        }
        for (solid, conforms, inside) in &self.solids {
            let value = solid.value(&centre)?;
            if value > reach {
                continue;
            }
            level = level.max(*inside);
            if value < -reach {
                // Solids after this one have no say in its depth.
                break;
            }
            if *conforms && level.max(octant.level) < self.grid.border && self.is_met(octant, &centre, solid, value)? {
                level = self.grid.border;
            }
        }
        Ok(level)
    }

    /// Whether a surface meets a cube, if it is taken to be a plane: the distance of the centre is at most half the cube's
    /// width along the normal.
    fn is_met(&self, octant: &Octant, centre: &[f64; 3], solid: &Surface, value: f64) -> Result<bool, GenerateError> {
        let edges = self.grid.edges(octant.level);
        let slope = solid.slope(centre, [true; 3], 0.01 * edges[0])?;
        let steepness = dot(&slope, &slope).sqrt();
        let width: f64 = (0..3).map(|k| edges[k] * slope[k].abs()).sum();
        // In the middle of a solid, or where two surfaces are equally near, the slope says nothing.
        Ok(steepness < 0.5 || value.abs() <= 0.5 * MARGIN * width)
    }

    /// The centre of a cube.
    fn centre(&self, octant: &Octant) -> [i32; 3] {
        let side = 1 << (self.grid.depth - octant.level);
        octant.origin.map(|x| 2 * x as i32 + side)
    }

    /// Whether corners, middles of edges and faces and the centre of a cube belong to different conforming solids.
    fn is_divided(&self, octant: &Octant) -> Result<bool, GenerateError> {
        let (centre, side) = (self.centre(octant), 1 << (self.grid.depth - octant.level));
        let corner = |s: i32| self.grid.position(centre.map(|x| x + s * side));
        if !self.conforming.iter().any(|s| s.may_hold(&corner(-1), &corner(1))) {
            return Ok(false);
        }
        let first = holder(self.conforming, &self.grid.position(centre))?;
        for i in 0..27 {
            let step = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
            let site = std::array::from_fn(|k| centre[k] + step[k] * side);
            if holder(self.conforming, &self.grid.position(site))? != first {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Refuses a division into too many cubes before it is made.
    fn check_count(&self, octree: &Octree, marked: usize, level: u8) -> Result<(), GenerateError> {
        let (leaves, marked) = (octree.n_leaves as f64, marked as f64);
        let next = estimate(leaves + 7.0 * marked);
        // Each further level has at least four times the cubes of the one before, as a surface does.
        let last = estimate(leaves + 7.0 * marked * 4_f64.powi(i32::from(self.grid.depth) - i32::from(level) - 1));
        let limit = self.settings.limit();
        if next > limit as f64 || last > DOUBT * limit as f64 {
            return Err(GenerateError::TooManyTets { estimate: last, limit });
        }
        Ok(())
    }
}
