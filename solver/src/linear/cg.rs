//! Projected conjugate gradients.

use super::krylov::{KrylovReport, KrylovSettings, UNDERFLOW, VERIFY_BELOW, not_positive};
use super::passes::{self, Vectors};
use crate::LinearOperator;
use crate::memory::bytes_of_all;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRule, StopRuleError};
use crate::subspace::Subspace;
use crate::team::{Pace, Team};
use crate::vector::{self, dot, first_not_finite, norm2};
use std::time::Instant;

/// Products of a solve that tells what a product takes.
const LEAST: usize = 4;

/// [`KrylovSettings`] under the name of this method.
pub type CgSettings = KrylovSettings;

/// [`KrylovReport`] under the name of this method.
pub type CgReport = KrylovReport;

/// Why a conjugate-gradient solve could not be carried out. `x` then holds the last iterate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CgError {
    /// A vector or the subspace does not fit the operator.
    #[error("operator has dimension {dim}, {what} has length {len}")]
    Shape {
        /// Which argument.
        what: &'static str,
        /// Dimension of the operator.
        dim: usize,
        /// Length of the argument.
        len: usize,
    },
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// A vector holds NaN or an infinity; `A x`, `A p` and `M⁻¹ r` point at the operator or the preconditioner.
    #[error("entry {index} of {what} is not finite at iteration {iteration}")]
    NotFinite {
        /// Which vector.
        what: &'static str,
        /// Its first entry that is not finite.
        index: usize,
        /// Iteration, 0 before the first.
        iteration: usize,
    },
    /// Every entry is finite, but a sum of squares is not.
    #[error("the norm of {what} overflows at iteration {iteration}")]
    Overflow {
        /// Which vector.
        what: &'static str,
        /// Iteration, 0 before the first.
        iteration: usize,
    },
    /// The operator is not positive definite on the subspace.
    #[error("pᵀAp = {curvature:e} at iteration {iteration}: not positive definite on the free space")]
    NotPositiveDefinite {
        /// Iteration, counted from 1.
        iteration: usize,
        /// The value that should have been positive.
        curvature: f64,
    },
    /// The preconditioner is not positive definite on the subspace.
    #[error("rᵀM⁻¹r = {value:e} at iteration {iteration}: the preconditioner is not positive definite")]
    PreconditionerNotPositive {
        /// Iteration, 0 before the first.
        iteration: usize,
        /// The value that should have been positive.
        value: f64,
    },
}

impl CgError {
    /// The same error of a solve that was part of a longer one, `iterations` of which came before.
    pub(super) fn later_by(mut self, iterations: usize) -> Self {
        match &mut self {
            Self::NotFinite { iteration, .. }
            | Self::Overflow { iteration, .. }
            | Self::NotPositiveDefinite { iteration, .. }
            | Self::PreconditionerNotPositive { iteration, .. } => *iteration += iterations,
            Self::Shape { .. } | Self::StopRule(_) => {}
        }
        self
    }
}

/// Vectors of a solve; sized by the first one, so that a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct CgWorkspace {
    /// That of the solve at hand: the whole one, or none where that is faster at the moment.
    team: Team,
    whole: Team,
    pace: Pace,
    r: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    z: Vec<f64>,
    best: Vec<f64>,
    /// `(I − P_W)(b − A x)` and `(I − P_W) A p` of the constrained nodes.
    reaction: Vec<f64>,
    q_reaction: Vec<f64>,
}

impl CgWorkspace {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty workspace whose solves are shared by a team, as long as that is faster than the calling thread alone; the bits do
    /// not depend on it.
    #[must_use]
    pub fn on(team: &Team) -> Self {
        Self { team: team.clone(), whole: team.clone(), ..Self::default() }
    }

    pub(super) fn team(&self) -> &Team {
        &self.team
    }

    /// `b − A x` of the last solve that returned a report, unprojected: at a constrained node its complement is the
    /// negative of the force that holds the node.
    #[must_use]
    pub fn residual(&self) -> &[f64] {
        &self.r
    }

    /// Chooses the team of a solve; when it began, where that is to be noted.
    fn begin(&mut self) -> Option<Instant> {
        if self.whole.size() == 1 {
            return None;
        }
        self.team = if self.pace.is_shared() { self.whole.clone() } else { Team::serial() };
        Some(Instant::now())
    }

    /// Notes what a solve of so many products took.
    fn end(&mut self, since: Option<Instant>, products: usize) {
        if let Some(since) = since
            && products >= LEAST
        {
            self.pace.note(self.team.size() > 1, since.elapsed().as_secs_f64() / products as f64);
        }
    }

    fn resize(&mut self, n: usize, constrained: usize, needs_z: bool) {
        for v in [&mut self.r, &mut self.p, &mut self.q, &mut self.best] {
            v.resize(n, 0.0);
        }
        self.z.resize(if needs_z { n } else { 0 }, 0.0);
        self.reaction.resize(constrained, 0.0);
        self.q_reaction.resize(constrained, 0.0);
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        bytes_of_all([&self.r, &self.p, &self.q, &self.z, &self.best, &self.reaction, &self.q_reaction])
    }
}

/// Where a solve stands when a [`Check`] is called.
#[derive(Clone, Copy, Debug)]
pub struct Checkpoint<'a> {
    /// The iterate.
    pub x: &'a [f64],
    /// Iterations so far.
    pub iterations: usize,
    /// `‖P_W (b − A x)‖₂`.
    pub residual_norm: f64,
    /// `(I − P_W)(b − A x)` of the constrained nodes, in the order of [`Subspace::constrained`].
    pub reaction: &'a [f64],
}

/// A look at the iterate on the way, when it has first met a looser tolerance: a caller that tries one configuration after
/// another sees early that this one will not do, and loses nothing if it does.
pub struct Check<'a> {
    /// The looser tolerance, in place of that of the stopping rule.
    pub tolerance: f64,
    /// Whether to go on. If not, the solve ends as [`Stop::Abandoned`].
    pub goes_on: &'a mut dyn FnMut(Checkpoint) -> bool,
}

/// Minimises `½ xᵀA x − bᵀx` over the moves `x + W` by preconditioned conjugate gradients.
///
/// `b` and `x` have length `n = a.dim() = w.dim()`. On entry `x` satisfies the constraints, on exit it holds the last
/// iterate, moved within `W` alone. `A` must be symmetric, and positive definite on `W`. The residual is kept projected,
/// and the reaction forces follow by the same recurrence, so a stop rule that compares with them is evaluated for the
/// current iterate at the cost of the constrained nodes alone. Where a tolerance below 1e-6 (of the forces, or of the
/// first residual) leaves the recurrence little credit, the residual is evaluated afresh before the solve counts as
/// converged; a solve in which that no longer helps ends as [`Stop::Stalled`] with the best iterate.
///
/// # Errors
/// See [`CgError`].
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithm 16.2, with the projection of Nienhuys,
/// *Cutting in deformable objects*, PhD thesis, Utrecht (2003), eq. (6.7); start vector and stop test as corrected by
/// Ascher & Boxerman, *The Visual Computer* 19 (2003).
pub fn projected_cg<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    b: &[f64],
    x: &mut [f64],
    settings: &CgSettings,
    ws: &mut CgWorkspace,
) -> Result<CgReport, CgError> {
    projected_cg_with_check(a, m, w, b, x, settings, None, ws)
}

/// [`projected_cg`] with a look at the iterate on the way.
///
/// # Errors
/// See [`CgError`].
#[expect(clippy::too_many_arguments, reason = "those of `projected_cg` and one more")]
pub fn projected_cg_with_check<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    b: &[f64],
    x: &mut [f64],
    settings: &CgSettings,
    check: Option<Check>,
    ws: &mut CgWorkspace,
) -> Result<CgReport, CgError> {
    let solve = Solve::new(a, m, w, b, settings)?;
    if let Some(check) = &check {
        StopRule { tolerance: check.tolerance, ..settings.stop }.validate()?;
    }
    if x.len() != b.len() {
        let (dim, len) = (b.len(), x.len());
        return Err(CgError::Shape { what: "x", dim, len });
    }
    ws.resize(b.len(), B * w.n_constrained(), !m.is_identity());
    let since = ws.begin();
    let report = solve.run(x, check, ws)?;
    ws.end(since, report.products);
    w.add_complement(&ws.reaction, &mut ws.r);
    Ok(report)
}

/// What stays the same during a solve.
struct Solve<'a, const B: usize, A: ?Sized, M: ?Sized> {
    a: &'a A,
    m: &'a M,
    w: &'a Subspace<B>,
    b: &'a [f64],
    external_norm: f64,
    settings: &'a CgSettings,
}

/// Residual and reaction norms of an iterate, and the threshold that follows.
#[derive(Clone, Copy)]
struct Measure {
    residual: f64,
    reaction: f64,
    threshold: f64,
}

impl<'a, const B: usize, A: LinearOperator + ?Sized, M: Preconditioner + ?Sized> Solve<'a, B, A, M> {
    fn new(a: &'a A, m: &'a M, w: &'a Subspace<B>, b: &'a [f64], settings: &'a CgSettings) -> Result<Self, CgError> {
        settings.stop.validate()?;
        let dim = a.dim();
        for (what, len) in [("b", b.len()), ("the subspace", w.dim())] {
            if len != dim {
                return Err(CgError::Shape { what, dim, len });
            }
        }
        let external_norm = norm2(b);
        finite(external_norm, "b", b, 0)?;
        Ok(Self { a, m, w, b, external_norm, settings })
    }

    fn run(&self, x: &mut [f64], mut check: Option<Check>, ws: &mut CgWorkspace) -> Result<CgReport, CgError> {
        let mut now = self.evaluate(x, ws, 0)?;
        let mut products = 1;
        let mut evaluated = now; // the last residual that was evaluated, not recurred
        // Whether the recurrence must be checked against an evaluation, and the best iterate kept.
        let StopRule { tolerance, round_floor, .. } = self.settings.stop;
        let verify = tolerance < VERIFY_BELOW && round_floor == 0.0 || now.threshold < VERIFY_BELOW * now.residual;
        let report = |stop, iterations, products, now: Measure| CgReport {
            stop,
            iterations,
            products,
            residual_norm: now.residual,
            reaction_norm: now.reaction,
            threshold: now.threshold,
        };
        if now.residual <= now.threshold {
            return Ok(report(Stop::Converged, 0, products, now));
        }
        if !self.goes_on(&mut check, x, now, 0, ws) {
            return Ok(report(Stop::Abandoned, 0, products, now));
        }
        if verify {
            ws.best.copy_from_slice(x);
        }
        let mut rz = self.precondition(ws, 0)?;
        let mut restart = true;
        for iteration in 1..=self.settings.max_iterations {
            if rz < UNDERFLOW {
                // The residual is so small that its square underflows: nothing is left to minimise.
                return Ok(report(Stop::Stalled, iteration - 1, products, now));
            }
            // Direction.
            if restart {
                let CgWorkspace { r, p, z, .. } = &mut *ws;
                p.copy_from_slice(self.preconditioned(r, z));
                restart = false;
            }
            let curvature = self.a.apply_dot_on(&ws.team, &ws.p, &mut ws.q);
            products += 1;
            if !(curvature > 0.0 && curvature.is_finite()) {
                finite(curvature, "A p", &ws.q, iteration)?;
                return Err(CgError::NotPositiveDefinite { iteration, curvature });
            }

            // Step: x, the projected residual and the reactions.
            let alpha = rz / curvature;
            self.w.split(&mut ws.q, &mut ws.q_reaction);
            let CgWorkspace { team, r, p, q, z, .. } = &mut *ws;
            let rz_before = rz;
            let (rr, next_rz) = passes::step(team, self.m, self.w, alpha, p, q, Vectors { x, r, z });
            rz = next_rz;
            vector::axpy(-alpha, &ws.q_reaction, &mut ws.reaction);
            now = self.measure(rr, ws, iteration)?;

            // Stop?
            let exhausted = now.residual <= 0.1 * f64::EPSILON * evaluated.residual;
            if now.residual <= now.threshold && !verify {
                return Ok(report(Stop::Converged, iteration, products, now));
            }
            if now.residual <= now.threshold || exhausted {
                now = self.evaluate(x, ws, iteration)?;
                products += 1;
                if now.residual <= now.threshold {
                    return Ok(report(Stop::Converged, iteration, products, now));
                }
                if now.residual > 0.5 * evaluated.residual {
                    if verify && now.residual > evaluated.residual {
                        x.copy_from_slice(&ws.best);
                        now = self.evaluate(x, ws, iteration)?;
                        products += 1;
                    }
                    return Ok(report(Stop::Stalled, iteration, products, now));
                }
                evaluated = now;
                ws.best.copy_from_slice(x);
                restart = true;
            }

            if !self.goes_on(&mut check, x, now, iteration, ws) {
                return Ok(report(Stop::Abandoned, iteration, products, now));
            }

            // Next direction.
            if restart {
                rz = self.precondition(ws, iteration)?;
                continue;
            }
            self.check_precondition(rz, ws, iteration)?;
            let CgWorkspace { team, r, p, z, .. } = &mut *ws;
            team.xpby(self.preconditioned(r, z), rz / rz_before, p);
        }
        Ok(report(Stop::IterationLimit, self.settings.max_iterations, products, now))
    }

    /// Lets the caller look, once, when the residual meets the looser tolerance.
    fn goes_on(&self, check: &mut Option<Check>, x: &[f64], now: Measure, iterations: usize, ws: &CgWorkspace) -> bool {
        let Some(due) = check else { return true };
        let rule = StopRule { tolerance: due.tolerance, ..self.settings.stop };
        if now.residual > rule.threshold(self.external_norm, now.reaction) {
            return true;
        }
        let point = Checkpoint { x, iterations, residual_norm: now.residual, reaction: &ws.reaction };
        let goes_on = (due.goes_on)(point);
        *check = None;
        goes_on
    }

    /// `r ← P_W (b − A x)` and the reactions, from scratch.
    fn evaluate(&self, x: &[f64], ws: &mut CgWorkspace, iteration: usize) -> Result<Measure, CgError> {
        self.a.apply_on(&ws.team, x, &mut ws.r);
        ws.team.xpby(self.b, -1.0, &mut ws.r);
        self.w.split(&mut ws.r, &mut ws.reaction);
        let rr = dot(&ws.r, &ws.r);
        if !rr.is_finite()
            && let Some(index) = first_not_finite(x)
        {
            return Err(CgError::NotFinite { what: "x", index, iteration });
        }
        self.measure(rr, ws, iteration)
    }

    fn measure(&self, rr: f64, ws: &CgWorkspace, iteration: usize) -> Result<Measure, CgError> {
        let reaction = norm2(&ws.reaction);
        finite(rr, "the residual b - A x", &ws.r, iteration)?;
        finite(reaction, "the reactions", &ws.reaction, iteration)?;
        Ok(Measure {
            residual: rr.sqrt(),
            reaction,
            threshold: self.settings.stop.threshold(self.external_norm, reaction),
        })
    }

    /// `z ← P_W M⁻¹ r`; returns `rᵀz`.
    fn precondition(&self, ws: &mut CgWorkspace, iteration: usize) -> Result<f64, CgError> {
        if self.m.is_identity() {
            return Ok(dot(&ws.r, &ws.r));
        }
        let value = passes::precondition(&ws.team, self.m, self.w, &ws.r, &mut ws.z);
        self.check_precondition(value, ws, iteration)?;
        Ok(value)
    }

    fn check_precondition(&self, value: f64, ws: &CgWorkspace, iteration: usize) -> Result<(), CgError> {
        if self.m.is_identity() {
            return Ok(());
        }
        finite(value, "M⁻¹ r", &ws.z, iteration)?;
        if not_positive(value, dot(&ws.r, &ws.r)) {
            return Err(CgError::PreconditionerNotPositive { iteration, value });
        }
        Ok(())
    }

    /// `M⁻¹ r` as [`precondition`](Self::precondition) left it.
    fn preconditioned<'v>(&self, r: &'v [f64], z: &'v [f64]) -> &'v [f64] {
        if self.m.is_identity() { r } else { z }
    }
}

/// Names the entry that spoilt a sum.
pub(super) fn finite(sum: f64, what: &'static str, v: &[f64], iteration: usize) -> Result<(), CgError> {
    if sum.is_finite() {
        return Ok(());
    }
    Err(match first_not_finite(v) {
        Some(index) => CgError::NotFinite { what, index, iteration },
        None => CgError::Overflow { what, iteration },
    })
}
