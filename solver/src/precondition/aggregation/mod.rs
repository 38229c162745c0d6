//! Coarse levels made of aggregates of nodes, from the matrix alone: two levels, or as many as it takes.
//!
//! Every level corrects what the one above cannot see: moves that cost little energy because whole regions move as one.

mod aggregates;
mod coarsest;
mod galerkin;
mod graph;
mod level;
mod modes;
mod smoothed;
mod tentative;
mod transfer;
mod two_level;

pub use modes::Modes;
pub use smoothed::{SmoothedAggregation, SmoothedAggregationSettings};
pub use two_level::{Form, TwoLevel};

#[cfg(test)]
mod tests;
