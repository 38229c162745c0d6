//! Bodies given by a signed distance, and which of several a point belongs to.

mod strata;

pub use strata::Strata;

/// A solid by a function of space: negative inside, positive outside, zero on its surface.
///
/// Near the surface the value is the distance to it in metres, or at least a Lipschitz function of slope about one: sizes
/// and cut points are found from it. Anywhere else its sign is what counts.
pub trait Implicit: Send + Sync {
    /// Signed distance at `p`, m.
    fn distance(&self, p: &[f64; 3]) -> f64;

    /// A box (lowest, highest corner) that holds the solid; `None` where it has no end.
    fn bounds(&self) -> Option<[[f64; 3]; 2]>;
}
