//! Which coupling nodes stick, and which slip.

use super::condensed::Condensed;
use super::state::{Answer, SlipLimits, SlipState, StickSlip};
use serde::{Deserialize, Serialize};
use stylet_solver::complementarity::BoxError;

/// How states are found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SearchMethod {
    /// Algorithm 3: solve with guessed states, change those that violate a condition, solve again.
    #[default]
    Trials,
    /// A complementarity solve on the condensed tangential system gives the states; one solve gives the rest.
    Condensed,
}

/// How far a search goes.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SearchSettings {
    /// How states are found.
    pub method: SearchMethod,
    /// Relative residual at which the conditions are looked at first; states that violate them are changed at once.
    pub check_tolerance: f64,
    /// Relative residual of the solution; also of the columns of the condensed system.
    pub solve_tolerance: f64,
    /// States that are tried before the next ones are accepted as they are.
    pub max_trials: usize,
    /// The number of trials that fail before [`SearchMethod::Trials`] takes its next states from the condensed system. That is
    /// not in the paper, whose search (`None`) gives up in 0.4 % of the steps: consistent states always exist, and this
    /// finds them. A trial that starts from the one before is cheap beside one column for each node.
    pub condense_after: Option<usize>,
    /// Whether states that failed are replaced by those that the complementarity problem has with the system's
    /// [estimate](StickSlip::estimate) of `W`, where it has one, before other rules apply. Not in the paper.
    pub estimate: bool,
    /// Whether states that failed at the check tolerance may be tried once more, at once at that of the solution. Not in the
    /// paper, where no states are tried twice: a slip near zero may then be refused by the error of the check alone, and with
    /// it the only consistent states.
    pub second_look: bool,
    /// By how many tolerances a condition may be violated; see [`search`].
    pub slack: f64,
    /// Whether the first solve of a step starts from the best combination of the last velocity of the tissue and its last three
    /// accelerations, not from zero as published.
    pub warm_start: bool,
    /// Whether the system is solved once more, from the same start, with the states that were found: what a search that knew
    /// them would have taken is then [reported](SearchReport::known_iterations). The answer is that of this last solve.
    pub count_known: bool,
}

impl Default for SearchSettings {
    fn default() -> Self {
        Self {
            method: SearchMethod::Trials,
            check_tolerance: 1e-3,
            solve_tolerance: 1e-5,
            max_trials: 10,
            condense_after: Some(4),
            estimate: true,
            second_look: true,
            slack: 1.0,
            warm_start: true,
            count_known: false,
        }
    }
}

impl SearchSettings {
    /// Algorithm 3 as it is published, with none of what is not in the paper.
    #[must_use]
    pub fn published() -> Self {
        Self { condense_after: None, estimate: false, second_look: false, warm_start: false, ..Self::default() }
    }
}

/// How a search went.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SearchReport {
    /// Sets of states solved for, at most one more than [`SearchSettings::max_trials`].
    pub trials: usize,
    /// Iterations of all linear solves, those of the condensed system included.
    pub iterations: usize,
    /// Iterations of the condensed system; zero if it was not asked for.
    pub condensed_iterations: usize,
    /// Iterations of a solve with the states that were found, not among the others; zero unless
    /// [asked for](SearchSettings::count_known).
    pub known_iterations: usize,
    /// Fewest iterations of a trial.
    pub fewest_iterations: usize,
    /// Most iterations of a trial.
    pub most_iterations: usize,
    /// Pivots of the complementarity solves.
    pub pivots: usize,
    /// Whether the states satisfy all conditions.
    pub consistent: bool,
    /// Why the condensed system was of no use, if it was not; the trials then went on without it.
    pub refused: Option<BoxError>,
}

/// Memory of searches; a second search of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct SearchWorkspace {
    /// Sets of states that were solved for, one after another.
    tried: Vec<SlipState>,
    /// At which tolerance each of them failed.
    failed_at: Vec<f64>,
    condensed: Condensed,
}

impl SearchWorkspace {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// Finds the states of the coupling nodes, from the guess in `states`, and the solution for them, left in the system and in
/// `answer`. Nodes that the guess lacks are taken as static.
///
/// A static node bears a force within its static limits; a forward one slips by `s ≥ 0` and a backward one by `s ≤ 0`. Where a
/// condition fails, a slipping node becomes static, and a static one slips as its force pushes. No set of states is tried
/// twice, unless it failed [only when it was checked](SearchSettings::second_look): in place of a known one comes the
/// next in lexicographic order (static, forward, backward) with the node at the entry as the least significant digit.
/// When `max_trials` sets have failed, the next one is solved for and accepted; [`SearchReport::consistent`] says
/// whether its conditions hold all the same.
///
/// Conditions hold up to a slack: a force may be beyond its limit by `slack · tolerance` times the largest force of the answer
/// or [the step](StickSlip::magnitudes), a slip may be of the wrong sign by as much of the largest slip or displacement, with
/// the tolerance that the solve has reached. A node that is about to slip has, as static, a force at its limit, and, as
/// slipping, no slip: without slack the rounding of the solve would refuse both. With it one of both is accepted, provided that
/// the slack covers the error of the solve: where the computed force is beyond the limit by more than its error, so is the true
/// one, and a node that lets go then slips the way in which its force pushed, as `W` is positive definite. Once a search has
/// gone on for long, a slip may also be of the wrong sign by what a force of that error makes of it.
///
/// A condensed system, once it is asked for, gives all further states. After each failure it is moved to agree with the
/// solution of that trial, since its columns have errors of the tolerance too. With a ratio above one, several sets may be
/// consistent: nodes that slip in the guess go on slipping if they can.
///
/// # Errors
/// Those of the system. A condensed system that is not symmetric positive definite is no error, but
/// [reported](SearchReport::refused).
///
/// # Panics
/// If the system's answer has fewer numbers than the system has nodes.
///
/// Source: Chentanez, Alterovitz, Ritchie, Cho, Hauser, Goldberg, Shewchuk & O'Brien, *Interactive simulation of surgical
/// needle insertion and steering*, ACM Trans. Graph. 28(3) (2009), section 3.6.1 and Algorithm 3; conditions (9) to (11).
pub fn search<S: StickSlip>(
    system: &mut S,
    states: &mut Vec<SlipState>,
    settings: &SearchSettings,
    ws: &mut SearchWorkspace,
    answer: &mut Answer,
) -> Result<SearchReport, S::Error> {
    states.resize(system.limits().len(), SlipState::Static);
    ws.tried.clear();
    ws.failed_at.clear();
    let mut report = SearchReport::default();
    let mut search =
        Search { system, settings, ws, answer, loaded: false, estimated: None, tolerance: settings.check_tolerance };
    if settings.method == SearchMethod::Condensed {
        search.condense(states, &mut report)?;
    }
    report.consistent = search.by_trials(states, &mut report)?;
    if settings.count_known {
        report.known_iterations = search.system.solve(states, settings.solve_tolerance, true, search.answer)?;
    }
    Ok(report)
}

struct Search<'a, S: StickSlip> {
    system: &'a mut S,
    settings: &'a SearchSettings,
    ws: &'a mut SearchWorkspace,
    answer: &'a mut Answer,
    /// Whether the condensed system of this step is there.
    loaded: bool,
    /// Whether its estimate is, and whether that is of use.
    estimated: Option<bool>,
    /// Tolerance of the last solve.
    tolerance: f64,
}

impl<S: StickSlip> Search<'_, S> {
    /// Tries states until they are consistent or the trials are used up, and returns whether they are.
    fn by_trials(&mut self, states: &mut [SlipState], report: &mut SearchReport) -> Result<bool, S::Error> {
        while report.trials < self.settings.max_trials {
            if self.trial(states, report)? {
                return Ok(true);
            }
            if !self.change(states, report)? {
                break; // All states there are have been tried.
            }
        }
        let consistent = self.solve(states, &[self.settings.solve_tolerance], report)?;
        Ok(consistent || self.holds_to_its_errors(states, report))
    }

    /// Solves with these states, and returns whether they are consistent.
    fn trial(&mut self, states: &[SlipState], report: &mut SearchReport) -> Result<bool, S::Error> {
        let checked = self.failures(states).next().is_some();
        self.ws.tried.extend_from_slice(states);
        let SearchSettings { check_tolerance, solve_tolerance, .. } = *self.settings;
        // States from the condensed system are most likely right: no look at half time.
        let condensed = self.loaded && report.refused.is_none();
        let first = usize::from(condensed || checked || check_tolerance <= solve_tolerance);
        let consistent = self.solve(states, &[check_tolerance, solve_tolerance][first..], report)?;
        self.ws.failed_at.push(self.tolerance);
        Ok(consistent || self.holds_to_its_errors(states, report))
    }

    /// Whether the conditions hold where slips may be wrong by what a force at the tolerance moves their nodes. In short steps,
    /// and where all is about to stop, that is far above the tolerance of slips, and every state of a node may be refused.
    /// For searches that have gone on for long alone: what holds to the errors might creep by them.
    fn holds_to_its_errors(&self, states: &[SlipState], report: &SearchReport) -> bool {
        let long = self.settings.condense_after.is_some_and(|failures| report.trials > failures);
        let [force, slip] = self.slacks();
        let moves = |i: usize| self.ws.condensed.compliance(i) * force;
        (self.loaded || long && self.estimated.is_some())
            && self.tolerance <= self.settings.solve_tolerance
            && states.iter().enumerate().all(|(i, &state)| self.holds(i, state, [force, slip.max(moves(i))]))
    }

    /// Solves to each of the tolerances while the conditions hold, and returns whether they hold at the end.
    fn solve(&mut self, states: &[SlipState], stages: &[f64], report: &mut SearchReport) -> Result<bool, S::Error> {
        let mut iterations = 0;
        let mut consistent = true;
        for (stage, &tolerance) in stages.iter().enumerate() {
            let fresh = report.trials == 0 && stage == 0;
            iterations += self.system.solve(states, tolerance, fresh, self.answer)?;
            self.tolerance = tolerance;
            let slacks = self.slacks();
            consistent = (0..states.len()).all(|i| self.holds(i, states[i], slacks));
            if !consistent {
                break;
            }
        }
        let fewest = if report.trials == 0 { iterations } else { report.fewest_iterations };
        report.fewest_iterations = fewest.min(iterations);
        report.most_iterations = report.most_iterations.max(iterations);
        report.iterations += iterations;
        report.trials += 1;
        Ok(consistent)
    }

    /// By how much a force (N) may exceed its limit, and a slip (m) be of the wrong sign.
    fn slacks(&self) -> [f64; 2] {
        let largest = |start: f64, v: &[f64]| v.iter().fold(start, |max, v| max.max(v.abs()));
        let [force, slip] = self.system.magnitudes();
        let scale = self.settings.slack * self.tolerance;
        [scale * largest(force, &self.answer.force), scale * largest(slip, &self.answer.slip)]
    }

    /// Conditions (9) to (11); a NaN satisfies none of them.
    fn holds(&self, i: usize, state: SlipState, [force_slack, slip_slack]: [f64; 2]) -> bool {
        let SlipLimits { fixed: [lower, upper], .. } = self.system.limits()[i];
        let (force, slip) = (self.answer.force[i], self.answer.slip[i]);
        match state {
            SlipState::Static => force >= lower - force_slack && force <= upper + force_slack,
            SlipState::Forward => slip >= -slip_slack,
            SlipState::Backward => slip <= slip_slack,
        }
    }

    /// Puts other states in place of those that failed. False if all there are have been tried.
    fn change(&mut self, states: &mut [SlipState], report: &mut SearchReport) -> Result<bool, S::Error> {
        let mut cycles = false;
        if self.settings.estimate && !self.loaded && self.estimated != Some(false) {
            if self.estimate(states, report)? && !self.is_tried(states) {
                return Ok(true);
            }
            // It comes back to states that failed: only true columns lead on.
            cycles = self.estimated == Some(true);
            self.estimated = Some(false);
        }
        let due = cycles && self.settings.condense_after.is_some();
        let due = due || self.settings.condense_after.is_some_and(|failures| report.trials >= failures);
        let condensed = (self.loaded || due) && report.refused.is_none();
        if !(condensed && self.condense(states, report)? && !self.is_tried(states)) {
            let failed = self.ws.tried.len() - states.len();
            states.copy_from_slice(&self.ws.tried[failed..]);
            self.change_violated(states);
        }
        // Of one more than were tried, one is new, unless there are no more.
        let mut left = self.ws.tried.len() / states.len().max(1);
        while self.is_tried(states) {
            if left == 0 {
                return Ok(false);
            }
            advance(states);
            left -= 1;
        }
        Ok(true)
    }

    /// Replaces `states` by those that the estimate has for consistent. False if it is of no use.
    fn estimate(&mut self, states: &mut [SlipState], report: &mut SearchReport) -> Result<bool, S::Error> {
        let condensed = &mut self.ws.condensed;
        if self.estimated.is_none() {
            self.estimated = Some(condensed.load_estimate(self.system)?);
        }
        if self.estimated != Some(true) {
            return Ok(false);
        }
        condensed.correct(self.answer);
        match condensed.states(self.system.limits(), states) {
            Ok(pivots) => report.pivots += pivots,
            Err(_) => self.estimated = Some(false),
        }
        Ok(self.estimated == Some(true))
    }

    /// Replaces `states` by those that the condensed system has for consistent. False if it is of no use.
    fn condense(&mut self, states: &mut [SlipState], report: &mut SearchReport) -> Result<bool, S::Error> {
        let condensed = &mut self.ws.condensed;
        if self.loaded {
            condensed.correct(self.answer);
        } else {
            // After trials it only has to tell which states; these are solved for all the same.
            let SearchSettings { method, check_tolerance, solve_tolerance, .. } = *self.settings;
            let tolerance = if method == SearchMethod::Condensed { solve_tolerance } else { check_tolerance };
            let iterations = condensed.load(self.system, tolerance)?;
            report.condensed_iterations += iterations;
            report.iterations += iterations;
            self.loaded = true;
        }
        match condensed.states(self.system.limits(), states) {
            Ok(pivots) => report.pivots += pivots,
            Err(error) => report.refused = Some(error),
        }
        Ok(report.refused.is_none())
    }

    /// The published rules.
    fn change_violated(&self, states: &mut [SlipState]) {
        let slacks = self.slacks();
        for (i, state) in states.iter_mut().enumerate() {
            if self.holds(i, *state, slacks) {
                continue;
            }
            *state = match *state {
                SlipState::Static if self.answer.force[i] < 0.0 => SlipState::Backward,
                SlipState::Static => SlipState::Forward,
                SlipState::Forward | SlipState::Backward => SlipState::Static,
            };
        }
    }

    /// Whether these states have failed for good.
    fn is_tried(&self, states: &[SlipState]) -> bool {
        let SearchSettings { second_look, solve_tolerance, .. } = *self.settings;
        self.failures(states).any(|tolerance| !second_look || tolerance <= solve_tolerance)
    }

    /// The tolerances at which these states have failed.
    fn failures(&self, states: &[SlipState]) -> impl Iterator<Item = f64> {
        let tried = self.ws.tried.chunks_exact(states.len().max(1)).zip(&self.ws.failed_at);
        tried.filter_map(move |(tried, tolerance)| (tried == states).then_some(*tolerance))
    }
}

/// The next states in lexicographic order, the first node being the least significant digit; after the last the first.
fn advance(states: &mut [SlipState]) {
    for state in states {
        *state = match state {
            SlipState::Static => SlipState::Forward,
            SlipState::Forward => SlipState::Backward,
            SlipState::Backward => SlipState::Static,
        };
        if *state != SlipState::Static {
            return;
        }
    }
}
