//! Projected conjugate gradients under constraints `C x = d`, preconditioned by the constraints themselves.

use super::constraints::{ConstraintError, Constraints};
use super::krylov::{KrylovSettings, UNDERFLOW, VectorError, check_length, finite, not_positive};
use super::row_reduction::RowReduction;
use super::schur::Schur;
use crate::LinearOperator;
use crate::precondition::{BlockJacobi, Preconditioner, PreconditionerError};
use crate::sparse::BlockCsr;
use crate::stop::{Stop, StopRuleError};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{self, norm2};

/// Why a constrained solve could not be set up or carried out. `x` then holds the last iterate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConstrainedError {
    /// A vector does not fit, or holds what is not a number.
    #[error(transparent)]
    Vector(#[from] VectorError),
    /// The constraints do not fit, or depend on each other.
    #[error(transparent)]
    Constraint(#[from] ConstraintError),
    /// A diagonal block has no inverse on the allowed moves of its node.
    #[error(transparent)]
    Preconditioner(#[from] PreconditionerError),
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// The operator is not positive definite on the moves that the constraints leave.
    #[error("pᵀAp = {curvature:e} at iteration {iteration}: not positive definite on the kernel of the constraints")]
    NegativeCurvature {
        /// Iteration, counted from 1.
        iteration: usize,
        /// The value that should have been positive.
        curvature: f64,
    },
    /// The projected residual makes an angle of more than 90° with the residual: rounding, or blocks that changed.
    #[error("rᵀz = {value:e} at iteration {iteration}: the constraint preconditioner is not positive")]
    NotPositive {
        /// Iteration, 0 before the first.
        iteration: usize,
        /// The value that should have been positive.
        value: f64,
    },
}

/// Solves `[G Cᵀ; C 0] (z, v) = (r, 0)` on a subspace, `G` the block diagonal of a matrix restricted to it.
#[derive(Debug)]
pub struct ConstraintPreconditioner<const B: usize> {
    w: Subspace<B>,
    c: Constraints,
    g: BlockJacobi<B>,
    schur: Schur,
    /// Nodes that the constraints touch, ascending, each with its place among the constrained nodes.
    touched: Vec<(usize, Option<usize>)>,
}

impl<const B: usize> ConstraintPreconditioner<B> {
    /// Factors the Schur matrix `C G⁻¹ Cᵀ`: densely up to 800 constraints, beyond that by faer's sparse Cholesky (feature
    /// `direct`).
    ///
    /// # Errors
    /// [`ConstraintError::Dependent`] names a constraint that is a combination of others and of the subspace, whether or not
    /// its right side is consistent; [`ConstraintError::TooMany`]; [`PreconditionerError`] names a node.
    pub fn new(matrix: &BlockCsr<B>, w: &Subspace<B>, c: &Constraints) -> Result<Self, ConstrainedError> {
        c.check(w)?;
        let g = BlockJacobi::new(matrix, w)?;
        let schur = Schur::new(c, |node| *g.inverse(node)).map_err(|error| named(error, w, c))?;
        let mut nodes: Vec<usize> = (0..c.n_rows()).flat_map(|row| c.row(row).0).map(|col| col / B).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let held: Vec<usize> = w.constrained().map(|(node, _)| node).collect();
        let touched = nodes.into_iter().map(|node| (node, held.binary_search(&node).ok())).collect();
        Ok(Self { w: w.clone(), c: c.clone(), g, schur, touched })
    }

    /// The constraints.
    #[must_use]
    pub fn constraints(&self) -> &Constraints {
        &self.c
    }

    /// Replaces `d`; the factors do not depend on it.
    ///
    /// # Errors
    /// [`VectorError::Length`]; [`ConstraintError::RightSide`]. The old right side then stays.
    pub fn set_right_side(&mut self, d: &[f64]) -> Result<(), ConstrainedError> {
        check_length("the right side", d.len(), self.c.n_rows())?;
        if let Some(row) = vector::first_not_finite(d) {
            return Err(ConstraintError::RightSide { row, value: d[row] }.into());
        }
        self.c.right_side_mut().copy_from_slice(d);
        Ok(())
    }

    /// `z ← G⁻¹ (r − Cᵀ v)` with `C z = 0`: solved once and refined once. Leaves `v` in `ws.v`.
    fn project(&self, ws: &mut ConstrainedWorkspace) {
        let ConstrainedWorkspace { team, r, z, v, gap, force, .. } = ws;
        self.g.apply_on(team, r, z);
        v.fill(0.0);
        for _ in 0..2 {
            self.c.apply(z, gap);
            self.schur.solve(gap);
            self.add_image(-1.0, gap, force, z);
            vector::axpy(1.0, gap, v);
        }
    }

    /// `z ← z + α G⁻¹ Cᵀ v`, at the touched nodes alone; leaves `Cᵀ v` there in `force`.
    fn add_image(&self, alpha: f64, v: &[f64], force: &mut [f64], z: &mut [f64]) {
        self.forces(v, force);
        let (force, z) = (force.as_chunks::<B>().0, z.as_chunks_mut::<B>().0);
        for &(node, _) in &self.touched {
            let inverse = self.g.inverse(node);
            for k in 0..B {
                z[node][k] += alpha * (0..B).map(|l| inverse[k][l] * force[node][l]).sum::<f64>();
            }
        }
    }

    /// `Cᵀ v` at the touched nodes; other entries of `force` are not written.
    fn forces(&self, v: &[f64], force: &mut [f64]) {
        for &(node, _) in &self.touched {
            force[node * B..][..B].fill(0.0);
        }
        self.c.add_transposed(1.0, v, force);
    }

    /// `r ← r − P_W Cᵀ v`, `reaction ← reaction − (I − P_W) Cᵀ v`.
    fn take_forces(&self, v: &[f64], force: &mut [f64], r: &mut [f64], reaction: &mut [f64]) {
        self.forces(v, force);
        let (force, r) = (force.as_chunks::<B>().0, r.as_chunks_mut::<B>().0);
        let reaction = reaction.as_chunks_mut::<B>().0;
        for &(node, held) in &self.touched {
            let allowed = self.w.get(node).project(force[node]);
            for k in 0..B {
                r[node][k] -= allowed[k];
                if let Some(at) = held {
                    reaction[at][k] -= force[node][k] - allowed[k];
                }
            }
        }
    }
}

/// A row that the factor stumbled over need not be the one a reader would name: asks the row reduction.
fn named<const B: usize>(error: ConstraintError, w: &Subspace<B>, c: &Constraints) -> ConstraintError {
    if !matches!(error, ConstraintError::Dependent { .. }) {
        return error;
    }
    match RowReduction::new(w, c).dependent().first() {
        Some(&row) => ConstraintError::Dependent { row },
        None => error,
    }
}

/// `diag(G, C G⁻¹ Cᵀ)`: positive definite, and three distinct eigenvalues of the coupled system where `G = A`; for
/// [`kkt_minres`](super::kkt_minres) and [`kkt_cg`](super::kkt_cg).
///
/// Source: Murphy, Golub & Wathen, *SIAM J. Sci. Comput.* 21 (2000).
#[derive(Clone, Copy, Debug)]
pub struct SchurDiagonal<'a, const B: usize>(pub &'a ConstraintPreconditioner<B>);

impl<const B: usize> Preconditioner for SchurDiagonal<'_, B> {
    /// # Panics
    /// If a vector does not have one entry per row of the matrix and one per constraint.
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        let n = self.0.c.dim();
        self.0.g.apply(&r[..n], &mut z[..n]);
        z[n..].copy_from_slice(&r[n..]);
        self.0.schur.solve(&mut z[n..]);
    }
}

/// How a constrained solve went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstrainedReport {
    /// Why it ended.
    pub stop: Stop,
    /// Iterations, each with one product `A p`.
    pub iterations: usize,
    /// All products, those that evaluate a residual included.
    pub products: usize,
    /// `‖P_W (b − A x − Cᵀλ)‖₂` of the iterate returned.
    pub residual_norm: f64,
    /// `‖(I − P_W)(b − A x − Cᵀλ)‖₂`: norm of the reaction forces.
    pub reaction_norm: f64,
    /// `‖C x − d‖₂`.
    pub constraint_norm: f64,
    /// What the residual norm was last compared with.
    pub threshold: f64,
}

/// Vectors of a solve; sized by the first one, so that a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct ConstrainedWorkspace {
    team: Team,
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    force: Vec<f64>,
    best: Vec<f64>,
    v: Vec<f64>,
    gap: Vec<f64>,
    best_lambda: Vec<f64>,
    reaction: Vec<f64>,
    q_reaction: Vec<f64>,
}

impl ConstrainedWorkspace {
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

    fn resize(&mut self, n: usize, m: usize, constrained: usize) {
        for v in [&mut self.r, &mut self.z, &mut self.p, &mut self.q, &mut self.force, &mut self.best] {
            v.resize(n, 0.0);
        }
        for v in [&mut self.v, &mut self.gap, &mut self.best_lambda] {
            v.resize(m, 0.0);
        }
        self.reaction.resize(constrained, 0.0);
        self.q_reaction.resize(constrained, 0.0);
    }
}

/// Minimises `½ xᵀA x − bᵀx` over the moves `x + W` with `C x = d`, by conjugate gradients on the kernel of `C`.
///
/// `b` and `x` have one entry per row of `A`, `lambda` one per constraint: on exit it holds the multipliers of
/// `A x + Cᵀλ = b + reactions`, i.e. `−Cᵀλ` are the forces of the constraints. Both `x` and `lambda` are used on entry; `x`
/// satisfies the subspace then, and need not satisfy `C x = d`. `A` must be symmetric, and positive definite on the kernel of
/// `C` within `W`; elsewhere it may be anything. After each projection the residual gives `Cᵀv` to the multipliers, so that it
/// tends to zero itself and rounding does not pile up in the constraints; the residual and `C x = d` are evaluated afresh
/// before a solve counts as converged.
///
/// # Errors
/// See [`ConstrainedError`].
///
/// Source: Gould, Hribar & Nocedal, *SIAM J. Sci. Comput.* 23 (2001), Algorithm 6.2 (residual update), with one step of
/// iterative refinement (section 5).
pub fn constrained_cg<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    m: &ConstraintPreconditioner<B>,
    b: &[f64],
    x: &mut [f64],
    lambda: &mut [f64],
    settings: &KrylovSettings,
    ws: &mut ConstrainedWorkspace,
) -> Result<ConstrainedReport, ConstrainedError> {
    settings.stop.validate()?;
    let (n, rows) = (m.c.dim(), m.c.n_rows());
    check_length("the operator", a.dim(), n)?;
    check_length("b", b.len(), n)?;
    check_length("x", x.len(), n)?;
    check_length("the multipliers", lambda.len(), rows)?;
    let external_norm = finite(norm2(b), "b", b, 0)?;
    finite(norm2(x), "x", x, 0)?;
    finite(norm2(lambda), "the multipliers", lambda, 0)?;
    ws.resize(n, rows, B * m.w.n_constrained());
    let mut solve = Solve { a, m, b, external_norm, scale: external_norm, settings, iterations: 0, products: 0 };
    let (stop, now) = solve.run(x, lambda, ws)?;
    m.c.gap(x, &mut ws.gap);
    Ok(ConstrainedReport {
        stop,
        iterations: solve.iterations,
        products: solve.products,
        residual_norm: now.residual,
        reaction_norm: now.reaction,
        constraint_norm: norm2(&ws.gap),
        threshold: now.threshold,
    })
}

struct Solve<'a, const B: usize, A: ?Sized> {
    a: &'a A,
    m: &'a ConstraintPreconditioner<B>,
    b: &'a [f64],
    external_norm: f64,
    /// Largest of the forces whose difference the residual is: its rounding error is a few ulp of this.
    scale: f64,
    settings: &'a KrylovSettings,
    iterations: usize,
    products: usize,
}

/// A residual below this share of the forces that it is the difference of has rounding errors of its own size.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Norms of an iterate, the threshold that follows, and `rᵀz` of its projected residual.
#[derive(Clone, Copy)]
struct Measure {
    residual: f64,
    reaction: f64,
    threshold: f64,
    rz: f64,
}

impl<const B: usize, A: LinearOperator + ?Sized> Solve<'_, B, A> {
    fn run(
        &mut self,
        x: &mut [f64],
        lambda: &mut [f64],
        ws: &mut ConstrainedWorkspace,
    ) -> Result<(Stop, Measure), ConstrainedError> {
        let mut now = self.evaluate(x, lambda, ws)?;
        let mut evaluated = now;
        if now.residual <= now.threshold {
            return Ok((Stop::Converged, now));
        }
        ws.best.copy_from_slice(x);
        ws.best_lambda.copy_from_slice(lambda);
        ws.p.copy_from_slice(&ws.z);
        while self.iterations < self.settings.max_iterations {
            // Step; nothing is left to minimise where the residual is made of rounding errors.
            if now.rz < UNDERFLOW {
                return Ok((Stop::Stalled, now));
            }
            self.iterations += 1;
            let curvature = self.a.apply_dot_on(&ws.team, &ws.p, &mut ws.q);
            self.products += 1;
            if !(curvature > 0.0 && curvature.is_finite()) {
                finite(curvature, "A p", &ws.q, self.iterations)?;
                return Err(ConstrainedError::NegativeCurvature { iteration: self.iterations, curvature });
            }
            let alpha = now.rz / curvature;
            self.m.w.split(&mut ws.q, &mut ws.q_reaction);
            ws.team.axpy(alpha, &ws.p, x);
            ws.team.axpy(-alpha, &ws.q, &mut ws.r);
            vector::axpy(-alpha, &ws.q_reaction, &mut ws.reaction);
            let rz_before = now.rz;
            now = self.project(lambda, ws)?;

            // Stop?
            let rounding = now.rz <= 0.0 || now.residual <= 0.1 * f64::EPSILON * evaluated.residual;
            if now.residual <= now.threshold || rounding {
                now = self.evaluate(x, lambda, ws)?;
                if now.residual <= now.threshold {
                    return Ok((Stop::Converged, now));
                }
                if now.residual > 0.5 * evaluated.residual {
                    if now.residual > evaluated.residual {
                        x.copy_from_slice(&ws.best);
                        lambda.copy_from_slice(&ws.best_lambda);
                        now = self.evaluate(x, lambda, ws)?;
                    }
                    return Ok((Stop::Stalled, now));
                }
                evaluated = now;
                ws.best.copy_from_slice(x);
                ws.best_lambda.copy_from_slice(lambda);
                ws.p.copy_from_slice(&ws.z);
                continue;
            }

            // Next direction.
            ws.team.xpby(&ws.z, now.rz / rz_before, &mut ws.p);
        }
        Ok((Stop::IterationLimit, now))
    }

    /// Moves `x` onto `C x = d`, then `r ← P_W (b − A x − Cᵀλ)` and its projection, from scratch.
    fn evaluate(
        &mut self,
        x: &mut [f64],
        lambda: &mut [f64],
        ws: &mut ConstrainedWorkspace,
    ) -> Result<Measure, ConstrainedError> {
        let m = self.m;
        for _ in 0..2 {
            m.c.gap(x, &mut ws.gap);
            m.schur.solve(&mut ws.gap);
            m.add_image(1.0, &ws.gap, &mut ws.force, x);
        }
        self.a.apply_on(&ws.team, x, &mut ws.r);
        self.products += 1;
        self.scale = self.scale.max(ws.team.norm2(&ws.r));
        ws.team.xpby(self.b, -1.0, &mut ws.r);
        m.w.split(&mut ws.r, &mut ws.reaction);
        m.take_forces(lambda, &mut ws.force, &mut ws.r, &mut ws.reaction);
        finite(ws.team.norm2(&ws.r), "the residual b - A x", &ws.r, self.iterations)?;
        self.project(lambda, ws)
    }

    /// The scale of forces, those of the multipliers and of their last change included, which may cancel each other.
    fn force_scale(&self, lambda: &[f64], v: &[f64]) -> f64 {
        let force = |i: usize| (lambda[i].abs() + v[i].abs()) * norm2(self.m.c.row(i).1);
        self.scale.max((0..lambda.len()).map(force).sum())
    }

    /// `z` from `r`; hands the constraints' part of `r` to the multipliers.
    fn project(&self, lambda: &mut [f64], ws: &mut ConstrainedWorkspace) -> Result<Measure, ConstrainedError> {
        self.m.project(ws);
        vector::axpy(1.0, &ws.v, lambda);
        self.m.take_forces(&ws.v, &mut ws.force, &mut ws.r, &mut ws.reaction);
        let rr = finite(ws.team.dot(&ws.r, &ws.r), "the residual", &ws.r, self.iterations)?;
        let rz = finite(ws.team.dot(&ws.r, &ws.z), "the projected residual", &ws.z, self.iterations)?;
        let reaction = finite(norm2(&ws.reaction), "the reactions", &ws.reaction, self.iterations)?;
        let threshold = self.settings.stop.threshold(self.external_norm, reaction);
        let residual = rr.sqrt();
        if residual > threshold && not_positive(rz, rr) && residual > ROUNDING * self.force_scale(lambda, &ws.v) {
            return Err(ConstrainedError::NotPositive { iteration: self.iterations, value: rz });
        }
        Ok(Measure { residual, reaction, threshold, rz })
    }
}
