//! Block principal pivoting.

use super::problem::{BoxError, BoxProblem, BoxReport, BoxState, BoxWorkspace};
use crate::stop::Stop;

/// How far block pivoting goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PivotingSettings {
    /// Budget of pivots, one factorisation each.
    pub max_pivots: usize,
    /// Block pivots in a row that may fail to lower the number of violated conditions before pivots are made one
    /// component at a time.
    pub patience: usize,
}

impl Default for PivotingSettings {
    fn default() -> Self {
        Self { max_pivots: 1000, patience: 10 }
    }
}

/// Solves the problem by exchanging the states of all components that violate their condition, from the states in `ws`.
///
/// Between the exchanges the components between their bounds are solved for exactly. When that has failed `patience` times to
/// lower the number of violations, only the violated component of least index is exchanged until the number falls: for positive
/// definite `W` this ends. Conditions count as violated beyond the rounding error of their numbers. `lambda` need not be set on
/// entry; on exit it is the solution, or with [`Stop::IterationLimit`] the last iterate, and within the bounds.
///
/// # Errors
/// See [`BoxError`]. A matrix that is not positive definite is noticed if a pivot comes upon it.
///
/// Source: Júdice & Pires, *A block principal pivoting algorithm for large-scale strictly monotone linear complementarity
/// problems*, Computers & Operations Research 21 (1994), 587-596, with the bounds of the same authors' *Basic-set algorithm for
/// a generalized linear complementarity problem*, J. Optim. Theory Appl. 74 (1992); least index: Murty (1974).
pub fn block_pivoting(
    problem: &BoxProblem<'_>,
    lambda: &mut [f64],
    settings: &PivotingSettings,
    ws: &mut BoxWorkspace,
) -> Result<BoxReport, BoxError> {
    lambda.fill(0.0);
    problem.check(lambda)?;
    ws.resize(problem.n());
    for i in 0..problem.n() {
        ws.states[i] = start_state(problem, i, ws.states[i]);
    }
    let (mut fewest, mut patience) = (usize::MAX, settings.patience);
    let mut pivots = 0;
    let stop = loop {
        problem.solve_states(ws, lambda)?;
        problem.evaluate(lambda, &mut ws.w);
        let violated = (0..problem.n()).filter(|&i| exchanged(problem, i, lambda, ws).is_some()).count();
        if violated == 0 {
            break Stop::Converged;
        }
        if pivots == settings.max_pivots {
            break Stop::IterationLimit;
        }
        if violated < fewest {
            (fewest, patience) = (violated, settings.patience);
        } else {
            patience = patience.saturating_sub(1);
        }
        let count = if patience > 0 { problem.n() } else { 1 };
        exchange(problem, lambda, ws, count);
        pivots += 1;
    };
    for (i, value) in lambda.iter_mut().enumerate() {
        *value = problem.clamp(i, *value);
    }
    problem.evaluate(lambda, &mut ws.w);
    for i in 0..problem.n() {
        if problem.lower[i] == problem.upper[i] {
            ws.states[i] = if ws.w[i] < 0.0 { BoxState::Upper } else { BoxState::Lower };
        }
    }
    let residual = problem.natural_residual(lambda, &ws.w);
    Ok(BoxReport { stop, iterations: pivots, factorisations: pivots + 1, residual })
}

/// A component is not put at infinity, and not solved for if it cannot move.
fn start_state(problem: &BoxProblem<'_>, i: usize, state: BoxState) -> BoxState {
    if problem.lower[i] == problem.upper[i] {
        return BoxState::Lower;
    }
    match state {
        BoxState::Lower if problem.lower[i].is_infinite() => BoxState::Between,
        BoxState::Upper if problem.upper[i].is_infinite() => BoxState::Between,
        state => state,
    }
}

/// The state that a component goes to, if it violates the condition of the one it has.
fn exchanged(problem: &BoxProblem<'_>, i: usize, lambda: &[f64], ws: &BoxWorkspace) -> Option<BoxState> {
    let (lower, upper) = (problem.lower[i], problem.upper[i]);
    if lower == upper {
        return None;
    }
    let slack_w = problem.rounding(i, lambda);
    let slack = slack_w / problem.diagonal(i);
    match ws.states[i] {
        BoxState::Between if lambda[i] < lower - slack => Some(BoxState::Lower),
        BoxState::Between if lambda[i] > upper + slack => Some(BoxState::Upper),
        BoxState::Lower if ws.w[i] < -slack_w => Some(BoxState::Between),
        BoxState::Upper if ws.w[i] > slack_w => Some(BoxState::Between),
        _ => None,
    }
}

/// Exchanges the first `count` violated components.
fn exchange(problem: &BoxProblem<'_>, lambda: &[f64], ws: &mut BoxWorkspace, count: usize) {
    let mut left = count;
    for i in 0..problem.n() {
        if left > 0
            && let Some(state) = exchanged(problem, i, lambda, ws)
        {
            ws.states[i] = state;
            left -= 1;
        }
    }
}
