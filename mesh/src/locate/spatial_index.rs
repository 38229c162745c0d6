//! A search tree over the live cells of a mesh at given positions, that follows deformation and refinement.
//!
//! A binary tree of boxes with one cell per leaf. It is built balanced, by medians; a cell that is born is put beside the
//! leaf whose box grows least, and one that died is taken out together with its parent. When as much has changed as there
//! is, the tree is built anew, so that it stays shallow.
//!
//! Source: Catto, *Dynamic bounding volume hierarchies*, Game Developers Conference (2019).

use super::{
    Configuration, Crossing, LocateError, Location, Owner, Positions, Walk, configuration::barycentric, is_finite,
    segment,
};
use crate::{
    CellId, MeshChange,
    bounds::{BoundingTree, Bounds},
    node::NONE,
    search::{clip, steepest, touch_tolerance},
};

/// Boxes are grown by this part of their extent, so that rounding cannot lose a touching cell.
const MARGIN: f64 = 1e-9;

#[derive(Clone, Copy, Debug)]
struct BoxNode<const D: usize> {
    bounds: Bounds<D>,
    parent: u32,
    /// The children; of a leaf `NONE` and the cell.
    below: [u32; 2],
}

/// Finds the live cells of a mesh that are near a point, a segment or a box, with the vertices at any positions: moved
/// ones, deformed ones, inverted cells among them.
///
/// It belongs to one mesh: after each change of that mesh call [`update`](Self::update), after a deformation
/// [`refit`](Self::refit), before asking again. A cell that it was not told of is not found; one that is gone is passed
/// over. Some 100 bytes per cell in the plane, 130 in space.
#[derive(Clone, Debug)]
pub struct SpatialIndex<const D: usize> {
    nodes: Vec<BoxNode<D>>,
    root: u32,
    /// The leaf of a cell, by slot; `NONE` if there is none.
    leaf_of: Vec<u32>,
    free: Vec<u32>,
    n_cells: usize,
    /// Insertions and removals since the tree was built.
    n_changes: usize,
}

impl<const D: usize> SpatialIndex<D> {
    /// The index of the live cells: `O(n log n)`.
    ///
    /// # Errors
    /// [`LocateError::Coordinate`] for a position that is not finite.
    pub fn new<const N: usize>(
        body: &Configuration<'_, D, N, impl Positions<D> + ?Sized>,
    ) -> Result<Self, LocateError> {
        let cells: Vec<CellId> = body.mesh.cells().collect();
        let boxes = cells.iter().map(|&c| bounds_of(body, c)).collect::<Result<Vec<_>, _>>()?;
        let (_, order) = BoundingTree::new(&boxes);
        let mut index = Self {
            nodes: Vec::with_capacity(2 * cells.len()),
            root: NONE,
            leaf_of: vec![NONE; body.mesh.n_slots()],
            free: Vec::new(),
            n_cells: cells.len(),
            n_changes: 0,
        };
        if !order.is_empty() {
            index.root = index.balanced(&order, &|item| (cells[item as usize], boxes[item as usize]));
        }
        Ok(index)
    }

    /// The subtree over some items in an order in which near ones are together.
    fn balanced(&mut self, items: &[u32], item: &impl Fn(u32) -> (CellId, Bounds<D>)) -> u32 {
        if let [only] = items {
            let (cell, bounds) = item(*only);
            self.leaf_of[cell.index()] = self.nodes.len() as u32;
            return self.push(BoxNode { bounds, parent: NONE, below: [NONE, cell.0] });
        }
        let node = self.push(BoxNode { bounds: Bounds::EMPTY, parent: NONE, below: [NONE; 2] });
        let (low, high) = items.split_at(items.len() / 2);
        let below = [self.balanced(low, item), self.balanced(high, item)];
        self.nodes[node as usize].below = below;
        below.iter().for_each(|&child| self.nodes[child as usize].parent = node);
        self.nodes[node as usize].bounds = self.joined(below);
        node
    }

    /// The cells that are in the index.
    pub fn n_cells(&self) -> usize {
        self.n_cells
    }

    /// Puts all cells where the vertices are now, in time proportional to their number. The shape of the tree stays: after
    /// deformations that bring far cells together, one built anew searches faster.
    ///
    /// # Errors
    /// [`LocateError::Coordinate`] for a position that is not finite; the index is then that of some cells at their
    /// earlier positions.
    pub fn refit<const N: usize>(
        &mut self,
        body: &Configuration<'_, D, N, impl Positions<D> + ?Sized>,
    ) -> Result<(), LocateError> {
        for slot in 0..self.leaf_of.len() {
            let (cell, leaf) = (CellId(slot as u32), self.leaf_of[slot]);
            if leaf != NONE && body.mesh.is_live(cell) {
                self.nodes[leaf as usize].bounds = bounds_of(body, cell)?;
            }
        }
        // Parents after their children: a pre-order list, backwards.
        let (mut order, mut stack) = (Vec::with_capacity(self.nodes.len() / 2), Vec::new());
        stack.extend((self.root != NONE).then_some(self.root));
        while let Some(at) = stack.pop() {
            if !self.is_leaf(at) {
                order.push(at);
                stack.extend(self.nodes[at as usize].below);
            }
        }
        for at in order.into_iter().rev() {
            self.nodes[at as usize].bounds = self.joined(self.nodes[at as usize].below);
        }
        Ok(())
    }

    /// Takes out the cells that died and puts in those that were born, in time proportional to their number (times the
    /// depth of the tree; averaged over many updates). All others stay where they were.
    ///
    /// # Errors
    /// [`LocateError::Coordinate`] for a position of a new cell that is not finite; that cell and later ones are then not
    /// in the index.
    pub fn update<const N: usize>(
        &mut self,
        body: &Configuration<'_, D, N, impl Positions<D> + ?Sized>,
        change: &MeshChange,
    ) -> Result<(), LocateError> {
        self.leaf_of.resize(body.mesh.n_slots().max(self.leaf_of.len()), NONE);
        for &cell in &change.died {
            self.remove(cell);
        }
        for &cell in change.born.iter().filter(|&&cell| body.mesh.is_live(cell)) {
            let bounds = bounds_of(body, cell)?;
            self.remove(cell);
            self.insert(cell, bounds);
        }
        self.n_changes += change.died.len() + change.born.len();
        if self.n_changes > 64 + 2 * self.n_cells {
            *self = Self::new(body)?;
        }
        Ok(())
    }

    /// The live cell that contains `p`, of several the one of smallest id; `None` outside, and if `p` is not finite.
    /// Closed, as [`SimplexMesh::locate`](crate::SimplexMesh::locate).
    pub fn locate<const N: usize>(
        &self,
        body: &Configuration<'_, D, N, impl Positions<D> + ?Sized>,
        p: [f64; D],
    ) -> Option<Location<N>> {
        if !is_finite(&p) {
            return None;
        }
        let mut best = Owner::default();
        self.visit(
            |bounds| bounds.contains(&p),
            |cell| {
                if body.mesh.is_live(cell) {
                    let corners = body.corners(cell);
                    if let Some(lambda) = barycentric(&corners, &p) {
                        best.offer(cell.0, lambda, body.mesh.slack(cell.0), || corners, &p);
                    }
                }
            },
        );
        best.location()
    }

    /// As [`locate`](Self::locate), for a point that is near a cell: walks, and asks the tree where the walk does not
    /// arrive. In a configuration without inverted cells both find the same.
    pub fn locate_near<const N: usize>(
        &self,
        body: &Configuration<'_, D, N, impl Positions<D> + ?Sized>,
        near: CellId,
        p: [f64; D],
    ) -> Option<Location<N>> {
        match body.walk(near, p) {
            Walk::Found(location) => Some(location),
            _ => self.locate(body, p),
        }
    }

    /// Overwrites `out` with the live cells that the closed segment from `a` to `b` touches, as
    /// [`SimplexMesh::leaves_along`](crate::SimplexMesh::leaves_along) does.
    pub fn cells_along<const N: usize>(
        &self,
        body: &Configuration<'_, D, N, impl Positions<D> + ?Sized>,
        a: [f64; D],
        b: [f64; D],
        out: &mut Vec<Crossing>,
    ) {
        out.clear();
        if !segment::is_segment(&a, &b) {
            return;
        }
        let magnitude = a.iter().chain(&b).fold(0.0_f64, |m, x| m.max(x.abs()));
        let reach = 4.0 * f64::EPSILON * magnitude;
        self.visit(
            |bounds| bounds.meets(&a, &b, reach),
            |cell| {
                if body.mesh.is_live(cell) {
                    let corners = body.corners(cell);
                    // Deformed cells may be thin, and rounding of places a greater part of them.
                    let rounding = 16.0 * f64::EPSILON * magnitude * steepest(&corners);
                    let tolerance = touch_tolerance::<N>(body.mesh.level(cell)) + rounding.min(MARGIN);
                    let found = clip(&corners, &[a, b], tolerance);
                    out.extend(found.map(|(from, to, _)| Crossing { cell, from, to }));
                }
            },
        );
        segment::put_in_order(out);
    }

    /// Overwrites `out` with the cells whose bounding boxes meet the box from `lower` to `upper`, ascending.
    pub fn cells_in_box(&self, lower: [f64; D], upper: [f64; D], out: &mut Vec<CellId>) {
        out.clear();
        let window = Bounds { lower, upper };
        self.visit(|bounds| bounds.overlaps(&window), |cell| out.push(cell));
        out.sort_unstable();
    }

    /// Calls `found` with the cells whose boxes, and those above them, meet something; in no order to rely on.
    fn visit(&self, meets: impl Fn(&Bounds<D>) -> bool, mut found: impl FnMut(CellId)) {
        let mut stack = Vec::with_capacity(64);
        stack.extend((self.root != NONE).then_some(self.root));
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if !meets(&node.bounds) {
                continue;
            }
            match node.below {
                [NONE, cell] => found(CellId(cell)),
                below => stack.extend(below),
            }
        }
    }

    fn is_leaf(&self, at: u32) -> bool {
        self.nodes[at as usize].below[0] == NONE
    }

    fn joined(&self, [first, second]: [u32; 2]) -> Bounds<D> {
        let mut bounds = self.nodes[first as usize].bounds;
        bounds.join(&self.nodes[second as usize].bounds);
        bounds
    }

    fn push(&mut self, node: BoxNode<D>) -> u32 {
        match self.free.pop() {
            Some(at) => {
                self.nodes[at as usize] = node;
                at
            }
            None => {
                self.nodes.push(node);
                self.nodes.len() as u32 - 1
            }
        }
    }

    /// Puts a cell beside the leaf that is found by going, at every node, where the box grows least.
    fn insert(&mut self, cell: CellId, bounds: Bounds<D>) {
        self.n_cells += 1;
        let leaf = self.push(BoxNode { bounds, parent: NONE, below: [NONE, cell.0] });
        self.leaf_of[cell.index()] = leaf;
        if self.root == NONE {
            self.root = leaf;
            return;
        }
        let mut sibling = self.root;
        while !self.is_leaf(sibling) {
            let growth = |child: u32| {
                let old = &self.nodes[child as usize].bounds;
                let mut grown = *old;
                grown.join(&bounds);
                grown.extent() - old.extent()
            };
            let [first, second] = self.nodes[sibling as usize].below;
            sibling = if growth(second) < growth(first) { second } else { first };
        }
        let above = self.nodes[sibling as usize].parent;
        let parent = self.push(BoxNode { bounds: Bounds::EMPTY, parent: above, below: [sibling, leaf] });
        self.replace(above, sibling, parent);
        (self.nodes[sibling as usize].parent, self.nodes[leaf as usize].parent) = (parent, parent);
        self.fit_upwards(parent);
    }

    /// Takes out a cell, if it is in the index.
    fn remove(&mut self, cell: CellId) {
        let Some(leaf) = self.leaf_of.get_mut(cell.index()).map(|leaf| std::mem::replace(leaf, NONE)) else { return };
        if leaf == NONE {
            return;
        }
        self.n_cells -= 1;
        self.free.push(leaf);
        let parent = self.nodes[leaf as usize].parent;
        if parent == NONE {
            self.root = NONE;
            return;
        }
        let [first, second] = self.nodes[parent as usize].below;
        let sibling = if first == leaf { second } else { first };
        let above = self.nodes[parent as usize].parent;
        self.replace(above, parent, sibling);
        self.nodes[sibling as usize].parent = above;
        self.free.push(parent);
        self.fit_upwards(above);
    }

    /// Puts `new` in the place of the child `old` of a node, or of the root.
    fn replace(&mut self, parent: u32, old: u32, new: u32) {
        if parent == NONE {
            self.root = new;
            return;
        }
        let below = &mut self.nodes[parent as usize].below;
        below[usize::from(below[1] == old)] = new;
    }

    /// Fits the boxes from a node up to the root, as far as they change.
    fn fit_upwards(&mut self, mut at: u32) {
        while at != NONE {
            let bounds = self.joined(self.nodes[at as usize].below);
            let node = &mut self.nodes[at as usize];
            if node.bounds == bounds && node.parent != NONE {
                return;
            }
            node.bounds = bounds;
            at = node.parent;
        }
    }
}

/// The box of a cell, grown by what still counts as touching it.
fn bounds_of<const D: usize, const N: usize>(
    body: &Configuration<'_, D, N, impl Positions<D> + ?Sized>,
    cell: CellId,
) -> Result<Bounds<D>, LocateError> {
    let corners = body.corners(cell);
    for (corner, vertex) in corners.iter().zip(body.mesh.cell(cell)) {
        if let Some((axis, &value)) = corner.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            return Err(LocateError::Coordinate { vertex: vertex.0, axis, value });
        }
    }
    Ok(Bounds::of(&corners, MARGIN.max(2.0 * body.mesh.slack(cell.0))))
}
