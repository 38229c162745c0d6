//! Edges outside the tissue are kept neither too short nor too long.
//!
//! ```text
//!   sleeve         free nodes          tissue
//!   0======1------2--o--o------(e-1)---e####e+1###...### n-1 (tip)
//!          |<--- these edges are ----->|
//!               merged and split
//! ```

use super::error::ReparameteriseError;
use super::profile::distance;
use super::table::{check_finite, check_len};
use serde::{Deserialize, Serialize};

/// How many nodes may be made: more than any needle has.
const MOST_PARTS: f64 = 1e4;

/// Between which lengths edges outside the tissue are kept.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct EdgeLimits {
    /// Shorter edges are merged, m.
    shortest: f64,
    /// Longer edges are split, m.
    longest: f64,
}

impl EdgeLimits {
    /// Half the length of the shortest edge at the start, and four times that of the longest (m).
    ///
    /// # Errors
    /// [`ReparameteriseError::Limits`] if the lengths are not positive and finite, or the first is above the second.
    pub fn from_initial(shortest: f64, longest: f64) -> Result<Self, ReparameteriseError> {
        if shortest > 0.0 && shortest <= longest && 4.0 * longest < f64::INFINITY {
            Ok(Self { shortest: 0.5 * shortest, longest: 4.0 * longest })
        } else {
            Err(ReparameteriseError::Limits { shortest, longest })
        }
    }

    /// Edges below this length are merged, m.
    #[must_use]
    pub fn shortest(&self) -> f64 {
        self.shortest
    }

    /// Edges above this length are split, m.
    #[must_use]
    pub fn longest(&self) -> f64 {
        self.longest
    }
}

/// What was done.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct MergeSplitReport {
    /// Nodes deleted.
    pub merged: usize,
    /// Nodes made.
    pub split: usize,
    /// Nodes left between the end of the sleeve and the entry, or the tip.
    pub free: usize,
    /// Length of the edge from the sleeve to the entry, m, if it is too short and there is no node left to merge.
    pub too_short: Option<f64>,
}

/// Deletes and makes nodes between the end of the sleeve, node 1, and the entry into the tissue, and returns all positions,
/// `3 n` coordinates in m. The last `coupled` nodes are in the tissue, the entry first; if there are none, the tip is in its place.
///
/// Edges that are too short lose a free node: the one at the other end of the sleeve or the entry, or, between two free nodes, the
/// one whose other edge is the shorter. Then edges that are too long are split, as often as it takes, at the midpoint of a cubic
/// Hermite curve over the length of the edge; its direction at either end is that of the parabola through the end and its two
/// neighbours, parameterised by the lengths of the edges (Catmull-Rom with chordal knots), and at a tip that of the edge.
/// Parts are no longer than three quarters of the edge, so that this ends, and no shorter than a quarter, so that
/// none needs merging. Nodes 0 and 1, the entry, and the nodes in the tissue stay.
///
/// # Errors
/// If there are fewer than three nodes, or fewer than two outside the tissue, a coordinate or a length is not finite, or edges would be split
/// into more than 10,000 parts.
///
/// Source: Chentanez et al. (2009), section 3.4.2.
pub fn merge_and_split(
    positions: &[f64],
    coupled: usize,
    limits: &EdgeLimits,
) -> Result<(Vec<f64>, MergeSplitReport), ReparameteriseError> {
    let entry = check(positions, coupled)?;
    let mut outside = Outside { positions: positions.to_vec(), entry };
    let mut report = MergeSplitReport::default();
    while let Some(node) = outside.superfluous(limits.shortest) {
        outside.positions.drain(3 * node..3 * node + 3);
        outside.entry -= 1;
        report.merged += 1;
    }
    let mut edge = 1;
    while edge < outside.entry {
        let length = outside.length(edge);
        if length <= limits.longest {
            edge += 1;
            continue;
        }
        let parts = length / limits.longest;
        if parts > MOST_PARTS || report.split as f64 > MOST_PARTS {
            return Err(ReparameteriseError::TooLong { length, parts, most: MOST_PARTS });
        }
        let middle = outside.middle(edge);
        outside.positions.splice(3 * edge + 3..3 * edge + 3, middle);
        outside.entry += 1;
        report.split += 1;
    }
    report.free = outside.entry - 2;
    let first = outside.length(1);
    report.too_short = (report.free == 0 && first < limits.shortest).then_some(first);
    Ok((outside.positions, report))
}

/// The index of the entry.
fn check(positions: &[f64], coupled: usize) -> Result<usize, ReparameteriseError> {
    let nodes = positions.len() / 3;
    check_len("positions", positions, 3 * nodes)?;
    if nodes < 3 {
        return Err(ReparameteriseError::TooFew { what: "nodes of the needle", count: nodes, least: 3 });
    }
    if coupled > nodes - 2 {
        return Err(ReparameteriseError::Coupled { coupled, nodes, most: nodes - 2 });
    }
    check_finite("positions", positions)?;
    let lengths: Vec<f64> = (1..nodes).map(|i| distance(positions, i - 1, i)).collect();
    check_finite("lengths of the edges", &lengths)?;
    Ok(nodes - coupled.max(1))
}

struct Outside {
    positions: Vec<f64>,
    /// Index of the entry, at least 2.
    entry: usize,
}

impl Outside {
    /// Edge `i` joins the nodes `i` and `i + 1`.
    fn length(&self, edge: usize) -> f64 {
        distance(&self.positions, edge, edge + 1)
    }

    /// The free node to delete at the first edge that is too short.
    fn superfluous(&self, shortest: f64) -> Option<usize> {
        if self.entry == 2 {
            return None;
        }
        let edge = (1..self.entry).find(|&edge| self.length(edge) < shortest)?;
        if edge == 1 {
            return Some(2);
        }
        if edge + 1 == self.entry {
            return Some(edge);
        }
        Some(if self.length(edge - 1) <= self.length(edge + 1) { edge } else { edge + 1 })
    }

    /// Midpoint of the cubic: with the chord `h` and the directions `m` at its ends, the middle of the chord and
    /// `h (m_start − m_end) / 8`. The directions are at most of unit length, hence the bounds on the parts.
    fn middle(&self, edge: usize) -> [f64; 3] {
        let h = self.length(edge);
        let start = self.direction(edge, edge - 1);
        let end = if 3 * (edge + 2) < self.positions.len() { self.direction(edge, edge + 1) } else { self.chord(edge) };
        std::array::from_fn(|k| {
            let ends = [self.positions[3 * edge + k], self.positions[3 * edge + 3 + k]];
            0.5 * (ends[0] + ends[1]) + 0.125 * h * (start[k] - end[k])
        })
    }

    /// Direction at the node that two edges share, each weighted by the length of the other.
    fn direction(&self, edge: usize, other: usize) -> [f64; 3] {
        let (h, g) = (self.length(edge), self.length(other));
        let (own, beside) = (self.chord(edge), self.chord(other));
        if g == 0.0 {
            return own;
        }
        std::array::from_fn(|k| (g * own[k] + h * beside[k]) / (g + h))
    }

    /// Unit vector along an edge, zero if it has no length.
    fn chord(&self, edge: usize) -> [f64; 3] {
        let length = self.length(edge);
        let along = |k: usize| self.positions[3 * edge + 3 + k] - self.positions[3 * edge + k];
        std::array::from_fn(|k| if length > 0.0 { along(k) / length } else { 0.0 })
    }
}
