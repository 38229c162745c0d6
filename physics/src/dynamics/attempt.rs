//! One attempt at a step, or at a part of one.

use super::error::Setback;
use super::following::Weights;
use super::incremental::Incremental;
use super::preconditioner::Followed;
use super::scheme::Coefficients;
use super::{Integrator, Solution, StageTimes, State, StepReport};
use crate::body::{Body, BodyError};
use crate::material::Hyperelastic;
use std::time::Instant;
use stylet_mesh::CellId;
use stylet_solver::LinearOperator;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::linear::{CgError, CgSettings, projected_cg};
use stylet_solver::nonlinear::{LineSearch, NewtonSettings, line_search::Armijo, newton_cg_with};
use stylet_solver::precondition::PreconditionerError;
use stylet_solver::stop::{Stop, StopRule};
use stylet_solver::subspace::Subspace;
use stylet_solver::vector::{axpy, norm2};

/// What a successful attempt tells; where it ends is in the integrator.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    /// Estimate of the displacement error, m.
    pub error: f64,
}

pub(crate) struct Attempt<'a, const D: usize, const N: usize, M> {
    pub body: &'a mut Body<D, N, M>,
    pub subspace: &'a Subspace<D>,
    pub start: &'a State,
    pub h: f64,
}

/// Forces below this share of those at the start are rounding errors.
const ROUND_OFF: f64 = 1e-14;

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Attempt<'_, D, N, M> {
    /// Leaves the end of the step in `u`, `v`, `a` of the integrator.
    pub(super) fn make(mut self, it: &mut Integrator<D>, report: &mut StepReport<D>) -> Result<Outcome, Setback> {
        let c = it.settings.scheme.coefficients(self.h);
        self.predict(it, &c);
        if M::IS_LINEAR || it.settings.solution == Solution::Linearised {
            self.linearised(it, &c, report)?;
        } else {
            self.newton(it, &c, report)?;
        }
        self.finish(it, &c)?;
        let largest = it.a.iter().zip(&self.start.a).map(|(a1, a0)| (a1 - a0).abs()).fold(0.0, f64::max);
        report.error = it.settings.scheme.error_factor() * self.h * self.h * largest;
        Ok(Outcome { error: report.error })
    }

    /// `u^` and `v^`, and in `a` the last acceleration where nodes are free, what brings constrained ones to where they
    /// are to be.
    pub fn predict(&self, it: &mut Integrator<D>, c: &Coefficients) {
        let start = self.start;
        for i in 0..start.u.len() {
            it.u_hat[i] = start.u[i] + c.h * start.v[i] + c.u_a0 * start.a[i];
            it.v_hat[i] = start.v[i] + c.v_a0 * start.a[i];
        }
        it.a.copy_from_slice(&start.a);
        let u_hat = it.u_hat.as_chunks::<D>().0;
        let (a, target) = (it.a.as_chunks_mut::<D>().0, it.drive.displacement.as_chunks::<D>().0);
        for (node, constraint) in self.subspace.constrained() {
            let wanted: [f64; D] = std::array::from_fn(|k| (target[node][k] - u_hat[node][k]) / c.cx);
            let (free, held) = (constraint.project(a[node]), constraint.project(wanted));
            a[node] = std::array::from_fn(|k| free[k] + wanted[k] - held[k]);
        }
    }

    /// One linearised step. Where the tangent is not positive definite on the free moves, and the step too long for the
    /// mass to make up for it, the step is made with the nearest semidefinite tangents.
    fn linearised(
        &mut self,
        it: &mut Integrator<D>,
        c: &Coefficients,
        report: &mut StepReport<D>,
    ) -> Result<(), Setback> {
        if !M::IS_LINEAR {
            let since = Instant::now();
            self.body.linearize(&self.start.u);
            it.times.linearize.add(since);
            report.elements_updated += self.body.elements_updated() as u64;
        }
        let first = self.solve_linearised(it, c, report);
        let projected = self.body.is_projected();
        if M::IS_LINEAR || projected || !matches!(first, Err(Unsolved::Indefinite)) {
            return first.map_err(Setback::from);
        }
        self.body.set_projection(true);
        self.predict(it, c);
        let second = self.solve_linearised(it, c, report);
        self.body.set_projection(false);
        second.map_err(Setback::from)
    }

    /// Right side, matrix and preconditioner of the linearised step, with the tangents that the body has; returns what
    /// rounding leaves of its residual, N.
    pub fn assemble(&mut self, it: &mut Integrator<D>, c: &Coefficients) -> Result<f64, Unsolved> {
        let (damping, start) = (it.settings.damping, self.start);
        let body = &mut *self.body;
        let [direction, product, _] = &mut it.scratch;
        let since = Instant::now();
        body.internal_force(&start.u, product);
        it.times.forces.add(since);
        let floor = it.round_off + ROUND_OFF * (norm2(product) + norm2(&it.drive.load));
        if !floor.is_finite() {
            let reason = format!("the elastic forces at t = {} s are not finite", start.t);
            return Err(Unsolved::Other(Setback::Curable(reason)));
        }
        for (rhs, (load, force)) in it.rhs.iter_mut().zip(it.drive.load.iter().zip(&*product)) {
            *rhs = load - force;
        }
        for i in 0..start.u.len() {
            direction[i] = it.u_hat[i] - start.u[i] + damping.stiffness * it.v_hat[i];
        }
        body.stiffness().apply_on(&it.team, direction, product);
        axpy(-1.0, product, &mut it.rhs);
        if damping.mass > 0.0 {
            body.apply_mass(&it.v_hat, product);
            axpy(-damping.mass, product, &mut it.rhs);
        }
        let since = Instant::now();
        body.evaluate_damping(&start.u).map_err(|e| Unsolved::Other(Setback::Final(e.into())))?;
        let since = it.times.linearize.add(since);
        let viscous = body.damping();
        if let Some((matrix, _)) = viscous {
            matrix.apply_on(&it.team, &it.v_hat, product);
            axpy(-1.0, product, &mut it.rhs);
        }
        let stiffness = c.cx + c.cv * damping.stiffness;
        let lagged = if viscous.is_some() { c.cv } else { 0.0 };
        let weights = Weights { stiffness, mass: 1.0 + c.cv * damping.mass, lagged };
        it.matrix
            .follow(body, weights, viscous)
            .map_err(|e| Unsolved::Other(Setback::Final(BodyError::from(e).into())))?;
        it.frozen.refresh(&it.matrix.matrix);
        it.preconditioner.follow(&it.team, &it.matrix.matrix, self.subspace)?;
        it.times.matrix.add(since);
        Ok(floor)
    }

    fn solve_linearised(
        &mut self,
        it: &mut Integrator<D>,
        c: &Coefficients,
        report: &mut StepReport<D>,
    ) -> Result<(), Unsolved> {
        let floor = self.assemble(it, c)?;
        let since = Instant::now();
        let stop = StopRule { round_floor: it.settings.stop.round_floor + floor, ..it.settings.stop };
        let settings = CgSettings { stop, max_iterations: it.settings.max_inner_iterations };
        let solved =
            projected_cg(&it.frozen, &*it.preconditioner, self.subspace, &it.rhs, &mut it.a, &settings, &mut it.cg)?;
        it.times.solve.add(since);
        report.iterations += solved.iterations;
        report.newton_iterations += 1;
        (report.residual, report.threshold) = (solved.residual_norm, solved.threshold);
        if solved.stop == Stop::IterationLimit {
            return Err(Unsolved::Other(Setback::Curable(format!(
                "conjugate gradients: residual {:e} N after {} iterations, threshold {:e} N",
                solved.residual_norm, solved.iterations, solved.threshold
            ))));
        }
        self.place(it, c);
        Ok(())
    }

    /// Where the accelerations that were found bring the body.
    pub fn place(&self, it: &mut Integrator<D>, c: &Coefficients) {
        for i in 0..it.u.len() {
            it.u[i] = it.u_hat[i] + c.cx * it.a[i];
        }
    }

    fn newton(&mut self, it: &mut Integrator<D>, c: &Coefficients, report: &mut StepReport<D>) -> Result<(), Setback> {
        let Solution::Newton { max_iterations } = it.settings.solution else { unreachable!("asked for by the caller") };
        let damping = it.settings.damping;
        self.body.set_projection(true);
        let damped = damping.stiffness > 0.0 || self.body.is_viscous();
        if damped {
            let since = Instant::now();
            if damping.stiffness > 0.0 {
                self.body.linearize(&self.start.u);
                report.elements_updated += self.body.elements_updated() as u64;
            }
            self.body.evaluate_damping(&self.start.u).map_err(|e| Setback::Final(e.into()))?;
            it.times.linearize.add(since);
            it.lag(self.body)?;
        }
        for i in 0..it.u.len() {
            it.u[i] = it.u_hat[i] + c.cx * it.a[i];
        }
        it.newton.invalidate();
        let [x, y, z] = &mut it.scratch;
        let mut energy = Incremental {
            body: self.body,
            coefficients: *c,
            damping,
            load: &it.drive.load,
            u_hat: &it.u_hat,
            v_hat: &it.v_hat,
            lagged: damped.then_some((&it.lagged, it.lagged_number)),
            hessian: &mut it.matrix,
            scratch: [x, y, z],
            round_off: it.energy_round_off,
            elements_updated: 0,
            times: StageTimes::default(),
        };
        let since = Instant::now();
        energy.choose_start(&self.start.u, self.subspace, &mut it.u, &mut it.rhs);
        let external = energy.scale(&self.start.u, &it.u, &mut it.rhs);
        let round_floor = it.settings.stop.round_floor + it.round_off + ROUND_OFF * external;
        let mut settings = NewtonSettings::new(StopRule { round_floor, ..it.settings.stop });
        // Energies decide: a residual may shrink on the way to a saddle, and what an overshoot gains is never lost again.
        settings.search = LineSearch::Armijo(Armijo::default());
        settings.max_iterations = max_iterations;
        settings.max_inner_iterations = it.settings.max_inner_iterations;
        let mut m = Followed { team: &it.team, inner: &mut *it.preconditioner };
        // By a pointer: the method is compiled once, not once for each law.
        let mut by_pointer: &mut dyn BlockHessian<D> = &mut energy;
        let solved =
            newton_cg_with(&mut by_pointer, &mut m, self.subspace, external, &mut it.u, &settings, &mut it.newton)?;
        report.elements_updated += energy.elements_updated;
        it.times.add_newton(&energy.times, since);
        report.iterations += solved.inner_iterations;
        report.newton_iterations += solved.iterations;
        (report.residual, report.threshold) = (solved.residual_norm, solved.threshold);
        let accepted = match solved.stop {
            Stop::Converged => true,
            Stop::Stalled => solved.residual_norm <= STALLED * external,
            _ => false,
        };
        let crushed = !accepted && self.body.inverted(&it.u).or(self.body.inverted(&self.start.u)).is_some();
        if crushed && !self.body.requires_positive_j() && solved.stop != Stop::Abandoned {
            // The energy of an inverted element has edges, on which no residual vanishes. The end has less energy than the
            // start: it is as good a way out as any, and shorter steps meet the same edges.
            report.unconverged += 1;
        } else if !accepted {
            return Err(Setback::Curable(format!(
                "Newton's method: {:?} after {} steps, residual {:e} N, threshold {:e} N",
                solved.stop, solved.iterations, solved.residual_norm, solved.threshold
            )));
        }
        for i in 0..it.u.len() {
            it.a[i] = (it.u[i] - it.u_hat[i]) / c.cx;
        }
        Ok(())
    }

    /// Whether no element that must not be inverted is inverted on the way to `u`.
    fn is_reachable(&mut self, it: &mut Integrator<D>) -> bool {
        if !self.body.requires_positive_j() {
            return true;
        }
        let direction = &mut it.scratch[1];
        for i in 0..it.u.len() {
            direction[i] = it.u[i] - self.start.u[i];
        }
        self.body.max_step(&self.start.u, direction, 1.0) >= 1.0
    }

    /// Velocities and accelerations at the end; refuses an end that inverts an element.
    pub fn finish(&mut self, it: &mut Integrator<D>, c: &Coefficients) -> Result<(), Setback> {
        // Newton's method has stayed within the domain by itself.
        if it.settings.solution == Solution::Linearised && !self.is_reachable(it) {
            let (cell, jacobian) = self.body.smallest_jacobian(&it.u).unwrap_or((CellId(0), f64::NAN));
            return Err(Setback::Curable(format!("the step inverts cell {}: det F = {jacobian:e}", cell.0)));
        }
        for i in 0..it.v.len() {
            it.v[i] = it.v_hat[i] + c.cv * it.a[i];
        }
        let (v, a) = (it.v.as_chunks_mut::<D>().0, it.a.as_chunks_mut::<D>().0);
        let (wanted, before) = (it.drive.velocity.as_chunks::<D>().0, self.start.v.as_chunks::<D>().0);
        for (node, constraint) in self.subspace.constrained() {
            let change: [f64; D] = std::array::from_fn(|k| (wanted[node][k] - before[node][k]) / c.h);
            let (v_free, v_held) = (constraint.project(v[node]), constraint.project(wanted[node]));
            let (a_free, a_held) = (constraint.project(a[node]), constraint.project(change));
            v[node] = std::array::from_fn(|k| v_free[k] + wanted[node][k] - v_held[k]);
            a[node] = std::array::from_fn(|k| a_free[k] + change[k] - a_held[k]);
        }
        Ok(())
    }
}

/// Why a linearised step has no solution.
pub(crate) enum Unsolved {
    /// The matrix is not positive definite on the free moves.
    Indefinite,
    Other(Setback),
}

impl From<CgError> for Unsolved {
    fn from(error: CgError) -> Self {
        match error {
            CgError::NotPositiveDefinite { .. } | CgError::PreconditionerNotPositive { .. } => Self::Indefinite,
            other => Self::Other(other.into()),
        }
    }
}

impl From<PreconditionerError> for Unsolved {
    fn from(error: PreconditionerError) -> Self {
        match error {
            PreconditionerError::NotPositive { .. } | PreconditionerError::Indefinite { .. } => Self::Indefinite,
            other => Self::Other(other.into()),
        }
    }
}

impl From<Unsolved> for Setback {
    fn from(unsolved: Unsolved) -> Self {
        match unsolved {
            Unsolved::Indefinite => Self::Curable("the matrix of the step is not positive definite".into()),
            Unsolved::Other(setback) => setback,
        }
    }
}

/// Residual relative to the forces of a step at which a Newton iteration that stalls is accepted.
const STALLED: f64 = 1e-9;

impl<const D: usize> Integrator<D> {
    /// Keeps the damping matrix of a step, `stiffness K` and what viscosities add, as they are at its start.
    fn lag<const N: usize, M: Hyperelastic<D>>(&mut self, body: &Body<D, N, M>) -> Result<(), Setback> {
        let failed = |error| Setback::Final(BodyError::from(error).into());
        let (share, viscous) = (self.settings.damping.stiffness, body.damping());
        let pattern = if share > 0.0 { Some(body.stiffness()) } else { viscous.map(|(matrix, _)| matrix) };
        let Some(pattern) = pattern else { return Ok(()) };
        let scale = if share > 0.0 { share } else { 1.0 };
        self.lagged.resize(body.n_vertices()).map_err(failed)?;
        for row in 0..body.n_vertices() {
            let (columns, blocks) = pattern.row(row);
            if self.lagged.row(row).0 != columns {
                self.lagged.set_row(row, columns, blocks).map_err(failed)?;
            }
            let sums = self.lagged.row_mut(row).1.as_flattened_mut().as_flattened_mut();
            sums.iter_mut().zip(blocks.as_flattened().as_flattened()).for_each(|(sum, k)| *sum = scale * k);
            if let (true, Some((matrix, _))) = (share > 0.0, viscous) {
                let viscous = matrix.row(row).1.as_flattened().as_flattened();
                sums.iter_mut().zip(viscous).for_each(|(sum, d)| *sum += d);
            }
        }
        self.lagged_number += 1;
        Ok(())
    }
}
