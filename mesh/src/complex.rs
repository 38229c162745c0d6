//! The simplicial complex: vertices, the bisection forest, and the neighbours of its leaves.

use crate::{
    BoundaryError, CellId, Rule, VertexId, geometry,
    locate::StartIndex,
    node::{BOUNDARY, FACET_BITS, MAX_BOUNDARY_TAG, MAX_SLOTS, NONE, Node, is_interior, unlink},
    recorder::Recorder,
    remesh::cavity::Overlay,
    state::MeshState,
};
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Slots that a mesh may grow to unless told otherwise: some 3 GB in 3D.
const DEFAULT_SLOT_LIMIT: usize = 1 << 26;

/// Simplices with `N` vertices in `D` dimensions, refined by bisection: `<2, 3>` triangles, `<3, 4>` tetrahedra,
/// `<3, 3>` a surface, `<3, 2>` a rod.
///
/// A cell is a leaf of the bisection forest; its [`CellId`] is a slot that no other cell takes over while it is alive.
/// Bisection makes vertices and cells, coarsening removes them; slots and ids that it frees are handed out again, the
/// latest first. All lengths are those of the coordinates given (rest coordinates, in metres in a scene).
///
/// Accessors that take a [`CellId`] or a [`VertexId`] panic, as indexing does, on an identifier that this mesh never
/// handed out. A cell that was bisected keeps its vertices and region but has no neighbours; of a slot or vertex that was
/// freed, nothing is promised.
///
/// Serialised as it is; what is read back has the same identifiers and goes on with the same bits.
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
    /// A live cell at each vertex, where the search for its star begins; `NONE` for an id that is free.
    pub(crate) vertex_leaf: Vec<u32>,
    pub(crate) nodes: Vec<Node<N>>,
    /// The regions that nodes name by index.
    pub(crate) regions: Vec<u32>,
    /// Free pairs of slots, by their first slot, and free vertices; the last is the next to be taken.
    pub(crate) free_pairs: Vec<u32>,
    pub(crate) free_vertices: Vec<u32>,
    /// Cells of the start mesh: the first slots.
    pub(crate) n_macros: usize,
    pub(crate) rule: Rule,
    pub(crate) n_live: usize,
    pub(crate) slot_limit: usize,
    pub(crate) bisection_limit: usize,
    /// Finds the cells of the start mesh near a point; made when it is first needed.
    pub(crate) start_index: OnceLock<StartIndex<D, N>>,
    /// Scratch of operations; its lists are empty between calls.
    pub(crate) recorder: Recorder,
    /// What remeshing has added.
    pub(crate) overlay: Overlay,
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
            regions: Vec::new(),
            free_pairs: Vec::new(),
            free_vertices: Vec::new(),
            n_macros: 0,
            rule: Rule::LongestEdge,
            n_live: 0,
            slot_limit: DEFAULT_SLOT_LIMIT,
            bisection_limit: usize::MAX,
            start_index: OnceLock::new(),
            recorder: Recorder::default(),
            overlay: Overlay::default(),
        }
    }

    /// Number of vertices. Their ids are below [`n_vertex_slots`](Self::n_vertex_slots).
    pub fn n_vertices(&self) -> usize {
        self.points.len() - self.free_vertices.len()
    }

    /// Number of vertex ids in use or free: an array with one entry per vertex has this length.
    pub fn n_vertex_slots(&self) -> usize {
        self.points.len()
    }

    /// Whether `v` is a vertex; false for an id that coarsening freed, or that was never handed out.
    pub fn is_vertex(&self, v: VertexId) -> bool {
        self.vertex_leaf.get(v.index()).is_some_and(|&leaf| leaf != NONE)
    }

    /// The vertices, ascending.
    pub fn vertices(&self) -> impl Iterator<Item = VertexId> + '_ {
        let used = self.vertex_leaf.iter().enumerate().filter(|&(_, &leaf)| leaf != NONE);
        used.map(|(v, _)| VertexId(v as u32))
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

    /// Sets the most slots that the mesh may grow to; a slot takes 32 bytes in 2D and 40 in 3D, and a mesh has about two
    /// per live cell. Values beyond what identifiers can count are lowered to that.
    pub fn set_slot_limit(&mut self, limit: usize) {
        self.slot_limit = limit.min(MAX_SLOTS);
    }

    /// The most cells that one call may bisect before it returns an error.
    pub fn bisection_limit(&self) -> usize {
        self.bisection_limit
    }

    /// Sets the most cells that one call may bisect, for frames that must end in time: the cost of a call is the number
    /// of its bisections, of which a mark may demand many. Unlimited at first.
    pub fn set_bisection_limit(&mut self, limit: usize) {
        self.bisection_limit = limit;
    }

    /// The memory of all that the mesh holds: number of entries times size of an entry, over all arrays.
    pub fn bytes(&self) -> usize {
        fn size<T>(array: &[T]) -> usize {
            size_of_val(array)
        }
        let vertices = size(&self.points) + size(&self.parents) + size(&self.generations) + size(&self.vertex_leaf);
        let free = size(&self.free_pairs) + size(&self.free_vertices);
        vertices
            + size(&self.reference)
            + size(&self.nodes)
            + size(&self.regions)
            + free
            + self.start_index.get().map_or(0, StartIndex::bytes)
    }

    /// The rest coordinates, by vertex id; of an id that is free, those of the vertex that was removed.
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// The rest coordinates of vertex `v`.
    pub fn point(&self, v: VertexId) -> [f64; D] {
        self.points[v.index()]
    }

    /// The live cells, ascending.
    pub fn cells(&self) -> impl Iterator<Item = CellId> + Clone + '_ {
        let leaves = self.nodes.iter().enumerate().filter(|(_, node)| node.is_leaf());
        leaves.map(|(slot, _)| CellId(slot as u32))
    }

    /// Whether `c` is a live cell; false for a slot that does not exist.
    pub fn is_live(&self, c: CellId) -> bool {
        self.nodes.get(c.index()).is_some_and(|node| node.is_leaf())
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
        if self.nodes[c.index()].is_negative() {
            v.swap(0, 1);
        }
        v
    }

    /// The orientation, 1 or -1, of the order [`cell`](Self::cell): the sign of its volume for `N = D + 1`, whether it
    /// agrees with the order in which its start cell was given for `N < D + 1`.
    pub fn orientation(&self, c: CellId) -> i8 {
        if self.nodes[c.index()].is_negative() { -1 } else { 1 }
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
        self.regions[self.nodes[c.index()].region()]
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
        self.nodes[c.index()].level()
    }

    /// The edge that a bisection of `c` halves.
    pub fn refinement_edge(&self, c: CellId) -> [VertexId; 2] {
        let node = &self.nodes[c.index()];
        [VertexId(node.v[0]), VertexId(node.v[node.tag()])]
    }

    /// The cell that was bisected into `c`; `None` for a cell of the start mesh.
    pub fn parent(&self, c: CellId) -> Option<CellId> {
        let parent = self.nodes[c.index()].parent;
        (parent != NONE).then_some(CellId(parent))
    }

    /// The two halves of `c`; `None` while it is alive.
    pub fn children(&self, c: CellId) -> Option<[CellId; 2]> {
        let child = self.nodes[c.index()].child();
        (child != NONE).then(|| [CellId(child), CellId(child + 1)])
    }

    /// The live cell across the facet opposite local vertex `facet` of `c`; `None` on the boundary.
    ///
    /// # Panics
    /// If `facet` is not below `N`.
    #[inline]
    pub fn neighbor(&self, c: CellId, facet: usize) -> Option<CellId> {
        let node = &self.nodes[c.index()];
        let link = node.links[facet];
        (node.is_leaf() && is_interior(link)).then(|| CellId(unlink(link).0 as u32))
    }

    /// Overwrites `out` with the live cells around vertex `v`, ascending.
    ///
    /// Found by a walk over the neighbours from one of them, so that the cost depends on their number alone.
    /// Empty for a vertex that was removed.
    pub fn star(&self, v: VertexId, out: &mut Vec<CellId>) {
        out.clear();
        let leaf = self.vertex_leaf[v.index()];
        if leaf == NONE {
            return;
        }
        out.push(CellId(leaf));
        let mut next = 0;
        while next < out.len() {
            let slot = out[next].index();
            next += 1;
            for facet in 0..N {
                let link = self.nodes[slot].links[facet];
                if self.nodes[slot].v[facet] == v.0 || !is_interior(link) {
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
        let is_boundary = |&(c, facet): &(CellId, usize)| !is_interior(self.nodes[c.index()].links[facet]);
        self.cells().flat_map(facets_of).filter(is_boundary)
    }

    /// The tag of the facet opposite local vertex `facet` of `c`, 0 unless one was set; `None` unless that is a boundary
    /// facet of a live cell.
    pub fn boundary_tag(&self, c: CellId, facet: usize) -> Option<u32> {
        let node = self.nodes.get(c.index()).filter(|node| node.is_leaf())?;
        let link = *node.links.get(facet)?;
        (!is_interior(link)).then(|| link - BOUNDARY)
    }

    /// Sets the tag of a boundary facet. The parts that bisection cuts a facet into inherit its tag; a vertex between
    /// parts with different tags is not removed by coarsening.
    ///
    /// # Errors
    /// [`BoundaryError`] if `c` is not alive, if it has no boundary facet there, or if the tag exceeds 2^31 - 1.
    pub fn set_boundary_tag(&mut self, c: CellId, facet: usize, tag: u32) -> Result<(), BoundaryError> {
        if tag > MAX_BOUNDARY_TAG {
            return Err(BoundaryError::Tag { tag, limit: MAX_BOUNDARY_TAG });
        }
        if self.boundary_tag(c, facet).is_none() {
            return Err(BoundaryError::Facet { cell: c.0, facet });
        }
        self.nodes[c.index()].links[facet] = BOUNDARY + tag;
        Ok(())
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

    /// The ends of the edges that vertices halve, by vertex id; a vertex of the start mesh names itself twice, of an id that
    /// is free nothing is promised. With [`generations_slice`](Self::generations_slice), all that a multilevel solver needs.
    pub fn parents_slice(&self) -> &[[u32; 2]] {
        &self.parents
    }

    /// The generations of vertices, by vertex id; of an id that is free nothing is promised.
    pub fn generations_slice(&self) -> &[u16] {
        &self.generations
    }
}
