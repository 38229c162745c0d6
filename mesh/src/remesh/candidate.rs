//! Candidate operations, evaluated on paper: the cells that an operation would make are measured, the mesh is not
//! touched.
//!
//! The standard operations that place a node at `p`, in the cell `t`, are the nonempty subsets of the vertices of `t`: of
//! one vertex, it is snapped to `p`; of more, the face they span is split at `p`. That makes 15 operations for a
//! tetrahedron and 7 for a triangle.
//!
//! An operation kills some cells, of shapes `d`, and makes others, of shapes `c`. Comparing two operations by the sorted
//! shapes of a region that contains whatever either changes is comparing `c_1 + d_2` with `c_2 + d_1`, as sorted lists:
//! all other cells occur on both sides.
//!
//! Source: Chentanez et al., ACM Trans. Graph. 28 (2009), section 3.4.1.

use super::measure::shape;
use crate::{
    SimplexMesh,
    node::{NONE, is_interior},
};
use std::cmp::Ordering;

/// Below this shape, a normalised volume of 0.15, more than the paper's candidates are tried.
const POOR: f64 = 0.0225;

/// A live cell near the tip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near<const N: usize> {
    pub slot: u32,
    pub v: [u32; N],
    /// Which vertices of `t` it has.
    pub mask: u8,
    /// Which of its facets are on the boundary.
    pub boundary: u8,
    pub sign: f64,
    pub shape: f64,
}

/// How the node beside the new one may move.
#[derive(Clone, Copy, Debug)]
pub(super) enum Rule<const D: usize> {
    /// On the segment between the new node and this point.
    Segment([f64; D]),
    /// Anywhere.
    Free,
}

/// What the candidates of one round have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round<const D: usize> {
    /// Index of the needle among all.
    pub needle: usize,
    /// Where the node is to be.
    pub p: [f64; D],
    /// How many nodes of the needle stay; the last of these, if any, must be joined with the new one or be it.
    pub keep: usize,
    /// The vertex that is optimised afterwards.
    pub follower: Option<(u32, Rule<D>)>,
    /// How many splits on top of the stack have been undone.
    pub undone: usize,
}

/// An operation with what it does to the shapes of cells.
#[derive(Clone, Debug)]
pub(super) struct Candidate<const D: usize, const N: usize> {
    pub undone: usize,
    pub keep: usize,
    /// A cell that has the face, which is the first `len` entries of the next.
    pub cell: u32,
    pub face: [u32; N],
    pub len: usize,
    /// Number of cells around the face.
    pub n_cells: usize,
    /// Vertices that move besides.
    pub moves: Vec<(u32, [f64; D])>,
    pub made: Vec<f64>,
    pub killed: Vec<f64>,
}

impl<const D: usize, const N: usize> Default for Candidate<D, N> {
    fn default() -> Self {
        Self {
            undone: 0,
            keep: 0,
            cell: NONE,
            face: [NONE; N],
            len: 0,
            n_cells: 0,
            moves: Vec::new(),
            made: Vec::new(),
            killed: Vec::new(),
        }
    }
}

impl<const D: usize, const N: usize> Candidate<D, N> {
    pub fn exists(&self) -> bool {
        self.len > 0
    }

    /// Whether there is no candidate, or one with a cell of a quality below 0.15.
    pub fn is_poor(&self) -> bool {
        !self.exists() || self.worst() < POOR
    }

    pub fn face(&self) -> &[u32] {
        &self.face[..self.len]
    }

    /// Whether this operation, whose lists are sorted then, is better than the best so far, whose lists are sorted.
    pub fn wins_against(&mut self, best: &Self) -> bool {
        let least = |list: &[f64]| list.iter().fold(f64::INFINITY, |least: f64, &x| least.min(x));
        let first = |list: &[f64]| list.first().copied().unwrap_or(f64::INFINITY);
        if best.exists() && least(&self.made).min(first(&best.killed)) < first(&best.made).min(least(&self.killed)) {
            return false;
        }
        self.made.sort_unstable_by(f64::total_cmp);
        self.killed.sort_unstable_by(f64::total_cmp);
        !best.exists() || self.beats(best)
    }

    /// Whether this operation leaves the better cells; all lists are sorted.
    fn beats(&self, other: &Self) -> bool {
        let ours = merged(&self.made, &other.killed);
        let theirs = merged(&other.made, &self.killed);
        for (a, b) in ours.zip(theirs) {
            match a.total_cmp(&b) {
                Ordering::Equal => {}
                order => return order == Ordering::Greater,
            }
        }
        // All that both have is equal: fewer cells are better.
        self.made.len() + other.killed.len() < other.made.len() + self.killed.len()
    }

    pub fn worst(&self) -> f64 {
        self.made.first().copied().unwrap_or(f64::NEG_INFINITY)
    }
}

/// Two sorted lists as one.
fn merged<'a>(mut a: &'a [f64], mut b: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    std::iter::from_fn(move || {
        let from = match (a.first(), b.first()) {
            (Some(x), Some(y)) if y < x => &mut b,
            (Some(_), _) => &mut a,
            (None, _) => &mut b,
        };
        let (first, rest) = from.split_first()?;
        *from = rest;
        Some(*first)
    })
}

pub(super) fn near<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, slot: u32, t: &[u32]) -> Near<N> {
    let node = &mesh.nodes[slot as usize];
    let links = &mesh.nodes[slot as usize].links;
    let sign = if node.is_negative() { -1.0 } else { 1.0 };
    let (mut mask, mut boundary) = (0, 0);
    for i in 0..t.len() {
        mask |= u8::from(node.v.contains(&t[i])) << i;
    }
    for i in 0..N {
        boundary |= u8::from(!is_interior(links[i])) << i;
    }
    Near { slot, v: node.v, mask, boundary, sign, shape: shape(&mesh.corners_of(&node.v), sign) }
}
