//! What is wanted of an improved mesh, and what became of it.

use super::ImproveError;
use crate::{generate::Tets, quality};

/// Targets and effort.
#[derive(Clone, Debug, PartialEq)]
pub struct ImproveSettings {
    /// No dihedral angle should be smaller, degrees; more than 0 and at most 60.
    pub least_angle_deg: f64,
    /// No dihedral angle should be larger, degrees; at least 80 and less than 180.
    pub greatest_angle_deg: f64,
    /// No cell's [`normalized_volume`](quality::normalized_volume) should be less; more than 0 and at most 1.
    pub least_quality: f64,
    /// Sweeps at most.
    pub sweeps: usize,
}

impl Default for ImproveSettings {
    fn default() -> Self {
        Self { least_angle_deg: 25.0, greatest_angle_deg: 138.0, least_quality: 0.45, sweeps: 12 }
    }
}

impl ImproveSettings {
    pub(super) fn check(&self) -> Result<(), ImproveError> {
        let refuse = |name, value, expected| Err(ImproveError::Setting { name, value, expected });
        if !(self.least_angle_deg > 0.0 && self.least_angle_deg <= 60.0) {
            return refuse("the least angle in degrees", self.least_angle_deg, "more than 0, at most 60");
        }
        if !(self.greatest_angle_deg >= 80.0 && self.greatest_angle_deg < 180.0) {
            return refuse("the greatest angle in degrees", self.greatest_angle_deg, "at least 80, less than 180");
        }
        if !(self.least_quality > 0.0 && self.least_quality <= 1.0) {
            return refuse("the least quality", self.least_quality, "more than 0, at most 1");
        }
        Ok(())
    }
}

/// One sweep, done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Its number, from one.
    pub number: usize,
    /// Edges removed, and facets.
    pub replaced: usize,
    /// Vertices moved.
    pub moved: usize,
    /// The largest ratio of what is wanted to what is, of all cells: one is as wanted, infinite is flat. Of small angles it
    /// is a ratio of `1 - cos`, of large ones of `1 + cos`, and otherwise of qualities.
    pub worst: f64,
}

/// The shapes of the cells of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// Smallest dihedral angle, degrees.
    pub min_deg: f64,
    /// Largest dihedral angle, degrees.
    pub max_deg: f64,
    /// Smallest [`normalized_volume`](quality::normalized_volume).
    pub min_quality: f64,
    /// Mean of the same.
    pub mean_quality: f64,
}

impl Angles {
    /// The shapes of the cells; of none, the best there are.
    pub fn of(tets: &Tets) -> Self {
        let mut all = Self { min_deg: 180.0, max_deg: 0.0, min_quality: 1.0, mean_quality: 1.0 };
        let mut sum = 0.0;
        for cell in &tets.cells {
            let corners = cell.map(|v| tets.points[v as usize]);
            let (min, max) = quality::angles_deg(&corners);
            let quality = quality::normalized_volume(&corners);
            (all.min_deg, all.max_deg) = (all.min_deg.min(min), all.max_deg.max(max));
            all.min_quality = all.min_quality.min(quality);
            sum += quality;
        }
        if !tets.cells.is_empty() {
            all.mean_quality = sum / tets.cells.len() as f64;
        }
        all
    }
}

/// What was done to a mesh.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ImproveReport {
    /// Shapes at first.
    pub before: Angles,
    /// Shapes at last.
    pub after: Angles,
    /// Sweeps done.
    pub sweeps: usize,
    /// Edges and facets removed.
    pub replaced: usize,
    /// Moves of vertices.
    pub moved: usize,
    /// Vertices of conforming borders that were not in their surface, and have therefore not been moved.
    pub astray: usize,
    /// Largest distance of a vertex of a conforming border from its surface at last, m.
    pub border_error: f64,
    /// Whether the caller's hook stopped the work.
    pub stopped: bool,
}

impl ImproveReport {
    pub(super) fn new(before: Angles, astray: usize) -> Self {
        Self { before, after: before, sweeps: 0, replaced: 0, moved: 0, astray, border_error: 0.0, stopped: false }
    }

    pub(super) fn add(&mut self, sweep: &Sweep) {
        self.sweeps = sweep.number;
        self.replaced += sweep.replaced;
        self.moved += sweep.moved;
    }
}
