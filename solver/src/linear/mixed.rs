//! Conjugate gradients in `f32` inside, true residuals in `f64` outside.

use super::passes::{self, Vectors};
use super::{CgError, CgReport, CgSettings};
use crate::LinearOperator;
use crate::precondition::Preconditioner;
use crate::stop::Stop;
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{dot, first_not_finite, norm2};

/// What an inner solve reduces the residual by at most: `f32` carries about seven digits.
const MOST_REDUCTION: f64 = 1e-5;
/// An inner solve aims this much below the threshold, so that the true residual meets it.
const MARGIN: f64 = 0.7;
/// An outer step that leaves more of the residual has reached the rounding errors of `f32` or of `x`.
const LEAST_GAIN: f64 = 0.5;

/// Vectors of a mixed solve; a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct MixedWorkspace {
    team: Team,
    r: Vec<f64>,
    best: Vec<f64>,
    reaction: Vec<f64>,
    inner: Inner,
}

/// The vectors in `f32`.
#[derive(Clone, Debug, Default)]
struct Inner {
    d: Vec<f32>,
    r: Vec<f32>,
    p: Vec<f32>,
    q: Vec<f32>,
    z: Vec<f32>,
}

impl MixedWorkspace {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty workspace whose solves are shared by a team; the bits do not depend on it.
    #[must_use]
    pub fn on(team: &Team) -> Self {
        Self { team: team.clone(), ..Self::default() }
    }

    fn resize(&mut self, n: usize, constrained: usize, needs_z: bool) {
        self.r.resize(n, 0.0);
        self.best.resize(n, 0.0);
        self.reaction.resize(constrained, 0.0);
        let Inner { d, r, p, q, z } = &mut self.inner;
        for v in [d, r, p, q] {
            v.resize(n, 0.0);
        }
        z.resize(if needs_z { n } else { 0 }, 0.0);
    }
}

/// The problem of [`projected_cg`](super::projected_cg), solved by iterative refinement whose corrections come from
/// conjugate gradients in `f32`: half the bytes a product.
///
/// `a32` and `m32` are `a` and its preconditioner in `f32`, such as [`Frozen<B, f32>`](crate::sparse::Frozen) and
/// [`BlockJacobi<B, f32>`](crate::precondition::BlockJacobi). Each correction starts from the true residual, scaled to norm
/// one, and reduces it by at most 1e5; residuals are evaluated with `a`, so the result meets the stopping rule in `f64`. Where
/// corrections no longer help, because the condition of `A` exceeds what `f32` carries, the solve ends as
/// [`Stop::Stalled`] with the best iterate. Iterations are those in `f32`; products count both formats.
///
/// # Errors
/// See [`CgError`]; `NotPositiveDefinite` also where only the rounded matrix is indefinite.
///
/// Source: Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed. (2002), chapter 12.
#[expect(
    clippy::too_many_arguments,
    reason = "those of `projected_cg`, with a matrix and a preconditioner in each format"
)]
pub fn mixed_cg<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    a32: &(impl LinearOperator<f32> + ?Sized),
    m32: &(impl Preconditioner<f32> + ?Sized),
    w: &Subspace<B>,
    b: &[f64],
    x: &mut [f64],
    settings: &CgSettings,
    ws: &mut MixedWorkspace,
) -> Result<CgReport, CgError> {
    settings.stop.validate()?;
    let dim = a.dim();
    for (what, len) in [("b", b.len()), ("x", x.len()), ("the subspace", w.dim()), ("the operator in f32", a32.dim())] {
        if len != dim {
            return Err(CgError::Shape { what, dim, len });
        }
    }
    ws.resize(dim, B * w.n_constrained(), !m32.is_identity());
    let external_norm = norm2(b);
    super::cg::finite(external_norm, "b", b, 0)?;

    let (mut iterations, mut products) = (0, 0);
    let mut best_norm = f64::INFINITY;
    loop {
        // The true residual.
        a.apply_on(&ws.team, x, &mut ws.r);
        ws.team.xpby(b, -1.0, &mut ws.r);
        w.split(&mut ws.r, &mut ws.reaction);
        products += 1;
        let (residual_norm, reaction_norm) = (dot(&ws.r, &ws.r).sqrt(), norm2(&ws.reaction));
        if !residual_norm.is_finite()
            && let Some(index) = first_not_finite(x)
        {
            return Err(CgError::NotFinite { what: "x", index, iteration: iterations });
        }
        super::cg::finite(residual_norm, "the residual b - A x", &ws.r, iterations)?;
        super::cg::finite(reaction_norm, "the reactions", &ws.reaction, iterations)?;
        let threshold = settings.stop.threshold(external_norm, reaction_norm);
        let report = |stop| CgReport { stop, iterations, products, residual_norm, reaction_norm, threshold };
        if residual_norm <= threshold {
            return Ok(report(Stop::Converged));
        }
        if iterations >= settings.max_iterations {
            return Ok(report(Stop::IterationLimit));
        }
        if residual_norm > LEAST_GAIN * best_norm {
            if residual_norm <= best_norm {
                return Ok(report(Stop::Stalled));
            }
            x.copy_from_slice(&ws.best);
            let report = report(Stop::Stalled);
            return Ok(CgReport { residual_norm: best_norm, ..report });
        }
        best_norm = residual_norm;
        ws.best.copy_from_slice(x);

        // A correction in f32.
        let target = (MARGIN * threshold / residual_norm).max(MOST_REDUCTION);
        let scale = 1.0 / residual_norm;
        for (r32, r) in ws.inner.r.iter_mut().zip(&ws.r) {
            *r32 = (scale * r) as f32;
        }
        let budget = settings.max_iterations - iterations;
        let (used, finite) = correct(&ws.team, a32, m32, w, target, budget, &mut ws.inner)
            .map_err(|error| error.later_by(iterations))?;
        iterations += used;
        products += used;
        if !finite {
            // The recurrence overflowed: to the precision of f32 the matrix is singular.
            return Ok(CgReport { stop: Stop::Stalled, iterations, products, residual_norm, reaction_norm, threshold });
        }
        for (x, d) in x.iter_mut().zip(&ws.inner.d) {
            *x += residual_norm * f64::from(*d);
        }
    }
}

/// Solves `P_W A P_W d = r` from zero, up to a residual norm of `target`; returns the iterations, and whether all
/// numbers stayed finite.
fn correct<const B: usize>(
    team: &Team,
    a: &(impl LinearOperator<f32> + ?Sized),
    m: &(impl Preconditioner<f32> + ?Sized),
    w: &Subspace<B>,
    target: f64,
    max_iterations: usize,
    v: &mut Inner,
) -> Result<(usize, bool), CgError> {
    let Inner { d, r, p, q, z } = v;
    d.fill(0.0);
    let mut rz = if m.is_identity() { dot(r, r) } else { passes::precondition(team, m, w, r, z) };
    p.copy_from_slice(if m.is_identity() { r } else { z });
    if !rz.is_finite() {
        let index = first_not_finite(z).unwrap_or(0);
        return Err(CgError::NotFinite { what: "M⁻¹ r in f32", index, iteration: 0 });
    }
    for iteration in 1..=max_iterations {
        if rz <= 0.0 {
            return Err(CgError::PreconditionerNotPositive { iteration, value: rz });
        }
        let curvature = a.apply_dot_on(team, p, q);
        if !curvature.is_finite() {
            if iteration > 1 {
                return Ok((iteration, false));
            }
            let index = first_not_finite(q).unwrap_or(0);
            return Err(CgError::NotFinite { what: "A p in f32", index, iteration });
        }
        if curvature <= 0.0 {
            return Err(CgError::NotPositiveDefinite { iteration, curvature });
        }
        w.project_part(0, q);
        let alpha = (rz / curvature) as f32;
        let (rr, next) = passes::step(team, m, w, alpha, p, q, Vectors { x: d, r, z });
        if !(rr.is_finite() && next.is_finite()) {
            return Ok((iteration, false));
        }
        if rr.sqrt() <= target {
            return Ok((iteration, true));
        }
        let beta = (next / rz) as f32;
        rz = next;
        team.xpby(if m.is_identity() { r } else { z }, beta, p);
    }
    Ok((max_iterations, true))
}
