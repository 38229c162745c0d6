//! Many points in one mesh: a copy of the bisection forest that has what a descent reads, and nothing else.
//!
//! A descent waits for memory. In a mesh of half a million triangles a node has 32 bytes, and below the first 15 levels
//! each of them comes from far away. What a descent asks of a node is where its children are, whether they are leaves,
//! and, on a tie, who wins: 4 bytes.

use super::{Location, descent, is_finite};
use crate::{CellId, SimplexMesh};

// The word of a bisected node is the place of the first of its two children, the second comes next; or
/// the slot of the first, if both are leaves;
const LEAF: u32 = 1 << 31;
/// the place in a table where the two are, if one is a leaf and the other is not.
const MIXED: u32 = 1 << 30;
/// A point in the middle belongs to the second child.
const SECOND_WINS: u32 = 1 << 29;
/// Slots and places are below.
const PAYLOAD: u32 = SECOND_WINS - 1;

/// Finds points in a mesh that does not change meanwhile, several times faster than [`SimplexMesh::locate`] in a large
/// mesh. Made by [`SimplexMesh::locator`] in time proportional to the number of cells, at some 4 bytes per cell.
#[derive(Clone, Debug)]
pub struct Locator<'a, const D: usize, const N: usize> {
    mesh: &'a SimplexMesh<D, N>,
    /// By start cell: its place, or `LEAF` and its slot.
    roots: Vec<u32>,
    /// A word for each bisected node, level by level.
    words: Vec<u32>,
    /// The children, in the form of `roots`, of nodes with a leaf and another node.
    mixed: Vec<[u32; 2]>,
    /// For the first of the words, those of the first cycle: which coordinate, in the order in which bisection makes a
    /// child, comes at which place.
    orders: Vec<[[u8; N]; 2]>,
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// A helper that finds points faster; worth it from about one point for every thirty cells on.
    pub fn locator(&self) -> Locator<'_, D, N> {
        Locator::new(self)
    }

    /// [`locate`](Self::locate) of each point.
    pub fn locate_many(&self, points: &[[f64; D]]) -> Vec<Option<Location<N>>> {
        if points.len() < self.n_cells() / 32 {
            return points.iter().map(|&p| self.locate(p)).collect();
        }
        let locator = self.locator();
        points.iter().map(|&p| locator.locate(p)).collect()
    }
}

impl<'a, const D: usize, const N: usize> Locator<'a, D, N> {
    fn new(mesh: &'a SimplexMesh<D, N>) -> Self {
        let (roots, words, mixed, orders) = Default::default();
        let mut locator = Self { mesh, roots, words, mixed, orders };
        if mesh.is_moved() {
            return locator; // halves need not fill a node: the mesh is asked
        }
        // The slots of the bisected nodes, by place.
        let mut queue: Vec<u32> = Vec::with_capacity(mesh.n_cells());
        locator.words.reserve(mesh.n_cells());
        let is_leaf = |slot: u32| mesh.nodes[slot as usize].is_leaf();
        let enter = |queue: &mut Vec<u32>, slot: u32| {
            if is_leaf(slot) {
                return LEAF | slot;
            }
            queue.push(slot);
            queue.len() as u32 - 1
        };
        locator.roots = (0..mesh.n_macros as u32).map(|slot| enter(&mut queue, slot)).collect();
        while let Some(&slot) = queue.get(locator.words.len()) {
            let node = &mesh.nodes[slot as usize];
            let child = node.child();
            let children = [enter(&mut queue, child), enter(&mut queue, child + 1)];
            let word = if is_leaf(child) == is_leaf(child + 1) {
                children[0]
            } else {
                locator.mixed.push(children);
                MIXED | (locator.mixed.len() as u32 - 1)
            };
            let tie = if descent::second_wins(node, node.tag()) { SECOND_WINS } else { 0 };
            locator.words.push(word | tie);
            if descent::is_reordered::<N>(node.tag(), node.level()) {
                locator.orders.push([0, 1].map(|second| {
                    let made = descent::made_order(node, &mesh.nodes[child as usize + second], second == 1);
                    made.map(|place| place as u8)
                }));
            }
        }
        locator
    }

    /// As [`SimplexMesh::locate`].
    pub fn locate(&self, p: [f64; D]) -> Option<Location<N>> {
        if self.mesh.is_moved() {
            return self.mesh.locate(p);
        }
        if !is_finite(&p) {
            return None;
        }
        let (root, barycentric) = self.mesh.locate_start(&p)?;
        let mut at = (self.roots[root as usize], barycentric);
        loop {
            // As in `SimplexMesh::descend`.
            let leaf = self.step::<7>(&mut at)
                || self.step::<6>(&mut at)
                || self.step::<5>(&mut at)
                || self.step::<4>(&mut at)
                || self.step::<3>(&mut at)
                || self.step::<2>(&mut at)
                || self.step::<1>(&mut at);
            if leaf {
                return Some(Location { cell: CellId(at.0 & PAYLOAD), barycentric: at.1 });
            }
        }
    }

    /// Goes down one level, from a node with tag `K`; returns whether it is a leaf.
    #[inline(always)]
    fn step<const K: usize>(&self, (at, lambda): &mut (u32, [f64; N])) -> bool {
        if K >= N {
            return false;
        }
        if *at & LEAF != 0 {
            return true;
        }
        let place = *at as usize;
        let word = self.words[place];
        let second = descent::is_second(lambda, K, || word & SECOND_WINS != 0);
        *at = if word & MIXED == 0 {
            (word & (LEAF | PAYLOAD)) + u32::from(second)
        } else {
            self.mixed[(word & PAYLOAD) as usize][usize::from(second)]
        };
        *lambda = descent::halve(lambda, K, second);
        if K > 2 && place < self.orders.len() {
            let order = &self.orders[place][usize::from(second)];
            let made = *lambda;
            *lambda = std::array::from_fn(|i| made[order[i] as usize]);
        }
        false
    }
}
