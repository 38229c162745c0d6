//! What a scene of flexible needles is made of, as plain data.

use std::path::PathBuf;
use stylet_scene::{Row, Words};
use stylet_tissue::order::VertexOrder;

/// A scene. SI units, angles in rad.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Scene {
    /// The built-in name, or the stem of the file.
    pub name: String,
    /// What errors call the text.
    pub label: String,
    /// What paths in the file are relative to.
    pub folder: PathBuf,
    /// The tissue's mesh.
    pub mesh: MeshStage,
    /// What neither a region nor the shape says.
    pub material: MaterialStage,
    /// Materials by region.
    pub regions: Vec<Row>,
    /// What is held.
    pub support: SupportStage,
    /// Steps.
    pub time: TimeStage,
    /// How states and solutions are found.
    pub solver: SolverStage,
    /// The needles.
    pub needles: Vec<Row>,
    /// Forces between needle and tissue.
    pub friction: FrictionStage,
    /// Forces by region.
    pub friction_regions: Vec<Row>,
    /// Skins and capsules.
    pub membranes: Vec<Row>,
    /// Measured positions.
    pub marker_file: Option<String>,
    /// Points to track.
    pub points: Vec<Row>,
    /// What is written while the scene runs.
    pub output: OutputStage,
}

/// `[mesh]`
#[derive(Clone, PartialEq, Debug)]
pub struct MeshStage {
    /// A built-in shape, or a file of shapes.
    pub shape: Option<String>,
    /// Edge of its lattice's cubes at borders, m.
    pub resolution: Option<f64>,
    /// A mesh file.
    pub file: Option<String>,
    /// Sides of a box, m.
    pub size: Vec<f64>,
    /// Its lower corner, m.
    pub origin: Vec<f64>,
    /// Parts along each side.
    pub cells: Vec<f64>,
    /// Numbers of the vertices.
    pub order: VertexOrder,
}

impl Default for MeshStage {
    fn default() -> Self {
        let [size, origin, cells] = [vec![0.1; 3], vec![0.0; 3], vec![8.0; 3]];
        Self { shape: None, resolution: None, file: None, size, origin, cells, order: VertexOrder::Rcm }
    }
}

/// `[material]`: what the scene says itself, so that what is said to no effect can be refused.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MaterialStage {
    /// Constitutive law; left out: [`MODEL`](Self::MODEL).
    pub model: Option<String>,
    /// Young's modulus, Pa; left out: [`YOUNG`](Self::YOUNG).
    pub young: Option<f64>,
    /// Poisson's ratio; left out: [`POISSON`](Self::POISSON).
    pub poisson: Option<f64>,
    /// Density, kg/m^3; left out: [`DENSITY`](Self::DENSITY).
    pub density: Option<f64>,
    /// Viscosity over elasticity, s; left out: [`DAMPING_TIME`](Self::DAMPING_TIME).
    pub damping_time: Option<f64>,
}

/// What a tissue is made of where nothing says otherwise.
impl MaterialStage {
    /// Constitutive law.
    pub const MODEL: &'static str = "fixed-corotated";
    /// Young's modulus, Pa.
    pub const YOUNG: f64 = 15e3;
    /// Poisson's ratio.
    pub const POISSON: f64 = 0.45;
    /// Density, kg/m^3.
    pub const DENSITY: f64 = 1000.0;
    /// Viscosity over elasticity, s.
    pub const DAMPING_TIME: f64 = 0.01;
}

/// `[support]`
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SupportStage {
    /// Sides of the box around the body whose nodes are held, with commas between.
    pub sides: String,
}

/// How displacement and velocity follow from the acceleration.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SchemeKind {
    /// By beta and gamma.
    Newmark,
    /// Newmark with 1/4 and 1/2.
    #[default]
    Trapezoid,
    /// Backward Euler.
    BackwardEuler,
}

impl Words for SchemeKind {
    const WORDS: &'static [(&'static str, Self)] =
        &[("newmark", Self::Newmark), ("trapezoid", Self::Trapezoid), ("backward-euler", Self::BackwardEuler)];
}

/// How the change of an element is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum LazyWord {
    /// By its strain.
    #[default]
    Strain,
    /// By its stiffness.
    Stiffness,
    /// By eq. (12) of Chentanez et al. (2009).
    Rotation,
}

impl Words for LazyWord {
    const WORDS: &'static [(&'static str, Self)] =
        &[("strain", Self::Strain), ("stiffness", Self::Stiffness), ("rotation", Self::Rotation)];
}

/// Who sums which rows and forces.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum PartitionKind {
    /// Each thread a stretch of numbers of vertices.
    #[default]
    Numbers,
    /// Each thread a part of METIS.
    Metis,
}

impl Words for PartitionKind {
    const WORDS: &'static [(&'static str, Self)] = &[("numbers", Self::Numbers), ("metis", Self::Metis)];
}

/// `[time]`
#[derive(Clone, PartialEq, Debug)]
pub struct TimeStage {
    /// Step, s.
    pub dt: f64,
    /// End of the run, s; left out: the last row of a motion.
    pub end: Option<f64>,
    /// How many times as fast as written the needles move.
    pub pace: f64,
    /// Scheme of the tissue.
    pub scheme: SchemeKind,
    /// Newmark's beta.
    pub beta: f64,
    /// Newmark's gamma.
    pub gamma: f64,
    /// What resists the rate of deformation.
    pub damping: DampingKind,
    /// When the twist of needles that are bent by nature is taken.
    pub twist: TwistKind,
    /// Change up to which stiffness is kept.
    pub lazy: f64,
    /// What of an element.
    pub lazy_measure: LazyWord,
    /// How the tissue is shared by threads.
    pub partition: PartitionKind,
    /// How far a needle may slide in a part of a step, m; left out: half an edge of the mesh.
    pub reach: Option<f64>,
}

impl Default for TimeStage {
    fn default() -> Self {
        Self {
            dt: 0.02,
            end: None,
            pace: 1.0,
            scheme: SchemeKind::default(),
            beta: 0.25,
            gamma: 0.5,
            damping: DampingKind::default(),
            twist: TwistKind::default(),
            lazy: 0.05,
            lazy_measure: LazyWord::default(),
            partition: PartitionKind::default(),
            reach: None,
        }
    }
}

/// How the coupled system is solved.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum Coupling {
    /// In the null space of the constraints, with the exact block of the needles.
    #[default]
    NullSpace,
    /// Conjugate gradients on the indefinite matrix.
    KktCg,
    /// MINRES on it.
    KktMinres,
    /// Projected conjugate gradients, preconditioned by the constraints.
    Constraint,
}

impl Words for Coupling {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("null-space", Self::NullSpace),
        ("kkt-cg", Self::KktCg),
        ("kkt-minres", Self::KktMinres),
        ("constraint", Self::Constraint),
    ];
}

/// What resists the rate at which tissue deforms.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum DampingKind {
    /// The stiffness at the start of the step times the damping time, where that is the same everywhere; else viscosity.
    #[default]
    Tangent,
    /// Kelvin and Voigt's viscosity, evaluated anew in each step.
    Viscosity,
}

impl Words for DampingKind {
    const WORDS: &'static [(&'static str, Self)] = &[("tangent", Self::Tangent), ("viscosity", Self::Viscosity)];
}

/// What the tissue is preconditioned with.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum PreconditionerKind {
    /// The diagonal blocks.
    #[default]
    BlockJacobi,
    /// Aggregates that move as one.
    TwoLevel,
}

impl Words for PreconditionerKind {
    const WORDS: &'static [(&'static str, Self)] =
        &[("block-jacobi", Self::BlockJacobi), ("two-level", Self::TwoLevel)];
}

/// When twist is taken.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum TwistKind {
    /// At the start of the step, as published.
    #[default]
    Explicit,
    /// At its end, with the other forces.
    Implicit,
}

impl Words for TwistKind {
    const WORDS: &'static [(&'static str, Self)] = &[("explicit", Self::Explicit), ("implicit", Self::Implicit)];
}

/// How friction states are found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SearchKind {
    /// Trials, those that fail followed by what the exact block of the needles says of the next states.
    #[default]
    Trials,
    /// Algorithm 3 of Chentanez et al. (2009), and nothing else.
    Published,
    /// A complementarity solve on the condensed system.
    Condensed,
}

impl Words for SearchKind {
    const WORDS: &'static [(&'static str, Self)] =
        &[("trials", Self::Trials), ("published", Self::Published), ("condensed", Self::Condensed)];
}

/// `[solver]`
#[derive(Clone, PartialEq, Debug)]
pub struct SolverStage {
    /// Form of the coupled system.
    pub coupling: Coupling,
    /// Preconditioner of the tissue.
    pub preconditioner: PreconditionerKind,
    /// Relative residual of the solution.
    pub tolerance: f64,
    /// Relative residual at which states are judged first.
    pub check_tolerance: f64,
    /// States that are tried.
    pub max_trials: i64,
    /// How states are found.
    pub search: SearchKind,
    /// Budget of one solve.
    pub max_iterations: i64,
}

impl Default for SolverStage {
    fn default() -> Self {
        Self {
            coupling: Coupling::default(),
            preconditioner: PreconditionerKind::default(),
            tolerance: 1e-5,
            check_tolerance: 1e-3,
            max_trials: 10,
            search: SearchKind::default(),
            max_iterations: 10_000,
        }
    }
}

/// `[friction]`
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FrictionStage {
    /// Dynamic friction along the shaft, N/m.
    pub per_length: f64,
    /// Viscous friction along the shaft, N s/m^2.
    pub viscosity: f64,
    /// Force that the tip needs to cut, N.
    pub cutting: f64,
}

impl Default for FrictionStage {
    fn default() -> Self {
        Self { per_length: 12.0, viscosity: 200.0, cutting: 1.0 }
    }
}

/// `[output]`
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct OutputStage {
    /// A frame every so many steps; 0: the last state only.
    pub frames: i64,
}
