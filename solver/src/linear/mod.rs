//! Linear systems.

pub mod cg;
pub mod constrained;
pub mod constraints;
#[cfg(feature = "direct")]
pub mod direct;
pub mod elimination;
pub mod kkt;
pub mod krylov;
pub mod many;
pub mod minres;
pub mod mixed;
pub mod null_space;
mod passes;
pub mod refine;
mod row_reduction;
mod schur;

pub use cg::{CgError, CgReport, CgSettings, CgWorkspace, Check, Checkpoint, projected_cg, projected_cg_with_check};
pub use constrained::{
    ConstrainedError, ConstrainedReport, ConstrainedWorkspace, ConstraintPreconditioner, SchurDiagonal, constrained_cg,
};
pub use constraints::{ConstraintError, Constraints};
pub use elimination::{Elimination, EliminationError, EliminationWorkspace, elimination_cg};
pub use kkt::{KktError, KktOperator, KktReport, KktWorkspace, kkt_cg, kkt_minres};
pub use krylov::{KrylovReport, KrylovSettings, VectorError};
pub use many::{ManyCgError, ManyCgWorkspace, many_cg};
pub use minres::{MinresError, MinresWorkspace, minres};
pub use mixed::{MixedWorkspace, mixed_cg};
pub use null_space::{Attachment, NullSpace, NullSpaceError, NullSpaceWorkspace, null_space_cg, null_space_start};
pub use refine::{RefineError, RefineReport, RefineSettings, RefineWorkspace, refine};
