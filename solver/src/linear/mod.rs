//! Linear systems.

pub mod cg;

pub use cg::{CgError, CgReport, CgSettings, CgWorkspace, projected_cg};
