//! Quasi-static stick-slip friction between a tool and the tissue nodes that lie on it.
//!
//! A contact either sticks, and then moves with the tool, or slips along the tool's tangent and carries the dynamic
//! friction as a prescribed traction. Between two equilibria the states are rearranged from the elastic forces:
//!
//! ```text
//!            |force| > static limit
//!   Stick  --------------------------->  Slip(direction of the force)
//!          <---------------------------
//!            force fallen to the dynamic limit, or the sliding has turned round
//! ```
//!
//! Source: Nienhuys, *Cutting in deformable objects*, PhD thesis, Utrecht (2003), section 6.3.2, for the two force tests.
//! The test on the direction of sliding is ours: a slipping node's force equals its limit up to the relaxation error,
//! so the force tests alone cannot see that a tool has turned round, and friction would then feed energy into the pair.

use serde::{Deserialize, Serialize};

/// The way a slipping contact's friction acts on the tissue, along the tool's tangent.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Direction {
    /// Along the tangent: the tool advances past the tissue and drags it forward.
    Forward,
    /// Against the tangent.
    Backward,
}

impl Direction {
    /// The direction of a force, or of a relative displacement, of this sign.
    pub fn of(value: f64) -> Self {
        if value < 0.0 { Self::Backward } else { Self::Forward }
    }

    /// 1 or -1.
    pub fn sign(self) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}

/// The state of one contact.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum FrictionState {
    /// The node moves with the tool.
    Stick,
    /// The node slides along the tool and carries the dynamic friction in this direction.
    Slip(Direction),
}

/// The friction limits of one contact, N. Both are positive or zero, and `sticking >= sliding` in a sensible material.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Limits {
    /// The largest force that a sticking contact bears (static threshold).
    pub sticking: f64,
    /// The force that a slipping contact carries (dynamic threshold).
    pub sliding: f64,
}

/// When a slipping contact sticks again.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Law {
    /// A slip event has run its course when the force that drives it has fallen to the dynamic limit. In equilibrium the
    /// two are equal up to the relaxation error, so the test is `force < (1 + restick) * limit` with `restick` of the order
    /// of the solver's tolerance. It does not apply where `(1 + restick)` times the dynamic limit reaches the static one:
    /// there a sliding contact goes on sliding until the tool turns round.
    pub restick: f64,
    /// Sliding against the friction's direction by more than this (m) sticks the contact: the tool has turned round.
    pub reversal: f64,
}

/// What one equilibrium says about one contact.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Observation {
    /// The force that the tool exerts on the node, along the tangent, N.
    pub force: f64,
    /// How far the tool has moved past the node along the tangent since the last position of the tool, m.
    pub sliding: f64,
}

/// What becomes of a contact.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// The state stands.
    Keep,
    /// A sticking contact breaks loose and carries friction in this direction.
    Loosen(Direction),
    /// A slipping contact sticks: its force has fallen to the dynamic limit.
    Hold,
    /// A slipping contact sticks: the tool has turned round.
    Turn,
}

/// Forces below this (N) count as rounding errors: a contact whose limit is zero does not break loose for them.
const NO_FORCE: f64 = 1e-12;

impl Law {
    /// Judges one contact. Nothing changes when every verdict is [`Verdict::Keep`].
    pub fn judge(&self, state: FrictionState, limits: Limits, seen: Observation) -> Verdict {
        match state {
            FrictionState::Stick if seen.force.abs() > limits.sticking.max(NO_FORCE) => {
                Verdict::Loosen(Direction::of(seen.force))
            }
            FrictionState::Stick => Verdict::Keep,
            FrictionState::Slip(direction) => {
                let fallen = (1.0 + self.restick) * limits.sliding;
                if seen.sliding * direction.sign() < -self.reversal {
                    Verdict::Turn
                } else if fallen < limits.sticking && seen.force * direction.sign() < fallen {
                    Verdict::Hold
                } else {
                    Verdict::Keep
                }
            }
        }
    }
}

/// A force density along a shaft by the distance behind the tip: piecewise linear, constant beyond the last row.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct LineDensity {
    rows: Vec<(f64, f64)>,
}

/// Why a force density is refused.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DensityError {
    /// There is no row at all.
    #[error("the force density has no row, expected at least one")]
    Empty,
    /// A row is not finite, or negative.
    #[error("row {row} of the force density is ({distance}, {density}), expected finite numbers of at least 0")]
    Value {
        /// Counted from 1.
        row: usize,
        /// Distance behind the tip, m.
        distance: f64,
        /// Density, N/m.
        density: f64,
    },
    /// Distances do not increase.
    #[error("row {row} of the force density has distance {distance}, expected more than {previous} of the row before")]
    Order {
        /// Counted from 1.
        row: usize,
        /// Distance behind the tip, m.
        distance: f64,
        /// The distance of the row before, m.
        previous: f64,
    },
}

impl LineDensity {
    /// From rows `(distance behind the tip in m, density in N/m)` with increasing distances.
    ///
    /// # Errors
    /// [`DensityError`] if there is no row, a number is negative or not finite, or distances do not increase.
    pub fn new(rows: Vec<(f64, f64)>) -> Result<Self, DensityError> {
        if rows.is_empty() {
            return Err(DensityError::Empty);
        }
        for (index, &(distance, density)) in rows.iter().enumerate() {
            let row = index + 1;
            if !(distance >= 0.0 && distance.is_finite() && density >= 0.0 && density.is_finite()) {
                return Err(DensityError::Value { row, distance, density });
            }
            if index > 0 && distance <= rows[index - 1].0 {
                return Err(DensityError::Order { row, distance, previous: rows[index - 1].0 });
            }
        }
        Ok(Self { rows })
    }

    /// The rows `(distance, density)`.
    pub fn rows(&self) -> &[(f64, f64)] {
        &self.rows
    }

    /// The density (N/m) at `distance` (m) behind the tip; ahead of the tip it is that at the first row.
    #[inline]
    pub fn at(&self, distance: f64) -> f64 {
        let rows = &self.rows;
        let last = rows[rows.len() - 1];
        if distance >= last.0 {
            return last.1;
        }
        for pair in rows.windows(2).rev() {
            let ((s0, q0), (s1, q1)) = (pair[0], pair[1]);
            if distance >= s0 {
                return q0 + (q1 - q0) * (distance - s0) / (s1 - s0);
            }
        }
        rows[0].1
    }

    /// The force (N) on the shaft between the tip and `length` (m) behind it.
    pub fn total(&self, length: f64) -> f64 {
        let mut stations: Vec<f64> = vec![0.0];
        stations.extend(self.rows.iter().map(|row| row.0).filter(|&s| s > 0.0 && s < length));
        stations.push(length.max(0.0));
        stations.windows(2).map(|s| 0.5 * (self.at(s[0]) + self.at(s[1])) * (s[1] - s[0])).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_calibrated_density_pushes_with_its_published_total() {
        let density = LineDensity::new(vec![(0.0, 0.0), (0.002, 90.0), (0.004, 45.0)]).unwrap();
        assert!((density.total(0.07) - 3.195).abs() < 1e-12);
        assert_eq!((density.at(-0.1), density.at(0.001), density.at(0.003), density.at(1.0)), (0.0, 45.0, 67.5, 45.0));
    }

    #[test]
    fn bad_densities_are_refused_with_their_row() {
        assert_eq!(LineDensity::new(vec![]), Err(DensityError::Empty));
        assert!(matches!(LineDensity::new(vec![(0.0, f64::NAN)]), Err(DensityError::Value { row: 1, .. })));
        assert!(matches!(LineDensity::new(vec![(0.0, 1.0), (0.0, 2.0)]), Err(DensityError::Order { row: 2, .. })));
    }

    /// Validation G3: independent nodes on springs, a rigid tool that goes 8 mm in, back to -8 mm and in again. The
    /// sheet's slip starts, forces and loss are exact for equal limits.
    #[test]
    fn five_springs_on_a_rigid_needle_follow_the_exact_hysteresis() {
        let stiffness = [50.0, 50.0, 100.0, 100.0, 200.0];
        let limit = [0.1, 0.2, 0.2, 0.3, 0.1];
        let law = Law { restick: 0.02, reversal: 1e-12 };
        let step = 1e-5;
        let mut states = [FrictionState::Stick; 5];
        let mut nodes = [0.0; 5]; // displacement of each node
        let mut offset = [0.0; 5]; // node minus needle while sticking
        let mut slip_start = [f64::NAN; 5];
        let mut needle = 0.0;
        // Returns the total force on the tissue at the new position.
        let mut go_to = |position: f64| -> f64 {
            let (before, old_needle) = (nodes, needle);
            needle = position;
            loop {
                let mut changed = false;
                for i in 0..5 {
                    nodes[i] = match states[i] {
                        FrictionState::Stick => needle + offset[i],
                        FrictionState::Slip(d) => d.sign() * limit[i] / stiffness[i],
                    };
                    let force = stiffness[i] * nodes[i];
                    let sliding = (needle - old_needle) - (nodes[i] - before[i]);
                    let limits = Limits { sticking: limit[i], sliding: limit[i] };
                    match law.judge(states[i], limits, Observation { force, sliding }) {
                        Verdict::Keep => continue,
                        Verdict::Loosen(d) => {
                            states[i] = FrictionState::Slip(d);
                            if slip_start[i].is_nan() {
                                slip_start[i] = old_needle;
                            }
                        }
                        Verdict::Hold => {
                            states[i] = FrictionState::Stick;
                            offset[i] = nodes[i] - needle;
                        }
                        Verdict::Turn => {
                            states[i] = FrictionState::Stick;
                            offset[i] = before[i] - old_needle;
                        }
                    }
                    changed = true;
                }
                if !changed {
                    return (0..5).map(|i| stiffness[i] * nodes[i]).sum();
                }
            }
        };
        let mut force_at = std::collections::BTreeMap::new();
        let (mut last, mut loss) = (0.0, 0.0);
        let mut travel = |range: &mut dyn Iterator<Item = i64>, leg: i64, count_loss: bool| {
            for k in range {
                let force = go_to(k as f64 * step);
                if count_loss {
                    loss += 0.5 * (force + last) * step * if leg == 2 { -1.0 } else { 1.0 };
                }
                last = force;
                force_at.insert((leg, k), force);
            }
        };
        travel(&mut (1..=800), 1, false);
        travel(&mut (-800..800).rev(), 2, true);
        travel(&mut (-799..=800), 3, true);
        for (start, expected) in slip_start.iter().zip([0.002, 0.004, 0.002, 0.003, 0.0005]) {
            assert!((start - expected).abs() <= 1.01 * step, "slip starts at {start}, expected {expected}");
        }
        let force = |leg, k| force_at[&(leg, k)];
        assert!((force(1, 200) - 0.7).abs() < 1e-9 && (force(1, 400) - 0.9).abs() < 1e-9);
        assert!((force(1, 800) - 0.9).abs() < 1e-9);
        assert!((force(2, 400) + 0.5).abs() < 1e-9, "{}", force(2, 400));
        assert!((force(2, 0) + 0.9).abs() < 1e-9);
        let zero = (-800..800).rev().find(|&k| force(2, k) <= 0.0).unwrap() as f64 * step;
        assert!((zero - 5.66667e-3).abs() <= 1.01 * step, "force vanishes at {zero}");
        assert!((loss - 19.4e-3).abs() < 1e-5, "loss per cycle {loss} J");
    }
}
