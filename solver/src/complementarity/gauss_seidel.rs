//! Projected Gauss-Seidel with overrelaxation, and Newton steps on the components between their bounds.

use super::problem::{BoxError, BoxProblem, BoxReport, BoxState, BoxWorkspace};
use crate::stop::Stop;
use crate::vector::dot;

/// A batch of sweeps that lowers the residual by less than this factor stalls.
const STALL: f64 = 0.999;
/// Sweeps between two looks at the progress.
const BATCH: usize = 8;

/// How far projected Gauss-Seidel goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussSeidelSettings {
    /// Relaxation factor ω, between 0 and 2 exclusively; 1 is Gauss-Seidel.
    pub relaxation: f64,
    /// Largest natural residual that counts as converged, in the unit of `λ`; not negative.
    pub tolerance: f64,
    /// Budget of sweeps.
    pub max_sweeps: usize,
    /// Whether a Newton step on the components between their bounds follows each batch of eight sweeps. It is kept if it lowers
    /// the residual.
    pub newton: bool,
}

impl Default for GaussSeidelSettings {
    fn default() -> Self {
        Self { relaxation: 1.0, tolerance: 1e-10, max_sweeps: 1000, newton: true }
    }
}

/// Solves the problem by sweeps `λ_i ← clamp(λ_i − ω w_i / W_ii)`, from the `lambda` handed in, put within the bounds.
///
/// For positive definite `W` the sweeps converge; [`Stop::Stalled`] means that eight of them hardly lowered the residual and no
/// Newton step helped either. `lambda` is within the bounds at all times, and on exit the iterate of least residual.
///
/// # Errors
/// See [`BoxError`]. A matrix that is not positive definite, but has a positive diagonal, may go unnoticed: the residual of the
/// report is that of a solution all the same.
///
/// Source: Cottle, Pang & Stone, *The Linear Complementarity Problem* (1992), section 5.2; subspace steps: Silcowitz, Niebe &
/// Erleben, *Projected Gauss-Seidel subspace minimization method*, GRAPP 2010.
pub fn projected_gauss_seidel(
    problem: &BoxProblem<'_>,
    lambda: &mut [f64],
    settings: &GaussSeidelSettings,
    ws: &mut BoxWorkspace,
) -> Result<BoxReport, BoxError> {
    problem.check(lambda)?;
    check_settings(settings)?;
    ws.resize(problem.n());
    for (i, value) in lambda.iter_mut().enumerate() {
        *value = problem.clamp(i, *value);
    }
    ws.best.copy_from_slice(lambda);
    problem.evaluate(lambda, &mut ws.w);
    let mut best = problem.natural_residual(lambda, &ws.w);
    let mut report = BoxReport { stop: Stop::Converged, iterations: 0, factorisations: 0, residual: best };
    while best > settings.tolerance {
        if report.iterations >= settings.max_sweeps {
            report.stop = Stop::IterationLimit;
            break;
        }
        let before = best;
        for _ in 0..BATCH.min(settings.max_sweeps - report.iterations) {
            sweep(problem, lambda, settings.relaxation);
            report.iterations += 1;
        }
        best = keep_best(problem, lambda, ws, best)?;
        if settings.newton && best > settings.tolerance {
            newton_step(problem, lambda, ws)?;
            report.factorisations += 1;
            best = keep_best(problem, lambda, ws, best)?;
            lambda.copy_from_slice(&ws.best);
        }
        if best > settings.tolerance && best > STALL * before {
            report.stop = Stop::Stalled;
            break;
        }
    }
    lambda.copy_from_slice(&ws.best);
    problem.evaluate(lambda, &mut ws.w);
    for i in 0..problem.n() {
        ws.states[i] = state(problem, i, lambda[i], ws.w[i]);
    }
    report.residual = best;
    Ok(report)
}

fn check_settings(settings: &GaussSeidelSettings) -> Result<(), BoxError> {
    let value = settings.relaxation;
    if !(value > 0.0 && value < 2.0) {
        return Err(BoxError::Settings { what: "relaxation", value });
    }
    let value = settings.tolerance;
    if !(value >= 0.0 && value.is_finite()) {
        return Err(BoxError::Settings { what: "tolerance", value });
    }
    Ok(())
}

fn sweep(problem: &BoxProblem<'_>, lambda: &mut [f64], relaxation: f64) {
    for i in 0..problem.n() {
        let w = dot(problem.row(i), lambda) + problem.q[i];
        lambda[i] = problem.clamp(i, lambda[i] - relaxation * w / problem.diagonal(i));
    }
}

/// Solves for the components that a Gauss-Seidel step would leave between their bounds, and puts them within.
fn newton_step(problem: &BoxProblem<'_>, lambda: &mut [f64], ws: &mut BoxWorkspace) -> Result<(), BoxError> {
    problem.evaluate(lambda, &mut ws.w);
    for i in 0..problem.n() {
        ws.states[i] = state(problem, i, lambda[i], ws.w[i]);
    }
    problem.solve_states(ws, lambda)?;
    for (i, value) in lambda.iter_mut().enumerate() {
        *value = problem.clamp(i, *value);
    }
    Ok(())
}

/// The residual of the better of `lambda` and the best so far, which is kept.
fn keep_best(problem: &BoxProblem<'_>, lambda: &[f64], ws: &mut BoxWorkspace, best: f64) -> Result<f64, BoxError> {
    problem.evaluate(lambda, &mut ws.w);
    let residual = problem.natural_residual(lambda, &ws.w);
    if !residual.is_finite() {
        let index = ws.w.iter().position(|w| !w.is_finite()).unwrap_or(0);
        return Err(BoxError::NotFinite { what: "w", index });
    }
    if residual < best {
        ws.best.copy_from_slice(lambda);
        return Ok(residual);
    }
    Ok(best)
}

fn state(problem: &BoxProblem<'_>, i: usize, lambda: f64, w: f64) -> BoxState {
    let (lower, upper) = (problem.lower[i], problem.upper[i]);
    let target = lambda - w / problem.diagonal(i);
    if lower == upper {
        return if w < 0.0 { BoxState::Upper } else { BoxState::Lower };
    }
    if target <= lower {
        BoxState::Lower
    } else if target >= upper {
        BoxState::Upper
    } else {
        BoxState::Between
    }
}
