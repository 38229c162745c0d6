//! What a scene of a body is made of, as plain data. A stage that is `None` is neither built nor run.

use crate::order::VertexOrder;
use std::path::PathBuf;
use stylet_scene::Row;

/// A scene of a body. All lengths in m, forces in N, moduli in Pa, angles in rad.
///
/// Rows of `[[region]]`, `[[constraint]]` and `[[load]]` are kept as they were read, and were checked one by one.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Scene {
    /// The built-in name, or the stem of the file.
    pub name: String,
    /// What errors call the scene.
    pub label: String,
    /// The folder that `mesh.file` is relative to.
    pub folder: PathBuf,
    /// The mesh.
    pub mesh: MeshStage,
    /// The material of all that is in no region.
    pub material: MaterialStage,
    /// Other materials, by place.
    pub regions: Vec<Row>,
    /// Who may move how.
    pub constraints: Vec<Row>,
    /// Forces.
    pub loads: Vec<Row>,
    /// The body comes to rest.
    pub statics: Option<StaticsStage>,
    /// The body moves.
    pub time: Option<TimeStage>,
    /// How systems are solved.
    pub solver: SolverStage,
    /// Where nodes are at the start.
    pub start: Option<StartStage>,
    /// What is written while the scene runs.
    pub output: Option<OutputStage>,
}

/// `[mesh]`
#[derive(Clone, PartialEq, Debug)]
pub struct MeshStage {
    /// A file, instead of a box.
    pub file: Option<String>,
    /// Sides of the box, m: two or three.
    pub size: Vec<f64>,
    /// Its lower corner, m.
    pub origin: Vec<f64>,
    /// Parts along each side.
    pub cells: Vec<f64>,
    /// Thickness in two dimensions, m.
    pub thickness: f64,
    /// Whether faults of a file that have one remedy are put right.
    pub repair: bool,
    /// Numbers of the vertices of a box.
    pub order: VertexOrder,
}

impl Default for MeshStage {
    fn default() -> Self {
        let (size, cells) = (vec![0.1; 3], vec![4.0; 3]);
        Self { file: None, size, origin: Vec::new(), cells, thickness: 1.0, repair: false, order: VertexOrder::Made }
    }
}

/// What holds across the plane of a body in two dimensions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PlaneKind {
    /// No stress: a thin sheet, whose thickness adjusts.
    Stress,
    /// No strain: a slice of a long body.
    Strain,
}

/// `[material]`: what the scene says itself, so that what is said to no effect can be refused.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MaterialStage {
    /// One of [`Solid::MODELS`](stylet_physics::material::Solid::MODELS); left out: [`MODEL`](Self::MODEL).
    pub model: Option<String>,
    /// Young's modulus, Pa; left out: [`YOUNG`](Self::YOUNG).
    pub young: Option<f64>,
    /// Poisson's ratio; left out: [`POISSON`](Self::POISSON).
    pub poisson: Option<f64>,
    /// Density, kg/m^3; left out: [`DENSITY`](Self::DENSITY).
    pub density: Option<f64>,
    /// Viscosity over elasticity, s; left out: none.
    pub damping_time: Option<f64>,
    /// What a body in two dimensions is a section of; `None`: a thin sheet, in plane stress.
    pub plane: Option<PlaneKind>,
}

/// What a body is made of where nothing says otherwise.
impl MaterialStage {
    /// Constitutive law.
    pub const MODEL: &'static str = "neo-hookean";
    /// Young's modulus, Pa.
    pub const YOUNG: f64 = 34e3;
    /// Poisson's ratio.
    pub const POISSON: f64 = 0.34;
    /// Density, kg/m^3.
    pub const DENSITY: f64 = 1000.0;
}

/// How an equilibrium is found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Method {
    /// Linear conjugate gradients.
    Cg,
    /// `L Lᵀ` factors, for linear materials.
    Llt,
    /// `L D Lᵀ` factors, for linear materials.
    Ldlt,
    /// Newton-CG.
    NewtonCg,
    /// Nonlinear conjugate gradients, Polak-Ribière+.
    PolakRibiere,
    /// Nonlinear conjugate gradients, Fletcher-Reeves.
    FletcherReeves,
    /// Nonlinear conjugate gradients, Hager-Zhang.
    HagerZhang,
    /// Limited-memory BFGS.
    Lbfgs,
}

/// `[statics]`
#[derive(Clone, PartialEq, Debug)]
pub struct StaticsStage {
    /// `None`: `cg` for a linear material, `newton-cg` for others.
    pub method: Option<Method>,
    /// The first load step, as a share of the load.
    pub first_step: f64,
    /// The load step below which the solve gives up.
    pub smallest_step: f64,
}

impl Default for StaticsStage {
    fn default() -> Self {
        Self { method: None, first_step: 1.0, smallest_step: 1.0 / 1024.0 }
    }
}

/// How velocities and displacements follow from accelerations.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SchemeKind {
    /// Newmark's method with `beta` and `gamma`.
    Newmark,
    /// The trapezoid rule: Newmark's with 1/4 and 1/2.
    Trapezoid,
    /// Backward Euler.
    BackwardEuler,
}

/// How much an element has changed since its stiffness was evaluated.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LazyWord {
    /// The relative change of its deformation gradient.
    Strain,
    /// How much its stiffness may have changed, N/m.
    Stiffness,
    /// The published measure, N/m.
    Rotation,
}

/// What is solved in a step.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NewtonKind {
    /// The equation of motion linearised once.
    One,
    /// The equation of motion itself.
    Full,
}

/// How mass is given to the nodes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MassWord {
    /// In equal shares.
    Lumped,
    /// As the shape functions have it.
    Consistent,
}

/// `[time]`
#[derive(Clone, PartialEq, Debug)]
pub struct TimeStage {
    /// The step, s.
    pub dt: f64,
    /// The end, s.
    pub end: f64,
    /// The scheme.
    pub scheme: SchemeKind,
    /// Newmark's beta.
    pub beta: f64,
    /// Newmark's gamma.
    pub gamma: f64,
    /// One linearised step or full Newton.
    pub newton: NewtonKind,
    /// Newton steps per time step.
    pub newton_iterations: i64,
    /// Damping in proportion to the mass, 1/s.
    pub damping_mass: f64,
    /// Damping in proportion to the stiffness, s.
    pub damping_stiffness: f64,
    /// Mass at the nodes.
    pub mass: MassWord,
    /// Threshold up to which an element keeps its old stiffness; 0: none does.
    pub lazy: f64,
    /// What is compared with the threshold.
    pub lazy_measure: LazyWord,
    /// Largest displacement error of one step, m; 0: steps of one length.
    pub adaptive: f64,
}

impl Default for TimeStage {
    fn default() -> Self {
        Self {
            dt: 0.01,
            end: 1.0,
            scheme: SchemeKind::Trapezoid,
            beta: 0.25,
            gamma: 0.5,
            newton: NewtonKind::One,
            newton_iterations: 50,
            damping_mass: 0.0,
            damping_stiffness: 0.0,
            mass: MassWord::Lumped,
            lazy: 0.0,
            lazy_measure: LazyWord::Strain,
            adaptive: 0.0,
        }
    }
}

/// What iterations are preconditioned with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PreconditionerKind {
    /// Nothing.
    None,
    /// The diagonal.
    Jacobi,
    /// Diagonal blocks.
    BlockJacobi,
    /// Symmetric successive over-relaxation.
    Ssor,
    /// Incomplete Cholesky factors.
    IncompleteCholesky,
    /// Chebyshev smoothing.
    Chebyshev,
    /// Smoothed aggregation.
    Aggregation,
    /// The Cholesky factor itself.
    Factor,
}

/// `[solver]`
#[derive(Clone, PartialEq, Debug)]
pub struct SolverStage {
    /// The preconditioner.
    pub preconditioner: PreconditionerKind,
    /// Relative tolerance of the residual force.
    pub tolerance: f64,
    /// Most iterations per load step or time step.
    pub max_iterations: i64,
}

impl Default for SolverStage {
    fn default() -> Self {
        Self { preconditioner: PreconditionerKind::BlockJacobi, tolerance: 1e-6, max_iterations: 20_000 }
    }
}

/// Where free nodes are at the start.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shape {
    /// Where the mesh has them.
    Rest,
    /// All in the middle of the body.
    Point,
    /// In the middle plane across the last axis.
    Plane,
    /// On the middle line along the last axis.
    Line,
    /// Anywhere in the box around the body.
    Scramble,
}

/// `[start]`
#[derive(Clone, PartialEq, Debug)]
pub struct StartStage {
    /// The shape.
    pub shape: Shape,
    /// The seed of a scramble.
    pub seed: i64,
}

impl Default for StartStage {
    fn default() -> Self {
        Self { shape: Shape::Rest, seed: 1 }
    }
}

/// `[output]`
#[derive(Clone, PartialEq, Debug, Default)]
pub struct OutputStage {
    /// A VTU frame every so many steps; 0: the last state only.
    pub frames: i64,
    /// Times, s, whose states stand side by side in one picture.
    pub instants: Vec<f64>,
}
