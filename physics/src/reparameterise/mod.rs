//! What a needle carries along its length, after its nodes have moved, come and gone.
//!
//! Where a needle slides its nodes no longer stand for the points of the needle that they stood for, and remeshing of the tissue
//! makes and deletes nodes. Before the next step
//!
//! 1. [`merge_and_split`] keeps the edges outside the tissue neither too short nor too long,
//! 2. [`reparameterise`] reads what the needle carried before at the distances from the base that the nodes have now,
//!
//! or [`adapt`] does both. [`Akima`] and [`Linear`] are the interpolations.
//!
//! Source: Chentanez et al., *Interactive simulation of surgical needle insertion and steering*, ACM Trans. Graph. 28(3)
//! (2009), section 3.4.2.

mod akima;
mod error;
mod linear;
mod merge_split;
mod profile;
mod table;
#[cfg(test)]
mod tests;

pub use akima::Akima;
pub use error::ReparameteriseError;
pub use linear::Linear;
pub use merge_split::{EdgeLimits, MergeSplitReport, merge_and_split};
pub use profile::{Profile, reparameterise};

/// [`merge_and_split`] of the nodes that follow a step, then [`reparameterise`]; the arguments are theirs.
///
/// # Errors
/// Theirs.
pub fn adapt(
    before: &Profile,
    positions: &[f64],
    coupled: usize,
    limits: &EdgeLimits,
) -> Result<(Profile, MergeSplitReport), ReparameteriseError> {
    let (positions, report) = merge_and_split(positions, coupled, limits)?;
    Ok((reparameterise(before, &positions, coupled)?, report))
}
