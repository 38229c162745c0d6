//! Projected Newton-CG.

use super::line_search::{Idle, Line, Trial, search};
use super::progress::{Counts, NonlinearError, NonlinearReport, Norms, Problem};
use super::truncated_cg::{self, Outcome, Vectors};
use crate::LinearOperator;
use crate::energy::BlockHessian;
use crate::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use crate::sparse::BlockCsr;
use crate::stop::{Stop, StopRule};
use crate::subspace::Subspace;
use crate::vector::{dot, first_not_finite};

/// A contraction of the residual above this counts as slow.
const SLOW: f64 = 0.5;

/// When the Hessian is made anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Linearization {
    /// At every iterate.
    Every,
    /// When there is none yet, and when a step left more than half of the residual, not counting what the linear solve
    /// was allowed to leave. The Hessian outlives the solve, see [`NewtonWorkspace::invalidate`].
    WhenSlow,
}

/// How the linear solves are preconditioned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preconditioning {
    /// Not at all.
    None,
    /// [`Jacobi`].
    Jacobi,
    /// [`BlockJacobi`].
    BlockJacobi,
}

/// How a minimisation proceeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// When the residual `P_W ∇E` is small enough.
    pub stop: StopRule,
    /// Budget of steps; zero only evaluates the residual.
    pub max_iterations: usize,
    /// Budget of iterations of the linear solves, all together.
    pub max_inner_iterations: usize,
    /// Largest relative residual of a linear solve, in `(0, 1)`; 0.5 unless there is a reason.
    pub forcing: f64,
    /// When the Hessian is made anew.
    pub linearization: Linearization,
    /// How the linear solves are preconditioned.
    pub preconditioning: Preconditioning,
}

impl NewtonSettings {
    /// The usual choices: forcing 0.5, a fresh Hessian at every iterate, block Jacobi, 100 steps, 10,000 inner iterations.
    #[must_use]
    pub fn new(stop: StopRule) -> Self {
        Self {
            stop,
            max_iterations: 100,
            max_inner_iterations: 10_000,
            forcing: 0.5,
            linearization: Linearization::Every,
            preconditioning: Preconditioning::BlockJacobi,
        }
    }
}

/// Vectors and preconditioners of a minimisation; a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct NewtonWorkspace<const B: usize> {
    g: Vec<f64>,
    reaction: Vec<f64>,
    trial_x: Vec<f64>,
    trial_g: Vec<f64>,
    trial_reaction: Vec<f64>,
    inner: Vectors,
    jacobi: Jacobi<B>,
    block_jacobi: BlockJacobi<B>,
    linearized: bool,
}

impl<const B: usize> NewtonWorkspace<B> {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Makes the next solve with [`Linearization::WhenSlow`] start with a fresh Hessian: call it when the energy, not
    /// only the iterate, has changed and does not keep its [`matrix`](BlockHessian::matrix) up to date itself.
    pub fn invalidate(&mut self) {
        self.linearized = false;
    }

    /// Whether the energy's Hessian is one that the last solve evaluated and would use again.
    #[must_use]
    pub fn is_linearized(&self) -> bool {
        self.linearized
    }

    /// Lets the next solve begin with the Hessian that the energy holds, as a solve does that follows on another one: for
    /// a caller that has restored the energy from a file.
    pub fn assume_linearized(&mut self) {
        self.linearized = true;
    }

    /// `∇E` of the iterate that the last solve returned, unprojected: at a constrained node its complement is the force
    /// that holds the node.
    #[must_use]
    pub fn gradient(&self) -> &[f64] {
        &self.g
    }

    fn resize(&mut self, n: usize, constrained: usize) {
        for v in [&mut self.g, &mut self.trial_x, &mut self.trial_g] {
            v.resize(n, 0.0);
        }
        self.reaction.resize(constrained, 0.0);
        self.trial_reaction.resize(constrained, 0.0);
    }
}

/// Minimises an energy over the moves `x + W` by Newton's method with inexact linear solves.
///
/// `x` has length `energy.dim() = w.dim()`; on entry it satisfies the constraints, on exit it holds the last iterate, moved
/// within `W` alone. `external_norm` is `‖f_ex‖₂` of the stopping rule. A start that satisfies the rule costs one gradient;
/// a full step costs one more, and no energy as long as the residual shrinks and the step does not overshoot. Steps stay
/// inside [`max_step`](crate::energy::Energy::max_step). A Hessian that is not positive definite is followed up to the first direction of
/// negative curvature; where it has no positive diagonal blocks, that linear solve goes without preconditioner.
///
/// # Errors
/// See [`NonlinearError`].
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithm 7.1, with the forcing term
/// `min(½, √(|g|/|g₀|))` after Eisenstat & Walker, SIAM J. Sci. Comput. 17 (1996).
pub fn newton_cg<const B: usize, E: BlockHessian<B>>(
    energy: &mut E,
    w: &Subspace<B>,
    external_norm: f64,
    x: &mut [f64],
    settings: &NewtonSettings,
    ws: &mut NewtonWorkspace<B>,
) -> Result<NonlinearReport, NonlinearError> {
    let problem = Problem::new(energy, w, &settings.stop, external_norm, x)?;
    if !(settings.forcing > 0.0 && settings.forcing < 1.0) {
        let (name, value) = ("forcing", settings.forcing);
        return Err(NonlinearError::Setting { name, value, expected: "a number between 0 and 1" });
    }
    ws.resize(x.len(), B * w.n_constrained());
    let report = minimise(energy, &problem, x, settings, ws)?;
    w.add_complement(&ws.reaction, &mut ws.g);
    Ok(report)
}

fn minimise<const B: usize, E: BlockHessian<B>>(
    energy: &mut E,
    problem: &Problem<B>,
    x: &mut [f64],
    settings: &NewtonSettings,
    ws: &mut NewtonWorkspace<B>,
) -> Result<NonlinearReport, NonlinearError> {
    let mut counts = Counts::default();
    let mut norms = problem.first_gradient(energy, x, &mut ws.g, &mut ws.reaction, &mut counts)?;
    let start_norm = norms.residual;
    let mut value = None;
    let mut model = Model::default();
    let mut idle = Idle::new(norms);
    while norms.residual > problem.threshold(norms) {
        let exhausted = counts.inner_iterations > 0 && counts.inner_iterations >= settings.max_inner_iterations;
        if counts.iterations == settings.max_iterations || exhausted {
            return Ok(problem.report(Stop::IterationLimit, norms, &counts));
        }
        model.prepare(energy, problem.w, x, settings, ws, &mut counts)?;
        let target = forcing(settings.forcing, norms, start_norm, problem.threshold(norms)) * norms.residual;
        let inner = model.solve(energy, problem.w, target, settings, ws, &mut counts)?;

        let slope = dot(&ws.g, &ws.inner.step);
        let line = Line { x, direction: &ws.inner.step, slope, norms, first: 1.0, secants: 0, trust_flat: false };
        let mut trial = Trial { x: &mut ws.trial_x, g: &mut ws.trial_g, reaction: &mut ws.trial_reaction };
        let accepted = match slope < 0.0 {
            true => search(energy, problem, &line, &mut value, &mut trial, &mut counts)?,
            false => None,
        };
        let Some(step) = accepted else {
            if model.fresh {
                return Ok(problem.report(Stop::Stalled, norms, &counts));
            }
            ws.linearized = false; // an old Hessian misled the search: try again with a new one
            continue;
        };
        x.copy_from_slice(&ws.trial_x);
        std::mem::swap(&mut ws.g, &mut ws.trial_g);
        std::mem::swap(&mut ws.reaction, &mut ws.trial_reaction);
        value = step.value;
        counts.iterations += 1;
        let slow = step.norms.residual - inner.residual > SLOW * norms.residual || step.t < 1.0;
        if settings.linearization == Linearization::Every || slow {
            ws.linearized = false;
        }
        model.fresh = false;
        norms = step.norms;

        if idle.stalls(&step) {
            return Ok(problem.report(Stop::Stalled, norms, &counts));
        }
    }
    Ok(problem.report(Stop::Converged, norms, &counts))
}

/// Relative residual that the linear solve may leave: never more accurate than the outer rule asks for.
fn forcing(largest: f64, norms: Norms, start_norm: f64, threshold: f64) -> f64 {
    let eta = (norms.residual / start_norm).sqrt().min(largest);
    eta.max((0.5 * threshold / norms.residual).min(largest))
}

/// State of the Hessian and its preconditioner during one solve.
#[derive(Default)]
struct Model {
    /// The Hessian was made at the current iterate.
    fresh: bool,
    /// The preconditioner belongs to the Hessian and to the subspace of this solve.
    preconditioned: bool,
    /// It could be built.
    usable: bool,
}

impl Model {
    fn prepare<const B: usize, E: BlockHessian<B>>(
        &mut self,
        energy: &mut E,
        w: &Subspace<B>,
        x: &[f64],
        settings: &NewtonSettings,
        ws: &mut NewtonWorkspace<B>,
        counts: &mut Counts,
    ) -> Result<(), NonlinearError> {
        if !ws.linearized || energy.matrix().dim() != x.len() {
            energy.linearize(x);
            counts.linearizations += 1;
            ws.linearized = true;
            self.fresh = true;
            self.preconditioned = false;
        }
        let (dim, len) = (x.len(), energy.matrix().dim());
        if len != dim {
            return Err(NonlinearError::Shape { what: "the Hessian", dim, len });
        }
        if !self.preconditioned {
            let built = match settings.preconditioning {
                Preconditioning::None => Ok(()),
                Preconditioning::Jacobi => ws.jacobi.rebuild(energy.matrix(), w),
                Preconditioning::BlockJacobi => ws.block_jacobi.rebuild(energy.matrix(), w),
            };
            self.usable = built.is_ok();
            self.preconditioned = true;
        }
        Ok(())
    }

    fn solve<const B: usize, E: BlockHessian<B>>(
        &self,
        energy: &E,
        w: &Subspace<B>,
        target: f64,
        settings: &NewtonSettings,
        ws: &mut NewtonWorkspace<B>,
        counts: &mut Counts,
    ) -> Result<Outcome, NonlinearError> {
        let m: &dyn Preconditioner = match settings.preconditioning {
            Preconditioning::Jacobi if self.usable => &ws.jacobi,
            Preconditioning::BlockJacobi if self.usable => &ws.block_jacobi,
            _ => &Identity,
        };
        ws.inner.resize(ws.g.len());
        let matrix: &BlockCsr<B> = energy.matrix();
        let limit = settings.max_inner_iterations.saturating_sub(counts.inner_iterations).max(1);
        let outcome = truncated_cg::solve(matrix, m, w, &ws.g, target, limit, &mut ws.inner);
        let Some(outcome) = outcome else {
            let index = matrix.blocks().find(|(_, _, b)| b.as_flattened().iter().any(|v| !v.is_finite()));
            let (index, iteration) = (index.map_or(0, |(i, _, _)| i * B), counts.iterations);
            return Err(NonlinearError::HessianNotFinite { index, iteration });
        };
        counts.inner_iterations += outcome.iterations;
        counts.products += outcome.iterations;
        debug_assert!(first_not_finite(&ws.inner.step).is_none());
        Ok(outcome)
    }
}
