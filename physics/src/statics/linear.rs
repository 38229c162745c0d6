//! Bodies of constant stiffness: one linear solve.

use super::{StaticError, StaticMethod, StaticReport, StaticSettings, StaticWorkspace};
use crate::body::Body;
use crate::material::Hyperelastic;
use stylet_solver::linear::{CgSettings, projected_cg};
use stylet_solver::stop::Stop;
use stylet_solver::subspace::Subspace;

/// Solves `K u = load` on the moves of `subspace`.
pub(super) fn solve_linear<const D: usize, const N: usize, M: Hyperelastic<D>>(
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
    #[cfg(feature = "direct")]
    if let StaticMethod::Direct(method) = settings.method {
        return direct::solve(body, subspace, load, u, settings, method, &mut ws.direct);
    }
    debug_assert!(settings.method == StaticMethod::Cg);
    let cg = CgSettings { stop: settings.stop, max_iterations: settings.max_iterations };
    ws.preconditioner.become_kind(settings.preconditioning);
    ws.preconditioner.rebuild(body.stiffness(), subspace)?;
    ws.frozen.refresh(body.stiffness());
    let report = projected_cg(&ws.frozen, &ws.preconditioner, subspace, load, u, &cg, &mut ws.cg)?;
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

#[cfg(feature = "direct")]
mod direct {
    use super::*;
    use std::sync::Arc;
    use stylet_solver::linear::direct::{Factor, FillOrder, Method, Symbolic};
    use stylet_solver::linear::{RefineSettings, RefineWorkspace, refine};

    /// Corrections of a factored solve; two do where the matrix is not hopeless.
    const MOST_CORRECTIONS: usize = 10;

    /// By a factor of the stiffness on the subspace, whose size goes to `bytes`, refined to the tolerance.
    pub(in super::super) fn solve<const D: usize, const N: usize, M: Hyperelastic<D>>(
        body: &Body<D, N, M>,
        subspace: &Subspace<D>,
        load: &[f64],
        u: &mut [f64],
        settings: &StaticSettings,
        method: Method,
        bytes: &mut usize,
    ) -> Result<StaticReport, StaticError> {
        let a = body.stiffness();
        let symbolic = match method {
            Method::Lblt => Symbolic::indefinite(a, FillOrder::MinimumDegree)?,
            _ => Symbolic::new(a, FillOrder::MinimumDegree)?,
        };
        let factor: Factor<D> = Factor::new(Arc::new(symbolic), method, a, subspace)?;
        *bytes = factor.memory_bytes();
        let refinement = RefineSettings { stop: settings.stop, max_iterations: MOST_CORRECTIONS };
        let report = refine(a, &factor, subspace, load, u, &refinement, &mut RefineWorkspace::default())?;
        if report.stop == Stop::IterationLimit {
            let (iterations, residual, threshold) = (report.iterations, report.residual_norm, report.threshold);
            return Err(StaticError::IterationLimit { iterations, residual, threshold });
        }
        Ok(StaticReport {
            stop: report.stop,
            load_steps: 1,
            failed_steps: 0,
            iterations: report.iterations,
            inner_iterations: report.iterations,
            residual_norm: report.residual_norm,
            reaction_norm: report.reaction_norm,
        })
    }
}
