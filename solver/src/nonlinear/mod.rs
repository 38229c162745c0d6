//! Minimisation of an [`Energy`](crate::energy::Energy) over a subspace.
//!
//! | method | asks for | good where |
//! |---|---|---|
//! | [`newton_cg`] | an assembled Hessian, few gradients | a Hessian is cheap beside its use, or the problem is stiff |
//! | [`nonlinear_cg`] | gradients; one Hessian product per step or none, two for [`Direction::Subspace`] | steps are many and loose |
//! | [`lbfgs`] | gradients and energies | an approximate Hessian was factored before, or there is none at all |
//!
//! All stay within a [`Subspace`](crate::subspace::Subspace), keep to the domain of the energy, take any
//! [`Preconditioner`](crate::precondition::Preconditioner) and choose among the same [line searches](line_search).

mod cg;
mod lbfgs;
pub mod line_search;
mod newton;
mod progress;
mod truncated_cg;

pub use cg::{Direction, NonlinearCgSettings, NonlinearCgWorkspace, StepModel, nonlinear_cg};
pub use lbfgs::{LbfgsSettings, LbfgsWorkspace, lbfgs};
pub use line_search::LineSearch;
pub use newton::{
    Following, Forcing, HessianPreconditioner, Kept, Linearization, NewtonSettings, NewtonWorkspace, Preconditioning,
    newton_cg, newton_cg_with,
};
pub use progress::{NonlinearError, NonlinearReport};
