//! Straight rods along the first axis, and how they are held.

use stylet_physics::rod::{Rod, RodStiffness};
use stylet_solver::subspace::{Constraint, Subspace};

/// A first director for all of them.
pub const DIRECTOR: [f64; 3] = [0.0, 1.0, 0.0];

/// How an end is held.
#[derive(Clone, Copy, PartialEq)]
pub enum End {
    /// Not at all.
    Free,
    /// Across the axis.
    Pinned,
    /// Position across the axis and tangent. An edge has its tangent in its middle, so half of it lies in the clamp.
    Clamped,
}

/// A rod of length `l` between what holds its ends, of edges of equal length, in its straight position, the first end in the
/// origin.
pub struct Straight {
    pub rod: Rod,
    pub x: Vec<f64>,
    pub subspace: Subspace<3>,
    pub h: f64,
}

impl Straight {
    pub fn new(l: f64, n_edges: usize, ends: [End; 2], stiffness: RodStiffness) -> Self {
        let clamps = ends.iter().filter(|&&end| end == End::Clamped).count();
        let h = l / (n_edges as f64 - 0.5 * clamps as f64);
        let rod = Rod::new(vec![h; n_edges], stiffness, 1.0).unwrap();
        let first = if ends[0] == End::Clamped { -0.5 * h } else { 0.0 };
        let x = (0..=n_edges).flat_map(|i| [first + i as f64 * h, 0.0, 0.0]).collect();
        let mut subspace = Subspace::new(n_edges + 1);
        let axis = Constraint::Line([1.0, 0.0, 0.0]);
        let mut hold = |end: End, nodes: [usize; 2]| match end {
            End::Free => {}
            End::Pinned => subspace.set(nodes[0], axis).unwrap(),
            End::Clamped => nodes.iter().for_each(|&node| subspace.set(node, axis).unwrap()),
        };
        hold(ends[0], [0, 1]);
        hold(ends[1], [n_edges, n_edges - 1]);
        // Whatever the ends, the rod does not slide along its axis as a whole.
        match ends[0] {
            End::Free => subspace.set(0, Constraint::Plane([1.0, 0.0, 0.0])).unwrap(),
            _ => subspace.set(0, Constraint::Fixed).unwrap(),
        }
        Self { rod, x, subspace, h }
    }

    pub fn n_nodes(&self) -> usize {
        self.rod.n_nodes()
    }

    /// A cantilever whose first edge does not move at all.
    pub fn cantilever(l: f64, n_edges: usize, stiffness: RodStiffness) -> Self {
        let mut rod = Self::new(l, n_edges, [End::Clamped, End::Free], stiffness);
        rod.subspace.set(1, Constraint::Fixed).unwrap();
        rod
    }
}

/// Asserts that errors fall with the square of the number of edges, which doubles from one to the next.
#[track_caller]
pub fn assert_second_order(name: &str, errors: &[f64]) {
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("{name}: errors {errors:?}, orders {orders:?}");
    assert!(orders.iter().all(|o| (1.8..2.4).contains(o)), "{name}: errors {errors:?}, orders {orders:?}");
}
