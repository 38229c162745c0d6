//! A rod in motion, its energies and momenta.

use crate::rod::Rod;
use serde::{Deserialize, Serialize};
use stylet_solver::vector::norm2;

/// A rod in motion; with the angles of the rod all that a run needs to go on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RodState {
    /// Time, s.
    pub t: f64,
    /// Positions, m, three numbers for each node.
    pub x: Vec<f64>,
    /// Velocities, m/s. Constrained nodes keep theirs from step to step: they move as the caller sets it.
    pub v: Vec<f64>,
    /// Accelerations, m/s^2.
    pub a: Vec<f64>,
    /// The base director, across the first edge; it turns with that edge without spinning.
    pub base_director: [f64; 3],
}

impl RodState {
    /// At rest at time zero.
    #[must_use]
    pub fn at_rest(x: Vec<f64>, base_director: [f64; 3]) -> Self {
        let n = x.len();
        Self { t: 0.0, x, v: vec![0.0; n], a: vec![0.0; n], base_director }
    }

    pub(super) fn first_tangent(&self) -> [f64; 3] {
        let edge: [f64; 3] = std::array::from_fn(|k| self.x[3 + k] - self.x[k]);
        let length = norm2(&edge);
        edge.map(|e| e / length)
    }
}

/// Energies and momenta of a rod in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodBalance {
    /// Bending, stretch and twist, J.
    pub elastic: f64,
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Momentum, kg m/s.
    pub momentum: [f64; 3],
    /// Moment of momentum about the origin, kg m^2/s.
    pub angular_momentum: [f64; 3],
}

impl RodBalance {
    /// Of a rod in a state.
    ///
    /// # Panics
    /// If the state has another number of nodes than the rod.
    #[must_use]
    pub fn of(rod: &mut Rod, state: &RodState) -> Self {
        let elastic = rod.energy(&state.x, &state.base_director);
        let (mut kinetic, mut momentum, mut angular_momentum) = (0.0, [0.0; 3], [0.0; 3]);
        for (node, (x, v)) in state.x.as_chunks::<3>().0.iter().zip(state.v.as_chunks::<3>().0).enumerate() {
            let p = v.map(|v| rod.node_mass(node) * v);
            for k in 0..3 {
                let (k1, k2) = ((k + 1) % 3, (k + 2) % 3);
                kinetic += 0.5 * p[k] * v[k];
                momentum[k] += p[k];
                angular_momentum[k] += x[k1] * p[k2] - x[k2] * p[k1];
            }
        }
        Self { elastic, kinetic, momentum, angular_momentum }
    }
}
