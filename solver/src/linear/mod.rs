//! Linear systems.

pub mod cg;
#[cfg(feature = "direct")]
pub mod direct;
pub mod refine;

pub use cg::{CgError, CgReport, CgSettings, CgWorkspace, projected_cg};
pub use refine::{RefineError, RefineReport, RefineSettings, RefineWorkspace, refine};
