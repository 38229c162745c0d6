//! Instants of a motion that are kept for a picture of it.

use serde::{Deserialize, Serialize};

/// A state that is drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Instant {
    /// s.
    pub t: f64,
    /// Displacement, m.
    pub u: Vec<f64>,
}

/// Keeps the state at `t` if one of the `wanted` times is past since `before`, the time of the state before it.
pub(super) fn keep(kept: &mut Vec<Instant>, wanted: &[f64], before: Option<f64>, t: f64, u: &[f64]) {
    // Times are sums of steps: one that is meant to fall on a step may be off by rounding errors.
    let past = |time: f64, t: f64| time <= t + ROUND_OFF * t.abs();
    if wanted.iter().any(|&time| past(time, t) && !before.is_some_and(|before| past(time, before))) {
        kept.push(Instant { t, u: u.to_vec() });
    }
}

const ROUND_OFF: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_time_is_kept_once_at_the_step_that_reaches_it() {
        let wanted = [0.0, 0.1, 0.25, 0.26, 5.0];
        let mut kept = Vec::new();
        keep(&mut kept, &wanted, None, 0.0, &[0.0]);
        let mut t = 0.0;
        for step in 1..=10 {
            let before = t;
            t += 0.1;
            keep(&mut kept, &wanted, Some(before), t, &[f64::from(step)]);
        }
        assert_eq!(kept.iter().map(|instant| instant.u[0]).collect::<Vec<_>>(), [0.0, 1.0, 3.0]);
    }
}
