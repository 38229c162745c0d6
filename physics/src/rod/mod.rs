//! Discrete elastic rods: thin, nearly inextensible bodies that bend and twist.
//!
//! A rod is a chain of nodes; its energy at the positions `x` and the angles `theta` of its edges is
//!
//! ```text
//! E = sum over inner nodes i    EI/2 l_i  mean over j = i-1, i of |omega_i^j / l_i - kappa_i|^2     bending
//!                             + GJ/2 l_i  ((theta^i - theta^(i-1)) / l_i)^2                         twist
//!   + sum over edges j          EA/2 l^j  (|e^j| / l^j - 1)^2                                       stretch
//! ```
//!
//! with rest lengths `l^j` of the edges, `l_i` half of those of the two edges at a node, and `omega_i^j` the curvature at node
//! `i` (times `l_i`) in the directors of edge `j`. Edge `j` joins nodes `j` and `j + 1`; its tangent points from the first to
//! the last node.
//!
//! * **Frames.** Bishop's frame starts at the first edge with a director that the caller gives, the *base director*, and is carried
//!   from edge to edge by the smallest rotation, so that it never spins. The material's directors `m1`, `m2` (`t`, `m1`, `m2` is
//!   right-handed) are Bishop's turned by `theta` about the tangent.
//! * **Curvature** of a node is the vector `dt/ds`, in components along `m1` and `m2`: `(k, 0)` bends the rod towards `m1`.
//!   [`Rod::rest_curvatures`] are such pairs. A natural torsion is a natural curvature whose direction turns along the rod.
//! * **Forces** are those at frames held against spinning: when a node moves, its edges take their directors along by the
//!   smallest rotation ([`Rod::carry_angles`]), and the angles relative to Bishop's frame may change with it. That makes
//!   forces local, and twist act on positions as `GJ (theta^i - theta^(i-1)) / l_i` times the change of the holonomy. For angles
//!   in equilibrium ([`Rod::settle_angles`]) it is the derivative of the energy that is left as a function of positions.
//! * **Inextensible** rods are stiff in stretch, as in Spillmann & Teschner (2007).
//!
//! Twist cannot be seen in the positions: [`Rod::add_twist_force`] is apart, so that it can be taken explicitly in time. The
//! derivative of forces at frames that do not spin is not symmetric where there are torques; [`Rod::tangent`] holds its
//! symmetric part, which is the second derivative of the energy with every frame carried straight from where it is.
//!
//! An edge of no length, or a corner folded back onto itself, has no frames: the energy there is infinite or NaN, forces are NaN.
//!
//! ```
//! use stylet_physics::rod::{HeldEnds, Rod, RodLoad, RodStaticSettings, RodStiffness, solve_rod};
//! use stylet_solver::subspace::{Constraint, Subspace};
//!
//! // A nitinol wire of 0.2 m; half of the first edge is in the clamp.
//! let (n, h) = (20, 0.2 / 19.5);
//! let mut rod = Rod::new(vec![h; n], RodStiffness::round(60e9, 0.33, 0.83e-3)?, 3.5e-3)?;
//! let mut x: Vec<f64> = (0..=n).flat_map(|i| [(i as f64 - 0.5) * h, 0.0, 0.0]).collect();
//! let mut subspace = Subspace::new(n + 1);
//! subspace.set(0, Constraint::Fixed)?;
//! subspace.set(1, Constraint::Fixed)?;
//! let mut load = RodLoad::new(n + 1);
//! load.forces[3 * n + 1] = 0.01; // newtons, at the tip
//! let (director, settings) = ([0.0, 1.0, 0.0], RodStaticSettings::default());
//! solve_rod(&mut rod, director, &load, &HeldEnds::default(), &subspace, &mut x, &settings)?;
//! let deflection = x[3 * n + 1]; // a beam: P L^3 / 3 EI, less a percent for the finite slope
//! assert!((deflection / 0.01908 - 1.0).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Source: Bergou, Wardetzky, Robinson, Audoly & Grinspun, *Discrete Elastic Rods*, SIGGRAPH 2008; Bergou, Audoly, Vouga,
//! Wardetzky & Grinspun, *Discrete Viscous Threads*, SIGGRAPH 2010 (frames carried in time); Spillmann & Teschner, *CoRdE*,
//! SCA 2007.

mod angles;
mod assembly;
mod banded;
mod corner;
mod dynamics;
mod error;
mod frames;
mod load;
mod potential;
mod statics;
mod stiffness;
mod stored;

pub use angles::HeldEnds;
pub use assembly::Tangent;
pub use banded::{BandedError, BandedFactor};
pub use dynamics::{
    RodBalance, RodDynamicsError, RodDynamicsSettings, RodIntegrator, RodState, RodStep, RodStepReport,
};
pub use error::RodError;
pub use frames::{Frame, parallel_transport};
pub use load::RodLoad;
pub use potential::RodPotential;
pub use statics::{RodStaticError, RodStaticSettings, solve_rod};
pub use stiffness::RodStiffness;

use assembly::Scratch;
use error::{positive, shape};
use serde::{Deserialize, Serialize};
use stored::Stored;

/// A rod of uniform stiffness and density: all but the positions of its nodes.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct Rod {
    stiffness: RodStiffness,
    linear_density: f64,
    rest_lengths: Vec<f64>,
    angles: Vec<f64>,
    rest_curvatures: Vec<[f64; 2]>,
    /// Whether a rest curvature is not zero: only then does bending depend on frames.
    curved: bool,
    scratch: Scratch,
}

/// Equal rods; what they have computed does not matter.
impl PartialEq for Rod {
    fn eq(&self, other: &Self) -> bool {
        self.stiffness == other.stiffness
            && self.linear_density == other.linear_density
            && self.rest_lengths == other.rest_lengths
            && self.angles == other.angles
            && self.rest_curvatures == other.rest_curvatures
    }
}

impl Rod {
    /// A naturally straight rod without twist: rest lengths of the edges (m), stiffness, mass per length (kg/m).
    ///
    /// # Errors
    /// [`RodError::Shape`] without an edge, [`RodError::Entry`] for a length that is not positive, [`RodError::Value`] for a
    /// stiffness or density that no rod has.
    pub fn new(rest_lengths: Vec<f64>, stiffness: RodStiffness, linear_density: f64) -> Result<Self, RodError> {
        stiffness.validate()?;
        positive("linear density", linear_density)?;
        if rest_lengths.is_empty() {
            return Err(RodError::Shape { name: "rest lengths", found: 0, expected: 1 });
        }
        check_lengths(&rest_lengths)?;
        let n = rest_lengths.len();
        let (angles, rest_curvatures) = (vec![0.0; n], vec![[0.0; 2]; n - 1]);
        let scratch = Scratch::default();
        Ok(Self { stiffness, linear_density, rest_lengths, angles, rest_curvatures, curved: false, scratch })
    }

    /// Stiffness of the section.
    #[must_use]
    pub fn stiffness(&self) -> &RodStiffness {
        &self.stiffness
    }

    /// Mass per length, kg/m.
    #[must_use]
    pub fn linear_density(&self) -> f64 {
        self.linear_density
    }

    /// Number of edges, one or more.
    #[must_use]
    pub fn n_edges(&self) -> usize {
        self.rest_lengths.len()
    }

    /// Number of nodes, one more than edges.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.n_edges() + 1
    }

    /// Rest lengths of the edges, m.
    #[must_use]
    pub fn rest_lengths(&self) -> &[f64] {
        &self.rest_lengths
    }

    /// Angle of the material's directors relative to Bishop's frame, rad, by edge.
    #[must_use]
    pub fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// Natural curvature along `m1` and `m2`, 1/m, of nodes 1 to `n_nodes - 2`. See the [module](self).
    #[must_use]
    pub fn rest_curvatures(&self) -> &[[f64; 2]] {
        &self.rest_curvatures
    }

    /// Whether the rod has no natural curvature; then frames do not matter to bending, and without torques along it twist is even.
    #[must_use]
    pub fn is_naturally_straight(&self) -> bool {
        !self.curved
    }

    /// Sets the angles of all edges, rad.
    ///
    /// # Errors
    /// [`RodError::Shape`], [`RodError::Entry`] for an angle that is not finite. The rod is then unchanged.
    pub fn set_angles(&mut self, angles: &[f64]) -> Result<(), RodError> {
        shape("angles", angles.len(), self.n_edges())?;
        check_finite("angle", angles)?;
        self.angles.copy_from_slice(angles);
        Ok(())
    }

    /// Sets the natural curvatures of all inner nodes, 1/m.
    ///
    /// # Errors
    /// [`RodError::Shape`], [`RodError::Entry`] for a curvature that is not finite. The rod is then unchanged.
    pub fn set_rest_curvatures(&mut self, curvatures: &[[f64; 2]]) -> Result<(), RodError> {
        shape("rest curvatures", curvatures.len(), self.n_edges() - 1)?;
        check_curvatures(curvatures)?;
        self.rest_curvatures.copy_from_slice(curvatures);
        self.note_curvature();
        Ok(())
    }

    /// Sets the rest length of one edge, m.
    ///
    /// # Errors
    /// [`RodError::Shape`] if there is no such edge, [`RodError::Entry`] if the length is not positive. The rod is then unchanged.
    pub fn set_rest_length(&mut self, edge: usize, length: f64) -> Result<(), RodError> {
        let n = self.n_edges();
        let place = self.rest_lengths.get_mut(edge);
        let place = place.ok_or(RodError::Shape { name: "edge", found: edge, expected: n - 1 })?;
        check_length(edge, length)?;
        *place = length;
        Ok(())
    }

    /// Another discretisation of the same rod: everything that is per node or edge at once.
    ///
    /// # Errors
    /// [`RodError::Shape`] if there is no edge, or angles and curvatures do not fit the lengths; [`RodError::Entry`]. The rod is
    /// then unchanged.
    pub fn replace(
        &mut self,
        rest_lengths: &[f64],
        angles: &[f64],
        rest_curvatures: &[[f64; 2]],
    ) -> Result<(), RodError> {
        let n = rest_lengths.len();
        if n == 0 {
            return Err(RodError::Shape { name: "rest lengths", found: 0, expected: 1 });
        }
        shape("angles", angles.len(), n)?;
        shape("rest curvatures", rest_curvatures.len(), n - 1)?;
        check_lengths(rest_lengths)?;
        check_finite("angle", angles)?;
        check_curvatures(rest_curvatures)?;
        let overwrite = |to: &mut Vec<f64>, from: &[f64]| {
            to.clear();
            to.extend_from_slice(from);
        };
        overwrite(&mut self.rest_lengths, rest_lengths);
        overwrite(&mut self.angles, angles);
        self.rest_curvatures.clear();
        self.rest_curvatures.extend_from_slice(rest_curvatures);
        self.note_curvature();
        Ok(())
    }

    fn note_curvature(&mut self) {
        self.curved = self.rest_curvatures.as_flattened().iter().any(|&k| k != 0.0);
    }

    /// Length that belongs to a node, m: half of the edges at it.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn node_length(&self, node: usize) -> f64 {
        assert!(node < self.n_nodes(), "node {node} of a rod of {} nodes", self.n_nodes());
        let before = if node > 0 { self.rest_lengths[node - 1] } else { 0.0 };
        let after = self.rest_lengths.get(node).copied().unwrap_or(0.0);
        0.5 * (before + after)
    }

    /// Mass of a node, kg: its length times the mass per length.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn node_mass(&self, node: usize) -> f64 {
        self.linear_density * self.node_length(node)
    }

    /// Twisting moment `GJ (theta^i - theta^(i-1)) / l_i` in the rod at an inner node, N m: what the part beyond the node
    /// exerts on the part before it, about the tangent; positive where the rod is wound right-handed.
    ///
    /// # Panics
    /// Unless `node` is an inner one, 1 to `n_nodes - 2`.
    #[must_use]
    pub fn twisting_moment(&self, node: usize) -> f64 {
        assert!(0 < node && node < self.n_edges(), "node {node} of {} is not an inner one", self.n_nodes());
        self.stiffness.twisting * (self.angles[node] - self.angles[node - 1]) / self.node_length(node)
    }

    /// Torque about the first tangent that holds the base, N m: minus the [twisting moment](Self::twisting_moment) at the
    /// first inner node. Zero without an inner node. The first edge of a naturally curved rod bears a part of the bending
    /// besides, which [`base_torque`](Self::base_torque) has too.
    #[must_use]
    pub fn twist_torque(&self) -> f64 {
        if self.n_edges() < 2 { 0.0 } else { -self.twisting_moment(1) }
    }
}

fn check_length(index: usize, value: f64) -> Result<(), RodError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(RodError::Entry { name: "rest length", index, value, expected: "a positive length, m" })
}

fn check_lengths(lengths: &[f64]) -> Result<(), RodError> {
    lengths.iter().enumerate().try_for_each(|(edge, &length)| check_length(edge, length))
}

fn check_finite(name: &'static str, values: &[f64]) -> Result<(), RodError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(RodError::Entry { name, index, value: values[index], expected: "a finite number" }),
        None => Ok(()),
    }
}

fn check_curvatures(curvatures: &[[f64; 2]]) -> Result<(), RodError> {
    curvatures.iter().enumerate().try_for_each(|(index, k)| match k.iter().find(|k| !k.is_finite()) {
        Some(&value) => Err(RodError::Entry { name: "rest curvature", index, value, expected: "a finite number" }),
        None => Ok(()),
    })
}
