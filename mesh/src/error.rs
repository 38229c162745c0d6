//! What can go wrong with a mesh, as values that carry the numbers.

/// Why a start mesh was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// There is nothing to mesh.
    #[error("a mesh needs at least one cell")]
    NoCells,
    /// More cells than identifiers of 32 bits, less the bits that name a facet, can count.
    #[error("{count} cells are too many: the limit is {limit}")]
    TooManyCells {
        /// Cells asked for; saturated if the number itself overflows.
        count: usize,
        /// Cells that fit.
        limit: usize,
    },
    /// One region per cell is needed.
    #[error("{found} regions for {expected} cells")]
    Regions {
        /// Number of cells.
        expected: usize,
        /// Number of regions given.
        found: usize,
    },
    /// More different regions than a cell can name.
    #[error("{count} different regions are too many: the limit is {limit}")]
    TooManyRegions {
        /// Number of different regions.
        count: usize,
        /// Regions that a mesh can tell apart.
        limit: usize,
    },
    /// A coordinate that is not a number, infinite, or so large that a volume would overflow.
    #[error("coordinate {axis} of vertex {vertex} is {value:e}: it must be finite and at most {limit:e} in magnitude")]
    Coordinate {
        /// Vertex index.
        vertex: usize,
        /// Axis, from zero.
        axis: usize,
        /// The refused value.
        value: f64,
        /// Largest magnitude accepted in this dimension.
        limit: f64,
    },
    /// A cell names a vertex that does not exist.
    #[error("cell {cell} names vertex {vertex}, but there are {n_vertices} vertices")]
    Index {
        /// Cell index.
        cell: usize,
        /// The vertex named.
        vertex: u32,
        /// Number of vertices.
        n_vertices: usize,
    },
    /// A cell names one vertex twice.
    #[error("cell {cell} names vertex {vertex} twice")]
    RepeatedVertex {
        /// Cell index.
        cell: usize,
        /// The repeated vertex.
        vertex: u32,
    },
    /// A cell without volume, or so small that its volume would underflow.
    #[error(
        "cell {cell} is flat: its edges span {relative_volume:e} of the cube of its longest edge, {longest_edge:e} \
         (at least {limit:e} is needed)"
    )]
    Flat {
        /// Cell index.
        cell: usize,
        /// Determinant of the edge vectors divided by the longest edge, which is scale-free.
        relative_volume: f64,
        /// Longest edge of the cell, in units of the coordinates.
        longest_edge: f64,
        /// Smallest relative volume accepted.
        limit: f64,
    },
    /// Two cells with the same vertices.
    #[error("cells {first} and {second} have the same vertices")]
    DuplicateCell {
        /// The earlier cell.
        first: usize,
        /// The later cell.
        second: usize,
    },
    /// A facet with more than two cells.
    #[error("cells {}, {} and {} share one facet: at most two may", cells[0], cells[1], cells[2])]
    SharedFacet {
        /// The first three of the cells.
        cells: [usize; 3],
    },
    /// Two cells on the same side of their common facet.
    #[error("cells {} and {} lie on the same side of the facet that they share", cells[0], cells[1])]
    Overlap {
        /// The two cells.
        cells: [usize; 2],
    },
    /// Cells that meet in a vertex or an edge without being joined around it by facets.
    #[error("cells {} and {} meet in vertices {face:?}, but no chain of facets around these joins them", cells[0], cells[1])]
    Pinched {
        /// The common vertex, edge or face.
        face: Vec<u32>,
        /// Two cells that are not joined.
        cells: [usize; 2],
    },
    /// A vertex that no cell uses.
    #[error("no cell uses vertex {vertex}")]
    Unreferenced {
        /// Vertex index.
        vertex: usize,
    },
    /// A box without extent or without cells.
    #[error(
        "axis {axis} of a box runs from {lower:e} to {upper:e} in {cells} cells: it needs lower < upper and a cell"
    )]
    Box {
        /// Axis, from zero.
        axis: usize,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
        /// Cells along the axis.
        cells: usize,
    },
}

/// Why a boundary tag was refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoundaryError {
    /// There is no such facet, or it has a cell on either side.
    #[error("cell {cell} is not alive or has no boundary facet {facet}")]
    Facet {
        /// The cell given.
        cell: u32,
        /// Local index of the vertex opposite the facet.
        facet: usize,
    },
    /// A tag beyond what a facet can hold.
    #[error("boundary tag {tag} is too large: the limit is {limit}")]
    Tag {
        /// The tag given.
        tag: u32,
        /// The largest tag.
        limit: u32,
    },
}

/// Why a refinement stopped. The mesh is valid and conforming, and the change log holds what was done until then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BisectError {
    /// A marked cell never existed.
    #[error("cell {cell} does not exist: the mesh has {n_slots} slots")]
    UnknownCell {
        /// The identifier given.
        cell: u32,
        /// Number of slots of the mesh.
        n_slots: usize,
    },
    /// A target size that no mesh can have.
    #[error("target size {size:e} must be a positive finite length")]
    Size {
        /// The size given.
        size: f64,
    },
    /// A feature with a coordinate that is not a number, infinite, or larger than any coordinate of a mesh.
    #[error("coordinate {axis} of the point to refine around is {value:e}: it must be at most {limit:e} in magnitude")]
    Point {
        /// Axis, from zero.
        axis: usize,
        /// The value given.
        value: f64,
        /// Largest magnitude accepted in this dimension.
        limit: f64,
    },
    /// The mesh would outgrow its limit, see [`SimplexMesh::set_slot_limit`](crate::SimplexMesh::set_slot_limit).
    #[error("at least {needed} slots are needed: the limit is {limit}")]
    SlotLimit {
        /// A lower bound of the slots needed.
        needed: usize,
        /// The limit.
        limit: usize,
    },
    /// The call would bisect more cells than it may, see
    /// [`SimplexMesh::set_bisection_limit`](crate::SimplexMesh::set_bisection_limit).
    #[error("at least {needed} bisections are needed: the limit of one call is {limit}")]
    BisectionLimit {
        /// A lower bound of the bisections needed.
        needed: usize,
        /// The limit.
        limit: usize,
    },
    /// A cell that the needle remesher made or replaced, or one around a vertex that it moved, would have to be bisected.
    #[error("cell {cell} is remeshed around a needle: it cannot be bisected before the needle is withdrawn")]
    Remeshed {
        /// The cell.
        cell: u32,
    },
    /// A chain of vertices, each younger than the one before, longer than generations can count.
    #[error("the midpoint of edge {a}-{b} would be of generation {generation}: the limit is {limit}")]
    Generation {
        /// One end.
        a: u32,
        /// The other end.
        b: u32,
        /// The generation.
        generation: u32,
        /// The largest generation.
        limit: u32,
    },
    /// The machine has no more memory.
    #[error("no memory for {needed} slots")]
    Memory {
        /// Slots needed.
        needed: usize,
    },
    /// An edge too short, for the precision of its coordinates, to have a midpoint of its own.
    #[error("edge {a}-{b} of length {length:e} is too short to be bisected at its distance from the origin")]
    Resolution {
        /// One end.
        a: u32,
        /// The other end.
        b: u32,
        /// Length of the edge.
        length: f64,
    },
    /// The closure came back to where it was, which a mesh built by this crate cannot do.
    #[error("the closure of cell {cell} did not end within {steps} steps")]
    Closure {
        /// The marked cell.
        cell: u32,
        /// Steps made.
        steps: usize,
    },
}

/// What is wrong with a mesh that should be valid; found by
/// [`check_invariants`](crate::SimplexMesh::check_invariants).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InvariantError {
    /// A vertex, cell or facet index out of range, or arrays of different lengths.
    #[error("cell {cell}: {what} is out of range")]
    Range {
        /// The cell.
        cell: u32,
        /// Which index.
        what: &'static str,
    },
    /// A node of the bisection tree that is not what its parent makes it.
    #[error("cell {cell} is not the child that bisection makes of its parent: {what}")]
    Tree {
        /// The cell.
        cell: u32,
        /// Which part differs.
        what: &'static str,
    },
    /// Two live cells disagree about their common facet.
    #[error("cell {cell} and its neighbour across facet {facet} disagree")]
    Neighbor {
        /// The cell.
        cell: u32,
        /// Local index of the vertex opposite the facet.
        facet: usize,
    },
    /// A live cell whose orientation is not the stored one.
    #[error("cell {cell} has signed volume {volume:e}, against its stored orientation")]
    Orientation {
        /// The cell.
        cell: u32,
        /// Signed volume in the order of [`cell`](crate::SimplexMesh::cell).
        volume: f64,
    },
    /// The live cells, or their boundary facets, do not add up to those of the start mesh: a gap or a hanging vertex.
    #[error("the {what} is {found:e}, that of the start mesh is {expected:e}")]
    Measure {
        /// `volume` or `boundary`.
        what: &'static str,
        /// Sum over the start mesh.
        expected: f64,
        /// Sum over the live cells.
        found: f64,
    },
    /// A vertex whose stored cell does not contain it, or whose parents are not older.
    #[error("vertex {vertex}: {what}")]
    Vertex {
        /// The vertex.
        vertex: u32,
        /// What is wrong.
        what: &'static str,
    },
}
