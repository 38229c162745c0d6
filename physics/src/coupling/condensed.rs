//! States from the tangential forces alone: a complementarity problem with one unknown for each coupling node.

use super::state::{Answer, SlipLimits, SlipState, StickSlip};
use stylet_solver::complementarity::{BoxError, BoxProblem, BoxState, BoxWorkspace, PivotingSettings, block_pivoting};

/// `s = s_free − W λ`, and memory of the solves.
#[derive(Clone, Debug, Default)]
pub(super) struct Condensed {
    w: Vec<f64>,
    free_slip: Vec<f64>,
    /// `−s_free`, the vector of the complementarity problem, whose `w` is `−s`.
    q: Vec<f64>,
    lambda: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Nodes whose force has the dynamic limits, since they slip or have let go.
    loose: Vec<bool>,
    start: Vec<BoxState>,
    boxes: BoxWorkspace,
}

impl Condensed {
    /// Asks the system for `W` and `s_free`. Columns that were solved to a tolerance are not quite symmetric: `W` becomes the
    /// mean of both triangles. Returns the iterations spent.
    pub(super) fn load<S: StickSlip>(&mut self, system: &mut S, tolerance: f64) -> Result<usize, S::Error> {
        let iterations = system.condense(tolerance, &mut self.w, &mut self.free_slip)?;
        let n = self.free_slip.len();
        if self.w.len() == n * n {
            for i in 0..n {
                for j in 0..i {
                    let mean = 0.5 * (self.w[i * n + j] + self.w[j * n + i]);
                    self.w[i * n + j] = mean;
                    self.w[j * n + i] = mean;
                }
            }
        }
        Ok(iterations)
    }

    /// Takes the system's estimate of `W` instead, if it has one; `s_free` then follows by [`correct`](Self::correct).
    pub(super) fn load_estimate<S: StickSlip>(&mut self, system: &mut S) -> Result<bool, S::Error> {
        let n = system.limits().len();
        self.free_slip.clear();
        self.free_slip.resize(n, 0.0);
        Ok(system.estimate(&mut self.w)? && self.w.len() == n * n)
    }

    /// Slip of a node by force on it, m/N; zero where it is not known.
    pub(super) fn compliance(&self, node: usize) -> f64 {
        self.w.get(node * self.free_slip.len() + node).copied().unwrap_or(0.0)
    }

    /// Moves `s_free` so that the condensed system reproduces what a solve of the whole one has found. With a `W` that is only
    /// nearly right the states are then right about that answer.
    pub(super) fn correct(&mut self, answer: &Answer) {
        let n = answer.force.len();
        if self.w.len() != n * n || self.free_slip.len() != n || answer.slip.len() != n {
            return; // The complementarity solve names what is wrong.
        }
        for (i, free) in self.free_slip.iter_mut().enumerate() {
            let row = &self.w[i * n..(i + 1) * n];
            *free = answer.slip[i] + row.iter().zip(&answer.force).map(|(w, force)| w * force).sum::<f64>();
        }
    }

    /// Overwrites `states`, the guess, by consistent ones. Returns the pivots.
    ///
    /// With equal static and dynamic limits the consistent states are those of the one solution of a box-constrained
    /// complementarity problem. Otherwise there may be several consistent sets, and there always is one, found here: nodes that
    /// slip in the guess have their dynamic limits, the others the static ones; nodes that reach a static limit are given the
    /// dynamic ones and the problem is solved again, until no further node lets go. That takes at most one solve more than
    /// there are nodes. A node with dynamic limits is at one of them and slips the right way, or within and sticks, so it
    /// is consistent either way.
    pub(super) fn states(&mut self, limits: &[SlipLimits], states: &mut [SlipState]) -> Result<usize, BoxError> {
        self.q.clear();
        self.q.extend(self.free_slip.iter().map(|slip| -slip));
        self.lambda.resize(limits.len(), 0.0);
        self.loose.clear();
        self.loose.extend(states.iter().map(|&state| state != SlipState::Static));
        self.start.clear();
        self.start.extend(states.iter().map(|state| match state {
            SlipState::Static => BoxState::Between,
            SlipState::Forward => BoxState::Upper,
            SlipState::Backward => BoxState::Lower,
        }));
        self.boxes.set_states(&self.start);
        let mut pivots = 0;
        loop {
            pivots += self.solve(limits)?;
            if !self.let_go(limits) {
                break;
            }
        }
        for (state, found) in states.iter_mut().zip(self.boxes.states()) {
            *state = match found {
                BoxState::Lower => SlipState::Backward,
                BoxState::Between => SlipState::Static,
                BoxState::Upper => SlipState::Forward,
            };
        }
        Ok(pivots)
    }

    fn solve(&mut self, limits: &[SlipLimits]) -> Result<usize, BoxError> {
        self.lower.clear();
        self.upper.clear();
        for (limits, &loose) in limits.iter().zip(&self.loose) {
            let [lower, upper] = if loose { limits.dynamic } else { limits.fixed };
            self.lower.push(lower);
            self.upper.push(upper);
        }
        let Self { w, q, lambda, lower, upper, boxes, .. } = self;
        let problem = BoxProblem { matrix: w, q, lower, upper };
        Ok(block_pivoting(&problem, lambda, &PivotingSettings::default(), boxes)?.iterations)
    }

    /// Whether nodes reached a static limit that is not their dynamic one. They let go.
    fn let_go(&mut self, limits: &[SlipLimits]) -> bool {
        let mut any = false;
        for ((loose, state), limits) in self.loose.iter_mut().zip(self.boxes.states()).zip(limits) {
            if !*loose && *state != BoxState::Between && limits.fixed != limits.dynamic {
                *loose = true;
                any = true;
            }
        }
        any
    }
}
