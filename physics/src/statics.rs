//! Static equilibrium: `dW/du = f` on the free moves, by a method of choice, with load steps where one step is too far.

use crate::body::{Body, Loaded};
use crate::material::Hyperelastic;
use stylet_mesh::CellId;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::linear::{CgError, CgSettings, CgWorkspace, projected_cg};
use stylet_solver::nonlinear::{
    NewtonSettings, NewtonWorkspace, NonlinearCgSettings, NonlinearCgWorkspace, NonlinearError, NonlinearReport,
    Preconditioning, StepModel, newton_cg, nonlinear_cg,
};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner, PreconditionerError};
use stylet_solver::sparse::{BlockCsr, Frozen};
use stylet_solver::stop::{Stop, StopRule, StopRuleError};
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;
use stylet_solver::vector;

/// How the equilibrium is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StaticMethod {
    /// Projected conjugate gradients: linear materials only.
    Cg,
    /// Projected nonlinear conjugate gradients, preconditioned by the stiffness at the start of each load step.
    NonlinearCg(StepModel),
    /// Projected Newton-CG.
    NewtonCg,
}

/// How a static problem is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticSettings {
    /// The method.
    pub method: StaticMethod,
    /// Its preconditioner.
    pub preconditioning: Preconditioning,
    /// When an equilibrium is accurate enough.
    pub stop: StopRule,
    /// Iterations of the method per load step.
    pub max_iterations: usize,
    /// First load step, as a share of the load, in `(0, 1]`; doubled after a success and halved after a failure.
    pub first_step: f64,
    /// The load step below which the solve gives up, in `(0, 1]`.
    pub smallest_step: f64,
}

impl StaticSettings {
    /// Block Jacobi, the whole load at once, halved down to 1/1024 of it; 100 Newton steps or 100,000 of the others.
    #[must_use]
    pub fn new(method: StaticMethod, stop: StopRule) -> Self {
        let max_iterations = if method == StaticMethod::NewtonCg { 100 } else { 100_000 };
        let preconditioning = Preconditioning::BlockJacobi;
        Self { method, preconditioning, stop, max_iterations, first_step: 1.0, smallest_step: 1.0 / 1024.0 }
    }
}

/// How a static solve went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticReport {
    /// Why the last load step ended: [`Stop::Converged`], or [`Stop::Stalled`] where rounding errors are reached.
    pub stop: Stop,
    /// Load steps that converged.
    pub load_steps: usize,
    /// Load steps that failed and were tried again with half the increment.
    pub failed_steps: usize,
    /// Iterations of the method, all steps together.
    pub iterations: usize,
    /// Iterations of the linear solves inside (Newton), or products (otherwise).
    pub inner_iterations: usize,
    /// Free residual of the last iterate, N.
    pub residual_norm: f64,
    /// Norm of the forces that hold the constrained nodes, N.
    pub reaction_norm: f64,
}

/// Why there is no equilibrium to return. `u` then holds the last one that was reached (the start, if none was).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticError {
    /// Linear conjugate gradients on a nonlinear material.
    #[error("linear conjugate gradients need a material with constant stiffness")]
    NotLinear,
    /// A vector or the subspace does not fit the body.
    #[error("the body has {dim} displacement components, {what} has {len}")]
    Shape {
        /// Which argument.
        what: &'static str,
        /// Components of a displacement.
        dim: usize,
        /// Components of the argument.
        len: usize,
    },
    /// A load step is not in `(0, 1]`.
    #[error("{name} is {value}, it must be above 0 and at most 1")]
    LoadStep {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// An element is inside out (or flat) where the solve starts, which the material does not allow.
    #[error("cell {} is inverted at the start: det F = {jacobian:e}", cell.0)]
    InvertedAtStart {
        /// The cell.
        cell: CellId,
        /// Its `det F`.
        jacobian: f64,
    },
    /// No load step, however small, led further.
    #[error(
        "no equilibrium beyond {load_factor} of the load; smallest det F = {jacobian:e}, in cell {}: {reason}", cell.0
    )]
    Blocked {
        /// Share of the load that is in equilibrium.
        load_factor: f64,
        /// The cell that was closest to inversion in the last attempt.
        cell: CellId,
        /// Its `det F` there.
        jacobian: f64,
        /// What the last attempt ended with.
        reason: String,
    },
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// The linear solve failed.
    #[error(transparent)]
    Cg(#[from] CgError),
    /// The iteration limit ended a linear solve.
    #[error("not converged after {iterations} iterations: residual {residual:e} N, threshold {threshold:e} N")]
    IterationLimit {
        /// Iterations made.
        iterations: usize,
        /// Residual, N.
        residual: f64,
        /// What it should have come down to, N.
        threshold: f64,
    },
    /// The preconditioner could not be built.
    #[error(transparent)]
    Preconditioner(#[from] PreconditionerError),
}

/// Vectors of static solves; a second one of the same size allocates little.
#[derive(Clone, Debug, Default)]
pub struct StaticWorkspace<const D: usize> {
    cg: CgWorkspace,
    frozen: Frozen<D>,
    nonlinear: NonlinearCgWorkspace,
    newton: NewtonWorkspace<D>,
    jacobi: Jacobi<D>,
    block_jacobi: BlockJacobi<D>,
}

impl<const D: usize> StaticWorkspace<D> {
    /// An empty workspace whose linear solves are shared by a team; the bits do not depend on it.
    #[must_use]
    pub fn on(team: &Team) -> Self {
        Self { cg: CgWorkspace::on(team), ..Self::default() }
    }
}

/// Finds the displacement `u` (m) at which elastic forces balance the dead `load` (N) on the moves of `subspace`.
///
/// Vectors are flat, `D` entries per vertex. On entry `u` is the start and satisfies the constraints (prescribed
/// displacements are values of `u` on constrained nodes); on exit it is the equilibrium. Nonlinear materials try the load
/// in steps of adaptive size, each from the equilibrium of the one before.
///
/// # Errors
/// [`StaticError`].
pub fn solve_static<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &mut Body<D, N, M>,
    subspace: &Subspace<D>,
    load: &[f64],
    u: &mut [f64],
    settings: &StaticSettings,
    workspace: &mut StaticWorkspace<D>,
) -> Result<StaticReport, StaticError> {
    let dim = body.dim();
    for (what, len) in [("the load", load.len()), ("u", u.len()), ("the subspace", subspace.dim())] {
        if len != dim {
            return Err(StaticError::Shape { what, dim, len });
        }
    }
    for (name, value) in [("first_step", settings.first_step), ("smallest_step", settings.smallest_step)] {
        if !(value > 0.0 && value <= 1.0) {
            return Err(StaticError::LoadStep { name, value });
        }
    }
    settings.stop.validate()?;
    if settings.method == StaticMethod::Cg {
        return solve_linear(body, subspace, load, u, settings, workspace);
    }
    if M::REQUIRES_POSITIVE_J && body.inverted(u).is_some() {
        let (cell, jacobian) = body.smallest_jacobian(u).unwrap_or((CellId(0), f64::NAN));
        return Err(StaticError::InvertedAtStart { cell, jacobian });
    }
    step_load(body, subspace, load, u, settings, workspace)
}

fn solve_linear<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &Body<D, N, M>,
    subspace: &Subspace<D>,
    load: &[f64],
    u: &mut [f64],
    settings: &StaticSettings,
    ws: &mut StaticWorkspace<D>,
) -> Result<StaticReport, StaticError> {
    if !M::IS_LINEAR {
        return Err(StaticError::NotLinear);
    }
    let cg = CgSettings { stop: settings.stop, max_iterations: settings.max_iterations };
    let StaticWorkspace { cg: vectors, frozen, jacobi, block_jacobi, .. } = ws;
    let m = preconditioner(body.stiffness(), subspace, settings.preconditioning, jacobi, block_jacobi)?;
    frozen.refresh(body.stiffness());
    let report = projected_cg(frozen, m, subspace, load, u, &cg, vectors)?;
    if report.stop == Stop::IterationLimit {
        let (iterations, residual, threshold) = (report.iterations, report.residual_norm, report.threshold);
        return Err(StaticError::IterationLimit { iterations, residual, threshold });
    }
    Ok(StaticReport {
        stop: report.stop,
        load_steps: 1,
        failed_steps: 0,
        iterations: report.iterations,
        inner_iterations: report.products,
        residual_norm: report.residual_norm,
        reaction_norm: report.reaction_norm,
    })
}

fn preconditioner<'a, const D: usize>(
    matrix: &BlockCsr<D>,
    subspace: &Subspace<D>,
    kind: Preconditioning,
    jacobi: &'a mut Jacobi<D>,
    block_jacobi: &'a mut BlockJacobi<D>,
) -> Result<&'a dyn Preconditioner, PreconditionerError> {
    Ok(match kind {
        Preconditioning::Jacobi => {
            jacobi.rebuild(matrix, subspace)?;
            jacobi
        }
        Preconditioning::BlockJacobi => {
            block_jacobi.rebuild(matrix, subspace)?;
            block_jacobi
        }
        _ => &Identity,
    })
}

/// Raises the load from zero to one by steps that adapt.
fn step_load<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &mut Body<D, N, M>,
    subspace: &Subspace<D>,
    load: &[f64],
    u: &mut [f64],
    settings: &StaticSettings,
    ws: &mut StaticWorkspace<D>,
) -> Result<StaticReport, StaticError> {
    let (mut factor, mut step) = (0.0, settings.first_step);
    let (mut load_steps, mut failed_steps, mut iterations, mut inner_iterations) = (0, 0, 0, 0);
    let (mut trial, mut scaled) = (u.to_vec(), load.to_vec());
    loop {
        let next = f64::min(factor + step, 1.0);
        for (scaled, load) in scaled.iter_mut().zip(load) {
            *scaled = next * load;
        }
        trial.copy_from_slice(u);
        let outcome = equilibrate(body, subspace, &scaled, &mut trial, settings, ws);
        let reason = match outcome {
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

/// A stalled solve still counts where nothing but rounding errors is left of the forces.
fn is_balanced(report: &NonlinearReport) -> bool {
    report.stop == Stop::Converged
        || report.residual_norm <= STALL_TOLERANCE * report.reaction_norm.max(f64::MIN_POSITIVE)
}

/// Residual relative to the reactions at which a solve that stalls is in equilibrium.
const STALL_TOLERANCE: f64 = 1e-8;

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
    let mut energy = Loaded::new(body, load);
    match settings.method {
        StaticMethod::NonlinearCg(step) => {
            let nonlinear = NonlinearCgSettings {
                max_iterations: settings.max_iterations,
                step,
                ..NonlinearCgSettings::new(settings.stop)
            };
            let StaticWorkspace { nonlinear: vectors, jacobi, block_jacobi, .. } = ws;
            let m: &dyn Preconditioner = if settings.preconditioning == Preconditioning::None {
                &Identity
            } else {
                energy.linearize(u);
                preconditioner(energy.matrix(), subspace, settings.preconditioning, jacobi, block_jacobi)
                    .map_err(|error| Failure::Curable(error.to_string()))?
            };
            Ok(nonlinear_cg(&mut energy, m, subspace, external_norm, u, &nonlinear, vectors)?)
        }
        _ => {
            let mut newton = NewtonSettings::new(settings.stop);
            newton.max_iterations = settings.max_iterations;
            newton.preconditioning = settings.preconditioning;
            ws.newton.invalidate();
            Ok(newton_cg(&mut energy, subspace, external_norm, u, &newton, &mut ws.newton)?)
        }
    }
}
