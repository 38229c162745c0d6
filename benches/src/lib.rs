//! Work-precision suites behind `stylet bench`, and criterion micro-benches.
//!
//! A suite answers one question with a table of ours beside the published values, a plot, and JSON of one common shape
//! ([`Report`]). Times are medians over repeats; failed runs are rows too.

mod conformance;
mod cube3d;
mod density;
mod fields;
mod insertion;
mod materials;
mod materials3d;
mod mesh;
mod page;
mod published;
mod report;
mod solvers;
mod speed;
mod stability;
mod timing;
mod tissue;
mod tolerance;
mod work_precision;

pub use report::{Figure, Machine, Numbers, Report, Row};
pub use timing::{Product, median, product_seconds};

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A question and the code that answers it.
#[derive(Debug)]
pub struct Suite {
    /// Its name on the command line.
    pub name: &'static str,
    /// The question, in a line.
    pub about: &'static str,
    /// Runs it.
    pub run: Run,
}

impl Suite {
    /// Names of the parts that it can be asked for, in their order; none where it is one whole.
    #[must_use]
    pub fn parts(&self) -> Vec<&'static str> {
        if self.name == "stability" { stability::parts() } else { Vec::new() }
    }
}

/// Runs a suite. The second argument is told what is being done.
pub type Run = fn(&BenchOptions, &mut dyn FnMut(&str)) -> Result<Report, BenchError>;

/// All suites.
pub const SUITES: &[Suite] = &[
    Suite { name: "tolerance", about: "error against the solver's tolerance (Table 6.1)", run: tolerance::run },
    Suite {
        name: "density",
        about: "iterations and error against mesh density (Tables 6.2, 6.3; Fig 6.10)",
        run: density::run,
    },
    Suite {
        name: "speed",
        about: "cycles, iterations and time against insertion speed (Tables 6.4, 6.5)",
        run: speed::run,
    },
    Suite {
        name: "conformance",
        about: "nodes beside the needle against relocated ones (Table 6.6)",
        run: conformance::run,
    },
    Suite { name: "materials", about: "three materials on one sideways insertion (Fig 6.12)", run: materials::run },
    Suite {
        name: "work-precision",
        about: "error against run time: methods x preconditioners x tolerances",
        run: work_precision::run,
    },
    Suite {
        name: "mesh",
        about: "the mesh layer: exact counts, times, bytes, long runs of the remesher",
        run: mesh::run,
    },
    Suite {
        name: "solvers",
        about: "the solver core: products, methods x preconditioners x tolerances, targets, a page of results",
        run: solvers::run,
    },
    Suite {
        name: "lazy-tissue",
        about: "lazy Jacobians of a dynamic body: share updated, time, error (Table 1 of Chentanez et al. 2009)",
        run: tissue::lazy::run,
    },
    Suite {
        name: "threads-tissue",
        about: "forces, Jacobian and step of a dynamic body by threads (Table 2 of Chentanez et al. 2009)",
        run: tissue::threads::run,
    },
    Suite {
        name: "friction-search",
        about: "which nodes of a flexible needle stick: trials and iterations (Table 3 of Chentanez et al. 2009)",
        run: insertion::search::run,
    },
    Suite {
        name: "lazy",
        about: "lazy Jacobians under a needle: share updated, time, tip error (Table 1 of Chentanez et al. 2009)",
        run: insertion::lazy::run,
    },
    Suite {
        name: "threads",
        about: "stages of a frame with a needle by threads (Table 2 of Chentanez et al. 2009), and its budget",
        run: insertion::threads::run,
    },
    Suite {
        name: "steering",
        about: "curvature of a bevelled wire's path against bevel, E, EI, step and mesh",
        run: insertion::steering::run,
    },
    Suite {
        name: "work-precision-insertion",
        about: "tip error against run time: steps, tolerances, thresholds, laws, coupling methods",
        run: insertion::precision::run,
    },
    Suite {
        name: "cube3d",
        about: "a needle in a cube beside one generation more: cells, force, tip, time (Figs 6.13, 6.14)",
        run: cube3d::run,
    },
    Suite {
        name: "materials3d",
        about: "every material on the same static scenes in 3D: force, displacement, error, iterations, time",
        run: materials3d::run,
    },
    Suite {
        name: "stability",
        about: "crushed, scrambled and inverted bodies, contrast, hostile input, threads, by material; a flexible needle in extremes (J1 to J12)",
        run: stability::run,
    },
];

/// How a suite is run.
#[derive(Clone, Debug, Default)]
pub struct BenchOptions {
    /// Fewer cases and repeats, in about a minute for all suites together.
    pub quick: bool,
    /// The only part of the suite to run, one of [`Suite::parts`]; all of them if absent.
    pub part: Option<String>,
    /// Where plots, tables and JSON go; nowhere if absent.
    pub out: Option<PathBuf>,
    /// The most threads that a run may use.
    pub threads: usize,
    /// Set to stop after the present run; the report then holds the rows so far.
    pub stop: Arc<AtomicBool>,
}

impl BenchOptions {
    /// Whether the user wants to stop.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Why a suite cannot be run at all; a run that fails is a row of the report instead.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// A scene that the suite builds on.
    #[error(transparent)]
    Needle(#[from] stylet_needle::NeedleError),
    /// A body that a suite builds.
    #[error(transparent)]
    Body(#[from] stylet_physics::body::BodyError),
    /// A step that a suite makes.
    #[error(transparent)]
    Dynamics(#[from] stylet_physics::dynamics::DynamicsError),
    /// A partition that a suite asks for.
    #[error(transparent)]
    Partition(#[from] stylet_solver::partition::PartitionError),
    /// A run of a flexible needle that cannot be set up.
    #[error(transparent)]
    Insertion(#[from] stylet_physics::insertion::InsertionError),
    /// A law with constants that it does not take.
    #[error("{model}: {error}")]
    Material {
        /// The law.
        model: &'static str,
        /// What is wrong.
        error: stylet_physics::material::MaterialError,
    },
    /// Shapes that a suite meshes.
    #[error(transparent)]
    Scene(#[from] stylet_scene::SceneError),
    /// Their mesh.
    #[error(transparent)]
    Plan(#[from] stylet_anatomy::plan::PlanError),
    /// A mesh that makes no sense.
    #[error(transparent)]
    Mesh(#[from] stylet_mesh::MeshError),
    /// A plot.
    #[error(transparent)]
    Plot(#[from] stylet_plot::PlotError),
    /// A file or folder that cannot be written.
    #[error("{path}: {reason}")]
    Output {
        /// The file or folder.
        path: String,
        /// What the system says.
        reason: String,
    },
}
