//! Quasi-static insertion: the interaction loop of section 6.7 of Nienhuys (2003).
//!
//! One cycle: *move the base, refine around the tip, take the nodes that the tip has passed, find the equilibrium,
//! rearrange the friction states, let go of nodes ahead of the tip*. The tip is located in the last equilibrium, before
//! the nodes that stick to the needle are moved, since moving them may turn triangles inside out.

mod carry;
mod state;
mod tip_region;

pub use state::InsertionState;

use crate::error::NeedleError;
use crate::history::CycleRow;
use crate::motion::Motion;
use crate::needle::{Needle, OnNeedle};
use crate::relocate;
use crate::scene::{Fineness, FrictionStage, NeedleStage, Rearrange, Scene};
use crate::shaft::{Hold, Shaft, ShaftFriction};
use crate::slab::{Slab, solve_error};
use crate::stages::{Stage, Stages};
use crate::surface::Surface;
use crate::tip::{Tip, deformed, follow};
use serde::{Deserialize, Serialize};
use std::time::Instant;
use stylet_mesh::{CellId, VertexId};
use stylet_physics::friction::Law;
use stylet_physics::material::Hyperelastic;
use stylet_solver::subspace::Constraint;

/// Cycles without motion after which friction states that still change are given up: three times the longest settling
/// seen over speeds from 0.01 to 3 (534).
const MOST_SETTLING_CYCLES: usize = 1600;

/// Cycles without motion and without an iteration in which states change, before they are left as they are.
const MOST_IDLE_CYCLES: usize = 20;

/// Cycles at one position in which the friction of slipping nodes follows their places.
const MOST_TRACTION_CYCLES: usize = 400;

/// A node ahead of the tip by more legs than this is forgotten; the tip finds it again when it comes back.
const FORGET_AHEAD: f64 = 2.0;

/// A needle on its way through a slab or a cube.
#[derive(Clone)]
pub struct Insertion<const D: usize, const N: usize, M: Hyperelastic<D>> {
    /// The tissue.
    pub slab: Slab<D, N, M>,
    /// The needle.
    pub needle: Needle<D>,
    /// The nodes on it.
    pub shaft: Shaft<D>,
    motion: Motion,
    friction: ShaftFriction,
    rearrange: Rearrange,
    relocate: bool,
    /// Size of the cells around the tip, m, and when they are fine enough.
    h_ref: f64,
    fineness: Fineness,
    /// Travel of the base per position, m.
    stride: f64,
    /// Relative change of friction that a settled state leaves.
    drift: f64,
    tip: Tip<D, N>,
    clock: Clock,
    /// Force and moment at the base in the last equilibrium, with the friction states that it was found for.
    held_by: Hold<D>,
    scratch: Scratch<D>,
}

/// How far the loop has come.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
struct Clock {
    /// Travel of the base so far, m, in this many strides.
    travel: f64,
    positions: usize,
    /// Cycles in all, and since the base last moved.
    cycles: usize,
    settling: usize,
    /// Cycles in a row, at this position, in which states changed and the equilibrium did not.
    idle: usize,
    /// Positions that were left although something still changed.
    unsettled: usize,
    /// Whether the last cycle changed mesh, needle nodes or friction states.
    changed: bool,
    finished: bool,
}

#[derive(Clone, Default)]
struct Scratch<const D: usize> {
    crossed: Vec<VertexId>,
    touching: Vec<CellId>,
    /// Marks by cell, all unset between uses.
    seen: Vec<bool>,
    near: Vec<VertexId>,
    marked: Vec<CellId>,
    turned: Vec<VertexId>,
    /// Where carried nodes go, and the displacement that this takes.
    targets: Vec<(VertexId, [f64; D])>,
    way: Vec<f64>,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Insertion<D, N, M> {
    /// A needle about to enter a slab at rest.
    ///
    /// # Errors
    /// [`NeedleError::Solve`] if the force density is refused.
    pub fn new(
        scene: &Scene,
        stage: &NeedleStage,
        friction: &FrictionStage,
        slab: Slab<D, N, M>,
    ) -> Result<Self, NeedleError> {
        let density = stage.line_density().map_err(|e| solve_error(0, e.to_string()))?;
        let motion = Motion::of(stage);
        let mut needle = stage.needle();
        needle.set_pose(motion.at(0.0));
        Ok(Self {
            slab,
            tip: Tip::Outside(needle.tip()),
            clock: Clock { changed: true, ..Clock::default() },
            held_by: Hold::default(),
            needle,
            shaft: Shaft::default(),
            motion,
            friction: ShaftFriction {
                density,
                static_ratio: friction.static_ratio,
                law: Law { restick: friction.restick, reversal: 0.0 },
                surface: Surface { radius: stage.radius, reach: scene.mesh.longest_edge_around_needle() },
            },
            rearrange: stage.rearrange,
            relocate: stage.relocate,
            h_ref: scene.mesh.h_ref(),
            fineness: scene.mesh.around_needle(),
            stride: stage.speed * scene.mesh.h_ref(),
            drift: scene.solver.tolerance.max(1e-4),
            scratch: Scratch::default(),
        })
    }

    /// What held the needle in the last equilibrium.
    pub fn held_by(&self) -> Hold<D> {
        self.held_by
    }

    /// Whether the last cycle changed nothing: no mesh, no needle node, no friction state.
    pub fn settled(&self) -> bool {
        !self.clock.changed
    }

    /// Whether the last motion is done and nothing changes any more.
    pub fn finished(&self) -> bool {
        self.clock.finished
    }

    /// Positions that were left although states still flipped within the tolerance, or friction still drifted.
    pub fn unsettled(&self) -> usize {
        self.clock.unsettled
    }

    /// Cycles so far.
    pub fn cycles(&self) -> usize {
        self.clock.cycles
    }

    /// The share of the motion that is done.
    pub fn progress(&self) -> f64 {
        (self.clock.travel / self.motion.travel()).min(1.0)
    }

    /// The tip in the undeformed body, m; where it is outside, the tip itself.
    pub fn tip_reference(&self) -> [f64; D] {
        let mut crossed = Vec::new();
        match follow(&self.slab.mesh, &self.slab.u, self.tip, self.needle.tip(), &mut crossed) {
            Tip::Inside(inside) => inside.in_reference(&self.slab.mesh),
            Tip::Outside(point) => point,
        }
    }

    /// One cycle of the loop. A row of the history is returned.
    ///
    /// # Errors
    /// [`NeedleError`] that names the cycle; the state is then the last one reached.
    pub fn cycle(&mut self, stages: &mut Stages) -> Result<CycleRow<D>, NeedleError> {
        self.clock.cycles += 1;
        let since = Instant::now();
        let settled = !self.clock.changed;
        let advance = self.clock.travel < self.motion.travel()
            && (self.rearrange == Rearrange::Once || settled || self.clock.cycles == 1);
        let step = if advance { self.advance() } else { [0.0; D] };
        let mut since = stages.lap(Stage::Move, since);

        let refined = if advance || self.clock.changed { self.locate_and_refine(stages, &mut since)? } else { false };
        let iterations_before = self.move_sticking(advance, step, stages, &mut since)?;
        let captured = self.capture(stages, &mut since)?;
        if advance || self.clock.changed {
            // At rest, part of the way: near the tip friction falls as a node moves forward, faster than its force does.
            let relaxation = if self.rearrange == Rearrange::Settle && !advance { 0.25 } else { 1.0 };
            self.shaft.renew_tractions(&self.friction, relaxation);
            self.apply_tractions();
        }
        since = stages.lap_on(Stage::Rearrange, since);

        let outcome = self.slab.solve(self.clock.cycles, stages)?;
        since = stages.lap(Stage::Solve, since);

        let rearranged = self.rearrange_states();
        since = stages.lap(Stage::Rearrange, since);
        let released = self.release();
        stages.lap(Stage::Release, since);

        let moved = refined || captured > 0 || released > 0 || outcome.iterations > 0;
        self.clock.idle = if moved || advance { 0 } else { self.clock.idle + 1 };
        self.clock.changed = refined || captured > 0 || rearranged > 0 || released > 0;
        self.finish_if_settled()?;
        Ok(self.history_row(outcome.iterations + iterations_before))
    }

    /// Takes the nodes that the tip has passed onto the needle, where they are.
    fn capture(&mut self, stages: &mut Stages, since: &mut Instant) -> Result<usize, NeedleError> {
        let mut captured = 0;
        let mut ahead = std::mem::take(&mut self.shaft.ahead);
        let mut kept = 0;
        for index in 0..ahead.len() {
            let vertex = ahead[index];
            let place = self.needle.frame_of(deformed(&self.slab.mesh, &self.slab.u, vertex));
            let takes = place.behind > self.on_needle() && !self.shaft.let_go.contains(&vertex);
            if takes {
                if !self.slab.is_clamped(vertex) && !self.shaft.contains(vertex) {
                    self.take(vertex, place, stages)?;
                    captured += 1;
                }
            } else if place.behind > -self.forgotten_ahead() {
                ahead[kept] = vertex;
                kept += 1;
            }
        }
        ahead.truncate(kept);
        self.shaft.ahead = ahead;
        *since = stages.lap(Stage::Capture, *since);
        Ok(captured)
    }

    /// Nodes ahead of the tip by more than this are forgotten, m.
    fn forgotten_ahead(&self) -> f64 {
        FORGET_AHEAD * self.h_ref + self.friction.surface.radius
    }

    /// A node is on the needle if it is further behind the tip than this, m: beyond rounding errors of positions.
    fn on_needle(&self) -> f64 {
        1e-9 * self.h_ref
    }

    fn take(&mut self, vertex: VertexId, mut place: OnNeedle, stages: &mut Stages) -> Result<(), NeedleError> {
        if self.relocate {
            let since = Instant::now();
            let on_axis = OnNeedle { perpendicular: 0.0, above: 0.0, ..place };
            if relocate::onto_needle(&mut self.slab, vertex, self.needle.point_at(on_axis))? {
                place = on_axis;
            }
            stages.lap(Stage::Relocate, since);
        }
        self.shaft.capture(vertex, place);
        self.slab.constrain(vertex, Constraint::Fixed);
        Ok(())
    }

    fn apply_tractions(&mut self) {
        let tangent = self.needle.tangent();
        for node in &self.shaft.nodes {
            for k in 0..D {
                self.slab.load[D * node.vertex.index() + k] = node.traction * tangent[k];
            }
        }
    }

    /// Reads the forces on the needle nodes off the equilibrium and changes the states that must change.
    fn rearrange_states(&mut self) -> usize {
        self.shaft.follow_slip(&self.needle, &self.slab.mesh, &self.slab.u);
        for node in &mut self.shaft.nodes {
            node.force = self.slab.elastic_force(node.vertex);
        }
        self.held_by = self.shaft.base_force(&self.needle);
        let turn_back = self.rearrange == Rearrange::Settle;
        let mut changed = self.shaft.rearrange(&self.needle, &self.friction, turn_back, &mut self.scratch.turned);
        // A settled state is one whose friction belongs to where its nodes have come to.
        if changed == 0 && self.rearrange == Rearrange::Settle {
            let (drift, total) = self.shaft.traction_drift(&self.friction);
            let drifts = drift > self.drift * total;
            let patient = self.clock.settling < MOST_TRACTION_CYCLES;
            self.clock.unsettled += usize::from(drifts && !patient);
            changed = usize::from(drifts && patient);
        }
        if changed > 0 {
            for node in &self.shaft.nodes {
                let constraint =
                    if node.sticks() { Constraint::Fixed } else { Constraint::Line(self.needle.tangent()) };
                if self.slab.subspace.get(node.vertex.index()) != constraint {
                    self.slab.constrain(node.vertex, constraint);
                }
            }
            self.apply_tractions();
        }
        changed
    }

    /// Lets go of nodes that are ahead of the tip.
    fn release(&mut self) -> usize {
        let limit = self.on_needle();
        let released = self.shaft.nodes.partition_point(|node| node.place.behind <= limit);
        for index in 0..released {
            let vertex = self.shaft.nodes[index].vertex;
            self.slab.constrain(vertex, Constraint::Free);
            self.slab.load[D * vertex.index()..][..D].fill(0.0);
            self.shaft.ahead.push(vertex);
            self.shaft.let_go.push(vertex);
        }
        self.shaft.nodes.drain(..released);
        released
    }

    fn finish_if_settled(&mut self) -> Result<(), NeedleError> {
        self.clock.settling += 1;
        if self.clock.changed && self.clock.settling > MOST_SETTLING_CYCLES {
            let reason = format!("friction states still change after {MOST_SETTLING_CYCLES} cycles without motion");
            return Err(solve_error(self.clock.cycles, reason));
        }
        // States that flip within the tolerance of an equilibrium that does not notice go on for ever.
        if self.clock.changed && self.clock.idle >= MOST_IDLE_CYCLES {
            self.clock.changed = false;
            self.clock.unsettled += 1;
        }
        self.clock.finished = !self.clock.changed && self.clock.travel >= self.motion.travel();
        Ok(())
    }

    fn history_row(&self, iterations: u64) -> CycleRow<D> {
        CycleRow {
            step: self.clock.cycles,
            depth_m: self.needle.pose().insert,
            tip: self.needle.tip(),
            held_by: self.held_by,
            iterations,
            cycles: self.clock.settling as u64,
            needle_nodes: self.shaft.nodes.len(),
            nodes: self.slab.mesh.n_vertices(),
            elements: self.slab.mesh.n_cells(),
        }
    }
}
