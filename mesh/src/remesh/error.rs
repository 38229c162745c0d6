//! What can go wrong with a needle, as values that carry the numbers.

/// Why a needle could not be moved. The mesh is valid, the needle is where its last whole substep brought it, and the
/// change log holds what was done until then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RemeshError {
    /// There is no such needle.
    #[error("needle {needle} does not exist: there are {n_needles}")]
    UnknownNeedle {
        /// The identifier given.
        needle: u32,
        /// Number of needles.
        n_needles: usize,
    },
    /// A tip with a coordinate that is not a number, infinite, or larger than any coordinate of a mesh.
    #[error("coordinate {axis} of the tip is {value:e}: it must be at most {limit:e} in magnitude")]
    Tip {
        /// Axis, from zero.
        axis: usize,
        /// The value given.
        value: f64,
        /// Largest magnitude accepted in this dimension.
        limit: f64,
    },
    /// A needle must start outside the mesh, so that it enters through the skin.
    #[error("the tip starts inside the mesh, in cell {cell}")]
    StartsInside {
        /// The cell.
        cell: u32,
    },
    /// A needle that is not in the mesh cannot be retracted through it.
    #[error("needle {needle} is outside the mesh and cannot be retracted into it")]
    NotInserted {
        /// The needle.
        needle: u32,
    },
    /// The tip left the mesh through the back and penetrates it again elsewhere; it may only be retracted.
    #[error("needle {needle} left the mesh and would penetrate it a second time: retract it first")]
    SecondEntry {
        /// The needle.
        needle: u32,
    },
    /// No candidate operation, however small the substep, keeps all cells positive, the boundary in shape and the nodes
    /// of all needles connected.
    #[error("no operation brings the tip of needle {needle} any closer to its place: it stopped {distance:e} short")]
    NoCandidate {
        /// The needle.
        needle: u32,
        /// What is missing to the position asked for.
        distance: f64,
    },
    /// What one needle has to undo has since been changed by another, which must be withdrawn first.
    #[error("needle {needle} has to undo what made cell {cell}, which needle {other} has changed since")]
    SharedElement {
        /// The needle to be moved.
        needle: u32,
        /// The needle in its way.
        other: u32,
        /// The cell that both changed.
        cell: u32,
    },
    /// The mesh would outgrow its limit, see [`SimplexMesh::set_slot_limit`](crate::SimplexMesh::set_slot_limit).
    #[error("at least {needed} slots are needed: the limit is {limit}")]
    SlotLimit {
        /// Slots needed.
        needed: usize,
        /// The limit.
        limit: usize,
    },
    /// The mesh is not the one that the needles are in.
    #[error("the mesh is not the one that needle {needle} is in: {what}")]
    OtherMesh {
        /// The needle.
        needle: u32,
        /// What differs.
        what: &'static str,
    },
}
