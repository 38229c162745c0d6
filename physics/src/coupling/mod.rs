//! Coupling of a flexible needle with the tissue that it pierces.
//!
//! Nodes that needle and tissue share are tied across the needle; along it they stick, or slip and carry friction. Which of
//! them stick is not known in advance: the states, the forces and the sliding satisfy a complementarity problem.
//!
//! * [`SlipState`], [`SlipLimits`], [`StickSlip`]: states, limits, and what a coupled system must be able to do;
//! * [`search`]: finds the states, by the published trials or by a complementarity solve on the tangential forces;
//! * [`guess`]: the states to start from, after nodes were born, moved or deleted.
//!
//! Coupling nodes are listed from the entry of the needle to its tip. A tangential force `λ_i` is the force on the tissue
//! along the tangent that points to the tip, a slip `s_i` is how far the needle moves past the tissue along it in a step.

mod aside;
mod condensed;
mod error;
mod rods;
mod search;
mod settings;
mod shaft;
mod stacked;
mod state;
mod step;
mod system;
#[cfg(test)]
mod tests;

pub use error::CouplingError;
pub use rods::ShaftEnd;
pub use search::{SearchMethod, SearchReport, SearchSettings, SearchWorkspace, search};
pub use settings::{CoupledReport, CoupledSettings, CoupledTimes};
pub use shaft::{CouplingNode, Shaft, SleeveMotion};
pub(crate) use shaft::{difference, inner, length, set_triple, triple, unit};
pub use state::{Answer, LimitsError, SlipLimits, SlipState, StickSlip, guess};
pub use step::{CoupledIntegrator, Past};
pub use system::CouplingMethod;
