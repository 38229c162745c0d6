//! Projected nonlinear conjugate gradients.

mod direction;

pub use direction::Direction;

use super::line_search::{Idle, Line, LineSearch, Trial, advance, exact_step};
use super::progress::{Counts, NonlinearError, NonlinearReport, Norms, Problem, positive};
use crate::energy::Energy;
use crate::memory::bytes_of_all;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRule};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{dot, dot_pair, first_not_finite};
use direction::{Memory, conjugate, plane_minimiser};

/// How the length of a step is guessed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepModel {
    /// Exact for a quadratic energy: `−g·d / d·H d`, one Hessian product per step.
    Curvature,
    /// From directional derivatives alone: no Hessian, and with [`LineSearch::GradientFirst`] about two gradients per step.
    Secant,
}

/// How a minimisation proceeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonlinearCgSettings {
    /// When the residual `P_W ∇E` is small enough.
    pub stop: StopRule,
    /// Budget of steps; zero only evaluates the residual.
    pub max_iterations: usize,
    /// How a direction follows from the last one.
    pub direction: Direction,
    /// How the length of a step is guessed.
    pub step: StepModel,
    /// What makes a step acceptable.
    pub search: LineSearch,
}

impl NonlinearCgSettings {
    /// The usual choices: Polak-Ribière+, one Hessian product per step, gradients before energies, 10,000 steps.
    #[must_use]
    pub fn new(stop: StopRule) -> Self {
        Self {
            stop,
            max_iterations: 10_000,
            direction: Direction::PolakRibierePlus,
            step: StepModel::Curvature,
            search: LineSearch::GradientFirst,
        }
    }

    fn validate(&self) -> Result<(), NonlinearError> {
        if let Direction::HagerZhang { eta } = self.direction
            && !(eta > 0.0 && eta.is_finite())
        {
            return Err(NonlinearError::Setting { name: "eta", value: eta, expected: "a positive number" });
        }
        self.search.validate()
    }
}

/// Vectors of a minimisation; a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct NonlinearCgWorkspace {
    team: Team,
    g: Vec<f64>,
    reaction: Vec<f64>,
    z: Vec<f64>,
    trial_x: Vec<f64>,
    trial_g: Vec<f64>,
    trial_reaction: Vec<f64>,
    trial_z: Vec<f64>,
    d: Vec<f64>,
    hd: Vec<f64>,
}

impl NonlinearCgWorkspace {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty workspace whose solves let the preconditioner work on a team, with the same bits.
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
        let Self { team: _, g, reaction, z, trial_x, trial_g, trial_reaction, trial_z, d, hd } = self;
        for v in [g, z, trial_x, trial_g, trial_z, d, hd] {
            v.resize(n, 0.0);
        }
        reaction.resize(constrained, 0.0);
        trial_reaction.resize(constrained, 0.0);
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let own = [&self.g, &self.reaction, &self.z, &self.d, &self.hd];
        bytes_of_all(own) + bytes_of_all([&self.trial_x, &self.trial_g, &self.trial_reaction, &self.trial_z])
    }
}

/// Minimises an energy over the moves `x + W` by preconditioned nonlinear conjugate gradients.
///
/// `x` has length `energy.dim() = w.dim()`; on entry it satisfies the constraints, on exit it holds the last iterate, moved
/// within `W` alone. `external_norm` is `‖f_ex‖₂` of the stopping rule. `m` approximates the inverse of the Hessian near the
/// solution and stays as it is. [`Direction`] says when a rule restarts; a failed search along `−M⁻¹g` ends the solve as
/// [`Stop::Stalled`]. On a quadratic energy the iterates are those of linear conjugate gradients.
///
/// # Errors
/// See [`NonlinearError`].
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), section 5.2; the projection is that of Nienhuys,
/// *Cutting in deformable objects*, PhD thesis, Utrecht (2003), eq. (6.7).
pub fn nonlinear_cg<const B: usize, E: Energy>(
    energy: &mut E,
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    external_norm: f64,
    x: &mut [f64],
    settings: &NonlinearCgSettings,
    ws: &mut NonlinearCgWorkspace,
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
    settings: &NonlinearCgSettings,
    ws: &mut NonlinearCgWorkspace,
) -> Result<NonlinearReport, NonlinearError> {
    let mut counts = Counts::default();
    let mut norms = problem.first_gradient(energy, x, &mut ws.g, &mut ws.reaction, &mut counts)?;
    if norms.residual <= problem.threshold(norms) {
        return Ok(problem.report(Stop::Converged, norms, &counts));
    }
    let (mut value, mut last_step) = (None, 1.0);
    let mut idle = Idle::new(norms, &settings.search);
    let mut memory = Memory::default();
    let mut restart = true;
    if settings.max_iterations > 0 {
        problem.precondition(&ws.team, m, &ws.g, &mut ws.z);
        memory = Memory::steepest(positive(dot(&ws.g, &ws.z), 0)?);
    }
    while norms.residual > problem.threshold(norms) {
        if counts.iterations == settings.max_iterations {
            return Ok(problem.report(Stop::IterationLimit, norms, &counts));
        }

        // Direction, and a guess of the step.
        let heading = head(energy, x, settings, &mut memory, restart, ws, &mut counts)?;
        if heading.slope >= 0.0 || heading.slope.is_nan() {
            return Ok(problem.report(Stop::Stalled, norms, &counts));
        }

        // Step.
        let line = line(x, &ws.d, &heading, norms, last_step);
        let mut trial = Trial { x: &mut ws.trial_x, g: &mut ws.trial_g, reaction: &mut ws.trial_reaction };
        let Some(step) = advance(energy, problem, &line, &settings.search, &mut value, &mut trial, &mut counts)? else {
            if heading.steepest {
                return Ok(problem.report(Stop::Stalled, norms, &counts));
            }
            restart = true;
            continue;
        };
        x.copy_from_slice(&ws.trial_x);
        counts.iterations += 1;
        (value, last_step, norms) = (step.value, step.t, step.norms);

        // What the next direction needs; M is symmetric, so M⁻¹g₁·g₀ is all that the rules ask of both gradients.
        problem.precondition(&ws.team, m, &ws.trial_g, &mut ws.trial_z);
        let (new_gz, cross) = dot_pair(&ws.trial_z, &ws.trial_g, &ws.g);
        positive(new_gz, counts.iterations)?;
        let (beta, next) = conjugate(settings.direction, memory, new_gz, cross, ws);
        memory = next;
        restart = false;
        if settings.direction != Direction::Subspace {
            for (d, z) in ws.d.iter_mut().zip(&ws.trial_z) {
                *d = beta * *d - z;
            }
        }
        std::mem::swap(&mut ws.g, &mut ws.trial_g);
        std::mem::swap(&mut ws.z, &mut ws.trial_z);
        std::mem::swap(&mut ws.reaction, &mut ws.trial_reaction);

        if idle.stalls(&step) {
            return Ok(problem.report(Stop::Stalled, norms, &counts));
        }
    }
    Ok(problem.report(Stop::Converged, norms, &counts))
}

/// A direction: its slope, the step that the quadratic model gives, and whether it is `−M⁻¹g`.
struct Heading {
    slope: f64,
    exact: Option<f64>,
    steepest: bool,
}

fn line<'a>(x: &'a [f64], direction: &'a [f64], heading: &Heading, norms: Norms, last_step: f64) -> Line<'a> {
    Line {
        x,
        direction,
        slope: heading.slope,
        norms,
        first: heading.exact.unwrap_or(last_step),
        guessed: heading.exact.is_none(),
        trust_flat: true,
    }
}

/// Completes the direction in `ws.d`, or restarts it.
fn head(
    energy: &mut impl Energy,
    x: &[f64],
    settings: &NonlinearCgSettings,
    memory: &mut Memory,
    restart: bool,
    ws: &mut NonlinearCgWorkspace,
    counts: &mut Counts,
) -> Result<Heading, NonlinearError> {
    if settings.direction == Direction::Subspace
        && !restart
        && let Some(heading) = head_in_plane(energy, x, memory.gz, ws, counts)?
    {
        return Ok(heading);
    }
    let mut slope = dot(&ws.g, &ws.d);
    let steepest = restart || settings.direction == Direction::Subspace || slope >= 0.0 || slope.is_nan();
    if steepest {
        for (d, z) in ws.d.iter_mut().zip(&ws.z) {
            *d = -z;
        }
        *memory = Memory::steepest(memory.gz);
        slope = -memory.gz;
    }
    let exact = match settings.step {
        StepModel::Curvature => {
            energy.linearize(x);
            counts.linearizations += 1;
            exact_step(slope, curvature(energy, &ws.d, &mut ws.hd, counts)?)
        }
        StepModel::Secant => None,
    };
    Ok(Heading { slope, exact, steepest })
}

/// Replaces `ws.d` by the minimiser of the quadratic model over the span of `ws.z` and `ws.d`, if there is one.
fn head_in_plane(
    energy: &mut impl Energy,
    x: &[f64],
    gz: f64,
    ws: &mut NonlinearCgWorkspace,
    counts: &mut Counts,
) -> Result<Option<Heading>, NonlinearError> {
    energy.linearize(x);
    counts.linearizations += 1;
    let dhd = curvature(energy, &ws.d, &mut ws.hd, counts)?;
    let (zhd, gd) = (dot(&ws.z, &ws.hd), dot(&ws.g, &ws.d));
    let zhz = curvature(energy, &ws.z, &mut ws.hd, counts)?;
    let Some((a, b)) = plane_minimiser(gz, gd, zhz, zhd, dhd) else { return Ok(None) };
    for (d, z) in ws.d.iter_mut().zip(&ws.z) {
        *d = b * *d - a * z;
    }
    let slope = dot(&ws.g, &ws.d);
    Ok((slope < 0.0).then_some(Heading { slope, exact: Some(1.0), steepest: false }))
}

/// `p·H p`, with the product in `hp`.
fn curvature(energy: &impl Energy, p: &[f64], hp: &mut [f64], counts: &mut Counts) -> Result<f64, NonlinearError> {
    energy.hessian_apply(p, hp);
    counts.products += 1;
    let curvature = dot(p, hp);
    if curvature.is_finite() {
        return Ok(curvature);
    }
    let (index, iteration) = (first_not_finite(hp).unwrap_or(0), counts.iterations);
    Err(NonlinearError::HessianNotFinite { index, iteration })
}
