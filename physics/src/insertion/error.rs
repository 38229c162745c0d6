//! What can go wrong with a needle in tissue, as values that carry the numbers.

use crate::body::BodyError;
use crate::coupling::{CouplingError, LimitsError};
use crate::dynamics::DynamicsError;
use crate::reparameterise::ReparameteriseError;
use crate::rod::RodError;
use stylet_mesh::remesh::RemeshError;

/// Why needles could not be set up or a step not be made. The state is the last good one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InsertionError {
    /// The tissue.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// Motion of the tissue.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// No step could be made, nor any of its parts.
    #[error("no step from t = {t} s, not even of {smallest:e} s: {reason}")]
    Failed {
        /// Time before the step, s.
        t: f64,
        /// The shortest part that was tried, s.
        smallest: f64,
        /// What the last attempt ended with.
        reason: CouplingError,
    },
    /// A rod makes no sense.
    #[error("needle {needle}: {error}")]
    Rod {
        /// The needle.
        needle: usize,
        /// What is wrong.
        error: RodError,
    },
    /// Forces between needle and tissue make no sense.
    #[error("needle {needle}, node {node}: {error}")]
    Limits {
        /// The needle.
        needle: usize,
        /// Its node.
        node: usize,
        /// What is wrong.
        error: LimitsError,
    },
    /// The mesh cannot follow the tip.
    #[error("needle {needle}: {error}")]
    Remesh {
        /// The needle.
        needle: usize,
        /// Why.
        error: RemeshError,
    },
    /// The needle's nodes could not be renewed.
    #[error("needle {needle}: {error}")]
    Reparameterise {
        /// The needle.
        needle: usize,
        /// Why.
        error: ReparameteriseError,
    },
    /// A needle starts in the tissue.
    #[error("needle {needle} starts inside the tissue: node {node} at ({:.4e}, {:.4e}, {:.4e}) m is in cell {cell} of region {region}", at[0], at[1], at[2])]
    StartsInside {
        /// The needle.
        needle: usize,
        /// Its node.
        node: usize,
        /// Where that is, m.
        at: [f64; 3],
        /// The cell.
        cell: u32,
        /// Its region.
        region: u32,
    },
    /// The tip has come out on the other side.
    #[error("needle {needle} has left the tissue at ({:.4e}, {:.4e}, {:.4e}) m: a needle that comes out again is not followed", at[0], at[1], at[2])]
    LeftTissue {
        /// The needle.
        needle: usize,
        /// Where the tip is, m.
        at: [f64; 3],
    },
    /// The sleeve has come too close to the skin.
    #[error("needle {needle}: its sleeve is {length:e} m from the tissue, too close to push on")]
    SleeveAtSkin {
        /// The needle.
        needle: usize,
        /// Length of the needle between sleeve and tissue, m.
        length: f64,
    },
    /// All of the needle has been pulled back into its sleeve.
    #[error("needle {needle} is pulled back further than it reaches out of its sleeve")]
    InSleeve {
        /// The needle.
        needle: usize,
    },
    /// Two needles share an element.
    #[error(
        "needles {needle} and {other} share cell {cell}: they must be in disjoint elements, or be withdrawn in reverse order"
    )]
    SharedElement {
        /// The needle that moved.
        needle: usize,
        /// The one in its way.
        other: usize,
        /// The cell that both touch.
        cell: u32,
    },
    /// A setting makes no sense.
    #[error("{name} is {value}, expected {expected}")]
    Setting {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
}
