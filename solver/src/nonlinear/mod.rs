//! Minimisation of an [`Energy`](crate::energy::Energy) over a subspace.
//!
//! [`newton_cg`] wants an assembled Hessian and few gradients; [`nonlinear_cg`] wants gradients and, for its step length,
//! one Hessian product per iteration or none at all.

mod cg;
mod line_search;
mod newton;
mod progress;
mod truncated_cg;

pub use cg::{NonlinearCgSettings, NonlinearCgWorkspace, StepModel, nonlinear_cg};
pub use newton::{Linearization, NewtonSettings, NewtonWorkspace, Preconditioning, newton_cg};
pub use progress::{NonlinearError, NonlinearReport};
