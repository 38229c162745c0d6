//! Projected L-BFGS.

mod pairs;

use super::line_search::{Idle, Line, LineSearch, StrongWolfe, Trial, advance};
use super::progress::{Counts, NonlinearError, NonlinearReport, Problem, positive};
use crate::energy::Energy;
use crate::memory::bytes_of_all;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRule};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{dot, norm2};
use pairs::Pairs;

/// How a minimisation proceeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LbfgsSettings {
    /// When the residual `P_W ∇E` is small enough.
    pub stop: StopRule,
    /// Budget of steps; zero only evaluates the residual.
    pub max_iterations: usize,
    /// Steps that the method remembers, at least one.
    pub memory: usize,
    /// Whether the initial matrix is `γ M⁻¹` with `γ = s·y / y·M⁻¹y` of the last step, for one more product with `M⁻¹` per
    /// step; otherwise it is `M⁻¹`, as suits one that was factored from a good approximation of the Hessian: with one that is
    /// many times too large a solve may stall before a tight tolerance.
    pub scaled: bool,
    /// What makes a step acceptable. Without a Wolfe search some steps may not be remembered.
    pub search: LineSearch,
}

impl LbfgsSettings {
    /// The usual choices: 5 steps remembered, scaled, the loose strong Wolfe conditions, 1,000 steps.
    #[must_use]
    pub fn new(stop: StopRule) -> Self {
        let search = LineSearch::StrongWolfe(StrongWolfe::loose());
        Self { stop, max_iterations: 1_000, memory: 5, scaled: true, search }
    }

    fn validate(&self) -> Result<(), NonlinearError> {
        if self.memory == 0 {
            return Err(NonlinearError::Setting { name: "memory", value: 0.0, expected: "at least 1" });
        }
        self.search.validate()
    }
}

/// Vectors of a minimisation; a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct LbfgsWorkspace {
    team: Team,
    g: Vec<f64>,
    reaction: Vec<f64>,
    trial_x: Vec<f64>,
    trial_g: Vec<f64>,
    trial_reaction: Vec<f64>,
    d: Vec<f64>,
    z: Vec<f64>,
    pairs: Pairs,
}

impl LbfgsWorkspace {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty workspace whose solves are the work of a team, with the same bits.
    #[must_use]
    pub fn on(team: &Team) -> Self {
        Self { team: team.clone(), ..Self::default() }
    }

    /// `∇E` of the iterate that the last solve returned, unprojected: at a constrained node its complement is the force
    /// that holds the node.
    #[must_use]
    pub fn gradient(&self) -> &[f64] {
        &self.g
    }

    fn resize(&mut self, n: usize, constrained: usize) {
        let Self { team: _, g, reaction, trial_x, trial_g, trial_reaction, d, z, pairs: _ } = self;
        for v in [g, trial_x, trial_g, d, z] {
            v.resize(n, 0.0);
        }
        reaction.resize(constrained, 0.0);
        trial_reaction.resize(constrained, 0.0);
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let own = [&self.g, &self.reaction, &self.d, &self.z];
        bytes_of_all(own)
            + bytes_of_all([&self.trial_x, &self.trial_g, &self.trial_reaction])
            + self.pairs.memory_bytes()
    }
}

/// Minimises an energy over the moves `x + W` by the limited-memory BFGS method.
///
/// `x` has length `energy.dim() = w.dim()`; on entry it satisfies the constraints, on exit it holds the last iterate, moved
/// within `W` alone. `external_norm` is `‖f_ex‖₂` of the stopping rule. `m` is the inverse of the initial matrix, as it is or
/// scaled; with a factored approximation of the Hessian this is the method of Liu, Bouaziz & Kavan. No Hessian is asked for.
/// Steps along which the gradient hardly rises, `s·y ≤ 1e-10 |s| |y|`, are not remembered. Where the direction does not
/// descend or the search along it fails, the memory is cleared; a failed search along `−M⁻¹g` ends the solve as
/// [`Stop::Stalled`]. The first step tried is 1, or `min(1, 1/‖g‖)` where there is neither memory nor preconditioner.
///
/// # Errors
/// See [`NonlinearError`].
///
/// Source: Liu & Nocedal, Math. Program. 45 (1989); Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithms 7.4
/// and 7.5; Liu, Bouaziz & Kavan, ACM Trans. Graph. 36 (2017).
pub fn lbfgs<const B: usize, E: Energy>(
    energy: &mut E,
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    external_norm: f64,
    x: &mut [f64],
    settings: &LbfgsSettings,
    ws: &mut LbfgsWorkspace,
) -> Result<NonlinearReport, NonlinearError> {
    let problem = Problem::new(energy, w, &settings.stop, external_norm, x)?;
    settings.validate()?;
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
    settings: &LbfgsSettings,
    ws: &mut LbfgsWorkspace,
) -> Result<NonlinearReport, NonlinearError> {
    let mut counts = Counts::default();
    let mut norms = problem.first_gradient(energy, x, &mut ws.g, &mut ws.reaction, &mut counts)?;
    let mut value = None;
    let mut idle = Idle::patient(norms);
    ws.pairs.clear(settings.memory, x.len());
    while norms.residual > problem.threshold(norms) {
        if counts.iterations == settings.max_iterations {
            return Ok(problem.report(Stop::IterationLimit, norms, &counts));
        }
        let slope = descend(m, problem, counts.iterations, ws)?;
        if slope >= 0.0 || slope.is_nan() {
            return Ok(problem.report(Stop::Stalled, norms, &counts));
        }

        // Step.
        let blind = ws.pairs.is_empty() && m.is_identity();
        let first = if blind { (1.0 / norms.residual).min(1.0) } else { 1.0 };
        let line = Line { x, direction: &ws.d, slope, norms, first, guessed: false, trust_flat: false };
        let mut trial = Trial { x: &mut ws.trial_x, g: &mut ws.trial_g, reaction: &mut ws.trial_reaction };
        let Some(step) = advance(energy, problem, &line, &settings.search, &mut value, &mut trial, &mut counts)? else {
            if ws.pairs.is_empty() {
                return Ok(problem.report(Stop::Stalled, norms, &counts));
            }
            ws.pairs.clear(settings.memory, x.len());
            continue;
        };
        remember(m, problem, x, settings.scaled, ws);
        x.copy_from_slice(&ws.trial_x);
        std::mem::swap(&mut ws.g, &mut ws.trial_g);
        std::mem::swap(&mut ws.reaction, &mut ws.trial_reaction);
        counts.iterations += 1;
        (value, norms) = (step.value, step.norms);

        if idle.stalls(&step) {
            return Ok(problem.report(Stop::Stalled, norms, &counts));
        }
    }
    Ok(problem.report(Stop::Converged, norms, &counts))
}

/// The direction `d = −H g` by two loops; forgets everything where that does not descend. Returns `g·d`.
fn descend<const B: usize>(
    m: &(impl Preconditioner + ?Sized),
    problem: &Problem<B>,
    iteration: usize,
    ws: &mut LbfgsWorkspace,
) -> Result<f64, NonlinearError> {
    let LbfgsWorkspace { team, g, d, z, pairs, .. } = ws;
    for (d, g) in d.iter_mut().zip(&*g) {
        *d = -g;
    }
    pairs.first_loop(team, d);
    problem.precondition(team, m, d, z);
    pairs.second_loop(team, z);
    std::mem::swap(d, z);
    let slope = dot(g, d);
    if pairs.is_empty() {
        return positive(-slope, iteration).map(|value| -value);
    }
    if slope < 0.0 {
        return Ok(slope);
    }
    pairs.forget();
    descend(m, problem, iteration, ws)
}

/// Adds the step from `x` to the trial point to the memory, if its curvature is good for it.
fn remember<const B: usize>(
    m: &(impl Preconditioner + ?Sized),
    problem: &Problem<B>,
    x: &[f64],
    scaled: bool,
    ws: &mut LbfgsWorkspace,
) {
    let LbfgsWorkspace { team, g, trial_x, trial_g, z, pairs, .. } = ws;
    let (s, y) = pairs.next();
    difference(trial_x, x, s);
    difference(trial_g, g, y);
    let sy = dot(s, y);
    if !(sy > SMALL_CURVATURE * norm2(s) * norm2(y) && sy.is_finite()) {
        return;
    }
    let scale = if scaled {
        problem.precondition(team, m, y, z);
        sy / dot(y, z)
    } else {
        1.0
    };
    if scale > 0.0 && scale.is_finite() {
        pairs.keep(sy, scale);
    }
}

/// Cosine between a step and the change of the gradient below which the step is not remembered.
const SMALL_CURVATURE: f64 = 1e-10;

fn difference(a: &[f64], b: &[f64], out: &mut [f64]) {
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = a - b;
    }
}
