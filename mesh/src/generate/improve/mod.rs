//! Better shaped tetrahedra, with every border kept in its surface.
//!
//! Sweeps of two kinds take turns: cells around an edge or at a facet are replaced by fewer, as many or more that cost less
//! (`edge`), then vertices move to where the cells around them cost less (`smooth`). What a cell costs rises steeply as
//! its angles and its quality miss the targets (`cost`); nothing is ever changed that costs more than before, so the
//! whole mesh gets better all the time. A vertex of a border moves along its surfaces and is put back onto them, a vertex of
//! a face or an edge of the box within it (`freedom`, `footing`).
//!
//! ```
//! use stylet_mesh::generate::{Tets, improve::{ImproveSettings, improve}, implicit::Strata, kuhn_box};
//! use std::ops::ControlFlow;
//!
//! let mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [4; 3])?;
//! let cells: Vec<[u32; 4]> = mesh.cells().map(|cell| mesh.oriented(cell).map(|v| v.index() as u32)).collect();
//! let mut tets = Tets { points: mesh.points().to_vec(), regions: vec![0; cells.len()], cells };
//! let nothing = Strata::new(vec![]);
//! let settings = ImproveSettings { least_angle_deg: 50.0, ..Default::default() };
//! let report =
//!     improve(&mut tets, &nothing, &[], [[0.0; 3], [1.0; 3]], &settings, &mut |_| ControlFlow::Continue(()))?;
//! assert!(report.after.min_quality >= report.before.min_quality);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod adjacency;
mod cost;
mod edge;
mod error;
mod footing;
mod freedom;
mod settings;
mod smooth;
#[cfg(test)]
mod tests;

pub use error::ImproveError;
pub use settings::{Angles, ImproveReport, ImproveSettings, Sweep};

use super::{Tets, implicit::Strata};
use crate::geometry::signed_measure;
use adjacency::{Complex, Stars};
use cost::{Cost, Targets};
use edge::Flipper;
use freedom::Freedoms;
use smooth::{Smoother, border_error};
use std::ops::ControlFlow;

/// Cells that cost more than this are tried for replacement.
const FLIP_ABOVE: f64 = 0.5;
/// Vertices of cells that cost more than this are moved.
const MOVE_ABOVE: f64 = 0.25;
/// Part of the cost of all cells that a sweep must save for another one to be worth it, where a cell misses its targets.
const WORTH_IT: f64 = 1e-3;
/// The same where none does.
const WORTH_IT_STILL: f64 = 1e-2;

/// Improves a mesh of solids in a box until its cells are as the settings want them, no more can be done, or all sweeps are.
///
/// `conforming` says of each solid whether the mesh's border with it lies in its surface; empty, all do. Vertices of the
/// borders of the others stay where they are. `bounds` (lowest, highest corner) is the box whose faces, edges and corners
/// vertices keep to. `progress` is called after each sweep, and can stop the work.
///
/// The result is the same, bit for bit, for the same input. Regions keep their cells, up to replacements within them, and
/// unused points stay in their places; numbers of cells change.
///
/// # Errors
/// Settings out of range, a mesh that is not conforming, or has a cell without positive volume. `tets` is then unchanged.
pub fn improve(
    tets: &mut Tets,
    strata: &Strata,
    conforming: &[bool],
    bounds: [[f64; 3]; 2],
    settings: &ImproveSettings,
    progress: &mut dyn FnMut(&Sweep) -> ControlFlow<()>,
) -> Result<ImproveReport, ImproveError> {
    settings.check()?;
    check(tets, strata, conforming, &bounds)?;
    let solids = strata.solids();
    let mut complex = Complex::new(tets)?;
    let mut stars = Stars::default();
    stars.rebuild(tets.points.len(), &complex);
    let conforms = |solid: u32| conforming.get(solid as usize).copied().unwrap_or(true);
    let freedoms = Freedoms::new(&tets.points, &complex, &stars, solids, conforms, &bounds);
    let mut targets = Targets::new(settings);
    let mut whole = Cost::NONE;
    tets.cells.iter().for_each(|cell| whole.add(&targets.cost_of(&tets.points, cell)));
    targets.allowed = whole.worst.map(|ratio| ratio.min(1.0));
    let mut report = ImproveReport::new(Angles::of(tets), freedoms.astray);
    let mut work = Work {
        points: &mut tets.points,
        targets,
        smoother: Smoother::new(targets, solids, &freedoms.of),
        flipper: Flipper::new(targets),
        marked: Vec::new(),
    };
    let mut paid = whole.sum;
    for number in 1..=settings.sweeps {
        let replaced = work.flip(&mut complex);
        if replaced > 0 {
            stars.rebuild(work.points.len(), &complex);
        }
        let moved = work.smooth(&complex, &stars);
        let cost = work.cost(&complex);
        let sweep = Sweep { number, replaced, moved, worst: cost.largest() };
        report.add(&sweep);
        report.stopped = progress(&sweep).is_break();
        let worth_it = if cost.largest() > 1.0 { WORTH_IT } else { WORTH_IT_STILL };
        if report.stopped || cost.sum > (1.0 - worth_it) * paid {
            break;
        }
        paid = cost.sum;
    }
    (tets.cells, tets.regions) = complex.into_cells();
    report.after = Angles::of(tets);
    report.border_error = border_error(&tets.points, &freedoms.of, solids);
    Ok(report)
}

/// A mesh in work.
struct Work<'a> {
    points: &'a mut Vec<[f64; 3]>,
    targets: Targets,
    smoother: Smoother<'a>,
    flipper: Flipper,
    /// Vertices to be moved.
    marked: Vec<bool>,
}

impl Work<'_> {
    /// Replaces what is worth it; the number of replacements.
    fn flip(&mut self, complex: &mut Complex) -> usize {
        let mut replaced = 0;
        for t in 0..complex.cells.len() as u32 {
            if complex.lives(t) && self.targets.cost_of(self.points, &complex.cells[t as usize]).sum > FLIP_ABOVE {
                replaced += usize::from(self.flipper.improve(self.points, complex, t));
            }
        }
        replaced
    }

    /// Moves the vertices of bad cells; the number of moves.
    fn smooth(&mut self, complex: &Complex, stars: &Stars) -> usize {
        self.marked.clear();
        self.marked.resize(self.points.len(), false);
        for cell in complex.live() {
            if self.targets.cost_of(self.points, cell).sum > MOVE_ABOVE {
                cell.iter().for_each(|&v| self.marked[v as usize] = true);
            }
        }
        let mut moved = 0;
        for v in 0..self.points.len() as u32 {
            if self.marked[v as usize] {
                moved += usize::from(self.smoother.relax(self.points, v, stars));
            }
        }
        moved
    }

    /// The cost of all cells.
    fn cost(&self, complex: &Complex) -> Cost {
        let mut whole = Cost::NONE;
        complex.live().for_each(|cell| whole.add(&self.targets.cost_of(self.points, cell)));
        whole
    }
}

/// Refuses what is no mesh of these solids in this box.
fn check(tets: &Tets, strata: &Strata, conforming: &[bool], [low, high]: &[[f64; 3]; 2]) -> Result<(), ImproveError> {
    for axis in 0..3 {
        let (low, high) = (low[axis], high[axis]);
        if !(low < high && (high - low).is_finite()) {
            return Err(ImproveError::Box { axis, low, high });
        }
    }
    let (n_cells, n_points, most) = (tets.cells.len(), tets.points.len(), strata.background());
    if !conforming.is_empty() && conforming.len() != strata.solids().len() {
        return Err(ImproveError::Conforming { expected: strata.solids().len(), found: conforming.len() });
    }
    if tets.regions.len() != n_cells {
        return Err(ImproveError::Regions { expected: n_cells, found: tets.regions.len() });
    }
    // Replacements may add cells, at most one for each there is; corners are counted in 32 bits.
    let limit = u32::MAX as usize / 8;
    if n_cells > limit {
        return Err(ImproveError::TooManyCells { found: n_cells, limit });
    }
    for (t, (cell, &region)) in tets.cells.iter().zip(&tets.regions).enumerate() {
        if region as usize > most {
            return Err(ImproveError::Region { cell: t, found: region, most });
        }
        if let Some(&point) = cell.iter().find(|&&v| v as usize >= n_points) {
            return Err(ImproveError::Index { cell: t, point, n_points });
        }
        let volume = signed_measure(&cell.map(|v| tets.points[v as usize]));
        // A NaN fails this test too.
        if !(volume > 0.0 && volume.is_finite()) {
            return Err(ImproveError::Volume { cell: t, volume });
        }
    }
    Ok(())
}
