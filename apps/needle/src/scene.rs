//! What a needle scene is made of, as plain data. A stage that is `None` is neither built nor run.

use crate::needle::{Needle, direction};
use serde::{Deserialize, Serialize};
use stylet_physics::friction::{DensityError, LineDensity};

/// A scene of a needle in a square slab or in a cube. All lengths in m, forces in N, moduli in Pa, angles in rad.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Scene {
    /// The built-in name, or the stem of the file.
    pub name: String,
    /// The slab and its triangles, or the cube and its tetrahedra.
    pub mesh: MeshStage,
    /// What the slab is made of.
    pub material: MaterialStage,
    /// How the slab is held.
    pub support: SupportStage,
    /// How equilibria are found.
    pub solver: SolverStage,
    /// The needle: a line with a force density along its shaft.
    pub needle: Option<NeedleStage>,
    /// The force density applied once, as a static load.
    pub load: Option<LoadStage>,
    /// Stick-slip friction: the needle is inserted step by step.
    pub friction: Option<FrictionStage>,
    /// What is written while the scene runs.
    pub output: Option<OutputStage>,
}

/// What the needle is pushed into.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Tissue {
    /// A square slab of triangles, in plane stress.
    Slab,
    /// A cube of tetrahedra.
    Cube,
}

/// `[mesh]`
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct MeshStage {
    /// Slab or cube.
    pub kind: Tissue,
    /// Side of the square slab, or of the cube, m.
    pub side: f64,
    /// Thickness of the slab, m.
    pub thickness: f64,
    /// Level of the starting mesh: triangles with legs of `side * 2^-h_start`.
    pub h_start: i64,
    /// Level around the needle, at least `h_start`.
    pub h_ref: i64,
    /// Bisections of the cube's six tetrahedra around the needle.
    pub fold: i64,
}

impl Default for MeshStage {
    fn default() -> Self {
        Self { kind: Tissue::Slab, side: 0.1, thickness: 0.01, h_start: 3, h_ref: 6, fold: 12 }
    }
}

impl MeshStage {
    /// The leg of the triangles of a level, m.
    pub fn leg(&self, level: i64) -> f64 {
        self.side * 0.5f64.powi(level as i32)
    }

    /// The longest edge of the triangles of a level, m.
    pub fn longest_edge(&self, level: i64) -> f64 {
        self.leg(level) * std::f64::consts::SQRT_2
    }

    /// The size of the cells around the needle, m, the unit of [`NeedleStage::speed`]: the leg of the triangles; in a cube
    /// the edge of a cube of six tetrahedra after as many bisections, which is halved by three.
    pub fn h_ref(&self) -> f64 {
        match self.kind {
            Tissue::Slab => self.leg(self.h_ref),
            Tissue::Cube => self.side * (-self.fold as f64 / 3.0).exp2(),
        }
    }

    /// How fine the mesh is around the needle.
    pub fn around_needle(&self) -> Fineness {
        match self.kind {
            Tissue::Slab => Fineness::Size(self.longest_edge(self.h_ref)),
            Tissue::Cube => Fineness::Fold(self.fold as u16),
        }
    }

    /// The longest edge around the needle, m.
    pub fn longest_edge_around_needle(&self) -> f64 {
        match self.kind {
            Tissue::Slab => self.longest_edge(self.h_ref),
            // The first bisection halves the diagonal of a cube, the second one that of a face, the third one an edge.
            Tissue::Cube => self.leg(self.fold / 3) * ((3 - self.fold % 3) as f64).sqrt(),
        }
    }

    /// The longest edge of the starting mesh, m; `None` for the six tetrahedra of a cube.
    pub fn longest_edge_at_start(&self) -> Option<f64> {
        (self.kind == Tissue::Slab).then(|| self.longest_edge(self.h_start))
    }

    /// What the volume of a cell is multiplied by: the thickness of the slab, m; 1 for a cube.
    pub fn thickness(&self) -> f64 {
        match self.kind {
            Tissue::Slab => self.thickness,
            Tissue::Cube => 1.0,
        }
    }

    /// The area whose stress (6.9) measures rounding errors by, as two lengths, m: `d H` of a slab and, as section 6.6
    /// proposes for space, `H^2` of a cube, where `H` is its diameter.
    pub fn section(&self) -> [f64; 2] {
        match self.kind {
            Tissue::Slab => [self.thickness, self.side * std::f64::consts::SQRT_2],
            Tissue::Cube => [self.side * 3.0_f64.sqrt(); 2],
        }
    }

    /// Dimensions of space: 2 for a slab, 3 for a cube.
    pub fn dimensions(&self) -> usize {
        match self.kind {
            Tissue::Slab => 2,
            Tissue::Cube => 3,
        }
    }
}

/// When a cell that the needle touches is fine enough.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Fineness {
    /// When its longest edge is no longer than this, m.
    Size(f64),
    /// When this many bisections made it.
    Fold(u16),
}

/// The constitutive law of the tissue.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Model {
    /// Small-strain linear elasticity.
    Linear,
    /// St. Venant-Kirchhoff.
    StVenantKirchhoff,
    /// Neo-Hookean.
    NeoHookean,
}

impl Model {
    /// Its name, one of [`Solid::MODELS`](stylet_physics::material::Solid::MODELS).
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::StVenantKirchhoff => "st-venant-kirchhoff",
            Self::NeoHookean => "neo-hookean",
        }
    }
}

/// `[material]`
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct MaterialStage {
    /// The constitutive law.
    pub model: Model,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio, in [0, 0.5).
    pub poisson: f64,
}

impl Default for MaterialStage {
    fn default() -> Self {
        Self { model: Model::Linear, young: 34e3, poisson: 0.34 }
    }
}

/// A side of the slab or the cube. The last axis points up.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Side {
    /// x = 0.
    Left,
    /// x = side.
    Right,
    /// y = 0 of a slab, z = 0 of a cube.
    Bottom,
    /// y = side of a slab, z = side of a cube.
    Top,
    /// y = 0 of a cube.
    Front,
    /// y = side of a cube.
    Back,
}

impl Side {
    /// The axis across this side in so many dimensions, and whether it is the side far from the origin.
    pub fn plane(self, dimensions: usize) -> (usize, bool) {
        match self {
            Self::Left => (0, false),
            Self::Right => (0, true),
            Self::Bottom => (dimensions - 1, false),
            Self::Top => (dimensions - 1, true),
            Self::Front => (1, false),
            Self::Back => (1, true),
        }
    }
}

/// `[support]`
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct SupportStage {
    /// The side whose nodes are fixed.
    pub clamped: Side,
}

impl Default for SupportStage {
    fn default() -> Self {
        Self { clamped: Side::Right }
    }
}

/// How an equilibrium is found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Method {
    /// Projected linear conjugate gradients; for the linear material only.
    Cg,
    /// Projected nonlinear conjugate gradients.
    NonlinearCg,
    /// Projected Newton with an inner conjugate gradient solve.
    NewtonCg,
}

/// What conjugate gradients are preconditioned with.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum PreconditionerKind {
    /// Nothing.
    None,
    /// The diagonal.
    Jacobi,
    /// The diagonal blocks, restricted to each node's subspace.
    BlockJacobi,
}

/// The stopping criterion.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum CriterionKind {
    /// Against the external forces, equation (6.8).
    External,
    /// Against external forces and reactions, equation (6.9).
    Reaction,
}

/// `[solver]`
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct SolverStage {
    /// `None`: `cg` for the linear material, `newton-cg` for the others.
    pub method: Option<Method>,
    /// The preconditioner.
    pub preconditioner: PreconditionerKind,
    /// Relative tolerance of the residual force.
    pub tolerance: f64,
    /// The most iterations of one solve; the iterate is kept when they run out.
    pub max_iterations: i64,
    /// The stopping criterion.
    pub criterion: CriterionKind,
    /// Tolerance for rounding errors, eps_round of (6.9).
    pub round_off: f64,
}

impl Default for SolverStage {
    fn default() -> Self {
        Self {
            method: None,
            preconditioner: PreconditionerKind::BlockJacobi,
            tolerance: 1e-6,
            max_iterations: 10_000,
            criterion: CriterionKind::Reaction,
            round_off: 1e-8,
        }
    }
}

/// When the needle moves on.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Rearrange {
    /// After one rearrangement of the friction states, as published.
    Once,
    /// When no friction state changes any more.
    Settle,
}

/// One row of `[[needle.density]]`.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct DensityRow {
    /// Distance behind the tip, m.
    pub distance: f64,
    /// Force per length of the shaft, N/m.
    pub force: f64,
}

/// One row of `[[needle.motion]]`; linear between rows.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct MotionRow {
    /// Travel of the base since the start, m; it increases from row to row.
    pub depth: f64,
    /// How far the tip is inserted along the needle's axis, m.
    pub insert: f64,
    /// Sideways offset of the base, m, positive to the left of the needle.
    pub sleeve: f64,
}

/// `[needle]`
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct NeedleStage {
    /// The point of the boundary where the needle enters, m: a coordinate for each dimension.
    pub entry: Vec<f64>,
    /// Angle from the x axis, rad.
    pub angle: f64,
    /// Angle from the plane of the first two axes of a cube, rad.
    pub elevation: f64,
    /// Radius of the shaft, m; 0: a line.
    pub radius: f64,
    /// Length of the needle in the slab at the end of the insertion, m.
    pub depth: f64,
    /// Advance per cycle, in sizes of the cells around the needle ([`MeshStage::h_ref`]).
    pub speed: f64,
    /// When the needle moves on.
    pub rearrange: Rearrange,
    /// Whether needle nodes are moved onto the needle in the mesh.
    pub relocate: bool,
    /// Friction or load per length of the shaft.
    pub density: Vec<DensityRow>,
    /// Motion of the base; empty: straight in to `depth`.
    pub motion: Vec<MotionRow>,
}

impl Default for NeedleStage {
    /// The calibrated force density stands for the picture (Fig 6.4) of the thesis.
    fn default() -> Self {
        let row = |distance, force| DensityRow { distance, force };
        Self {
            entry: vec![0.0, 0.05],
            angle: 0.0,
            elevation: 0.0,
            radius: 0.0,
            depth: 0.07,
            speed: 0.1,
            rearrange: Rearrange::Settle,
            relocate: false,
            density: vec![row(0.0, 0.0), row(0.002, 90.0), row(0.004, 45.0)],
            motion: Vec::new(),
        }
    }
}

impl NeedleStage {
    /// The needle at its entry. Coordinates that the scene does not have are zero; a checked scene has all.
    pub fn needle<const D: usize>(&self) -> Needle<D> {
        let entry = std::array::from_fn(|k| self.entry.get(k).copied().unwrap_or(0.0));
        Needle::new(entry, direction(self.angle, self.elevation))
    }

    /// The force density along the shaft.
    ///
    /// # Errors
    /// [`DensityError`] if its rows make none.
    pub fn line_density(&self) -> Result<LineDensity, DensityError> {
        LineDensity::new(self.density.iter().map(|row| (row.distance, row.force)).collect())
    }
}

/// How a line load becomes nodal forces.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Distribution {
    /// Density at the node times half the distance to each neighbouring needle node.
    Lumped,
    /// Integrated exactly against the shape functions along the line.
    Consistent,
}

/// `[load]`
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct LoadStage {
    /// How the line load becomes nodal forces.
    pub distribution: Distribution,
}

impl Default for LoadStage {
    fn default() -> Self {
        Self { distribution: Distribution::Consistent }
    }
}

/// `[friction]`
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct FrictionStage {
    /// Static threshold over dynamic threshold.
    pub static_ratio: f64,
    /// A slipping node sticks when its elastic force falls below `1 + restick` times its dynamic threshold.
    pub restick: f64,
}

impl Default for FrictionStage {
    fn default() -> Self {
        Self { static_ratio: 2.0, restick: 0.02 }
    }
}

/// `[output]`
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct OutputStage {
    /// A VTU frame every so many cycles; 0: the last state only.
    pub frames: i64,
}
