//! Projected Newton-CG.

mod forcing;
mod preconditioning;

pub use forcing::Forcing;
pub use preconditioning::{Following, HessianPreconditioner, Kept, Preconditioning};

use super::line_search::{Idle, Line, LineSearch, Trial, advance};
use super::progress::{Counts, NonlinearError, NonlinearReport, Problem};
use super::truncated_cg::{self, Broken, Outcome, System, Vectors};
use crate::LinearOperator;
use crate::energy::BlockHessian;
use crate::memory::bytes_of_all;
use crate::precondition::{BlockJacobi, Identity, Jacobi};
use crate::sparse::BlockCsr;
use crate::stop::{Stop, StopRule};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{dot, first_not_finite};
use forcing::Accuracy;

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
    /// How much less a linear solve may leave as the iteration gets on.
    pub forcing_rule: Forcing,
    /// When the Hessian is made anew.
    pub linearization: Linearization,
    /// How the linear solves of [`newton_cg`] are preconditioned; [`newton_cg_with`] has its own.
    pub preconditioning: Preconditioning,
    /// What makes a step acceptable.
    pub search: LineSearch,
}

impl NewtonSettings {
    /// The usual choices: forcing at most 0.5 by [`Forcing::Root`], a fresh Hessian at every iterate, block Jacobi, gradients
    /// before energies, 100 steps, 10,000 inner iterations.
    #[must_use]
    pub fn new(stop: StopRule) -> Self {
        Self {
            stop,
            max_iterations: 100,
            max_inner_iterations: 10_000,
            forcing: 0.5,
            forcing_rule: Forcing::Root,
            linearization: Linearization::Every,
            preconditioning: Preconditioning::BlockJacobi,
            search: LineSearch::GradientFirst,
        }
    }

    fn validate(&self) -> Result<(), NonlinearError> {
        if !(self.forcing > 0.0 && self.forcing < 1.0) {
            let (name, value) = ("forcing", self.forcing);
            return Err(NonlinearError::Setting { name, value, expected: "a number between 0 and 1" });
        }
        self.search.validate()
    }
}

/// Vectors and preconditioners of a minimisation; a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct NewtonWorkspace<const B: usize> {
    team: Team,
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

    /// An empty workspace whose linear solves are the work of a team, with the same bits.
    #[must_use]
    pub fn on(team: &Team) -> Self {
        Self { team: team.clone(), ..Self::default() }
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

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let own = [&self.g, &self.reaction, &self.trial_x, &self.trial_g, &self.trial_reaction];
        bytes_of_all(own) + self.inner.memory_bytes() + self.jacobi.memory_bytes() + self.block_jacobi.memory_bytes()
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
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithm 7.1; [`Forcing`] names that of the forcing
/// terms.
pub fn newton_cg<const B: usize, E: BlockHessian<B>>(
    energy: &mut E,
    w: &Subspace<B>,
    external_norm: f64,
    x: &mut [f64],
    settings: &NewtonSettings,
    ws: &mut NewtonWorkspace<B>,
) -> Result<NonlinearReport, NonlinearError> {
    match settings.preconditioning {
        Preconditioning::None => newton_cg_with(energy, &mut Identity, w, external_norm, x, settings, ws),
        Preconditioning::Jacobi => {
            let mut m = std::mem::take(&mut ws.jacobi);
            let result = newton_cg_with(energy, &mut m, w, external_norm, x, settings, ws);
            ws.jacobi = m;
            result
        }
        Preconditioning::BlockJacobi => {
            let mut m = std::mem::take(&mut ws.block_jacobi);
            let result = newton_cg_with(energy, &mut m, w, external_norm, x, settings, ws);
            ws.block_jacobi = m;
            result
        }
    }
}

/// [`newton_cg`] with a preconditioner of the caller's: one that follows the Hessian, [`Following`] a function that makes it,
/// or [`Kept`] as it is.
///
/// # Errors
/// See [`NonlinearError`].
pub fn newton_cg_with<const B: usize, E: BlockHessian<B>>(
    energy: &mut E,
    m: &mut impl HessianPreconditioner<B>,
    w: &Subspace<B>,
    external_norm: f64,
    x: &mut [f64],
    settings: &NewtonSettings,
    ws: &mut NewtonWorkspace<B>,
) -> Result<NonlinearReport, NonlinearError> {
    let problem = Problem::new(energy, w, &settings.stop, external_norm, x)?;
    settings.validate()?;
    ws.resize(x.len(), B * w.n_constrained());
    let report = minimise(energy, m, &problem, x, settings, ws)?;
    w.add_complement(&ws.reaction, &mut ws.g);
    Ok(report)
}

fn minimise<const B: usize, E: BlockHessian<B>>(
    energy: &mut E,
    m: &mut impl HessianPreconditioner<B>,
    problem: &Problem<B>,
    x: &mut [f64],
    settings: &NewtonSettings,
    ws: &mut NewtonWorkspace<B>,
) -> Result<NonlinearReport, NonlinearError> {
    let mut counts = Counts::default();
    let mut norms = problem.first_gradient(energy, x, &mut ws.g, &mut ws.reaction, &mut counts)?;
    let mut accuracy = Accuracy::new(settings.forcing_rule, settings.forcing, norms);
    let mut value = None;
    let mut model = Model::default();
    let mut idle = Idle::new(norms, &settings.search);
    while norms.residual > problem.threshold(norms) {
        let exhausted = counts.inner_iterations > 0 && counts.inner_iterations >= settings.max_inner_iterations;
        if counts.iterations == settings.max_iterations || exhausted {
            return Ok(problem.report(Stop::IterationLimit, norms, &counts));
        }
        model.prepare(energy, m, problem.w, x, ws, &mut counts)?;
        let target = accuracy.next(norms, problem.threshold(norms)) * norms.residual;
        let limit = settings.max_inner_iterations.saturating_sub(counts.inner_iterations).max(1);
        let inner = model.solve(energy.matrix(), m, problem.w, (target, limit), ws, &mut counts)?;

        let slope = dot(&ws.g, &ws.inner.step);
        let line = Line { x, direction: &ws.inner.step, slope, norms, first: 1.0, guessed: false, trust_flat: false };
        let mut trial = Trial { x: &mut ws.trial_x, g: &mut ws.trial_g, reaction: &mut ws.trial_reaction };
        let accepted = match slope < 0.0 {
            true => advance(energy, problem, &line, &settings.search, &mut value, &mut trial, &mut counts)?,
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
        m: &mut impl HessianPreconditioner<B>,
        w: &Subspace<B>,
        x: &[f64],
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
            self.usable = m.follow(energy.matrix(), w);
            self.preconditioned = true;
        }
        Ok(())
    }

    /// Solves up to the residual norm `target` in at most `limit` iterations.
    fn solve<const B: usize>(
        &self,
        h: &BlockCsr<B>,
        m: &impl HessianPreconditioner<B>,
        w: &Subspace<B>,
        (target, limit): (f64, usize),
        ws: &mut NewtonWorkspace<B>,
        counts: &mut Counts,
    ) -> Result<Outcome, NonlinearError> {
        ws.inner.resize(ws.g.len());
        let system = System { team: &ws.team, h, m: if self.usable { m } else { &Identity }, w };
        let iteration = counts.iterations;
        let outcome =
            truncated_cg::solve(&system, &ws.g, target, limit, &mut ws.inner).map_err(|broken| match broken {
                Broken::Hessian => NonlinearError::HessianNotFinite { index: first_bad_row(h), iteration },
                Broken::Preconditioner(value) => NonlinearError::PreconditionerNotPositive { value, iteration },
            })?;
        counts.inner_iterations += outcome.iterations;
        counts.products += outcome.iterations;
        debug_assert!(first_not_finite(&ws.inner.step).is_none());
        Ok(outcome)
    }
}

/// The first entry of the first block row that is not finite; 0 if only a sum overflows.
fn first_bad_row<const B: usize>(h: &BlockCsr<B>) -> usize {
    let bad = h.blocks().find(|(_, _, b)| b.as_flattened().iter().any(|v| !v.is_finite()));
    bad.map_or(0, |(i, _, _)| i * B)
}
