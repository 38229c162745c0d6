//! What every running scene shares, whatever its application and its dimension: one interface ([`Simulation`]), the files
//! of a run ([`output`]), state files ([`state`]), the stages that the time goes to ([`stages`]), and what a run says of
//! itself ([`summary`], [`history`]).
//!
//! And scenes of bodies without a tool, at rest or in motion, in two and three dimensions ([`body`]).

pub mod body;
mod error;
pub mod history;
pub mod order;
pub mod output;
pub mod scenario;
pub mod simulation;
pub mod source;
pub mod stages;
pub mod state;
pub mod summary;

pub use error::RunError;
pub use scenario::Scenario;
pub use simulation::Simulation;
