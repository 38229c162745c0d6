//! How the surface of the needle is shared among the nodes on it.
//!
//! Friction is a traction on the surface of the shaft. The nodes of the mesh that stand for it are a jagged surface, whose
//! own area depends on the mesh and does not tend to that of the needle when the mesh is refined (Schwarz's lantern). So
//! it is the needle's cylinder that is shared out: each piece of it goes to the nodes around the piece, by their nearness.
//! The whole is then that of the cylinder on any mesh, a node that lies within a fine jagged surface bears nothing, and no
//! share jumps when nodes move. For a line of nodes on the axis what comes out is half the distance to each neighbour,
//! which is how a line is shared out without this.

use crate::needle::OnNeedle;
use crate::shaft::ShaftNode;
use serde::{Deserialize, Serialize};

/// Pieces of the cylinder around its axis.
const AROUND: usize = 8;
/// Rings of pieces per reach.
const RINGS_PER_REACH: f64 = 6.0;
/// No more rings than this, whatever the reach.
const MOST_RINGS: f64 = 20_000.0;

/// The surface of a needle's shaft.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Surface {
    /// Radius of the shaft, m; 0: a line.
    pub radius: f64,
    /// How far from a piece of the surface its nodes may be, m: the longest edge of the cells around the needle.
    pub reach: f64,
}

impl Surface {
    /// Sets the share of each node, m: the area that belongs to it over the circumference of the shaft. Nodes are ordered
    /// from the tip backwards; shares sum up to the length from the tip to the last of them, of a line from the first to the
    /// last.
    ///
    /// Source of the weights: Shepard, *A two-dimensional interpolation function for irregularly-spaced data*, Proc. 23rd
    /// ACM National Conference (1968), in their local form.
    pub fn share_out<const D: usize>(&self, nodes: &mut [ShaftNode<D>]) {
        if D == 2 || self.radius == 0.0 {
            return share_out_line(nodes);
        }
        nodes.iter_mut().for_each(|node| node.share = 0.0);
        let Some(length) = nodes.last().map(|last| last.place.behind.max(0.0)) else { return };
        let rings = (RINGS_PER_REACH * length / self.reach).ceil().clamp(1.0, MOST_RINGS);
        let directions: [(f64, f64); AROUND] = std::array::from_fn(|k| {
            let angle = std::f64::consts::TAU * (k as f64 + 0.5) / AROUND as f64;
            (self.radius * angle.cos(), self.radius * angle.sin())
        });
        let piece = length / rings / AROUND as f64;
        let mut window = 0..0;
        for ring in 0..rings as usize {
            let behind = length * (ring as f64 + 0.5) / rings;
            while nodes.get(window.start).is_some_and(|node| node.place.behind < behind - self.reach) {
                window.start += 1;
            }
            while nodes.get(window.end).is_some_and(|node| node.place.behind <= behind + self.reach) {
                window.end += 1;
            }
            for (perpendicular, above) in directions {
                self.share_piece(nodes, window.clone(), OnNeedle { behind, perpendicular, above }, piece);
            }
        }
    }

    /// Adds a piece of the surface to the nodes that it belongs to, `window` at most.
    fn share_piece<const D: usize>(
        &self,
        nodes: &mut [ShaftNode<D>],
        window: std::ops::Range<usize>,
        at: OnNeedle,
        piece: f64,
    ) {
        let weight = |node: &ShaftNode<D>| (1.0 - distance(&node.place, &at) / self.reach).max(0.0);
        let sum: f64 = nodes[window.clone()].iter().map(weight).sum();
        if sum > 0.0 {
            for node in &mut nodes[window] {
                node.share += piece * weight(node) / sum;
            }
            return;
        }
        // Where the needle has run away from its nodes: those next to the piece along the shaft, by how near they are.
        // Ahead of the first node it is that one's.
        let after = nodes.partition_point(|node| node.place.behind < at.behind).min(nodes.len() - 1);
        let before = after.saturating_sub(1);
        let gap = nodes[after].place.behind - nodes[before].place.behind;
        let part = if gap > 0.0 { (at.behind - nodes[before].place.behind) / gap } else { 0.5 };
        nodes[before].share += piece * (1.0 - part);
        nodes[after].share += piece * part;
    }
}

/// Half the distance to each neighbour along the shaft.
fn share_out_line<const D: usize>(nodes: &mut [ShaftNode<D>]) {
    for index in 0..nodes.len() {
        let behind = |k: usize| nodes[k].place.behind;
        let to_tip = if index > 0 { behind(index) - behind(index - 1) } else { 0.0 };
        let to_base = if index + 1 < nodes.len() { behind(index + 1) - behind(index) } else { 0.0 };
        nodes[index].share = 0.5 * (to_tip + to_base);
    }
}

fn distance(a: &OnNeedle, b: &OnNeedle) -> f64 {
    let (s, x, y) = (a.behind - b.behind, a.perpendicular - b.perpendicular, a.above - b.above);
    (s * s + x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shaft::Shaft;
    use stylet_mesh::VertexId;

    fn shaft(places: &[(f64, f64, f64)]) -> Shaft<3> {
        let mut shaft = Shaft::default();
        for (index, &(behind, perpendicular, above)) in places.iter().enumerate() {
            shaft.capture(VertexId::new(index), OnNeedle { behind, perpendicular, above });
        }
        shaft
    }

    fn total(shaft: &Shaft<3>) -> f64 {
        shaft.nodes.iter().map(|node| node.share).sum()
    }

    #[test]
    fn a_line_of_nodes_shares_by_half_distances_with_and_without_a_radius() {
        let places: Vec<(f64, f64, f64)> = (0..20).map(|k| (1.5e-3 * f64::from(k), 0.0, 0.0)).collect();
        for radius in [0.0, 1e-3] {
            let mut shaft = shaft(&places);
            Surface { radius, reach: 2.5e-3 }.share_out(&mut shaft.nodes);
            assert!((total(&shaft) - 28.5e-3).abs() < 1e-15);
            for (index, node) in shaft.nodes.iter().enumerate() {
                let expected = if index == 0 || index == 19 { 0.75e-3 } else { 1.5e-3 };
                assert!((node.share - expected).abs() < 0.12 * expected, "{index}: {} at radius {radius}", node.share);
            }
        }
    }

    #[test]
    fn nodes_around_the_needle_share_alike_and_those_deep_within_bear_nothing() {
        let (radius, h) = (1e-3, 0.5e-3);
        let ring = |k: i32| {
            (0..8).map(move |i| {
                let angle = std::f64::consts::TAU * f64::from(i) / 8.0;
                (h * f64::from(k), radius * angle.cos(), radius * angle.sin())
            })
        };
        let mut places: Vec<(f64, f64, f64)> = (0..12).flat_map(ring).collect();
        places.extend((0..11).map(|k| (h * (f64::from(k) + 0.5), 0.0, 0.0)));
        let mut shaft = shaft(&places);
        Surface { radius, reach: 0.9e-3 }.share_out(&mut shaft.nodes);
        assert!((total(&shaft) - 5.5e-3).abs() < 1e-15);
        let inner = |node: &&ShaftNode<3>| node.place.behind > 1e-3 && node.place.behind < 4.5e-3;
        for node in shaft.nodes.iter().filter(inner) {
            let expected = if node.place.from_axis() > 0.0 { h / 8.0 } else { 0.0 };
            assert!((node.share - expected).abs() < 0.02 * h / 8.0, "{node:?}");
        }
    }

    #[test]
    fn shares_follow_moving_nodes_without_jumps_and_always_sum_up() {
        let surface = Surface { radius: 1e-3, reach: 2e-3 };
        let shares = |shift: f64| {
            let places =
                [(0.0, 0.0, 0.0), (1e-3 + shift, 5e-4, 0.0), (2e-3, 0.0, -4e-4), (9e-3, 4e-3, 0.0), (9.5e-3, 0.0, 0.0)];
            let mut shaft = shaft(&places);
            surface.share_out(&mut shaft.nodes);
            assert!((total(&shaft) - 9.5e-3).abs() < 1e-15);
            shaft.nodes.iter().map(|node| node.share).collect::<Vec<_>>()
        };
        let mut before = shares(0.0);
        for k in 1..=200 {
            let now = shares(1e-6 * f64::from(k));
            assert!(before.iter().zip(&now).all(|(a, b)| (a - b).abs() < 2e-6), "{before:?} {now:?}");
            before = now;
        }
        let mut one = shaft(&[(9e-3, 0.0, 0.0)]);
        surface.share_out(&mut one.nodes);
        assert!((one.nodes[0].share - 9e-3).abs() < 1e-15, "a node alone bears all from the tip on");
    }
}
