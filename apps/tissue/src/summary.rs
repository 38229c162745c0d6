//! What a run says of itself at its end.

use crate::stages::Stages;
use serde::Serialize;

/// The run summary (`summary.json`, `stylet run --json`). SI units, angles in degrees where the name says so.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Summary {
    /// Version of this layout.
    pub schema: u32,
    /// Name of the scene.
    pub scene: String,
    /// Whether every solve reached its tolerance and the scene ran to its end, or to the last step that was asked for.
    pub converged: bool,
    /// Whether the run ended before the scene did.
    pub interrupted: bool,
    /// Why the run could not go on; absent where it could.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Numbers of displacement unknowns, fixed ones included.
    pub dofs: usize,
    /// Mesh vertices.
    pub nodes: usize,
    /// Simplices.
    pub elements: usize,
    /// Steps: cycles of an insertion, time steps, 1 for a static load.
    pub steps: usize,
    /// Threads that the run was allowed.
    pub threads: usize,
    /// Seconds of wall time in the steps, files excluded.
    pub wall_s: f64,
    /// Steps per second of wall time.
    pub update_hz: f64,
    /// Strain energy, J; null in JSON where a failed run has left the domain of its material.
    pub energy_j: f64,
    /// The solver's work.
    pub solver: SolverSummary,
    /// The needle; absent where the scene has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needle: Option<NeedleSummary>,
    /// Flexible needles, the first of which is also [`needle`](Self::needle); absent in other scenes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steering: Option<SteeringSummary>,
    /// The body at the end of a run; absent in a scene with a needle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<BodySummary>,
    /// Memory; absent where nobody counts it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<Bytes>,
    /// Displacements at the points asked for.
    pub probes: Vec<Probe>,
    /// Quality of the cells in the undeformed mesh.
    pub quality: QualitySummary,
    /// Seconds and calls of each stage that ran.
    pub stages: Stages,
}

/// The solver's work over all solves of a run.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct SolverSummary {
    /// Products with the stiffness matrix in conjugate gradient iterations.
    pub iterations_total: u64,
    /// Mean over all solves, those with no iteration included.
    pub iterations_mean: f64,
    /// The most in one solve.
    pub iterations_max: u64,
    /// Residual of the last solve over the force that (6.8) or (6.9) measures it against.
    pub relative_residual: f64,
    /// Solves that ran out of iterations.
    pub unconverged_solves: u64,
    /// Step or cycle of the first of them; 0 if there are none.
    pub first_unconverged_cycle: usize,
}

/// The needle at the end of a run; places and forces have a number per dimension.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct NeedleSummary {
    /// The tip, m.
    pub tip: Vec<f64>,
    /// The material point at the tip in the undeformed body, m; where the tip is outside, the tip itself.
    pub tip_reference: Vec<f64>,
    /// Force that holds the base, N: the sum of the forces that the needle exerts on the tissue.
    pub base_force: Vec<f64>,
    /// Moment of that force about the base, N m: one number in 2D, three in 3D.
    pub base_torque: Vec<f64>,
    /// Cycles of the loop, each of which is one rearrangement.
    pub rearrangements: usize,
    /// Positions of the base that were left although friction states still flipped within the solver's tolerance, or the
    /// friction of slipping nodes still drifted.
    pub unsettled: usize,
    /// Nodes on the needle.
    pub nodes: usize,
    /// Those of them that stick.
    pub sticking: usize,
}

/// What flexible needles did in a run.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct SteeringSummary {
    /// Time, s.
    pub time_s: f64,
    /// The needles at the end of the run.
    pub needles: Vec<FlexibleNeedle>,
    /// Trials of friction states by step: mean and most.
    pub trials_mean: f64,
    /// The most in one step.
    pub trials_max: u64,
    /// Parts that steps were made of, in all.
    pub substeps: u64,
    /// Parts that were given up and halved.
    pub halvings: u64,
    /// Share of the parts whose friction states satisfy all conditions.
    pub consistent_share: f64,
    /// Tips that the mesh could not follow at once.
    pub blocked: u64,
    /// Element stiffnesses that were evaluated.
    pub elements_updated: u64,
    /// Smallest and largest dihedral angle, degrees: of the undeformed mesh at rest, and of what needles changed in it while all that
    /// were inside had been there for more than twenty steps.
    pub angles_deg: [f64; 2],
    /// Median, 99th percentile and largest of the wall times of the steps, s.
    pub step_s: [f64; 3],
    /// Least distance of a shaft from fixed regions in the undeformed body, m, negative inside; null without any.
    pub clearance_m: Option<f64>,
    /// Marked points of the body, where they are at the end.
    pub markers: Vec<MarkerSummary>,
    /// Seeds that were left.
    pub seeds: Vec<SeedSummary>,
    /// A line each: what in the scene is hardly meant; what did not come about although the scene asks for it: needles that never
    /// cut, seeds that were not left.
    pub notes: Vec<String>,
    /// Against measured positions; absent without a file of them, or where none of them lies within the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marker_error: Option<MarkerError>,
}

/// A flexible needle at the end of a run.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct FlexibleNeedle {
    /// The tip, m.
    pub tip: Vec<f64>,
    /// The material point at the tip; where the tip is outside, the tip itself, m.
    pub tip_reference: Vec<f64>,
    /// Length in the tissue, m.
    pub depth_m: f64,
    /// The greatest length in the tissue in the run, m.
    pub max_depth_m: f64,
    /// Force of the sleeve on the needle, N.
    pub base_force: Vec<f64>,
    /// Moment of the sleeve about the base, N m.
    pub base_torque: Vec<f64>,
    /// The largest base force along the needle in the run, N.
    pub max_push_n: f64,
    /// Nodes shared with the tissue.
    pub nodes: usize,
    /// Those of them that stick.
    pub sticking: usize,
}

/// A marked point of the body.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct MarkerSummary {
    /// Its name.
    pub name: String,
    /// Where it is in the undeformed body, m.
    pub at: [f64; 3],
    /// Where it is at the end, m.
    pub place: [f64; 3],
    /// The least distance of a tip from it in the undeformed body, m; null if no tip was inside.
    pub closest_tip_m: Option<f64>,
}

/// A seed that a needle has left.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct SeedSummary {
    /// The needle, from 1.
    pub needle: usize,
    /// The depth that it was asked for, m.
    pub depth_m: f64,
    /// Its material point in the undeformed body, m.
    pub at: [f64; 3],
    /// Where it is at the end, m.
    pub place: [f64; 3],
}

/// Distances of markers from where they were measured.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct MarkerError {
    /// Positions that were compared.
    pub count: usize,
    /// Root of the mean square, m.
    pub rms_m: f64,
    /// The largest, m.
    pub max_m: f64,
    /// Shares below 1, 2 and 3 mm.
    pub below_1_mm: f64,
    /// Share below 2 mm.
    pub below_2_mm: f64,
    /// Share below 3 mm.
    pub below_3_mm: f64,
}

/// A body without a needle at the end of a run.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct BodySummary {
    /// Time, s; 0 in statics.
    pub time_s: f64,
    /// Kinetic energy, J.
    pub kinetic_energy_j: f64,
    /// Potential of the loads, J.
    pub load_energy_j: f64,
    /// Momentum, kg m/s; empty in statics.
    pub momentum: Vec<f64>,
    /// Largest displacement of a vertex, m.
    pub max_displacement_m: f64,
    /// Mean displacement of the volume, m.
    pub mean_displacement_m: Vec<f64>,
    /// Smallest det F.
    pub min_j: f64,
    /// Deformed volume, m^3; in plane stress with the thickness as it has become.
    pub volume_m3: f64,
    /// Free residual of the last solve, N, and what it was compared with.
    pub residual_n: f64,
    /// Steps of the nonlinear method (or of the linear one) in all.
    pub nonlinear_iterations: u64,
    /// Load steps that converged; 0 in dynamics.
    pub load_steps: usize,
    /// Load steps or time steps that failed and were tried again, shorter.
    pub failed_steps: u64,
    /// Element stiffnesses that were evaluated at a deformation; 0 for a linear material, which is assembled once.
    pub elements_linearized: u64,
    /// What looks wrong with the scene, a line each.
    pub warnings: Vec<String>,
}

/// Memory that mesh, body, matrices and state take, spare room included.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct Bytes {
    /// In all.
    pub total: usize,
    /// By element.
    pub per_element: f64,
}

/// A point of the undeformed body and its displacement, m.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Probe {
    /// The point.
    pub at: Vec<f64>,
    /// Its displacement.
    pub displacement: Vec<f64>,
}

/// Quality of a mesh.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct QualitySummary {
    /// The smallest angle: at vertices in 2D, between faces in 3D.
    pub min_angle_deg: f64,
    /// The largest angle.
    pub max_angle_deg: f64,
    /// The smallest quality; 1 for a regular simplex.
    pub min_quality: f64,
    /// Cells that the deformation has turned over (det F <= 0): a linear material does not resist that.
    pub inverted_elements: usize,
}
