//! A hierarchy of boxes around triangles.

use crate::bounds::Bounds;

/// Triangles in a leaf, at most.
const LEAF: usize = 4;

/// A box, and what it holds.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub low: [f64; 3],
    pub high: [f64; 3],
    /// First triangle of a leaf; of others the second child, the first being the next node.
    pub first: u32,
    /// Triangles of a leaf; zero otherwise.
    pub count: u32,
}

impl Node {
    /// The squared distance of a point from the box.
    #[inline]
    pub fn distance2(&self, p: &[f64; 3]) -> f64 {
        (0..3).map(|k| (self.low[k] - p[k]).max(p[k] - self.high[k]).max(0.0).powi(2)).sum()
    }

    /// Whether another box, as lowest and highest corner, has a point in common.
    #[inline]
    pub fn meets(&self, low: &[f64; 3], high: &[f64; 3]) -> bool {
        (0..3).all(|k| self.low[k] <= high[k] && low[k] <= self.high[k])
    }
}

/// Nodes with children behind their parents; the first is the root.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
}

impl Tree {
    /// The hierarchy of at least one triangle, and the order in which its leaves hold them.
    pub fn new(triangles: &[[[f64; 3]; 3]]) -> (Self, Vec<u32>) {
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut nodes = Vec::with_capacity(triangles.len());
        let centre = |t: u32| std::array::from_fn(|k| triangles[t as usize].iter().map(|p| p[k]).sum::<f64>());
        let centres: Vec<[f64; 3]> = order.iter().map(|&t| centre(t)).collect();
        build(&mut nodes, &mut order, 0, triangles, &centres);
        (Self { nodes }, order)
    }

    /// The box around all.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        [self.nodes[0].low, self.nodes[0].high]
    }

    /// Calls back with the triangles of all leaves that a box meets.
    pub fn visit(&self, low: &[f64; 3], high: &[f64; 3], mut visit: impl FnMut(u32)) {
        let mut stack = vec![0_u32];
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if !node.meets(low, high) {
                continue;
            }
            if node.count > 0 {
                (node.first..node.first + node.count).for_each(&mut visit);
            } else {
                stack.extend([node.first, at + 1]);
            }
        }
    }
}

/// Adds the node of some triangles, `start` behind the first of all, and those below it: halves along the longest axis of
/// their centres, so that the depth is the logarithm of their number.
fn build(nodes: &mut Vec<Node>, order: &mut [u32], start: usize, all: &[[[f64; 3]; 3]], centres: &[[f64; 3]]) {
    let (mut bounds, mut spread) = (Bounds::<3>::EMPTY, Bounds::<3>::EMPTY);
    for &t in order.iter() {
        bounds.join(&Bounds::of(&all[t as usize], 0.0));
        spread.join(&Bounds::of(&[centres[t as usize]], 0.0));
    }
    let at = nodes.len();
    let is_leaf = order.len() <= LEAF;
    let count = if is_leaf { order.len() as u32 } else { 0 };
    nodes.push(Node { low: bounds.lower, high: bounds.upper, first: start as u32, count });
    if is_leaf {
        return;
    }
    let extent: [f64; 3] = std::array::from_fn(|k| spread.upper[k] - spread.lower[k]);
    let axis = (1..3).fold(0, |longest, k| if extent[k] > extent[longest] { k } else { longest });
    let middle = order.len() / 2;
    let by_centre = |s: &u32, t: &u32| centres[*s as usize][axis].total_cmp(&centres[*t as usize][axis]).then(s.cmp(t));
    order.select_nth_unstable_by(middle, by_centre);
    let (left, right) = order.split_at_mut(middle);
    build(nodes, left, start, all, centres);
    nodes[at].first = nodes.len() as u32;
    build(nodes, right, start + middle, all, centres);
}
