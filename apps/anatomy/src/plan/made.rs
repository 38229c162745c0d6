//! The work, and what came of it.

use super::{Plan, volume};
use std::ops::ControlFlow;
use std::time::Instant;
use stylet_mesh::generate::Tets;
use stylet_mesh::generate::improve::{Angles, ImproveError, ImproveReport, ImproveSettings, Sweep, improve};
use stylet_mesh::generate::stuff::{Border, GenerateError, Report, Step, Warning, stuff};
use stylet_mesh::io::RegionName;

/// How much is done after stuffing.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// Smoothing and edge removal; none leaves the mesh as it was stuffed.
    pub improve: Option<ImproveSettings>,
}

impl Default for Effort {
    fn default() -> Self {
        Self { improve: Some(ImproveSettings::default()) }
    }
}

/// What the work is about to do, or has done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// A step of stuffing, about to begin.
    Stuffing(Step),
    /// A sweep of improvement, done.
    Improving(Sweep),
    /// Measuring volumes, about to begin.
    Measuring,
}

/// A mesh and its figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Made {
    /// The mesh. Its regions are numbered as `regions` are.
    pub tets: Tets,
    /// The organs in order of precedence, and the background if it is meshed.
    pub regions: Vec<MadeRegion>,
    /// Of stuffing.
    pub stuffed: Report,
    /// Shapes straight from stuffing.
    pub straight: Angles,
    /// Of improvement.
    pub improved: Option<ImproveReport>,
    /// Seconds of stuffing and of improvement.
    pub seconds: [f64; 2],
}

/// A region of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MadeRegion {
    /// Its name.
    pub name: String,
    /// Whether facets of the mesh follow its surface.
    pub conforming: bool,
    /// Number of cells.
    pub cells: usize,
    /// Volume of its cells, m³.
    pub volume: f64,
    /// Its volume by its source, m³: of contours by the slices, of other solids by sampling.
    pub source_volume: f64,
}

/// Why there is no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// Contours of nothing.
    #[error("found no organ, expected at least one")]
    NoOrgan,
    /// An organ that there is not.
    #[error("found {name}, expected one of {known}")]
    UnknownOrgan {
        /// The name.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A solid that the lattice misses.
    #[error(
        "{name}: found no cell at size {size} m, expected some: it is empty, outside the box, hidden by what comes before \
         it, or thinner than the lattice"
    )]
    NoCells {
        /// The organ.
        name: String,
        /// Size of cells at borders, m.
        size: f64,
    },
    /// A distance that is not a number.
    #[error("{name}: the distance at {point:?} is not a number")]
    NotANumber {
        /// The organ.
        name: String,
        /// Where, m.
        point: [f64; 3],
    },
    /// Stuffing failed.
    #[error(transparent)]
    Stuffing(GenerateError),
    /// Improvement failed.
    #[error(transparent)]
    Improving(#[from] ImproveError),
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped,
}

impl Made {
    /// Largest distance of a vertex of a conforming border from its surface, m.
    pub fn border_error(&self) -> f64 {
        self.improved.as_ref().map_or(self.stuffed.border_error, |report| report.border_error)
    }

    /// What a user should look at, with names.
    pub fn warnings(&self) -> Vec<String> {
        let line = |warning: &Warning| match warning {
            Warning::Volume { solid, in_mesh, sampled } => format!(
                "{}: {in_mesh:.3e} m^3 in the mesh, {sampled:.3e} m^3 by sampling: the size is too coarse for its shape",
                self.regions[*solid].name
            ),
            other => other.to_string(),
        };
        self.stuffed.warnings.iter().map(line).collect()
    }

    /// Names of the regions, as files hold them.
    pub fn region_names(&self) -> Vec<RegionName> {
        let name = |(region, of): (usize, &MadeRegion)| RegionName {
            vertices_per_cell: 4,
            region: region as i32,
            name: of.name.clone(),
        };
        self.regions.iter().enumerate().map(name).collect()
    }
}

impl Plan {
    /// Makes the mesh. `hook` is told what goes on, and may stop the work; improvement that is stopped leaves a mesh.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn mesh(&self, effort: &Effort, hook: &mut dyn FnMut(Stage) -> ControlFlow<()>) -> Result<Made, PlanError> {
        let began = Instant::now();
        let stuffed = stuff(&self.strata, self.domain, &self.settings, &mut |step| hook(Stage::Stuffing(step)));
        let stuffed = stuffed.map_err(|error| self.name_error(error))?;
        let (mut tets, report) = (stuffed.tets, stuffed.report);
        let stuffing = began.elapsed().as_secs_f64();
        let straight = Angles::of(&tets);
        let began = Instant::now();
        let improved = match &effort.improve {
            None => None,
            Some(settings) => {
                let conforming: Vec<bool> = (0..self.organs.len()).map(|solid| self.conforms(solid)).collect();
                let mut tell = |sweep: &Sweep| hook(Stage::Improving(*sweep));
                Some(improve(&mut tets, &self.strata, &conforming, self.domain, settings, &mut tell)?)
            }
        };
        let seconds = [stuffing, began.elapsed().as_secs_f64()];
        if hook(Stage::Measuring).is_break() {
            return Err(PlanError::Stopped);
        }
        let regions = self.measure(&tets);
        Ok(Made { tets, regions, stuffed: report, straight, improved, seconds })
    }

    fn conforms(&self, solid: usize) -> bool {
        self.settings.border(solid) == Border::Conforming
    }

    fn measure(&self, tets: &Tets) -> Vec<MadeRegion> {
        let n = self.organs.len() + usize::from(self.background.is_some());
        let (mut cells, mut volumes) = (vec![0; n], vec![0.0; n]);
        for (cell, &region) in tets.cells.iter().zip(&tets.regions) {
            let corners = cell.map(|v| tets.points[v as usize]);
            cells[region as usize] += 1;
            volumes[region as usize] += stylet_mesh::geometry::signed_measure(&corners);
        }
        let [low, high] = self.domain;
        let mut rest: f64 = (0..3).map(|k| high[k] - low[k]).product();
        let region = |index: usize| {
            let organ = self.organs.get(index);
            let source_volume = match organ {
                None => rest,
                Some(organ) => organ.volume.unwrap_or_else(|| volume::sampled(&self.strata, index, self.domain)),
            };
            rest -= source_volume;
            MadeRegion {
                name: self.name(index).to_owned(),
                conforming: organ.is_some() && self.conforms(index),
                cells: cells[index],
                volume: volumes[index],
                source_volume,
            }
        };
        (0..n).map(region).collect()
    }

    fn name_error(&self, error: GenerateError) -> PlanError {
        match error {
            GenerateError::NoCells { solid, size } => PlanError::NoCells { name: self.name(solid).into(), size },
            GenerateError::NotANumber { solid, point } => {
                PlanError::NotANumber { name: self.name(solid).into(), point }
            }
            GenerateError::Cancelled => PlanError::Stopped,
            other => PlanError::Stuffing(other),
        }
    }
}
