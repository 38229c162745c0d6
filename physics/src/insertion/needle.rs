//! A steerable needle: what it is made of, where it starts, and how its base is moved.

use super::InsertionError;
use super::tip::Lag;
use crate::coupling::{CouplingNode, Shaft, SleeveMotion};
use crate::reparameterise::EdgeLimits;
use crate::rod::{Rod, RodStiffness};
use serde::{Deserialize, Serialize};
use stylet_mesh::remesh::NeedleId;

/// Most natural curvature times the length of an edge: beyond, edges would not follow the bend.
const MOST_TURN: f64 = 1.0;

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
    /// A bend that it has by nature.
    pub bend: Option<NaturalBend>,
    /// Factors of the friction along the needle: from a distance to the tip (m) on, ascending; one where there is none.
    pub friction_factors: Vec<(f64, f64)>,
}

/// A natural curvature that begins at a distance from the tip: a pre-bent needle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NaturalBend {
    /// Curvature towards the direction of the bevel, or away from it, 1/m.
    pub curvature: f64,
    /// Length of the needle that is bent, from the tip, m.
    pub length: f64,
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
            bend: None,
            friction_factors: Vec::new(),
        })
    }

    /// The needle at rest, free of force, in a sleeve that holds its first edge.
    ///
    /// # Errors
    /// [`InsertionError::Setting`] names what makes no sense; [`InsertionError::Rod`].
    pub fn shaft(&self) -> Result<Shaft, InsertionError> {
        let refuse = |name, value, expected| Err(InsertionError::Setting { name, value, expected });
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !positive(self.length) {
            return refuse("needle.length", self.length, "a positive length, m");
        }
        if !(positive(self.edge) && self.edge <= self.length) {
            return refuse("needle.edge", self.edge, "a positive length up to that of the needle, m");
        }
        if self.bevel.is_nan() || self.bevel.abs() >= 1.2 {
            return refuse("needle.bevel", self.bevel, "an angle between -1.2 and 1.2 rad");
        }
        if !(self.damping >= 0.0 && self.damping.is_finite()) {
            return refuse("needle.damping", self.damping, "zero or more, s");
        }
        if let Some((_, factor)) = self.friction_factors.iter().find(|(_, f)| !(*f >= 0.0 && f.is_finite())) {
            return refuse("needle.friction_factors", *factor, "zero or more");
        }
        let direction = unit_or("needle.direction", &self.direction)?;
        let across = unit_or("needle.bevel_direction", &self.bevel_direction)?;
        let along: f64 = (0..3).map(|i| across[i] * direction[i]).sum();
        let director: [f64; 3] = std::array::from_fn(|i| across[i] - along * direction[i]);
        let director = unit_or("needle.bevel_direction less its part along needle.direction", &director)?;
        let n_edges = (self.length / self.edge).round().max(1.0) as usize;
        let edge = self.length / n_edges as f64;
        let wrong = |error| InsertionError::Rod { needle: 0, error };
        let mut rod = Rod::new(vec![edge; n_edges + 1], self.stiffness, self.linear_density).map_err(wrong)?;
        if let Some(bend) = self.bend {
            let turn = bend.curvature.abs() * edge;
            if turn.is_nan() || turn > MOST_TURN {
                return refuse("needle.bend.curvature", bend.curvature, "at most a radian for each edge, 1/m");
            }
            if !positive(bend.length) {
                return refuse("needle.bend.length", bend.length, "a positive length, m");
            }
            // Inner node 1 is the mouth of the sleeve; the last one is an edge from the tip.
            let to_tip = |node: usize| (n_edges + 1 - node) as f64 * edge;
            let of = |node| if to_tip(node) <= bend.length * (1.0 + 1e-9) { [bend.curvature, 0.0] } else { [0.0; 2] };
            rod.set_rest_curvatures(&(1..=n_edges).map(of).collect::<Vec<_>>()).map_err(wrong)?;
        }
        let x = at_rest(&rod, &self.base, edge, &direction, &director);
        let zero = vec![0.0; x.len()];
        Ok(Shaft { rod, v: zero.clone(), a: zero, x, director, damping: self.damping, nodes: Vec::new() })
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
    pub(super) lag: Lag,
    pub(super) id: NeedleId,
    pub(super) edges: EdgeLimits,
}

impl Needle {
    pub(super) fn new(k: usize, id: NeedleId, settings: NeedleSettings) -> Result<Self, InsertionError> {
        let shaft = settings.shaft().map_err(|error| match error {
            InsertionError::Rod { error, .. } => InsertionError::Rod { needle: k, error },
            error => error,
        })?;
        let edge = shaft.rod.rest_lengths()[0];
        let edges = EdgeLimits::from_initial(edge, edge)
            .map_err(|error| InsertionError::Reparameterise { needle: k, error })?;
        Ok(Self {
            settings,
            shaft,
            inserted: 0.0,
            angle: 0.0,
            base_force: [0.0; 3],
            base_moment: [0.0; 3],
            forces: Vec::new(),
            slips: Vec::new(),
            lag: Lag::default(),
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
        SleeveMotion { place: [place(0), place(1)], velocity: motion.sleeve, fed: h * motion.insert }
    }
}

/// Places of the nodes without any force: straight, or bent in the plane of the base's first director.
fn at_rest(rod: &Rod, base: &[f64; 3], edge: f64, direction: &[f64; 3], director: &[f64; 3]) -> Vec<f64> {
    let place =
        |x: &[f64; 2]| -> [f64; 3] { std::array::from_fn(|k| base[k] + x[0] * direction[k] + x[1] * director[k]) };
    let (mut at, mut angle): ([f64; 2], f64) = ([0.0; 2], 0.0);
    let mut x: Vec<f64> = [place(&[-edge, 0.0]), place(&at)].concat();
    for [curvature, _] in rod.rest_curvatures() {
        // The turn at a node of a rod in equilibrium, where its curvature is 2 tan(turn / 2) over the length of an edge.
        angle += 2.0 * (0.5 * curvature * edge).atan();
        at = [at[0] + edge * angle.cos(), at[1] + edge * angle.sin()];
        x.extend(place(&at));
    }
    x
}

fn unit_or(name: &'static str, v: &[f64; 3]) -> Result<[f64; 3], InsertionError> {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 1e-9 && length.is_finite() {
        return Ok(v.map(|x| x / length));
    }
    Err(InsertionError::Setting { name, value: length, expected: "a direction: a vector that is not zero" })
}
