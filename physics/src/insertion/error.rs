//! What can go wrong with a needle in tissue, as values that carry the numbers. Values count needles from 0, messages from 1.

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
    #[error("no step from t = {t:.6} s, not even of {smallest:.3e} s: {reason}")]
    Failed {
        /// Time before the step, s.
        t: f64,
        /// The shortest part that was tried, s.
        smallest: f64,
        /// What the last attempt ended with.
        reason: CouplingError,
    },
    /// A rod makes no sense.
    #[error("needle {}: {error}", needle + 1)]
    Rod {
        /// The needle.
        needle: usize,
        /// What is wrong.
        error: RodError,
    },
    /// Forces between needle and tissue make no sense.
    #[error("needle {}, node {node}: {error}", needle + 1)]
    Limits {
        /// The needle.
        needle: usize,
        /// Its node.
        node: usize,
        /// What is wrong.
        error: LimitsError,
    },
    /// The mesh cannot follow the tip.
    #[error("needle {}: {error}", needle + 1)]
    Remesh {
        /// The needle.
        needle: usize,
        /// Why.
        error: RemeshError,
    },
    /// The needle's nodes could not be renewed.
    #[error("needle {}: {error}", needle + 1)]
    Reparameterise {
        /// The needle.
        needle: usize,
        /// Why.
        error: ReparameteriseError,
    },
    /// A needle starts in the tissue.
    #[error("needle {} starts inside the tissue: node {node} at ({:.4}, {:.4}, {:.4}) m is in cell {cell} of region {region}", needle + 1, at[0], at[1], at[2])]
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
    #[error("needle {} has left the tissue at ({:.4}, {:.4}, {:.4}) m: a needle that comes out again is not followed", needle + 1, at[0], at[1], at[2])]
    LeftTissue {
        /// The needle.
        needle: usize,
        /// Where the tip is, m.
        at: [f64; 3],
    },
    /// The sleeve has come too close to the skin.
    #[error("needle {}: its sleeve is {length:.3e} m from the tissue, too close to push on", needle + 1)]
    SleeveAtSkin {
        /// The needle.
        needle: usize,
        /// Length of the needle between sleeve and tissue, m.
        length: f64,
    },
    /// All of the needle has been pulled back into its sleeve.
    #[error("needle {} is pulled back further than it reaches out of its sleeve", needle + 1)]
    InSleeve {
        /// The needle.
        needle: usize,
    },
    /// Two needles share an element.
    #[error(
        "needles {} and {} share cell {cell}: they must be in disjoint elements, or be withdrawn in reverse order",
        needle + 1,
        other + 1
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
    #[error("{name} is {value:?}, expected {expected}")]
    Setting {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needles_are_counted_from_one() {
        let overrun = CouplingError::Overrun { needle: 1, node: 4, slip: 1e-3, reach: 1e-4 };
        let error = ReparameteriseError::NotFinite { what: "positions", index: 3 };
        for (error, start) in [
            (InsertionError::InSleeve { needle: 0 }, "needle 1 is pulled back further"),
            (InsertionError::Reparameterise { needle: 0, error }, "needle 1: positions"),
            (
                InsertionError::LeftTissue { needle: 2, at: [0.1, 0.2, 0.3] },
                "needle 3 has left the tissue at (0.1000, 0.2000, 0.3000) m",
            ),
            (InsertionError::SleeveAtSkin { needle: 1, length: 1e-3 }, "needle 2: its sleeve is"),
            (InsertionError::SharedElement { needle: 0, other: 1, cell: 7 }, "needles 1 and 2 share cell 7"),
            (
                InsertionError::Failed { t: 1.0, smallest: 1e-3, reason: overrun },
                "no step from t = 1.000000 s, not even of 1.000e-3 s: needle 2 slides",
            ),
        ] {
            let line = error.to_string();
            assert!(line.starts_with(start), "{line}");
        }
    }
}
