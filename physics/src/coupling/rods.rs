//! The rods in the coupled system: their forces, matrices and right sides, and where their nodes end.

use super::settings::CoupledSettings;
use super::shaft::{SleeveMotion, difference, inner, length, set_triple, triple, unit};
use super::{Shaft, SlipState};
use crate::dynamics::scheme::Coefficients;
use crate::rod::RodError;
use stylet_mesh::geometry::cross;
use stylet_solver::sparse::{BlockCsr, SparseError};

/// Where a step would leave a needle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShaftEnd {
    /// Places, m.
    pub x: Vec<f64>,
    /// Velocities, m/s.
    pub v: Vec<f64>,
    /// Accelerations, m/s^2.
    pub a: Vec<f64>,
    /// Force of the sleeve on the needle, N.
    pub base_force: [f64; 3],
    /// Moment of the sleeve on the needle about node 0, N m.
    pub base_moment: [f64; 3],
    /// By coupling node: state, force along `t` on the tissue (N), sliding (m).
    pub states: Vec<SlipState>,
    /// Forces along `t` on the tissue, N.
    pub forces: Vec<f64>,
    /// Needle less tissue along `t`, m.
    pub slips: Vec<f64>,
}

/// Numbers of one needle in the step at hand.
#[derive(Debug)]
pub(super) struct RodSystem {
    tangent: BlockCsr<3>,
    force: Vec<f64>,
    /// `x^ − x0` and `v^`; of the nodes in the sleeve what is prescribed.
    pub p: Vec<f64>,
    v_hat: Vec<f64>,
    /// Where forces and matrix are taken: `x0`, but for what the sleeve has fed, which all that is outside goes on by. At `x0`
    /// itself the second edge would be stretched or compressed by it, with thousands of newtons that are none, and a pull holds
    /// edges in the direction that they have. An edge that would be too short even so goes on by what it lacks: a push that is
    /// there turns edges about, and a pull may stay.
    fed: Vec<f64>,
    /// `x^` less these places; of the nodes in the sleeve what is prescribed.
    ahead: Vec<f64>,
    /// Torque about the first edge that holds its angle, N m.
    base_torque: f64,
    /// Its first node (node 2) in the small body.
    pub first: usize,
    /// Its own scheme. The unknowns of the system are accelerations as the scheme of the tissue has them: `x1 = x^ + cx z`.
    own: Option<Coefficients>,
}

impl RodSystem {
    pub fn new() -> Self {
        Self {
            tangent: BlockCsr::new(0),
            force: Vec::new(),
            p: Vec::new(),
            v_hat: Vec::new(),
            fed: Vec::new(),
            ahead: Vec::new(),
            base_torque: 0.0,
            first: 0,
            own: None,
        }
    }

    pub fn evaluate(
        &mut self,
        needle: &mut Shaft,
        (sleeve, twist): (&SleeveMotion, bool),
        settings: &CoupledSettings,
        c: &Coefficients,
    ) -> Result<(), RodError> {
        let n = needle.n_nodes();
        self.force.clear();
        self.force.resize(3 * n, 0.0);
        self.base_torque = 0.0;
        let Shaft { rod, x, director, .. } = needle;
        let edge = difference(&triple(x, 2), &triple(x, 1));
        let fed = sleeve.fed.max(rod.rest_lengths()[1] - length(&edge));
        let on = unit(&edge).map(|t| fed * t);
        self.fed.clear();
        self.fed.extend(x.iter().enumerate().map(|(i, x)| if i < 6 { *x } else { x + on[i % 3] }));
        let x = &self.fed;
        if !rod.is_naturally_straight() {
            // Twist spreads at once: the angles are in balance, with the base held. Without torsional friction nothing else turns
            // an edge, so that a straight needle keeps the angle of its base all along.
            let base = rod.angles()[0];
            rod.settle_angles(x, director, Some(base), None, None)?;
            rod.add_twist_force(x, director, &mut self.force);
            self.base_torque = rod.base_torque(x, director)?;
        }
        needle.rod.add_force(&self.fed, &needle.director, &mut self.force);
        for node in 0..n {
            let mass = needle.rod.node_mass(node);
            (0..3).for_each(|k| self.force[3 * node + k] += mass * settings.gravity[k]);
        }
        needle.rod.tangent(&self.fed, &needle.director, settings.tangent, twist, &mut self.tangent);
        let own = settings.needle_scheme.coefficients(c.h);
        self.own = Some(own);
        self.p.clear();
        self.p.extend((0..3 * n).map(|i| own.h * needle.v[i] + own.u_a0 * needle.a[i]));
        self.v_hat.clear();
        self.v_hat.extend((0..3 * n).map(|i| needle.v[i] + own.v_a0 * needle.a[i]));
        for (node, place) in sleeve.place.iter().enumerate() {
            set_triple(&mut self.p, node, &difference(place, &needle.place(node)));
            set_triple(&mut self.v_hat, node, &sleeve.velocity);
        }
        self.ahead.clear();
        self.ahead.extend((0..3 * n).map(|i| self.p[i] + needle.x[i] - self.fed[i]));
        Ok(())
    }

    /// `f − K (x^ − x) − D v^` of a node, with forces and matrix at `x`.
    fn side(&self, node: usize, damping: f64) -> [f64; 3] {
        let mut side = triple(&self.force, node);
        let (columns, blocks) = self.tangent.row(node);
        for (&j, block) in columns.iter().zip(blocks) {
            let (p, v) = (triple(&self.ahead, j as usize), triple(&self.v_hat, j as usize));
            for (side, row) in side.iter_mut().zip(block) {
                *side -= (0..3).map(|l| row[l] * (p[l] + damping * v[l])).sum::<f64>();
            }
        }
        side
    }

    pub fn add_to(
        &self,
        needle: &Shaft,
        c: &Coefficients,
        small: &mut BlockCsr<3>,
        b: &mut [f64],
    ) -> Result<(), SparseError> {
        let (stiffness, inertia) = self.weights(needle, c);
        let (mut row_columns, mut row_blocks) = (Vec::with_capacity(5), Vec::with_capacity(5));
        for node in 2..needle.n_nodes() {
            row_columns.clear();
            row_blocks.clear();
            let (columns, blocks) = self.tangent.row(node);
            for (&j, block) in columns.iter().zip(blocks).filter(|(j, _)| **j >= 2) {
                let mut block = block.map(|row| row.map(|k| stiffness * k));
                if j as usize == node {
                    (0..3).for_each(|k| block[k][k] += inertia * needle.rod.node_mass(node));
                }
                row_columns.push((self.first + j as usize - 2) as u32);
                row_blocks.push(block);
            }
            small.set_row(self.first + node - 2, &row_columns, &row_blocks)?;
            set_triple(b, node - 2, &self.side(node, needle.damping));
        }
        Ok(())
    }

    /// Factors of stiffness and mass in the system.
    fn weights(&self, needle: &Shaft, c: &Coefficients) -> (f64, f64) {
        let own = self.own.unwrap_or(*c);
        (c.cx * (1.0 + needle.damping * own.cv / own.cx), c.cx / own.cx)
    }

    pub fn end(
        &self,
        needle: &Shaft,
        sleeve: &SleeveMotion,
        x_small: &[f64],
        c: &Coefficients,
        h: f64,
        end: &mut ShaftEnd,
    ) {
        let n = needle.n_nodes();
        for (v, from) in [(&mut end.x, &needle.x), (&mut end.v, &needle.v), (&mut end.a, &needle.a)] {
            v.clear();
            v.extend_from_slice(from);
        }
        for node in 0..2 {
            let before = triple(&needle.v, node);
            set_triple(&mut end.x, node, &sleeve.place[node]);
            set_triple(&mut end.v, node, &sleeve.velocity);
            set_triple(&mut end.a, node, &difference(&sleeve.velocity, &before).map(|v| v / h));
        }
        let (own, (stiffness, inertia)) = (self.own.unwrap_or(*c), self.weights(needle, c));
        for node in 2..n {
            let z = triple(x_small, self.first + node - 2);
            for (k, z) in z.iter().enumerate() {
                let (i, a) = (3 * node + k, inertia * z);
                end.x[i] = needle.x[i] + self.p[i] + c.cx * z;
                end.v[i] = self.v_hat[i] + own.cv * a;
                end.a[i] = a;
            }
        }
        // What holds the nodes in the sleeve: M a − (f − K (p + cx a) − D (v^ + cv a)).
        let mut forces = [[0.0; 3]; 2];
        for (node, force) in forces.iter_mut().enumerate() {
            let (side, acceleration) = (self.side(node, needle.damping), triple(&end.a, node));
            let mass = needle.rod.node_mass(node);
            *force = std::array::from_fn(|k| mass * acceleration[k] - side[k]);
            let (columns, blocks) = self.tangent.row(node);
            for (&j, block) in columns.iter().zip(blocks).filter(|(j, _)| **j >= 2) {
                let z = triple(x_small, self.first + j as usize - 2);
                for (force, row) in force.iter_mut().zip(block) {
                    *force += stiffness * inner(row, &z);
                }
            }
        }
        let arm = difference(&sleeve.place[1], &sleeve.place[0]);
        end.base_force = std::array::from_fn(|k| forces[0][k] + forces[1][k]);
        let (bent, axis) = (cross(&arm, &forces[1]), needle.tangent(0));
        end.base_moment = std::array::from_fn(|k| bent[k] + self.base_torque * axis[k]);
    }
}
