//! A line search that reads directional derivatives first and energies only when they leave doubt.

use super::ray::{Accepted, Line, Progress, Trial, secant, settled, start_value};
use super::{DELTA, within_rounding};
use crate::energy::Energy;
use crate::nonlinear::progress::{Counts, NonlinearError, Problem};
use crate::vector::{add_scaled, dot};

/// Secant moves of a step that is a mere guess.
const SECANTS: usize = 6;
/// Armijo's constant.
const ARMIJO: f64 = 1e-4;
/// A directional derivative this much smaller than at the start marks a minimum along the line.
const FLAT: f64 = 0.1;
const MAX_TRIALS: usize = 40;

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
    limit: f64,
    value: &mut Option<f64>,
    trial: &mut Trial,
    counts: &mut Counts,
) -> Result<Option<Accepted>, NonlinearError> {
    let mut t = line.first.min(limit);
    let mut secants = if line.guessed { SECANTS } else { 0 };
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
        let after = settled(energy, before, trial.x);
        counts.values += 1;
        let decreased = after <= before + ARMIJO * t * line.slope;
        let noise = within_rounding(after, before);
        if decreased || (gentle && noise) {
            return Ok(Some(Accepted {
                t,
                norms,
                value: Some(after),
                progress: if noise { Progress::Rounding } else { Progress::Decrease },
            }));
        }
        t *= if slope > 0.0 { (line.slope / (line.slope - slope)).clamp(0.1, 0.6) } else { 0.5 };
    }
    Ok(None)
}
