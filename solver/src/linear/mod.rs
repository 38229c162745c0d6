//! Linear systems.

pub mod cg;
pub mod mixed;
mod passes;

pub use cg::{CgError, CgReport, CgSettings, CgWorkspace, Check, Checkpoint, projected_cg, projected_cg_with_check};
pub use mixed::{MixedWorkspace, mixed_cg};
