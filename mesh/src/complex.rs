//! The simplicial complex: vertices, the bisection forest, and the neighbours of its leaves.

use crate::{CellId, VertexId, bounds::BoundingTree, geometry, state::MeshState};
use serde::{Deserialize, Serialize};

/// No cell, no child, no neighbour.
pub(crate) const NONE: u32 = u32::MAX;
/// A link to a neighbour is its slot shifted by this, plus the local index of the common facet there.
pub(crate) const FACET_BITS: u32 = 3;
/// Slots that a link can name.
pub(crate) const MAX_SLOTS: usize = (1 << (32 - FACET_BITS)) - 1;
/// Slots that a mesh may grow to unless told otherwise: some 5 GB in 3D.
const DEFAULT_SLOT_LIMIT: usize = 1 << 26;

/// The link to facet `facet` of the cell in `slot`.
#[inline]
pub(crate) fn link(slot: u32, facet: usize) -> u32 {
    slot << FACET_BITS | facet as u32
}

/// The slot and the local facet that a link names.
#[inline]
pub(crate) fn unlink(link: u32) -> (usize, usize) {
    ((link >> FACET_BITS) as usize, (link & ((1 << FACET_BITS) - 1)) as usize)
}

/// A node of the bisection forest; a leaf is a live cell.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Node<const N: usize> {
    /// The vertices in Maubach order: the refinement edge is `(v[0], v[tag])`.
    pub v: [u32; N],
    /// The node that was bisected into this one, `NONE` for a cell of the start mesh.
    pub parent: u32,
    /// The first child, the second is the next slot; `NONE` for a leaf.
    pub child: u32,
    pub region: u32,
    /// Number of bisections since the start mesh.
    pub level: u16,
    /// Maubach's tag, `1..=N - 1`.
    pub tag: u8,
    /// Whether the order `v` is of negative orientation.
    pub negative: bool,
    /// Scratch of the patch search, false between calls.
    pub visited: bool,
}

/// Simplices with `N` vertices in `D` dimensions, refined by bisection: `<2, 3>` triangles, `<3, 4>` tetrahedra,
/// `<3, 3>` a surface, `<3, 2>` a rod.
///
/// A cell is a leaf of the bisection forest; its [`CellId`] is a slot that no other cell takes over while it is alive.
/// Vertices are never removed. All lengths are those of the coordinates given (rest coordinates, in metres in a scene).
///
/// Accessors that take a [`CellId`] or a [`VertexId`] panic, as indexing does, on an identifier that this mesh never
/// handed out. A cell that was bisected keeps its vertices and region but has no neighbours.
///
/// Serialised as start mesh and history; what is read back has the same identifiers and the same bits.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "MeshState", into = "MeshState")]
pub struct SimplexMesh<const D: usize, const N: usize> {
    pub(crate) points: Vec<[f64; D]>,
    /// The ends of the edge that a vertex halves; itself twice for a vertex of the start mesh.
    pub(crate) parents: Vec<[u32; 2]>,
    pub(crate) generations: Vec<u16>,
    /// Where vertices would be had none been moved; empty as long as none was.
    pub(crate) reference: Vec<[f64; D]>,
    /// A bound of the distance between a vertex and its reference position.
    pub(crate) farthest_move: f64,
    /// A live cell at each vertex, where the search for its star begins.
    pub(crate) vertex_leaf: Vec<u32>,
    pub(crate) nodes: Vec<Node<N>>,
    /// Links across the facet opposite each vertex; meaningful for leaves, `NONE` otherwise and on the boundary.
    pub(crate) links: Vec<[u32; N]>,
    /// Cells of the start mesh: the first slots.
    pub(crate) n_macros: usize,
    pub(crate) n_live: usize,
    pub(crate) slot_limit: usize,
    /// Finds the cells of the start mesh near a point.
    pub(crate) macro_tree: BoundingTree<D>,
    /// The cells around the edge that is being bisected, and the stack of the closure; empty between calls.
    pub(crate) patch: Vec<u32>,
    pub(crate) stack: Vec<u32>,
    /// Cells that the running operation bisected and that were alive before it.
    pub(crate) died: Vec<CellId>,
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// Fails the build for a simplex that cannot exist, or whose facets do not fit into the bits of a link.
    pub(crate) const VALID: () = assert!(
        2 <= N && N <= D + 1 && N <= 1 << FACET_BITS,
        "a simplex in D dimensions has 2 to D + 1 vertices, and at most 8"
    );

    /// The mesh with vertices and without cells, to be filled.
    pub(crate) fn with_points(points: Vec<[f64; D]>) -> Self {
        let n = points.len();
        Self {
            points,
            parents: (0..n as u32).map(|v| [v, v]).collect(),
            generations: vec![0; n],
            reference: Vec::new(),
            farthest_move: 0.0,
            vertex_leaf: vec![NONE; n],
            nodes: Vec::new(),
            links: Vec::new(),
            n_macros: 0,
            n_live: 0,
            slot_limit: DEFAULT_SLOT_LIMIT,
            macro_tree: BoundingTree::default(),
            patch: Vec::new(),
            stack: Vec::new(),
            died: Vec::new(),
        }
    }

    /// Number of vertices; vertex ids are below it.
    pub fn n_vertices(&self) -> usize {
        self.points.len()
    }

    /// Number of live cells.
    pub fn n_cells(&self) -> usize {
        self.n_live
    }

    /// Number of slots: cell ids are below it. An array with one entry per cell has this length.
    pub fn n_slots(&self) -> usize {
        self.nodes.len()
    }

    /// The most slots that the mesh may grow to before refinement returns an error.
    pub fn slot_limit(&self) -> usize {
        self.slot_limit
    }

    /// Sets the most slots that the mesh may grow to; a slot takes some 60 bytes in 3D, and a mesh has about two per
    /// live cell. Values beyond what identifiers can count are lowered to that.
    pub fn set_slot_limit(&mut self, limit: usize) {
        self.slot_limit = limit.min(MAX_SLOTS);
    }

    /// The rest coordinates, by vertex id.
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// The rest coordinates of vertex `v`.
    pub fn point(&self, v: VertexId) -> [f64; D] {
        self.points[v.index()]
    }

    /// The live cells, ascending.
    pub fn cells(&self) -> impl Iterator<Item = CellId> + '_ {
        let leaves = self.nodes.iter().enumerate().filter(|(_, node)| node.child == NONE);
        leaves.map(|(slot, _)| CellId(slot as u32))
    }

    /// Whether `c` is a live cell; false for a slot that does not exist.
    pub fn is_live(&self, c: CellId) -> bool {
        self.nodes.get(c.index()).is_some_and(|node| node.child == NONE)
    }

    /// The vertices of `c` in Maubach order: that of [`corners`](Self::corners), [`neighbor`](Self::neighbor) and
    /// [`Location`](crate::Location). It may be of either orientation.
    #[inline]
    pub fn cell(&self, c: CellId) -> [VertexId; N] {
        self.nodes[c.index()].v.map(VertexId)
    }

    /// The vertices of `c` in an order of positive volume for `N = D + 1`, and of the orientation that its start cell
    /// was given in for `N < D + 1`.
    #[inline]
    pub fn oriented(&self, c: CellId) -> [VertexId; N] {
        let mut v = self.cell(c);
        if self.nodes[c.index()].negative {
            v.swap(0, 1);
        }
        v
    }

    /// The orientation, 1 or -1, of the order [`cell`](Self::cell): the sign of its volume for `N = D + 1`, whether it
    /// agrees with the order in which its start cell was given for `N < D + 1`.
    pub fn orientation(&self, c: CellId) -> i8 {
        if self.nodes[c.index()].negative { -1 } else { 1 }
    }

    /// The coordinates of the vertices of `c`, in the order of [`cell`](Self::cell).
    #[inline]
    pub fn corners(&self, c: CellId) -> [[f64; D]; N] {
        self.corners_of(&self.nodes[c.index()].v)
    }

    #[inline]
    pub(crate) fn corners_of(&self, v: &[u32; N]) -> [[f64; D]; N] {
        std::array::from_fn(|i| self.points[v[i] as usize])
    }

    /// The region of `c`, inherited from its start cell.
    pub fn region(&self, c: CellId) -> u32 {
        self.nodes[c.index()].region
    }

    /// The volume of `c`, positive; length or area of a cell with fewer vertices.
    pub fn volume(&self, c: CellId) -> f64 {
        geometry::signed_measure(&self.corners(c)).abs()
    }

    /// The sum of the volumes of the live cells.
    pub fn total_volume(&self) -> f64 {
        self.cells().map(|c| self.volume(c)).sum()
    }

    /// The longest edge of `c`.
    pub fn longest_edge(&self, c: CellId) -> f64 {
        geometry::longest_edge2(&self.corners(c)).sqrt()
    }

    /// Number of bisections between the start mesh and `c`.
    pub fn level(&self, c: CellId) -> u16 {
        self.nodes[c.index()].level
    }

    /// The edge that a bisection of `c` halves.
    pub fn refinement_edge(&self, c: CellId) -> [VertexId; 2] {
        let node = &self.nodes[c.index()];
        [VertexId(node.v[0]), VertexId(node.v[node.tag as usize])]
    }

    /// The cell that was bisected into `c`; `None` for a cell of the start mesh.
    pub fn parent(&self, c: CellId) -> Option<CellId> {
        let parent = self.nodes[c.index()].parent;
        (parent != NONE).then_some(CellId(parent))
    }

    /// The two halves of `c`; `None` while it is alive.
    pub fn children(&self, c: CellId) -> Option<[CellId; 2]> {
        let child = self.nodes[c.index()].child;
        (child != NONE).then(|| [CellId(child), CellId(child + 1)])
    }

    /// The live cell across the facet opposite local vertex `facet` of `c`; `None` on the boundary.
    ///
    /// # Panics
    /// If `facet` is not below `N`.
    #[inline]
    pub fn neighbor(&self, c: CellId, facet: usize) -> Option<CellId> {
        let link = self.links[c.index()][facet];
        (link != NONE).then(|| CellId(unlink(link).0 as u32))
    }

    /// Overwrites `out` with the live cells around vertex `v`, ascending.
    ///
    /// Found by a walk over the neighbours from one of them, so that the cost depends on their number alone.
    pub fn star(&self, v: VertexId, out: &mut Vec<CellId>) {
        out.clear();
        out.push(CellId(self.vertex_leaf[v.index()]));
        let mut next = 0;
        while next < out.len() {
            let slot = out[next].index();
            next += 1;
            for facet in 0..N {
                let link = self.links[slot][facet];
                if self.nodes[slot].v[facet] == v.0 || link == NONE {
                    continue;
                }
                let neighbor = CellId(unlink(link).0 as u32);
                // A star is short, and its latest cells are the likeliest to be met again.
                if !out.iter().rev().any(|&c| c == neighbor) {
                    out.push(neighbor);
                }
            }
        }
        out.sort_unstable();
    }

    /// The facets with a cell on one side only, as a live cell and the local index of the vertex opposite; by cell,
    /// ascending.
    pub fn boundary_facets(&self) -> impl Iterator<Item = (CellId, usize)> + '_ {
        let facets_of = |c: CellId| (0..N).map(move |facet| (c, facet));
        self.cells().flat_map(facets_of).filter(|&(c, facet)| self.links[c.index()][facet] == NONE)
    }

    /// The ends of the edge that vertex `v` halves; `None` for a vertex of the start mesh.
    pub fn parents(&self, v: VertexId) -> Option<[VertexId; 2]> {
        let parents = self.parents[v.index()];
        (parents != [v.0; 2]).then(|| parents.map(VertexId))
    }

    /// The generation of vertex `v`: 0 in the start mesh, otherwise one more than the greatest among the vertices of
    /// the cells that were bisected to make it. Vertices of one generation never share a cell.
    pub fn generation(&self, v: VertexId) -> u16 {
        self.generations[v.index()]
    }
}
