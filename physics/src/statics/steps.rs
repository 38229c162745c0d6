//! Load steps that adapt: from equilibrium to equilibrium up to the whole load.

use super::{Preconditioning, StaticError, StaticMethod, StaticReport, StaticSettings, StaticWorkspace};
use crate::body::{Body, Loaded};
use crate::material::Hyperelastic;
use stylet_mesh::CellId;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::linear::{CgSettings, projected_cg};
use stylet_solver::nonlinear::{
    LbfgsSettings, NewtonSettings, NonlinearCgSettings, NonlinearError, NonlinearReport, lbfgs, newton_cg_with,
    nonlinear_cg,
};
use stylet_solver::precondition::Identity;
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::Subspace;
use stylet_solver::vector;

/// Iterations of the first guess, in which free nodes follow prescribed ones.
const GUESS_ITERATIONS: usize = 200;

/// Residual relative to the reactions at which a solve that stalls is in equilibrium.
const STALL_TOLERANCE: f64 = 1e-8;

/// Raises load and prescribed displacements from their start to their end by steps that adapt.
pub(super) fn step_load<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &mut Body<D, N, M>,
    subspace: &Subspace<D>,
    program: &mut super::Program,
    u: &mut [f64],
    settings: &StaticSettings,
    ws: &mut StaticWorkspace<D>,
) -> Result<StaticReport, StaticError> {
    let (mut factor, mut step) = (0.0, settings.first_step);
    let (mut load_steps, mut failed_steps, mut iterations, mut inner_iterations) = (0, 0, 0, 0);
    let (mut trial, mut load) = (u.to_vec(), vec![0.0; u.len()]);
    loop {
        let next = f64::min(factor + step, 1.0);
        trial.copy_from_slice(u);
        program(next, &mut load, &mut trial);
        follow(body, subspace, u, &mut trial, ws);
        let reason = match equilibrate(body, subspace, &load, &mut trial, settings, ws) {
            Ok(report) => {
                iterations += report.iterations;
                inner_iterations += report.inner_iterations.max(report.products);
                if report.stop != Stop::IterationLimit && is_balanced(&report) {
                    u.copy_from_slice(&trial);
                    (factor, load_steps) = (next, load_steps + 1);
                    if factor >= 1.0 {
                        let (residual_norm, reaction_norm) = (report.residual_norm, report.reaction_norm);
                        let stop = report.stop;
                        return Ok(StaticReport {
                            stop,
                            load_steps,
                            failed_steps,
                            iterations,
                            inner_iterations,
                            residual_norm,
                            reaction_norm,
                        });
                    }
                    step *= 2.0;
                    continue;
                }
                format!(
                    "{:?} after {} iterations, residual {:e} N, threshold {:e} N",
                    report.stop, report.iterations, report.residual_norm, report.threshold
                )
            }
            Err(Failure::Curable(reason)) => reason,
            Err(Failure::Final(error)) => return Err(error),
        };
        failed_steps += 1;
        step *= 0.5;
        if step < settings.smallest_step {
            let (cell, jacobian) = body.smallest_jacobian(&trial).unwrap_or((CellId(0), f64::NAN));
            return Err(StaticError::Blocked { load_factor: factor, cell, jacobian, reason });
        }
    }
}

/// Where prescribed nodes of `trial` have left `u`, lets the free nodes follow them elastically, to first order: nodes that
/// moved alone would turn the elements around them over. What cannot be guessed stays where it is.
fn follow<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &mut Body<D, N, M>,
    subspace: &Subspace<D>,
    u: &[f64],
    trial: &mut [f64],
    ws: &mut StaticWorkspace<D>,
) {
    let mut way: Vec<f64> = trial.iter().zip(u).map(|(new, old)| new - old).collect();
    if way.iter().all(|&x| x == 0.0) {
        return;
    }
    body.linearize(u);
    let nothing = vec![0.0; way.len()];
    let stop = StopRule { tolerance: 1e-3, criterion: Criterion::Reaction, round_floor: 0.0 };
    let cg = CgSettings { stop, max_iterations: GUESS_ITERATIONS };
    if projected_cg(body.stiffness(), &Identity, subspace, &nothing, &mut way, &cg, &mut ws.cg).is_ok()
        && vector::first_not_finite(&way).is_none()
    {
        trial.iter_mut().zip(u).zip(&way).for_each(|((trial, u), way)| *trial = u + way);
    }
}

/// A stalled solve still counts where nothing but rounding errors is left of the forces.
fn is_balanced(report: &NonlinearReport) -> bool {
    report.stop == Stop::Converged
        || report.residual_norm <= STALL_TOLERANCE * report.reaction_norm.max(f64::MIN_POSITIVE)
}

/// Why a load step failed.
enum Failure {
    /// A smaller step may do.
    Curable(String),
    Final(StaticError),
}

impl From<NonlinearError> for Failure {
    fn from(error: NonlinearError) -> Self {
        match error {
            NonlinearError::StopRule(error) => Self::Final(error.into()),
            other => Self::Curable(other.to_string()),
        }
    }
}

/// One load step.
fn equilibrate<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &mut Body<D, N, M>,
    subspace: &Subspace<D>,
    load: &[f64],
    u: &mut [f64],
    settings: &StaticSettings,
    ws: &mut StaticWorkspace<D>,
) -> Result<NonlinearReport, Failure> {
    let external_norm = vector::norm2(load);
    let StaticWorkspace { nonlinear, lbfgs: memory, newton, preconditioner, .. } = ws;
    preconditioner.become_kind(settings.preconditioning);
    if settings.method != StaticMethod::NewtonCg && settings.preconditioning != Preconditioning::None {
        body.linearize(u);
        preconditioner.rebuild(body.stiffness(), subspace).map_err(|error| Failure::Curable(error.to_string()))?;
    }
    // By a pointer: methods are compiled once, not once for each law.
    let mut loaded = Loaded::new(body, load);
    let mut energy: &mut dyn BlockHessian<D> = &mut loaded;
    let max_iterations = settings.max_iterations;
    match settings.method {
        StaticMethod::NonlinearCg { direction, step } => {
            let method =
                NonlinearCgSettings { max_iterations, step, direction, ..NonlinearCgSettings::new(settings.stop) };
            Ok(nonlinear_cg(&mut energy, preconditioner, subspace, external_norm, u, &method, nonlinear)?)
        }
        StaticMethod::Lbfgs => {
            let method = LbfgsSettings { max_iterations, ..LbfgsSettings::new(settings.stop) };
            Ok(lbfgs(&mut energy, preconditioner, subspace, external_norm, u, &method, memory)?)
        }
        _ => {
            let method = NewtonSettings { max_iterations, ..NewtonSettings::new(settings.stop) };
            newton.invalidate();
            Ok(newton_cg_with(&mut energy, preconditioner, subspace, external_norm, u, &method, newton)?)
        }
    }
}
