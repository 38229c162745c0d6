//! Projected nonlinear conjugate gradients.

use super::line_search::{Idle, Line, Trial, search};
use super::progress::{Counts, NonlinearError, NonlinearReport, Problem};
use crate::energy::Energy;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRule};
use crate::subspace::Subspace;
use crate::vector::{dot, dot_pair, first_not_finite};

/// Secant moves per step when there is no curvature to go by.
const SECANTS: usize = 6;

/// How the length of a step is guessed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepModel {
    /// Exact for a quadratic energy: `−g·d / d·H d`, one Hessian product per step.
    Curvature,
    /// From directional derivatives alone: about two gradients per step and no Hessian.
    Secant,
}

/// How a minimisation proceeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonlinearCgSettings {
    /// When the residual `P_W ∇E` is small enough.
    pub stop: StopRule,
    /// Budget of steps; zero only evaluates the residual.
    pub max_iterations: usize,
    /// How the length of a step is guessed.
    pub step: StepModel,
}

/// Vectors of a minimisation; a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct NonlinearCgWorkspace {
    g: Vec<f64>,
    reaction: Vec<f64>,
    trial_x: Vec<f64>,
    trial_g: Vec<f64>,
    trial_reaction: Vec<f64>,
    z: Vec<f64>,
    d: Vec<f64>,
    hd: Vec<f64>,
}

impl NonlinearCgWorkspace {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// `∇E` of the iterate that the last solve returned, unprojected: at a constrained node its complement is the force
    /// that holds the node.
    #[must_use]
    pub fn gradient(&self) -> &[f64] {
        &self.g
    }

    fn resize(&mut self, n: usize, constrained: usize) {
        let Self { g, reaction, trial_x, trial_g, trial_reaction, z, d, hd } = self;
        for v in [g, trial_x, trial_g, z, d, hd] {
            v.resize(n, 0.0);
        }
        reaction.resize(constrained, 0.0);
        trial_reaction.resize(constrained, 0.0);
    }
}

/// Minimises an energy over the moves `x + W` by preconditioned nonlinear conjugate gradients.
///
/// `x` has length `energy.dim() = w.dim()`; on entry it satisfies the constraints, on exit it holds the last iterate, moved
/// within `W` alone. `external_norm` is `‖f_ex‖₂` of the stopping rule. `m` approximates the inverse of the Hessian near the
/// solution and stays as it is. Directions follow Polak-Ribière+, with a restart where they do not descend; on a quadratic
/// energy the iterates are those of linear conjugate gradients.
///
/// # Errors
/// See [`NonlinearError`].
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), eqs. (5.44), (5.45); the projection is that of
/// Nienhuys, *Cutting in deformable objects*, PhD thesis, Utrecht (2003), eq. (6.7).
pub fn nonlinear_cg<const B: usize, E: Energy>(
    energy: &mut E,
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    external_norm: f64,
    x: &mut [f64],
    settings: &NonlinearCgSettings,
    ws: &mut NonlinearCgWorkspace,
) -> Result<NonlinearReport, NonlinearError> {
    let problem = Problem::new(energy, w, &settings.stop, external_norm, x)?;
    ws.resize(x.len(), B * w.n_constrained());
    let report = minimise(energy, m, &problem, x, settings, ws)?;
    w.add_complement(&ws.reaction, &mut ws.g);
    Ok(report)
}

fn minimise<const B: usize, E: Energy>(
    energy: &mut E,
    m: &(impl Preconditioner + ?Sized),
    problem: &Problem<B>,
    x: &mut [f64],
    settings: &NonlinearCgSettings,
    ws: &mut NonlinearCgWorkspace,
) -> Result<NonlinearReport, NonlinearError> {
    let mut counts = Counts::default();
    let mut norms = problem.first_gradient(energy, x, &mut ws.g, &mut ws.reaction, &mut counts)?;
    let (mut value, mut last_step) = (None, 1.0);
    let mut idle = Idle::new(norms);
    let mut gz = 0.0;
    let mut steepest = true;
    while norms.residual > problem.threshold(norms) {
        if counts.iterations == settings.max_iterations {
            return Ok(problem.report(Stop::IterationLimit, norms, &counts));
        }

        // Direction: steepest descent here, or conjugate to the last one, made at the end of the loop.
        let mut slope = dot(&ws.g, &ws.d);
        if steepest || slope >= 0.0 || slope.is_nan() {
            precondition(m, problem.w, &ws.g, &mut ws.z);
            gz = dot(&ws.g, &ws.z);
            for (d, z) in ws.d.iter_mut().zip(&ws.z) {
                *d = -z;
            }
            slope = -gz;
            steepest = true;
        }
        if slope >= 0.0 || slope.is_nan() {
            return Ok(problem.report(Stop::Stalled, norms, &counts));
        }

        // Step.
        let exact = match settings.step {
            StepModel::Curvature => exact_step(energy, x, slope, ws, &mut counts)?,
            StepModel::Secant => None,
        };
        let line = Line {
            x,
            direction: &ws.d,
            slope,
            norms,
            first: exact.unwrap_or(last_step),
            secants: if exact.is_some() { 0 } else { SECANTS },
            trust_flat: true,
        };
        let mut trial = Trial { x: &mut ws.trial_x, g: &mut ws.trial_g, reaction: &mut ws.trial_reaction };
        let Some(step) = search(energy, problem, &line, &mut value, &mut trial, &mut counts)? else {
            if steepest {
                return Ok(problem.report(Stop::Stalled, norms, &counts));
            }
            steepest = true;
            continue;
        };
        x.copy_from_slice(&ws.trial_x);
        counts.iterations += 1;
        (value, last_step, norms) = (step.value, step.t, step.norms);

        // β = g₁·M⁻¹(g₁ − g₀) / g₀·M⁻¹g₀, at least zero; M is symmetric, so z₁ will do.
        precondition(m, problem.w, &ws.trial_g, &mut ws.z);
        let (new, cross) = dot_pair(&ws.z, &ws.trial_g, &ws.g);
        let beta = ((new - cross) / gz).max(0.0);
        gz = new;
        for (d, z) in ws.d.iter_mut().zip(&ws.z) {
            *d = beta * *d - z;
        }
        steepest = false;
        std::mem::swap(&mut ws.g, &mut ws.trial_g);
        std::mem::swap(&mut ws.reaction, &mut ws.trial_reaction);

        if idle.stalls(&step) {
            return Ok(problem.report(Stop::Stalled, norms, &counts));
        }
    }
    Ok(problem.report(Stop::Converged, norms, &counts))
}

/// `−g·d / d·H d`, if the curvature is positive.
fn exact_step(
    energy: &mut impl Energy,
    x: &[f64],
    slope: f64,
    ws: &mut NonlinearCgWorkspace,
    counts: &mut Counts,
) -> Result<Option<f64>, NonlinearError> {
    energy.linearize(x);
    energy.hessian_apply(&ws.d, &mut ws.hd);
    counts.linearizations += 1;
    counts.products += 1;
    let curvature = dot(&ws.d, &ws.hd);
    if !curvature.is_finite() {
        let (index, iteration) = (first_not_finite(&ws.hd).unwrap_or(0), counts.iterations);
        return Err(NonlinearError::HessianNotFinite { index, iteration });
    }
    let step = -slope / curvature;
    Ok((curvature > 0.0 && step.is_finite()).then_some(step))
}

/// `z ← P_W M⁻¹ g`.
fn precondition<const B: usize>(m: &(impl Preconditioner + ?Sized), w: &Subspace<B>, g: &[f64], z: &mut [f64]) {
    m.apply(g, z);
    w.project(z);
}
