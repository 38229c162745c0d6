//! What is said when a step cannot be made: needles counted from 1, as in scene files, and where they are.

use super::Run;
use stylet_physics::insertion::{InsertionError, Needle};
use stylet_tissue::RunError;

impl Run {
    /// What went wrong, with where the needles are.
    pub(super) fn failure(&self, error: &InsertionError) -> RunError {
        let place = |(k, needle): (usize, &Needle)| {
            let (tip, node) = (needle.shaft.tip(), needle.shaft.n_nodes() - 1);
            format!(
                "needle {} has its tip, node {node}, at ({:.5}, {:.5}, {:.5}) m, {:.5} m deep",
                k + 1,
                tip[0],
                tip[1],
                tip[2],
                needle.depth()
            )
        };
        let places: Vec<String> = self.insertion.needles().iter().enumerate().map(place).collect();
        RunError::Step { step: self.steps + 1, reason: format!("{}; {}", named(error), places.join("; ")) }
    }
}

/// An error with needles counted from 1, as in scene files.
pub(super) fn named(error: &InsertionError) -> String {
    match error {
        InsertionError::SharedElement { needle, other, cell } => format!(
            "needles {} and {} share cell {cell}: they must be in disjoint elements, or be withdrawn in reverse order",
            needle + 1,
            other + 1
        ),
        InsertionError::LeftTissue { needle, at } => format!(
            "needle {} has left the tissue at ({:.4}, {:.4}, {:.4}) m: a needle that comes out at the back is not followed",
            needle + 1,
            at[0],
            at[1],
            at[2]
        ),
        InsertionError::SleeveAtSkin { needle, length } => {
            format!("needle {}: its sleeve is {length:e} m from the tissue, too close to push on", needle + 1)
        }
        other => other.to_string(),
    }
}
