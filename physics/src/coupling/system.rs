//! The linear system of a coupled step for given friction states, and what its solution says about them.
//!
//! Equation (7) of Chentanez et al. (2009), with its signs corrected so that it agrees with the conditions (9) to (11): with
//! `t` from base to tip, the friction of a node where the needle slides forwards pulls the tissue along `t` and the needle
//! back. In the null-space form the unknowns are the accelerations of the tissue and those of the needle that are its own:
//! all of a free node, the one along `t` of a sliding node. Solved in accelerations, `x1 = x^ + cx a1`.

use super::shaft::{inner, set_triple, triple};
use super::stacked::{Parts, Stacked};
use super::{Answer, CouplingError, SlipLimits, SlipState, StickSlip};
use crate::dynamics::StepPreconditioner;
use serde::{Deserialize, Serialize};
use stylet_solver::linear::{CgSettings, NullSpace, NullSpaceWorkspace, null_space_cg, null_space_start};
use stylet_solver::sparse::{BlockCsr, Frozen};
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::vector::norm2;

/// How much more than the exact block the tissue yields to friction at one node: 1.5 to 2 times at 20 ms, next to nothing more
/// at 1 ms. States guessed with it hold after one or two trials.
const YIELD: f64 = 1.5;

/// A coupling node in the numbers of the system.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    /// Its node in the small body: the nodes of all needles but those in sleeves.
    pub small: usize,
    pub vertex: usize,
    pub tangent: [f64; 3],
    /// Viscous friction by sliding in the step, N/m.
    pub drag: f64,
    /// Sliding that the accelerations at the start of the step would make, m.
    pub slip: f64,
}

/// How the coupled system is solved for given states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingMethod {
    /// Conjugate gradients on the system without multipliers, the needle and what it touches inverted exactly.
    #[default]
    NullSpace,
    /// Conjugate gradients on the indefinite matrix, as published, preconditioned by its block diagonal.
    KktCg,
    /// MINRES on the same matrix with the same preconditioner.
    KktMinres,
    /// Projected conjugate gradients, preconditioned by the constraints.
    ConstraintPreconditioned,
}

/// Right sides, offsets and iterates; kept between steps.
#[derive(Debug, Default)]
pub(super) struct SystemVectors {
    pub b_small: Vec<f64>,
    /// `(x^ of the tissue − x^ of the needle) / cx`.
    pub offsets: Vec<f64>,
    pub x_small: Vec<f64>,
    big_side: Vec<f64>,
    small_side: Vec<f64>,
    forces: Vec<f64>,
    free: Vec<Constraint<3>>,
    resistance: Vec<f64>,
    pub start: Vec<f64>,
    stacked: Stacked,
}

pub(super) struct System<'s> {
    pub method: CouplingMethod,
    pub matrix: &'s BlockCsr<3>,
    pub w: &'s Subspace<3>,
    pub a: &'s Frozen<3>,
    pub m: &'s dyn StepPreconditioner<3>,
    pub form: &'s mut NullSpace<3>,
    pub links: &'s [Link],
    pub limits: &'s [SlipLimits],
    /// Right side of the tissue, N.
    pub b: &'s [f64],
    /// Accelerations of the tissue.
    pub x: &'s mut Vec<f64>,
    pub vectors: &'s mut SystemVectors,
    pub ws: &'s mut NullSpaceWorkspace,
    pub cx: f64,
    pub round_floor: f64,
    pub scale: f64,
    pub max_iterations: usize,
    pub residual: f64,
    pub threshold: f64,
    pub moves: Vec<(usize, [f64; 3])>,
    /// Moves of the tissue that are likely to go on.
    pub guesses: &'s [&'s [f64]],
}

impl System<'_> {
    /// Moves of each needle node relative to the tissue, and what resists them.
    fn set_states(&mut self, states: &[SlipState]) -> Result<(), CouplingError> {
        let SystemVectors { free, resistance, x_small, .. } = &mut *self.vectors;
        let n_small = x_small.len() / 3;
        free.clear();
        free.resize(n_small, Constraint::Free);
        resistance.clear();
        resistance.resize(n_small, 0.0);
        for (link, state) in self.links.iter().zip(states) {
            free[link.small] =
                if *state == SlipState::Static { Constraint::Fixed } else { Constraint::Line(link.tangent) };
            resistance[link.small] = if *state == SlipState::Static { 0.0 } else { self.cx * link.drag };
        }
        self.form.set_motions(free, resistance)?;
        Ok(())
    }

    /// Right sides with the friction `force(k)` of node `k` along `t` on the tissue.
    fn set_sides(&mut self, force: impl Fn(usize) -> f64) {
        let SystemVectors { big_side, small_side, b_small, .. } = &mut *self.vectors;
        big_side.clear();
        big_side.extend_from_slice(self.b);
        small_side.clear();
        small_side.extend_from_slice(b_small);
        for (k, link) in self.links.iter().enumerate() {
            let force = force(k);
            for i in 0..3 {
                big_side[3 * link.vertex + i] += force * link.tangent[i];
                small_side[3 * link.small + i] -= force * link.tangent[i];
            }
        }
    }

    /// Begins with what the stiff needle does to the tissue beside it: that is the scale of tolerances from then on. Goes on
    /// along `guesses`, as far as that brings it nearer to the solution.
    fn begin(&mut self, guesses: &[&[f64]]) -> Result<(), CouplingError> {
        let SystemVectors { big_side, small_side, offsets, x_small, .. } = &mut *self.vectors;
        let b = (&big_side[..], &small_side[..], &offsets[..]);
        self.scale = null_space_start(self.form, self.a, b, (&mut *self.x, x_small), guesses, self.ws)?;
        Ok(())
    }

    fn cg(&mut self, tolerance: f64) -> Result<usize, CouplingError> {
        let SystemVectors { big_side, small_side, offsets, x_small, .. } = &mut *self.vectors;
        // The right side does not count: it moves a stiff body, by forces that are by magnitudes beyond those of the tissue.
        let round_floor = self.round_floor + tolerance * self.scale;
        let stop = StopRule { tolerance: f64::MIN_POSITIVE, criterion: Criterion::External, round_floor };
        let settings = CgSettings { stop, max_iterations: self.max_iterations };
        let b = (&big_side[..], &small_side[..], &offsets[..]);
        let solved = null_space_cg(self.form, self.a, self.m, b, (&mut *self.x, x_small), &settings, self.ws)?;
        (self.residual, self.threshold) = (solved.residual_norm, solved.threshold);
        if solved.stop == Stop::IterationLimit {
            return Err(CouplingError::IterationLimit {
                iterations: solved.iterations,
                residual: solved.residual_norm,
                threshold: solved.threshold,
            });
        }
        Ok(solved.iterations)
    }

    /// Norm of the forces (N) that needle and tissue exchange as the system stands: friction, and what holds the needle in its
    /// channel. In short steps they are far above what a step leaves to be solved for: a part of that would be solved to less
    /// than anyone can feel.
    fn exchanged(&mut self, states: &[SlipState]) -> Result<f64, CouplingError> {
        let SystemVectors { small_side, x_small, forces, .. } = &mut *self.vectors;
        forces.resize(x_small.len(), 0.0);
        self.form.constraint_forces(small_side, x_small, forces)?;
        let sliding = self.limits.iter().zip(states).filter(|(_, state)| **state != SlipState::Static);
        let friction = sliding.map(|(limits, state)| limits.slipping(*state).powi(2)).sum::<f64>();
        Ok(norm2(forces).hypot(friction.sqrt()))
    }

    /// Sliding of a node: needle less tissue along `t`, m.
    fn slip(&self, link: &Link) -> f64 {
        let (needle, tissue) = (triple(&self.vectors.x_small, link.small), triple(self.x, link.vertex));
        link.slip + self.cx * (inner(&link.tangent, &needle) - inner(&link.tangent, &tissue))
    }
}

impl StickSlip for System<'_> {
    type Error = CouplingError;

    fn limits(&self) -> &[SlipLimits] {
        self.limits
    }

    fn solve(
        &mut self,
        states: &[SlipState],
        tolerance: f64,
        fresh: bool,
        answer: &mut Answer,
    ) -> Result<usize, CouplingError> {
        self.set_states(states)?;
        let (links, limits) = (self.links, self.limits);
        self.set_sides(|k| match states[k] {
            SlipState::Static => 0.0,
            state => limits[k].slipping(state) + links[k].drag * links[k].slip,
        });
        if fresh {
            self.x.copy_from_slice(&self.vectors.start);
            self.vectors.x_small.fill(0.0);
            self.begin(self.guesses)?;
            self.scale = self.scale.max(self.exchanged(states)?);
        }
        if self.method != CouplingMethod::NullSpace && !links.is_empty() {
            return self.solve_stacked(states, tolerance, answer);
        }
        let iterations = self.cg(tolerance)?;
        let SystemVectors { small_side, x_small, forces, .. } = &mut *self.vectors;
        forces.resize(x_small.len(), 0.0);
        self.form.constraint_forces(small_side, x_small, forces)?;
        answer.force.clear();
        answer.slip.clear();
        for (k, link) in links.iter().enumerate() {
            let (force, slip) = match states[k] {
                SlipState::Static => (-inner(&link.tangent, &triple(&self.vectors.forces, link.small)), 0.0),
                state => (limits[k].slipping(state), self.slip(link)),
            };
            answer.force.push(force);
            answer.slip.push(slip);
        }
        Ok(iterations)
    }

    /// Forces that the tissue takes up beside the needle, and displacements beside those that are known beforehand.
    fn magnitudes(&self) -> [f64; 2] {
        let moved = |link: &Link| {
            let a = triple(self.x, link.vertex);
            link.slip.abs().max(self.cx * inner(&a, &a).sqrt())
        };
        [self.scale, self.links.iter().map(moved).fold(0.0, f64::max)]
    }

    fn estimate(&mut self, w: &mut Vec<f64>) -> Result<bool, CouplingError> {
        self.set_states(&vec![SlipState::Forward; self.links.len()])?;
        self.moves.clear();
        self.moves.extend(self.links.iter().map(|link| (link.small, link.tangent)));
        self.form.relative_compliance(&self.moves, w);
        w.iter_mut().for_each(|w| *w *= YIELD * self.cx);
        Ok(true)
    }

    fn condense(&mut self, tolerance: f64, w: &mut Vec<f64>, free_slip: &mut Vec<f64>) -> Result<usize, CouplingError> {
        let q = self.links.len();
        let links = self.links;
        self.set_states(&vec![SlipState::Forward; q])?;
        let (x, x_small) = (self.x.clone(), self.vectors.x_small.clone());
        self.set_sides(|k| links[k].drag * links[k].slip);
        let mut iterations = self.cg(tolerance)?;
        free_slip.clear();
        free_slip.extend(links.iter().map(|link| self.slip(link)));
        w.clear();
        w.resize(q * q, 0.0);
        // One column each: the answer to a unit of friction at one node, all else zero.
        let (b_small, offsets) = (self.vectors.b_small.clone(), self.vectors.offsets.clone());
        let (floor, scale, b) = (std::mem::replace(&mut self.round_floor, 0.0), self.scale, self.b);
        let zero = vec![0.0; b.len()];
        self.b = &[];
        for k in 0..q {
            self.vectors.b_small.fill(0.0);
            self.vectors.offsets.fill(0.0);
            self.x.copy_from_slice(&zero);
            self.vectors.x_small.fill(0.0);
            self.set_unit_sides(&zero, k);
            self.begin(&[])?;
            iterations += self.cg(tolerance)?;
            for (i, link) in links.iter().enumerate() {
                let unit = Link { slip: 0.0, ..*link };
                w[i * q + k] = -self.slip(&unit);
            }
        }
        self.b = b;
        (self.round_floor, self.scale) = (floor, scale);
        self.vectors.b_small = b_small;
        self.vectors.offsets = offsets;
        *self.x = x;
        self.vectors.x_small = x_small;
        Ok(iterations)
    }
}

impl System<'_> {
    /// The same by a method with multipliers.
    fn solve_stacked(
        &mut self,
        states: &[SlipState],
        tolerance: f64,
        answer: &mut Answer,
    ) -> Result<usize, CouplingError> {
        let threshold = self.round_floor + tolerance * self.scale;
        let SystemVectors { big_side, small_side, offsets, x_small, resistance, stacked, forces, .. } =
            &mut *self.vectors;
        let n = big_side.len();
        stacked.x.clear();
        stacked.x.extend(self.x.iter().chain(x_small.iter()));
        stacked.b.clear();
        stacked.b.extend(big_side.iter().chain(small_side.iter()));
        let parts = Parts {
            big: self.a,
            big_matrix: self.matrix,
            w: self.w,
            small: self.form.small(),
            links: self.links,
            resistance,
            offsets,
        };
        let solved = stacked.solve(self.method, &parts, states, (threshold, self.max_iterations), forces)?;
        self.x.copy_from_slice(&stacked.x[..n]);
        x_small.copy_from_slice(&stacked.x[n..]);
        (self.residual, self.threshold) = (solved.1, threshold);
        answer.force.clear();
        answer.slip.clear();
        for (k, link) in self.links.iter().enumerate() {
            let (force, slip) = match states[k] {
                SlipState::Static => (self.vectors.forces[k], 0.0),
                state => (self.limits[k].slipping(state), self.slip(link)),
            };
            answer.force.push(force);
            answer.slip.push(slip);
        }
        Ok(solved.0)
    }

    fn set_unit_sides(&mut self, zero: &[f64], node: usize) {
        let SystemVectors { big_side, small_side, b_small, .. } = &mut *self.vectors;
        big_side.clear();
        big_side.extend_from_slice(zero);
        small_side.clear();
        small_side.extend_from_slice(b_small);
        let link = &self.links[node];
        set_triple(big_side, link.vertex, &link.tangent);
        set_triple(small_side, link.small, &link.tangent.map(|t| -t));
    }
}
