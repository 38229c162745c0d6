//! Flexible needles pushed, turned and withdrawn through deforming tissue.
//!
//! ```text
//! base motion -> rods, sleeves -.
//! tissue (mesh, body, State) ---+-> coupled step -> tip: mesh gets a node there (MeshChange) -> u, v, a, body, constraints follow
//!                               '-------------------------- needle read anew at the nodes it has now <-'
//! ```
//!
//! An [`Insertion`] owns the mesh, the body on it, its motion and the needles. A [`step`](Insertion::step) moves all of them to
//! the end of a step, or of as many parts as it takes; where it cannot, nothing has moved.
//!
//! Source: Chentanez, Alterovitz, Ritchie, Cho, Hauser, Goldberg, Shewchuk & O'Brien, *Interactive simulation of surgical needle
//! insertion and steering*, ACM Trans. Graph. 28(3) (2009).

mod ambient;
mod entry;
mod error;
mod interaction;
mod needle;
mod report;
mod state;
mod tip;

pub use error::InsertionError;
pub use interaction::{Interaction, UniformInteraction};
pub use needle::{BaseMotion, NaturalBend, Needle, NeedleSettings};
pub use report::{InsertionReport, InsertionTimes};
pub use state::InsertionState;

use crate::body::Body;
use crate::coupling::{
    CoupledIntegrator, CoupledSettings, CouplingError, Past, SleeveMotion, SlipLimits, SlipState, triple,
};
use crate::dynamics::{Drive, DynamicsError, State};
use crate::material::Hyperelastic;
use crate::reparameterise::{Profile, adapt};
use std::time::Instant;
use stylet_mesh::remesh::Remesher;
use stylet_mesh::{CellId, SimplexMesh, VertexId};
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;
use tip::TipMove;

/// The largest number of parts of a step is two to this.
const MAX_HALVINGS: u32 = 12;
/// Part of the shortest edge of a needle that a part of a step may take back into the sleeve.
const PULL: f64 = 0.9;
/// Most that a needle is turned in a part of a step, rad: its bevel cuts one way during all of it.
const TURN: f64 = std::f64::consts::FRAC_PI_8;
/// Slower than this, in metres by step, a node has not slid.
const STILL: f64 = 1e-15;

/// Rounding of barycentric coordinates.
const ON_FACE: f64 = 1e-9;

/// Tissue with needles in it, in motion.
pub struct Insertion<M> {
    mesh: SimplexMesh<3, 4>,
    body: Body<3, 4, M>,
    subspace: Subspace<3>,
    remesher: Remesher<3, 4>,
    state: State,
    needles: Vec<Needle>,
    integrator: CoupledIntegrator,
    interaction: Box<dyn Interaction>,
    gravity: [f64; 3],
    load: Vec<f64>,
    times: InsertionTimes,
    star: Vec<CellId>,
    /// By cell, whether a search has been there; none has between searches.
    seen: Vec<bool>,
    frames: Vec<crate::rod::Frame>,
    shafts: Vec<crate::coupling::Shaft>,
}

impl<M: Hyperelastic<3>> Insertion<M> {
    /// A body at rest with mass, on its mesh, held by `subspace`; needles come later.
    ///
    /// # Errors
    /// [`InsertionError::Dynamics`] if the body has no mass, or the settings make no sense.
    pub fn new(
        mesh: SimplexMesh<3, 4>,
        body: Body<3, 4, M>,
        mut subspace: Subspace<3>,
        settings: CoupledSettings,
        interaction: impl Interaction + 'static,
        gravity: [f64; 3],
        team: &Team,
    ) -> Result<Self, InsertionError> {
        // Slots without a vertex take no part.
        subspace.resize(mesh.n_vertex_slots());
        for slot in (0..mesh.n_vertex_slots()).filter(|&slot| !mesh.is_vertex(VertexId(slot as u32))) {
            let _ = subspace.set(slot, stylet_solver::subspace::Constraint::Fixed);
        }
        let (remesher, needles) = (Remesher::new(), Vec::new());
        let (state, past) = (State::default(), Past::default());
        let at_rest = InsertionState { mesh, remesher, subspace, state, needles, past };
        let mut this = Self::of_parts(at_rest, body, settings, interaction, gravity, team)?;
        let load = this.load.clone();
        let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&load);
        this.state = this.integrator.tissue().start(&mut this.body, &this.subspace, &mut drive)?;
        Ok(this)
    }

    /// The parts put together, before the tissue's integrator knows of them.
    fn of_parts(
        parts: InsertionState,
        body: Body<3, 4, M>,
        settings: CoupledSettings,
        interaction: impl Interaction + 'static,
        gravity: [f64; 3],
        team: &Team,
    ) -> Result<Self, InsertionError> {
        if body.mass_kind().is_none() {
            return Err(DynamicsError::NoMass.into());
        }
        let InsertionState { mesh, remesher, subspace, state, needles, past } = parts;
        let mut this = Self {
            mesh,
            body,
            subspace,
            remesher,
            state,
            needles,
            integrator: CoupledIntegrator::new(settings, team),
            interaction: Box::new(interaction),
            gravity,
            load: Vec::new(),
            times: InsertionTimes::default(),
            star: Vec::new(),
            seen: Vec::new(),
            frames: Vec::new(),
            shafts: Vec::new(),
        };
        *this.integrator.past_mut() = past;
        this.weigh();
        Ok(this)
    }

    /// Adds a needle, all of it outside the tissue; returns its number.
    ///
    /// # Errors
    /// [`InsertionError::StartsInside`], [`InsertionError::Setting`], [`InsertionError::Rod`].
    pub fn add_needle(&mut self, settings: NeedleSettings) -> Result<usize, InsertionError> {
        let k = self.needles.len();
        let far = self.mesh.points().iter().fold([0.0_f64; 3], |far, x| std::array::from_fn(|i| far[i].max(x[i])));
        let outside = far.map(|x| 2.0 * x.abs() + 1.0);
        let id = self
            .remesher
            .add_needle(&self.mesh, outside)
            .map_err(|error| InsertionError::Remesh { needle: k, error })?;
        let needle = Needle::new(k, id, settings)?;
        for node in 0..needle.shaft.n_nodes() {
            let at = needle.shaft.place(node);
            if let Some((cell, _)) = self.cell_of(&at) {
                let region = self.mesh.region(cell);
                return Err(InsertionError::StartsInside { needle: k, node, at, cell: cell.0, region });
            }
        }
        self.needles.push(needle);
        Ok(k)
    }

    /// The mesh of the tissue.
    pub fn mesh(&self) -> &SimplexMesh<3, 4> {
        &self.mesh
    }

    /// The tissue.
    pub fn body(&self) -> &Body<3, 4, M> {
        &self.body
    }

    /// The tissue, for settings such as lazy updates and viscosity.
    pub fn body_mut(&mut self) -> &mut Body<3, 4, M> {
        &mut self.body
    }

    /// What is held.
    pub fn subspace(&self) -> &Subspace<3> {
        &self.subspace
    }

    /// Time, displacement, velocity and acceleration of the tissue.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The needles.
    pub fn needles(&self) -> &[Needle] {
        &self.needles
    }

    /// The steps that move them.
    pub fn integrator(&mut self) -> &mut CoupledIntegrator {
        &mut self.integrator
    }

    /// The remesher, for its counts and angles.
    pub fn remesher(&mut self) -> &mut Remesher<3, 4> {
        &mut self.remesher
    }

    /// Where the time went.
    pub fn times(&self) -> InsertionTimes {
        InsertionTimes { tissue: *self.integrator.tissue_times(), coupled: *self.integrator.times(), ..self.times }
    }

    /// Makes a step of length `h` (s), with one motion for each needle, constant during the step.
    ///
    /// It is made in parts, each half as long as the one that failed, where the needle would slide too far or the system has no
    /// solution.
    ///
    /// # Errors
    /// [`InsertionError`]. Of [`InsertionError::Failed`] the parts that were made stay.
    ///
    /// # Panics
    /// If there is not one motion for each needle.
    pub fn step(&mut self, motions: &[BaseMotion], h: f64) -> Result<InsertionReport, InsertionError> {
        assert_eq!(motions.len(), self.needles.len(), "one motion for each needle");
        if !(h > 0.0 && h.is_finite()) {
            return Err(InsertionError::Setting { name: "the step", value: h, expected: "a positive time, s" });
        }
        let mut report = InsertionReport::default();
        let whole = 1u32 << MAX_HALVINGS;
        let (mut done, mut size) = (0, whole);
        // Free needles, too, come to the skin by no more than they may slide in it.
        let longest = motions.iter().map(|motion| motion.insert.abs() + speed(&motion.sleeve)).fold(0.0, f64::max) * h;
        // Nor may a part take back more than the shortest edge that there can be at a sleeve.
        let edges = self.needles.iter().map(|needle| PULL * needle.edges.shortest()).fold(f64::INFINITY, f64::min);
        let reach = self.integrator.settings().reach.min(edges);
        let turn = motions.iter().map(|motion| motion.spin.abs()).fold(0.0, f64::max) * h;
        let part_of = |size: u32| f64::from(size) / f64::from(whole);
        while size > 1 && (longest * part_of(size) > reach || turn * part_of(size) > TURN) {
            size /= 2;
        }
        if turn * part_of(size) > TURN {
            let value = turn / h;
            return Err(InsertionError::Setting {
                name: "the spin",
                value,
                expected: "no more than 1,600 rad by step",
            });
        }
        let largest = size;
        while done < whole {
            let part = h * f64::from(size) / f64::from(whole);
            match self.part(motions, part, &mut report) {
                Ok(()) => {
                    done += size;
                    report.substeps += 1;
                    if 2 * size <= largest && done % (2 * size) == 0 && done + 2 * size <= whole {
                        size *= 2;
                    }
                }
                Err(Setback::Curable(reason)) => {
                    report.halvings += 1;
                    if size == 1 {
                        return Err(InsertionError::Failed { t: self.state.t, smallest: part, reason });
                    }
                    size /= 2;
                }
                Err(Setback::Final(error)) => return Err(error),
            }
        }
        Ok(report)
    }

    /// One part of a step: rods, coupled step, tips, needles.
    fn part(&mut self, motions: &[BaseMotion], h: f64, report: &mut InsertionReport) -> Result<(), Setback> {
        let since = Instant::now();
        self.limit_forces()?;
        self.shafts.clear();
        let mut sleeves: Vec<SleeveMotion> = Vec::with_capacity(motions.len());
        for (k, (needle, motion)) in self.needles.iter().zip(motions).enumerate() {
            self.shafts.push(needle.shaft.clone());
            sleeves.push(needle.sleeve(motion, h));
            feed(k, &mut self.shafts[k], motion, h)?;
        }
        self.times.prepare.add(since);
        let load = &self.load;
        let u = &self.state.u;
        let mut drive = |_: f64, drive: &mut Drive| {
            drive.load.copy_from_slice(load);
            drive.displacement.copy_from_slice(u);
        };
        let made = self.integrator.attempt(
            &mut self.body,
            &self.subspace,
            &mut drive,
            (&self.state, &mut self.shafts),
            &sleeves,
            h,
        );
        let made = made.map_err(Setback::Curable)?;
        // Where the skin was, for tips that have not met it.
        let was = if self.needles.iter().all(Needle::is_inside) { Vec::new() } else { self.state.u.clone() };
        self.integrator.take(&mut self.state, &mut self.shafts, h);
        report.add(&made);
        for (k, motion) in motions.iter().enumerate() {
            let before = self.needles[k].shaft.tip();
            std::mem::swap(&mut self.needles[k].shaft, &mut self.shafts[k]);
            let (needle, end) = (&mut self.needles[k], &self.integrator.ends()[k]);
            needle.inserted += motion.insert * h;
            needle.angle += motion.spin * h;
            (needle.base_force, needle.base_moment) = (end.base_force, end.base_moment);
            needle.forces.clone_from(&end.forces);
            needle.slips.clone_from(&end.slips);
            self.renew(k, (&before, &was), report)?;
        }
        Ok(())
    }

    /// Brings the mesh to the tip and the nodes of the needle to the mesh.
    fn renew(
        &mut self,
        k: usize,
        (before, was): (&[f64; 3], &[f64]),
        report: &mut InsertionReport,
    ) -> Result<(), Setback> {
        let since = Instant::now();
        let old = profile(&self.needles[k]);
        let slip = self.needles[k].slips.last().copied().unwrap_or(0.0);
        let tip = self.needles[k].shaft.nodes.last().map(|node| node.state);
        let moved = match tip {
            None => self.meet(k, before, was)?,
            Some(SlipState::Static) => TipMove::default(),
            Some(_) if slip.abs() <= STILL => TipMove::default(),
            Some(_) if slip > 0.0 && self.waits(k, slip) => self.wait(k, slip),
            Some(_) => self.cut(k, slip)?,
        };
        report.blocked += u32::from(moved.blocked);
        let since = self.times.remesh.add(since);
        self.reparameterise(k, &old)?;
        self.times.reparameterise.add(since);
        Ok(())
    }

    /// The needle as it is read at the nodes that it has now: those outside where they are, the others where the tissue is.
    fn reparameterise(&mut self, k: usize, old: &Profile) -> Result<(), InsertionError> {
        let needle = &self.needles[k];
        let slid = needle.slips.iter().any(|slip| slip.abs() > STILL);
        let (shaft, q) = (&needle.shaft, needle.shaft.nodes.len());
        // A tip that has just met the skin, or come out of it, is the same node of the needle.
        let outside = old.n_nodes() - old.states.len().max(1);
        let mut positions = old.positions[..3 * outside].to_vec();
        for node in &shaft.nodes {
            let (x, u) = (self.mesh.point(VertexId(node.vertex)), triple(&self.state.u, node.vertex as usize));
            positions.extend((0..3).map(|i| x[i] + u[i]));
        }
        if q == 0 {
            positions.extend_from_slice(&old.positions[old.positions.len() - 3..]);
        }
        let wrong = |error| InsertionError::Reparameterise { needle: k, error };
        let (new, merged) = adapt(old, &positions, q, &needle.edges).map_err(wrong)?;
        if let Some(length) = merged.too_short {
            return Err(InsertionError::SleeveAtSkin { needle: k, length });
        }
        let shaft = &mut self.needles[k].shaft;
        let curvatures: Vec<[f64; 2]> = new.rest_curvature.as_chunks::<2>().0.to_vec();
        shaft
            .rod
            .replace(&new.rest_lengths, &new.angles, &curvatures)
            .map_err(|error| InsertionError::Rod { needle: k, error })?;
        shaft.x = new.positions;
        shaft.v = new.velocity;
        shaft.a = new.acceleration;
        if slid || q != old.states.len() {
            for (node, state) in shaft.nodes.iter_mut().zip(&new.states) {
                node.state = *state;
            }
        }
        let entry = shaft.entry();
        for i in 0..q {
            let (node, vertex) = (entry + i, shaft.nodes[i].vertex as usize);
            let tangent = shaft.tangent(node);
            tip::agree(&mut shaft.v, node, &triple(&self.state.v, vertex), &tangent);
            tip::agree(&mut shaft.a, node, &triple(&self.state.a, vertex), &tangent);
        }
        Ok(())
    }

    /// What each coupling node bears, from where it is in the undeformed body.
    fn limit_forces(&mut self) -> Result<(), InsertionError> {
        for k in 0..self.needles.len() {
            let q = self.needles[k].shaft.nodes.len();
            let mut to_tip = 0.0;
            for i in (0..q).rev() {
                let vertex = self.needles[k].shaft.nodes[i].vertex;
                let direction = self.material_tangent(k, i);
                let region = self.region_ahead(vertex, &direction);
                let is_even = self.is_even(vertex, &direction);
                let at = self.mesh.point(VertexId(vertex));
                let needle = &mut self.needles[k];
                let entry = needle.shaft.entry();
                let rest = needle.shaft.rod.rest_lengths();
                // Half of the edges that meet here, as far as they are in the tissue.
                let after = if i + 1 < q { rest[entry + i] } else { 0.0 };
                let before = if i > 0 { rest[entry + i - 1] } else { 0.0 };
                to_tip += after;
                let length = 0.5 * (before + after) * needle.friction_factor(to_tip);
                let cutting = if i + 1 == q { self.interaction.cutting(region, &at) } else { 0.0 };
                let friction = length * self.interaction.friction(region, &at);
                let limits = SlipLimits::new(friction, cutting, needle.settings.friction_ratio)
                    .map_err(|error| InsertionError::Limits { needle: k, node: entry + i, error })?;
                let drag = length * self.interaction.viscosity(region, &at);
                let node = &mut needle.shaft.nodes[i];
                (node.limits, node.drag, node.is_even) = (limits, drag, is_even);
            }
        }
        Ok(())
    }

    fn weigh(&mut self) {
        self.load.clear();
        self.load.resize(3 * self.body.n_vertices(), 0.0);
        if self.gravity != [0.0; 3] {
            self.body.add_gravity(&self.gravity, &mut self.load);
        }
    }

    /// The cell of the deformed body that a place is in, found by looking at all, and its coordinates there.
    fn cell_of(&self, at: &[f64; 3]) -> Option<(CellId, [f64; 4])> {
        let (points, u) = (self.mesh.points(), &self.state.u);
        let place = |i: usize| -> [f64; 3] {
            let u = triple(u, i);
            std::array::from_fn(|k| points[i][k] + u[k])
        };
        self.mesh.cells().find_map(|cell| {
            let corners = self.mesh.cell(cell).map(|v| place(v.index()));
            let lambda = stylet_mesh::geometry::barycentric(&corners, at)?;
            // On a face between two cells it is inside; on the skin it is not.
            let skin = |facet: usize| self.mesh.boundary_tag(cell, facet).is_some();
            let inside = |(facet, l): (usize, &f64)| if skin(facet) { *l > ON_FACE } else { *l >= -ON_FACE };
            lambda.iter().enumerate().all(inside).then_some((cell, lambda))
        })
    }
}

/// Why a part of a step was given up.
enum Setback {
    /// A shorter one may do.
    Curable(CouplingError),
    Final(InsertionError),
}

impl From<InsertionError> for Setback {
    fn from(error: InsertionError) -> Self {
        Self::Final(error)
    }
}

fn speed(v: &[f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Pushes the needle out of its sleeve and turns its base.
fn feed(k: usize, shaft: &mut crate::coupling::Shaft, motion: &BaseMotion, h: f64) -> Result<(), InsertionError> {
    let rod = &mut shaft.rod;
    let length = rod.rest_lengths()[1] + motion.insert * h;
    if length <= 0.0 {
        return Err(InsertionError::InSleeve { needle: k });
    }
    let wrong = |error| InsertionError::Rod { needle: k, error };
    rod.set_rest_length(1, length).map_err(wrong)?;
    if motion.spin != 0.0 {
        // Where the needle is bent by nature, the step finds how far its edges follow.
        let angles: Vec<f64> = rod.angles().iter().map(|angle| angle + motion.spin * h).collect();
        rod.set_angles(&angles).map_err(wrong)?;
    }
    Ok(())
}

/// What a needle carries along its length.
fn profile(needle: &Needle) -> Profile {
    let shaft = &needle.shaft;
    Profile {
        positions: shaft.x.clone(),
        rest_lengths: shaft.rod.rest_lengths().to_vec(),
        angles: shaft.rod.angles().to_vec(),
        rest_curvature: shaft.rod.rest_curvatures().iter().flatten().copied().collect(),
        velocity: shaft.v.clone(),
        acceleration: shaft.a.clone(),
        states: shaft.nodes.iter().map(|node| node.state).collect(),
    }
}
