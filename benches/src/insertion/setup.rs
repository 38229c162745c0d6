//! Tissue, needles and motions that the suites share: the five runs of Chentanez et al. (2009) and boxes of gel.

use crate::BenchError;
use std::ops::ControlFlow;
use std::time::Instant;
use stylet_anatomy::plan::{Effort, Plan, built_in};
use stylet_mesh::SimplexMesh;
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::{Body, Density, LazyRule, MassKind};
use stylet_physics::coupling::{CoupledSettings, CouplingMethod, SearchSettings};
use stylet_physics::dynamics::{Damping, DynamicsSettings};
use stylet_physics::insertion::{
    BaseMotion, Insertion, InsertionError, InsertionReport, Interaction, NeedleSettings, UniformInteraction,
};
use stylet_physics::material::Solid;
use stylet_physics::numbering::{in_reverse_cuthill_mckee_order, metis_parts};
use stylet_physics::rod::RodStiffness;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// Part of the mean edge of a mesh that a needle may slide in a step.
const REACH: f64 = 0.2;
/// Distance of the sleeve from the skin, and of the tip, m.
const SLEEVE: f64 = 0.045;
const BEFORE: f64 = 2e-3;
/// m/s.
pub(crate) const SPEED: f64 = 0.02;
/// Frame of the 2009 paper, s.
pub(crate) const FRAME: f64 = 0.02;
/// Damping time of all tissue, s.
const DAMPING: f64 = 0.01;

/// What a region is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stuff {
    /// Pa.
    pub young: f64,
    pub poisson: f64,
    /// kg/m³.
    pub density: f64,
}

/// A gel, as measured for the phantom of the paper's experiments or near it.
pub(crate) const GEL: Stuff = Stuff { young: 15e3, poisson: 0.45, density: 1030.0 };

/// A mesh, what its regions are made of, and what is held.
#[derive(Clone)]
pub(crate) struct Tissue {
    pub mesh: SimplexMesh<3, 4>,
    pub regions: Vec<(u32, Stuff)>,
    /// By vertex.
    pub held: Vec<bool>,
}

impl Tissue {
    /// A box of gel with its lowest corner at the origin; `is_held` tells what is held.
    pub fn gel_box(size: [f64; 3], cells: [usize; 3], gel: Stuff, is_held: impl Fn(&[f64; 3]) -> bool) -> Self {
        Self::of_gel(kuhn_box::<3, 4>([0.0; 3], size, cells).expect("a box"), gel, is_held)
    }

    /// A mesh of gel; `is_held` tells what is held.
    pub fn of_gel(mesh: SimplexMesh<3, 4>, gel: Stuff, is_held: impl Fn(&[f64; 3]) -> bool) -> Self {
        let held = mesh.points().iter().map(is_held).collect();
        Self { mesh, regions: vec![(0, gel)], held }
    }

    /// A built-in scene of shapes, finer by `refine`; its fixed organs are held, and what `is_held` tells.
    pub fn built_in(name: &str, refine: f64, is_held: impl Fn(&[f64; 3]) -> bool) -> Result<Self, BenchError> {
        let shapes = built_in(name).expect("a scene of this name")?;
        let plan = Plan::of_shapes(&shapes);
        let size = plan.settings.size / refine;
        let plan = plan.with_size(size);
        let made = plan.mesh(&Effort::default(), &mut |_| ControlFlow::Continue(()))?;
        let mesh = made.tets.into_mesh()?;
        let stuff = |region: usize| {
            let own = plan.organs.get(region).map_or(&shapes.background, |organ| &organ.material);
            let of = |mine: Option<f64>, all: Option<f64>, else_: f64| mine.or(all).unwrap_or(else_);
            Stuff {
                young: of(own.young, shapes.background.young, GEL.young),
                poisson: of(own.poisson, shapes.background.poisson, GEL.poisson),
                density: of(own.density, shapes.background.density, GEL.density),
            }
        };
        let mut present: Vec<u32> = mesh.cells().map(|cell| mesh.region(cell)).collect();
        present.sort_unstable();
        present.dedup();
        let regions = present.into_iter().map(|region| (region, stuff(region as usize))).collect();
        let mut held: Vec<bool> = mesh.points().iter().map(is_held).collect();
        for cell in mesh.cells() {
            if plan.organs.get(mesh.region(cell) as usize).is_some_and(|organ| organ.fixed) {
                mesh.cell(cell).iter().for_each(|vertex| held[vertex.index()] = true);
            }
        }
        Ok(Self { mesh, regions, held })
    }

    /// The same tissue with its vertices in reverse Cuthill-McKee order.
    pub fn in_rcm_order(&self) -> Self {
        let (mesh, order) = in_reverse_cuthill_mckee_order(&self.mesh).expect("a mesh as it was made");
        let held = order.new_to_old().iter().map(|&old| self.held[old as usize]).collect();
        Self { mesh, held, regions: self.regions.clone() }
    }

    /// Mean length of the edges, each as often as cells have it, m.
    pub fn mean_edge(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for cell in self.mesh.cells() {
            let x = self.mesh.corners(cell);
            for (i, k) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                sum += distance(&x[i], &x[k]);
                count += 1.0;
            }
        }
        sum / count
    }
}

/// How a run is computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Numerics {
    /// Step, s.
    pub dt: f64,
    /// Law of all regions, by its name.
    pub model: &'static str,
    /// Poisson's ratio of all regions, if not their own.
    pub poisson: Option<f64>,
    pub lazy: LazyRule,
    pub search: SearchSettings,
    pub coupling: CouplingMethod,
    /// Whether METIS says which thread sums which rows.
    pub metis: bool,
    /// Whether nodes are relieved of what unsymmetric cells do to forces along a needle.
    pub relieve_aside: bool,
}

impl Default for Numerics {
    fn default() -> Self {
        Self {
            dt: FRAME,
            model: "fixed-corotated",
            poisson: None,
            lazy: LazyRule::Always,
            search: SearchSettings::default(),
            coupling: CouplingMethod::NullSpace,
            metis: false,
            relieve_aside: true,
        }
    }
}

/// Friction and cutting, with a skin and a capsule that take more to cut.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Layers {
    pub within: UniformInteraction,
    /// Cutting force down to a depth along x, N and m.
    pub skin: (f64, f64),
    /// Cutting force and thickness of the capsule, N and m, around an ellipsoid with this centre and these semi-axes.
    pub capsule: Option<(f64, f64, [f64; 3], [f64; 3])>,
}

impl Interaction for Layers {
    fn friction(&self, _: u32, _: &[f64; 3]) -> f64 {
        self.within.friction
    }

    fn viscosity(&self, _: u32, _: &[f64; 3]) -> f64 {
        self.within.viscosity
    }

    fn cutting(&self, _: u32, at: &[f64; 3]) -> f64 {
        if at[0] < self.skin.1 {
            return self.skin.0;
        }
        let Some((force, thickness, centre, axes)) = self.capsule else { return self.within.cutting };
        // Distance to first order: (|q| - 1) / |grad |q||.
        let q: [f64; 3] = std::array::from_fn(|k| (at[k] - centre[k]) / axes[k]);
        let norm = length(&q);
        let gradient = length(&std::array::from_fn(|k| q[k] / axes[k])) / norm;
        if (norm - 1.0).abs() < 0.5 * thickness * gradient { force } else { self.within.cutting }
    }
}

/// A constant motion for a time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    /// s.
    pub seconds: f64,
    pub motion: BaseMotion,
}

impl Leg {
    pub fn insert(depth: f64, speed: f64) -> Self {
        Self {
            seconds: depth.abs() / speed,
            motion: BaseMotion { insert: speed.copysign(depth), ..BaseMotion::default() },
        }
    }

    pub fn hold(seconds: f64) -> Self {
        Self { seconds, motion: BaseMotion::default() }
    }

    /// Turns the base by an angle (rad) in half a second.
    pub fn turn(angle: f64) -> Self {
        Self { seconds: 0.5, motion: BaseMotion { spin: 2.0 * angle, ..BaseMotion::default() } }
    }
}

/// The motion of each step.
pub(crate) fn motions(legs: &[Leg], dt: f64) -> impl Iterator<Item = BaseMotion> + '_ {
    legs.iter().flat_map(move |leg| std::iter::repeat_n(leg.motion, (leg.seconds / dt).round() as usize))
}

/// A needle pushed into tissue and pulled out again.
#[derive(Clone)]
pub(crate) struct Scene {
    pub name: &'static str,
    pub tissue: Tissue,
    pub needle: NeedleSettings,
    pub layers: Layers,
    pub legs: Vec<Leg>,
}

impl Scene {
    /// The body at rest with the needle before it.
    pub fn start(&self, numerics: &Numerics, team: &Team) -> Result<Insertion<Solid>, BenchError> {
        self.start_with(numerics, team, self.layers)
    }

    /// The same with other forces on the needle.
    pub fn start_with(
        &self,
        numerics: &Numerics,
        team: &Team,
        forces: impl Interaction + 'static,
    ) -> Result<Insertion<Solid>, BenchError> {
        let solid = |stuff: &Stuff| {
            Solid::from_young_poisson(numerics.model, stuff.young, numerics.poisson.unwrap_or(stuff.poisson))
        };
        let refused = |error| BenchError::Material { model: numerics.model, error };
        let mut solids = Vec::new();
        for (region, stuff) in &self.tissue.regions {
            solids.push((*region, solid(stuff).map_err(refused)?));
        }
        let mut body = Body::with_materials(&self.tissue.mesh, &solids, 1.0)?;
        body.set_team(team);
        let densities: Vec<(u32, f64)> = self.tissue.regions.iter().map(|(id, stuff)| (*id, stuff.density)).collect();
        body.set_mass(MassKind::Lumped, &Density::ByRegion(densities))?;
        body.set_lazy_rule(numerics.lazy);
        if numerics.metis {
            body.set_partition(&metis_parts(&self.tissue.mesh, team.size())?)?;
        }
        let mut held = Subspace::new(self.tissue.mesh.n_vertex_slots());
        for vertex in (0..self.tissue.held.len()).filter(|&vertex| self.tissue.held[vertex]) {
            held.set(vertex, Constraint::Fixed).expect("a vertex of the mesh");
        }
        let settings = CoupledSettings {
            // As `stylet run` does where all tissues have one damping time: the tangents are there already.
            dynamics: DynamicsSettings {
                damping: Damping { mass: 0.0, stiffness: DAMPING },
                ..DynamicsSettings::new(numerics.dt)
            },
            search: numerics.search,
            coupling: numerics.coupling,
            relieve_aside: numerics.relieve_aside,
            ..CoupledSettings::new(numerics.dt, REACH * self.tissue.mean_edge())
        };
        let mut insertion = Insertion::new(self.tissue.mesh.clone(), body, held, settings, forces, [0.0; 3], team)?;
        insertion.add_needle(self.needle.clone())?;
        Ok(insertion)
    }

    /// Makes all steps; `after` sees each of them, with its report and the seconds that it took, and says whether to go on.
    pub fn follow(
        &self,
        insertion: &mut Insertion<Solid>,
        dt: f64,
        mut after: impl FnMut(&mut Insertion<Solid>, &InsertionReport, f64) -> ControlFlow<()>,
    ) -> Result<(), InsertionError> {
        for motion in motions(&self.legs, dt) {
            let since = Instant::now();
            let report = insertion.step(&[motion], dt)?;
            if after(insertion, &report, since.elapsed().as_secs_f64()).is_break() {
                break;
            }
        }
        Ok(())
    }
}

/// The steerable wire of the paper: 0.83 mm of nitinol with a bevel (rad), its tip a little before `entry`, along x.
pub(crate) fn wire(entry: [f64; 3], bevel: f64) -> NeedleSettings {
    let base = [entry[0] - SLEEVE, entry[1], entry[2]];
    let needle = NeedleSettings::nitinol(base, [1.0, 0.0, 0.0]).expect("a round wire");
    NeedleSettings { length: SLEEVE - BEFORE, edge: 5e-3, bevel, bevel_direction: [0.0, 1.0, 0.0], ..needle }
}

/// A tube of 18 gauge with a symmetric tip.
pub(crate) fn tube(entry: [f64; 3]) -> NeedleSettings {
    let stiffness = RodStiffness::tube(200e9, 0.3, 1.27e-3, 0.838e-3).expect("a tube");
    NeedleSettings { stiffness, linear_density: 5.6e-3, ..wire(entry, 0.0) }
}

/// Pushes, holds, pulls out until all of the needle is outside.
fn in_and_out(depth: f64, turn: bool) -> Vec<Leg> {
    let way = depth + BEFORE;
    let mut legs = if turn {
        vec![Leg::insert(0.5 * way, SPEED), Leg::turn(std::f64::consts::PI), Leg::insert(0.5 * way, SPEED)]
    } else {
        vec![Leg::insert(way, SPEED)]
    };
    legs.extend([Leg::hold(0.5), Leg::insert(-way - 5.0 * BEFORE, SPEED)]);
    legs
}

/// Five degrees: about the curvature that was measured in gel.
pub(crate) const BEVEL: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// The prostate of the paper, finer by `refine`: bone is held, and the side away from the entry.
pub(crate) fn prostate(refine: f64) -> Result<Tissue, BenchError> {
    Tissue::built_in("prostate", refine, |x| x[0] > 0.12 - 1e-9)
}

/// The flexible needle in the prostate, pushed to `depth`.
pub(crate) fn prostate_flexible(tissue: Tissue, depth: f64) -> Scene {
    let within = UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.5 };
    let capsule = Some((1.0, 0.5e-3, [0.072, 0.0, 0.0], [0.0225, 0.0205, 0.0255]));
    let layers = Layers { within, skin: (1.0, 1e-3), capsule };
    let needle = wire([0.0, -0.0061, 0.0083], BEVEL);
    Scene { name: "prostate flexible", tissue, needle, layers, legs: in_and_out(depth, false) }
}

/// The five runs of Table 3 of the paper; a quick look goes a tenth as deep.
pub(crate) fn published_scenes(quick: bool) -> Result<Vec<Scene>, BenchError> {
    let part = if quick { 0.1 } else { 1.0 };
    let flexible = prostate_flexible(prostate(1.0)?, 0.078 * part);
    let stiff = Scene { name: "prostate stiff", needle: tube([0.0, -0.0061, 0.0083]), ..flexible.clone() };
    let gel = UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.2 };
    let layers = Layers { within: gel, ..Layers::default() };
    let cylinders = Scene {
        name: "two cylinders",
        tissue: Tissue::built_in("two-cylinders", 1.0, |x| x[0] > 0.12 - 1e-9)?,
        needle: wire([0.0, -0.0053, 0.0011], BEVEL),
        layers,
        legs: in_and_out(0.1 * part, true),
    };
    let single = Scene {
        name: "gel single bend",
        tissue: Tissue::built_in("gel-block", 1.0, |x| x[2] < 1e-9 || x[0] > 0.271 - 1e-9)?,
        needle: wire([0.0, 0.1329, 0.0191], BEVEL),
        layers,
        legs: in_and_out(0.15 * part, false),
    };
    let double = Scene { name: "gel double bend", legs: in_and_out(0.15 * part, true), ..single.clone() };
    Ok(vec![flexible, stiff, cylinders, single, double])
}

pub(crate) fn length(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub(crate) fn distance(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    length(&std::array::from_fn(|k| p[k] - q[k]))
}
