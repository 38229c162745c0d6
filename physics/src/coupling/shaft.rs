//! A needle as the coupled step sees it: a rod in motion, and the vertices of the tissue that its nodes are.

use super::{SlipLimits, SlipState};
use crate::rod::Rod;
use serde::{Deserialize, Serialize};

/// A needle: a rod whose first two nodes are held by a sleeve, and some of whose nodes are vertices of the tissue.
///
/// Nodes count from the base to the tip; vectors are flat, node `i` owns entries `3i .. 3i + 3`, in world coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shaft {
    /// Rest lengths, stiffness, angles.
    pub rod: Rod,
    /// Places of the nodes, m.
    pub x: Vec<f64>,
    /// Their velocities, m/s.
    pub v: Vec<f64>,
    /// Their accelerations, m/s^2.
    pub a: Vec<f64>,
    /// A unit vector across the first edge: the frame of the rod starts there.
    pub director: [f64; 3],
    /// Stiffness-proportional damping of the rod, s.
    pub damping: f64,
    /// The coupling nodes, from the entry to the tip: the last nodes of the needle.
    pub nodes: Vec<CouplingNode>,
}

/// A node that needle and tissue share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CouplingNode {
    /// The vertex of the tissue.
    pub vertex: u32,
    /// Its friction state.
    pub state: SlipState,
    /// Forces along the needle that it bears.
    pub limits: SlipLimits,
    /// Viscous friction, N s/m.
    pub drag: f64,
    /// Force along the needle on the tissue in the last step, N.
    pub force: f64,
    /// Whether the tissue is the same all around the needle there, so that a force along the needle ought to move it along the
    /// needle alone: no border of a region, nor skin that is not square to the needle.
    pub is_even: bool,
}

impl CouplingNode {
    /// A node that sticks and bears nothing yet.
    #[must_use]
    pub fn new(vertex: u32) -> Self {
        let limits = SlipLimits { dynamic: [0.0; 2], fixed: [0.0; 2] };
        Self { vertex, state: SlipState::Static, limits, drag: 0.0, force: 0.0, is_even: false }
    }
}

/// How the sleeve moves its two nodes during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SleeveMotion {
    /// Where the two nodes are at the end, m.
    pub place: [[f64; 3]; 2],
    /// Their velocity there, m/s.
    pub velocity: [f64; 3],
    /// How much of the needle it has pushed out, m, by which the rest length of the second edge has grown already; negative
    /// where it draws the needle in.
    pub fed: f64,
}

impl Shaft {
    /// Number of nodes.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.rod.n_nodes()
    }

    /// The first coupling node; the number of nodes where there is none.
    #[must_use]
    pub fn entry(&self) -> usize {
        self.n_nodes() - self.nodes.len()
    }

    /// Place of a node, m.
    #[must_use]
    pub fn place(&self, node: usize) -> [f64; 3] {
        triple(&self.x, node)
    }

    /// Where the tip is, m.
    #[must_use]
    pub fn tip(&self) -> [f64; 3] {
        self.place(self.n_nodes() - 1)
    }

    /// The unit tangent at a node, from base to tip: the normalised sum of the unit edges that meet there.
    #[must_use]
    pub fn tangent(&self, node: usize) -> [f64; 3] {
        let edge = |from: usize| unit(&difference(&self.place(from + 1), &self.place(from)));
        let last = self.n_nodes() - 1;
        if node == 0 {
            return edge(0);
        }
        if node == last {
            return edge(last - 1);
        }
        let (before, after) = (edge(node - 1), edge(node));
        unit(&std::array::from_fn(|k| before[k] + after[k]))
    }
}

/// Entries of a node.
#[inline]
#[must_use]
pub(crate) fn triple(v: &[f64], node: usize) -> [f64; 3] {
    [v[3 * node], v[3 * node + 1], v[3 * node + 2]]
}

pub(crate) fn set_triple(v: &mut [f64], node: usize, value: &[f64; 3]) {
    v[3 * node..3 * node + 3].copy_from_slice(value);
}

pub(crate) fn difference(p: &[f64; 3], q: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| p[k] - q[k])
}

pub(crate) fn inner(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

pub(crate) fn length(v: &[f64; 3]) -> f64 {
    inner(v, v).sqrt()
}

/// `v` scaled to length one; the zero vector as it is.
pub(crate) fn unit(v: &[f64; 3]) -> [f64; 3] {
    let length = length(v);
    if length > 0.0 { v.map(|x| x / length) } else { *v }
}
