//! A node of the bisection forest, packed: 32 bytes for a triangle, 40 for a tetrahedron.
//!
//! ```text
//! info   31..29 record bits   28 visited   27..26 kind   25 negative   24..15 region   14..3 level   2..0 tag
//! link   0, slot (28 bits), local facet there (3 bits)      to a neighbour
//!        1, boundary tag (31 bits)                          on the boundary
//! ```

/// No cell, no vertex, no parent.
pub(crate) const NONE: u32 = u32::MAX;
/// A link to a neighbour is its slot shifted by this, plus the local index of the common facet there.
pub(crate) const FACET_BITS: u32 = 3;
/// Slots that a link can name.
pub(crate) const MAX_SLOTS: usize = 1 << (31 - FACET_BITS);
/// The link of a facet on the boundary, to which its tag is added.
pub(crate) const BOUNDARY: u32 = 1 << 31;
/// The largest tag of a boundary facet.
pub(crate) const MAX_BOUNDARY_TAG: u32 = BOUNDARY - 1;

/// The link to facet `facet` of the cell in `slot`.
#[inline]
pub(crate) fn link(slot: u32, facet: usize) -> u32 {
    slot << FACET_BITS | facet as u32
}

/// The slot and the local facet that a link to a neighbour names.
#[inline]
pub(crate) fn unlink(link: u32) -> (usize, usize) {
    ((link >> FACET_BITS) as usize, (link & ((1 << FACET_BITS) - 1)) as usize)
}

/// Whether a link is one to a neighbour, not one of a boundary facet.
#[inline]
pub(crate) fn is_interior(link: u32) -> bool {
    link < BOUNDARY
}

/// Evaluates an expression with a tag as a constant, so that the compiler writes out the moves of the vertices.
macro_rules! for_tag {
    ($tag:expr, $K:ident => $body:expr) => {
        match $tag {
            1 => {
                const $K: usize = 1;
                $body
            }
            2 => {
                const $K: usize = 2;
                $body
            }
            3 => {
                const $K: usize = 3;
                $body
            }
            4 => {
                const $K: usize = 4;
                $body
            }
            5 => {
                const $K: usize = 5;
                $body
            }
            6 => {
                const $K: usize = 6;
                $body
            }
            7 => {
                const $K: usize = 7;
                $body
            }
            tag => unreachable!("cells with tag {tag} are not bisected"),
        }
    };
}
pub(crate) use for_tag;

const TAG: u32 = 0b111;
const LEVEL_SHIFT: u32 = 3;
/// The largest level: edges of the largest and the smallest coordinates are some 2,000 bisections apart.
pub(crate) const MAX_LEVEL: u16 = (1 << 12) - 1;
const REGION_SHIFT: u32 = 15;
/// Regions that a mesh can tell apart.
pub(crate) const MAX_REGIONS: usize = 1 << 10;
const NEGATIVE: u32 = 1 << 25;
const KIND: u32 = 0b11 << 26;
const INNER: u32 = 1 << 26;
const COVERED: u32 = 2 << 26;
const FREE: u32 = 3 << 26;
const VISITED: u32 = 1 << 28;
/// Died in the running operation, having been alive before it.
pub(crate) const DIED: u32 = 1 << 29;
/// Alive after the running operation as far as it has got, but not before it, or not as the same cell.
pub(crate) const BORN: u32 = 1 << 30;
/// Another cell than the one that was in this slot before the running operation.
pub(crate) const REUSED: u32 = 1 << 31;

/// A node of the bisection forest; a leaf is a live cell.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub(crate) struct Node<const N: usize> {
    /// The vertices in Maubach order: the refinement edge is `(v[0], v[tag])`.
    pub v: [u32; N],
    /// Of a leaf, the links across the facets opposite the vertices. Of an inner node, the first child at index 0 (the
    /// second child is the next slot), and nothing of meaning in the rest.
    pub links: [u32; N],
    /// The node that was bisected into this one, `NONE` for a cell of the start mesh and of an overlay.
    pub parent: u32,
    pub info: u32,
}

impl<const N: usize> Node<N> {
    /// A start cell, without neighbours.
    pub fn root(v: [u32; N], region: u32, negative: bool) -> Self {
        let info = (N - 1) as u32 | region << REGION_SHIFT | if negative { NEGATIVE } else { 0 };
        Self { v, links: [BOUNDARY; N], parent: NONE, info }
    }

    /// Maubach's tag, `1..=N - 1`; 0 for a cell of an overlay, which is never bisected.
    #[inline]
    pub fn tag(&self) -> usize {
        (self.info & TAG) as usize
    }

    /// Number of bisections since the start mesh.
    #[inline]
    pub fn level(&self) -> u16 {
        (self.info >> LEVEL_SHIFT) as u16 & MAX_LEVEL
    }

    /// The index of the region in the table of the mesh.
    #[inline]
    pub fn region(&self) -> usize {
        (self.info >> REGION_SHIFT) as usize & (MAX_REGIONS - 1)
    }

    /// Whether the order `v` is of negative orientation.
    #[inline]
    pub fn is_negative(&self) -> bool {
        self.info & NEGATIVE != 0
    }

    pub fn flip(&mut self) {
        self.info ^= NEGATIVE;
    }

    /// Whether this is a live cell.
    #[inline]
    pub fn is_leaf(&self) -> bool {
        self.info & KIND == 0
    }

    #[inline]
    pub fn is_inner(&self) -> bool {
        self.info & KIND == INNER
    }

    pub fn is_covered(&self) -> bool {
        self.info & KIND == COVERED
    }

    pub fn is_free(&self) -> bool {
        self.info & KIND == FREE
    }

    /// Whether it is a cell of an overlay, live or covered by others: never bisected, without parent.
    #[inline]
    pub fn is_overlay(&self) -> bool {
        self.info & TAG == 0
    }

    /// This cell as one of an overlay.
    pub fn as_overlay(&self) -> Self {
        Self { parent: NONE, info: self.tree_info() & !TAG, ..*self }
    }

    /// Puts a live cell under overlay cells: it keeps its vertices and its links, but is not live.
    pub fn cover(&mut self) {
        self.info |= COVERED;
    }

    /// Makes a covered cell live again.
    pub fn uncover(&mut self) {
        self.info &= !KIND;
    }

    /// The first child of an inner node, `NONE` of any other.
    #[inline]
    pub fn child(&self) -> u32 {
        if self.is_inner() { self.links[0] } else { NONE }
    }

    /// The children of an inner node; a slot that does not exist twice for any other.
    pub fn child_slots(&self) -> [u32; 2] {
        let child = self.child();
        [child, child.saturating_add(1)]
    }

    /// What bisection fixes: tag, level, region, orientation.
    pub fn tree_info(&self) -> u32 {
        self.info & (VISITED - 1) & !KIND
    }

    /// Makes an inner node of a leaf.
    #[inline]
    pub fn bisect_into(&mut self, first_child: u32) {
        self.links[0] = first_child;
        self.info |= INNER;
    }

    /// Makes a leaf of an inner node.
    pub fn revive(&mut self, links: [u32; N]) {
        self.links = links;
        self.info &= !KIND;
    }

    /// Gives the slot back.
    pub fn free(&mut self) {
        self.info |= FREE;
    }

    #[inline]
    pub fn is_visited(&self) -> bool {
        self.info & VISITED != 0
    }

    #[inline]
    pub fn visit(&mut self) {
        self.info |= VISITED;
    }

    #[inline]
    pub fn unvisit(&mut self) {
        self.info &= !VISITED;
    }

    /// The bits that hold between operations: all but the marks of a walk and of the record.
    pub fn lasting_info(&self) -> u32 {
        self.info & (VISITED - 1)
    }

    /// The ends of the refinement edge, ascending.
    #[inline]
    pub fn edge(&self) -> [u32; 2] {
        let (a, b) = (self.v[0], self.v[self.tag()]);
        [a.min(b), a.max(b)]
    }

    /// The local index of a vertex.
    #[inline]
    pub fn position(&self, vertex: u32) -> Option<usize> {
        self.v.iter().position(|&v| v == vertex)
    }

    /// The children of this leaf, in `slot`, at the midpoint `vertex` of its refinement edge, when the first child goes to
    /// slot `first`. They are linked to each other and to what this cell is linked to; links across the facets that are
    /// cut name the old neighbours still.
    pub fn children(&self, slot: u32, first: u32, vertex: u32) -> [Self; 2] {
        for_tag!(self.tag(), K => self.children_of_tag::<K>(slot, first, vertex))
    }

    /// As [`children`](Self::children), of a cell known to have tag `K`.
    #[inline(always)]
    pub fn children_of_tag<const K: usize>(&self, slot: u32, first: u32, vertex: u32) -> [Self; 2] {
        let tag = if K > 1 { K - 1 } else { N - 1 } as u32;
        let info = ((self.tree_info() & !TAG) + (1 << LEVEL_SHIFT)) | tag;
        let mut lower = Self { v: self.v, links: self.links, parent: slot, info };
        // Child 1 is the cell with z for v[0], turned cyclically through k + 1 places.
        let turned = |i: usize| if i < K { i + 1 } else { i };
        let mut upper = Self {
            v: std::array::from_fn(|i| self.v[turned(i)]),
            links: std::array::from_fn(|i| self.links[turned(i)]),
            parent: slot,
            info: if K % 2 == 1 { info ^ NEGATIVE } else { info },
        };
        lower.v[K] = vertex;
        upper.v[K] = vertex;
        upper.links[K] = self.links[0];
        lower.links[0] = link(first + 1, K - 1);
        upper.links[K - 1] = link(first, 0);
        [lower, upper]
    }
}
