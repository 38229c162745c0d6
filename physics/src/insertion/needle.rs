//! A steerable needle: what it is made of, where it starts, and how its base is moved.

use super::InsertionError;
use crate::coupling::{CouplingNode, Shaft, SleeveMotion};
use crate::reparameterise::EdgeLimits;
use crate::rod::{Rod, RodStiffness};
use serde::{Deserialize, Serialize};
use stylet_mesh::remesh::NeedleId;

/// A needle and where it starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NeedleSettings {
    /// EI, GJ and EA.
    pub stiffness: RodStiffness,
    /// Mass by length, kg/m.
    pub linear_density: f64,
    /// Mouth of the sleeve, m.
    pub base: [f64; 3],
    /// Where the sleeve points.
    pub direction: [f64; 3],
    /// Across it, where the bevel bends the needle to at angle zero.
    pub bevel_direction: [f64; 3],
    /// Length outside the sleeve at the start, m.
    pub length: f64,
    /// Length of the edges at the start, m.
    pub edge: f64,
    /// Bevel angle psi, rad: the tip moves `tan psi` across for each unit along. Zero for a symmetric tip.
    pub bevel: f64,
    /// Static by dynamic friction, at least one.
    pub friction_ratio: f64,
    /// Stiffness-proportional damping of the rod, s.
    pub damping: f64,
    /// Factors of the friction along the needle: from a distance to the tip (m) on, ascending; one where there is none.
    pub friction_factors: Vec<(f64, f64)>,
}

impl NeedleSettings {
    /// A round wire: diameter 0.83 mm of nitinol (60 GPa, 6450 kg/m^3), straight, symmetric, 0.1 m outside its sleeve.
    ///
    /// # Errors
    /// [`InsertionError::Rod`] does not occur; it is that of the rod's own check.
    pub fn nitinol(base: [f64; 3], direction: [f64; 3]) -> Result<Self, InsertionError> {
        let diameter = 0.83e-3;
        let stiffness =
            RodStiffness::round(60e9, 0.33, diameter).map_err(|error| InsertionError::Rod { needle: 0, error })?;
        let bevel_direction = if direction[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
        Ok(Self {
            stiffness,
            linear_density: 6450.0 * std::f64::consts::FRAC_PI_4 * diameter * diameter,
            base,
            direction,
            bevel_direction,
            length: 0.1,
            edge: 5e-3,
            bevel: 0.0,
            friction_ratio: 1.0,
            damping: 0.0,
            friction_factors: Vec::new(),
        })
    }
}

/// How a base is moved during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BaseMotion {
    /// Speed at which the needle leaves the sleeve, m/s.
    pub insert: f64,
    /// Velocity of the sleeve, m/s.
    pub sleeve: [f64; 3],
    /// Turning about the axis, rad/s.
    pub spin: f64,
}

/// A needle in an [`Insertion`](super::Insertion).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Needle {
    /// What it is made of.
    pub settings: NeedleSettings,
    /// The rod, and its nodes in the tissue.
    pub shaft: Shaft,
    /// How far it has been pushed out of the sleeve since the start, m.
    pub inserted: f64,
    /// Angle of the base since the start, rad.
    pub angle: f64,
    /// Force of the sleeve on the needle in the last step, N, and its moment about node 0, N m.
    pub base_force: [f64; 3],
    /// Moment of the sleeve, N m.
    pub base_moment: [f64; 3],
    /// Of the coupling nodes in the last step: force along the needle on the tissue, N, and sliding, m.
    pub forces: Vec<f64>,
    /// Sliding of the needle past the tissue in the last step, m.
    pub slips: Vec<f64>,
    pub(super) id: NeedleId,
    pub(super) edges: EdgeLimits,
}

impl Needle {
    pub(super) fn new(k: usize, id: NeedleId, settings: NeedleSettings) -> Result<Self, InsertionError> {
        let refuse = |name, value, expected| Err(InsertionError::Setting { name, value, expected });
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !positive(settings.length) {
            return refuse("needle.length", settings.length, "a positive length, m");
        }
        if !(positive(settings.edge) && settings.edge <= settings.length) {
            return refuse("needle.edge", settings.edge, "a positive length up to that of the needle, m");
        }
        if settings.bevel.is_nan() || settings.bevel.abs() >= 1.2 {
            return refuse("needle.bevel", settings.bevel, "an angle between -1.2 and 1.2 rad");
        }
        if !(settings.damping >= 0.0 && settings.damping.is_finite()) {
            return refuse("needle.damping", settings.damping, "zero or more, s");
        }
        if let Some((_, factor)) = settings.friction_factors.iter().find(|(_, f)| !(*f >= 0.0 && f.is_finite())) {
            return refuse("needle.friction_factors", *factor, "zero or more");
        }
        let direction = unit_or("needle.direction", &settings.direction)?;
        let across = unit_or("needle.bevel_direction", &settings.bevel_direction)?;
        let along: f64 = (0..3).map(|i| across[i] * direction[i]).sum();
        let director: [f64; 3] = std::array::from_fn(|i| across[i] - along * direction[i]);
        let director = unit_or("needle.bevel_direction less its part along needle.direction", &director)?;
        let n_edges = (settings.length / settings.edge).round().max(1.0) as usize;
        let edge = settings.length / n_edges as f64;
        let rod = Rod::new(vec![edge; n_edges + 1], settings.stiffness, settings.linear_density)
            .map_err(|error| InsertionError::Rod { needle: k, error })?;
        let edges = EdgeLimits::from_initial(edge, edge)
            .map_err(|error| InsertionError::Reparameterise { needle: k, error })?;
        let x: Vec<f64> = (0..n_edges + 2)
            .flat_map(|i| (0..3).map(move |k| (i as f64 - 1.0, k)))
            .map(|(i, k)| settings.base[k] + i * edge * direction[k])
            .collect();
        let zero = vec![0.0; x.len()];
        let damping = settings.damping;
        let shaft = Shaft { rod, v: zero.clone(), a: zero, x, director, damping, nodes: Vec::new() };
        Ok(Self {
            settings,
            shaft,
            inserted: 0.0,
            angle: 0.0,
            base_force: [0.0; 3],
            base_moment: [0.0; 3],
            forces: Vec::new(),
            slips: Vec::new(),
            id,
            edges,
        })
    }

    /// Length of the needle in the tissue, m.
    #[must_use]
    pub fn depth(&self) -> f64 {
        let entry = self.shaft.entry();
        self.shaft.rod.rest_lengths().get(entry..).map_or(0.0, |lengths| lengths.iter().sum())
    }

    /// Whether a node of it is in the tissue.
    #[must_use]
    pub fn is_inside(&self) -> bool {
        !self.shaft.nodes.is_empty()
    }

    /// The nodes that needle and tissue share, entry first.
    #[must_use]
    pub fn nodes(&self) -> &[CouplingNode] {
        &self.shaft.nodes
    }

    /// Factor of the friction at a distance from the tip.
    pub(super) fn friction_factor(&self, from_tip: f64) -> f64 {
        let rows = &self.settings.friction_factors;
        rows.iter().rev().find(|(from, _)| *from <= from_tip).map_or(1.0, |(_, factor)| *factor)
    }

    /// Where the sleeve is at the end of a step.
    pub(super) fn sleeve(&self, motion: &BaseMotion, h: f64) -> SleeveMotion {
        let place = |node: usize| {
            let x = self.shaft.place(node);
            std::array::from_fn(|k| x[k] + h * motion.sleeve[k])
        };
        SleeveMotion { place: [place(0), place(1)], velocity: motion.sleeve }
    }
}

fn unit_or(name: &'static str, v: &[f64; 3]) -> Result<[f64; 3], InsertionError> {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 1e-9 && length.is_finite() {
        return Ok(v.map(|x| x / length));
    }
    Err(InsertionError::Setting { name, value: length, expected: "a direction: a vector that is not zero" })
}
