//! MINRES: symmetric systems that need not be definite, nor regular.

use super::krylov::{KrylovReport, KrylovSettings, UNDERFLOW, VectorError, check_length, finite, not_positive};
use crate::LinearOperator;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRuleError};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{axpy, norm2};

/// `‖A r‖ / (‖A‖ ‖r‖)`, in the norms of the preconditioner, at which `r` counts as orthogonal to the range of `A`: `√ε`. Rounding
/// keeps this ratio from falling much further where `b` is not in the range, and then drives the iterate along the kernel.
const LEAST_SQUARES: f64 = 1.5e-8;
/// `|‖A v‖² − vᵀA(A v)|`, relative to its bound, at which the operator counts as unsymmetric.
const ASYMMETRY: f64 = 1e-7;

/// Why a solve could not be carried out. `x` then holds the last iterate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MinresError {
    /// A vector does not fit, or holds what is not a number.
    #[error(transparent)]
    Vector(#[from] VectorError),
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// The preconditioner is not positive definite on the subspace.
    #[error("rᵀM⁻¹r = {value:e} at iteration {iteration}: the preconditioner is not positive definite")]
    PreconditionerNotPositive {
        /// Iteration, 0 before the first.
        iteration: usize,
        /// The value that should have been positive.
        value: f64,
    },
    /// `vᵀA(A v)` differs from `(A v)ᵀ(A v)` for the first direction `v`.
    #[error("(Av)ᵀ(Av) = {square:e}, but vᵀA(Av) = {twice:e}: the operator is not symmetric")]
    NotSymmetric {
        /// `(A v)ᵀ(A v)`.
        square: f64,
        /// `vᵀA(A v)`.
        twice: f64,
    },
}

/// Vectors of a solve; sized by the first one, so that a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct MinresWorkspace {
    team: Team,
    /// The residual: evaluated, then by recurrence.
    r: Vec<f64>,
    /// Two Lanczos vectors, scaled by their `β`.
    r1: Vec<f64>,
    r2: Vec<f64>,
    /// `M⁻¹ r2`, the direction `v = y / β` and its product.
    y: Vec<f64>,
    v: Vec<f64>,
    q: Vec<f64>,
    /// Search directions times their `γ`.
    d1: Vec<f64>,
    d2: Vec<f64>,
    best: Vec<f64>,
    /// `(I − P_W)` of the residual, and of `A` times `v` and the search directions, at the constrained nodes.
    reaction: Vec<f64>,
    q_reaction: Vec<f64>,
    d1_reaction: Vec<f64>,
    d2_reaction: Vec<f64>,
}

impl MinresWorkspace {
    /// An empty workspace; solves run on the calling thread.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty workspace; solves run on a team, with the same bits.
    #[must_use]
    pub fn on(team: Team) -> Self {
        Self { team, ..Self::default() }
    }

    fn resize(&mut self, n: usize, constrained: usize) {
        let Self { r, r1, r2, y, v, q, d1, d2, best, reaction, q_reaction, d1_reaction, d2_reaction, .. } = self;
        for vector in [r, r1, r2, y, v, q, d1, d2, best] {
            vector.resize(n, 0.0);
        }
        for vector in [reaction, q_reaction, d1_reaction, d2_reaction] {
            vector.resize(constrained, 0.0);
        }
    }
}

/// Minimises `‖P_W (b − A x)‖` over the moves `x + W`, in the norm of the preconditioner.
///
/// `b` and `x` have length `n = a.dim() = w.dim()`. On entry `x` satisfies the constraints, on exit it holds the best iterate,
/// moved within `W` alone. `A` must be symmetric: it may be indefinite, and singular as long as `b` lies in its range; `M` must
/// be positive definite on `W`. Where `b` does not lie in the range, or the tolerance is below what rounding allows, the solve
/// ends as [`Stop::Stalled`] with the least-squares iterate; so does one whose residual lies along eigenvectors with eigenvalues
/// below `1.5e-8 ‖A‖`, which are told from a kernel only by a better preconditioner. The residual of the recurrence is not taken at its word: it is
/// evaluated before a solve counts as converged, and the method restarts from it where they differ.
///
/// Symmetry is tested on the first direction alone, for one product more: an operator that fails is unsymmetric, one that
/// passes need not be symmetric.
///
/// # Errors
/// See [`MinresError`].
///
/// Source: Paige & Saunders, *SIAM J. Numer. Anal.* 12 (1975), section 6; preconditioned as in Elman, Silvester & Wathen,
/// *Finite Elements and Fast Iterative Solvers* (2005), Algorithm 6.1.
pub fn minres<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    b: &[f64],
    x: &mut [f64],
    settings: &KrylovSettings,
    ws: &mut MinresWorkspace,
) -> Result<KrylovReport, MinresError> {
    settings.stop.validate()?;
    let n = a.dim();
    check_length("the subspace", w.dim(), n)?;
    check_length("b", b.len(), n)?;
    check_length("x", x.len(), n)?;
    let external_norm = finite(norm2(b), "b", b, 0)?;
    ws.resize(n, B * w.n_constrained());
    Solve { a, m, w, b, external_norm, settings, iterations: 0, products: 0, norm: 0.0 }.run(x, ws)
}

struct Solve<'a, const B: usize, A: ?Sized, M: ?Sized> {
    a: &'a A,
    m: &'a M,
    w: &'a Subspace<B>,
    b: &'a [f64],
    external_norm: f64,
    settings: &'a KrylovSettings,
    iterations: usize,
    products: usize,
    /// Largest norm of a Lanczos matrix so far, Frobenius: an estimate of `‖A‖`.
    norm: f64,
}

/// Residual and reaction norms of an iterate, and the threshold that follows.
#[derive(Clone, Copy)]
struct Measure {
    residual: f64,
    reaction: f64,
    threshold: f64,
}

/// Why a run of the recurrence ended.
enum Ended {
    /// Its residual is small enough or orthogonal to the range of `A`, or there are no more directions.
    Exhausted,
    Budget,
}

/// One reflection `[c s; s −c]` of the QR factorisation of the Lanczos matrix, and what it leaves behind.
struct Rotation {
    c: f64,
    s: f64,
    /// What the next column inherits: its entry above the diagonal before, and two above after the reflection.
    dbar: f64,
    epsilon: f64,
    /// `‖r‖` in the norm of the preconditioner.
    phibar: f64,
}

impl<const B: usize, A: LinearOperator + ?Sized, M: Preconditioner + ?Sized> Solve<'_, B, A, M> {
    fn run(mut self, x: &mut [f64], ws: &mut MinresWorkspace) -> Result<KrylovReport, MinresError> {
        let mut best = self.evaluate(x, ws)?;
        if best.residual <= best.threshold {
            return Ok(self.report(Stop::Converged, best));
        }
        ws.best.copy_from_slice(x);
        loop {
            let ended = self.recur(x, ws)?;
            let before = best;
            let now = self.evaluate(x, ws)?;
            if now.residual <= best.residual {
                best = now;
                ws.best.copy_from_slice(x);
            }
            let stop = match ended {
                _ if now.residual <= now.threshold => Stop::Converged,
                Ended::Budget => Stop::IterationLimit,
                Ended::Exhausted if now.residual <= 0.5 * before.residual => continue,
                Ended::Exhausted => Stop::Stalled,
            };
            x.copy_from_slice(&ws.best);
            return Ok(self.report(stop, best));
        }
    }

    fn report(&self, stop: Stop, now: Measure) -> KrylovReport {
        KrylovReport {
            stop,
            iterations: self.iterations,
            products: self.products,
            residual_norm: now.residual,
            reaction_norm: now.reaction,
            threshold: now.threshold,
        }
    }

    /// The Lanczos process from the residual at hand, and the iterate along with it.
    fn recur(&mut self, x: &mut [f64], ws: &mut MinresWorkspace) -> Result<Ended, MinresError> {
        ws.r1.fill(0.0);
        ws.r2.copy_from_slice(&ws.r);
        for v in [&mut ws.d1, &mut ws.d2, &mut ws.d1_reaction, &mut ws.d2_reaction] {
            v.fill(0.0);
        }
        let mut beta = self.precondition(ws)?;
        let mut beta_before = 1.0;
        let mut t = Rotation { c: -1.0, s: 0.0, dbar: 0.0, epsilon: 0.0, phibar: beta };
        let (mut gamma1, mut gamma2) = (1.0, 1.0);
        let mut norm_square = 0.0; // of this Lanczos matrix
        if beta * beta < UNDERFLOW {
            return Ok(Ended::Exhausted);
        }
        while self.iterations < self.settings.max_iterations {
            self.iterations += 1;
            // Lanczos: T gains the column (β, α, β').
            let alpha = self.lanczos(ws, beta, beta_before)?;
            (beta_before, beta) = (beta, self.precondition(ws)?);
            norm_square += alpha * alpha + 2.0 * beta * beta;
            self.norm = self.norm.max(norm_square.sqrt());
            let norm = self.norm;
            if beta <= f64::EPSILON * norm {
                beta = 0.0;
            }

            // QR: apply the last reflection to that column, and make the next.
            let oldeps = t.epsilon;
            let delta = t.c * t.dbar + t.s * alpha;
            let gbar = t.s * t.dbar - t.c * alpha;
            t.epsilon = t.s * beta;
            t.dbar = -t.c * beta;
            let gamma = gbar.hypot(beta);
            if gbar.hypot(t.dbar) <= LEAST_SQUARES * norm || gamma <= f64::EPSILON * norm {
                return Ok(Ended::Exhausted);
            }
            (t.c, t.s) = (gbar / gamma, beta / gamma);
            let phi = t.c * t.phibar;
            t.phibar *= t.s;

            // Step along d = v − δ/γ₂ d₂ − ε/γ₁ d₁.
            let team = &ws.team;
            team.xpby(&ws.v, -oldeps / gamma1, &mut ws.d1);
            team.axpy(-delta / gamma2, &ws.d2, &mut ws.d1);
            std::mem::swap(&mut ws.d1, &mut ws.d2);
            team.axpy(phi / gamma, &ws.d2, x);
            for (d1, (q, d2)) in ws.d1_reaction.iter_mut().zip(ws.q_reaction.iter().zip(&ws.d2_reaction)) {
                *d1 = *q - oldeps / gamma1 * *d1 - delta / gamma2 * *d2;
            }
            std::mem::swap(&mut ws.d1_reaction, &mut ws.d2_reaction);
            axpy(-phi / gamma, &ws.d2_reaction, &mut ws.reaction);
            (gamma1, gamma2) = (gamma2, gamma);

            // Residual: r ← s² r − c φ̄ v', v' the next Lanczos vector.
            let residual = self.recurred_residual(ws, &t, beta);
            let now = self.measure(residual, ws)?;
            if now.residual <= now.threshold || beta == 0.0 {
                return Ok(Ended::Exhausted);
            }
        }
        Ok(Ended::Budget)
    }

    /// Leaves `β' v'` in `r2` and `β v` in `r1`, the product `A v` at constrained nodes in `q_reaction`; returns `α = vᵀA v`.
    fn lanczos(&mut self, ws: &mut MinresWorkspace, beta: f64, beta_before: f64) -> Result<f64, MinresError> {
        let team = &ws.team;
        for (v, y) in ws.v.iter_mut().zip(&ws.y) {
            *v = *y / beta;
        }
        self.a.apply_on(team, &ws.v, &mut ws.q);
        self.w.split(&mut ws.q, &mut ws.q_reaction);
        self.products += 1;
        if self.products == 2 {
            self.check_symmetry(ws)?;
        }
        let team = &ws.team;
        team.axpy(-beta / beta_before, &ws.r1, &mut ws.q);
        let alpha = finite(team.dot(&ws.v, &ws.q), "A v", &ws.q, self.iterations)?;
        team.axpy(-alpha / beta, &ws.r2, &mut ws.q);
        std::mem::swap(&mut ws.r1, &mut ws.r2);
        std::mem::swap(&mut ws.r2, &mut ws.q);
        Ok(alpha)
    }

    /// Compares `(A v)ᵀ(A v)` with `vᵀA(A v)`; `y` is free to hold `A (A v)`.
    fn check_symmetry(&mut self, ws: &mut MinresWorkspace) -> Result<(), MinresError> {
        self.a.apply_on(&ws.team, &ws.q, &mut ws.y);
        self.w.project(&mut ws.y);
        self.products += 1;
        let (square, twice) = (ws.team.dot(&ws.q, &ws.q), ws.team.dot(&ws.v, &ws.y));
        finite(square, "A v", &ws.q, self.iterations)?;
        let bound = square + ws.team.norm2(&ws.v) * ws.team.norm2(&ws.y);
        if (square - twice).abs() > ASYMMETRY * bound {
            return Err(MinresError::NotSymmetric { square, twice });
        }
        Ok(())
    }

    /// `y ← P_W M⁻¹ r2`; returns `β = √(r2ᵀ y)`.
    fn precondition(&self, ws: &mut MinresWorkspace) -> Result<f64, MinresError> {
        self.m.apply_on(&ws.team, &ws.r2, &mut ws.y);
        self.w.project(&mut ws.y);
        let value = finite(ws.team.dot(&ws.r2, &ws.y), "M⁻¹ r", &ws.y, self.iterations)?;
        let rr = ws.team.dot(&ws.r2, &ws.r2);
        if not_positive(value, rr) && !self.is_rounding(rr, ws) {
            let iteration = self.iterations;
            return Err(MinresError::PreconditionerNotPositive { iteration, value });
        }
        Ok(value.max(0.0).sqrt())
    }

    /// Whether `r2`, of square `rr`, is what rounding left of `A v`: the process has come to its end. `y` is free.
    fn is_rounding(&self, rr: f64, ws: &mut MinresWorkspace) -> bool {
        if self.iterations == 0 {
            return false;
        }
        self.a.apply_on(&ws.team, &ws.v, &mut ws.y);
        let product = ws.team.norm2(&ws.y);
        ws.y.fill(0.0);
        rr.sqrt() <= 64.0 * f64::EPSILON * product
    }

    fn recurred_residual(&self, ws: &mut MinresWorkspace, t: &Rotation, beta: f64) -> f64 {
        if self.m.is_identity() || beta == 0.0 {
            return t.phibar;
        }
        let (keep, add) = (t.s * t.s, t.c * t.phibar / beta);
        for (r, next) in ws.r.iter_mut().zip(&ws.r2) {
            *r = keep * *r - add * *next;
        }
        ws.team.norm2(&ws.r)
    }

    /// `r ← P_W (b − A x)` and the reactions, from scratch.
    fn evaluate(&mut self, x: &[f64], ws: &mut MinresWorkspace) -> Result<Measure, MinresError> {
        self.a.apply_on(&ws.team, x, &mut ws.r);
        self.products += 1;
        ws.team.xpby(self.b, -1.0, &mut ws.r);
        self.w.split(&mut ws.r, &mut ws.reaction);
        let residual = ws.team.norm2(&ws.r);
        if !residual.is_finite() {
            finite(x.iter().sum(), "x", x, self.iterations)?;
            finite(residual, "the residual b - A x", &ws.r, self.iterations)?;
        }
        self.measure(residual, ws)
    }

    fn measure(&self, residual: f64, ws: &MinresWorkspace) -> Result<Measure, MinresError> {
        let reaction = finite(norm2(&ws.reaction), "the reactions", &ws.reaction, self.iterations)?;
        let threshold = self.settings.stop.threshold(self.external_norm, reaction);
        Ok(Measure { residual, reaction, threshold })
    }
}
