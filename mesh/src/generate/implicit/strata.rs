//! Several solids with a stated precedence.

use super::Implicit;

/// Solids in order of precedence: a point belongs to the first that holds it, or to what surrounds them all.
///
/// The border between regions `i < k` lies in the surface of solid `i`.
pub struct Strata {
    solids: Vec<Box<dyn Implicit>>,
}

impl Strata {
    /// The first solid takes precedence over the second, and so on.
    pub fn new(solids: Vec<Box<dyn Implicit>>) -> Self {
        Self { solids }
    }

    /// The solids, first in precedence first.
    pub fn solids(&self) -> &[Box<dyn Implicit>] {
        &self.solids
    }

    /// Number of the region outside all solids.
    pub fn background(&self) -> usize {
        self.solids.len()
    }

    /// Number of the region at `p`: its solid's place in the order, or [`background`](Self::background).
    pub fn region(&self, p: &[f64; 3]) -> usize {
        self.solids.iter().position(|solid| solid.distance(p) < 0.0).unwrap_or(self.background())
    }
}
