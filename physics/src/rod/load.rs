//! Loads that have a potential.

use super::Rod;
use super::assembly::nodes;
use serde::{Deserialize, Serialize};
use stylet_solver::Block;
use stylet_solver::sparse::BlockCsr;

/// Dead forces on the nodes, and a couple on the last edge.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RodLoad {
    /// Forces, N, three for each node.
    pub forces: Vec<f64>,
    /// Moment on the last edge, N m, about an axis that stays: its potential is minus the moment times the angle by which the
    /// edge, seen along the axis, is turned about it. In the plane across the axis that is a moment in every position; out of the
    /// plane it is the forces across the edge's projection that do the same work.
    pub couple: [f64; 3],
}

impl RodLoad {
    /// No load on this many nodes.
    #[must_use]
    pub fn new(n_nodes: usize) -> Self {
        Self { forces: vec![0.0; 3 * n_nodes], couple: [0.0; 3] }
    }

    /// Adds the weight of a rod in a field of gravity (m/s^2).
    ///
    /// # Panics
    /// If there are not three forces for each node of the rod.
    pub fn add_weight(&mut self, rod: &Rod, gravity: &[f64; 3]) {
        assert_eq!(self.forces.len(), 3 * rod.n_nodes(), "a load has three forces for each node");
        for (node, force) in self.forces.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            (0..3).for_each(|k| force[k] += rod.node_mass(node) * gravity[k]);
        }
    }

    /// Potential of the load at `x`, J, up to a constant; the angle of the couple is within half a turn of that at `near`.
    pub(super) fn potential(&self, x: &[f64], near: f64) -> f64 {
        let dead: f64 = self.forces.iter().zip(x).map(|(f, x)| f * x).sum();
        let couple = Couple::at(self, x).map_or(0.0, |couple| couple.moment * couple.angle_near(near));
        -dead - couple
    }

    /// Angle of the last edge about the axis of the couple, within half a turn of `near`.
    pub(super) fn angle(&self, x: &[f64], near: f64) -> f64 {
        Couple::at(self, x).map_or(near, |couple| couple.angle_near(near))
    }

    /// Adds the forces.
    pub(super) fn add_force(&self, x: &[f64], force: &mut [f64]) {
        for (force, dead) in force.iter_mut().zip(&self.forces) {
            *force += dead;
        }
        let Some(couple) = Couple::at(self, x) else { return };
        let n = x.len();
        for (k, slope) in couple.gradient().iter().enumerate() {
            force[n - 6 + k] -= couple.moment * slope;
            force[n - 3 + k] += couple.moment * slope;
        }
    }

    /// Adds the second derivative of the potential.
    pub(super) fn add_tangent(&self, x: &[f64], matrix: &mut BlockCsr<3>) {
        let Some(couple) = Couple::at(self, x) else { return };
        let block = couple.hessian();
        let last = matrix.n_rows() - 1;
        for (i, j, sign) in
            [(last, last, -1.0), (last - 1, last - 1, -1.0), (last, last - 1, 1.0), (last - 1, last, 1.0)]
        {
            if let Some(entry) = matrix.get_mut(i, j) {
                for (to, from) in entry.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
                    *to += sign * couple.moment * from;
                }
            }
        }
    }
}

/// The last edge in a plane across the axis: coordinates `p`, `q` along `b1`, `b2`.
struct Couple {
    moment: f64,
    b1: [f64; 3],
    b2: [f64; 3],
    p: f64,
    q: f64,
}

impl Couple {
    fn at(load: &RodLoad, x: &[f64]) -> Option<Self> {
        let axis = nalgebra::Vector3::from(load.couple);
        let moment = axis.norm();
        if moment == 0.0 {
            return None;
        }
        let axis = axis / moment;
        let side = nalgebra::Vector3::ith(axis.iamin(), 1.0);
        let b1 = (side - axis * axis.dot(&side)).normalize();
        let b2 = axis.cross(&b1);
        let [.., from, to] = nodes(x, x.len() / 3) else { return None };
        let edge = nalgebra::Vector3::from(*to) - nalgebra::Vector3::from(*from);
        Some(Self { moment, b1: b1.into(), b2: b2.into(), p: edge.dot(&b1), q: edge.dot(&b2) })
    }

    fn angle_near(&self, near: f64) -> f64 {
        use std::f64::consts::TAU;
        let angle = self.q.atan2(self.p);
        angle - TAU * ((angle - near) / TAU).round()
    }

    fn gradient(&self) -> [f64; 3] {
        let r2 = self.p * self.p + self.q * self.q;
        std::array::from_fn(|k| (self.b2[k] * self.p - self.b1[k] * self.q) / r2)
    }

    fn hessian(&self) -> Block<3> {
        let (p, q) = (self.p, self.q);
        let r4 = (p * p + q * q).powi(2);
        let (pp, pq) = (2.0 * p * q / r4, (q * q - p * p) / r4);
        let (b1, b2) = (&self.b1, &self.b2);
        std::array::from_fn(|k| {
            std::array::from_fn(|l| pp * (b1[k] * b1[l] - b2[k] * b2[l]) + pq * (b1[k] * b2[l] + b2[k] * b1[l]))
        })
    }
}
