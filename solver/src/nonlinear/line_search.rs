//! A line search that reads directional derivatives first and energies only when they leave doubt.

use super::progress::{Counts, NonlinearError, Norms, Problem};
use crate::energy::Energy;
use crate::vector::{add_scaled, dot};

/// Stay this far inside the domain, relative to the step that leaves it.
const DOMAIN_MARGIN: f64 = 0.9;
/// Armijo's constant, and δ of the approximate Wolfe condition `φ'(t) ≤ (2δ − 1) φ'(0)`.
const ARMIJO: f64 = 1e-4;
const DELTA: f64 = 0.1;
/// Energy differences below this fraction of the energy are rounding errors.
const ENERGY_ROUNDING: f64 = 1e-10;
/// A directional derivative this much smaller than at the start marks a minimum along the line.
const FLAT: f64 = 0.1;
/// Secants go no further than this many first steps.
const MOST_GROWTH: f64 = 10.0;
const MAX_TRIALS: usize = 40;
/// Steps within rounding errors before an iteration counts as stalled.
const PATIENCE: usize = 5;

/// Where a search starts and where it looks.
pub(super) struct Line<'a> {
    pub x: &'a [f64],
    pub direction: &'a [f64],
    /// `φ'(0) < 0`.
    pub slope: f64,
    pub norms: Norms,
    /// First step to try.
    pub first: f64,
    /// How often the step may be moved to the zero of `φ'` that a secant predicts.
    pub secants: usize,
    /// Whether a zero of `φ'` is accepted without a look at the energy, though the residual grew.
    pub trust_flat: bool,
}

/// The trial point, its gradient split in two; after a success these belong to the accepted point.
pub(super) struct Trial<'a> {
    pub x: &'a mut [f64],
    pub g: &'a mut [f64],
    pub reaction: &'a mut [f64],
}

/// An accepted step.
pub(super) struct Accepted {
    pub t: f64,
    pub norms: Norms,
    /// Energy at the new point, if it was needed.
    pub value: Option<f64>,
    /// What the energies said about the step.
    pub progress: Progress,
}

/// What the energies said about a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// They were not needed.
    Unknown,
    /// A decrease beyond rounding errors.
    Decrease,
    /// A change that rounding errors explain.
    Rounding,
}

/// Notices an iteration that goes round in its own rounding errors.
#[derive(Debug)]
pub(super) struct Idle {
    best: f64,
    steps: usize,
}

impl Idle {
    pub fn new(norms: Norms) -> Self {
        Self { best: norms.residual, steps: 0 }
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
        self.steps == PATIENCE
    }
}

/// Searches `t` with a sufficient decrease along `x + t d`; `None` if no representable step gives one.
///
/// Accepts a step by gradients alone if `φ'(t) ≤ (2δ − 1) φ'(0)`, which is Armijo's condition for a parabola and keeps its
/// meaning where energy differences drown in rounding errors, and the residual shrinks. Otherwise energies decide.
///
/// Source: approximate Wolfe condition of Hager & Zhang, SIAM J. Optim. 16 (2005).
pub(super) fn search<const B: usize, E: Energy>(
    energy: &mut E,
    problem: &Problem<B>,
    line: &Line,
    value: &mut Option<f64>,
    trial: &mut Trial,
    counts: &mut Counts,
) -> Result<Option<Accepted>, NonlinearError> {
    let furthest = if line.secants > 0 { MOST_GROWTH * line.first } else { line.first };
    let limit = DOMAIN_MARGIN * energy.max_step(line.x, line.direction, furthest / DOMAIN_MARGIN);
    if limit.is_nan() || limit <= 0.0 {
        start_value(energy, line, value, counts)?; // not finite if the search starts outside the domain
        return Ok(None);
    }
    let mut t = line.first.min(limit);
    let mut secants = line.secants;
    for _ in 0..MAX_TRIALS {
        add_scaled(line.x, t, line.direction, trial.x);
        if *trial.x == *line.x {
            return Ok(None);
        }
        let norms = problem.gradient(energy, trial.x, trial.g, trial.reaction, counts);
        let slope = dot(trial.g, line.direction);
        if !(norms.residual.is_finite() && norms.reaction.is_finite() && slope.is_finite()) {
            t *= 0.5;
            continue;
        }
        if secants > 0 && slope.abs() > FLAT * line.slope.abs() {
            let next = secant(t, line.slope, slope).min(limit);
            if next != t {
                secants -= 1;
                t = next;
                continue;
            }
        }
        let gentle = slope <= (2.0 * DELTA - 1.0) * line.slope;
        let flat = line.trust_flat && slope.abs() <= FLAT * line.slope.abs();
        if gentle && (norms.residual <= line.norms.residual || flat) {
            return Ok(Some(Accepted { t, norms, value: None, progress: Progress::Unknown }));
        }
        let before = start_value(energy, line, value, counts)?;
        let after = energy.value(trial.x);
        counts.values += 1;
        let decreased = after <= before + ARMIJO * t * line.slope;
        let within_rounding = (after - before).abs() <= ENERGY_ROUNDING * before.abs().max(after.abs());
        if decreased || (gentle && within_rounding) {
            return Ok(Some(Accepted {
                t,
                norms,
                value: Some(after),
                progress: if within_rounding { Progress::Rounding } else { Progress::Decrease },
            }));
        }
        t *= if slope > 0.0 { (line.slope / (line.slope - slope)).clamp(0.1, 0.6) } else { 0.5 };
    }
    Ok(None)
}

/// The zero of the line through `φ'(0) = before` and `φ'(t) = after`, or a longer step where `φ'` does not rise.
fn secant(t: f64, before: f64, after: f64) -> f64 {
    let rise = after - before;
    if rise <= 0.0 {
        return 10.0 * t;
    }
    t * (-before / rise).clamp(1e-4, 1e4)
}

fn start_value(
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
