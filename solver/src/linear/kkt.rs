//! The indefinite system `[A Cᵀ; C 0]` as it stands: conjugate gradients as published, and MINRES.

use super::constraints::{ConstraintError, Constraints};
use super::krylov::{KrylovSettings, UNDERFLOW, VectorError, check_length, finite, not_positive};
use super::minres::{MinresError, MinresWorkspace, minres};
use crate::LinearOperator;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRuleError};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::norm2;

/// `|pᵀK p| / (‖p‖ ‖K p‖)` at which a direction of conjugate gradients counts as broken down.
const BREAKDOWN: f64 = 1e-14;

/// `K = [P_W A Cᵀ; C 0]` on the moves `W × ℝᵐ`: entries of `x` first, one multiplier per constraint after them.
#[derive(Clone, Copy, Debug)]
pub struct KktOperator<'a, const B: usize, A: ?Sized> {
    a: &'a A,
    w: &'a Subspace<B>,
    c: &'a Constraints,
}

/// A coupled system that cannot be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum KktError {
    /// A vector does not fit, or holds what is not a number.
    #[error(transparent)]
    Vector(#[from] VectorError),
    /// The constraints do not fit the operator or the subspace.
    #[error(transparent)]
    Constraint(#[from] ConstraintError),
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// The preconditioner is not positive definite.
    #[error("rᵀM⁻¹r = {value:e} at iteration {iteration}: the preconditioner is not positive definite")]
    PreconditionerNotPositive {
        /// Iteration, 0 before the first.
        iteration: usize,
        /// The value that should have been positive.
        value: f64,
    },
    /// MINRES found its input wanting.
    #[error(transparent)]
    Minres(#[from] MinresError),
}

/// How a solve of the coupled system went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KktReport {
    /// Why it ended.
    pub stop: Stop,
    /// Iterations, each with one product.
    pub iterations: usize,
    /// All products, those that evaluate a residual included.
    pub products: usize,
    /// Norm of the whole residual `(P_W (b − A x − Cᵀλ), d − C x)`; its two parts have different units.
    pub residual_norm: f64,
    /// `‖C x − d‖₂`.
    pub constraint_norm: f64,
    /// What the residual norm was compared with: the external norm is that of `(P_W b, d)`.
    pub threshold: f64,
    /// Directions of negative curvature that conjugate gradients went along; zero for MINRES.
    pub negative_steps: usize,
}

/// Vectors of a solve; sized by the first one, so that a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct KktWorkspace {
    team: Team,
    z: Vec<f64>,
    right_side: Vec<f64>,
    r: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    preconditioned: Vec<f64>,
    best: Vec<f64>,
    minres: MinresWorkspace,
    all: Subspace<1>,
}

impl KktWorkspace {
    /// An empty workspace; solves run on the calling thread.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty workspace; solves run on a team, with the same bits.
    #[must_use]
    pub fn on(team: Team) -> Self {
        Self { minres: MinresWorkspace::on(team.clone()), team, ..Self::default() }
    }
}

impl<'a, const B: usize, A: LinearOperator + ?Sized> KktOperator<'a, B, A> {
    /// The coupled operator of `a` on the subspace `w`, with the constraints `c`.
    ///
    /// # Errors
    /// [`ConstraintError::Shape`] if the three differ in length; [`ConstraintError::RightSide`].
    pub fn new(a: &'a A, w: &'a Subspace<B>, c: &'a Constraints) -> Result<Self, ConstraintError> {
        c.check(w)?;
        if a.dim() != c.dim() {
            return Err(ConstraintError::Shape { what: "the operator", dim: c.dim(), len: a.dim() });
        }
        Ok(Self { a, w, c })
    }

    /// Stacks `(P_W b, d)` and the start `(x, λ)` in the workspace.
    fn gather(&self, b: &[f64], x: &[f64], lambda: &[f64], ws: &mut KktWorkspace) -> Result<(), VectorError> {
        let (n, m) = (self.c.dim(), self.c.n_rows());
        check_length("b", b.len(), n)?;
        check_length("x", x.len(), n)?;
        check_length("the multipliers", lambda.len(), m)?;
        finite(norm2(b), "b", b, 0)?;
        finite(norm2(x), "x", x, 0)?;
        finite(norm2(lambda), "the multipliers", lambda, 0)?;
        for v in [&mut ws.z, &mut ws.right_side, &mut ws.r, &mut ws.p, &mut ws.q, &mut ws.preconditioned, &mut ws.best]
        {
            v.resize(n + m, 0.0);
        }
        ws.right_side[..n].copy_from_slice(b);
        self.w.project(&mut ws.right_side[..n]);
        ws.right_side[n..].copy_from_slice(self.c.right_side());
        ws.z[..n].copy_from_slice(x);
        ws.z[n..].copy_from_slice(lambda);
        Ok(())
    }

    fn scatter(&self, z: &[f64], x: &mut [f64], lambda: &mut [f64]) {
        let n = self.c.dim();
        x.copy_from_slice(&z[..n]);
        lambda.copy_from_slice(&z[n..]);
    }

    /// `r ← (P_W b, d) − K z`; returns its norm.
    fn evaluate(&self, ws: &mut KktWorkspace, iteration: usize) -> Result<f64, VectorError> {
        self.apply_on(&ws.team, &ws.z, &mut ws.r);
        ws.team.xpby(&ws.right_side, -1.0, &mut ws.r);
        finite(ws.team.norm2(&ws.r), "the residual", &ws.r, iteration)
    }
}

impl<const B: usize, A: LinearOperator + ?Sized> LinearOperator for KktOperator<'_, B, A> {
    fn dim(&self) -> usize {
        self.c.dim() + self.c.n_rows()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.apply_on(&Team::serial(), x, y);
    }

    fn apply_on(&self, team: &Team, x: &[f64], y: &mut [f64]) {
        let n = self.c.dim();
        let ((x, lambda), (y, gap)) = (x.split_at(n), y.split_at_mut(n));
        self.a.apply_on(team, x, y);
        self.c.add_transposed(1.0, lambda, y);
        self.w.project(y);
        self.c.apply(x, gap);
    }
}

/// Solves `A x + Cᵀλ = b` on the moves `x + W`, `C x = d`, by conjugate gradients on the indefinite matrix.
///
/// `b` and `x` have one entry per row of `A`, `lambda` one per constraint; both are used on entry. On exit they hold the best
/// iterate. Nothing guarantees convergence: the method is here because it was published for this system, and as what others
/// are compared with. A direction along which the curvature vanishes ends the solve as [`Stop::Stalled`]; that happens at once
/// where the first residual lies in the constraints alone (`b = 0`, `x = 0`, `λ = 0`, without a preconditioner).
/// `m` acts on the stacked vector and must be positive definite.
///
/// # Errors
/// See [`KktError`].
///
/// Source: Chentanez et al., *Interactive simulation of surgical needle insertion and steering*, ACM Trans. Graph. 28 (2009),
/// section 3.3, eq. (7).
pub fn kkt_cg<const B: usize, A: LinearOperator + ?Sized>(
    k: &KktOperator<'_, B, A>,
    m: &(impl Preconditioner + ?Sized),
    b: &[f64],
    x: &mut [f64],
    lambda: &mut [f64],
    settings: &KrylovSettings,
    ws: &mut KktWorkspace,
) -> Result<KktReport, KktError> {
    settings.stop.validate()?;
    k.gather(b, x, lambda, ws)?;
    let threshold = settings.stop.threshold(finite(norm2(&ws.right_side), "(b, d)", &ws.right_side, 0)?, 0.0);
    let mut solve = IndefiniteCg { k, m, threshold, largest: 0.0, iterations: 0, products: 0, negative: 0 };
    let (stop, residual_norm) = solve.run(settings.max_iterations, ws)?;
    k.scatter(&ws.z, x, lambda);
    Ok(KktReport {
        stop,
        iterations: solve.iterations,
        products: solve.products,
        residual_norm,
        constraint_norm: norm2(&ws.r[k.c.dim()..]),
        threshold,
        negative_steps: solve.negative,
    })
}

/// Solves the same system by [`minres`]; `m` acts on the stacked vector.
///
/// Dependent constraints are no obstacle as long as they do not contradict each other; if they do, the solve ends as
/// [`Stop::Stalled`] with the least-squares iterate.
///
/// # Errors
/// See [`KktError`].
pub fn kkt_minres<const B: usize, A: LinearOperator + ?Sized>(
    k: &KktOperator<'_, B, A>,
    m: &(impl Preconditioner + ?Sized),
    b: &[f64],
    x: &mut [f64],
    lambda: &mut [f64],
    settings: &KrylovSettings,
    ws: &mut KktWorkspace,
) -> Result<KktReport, KktError> {
    k.gather(b, x, lambda, ws)?;
    ws.all.resize(k.dim());
    let report = minres(k, m, &ws.all, &ws.right_side, &mut ws.z, settings, &mut ws.minres)?;
    k.scatter(&ws.z, x, lambda);
    let gap = &mut ws.q[..k.c.n_rows()];
    k.c.gap(x, gap);
    Ok(KktReport {
        stop: report.stop,
        iterations: report.iterations,
        products: report.products,
        residual_norm: report.residual_norm,
        constraint_norm: norm2(gap),
        threshold: report.threshold,
        negative_steps: 0,
    })
}

struct IndefiniteCg<'a, 'k, const B: usize, A: ?Sized, M: ?Sized> {
    k: &'a KktOperator<'k, B, A>,
    m: &'a M,
    threshold: f64,
    /// Norm of the largest residual so far, of which a few ulp stay behind in later ones.
    largest: f64,
    iterations: usize,
    products: usize,
    negative: usize,
}

impl<const B: usize, A: LinearOperator + ?Sized, M: Preconditioner + ?Sized> IndefiniteCg<'_, '_, B, A, M> {
    /// Leaves the best iterate in `z` and its evaluated residual in `r`; returns the norm of the latter.
    fn run(&mut self, max_iterations: usize, ws: &mut KktWorkspace) -> Result<(Stop, f64), KktError> {
        let mut evaluated = self.evaluate(ws)?;
        self.largest = evaluated;
        if evaluated <= self.threshold {
            return Ok((Stop::Converged, evaluated));
        }
        let mut best = evaluated;
        ws.best.copy_from_slice(&ws.z);
        let mut rz = self.precondition(ws)?;
        ws.p.copy_from_slice(&ws.preconditioned);
        let mut stop = Stop::IterationLimit;
        while self.iterations < max_iterations {
            // Step.
            if rz < UNDERFLOW {
                stop = Stop::Stalled;
                break;
            }
            self.iterations += 1;
            let curvature = self.k.apply_dot_on(&ws.team, &ws.p, &mut ws.q);
            self.products += 1;
            finite(curvature, "K p", &ws.q, self.iterations)?;
            let scale = ws.team.norm2(&ws.p) * ws.team.norm2(&ws.q);
            if curvature.abs() <= BREAKDOWN * scale {
                stop = Stop::Stalled;
                break;
            }
            self.negative += usize::from(curvature < 0.0);
            let alpha = rz / curvature;
            ws.team.axpy(alpha, &ws.p, &mut ws.z);
            ws.team.axpy(-alpha, &ws.q, &mut ws.r);
            let residual = ws.team.norm2(&ws.r);
            if !residual.is_finite() {
                stop = Stop::Stalled; // diverged
                break;
            }
            self.largest = self.largest.max(residual);

            // Stop?
            if residual < best {
                best = residual;
                ws.best.copy_from_slice(&ws.z);
            }
            let mut beta = 0.0;
            if residual <= self.threshold {
                let now = self.evaluate(ws)?;
                if now <= self.threshold {
                    return Ok((Stop::Converged, now));
                }
                if now > 0.5 * evaluated {
                    stop = Stop::Stalled;
                    break;
                }
                (evaluated, best) = (now, now); // and start afresh
            } else {
                beta = 1.0 / rz;
            }

            // Next direction.
            rz = self.precondition(ws)?;
            ws.team.xpby(&ws.preconditioned, beta * rz, &mut ws.p);
        }
        ws.z.copy_from_slice(&ws.best);
        let now = self.evaluate(ws)?;
        Ok((stop, now))
    }

    fn evaluate(&mut self, ws: &mut KktWorkspace) -> Result<f64, KktError> {
        self.products += 1;
        Ok(self.k.evaluate(ws, self.iterations)?)
    }

    /// `M⁻¹ r`, its moves in `W`; returns `rᵀM⁻¹r`.
    fn precondition(&self, ws: &mut KktWorkspace) -> Result<f64, KktError> {
        self.m.apply_on(&ws.team, &ws.r, &mut ws.preconditioned);
        self.k.w.project(&mut ws.preconditioned[..self.k.c.dim()]);
        let value = ws.team.dot(&ws.r, &ws.preconditioned);
        finite(value, "M⁻¹ r", &ws.preconditioned, self.iterations)?;
        let rr = ws.team.dot(&ws.r, &ws.r);
        if not_positive(value, rr) && rr.sqrt() > 64.0 * f64::EPSILON * self.largest {
            let iteration = self.iterations;
            return Err(KktError::PreconditionerNotPositive { iteration, value });
        }
        Ok(value.max(0.0)) // of a residual of rounding errors
    }
}
