//! Which edge of a start cell is bisected first.

use serde::{Deserialize, Serialize};

/// How the start cells, and with them the whole forest, come to their refinement edges.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug, Serialize, Deserialize)]
pub enum Rule {
    /// The longest edge, in each of the first `N - 1` bisections anew; fits shapes best.
    #[default]
    LongestEdge,
    /// A colouring of the vertices, blind to shape, for which the cost of the closure is proved to be bounded.
    Colouring,
}
