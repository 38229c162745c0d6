//! States and limits of coupling nodes, and the system whose states are chosen.

use serde::{Deserialize, Serialize};

/// What a coupling node does along the needle. Nodes outside the tissue are no coupling nodes and have no such state.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub enum SlipState {
    /// Needle and tissue move together: `s = 0`.
    #[default]
    Static,
    /// The needle penetrates, `s ≥ 0`, and drags the tissue towards the tip (DYNAMIC+ of the paper).
    Forward,
    /// The needle withdraws, `s ≤ 0`, and drags the tissue towards the base (DYNAMIC-).
    Backward,
}

/// Limits of the tangential force of one node on the tissue, N.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct SlipLimits {
    /// What a slipping node carries: backward (not positive), forward (not negative).
    pub dynamic: [f64; 2],
    /// What a sticking node bears, at least: the dynamic limits times a ratio of at least one.
    pub fixed: [f64; 2],
}

/// A friction law that makes no sense.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LimitsError {
    /// A force is negative, infinite or NaN.
    #[error("the {what} force is {value} N, expected a finite number of at least 0")]
    Force {
        /// Which force.
        what: &'static str,
        /// Its value, N.
        value: f64,
    },
    /// The ratio of static to dynamic friction is below one, infinite or NaN.
    #[error("the ratio of static to dynamic friction is {value}, expected a finite number of at least 1")]
    Ratio {
        /// Its value.
        value: f64,
    },
}

impl SlipLimits {
    /// A node with this dynamic friction and cutting force (N; the latter zero except at a tip that would have to cut), and
    /// static limits that are `ratio` times the dynamic ones.
    ///
    /// # Errors
    /// [`LimitsError`] if a force is negative, the ratio is below one, or one of them is not finite.
    ///
    /// Source: Chentanez et al. (2009), section 3.3, bounds (9) and (10).
    pub fn new(friction: f64, cutting: f64, ratio: f64) -> Result<Self, LimitsError> {
        for (what, value) in [("friction", friction), ("cutting", cutting)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(LimitsError::Force { what, value });
            }
        }
        if !(ratio >= 1.0 && ratio.is_finite()) {
            return Err(LimitsError::Ratio { value: ratio });
        }
        let dynamic = [-friction, friction + cutting];
        Ok(Self { dynamic, fixed: dynamic.map(|limit| ratio * limit) })
    }

    /// The tangential force of a slipping node on the tissue, N; zero for one that sticks, whose force is not prescribed.
    #[must_use]
    pub fn slipping(&self, state: SlipState) -> f64 {
        match state {
            SlipState::Static => 0.0,
            SlipState::Forward => self.dynamic[1],
            SlipState::Backward => self.dynamic[0],
        }
    }
}

/// What a solve for given states found, entry first, tip last.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Answer {
    /// `λ`: tangential forces on the tissue, N. Those of slipping nodes are [`SlipLimits::slipping`].
    pub force: Vec<f64>,
    /// `s`: slip of the step, m; zero where a node sticks.
    pub slip: Vec<f64>,
}

/// A coupled system whose tangential states can be chosen.
///
/// For all states together it is `s = s_free − W λ`, with `W` symmetric positive definite; but that system need not be
/// known, unless [`condense`](Self::condense) is called.
pub trait StickSlip {
    /// Why a solve can fail.
    type Error;

    /// Limits of the coupling nodes, entry first, tip last.
    fn limits(&self) -> &[SlipLimits];

    /// Solves with these states until the residual is `tolerance` times the right-hand side, starting from the iterate of the
    /// last call, or from zero if `fresh`. Fills `answer`, and returns the iterations.
    ///
    /// # Errors
    /// If the system cannot be solved; a search ends with this error.
    fn solve(
        &mut self,
        states: &[SlipState],
        tolerance: f64,
        fresh: bool,
        answer: &mut Answer,
    ) -> Result<usize, Self::Error>;

    /// `W` (m/N, by rows) and `s_free` (m), the slip where nothing hinders it: the system with all nodes slipping. Columns may be
    /// solved to `tolerance` only, or be those of the last step: the search corrects what comes of it, at the price of more
    /// trials. The iterate of [`solve`](Self::solve) stays. Returns the iterations.
    ///
    /// # Errors
    /// If the system cannot be solved; a search ends with this error.
    fn condense(&mut self, tolerance: f64, w: &mut Vec<f64>, free_slip: &mut Vec<f64>) -> Result<usize, Self::Error>;

    /// An estimate of `W` that costs no solve, all nodes slipping; false where there is none. It serves to guess states.
    ///
    /// # Errors
    /// If it cannot be made; a search ends with this error.
    fn estimate(&mut self, w: &mut Vec<f64>) -> Result<bool, Self::Error> {
        let _ = w;
        Ok(false)
    }

    /// Sizes of a force (N) and of a displacement (m) of the step, such as those of the fastest node. The tolerance of a solve
    /// times these is what its forces and slips are uncertain by. Without them, those of the answer are taken.
    fn magnitudes(&self) -> [f64; 2] {
        [0.0, 0.0]
    }
}

/// Gives each new node the state of the nearest old one, by arc length (m, ascending); the one nearer to the base wins a draw.
/// Without old nodes all are [`SlipState::Static`].
///
/// # Panics
/// If there is not one state for each old node.
///
/// Source: Chentanez et al. (2009), section 3.6.1.
pub fn guess(old_arc: &[f64], old_states: &[SlipState], new_arc: &[f64], new_states: &mut Vec<SlipState>) {
    assert_eq!(old_arc.len(), old_states.len(), "one state for each old node");
    new_states.clear();
    new_states.extend(new_arc.iter().map(|&arc| {
        let above = old_arc.partition_point(|&old| old < arc);
        let below = above.saturating_sub(1);
        let nearest = match old_arc.get(above) {
            Some(old) if old - arc < arc - old_arc[below] || above == 0 => above,
            _ => below,
        };
        old_states.get(nearest).copied().unwrap_or_default()
    }));
}
