//! The nodes on the needle: which ones they are, where they are along the shaft, and whether they stick or slip.

use crate::needle::{Needle, OnNeedle, along, cross3, dot, minus};
use crate::surface::Surface;
use crate::tip::deformed;
use serde::{Deserialize, Serialize};
use stylet_mesh::{SimplexMesh, VertexId};
use stylet_physics::friction::{FrictionState, Law, Limits, LineDensity, Observation, Verdict};

/// A node that breaks loose this often while the needle is at rest does not stick again before the needle moves on. An
/// overloaded needle comes to rest in at most some 150 cycles; only relaxation errors of a loose tolerance can make states
/// go in circles, and this ends those.
const MOST_LOOSENED: u16 = 200;

/// A node of the mesh that lies on the needle.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ShaftNode<const D: usize> {
    /// The mesh vertex.
    pub vertex: VertexId,
    /// Its place on the needle: kept while it sticks, followed while it slips.
    pub place: OnNeedle,
    /// Its distance behind the tip when the needle last moved, m.
    pub behind_before: f64,
    /// Whether it sticks.
    pub state: FrictionState,
    /// The friction that it carries while it slips, along the tangent, N.
    pub traction: f64,
    /// The force that the needle exerts on it, N.
    #[serde(with = "crate::array")]
    pub force: [f64; D],
    /// The length of the shaft that it stands for, m: see [`Surface`].
    pub share: f64,
    /// How often it has broken loose since the needle last moved.
    pub loosened: u16,
}

impl<const D: usize> ShaftNode<D> {
    /// Whether the node moves with the needle.
    pub fn sticks(&self) -> bool {
        self.state == FrictionState::Stick
    }
}

/// The needle nodes, ordered from the tip backwards, and those that the tip is about to pass.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Shaft<const D: usize> {
    /// The needle nodes.
    pub nodes: Vec<ShaftNode<D>>,
    /// Closest nodes of crossed facets, and nodes within the needle's radius, that are still ahead of the tip, which takes
    /// them when it has passed them.
    pub ahead: Vec<VertexId>,
    /// Nodes let go since the needle last moved. It does not take them back before it moves again: at rest a node next to
    /// the tip could otherwise be taken and let go for ever.
    pub let_go: Vec<VertexId>,
}

/// Friction along a shaft.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ShaftFriction {
    /// Dynamic friction per length, by distance behind the tip.
    pub density: LineDensity,
    /// Static over dynamic threshold.
    pub static_ratio: f64,
    /// When slipping nodes stick.
    pub law: Law,
    /// The surface that the friction acts on.
    pub surface: Surface,
}

/// The force that holds a needle at its base, N, and the moment about the base, N m; in the plane the moment has a third
/// component alone.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Hold<const D: usize> {
    /// Force, N.
    #[serde(with = "crate::array")]
    pub force: [f64; D],
    /// Moment, N m.
    pub moment: [f64; 3],
}

impl<const D: usize> Hold<D> {
    /// The components of the moment that there are: one in the plane, three in space.
    pub fn moment_components(&self) -> &[f64] {
        if D == 2 { &self.moment[2..] } else { &self.moment }
    }
}

impl<const D: usize> Default for Hold<D> {
    fn default() -> Self {
        Self { force: [0.0; D], moment: [0.0; 3] }
    }
}

impl<const D: usize> Shaft<D> {
    /// Whether a vertex is a needle node.
    pub fn contains(&self, vertex: VertexId) -> bool {
        self.nodes.iter().any(|node| node.vertex == vertex)
    }

    /// Takes a node onto the needle, where it sticks.
    pub fn capture(&mut self, vertex: VertexId, place: OnNeedle) {
        let at = self.nodes.partition_point(|node| node.place.behind < place.behind);
        let node = ShaftNode {
            vertex,
            place,
            behind_before: place.behind,
            state: FrictionState::Stick,
            traction: 0.0,
            force: [0.0; D],
            share: 0.0,
            loosened: 0,
        };
        self.nodes.insert(at, node);
    }

    /// Reads the places of slipping nodes off the deformed mesh, and restores the order along the shaft.
    pub fn follow_slip<const N: usize>(&mut self, needle: &Needle<D>, mesh: &SimplexMesh<D, N>, u: &[f64]) {
        for node in &mut self.nodes {
            if !node.sticks() {
                node.place.behind = needle.frame_of(deformed(mesh, u, node.vertex)).behind;
            }
        }
        self.sort();
    }

    /// Marks the present places as those from which sliding is measured: the needle is about to move.
    pub fn mark_places(&mut self) {
        self.let_go.clear();
        for node in &mut self.nodes {
            node.behind_before = node.place.behind;
            node.loosened = 0;
        }
    }

    /// Measures which part of the needle's surface belongs to each node where it is now.
    pub fn measure(&mut self, friction: &ShaftFriction) {
        friction.surface.share_out(&mut self.nodes);
    }

    /// The friction limits of node `index`, of the surface that was last measured.
    pub fn limits(&self, index: usize, friction: &ShaftFriction) -> Limits {
        let node = &self.nodes[index];
        let sliding = friction.density.at(node.place.behind) * node.share;
        Limits { sticking: friction.static_ratio * sliding, sliding }
    }

    /// Brings the friction of slipping nodes nearer to that of their present place, by the share `relaxation` of the way.
    pub fn renew_tractions(&mut self, friction: &ShaftFriction, relaxation: f64) {
        self.measure(friction);
        for index in 0..self.nodes.len() {
            if let FrictionState::Slip(direction) = self.nodes[index].state {
                let here = direction.sign() * self.limits(index, friction).sliding;
                let node = &mut self.nodes[index];
                node.traction =
                    if relaxation == 1.0 { here } else { node.traction + relaxation * (here - node.traction) };
            }
        }
    }

    /// How far the friction of slipping nodes is from that of their present place, and its sum, N.
    pub fn traction_drift(&mut self, friction: &ShaftFriction) -> (f64, f64) {
        self.measure(friction);
        let (mut drift, mut total) = (0.0, 0.0);
        for (index, node) in self.nodes.iter().enumerate() {
            if let FrictionState::Slip(direction) = node.state {
                let here = direction.sign() * self.limits(index, friction).sliding;
                drift += (here - node.traction).abs();
                total += here.abs();
            }
        }
        (drift, total)
    }

    /// Judges every node by its force (to be set beforehand) and changes the states that must change, all in one go.
    /// Returns how many changed.
    ///
    /// A node that sticks because the needle has turned round sticks where it is, or, with `turn_back`, where it was before
    /// the needle's last move, as if it had never slid the wrong way; `turned` receives those for the caller to put there.
    pub fn rearrange(
        &mut self,
        needle: &Needle<D>,
        friction: &ShaftFriction,
        turn_back: bool,
        turned: &mut Vec<VertexId>,
    ) -> usize {
        turned.clear();
        let tangent = needle.tangent();
        let mut changed = 0;
        // No verdict may influence another one: shares are measured before a node can be put back.
        self.measure(friction);
        for index in 0..self.nodes.len() {
            let limits = self.limits(index, friction);
            let node = &mut self.nodes[index];
            let seen = Observation { force: dot(node.force, tangent), sliding: node.place.behind - node.behind_before };
            let verdict = friction.law.judge(node.state, limits, seen);
            match verdict {
                Verdict::Keep => continue,
                // At rest, states must come to an end: a node that goes to and fro keeps slipping.
                Verdict::Hold | Verdict::Turn if node.loosened >= MOST_LOOSENED => continue,
                Verdict::Loosen(direction) => {
                    node.loosened = node.loosened.saturating_add(1);
                    node.state = FrictionState::Slip(direction);
                    node.traction = direction.sign() * limits.sliding;
                }
                Verdict::Hold => (node.state, node.traction) = (FrictionState::Stick, 0.0),
                Verdict::Turn => {
                    (node.state, node.traction) = (FrictionState::Stick, 0.0);
                    if turn_back {
                        node.place.behind = node.behind_before;
                        turned.push(node.vertex);
                    }
                }
            }
            changed += 1;
        }
        if !turned.is_empty() {
            self.sort();
        }
        changed
    }

    /// Orders the nodes from the tip backwards; they are nearly so already, and ties keep their order.
    fn sort(&mut self) {
        self.nodes.sort_by(|a, b| a.place.behind.total_cmp(&b.place.behind));
    }

    /// Force (N) and moment about the needle's base (N m) that hold the needle: the sum of what it exerts on its nodes. A
    /// slipping node bears its friction along the shaft, whatever the relaxation error of its elastic force.
    pub fn base_force(&self, needle: &Needle<D>) -> Hold<D> {
        let mut hold = Hold::default();
        for node in &self.nodes {
            let exerted = if node.sticks() {
                node.force
            } else {
                let t = needle.tangent();
                let across = |n| dot(node.force, n);
                let level = along(along([0.0; D], node.traction, t), across(needle.normal()), needle.normal());
                needle.upward().map_or(level, |up| along(level, across(up), up))
            };
            hold.force = along(hold.force, 1.0, exerted);
            let arm = minus(needle.point_at(node.place), needle.base());
            hold.moment = along(hold.moment, 1.0, cross3(arm, exerted));
        }
        hold
    }
}
