//! Line searches on an energy: what a minimisation asks of them.

use super::{Found, LineFunction, LineSearch, LineStart, gradient_first};
use crate::energy::Energy;
use crate::nonlinear::progress::{Counts, NonlinearError, Norms, Problem};
use crate::vector::{add_scaled, dot};

/// Stay this far inside the domain, relative to the step that leaves it.
const DOMAIN_MARGIN: f64 = 0.9;
/// Searches for a curvature condition go no further than this many first steps, secant moves than fewer.
const MOST_GROWTH: f64 = 100.0;
const MOST_SECANT_GROWTH: f64 = 10.0;
/// Steps within rounding errors before an iteration counts as stalled: few where energies are asked for only once the residual
/// grows, more where every step comes with its energy or residuals go up and down.
const PATIENCE: usize = 5;
const LONG_PATIENCE: usize = 100;
/// A search that compares energies at every step sees a decrease beyond this fraction of the energy as progress.
const NOISE: f64 = 16.0 * f64::EPSILON;

/// Where a search starts and where it looks.
pub(in crate::nonlinear) struct Line<'a> {
    pub x: &'a [f64],
    pub direction: &'a [f64],
    /// `φ'(0) < 0`.
    pub slope: f64,
    pub norms: Norms,
    /// First step to try.
    pub first: f64,
    /// Whether `first` is no more than the length of the last step: a search that cannot lengthen it looks for a better one.
    pub guessed: bool,
    /// Whether a zero of `φ'` is accepted without a look at the energy, though the residual grew.
    pub trust_flat: bool,
}

/// The trial point, its gradient split in two; after a success these belong to the accepted point.
pub(in crate::nonlinear) struct Trial<'a> {
    pub x: &'a mut [f64],
    pub g: &'a mut [f64],
    pub reaction: &'a mut [f64],
}

/// An accepted step.
pub(in crate::nonlinear) struct Accepted {
    pub t: f64,
    pub norms: Norms,
    /// Energy at the new point, if it was needed.
    pub value: Option<f64>,
    /// What the energies said about the step.
    pub progress: Progress,
}

/// What the energies said about a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::nonlinear) enum Progress {
    /// They were not needed.
    Unknown,
    /// A decrease beyond rounding errors.
    Decrease,
    /// A change that rounding errors explain.
    Rounding,
}

/// Notices an iteration that goes round in its own rounding errors.
#[derive(Debug)]
pub(in crate::nonlinear) struct Idle {
    best: f64,
    steps: usize,
    patience: usize,
}

impl Idle {
    pub fn new(norms: Norms, search: &LineSearch) -> Self {
        let patience = if *search == LineSearch::GradientFirst { PATIENCE } else { LONG_PATIENCE };
        Self { best: norms.residual, steps: 0, patience }
    }

    /// For a method whose residuals go up and down.
    pub fn patient(norms: Norms) -> Self {
        Self { best: norms.residual, steps: 0, patience: LONG_PATIENCE }
    }

    /// Whether as many steps as make a stall lowered neither the energy nor the smallest residual.
    pub fn stalls(&mut self, step: &Accepted) -> bool {
        let residual = step.norms.residual;
        if residual < self.best || step.progress == Progress::Decrease {
            self.steps = 0;
        } else if step.progress == Progress::Rounding {
            self.steps += 1;
        }
        self.best = self.best.min(residual);
        self.steps == self.patience
    }
}

/// Searches a step along `x + t d`; `None` if no representable step decreases the energy. `value` is the energy at `x`, if it
/// is known; it is found out when needed.
pub(in crate::nonlinear) fn advance<const B: usize, E: Energy>(
    energy: &mut E,
    problem: &Problem<B>,
    line: &Line,
    search: &LineSearch,
    value: &mut Option<f64>,
    trial: &mut Trial,
    counts: &mut Counts,
) -> Result<Option<Accepted>, NonlinearError> {
    let growth = match search {
        LineSearch::StrongWolfe(_) | LineSearch::ApproximateWolfe(_) => MOST_GROWTH,
        LineSearch::GradientFirst | LineSearch::Armijo(_) if line.guessed => MOST_SECANT_GROWTH,
        LineSearch::GradientFirst | LineSearch::Armijo(_) => 1.0,
    };
    let furthest = growth * line.first;
    let limit = DOMAIN_MARGIN * energy.max_step(line.x, line.direction, furthest / DOMAIN_MARGIN);
    if limit.is_nan() || limit <= 0.0 {
        start_value(energy, line, value, counts)?; // not finite if the search starts outside the domain
        return Ok(None);
    }
    if *search == LineSearch::GradientFirst {
        return gradient_first::search(energy, problem, line, limit, value, trial, counts);
    }
    let before = start_value(energy, line, value, counts)?;
    let mut ray = Ray { energy, problem, line, trial, counts, energy_before: before, at: f64::NAN, norms: None };
    let mut start = LineStart { value: before, slope: line.slope, first: line.first, limit };
    if line.guessed && !matches!(search, LineSearch::StrongWolfe(_)) {
        start.first = ray.secant_guess(&start);
    }
    let found = match search {
        LineSearch::Armijo(armijo) => armijo.search(&mut ray, &start),
        LineSearch::StrongWolfe(wolfe) => wolfe.search(&mut ray, &start),
        LineSearch::ApproximateWolfe(wolfe) => wolfe.search(&mut ray, &start),
        LineSearch::GradientFirst => unreachable!("handled above"),
    };
    Ok(ray.accept(before, &found))
}

/// The energy where a search starts, which must be finite.
pub(super) fn start_value(
    energy: &mut impl Energy,
    line: &Line,
    value: &mut Option<f64>,
    counts: &mut Counts,
) -> Result<f64, NonlinearError> {
    if let Some(known) = *value {
        return Ok(known);
    }
    let fresh = energy.value(line.x);
    counts.values += 1;
    if !fresh.is_finite() {
        let iteration = counts.iterations;
        return Err(NonlinearError::EnergyNotFinite { value: fresh, iteration });
    }
    *value = Some(fresh);
    Ok(fresh)
}

/// The zero of the line through `φ'(0) = before` and `φ'(t) = after`, or a longer step where `φ'` does not rise.
pub(super) fn secant(t: f64, before: f64, after: f64) -> f64 {
    let rise = after - before;
    if rise <= 0.0 {
        return MOST_SECANT_GROWTH * t;
    }
    t * (-before / rise).clamp(1e-4, 1e4)
}

/// An energy along a line.
struct Ray<'r, 'l, 't, const B: usize, E> {
    energy: &'r mut E,
    problem: &'r Problem<'r, B>,
    line: &'r Line<'l>,
    trial: &'r mut Trial<'t>,
    counts: &'r mut Counts,
    /// The energy at the start of the line.
    energy_before: f64,
    /// The step whose point the trial holds.
    at: f64,
    /// Norms of the gradient, if the trial holds that of its point.
    norms: Option<Norms>,
}

impl<const B: usize, E: Energy> Ray<'_, '_, '_, B, E> {
    fn go(&mut self, t: f64) {
        if self.at != t {
            add_scaled(self.line.x, t, self.line.direction, self.trial.x);
            (self.at, self.norms) = (t, None);
        }
    }

    /// A better first step than the last one's length, by one slope: for searches that do not interpolate before they have
    /// gone too far. That of CG_DESCENT looks at one value for the same purpose.
    fn secant_guess(&mut self, start: &LineStart) -> f64 {
        let t = start.first.min(start.limit);
        let slope = self.slope(t);
        if slope.is_finite() { secant(t, start.slope, slope).min(start.limit) } else { 0.5 * t }
    }

    /// Moves the trial to the step that was found, if it moves anything.
    fn accept(&mut self, before: f64, found: &Found) -> Option<Accepted> {
        if found.t == 0.0 {
            return None;
        }
        self.go(found.t);
        if self.norms.is_none() {
            self.slope(found.t);
        }
        if *self.trial.x == *self.line.x {
            return None;
        }
        let decreased = found.value < before - NOISE * before.abs();
        let progress = if decreased { Progress::Decrease } else { Progress::Rounding };
        Some(Accepted { t: found.t, norms: self.norms?, value: Some(found.value), progress })
    }
}

impl<const B: usize, E: Energy> LineFunction for Ray<'_, '_, '_, B, E> {
    fn value(&mut self, t: f64) -> f64 {
        self.go(t);
        self.counts.values += 1;
        settled(self.energy, self.energy_before, self.trial.x)
    }

    fn slope(&mut self, t: f64) -> f64 {
        self.go(t);
        let Trial { x, g, reaction } = self.trial;
        let norms = self.problem.gradient(self.energy, x, g, reaction, self.counts);
        self.norms = Some(norms);
        if !(norms.residual.is_finite() && norms.reaction.is_finite()) {
            return f64::NAN;
        }
        dot(self.trial.g, self.line.direction)
    }
}

/// The energy at `x`, which is that `before` as far as its rounding errors tell.
pub(super) fn settled(energy: &mut impl Energy, before: f64, x: &[f64]) -> f64 {
    let value = energy.value(x);
    if (value - before).abs() <= energy.value_round_off() { before } else { value }
}
