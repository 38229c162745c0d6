//! Angles in equilibrium at given positions, and angles of edges that do not spin.

use super::assembly::nodes;
use super::corner::Edge;
use super::error::shape;
use super::frames::{bishop, transport, turned};
use super::{Rod, RodError, check_finite};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Torques below this share of what they are sums of are rounding errors.
const ROUND_OFF: f64 = 1e-12;
const MAX_ITERATIONS: usize = 200;
/// A step of Newton's method that must be shorter than this leads nowhere.
const SHORTEST: f64 = 1e-12;
/// What is added to the diagonal of a matrix that is not positive definite, in turn, as a share of the largest entry that bending
/// can have there.
const SHIFTS: [f64; 6] = [0.0, 1e-3, 1e-2, 0.1, 0.5, 2.0];
/// Share of the slope by which the energy must fall.
const ARMIJO: f64 = 1e-4;

/// How the ends of a rod are kept from spinning about their edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HeldEnds {
    /// Angle of the first edge relative to Bishop's frame, rad, if that edge is held.
    pub start: Option<f64>,
    /// Where the first director of the last edge points, if that edge is held: a vector across the edge.
    pub end: Option<[f64; 3]>,
}

/// Vectors of the iteration, one entry for each edge.
#[derive(Clone, Debug, Default)]
pub(super) struct Settling {
    /// Bending as a function of the edge's angle, `-(c cos theta + s sin theta)`.
    waves: Vec<[f64; 2]>,
    gradient: Vec<f64>,
    diagonal: Vec<f64>,
    step: Vec<f64>,
    start: Vec<f64>,
}

impl Rod {
    /// Turns the edges until bending, twist and `torques` (N m, one for each edge, about its tangent) are in balance at the
    /// positions `x`; the first and the last edge are held at `start` and `end` (rad, relative to Bishop's frame) if given. Returns
    /// the number of iterations, zero where no system had to be solved.
    ///
    /// A naturally straight rod that neither end holds keeps the angle of its first edge. A rod of one edge is held by `start`
    /// rather than by `end`. Of several equilibria of a naturally curved rod it finds one that the energy leads down to from the
    /// angles that it has.
    ///
    /// Newton's method on the tridiagonal system, Bergou et al. (2008), section 5, made definite where it is not, with energies
    /// that fall.
    ///
    /// # Errors
    /// [`RodError::Shape`] and [`RodError::Entry`] for torques or held angles that do not fit, [`RodError::Degenerate`],
    /// [`RodError::Unbalanced`], [`RodError::NotSettled`]. After all but the last the angles are unchanged.
    ///
    /// # Panics
    /// If `x` does not have three numbers for each node.
    pub fn settle_angles(
        &mut self,
        x: &[f64],
        base_director: &[f64; 3],
        start: Option<f64>,
        end: Option<f64>,
        torques: Option<&[f64]>,
    ) -> Result<usize, RodError> {
        let last = self.n_edges() - 1;
        check_finite("held angle", start.as_slice())?;
        check_finite("held angle", end.as_slice())?;
        if let Some(torques) = torques {
            shape("torques", torques.len(), self.n_edges())?;
            check_finite("torque", torques)?;
        }
        let end = end.filter(|_| last > 0 || start.is_none());
        if !self.curved && torques.is_none() && (start.is_none() || end.is_none()) {
            let angle = start.or(end).unwrap_or(self.angles[0]);
            self.angles.fill(angle);
            return Ok(0);
        }
        let mut start = start;
        if !self.curved && start.is_none() && end.is_none() {
            check_balance(torques.unwrap_or_default())?;
            start = Some(self.angles[0]);
        }
        self.find_waves(x, base_director)?;
        if let Some(end) = end {
            self.angles[last] = end;
        }
        if let Some(start) = start {
            self.angles[0] = start;
        }
        let held = |edge: usize| (edge == 0 && start.is_some()) || (edge == last && end.is_some());
        let mut work = std::mem::take(&mut self.scratch.settling);
        let settled = self.newton(&mut work, held, torques);
        self.scratch.settling = work;
        settled
    }

    /// [`settle_angles`](Self::settle_angles) with ends that are held in space, without torques.
    ///
    /// # Errors
    /// As [`settle_angles`](Self::settle_angles), and as [`angle_towards`](Self::angle_towards).
    ///
    /// # Panics
    /// If `x` does not have three numbers for each node.
    pub fn settle_held(&mut self, x: &[f64], base_director: &[f64; 3], ends: &HeldEnds) -> Result<usize, RodError> {
        let last = self.n_edges() - 1;
        let end = ends.end.map(|director| self.angle_towards(x, base_director, last, &director)).transpose()?;
        self.settle_angles(x, base_director, ends.start, end, None)
    }

    /// The angle at which the first director of an edge points along `director`, as far as that is across the edge: of all
    /// that differ by whole turns the one nearest to the angle that the edge has.
    ///
    /// # Errors
    /// [`RodError::Shape`] if there is no such edge, [`RodError::Degenerate`] if the rod has no frames there or `director` is along
    /// the edge.
    ///
    /// # Panics
    /// If `x` does not have three numbers for each node.
    pub fn angle_towards(
        &mut self,
        x: &[f64],
        base_director: &[f64; 3],
        edge: usize,
        director: &[f64; 3],
    ) -> Result<f64, RodError> {
        let near = *self.angles.get(edge).ok_or(RodError::Shape {
            name: "edge",
            found: edge,
            expected: self.n_edges() - 1,
        })?;
        self.measure(x);
        self.check_edges()?;
        let director = Vector3::from(*director);
        let frame = bishop(self.scratch.edges.iter().map(|e| e.tangent), base_director).nth(edge);
        let Some([_, u, v]) = frame.filter(|[_, u, v]| director.dot(u).hypot(director.dot(v)) > 0.0) else {
            return Err(RodError::Degenerate { edge });
        };
        Ok(nearest(director.dot(&v).atan2(director.dot(&u)), near))
    }

    /// Torque about the first tangent that holds the base at its angle, N m: what bending and twist change by when the first
    /// edge is turned.
    ///
    /// # Errors
    /// [`RodError::Degenerate`].
    ///
    /// # Panics
    /// If `x` does not have three numbers for each node.
    pub fn base_torque(&mut self, x: &[f64], base_director: &[f64; 3]) -> Result<f64, RodError> {
        self.find_waves(x, base_director)?;
        Ok(self.bending_torque(&self.scratch.settling.waves, 0) + self.twist_torque())
    }

    /// Changes the angles so that no edge spins when the rod goes from one configuration to another: the material's
    /// directors turn with their edges by the smallest rotation. Angles change by less than half a turn.
    ///
    /// # Errors
    /// [`RodError::Degenerate`] if one of the configurations has no frames, or an edge is reversed. The rod is then unchanged.
    ///
    /// # Panics
    /// If `from` or `to` does not have three numbers for each node.
    pub fn carry_angles(
        &mut self,
        from: &[f64],
        from_director: &[f64; 3],
        to: &[f64],
        to_director: &[f64; 3],
    ) -> Result<(), RodError> {
        for x in [from, to] {
            self.measure(x);
            self.check_edges()?;
        }
        let n = self.n_nodes();
        let tangents = |x| nodes(x, n).windows(2).map(|e: &[[f64; 3]]| Edge::between(&e[0], &e[1]).tangent);
        let before = bishop(tangents(from), from_director).zip(&self.angles);
        let carried = before.zip(bishop(tangents(to), to_director)).map(|((old, &angle), [t, u, v])| {
            let m1 = transport(&turned(&old, angle)[0], &old[0], &t);
            nearest(m1.dot(&v).atan2(m1.dot(&u)), angle)
        });
        let angles = &mut self.scratch.settling.step;
        angles.clear();
        angles.extend(carried);
        match angles.iter().position(|a| !a.is_finite()) {
            Some(edge) => Err(RodError::Degenerate { edge }),
            None => {
                self.angles.copy_from_slice(&self.scratch.settling.step);
                Ok(())
            }
        }
    }

    /// Bending as a function of the angles: `-EI kb . q / 2` for either edge at a node.
    fn find_waves(&mut self, x: &[f64], base_director: &[f64; 3]) -> Result<(), RodError> {
        self.measure(x);
        self.check_edges()?;
        let mut waves = std::mem::take(&mut self.scratch.settling.waves);
        waves.clear();
        waves.resize(self.n_edges(), [0.0; 2]);
        if self.curved {
            let last = self.n_edges() - 1;
            let tangents = self.scratch.edges.iter().map(|e| e.tangent);
            for (j, ([_, u, v], wave)) in bishop(tangents, base_director).zip(&mut waves).enumerate() {
                for node in j.max(1)..=(j + 1).min(last) {
                    let kb = self.corner(node).binormal() * (0.5 * self.stiffness.bending);
                    let [k1, k2] = self.rest_curvatures[node - 1];
                    wave[0] += k1 * kb.dot(&v) - k2 * kb.dot(&u);
                    wave[1] -= k1 * kb.dot(&u) + k2 * kb.dot(&v);
                }
            }
        }
        self.scratch.settling.waves = waves;
        Ok(())
    }

    fn newton(
        &mut self,
        work: &mut Settling,
        held: impl Fn(usize) -> bool,
        torques: Option<&[f64]>,
    ) -> Result<usize, RodError> {
        let (mut torque, mut scale) = self.torques(work, &held, torques);
        for iteration in 0..MAX_ITERATIONS {
            if torque <= ROUND_OFF * scale {
                return Ok(iteration);
            }
            let Some(shift) = self.definite_direction(work, &held) else {
                return Err(RodError::NotSettled { iterations: iteration, torque });
            };
            let slope: f64 = work.step.iter().zip(&work.gradient).map(|(s, g)| s * g).sum();
            let before = self.turning_energy(work, torques);
            work.start.clone_from(&self.angles);
            let mut length = 1.0;
            loop {
                for j in 0..self.n_edges() {
                    self.angles[j] = work.start[j] + length * work.step[j];
                }
                let change = self.turning_energy(work, torques) - before;
                let old = torque;
                (torque, scale) = self.torques(work, &held, torques);
                // Close to a minimum changes of the energy are all rounding errors; torques tell better.
                let closer = shift == 0.0 && torque < 0.5 * old && change <= ROUND_OFF * scale;
                if closer || change <= ARMIJO * length * slope {
                    break;
                }
                torque = old;
                length *= 0.5;
                if length < SHORTEST {
                    self.angles.clone_from(&work.start);
                    return Err(RodError::NotSettled { iterations: iteration, torque });
                }
            }
        }
        Err(RodError::NotSettled { iterations: MAX_ITERATIONS, torque })
    }

    /// The gradient; its largest entry, and the largest sum of what an entry is made of.
    fn torques(&self, work: &mut Settling, held: impl Fn(usize) -> bool, torques: Option<&[f64]>) -> (f64, f64) {
        work.gradient.clear();
        let (mut largest, mut scale) = (0.0_f64, 0.0_f64);
        for j in 0..self.n_edges() {
            let external = torques.map_or(0.0, |t| t[j]);
            let [c, s] = work.waves[j];
            let (mut gradient, mut terms) =
                (self.bending_torque(&work.waves, j) - external, c.hypot(s) + external.abs());
            for (node, sign) in [(j, 1.0), (j + 1, -1.0)] {
                if 0 < node && node < self.n_edges() {
                    gradient += sign * self.twisting_moment(node);
                    let sum = self.angles[node].abs() + self.angles[node - 1].abs();
                    terms += self.stiffness.twisting / self.node_length(node) * sum;
                }
            }
            if held(j) {
                gradient = 0.0;
            }
            work.gradient.push(gradient);
            largest = if gradient.is_nan() { f64::INFINITY } else { largest.max(gradient.abs()) };
            scale = scale.max(terms);
        }
        (largest, scale)
    }

    fn bending_torque(&self, waves: &[[f64; 2]], edge: usize) -> f64 {
        let ([c, s], (sin, cos)) = (waves[edge], self.angles[edge].sin_cos());
        c * sin - s * cos
    }

    fn turning_energy(&self, work: &Settling, torques: Option<&[f64]>) -> f64 {
        let mut energy = 0.0;
        for j in 0..self.n_edges() {
            let ([c, s], (sin, cos)) = (work.waves[j], self.angles[j].sin_cos());
            energy -= c * cos + s * sin + torques.map_or(0.0, |t| t[j]) * self.angles[j];
            if j > 0 {
                energy += 0.5 * self.twisting_moment(j) * (self.angles[j] - self.angles[j - 1]);
            }
        }
        energy
    }

    /// Newton's step, with as much added to the diagonal as makes the matrix positive definite; how much that is.
    fn definite_direction(&self, work: &mut Settling, held: impl Fn(usize) -> bool) -> Option<f64> {
        let largest = work.waves.iter().map(|[c, s]| c.hypot(*s)).fold(0.0, f64::max);
        // Bending takes no more than `largest` from the diagonal.
        let shifts = SHIFTS.iter().map(|share| share * largest);
        shifts.into_iter().find(|&shift| self.direction(work, &held, shift))
    }

    /// Newton's step from the tridiagonal Hessian with `shift` added to the diagonal. False if that is not positive definite.
    fn direction(&self, work: &mut Settling, held: impl Fn(usize) -> bool, shift: f64) -> bool {
        let n = self.n_edges();
        let coupling = |node: usize| {
            let free = 0 < node && node < n && !held(node) && !held(node - 1);
            if free { -self.stiffness.twisting / self.node_length(node) } else { 0.0 }
        };
        work.diagonal.clear();
        work.step.clear();
        for j in 0..n {
            let ([c, s], (sin, cos)) = (work.waves[j], self.angles[j].sin_cos());
            let mut diagonal = c * cos + s * sin + shift;
            for node in [j, j + 1] {
                if 0 < node && node < n {
                    diagonal += self.stiffness.twisting / self.node_length(node);
                }
            }
            // What nothing turns stays where it is.
            let idle = held(j) || diagonal == 0.0;
            let (mut pivot, mut rhs) = if idle { (1.0, 0.0) } else { (diagonal, -work.gradient[j]) };
            if j > 0 {
                let off = coupling(j);
                pivot -= off * off / work.diagonal[j - 1];
                rhs -= off / work.diagonal[j - 1] * work.step[j - 1];
            }
            let floor = if idle { 0.0 } else { n as f64 * f64::EPSILON * diagonal.abs() };
            if pivot.is_nan() || pivot <= floor {
                return false;
            }
            work.diagonal.push(pivot);
            work.step.push(rhs);
        }
        work.step[n - 1] /= work.diagonal[n - 1];
        for j in (0..n - 1).rev() {
            work.step[j] = (work.step[j] - coupling(j + 1) * work.step[j + 1]) / work.diagonal[j];
        }
        true
    }
}

/// `angle` plus the whole turns that bring it nearest to another one.
fn nearest(angle: f64, near: f64) -> f64 {
    angle - TAU * ((angle - near) / TAU).round()
}

fn check_balance(torques: &[f64]) -> Result<(), RodError> {
    let (sum, size) = torques.iter().fold((0.0, 0.0), |(sum, size), t| (sum + t, size + t.abs()));
    if sum.abs() <= ROUND_OFF * size { Ok(()) } else { Err(RodError::Unbalanced { sum }) }
}
