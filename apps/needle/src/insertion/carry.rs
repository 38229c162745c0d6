//! Moving the base, and the nodes that the needle carries along.

use super::Insertion;
use crate::error::NeedleError;
use crate::needle::{along, dot, minus};
use crate::stages::{Stage, Stages};
use crate::tip::deformed;
use std::time::Instant;
use stylet_physics::material::Hyperelastic;
use stylet_solver::subspace::Constraint;

/// Parts into which the motion of the carried nodes is cut before it is given up.
const MOST_PARTS: usize = 100;

/// A nonlinear material is moved to at most one part in this many of the way to inversion: half the way is as far as an
/// energy with ln J likes to be started from.
const CLEARANCE: f64 = 2.0;

/// The smallest part of a stride that the base is moved by when the whole would invert an element.
const SMALLEST_STRIDE: f64 = 1.0 / 64.0;

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Insertion<D, N, M> {
    /// Moves the base by one stride, or by as much of it as goes without turning a cell of a nonlinear material inside
    /// out: friction states then change before it goes on. Returns by how much the needle has moved.
    pub(super) fn advance(&mut self) -> [f64; D] {
        self.clock.settling = 0;
        let (before, start) = (self.needle.tip(), self.clock.travel);
        // A product, not a sum: thousands of strides end where the table ends, to the last bit.
        let end = ((self.clock.positions + 1) as f64 * self.stride).min(self.motion.travel());
        let mut part = 1.0;
        loop {
            let travel = if part == 1.0 { end } else { (start + part * self.stride).min(end) };
            self.clock.travel = travel;
            self.needle.set_pose(self.motion.at(travel));
            let step = minus(self.needle.tip(), before);
            if !M::REQUIRES_POSITIVE_J || part <= SMALLEST_STRIDE {
                break;
            }
            self.gather_targets(true, step);
            if self.can_go_at_once() {
                break;
            }
            part *= 0.5;
        }
        if self.clock.travel == end {
            self.clock.positions += 1;
        }
        minus(self.needle.tip(), before)
    }

    /// Carries the sticking nodes along with the needle. Where that would still turn a cell of a nonlinear material
    /// inside out, it goes in parts. Returns the iterations that this took.
    pub(super) fn move_sticking(
        &mut self,
        advance: bool,
        step: [f64; D],
        stages: &mut Stages,
        since: &mut Instant,
    ) -> Result<u64, NeedleError> {
        self.gather_targets(advance, step);
        let mut iterations = 0;
        if M::REQUIRES_POSITIVE_J && !self.scratch.targets.is_empty() {
            if advance {
                iterations = self.move_in_parts(stages)?;
            } else if !self.can_go_at_once() {
                self.stay_where_turned();
            }
        }
        for &(vertex, target) in &self.scratch.targets {
            let rest = self.slab.mesh.point(vertex);
            for k in 0..D {
                self.slab.u[D * vertex.index() + k] = target[k] - rest[k];
            }
        }
        if advance {
            self.shaft.follow_slip(&self.needle, &self.slab.mesh, &self.slab.u);
            self.shaft.mark_places();
            // What a slipping node slides in this position counts from where it was on the needle before.
            for node in self.shaft.nodes.iter_mut().filter(|node| !node.sticks()) {
                node.behind_before -= dot(step, self.needle.tangent());
            }
        }
        *since = stages.lap_on(Stage::Move, *since);
        Ok(iterations)
    }

    /// Where the carried nodes go: sticking ones stay where they are on the needle, slipping ones keep their distance from
    /// the shaft. At rest only those that turned round are put back.
    fn gather_targets(&mut self, advance: bool, step: [f64; D]) {
        let targets = &mut self.scratch.targets;
        targets.clear();
        let turned = &self.scratch.turned;
        for node in self.shaft.nodes.iter().filter(|node| node.sticks()) {
            if advance || turned.contains(&node.vertex) {
                targets.push((node.vertex, self.needle.point_at(node.place)));
            }
        }
        // The sleeve moves the base to its left and right alone.
        let normal = self.needle.normal();
        let sideways = dot(step, normal);
        if advance && sideways != 0.0 {
            for node in self.shaft.nodes.iter().filter(|node| !node.sticks()) {
                let here = deformed(&self.slab.mesh, &self.slab.u, node.vertex);
                targets.push((node.vertex, along(here, sideways, normal)));
            }
        }
    }

    /// Nodes that turned round stick where they are, if going back would turn a cell inside out.
    fn stay_where_turned(&mut self) {
        self.scratch.targets.clear();
        for node in self.shaft.nodes.iter_mut().filter(|node| self.scratch.turned.contains(&node.vertex)) {
            node.place.behind = self.needle.frame_of(deformed(&self.slab.mesh, &self.slab.u, node.vertex)).behind;
        }
    }

    /// Whether the targets can be reached at once, well clear of inversion. Leaves the way there in the scratch.
    fn can_go_at_once(&mut self) -> bool {
        let way = &mut self.scratch.way;
        way.clear();
        way.resize(self.slab.u.len(), 0.0);
        for &(vertex, target) in &self.scratch.targets {
            let rest = self.slab.mesh.point(vertex);
            for k in 0..D {
                let at = D * vertex.index() + k;
                way[at] = target[k] - rest[k] - self.slab.u[at];
            }
        }
        self.slab.max_step(&self.scratch.way, CLEARANCE) >= CLEARANCE
    }

    /// Goes towards the targets as long as they cannot be reached without turning a cell inside out: the tissue around
    /// the sticking nodes is carried along elastically, and finds its equilibrium in between.
    fn move_in_parts(&mut self, stages: &mut Stages) -> Result<u64, NeedleError> {
        let mut iterations = 0;
        for part in 0..MOST_PARTS {
            if part > 0 {
                self.let_targets_slide();
            }
            if self.can_go_at_once() {
                return Ok(iterations);
            }
            let way = &mut self.scratch.way;
            self.slab.carry_along(way).map_err(|reason| self.slab.blame(self.clock.cycles, reason))?;
            let limit = self.slab.max_step(way, CLEARANCE);
            for (u, w) in self.slab.u.iter_mut().zip(&self.scratch.way) {
                *u += limit / CLEARANCE * w;
            }
            if limit >= CLEARANCE {
                self.let_targets_slide();
                return Ok(iterations);
            }
            iterations += self.slab.solve_tightly(self.clock.cycles, stages)?.iterations;
        }
        let reason = format!("the nodes that stick to the needle cannot follow it, even in {MOST_PARTS} parts");
        Err(self.slab.blame(self.clock.cycles, reason))
    }

    /// Slipping nodes that the tissue has carried along the shaft stay where they have come to; only their distance from the
    /// shaft was asked for. To put them back would turn triangles inside out.
    fn let_targets_slide(&mut self) {
        for (vertex, target) in &mut self.scratch.targets {
            if let Constraint::Line(_) = self.slab.subspace.get(vertex.index()) {
                let here = deformed(&self.slab.mesh, &self.slab.u, *vertex);
                let way = minus(*target, here);
                let beside = along(here, dot(way, self.needle.normal()), self.needle.normal());
                *target = self.needle.upward().map_or(beside, |up| along(beside, dot(way, up), up));
            }
        }
    }
}
