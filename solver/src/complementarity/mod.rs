//! Complementarity problems with bounds: forces that are limited, such as friction along a needle.
//!
//! Find `λ` with `l ≤ λ ≤ u` such that `w = W λ + q` satisfies, component by component,
//!
//! ```text
//! w_i ≥ 0  where λ_i = l_i      (state Lower)
//! w_i = 0  where l_i < λ_i < u_i (state Between)
//! w_i ≤ 0  where λ_i = u_i      (state Upper)
//! ```
//!
//! That is what minimises `½ λᵀW λ + qᵀλ` within the bounds. For symmetric positive definite `W` there is exactly one such `λ`.
//! With `λ` the forces on a tool and `w` the sliding that is left, `Between` sticks, and the other two slip. Bounds may be
//! infinite, and equal: a component with `l = u` has the state that the sign of `w` says, `Lower` for zero.
//!
//! * [`block_pivoting`]: exact, a few factorisations; the method of choice up to a few hundred components;
//! * [`projected_gauss_seidel`]: any number of sweeps, and Newton steps on the components between their bounds.
//!
//! Both are warm started from the iterate handed in.

mod gauss_seidel;
mod pivoting;
mod problem;
#[cfg(test)]
mod tests;

pub use gauss_seidel::{GaussSeidelSettings, projected_gauss_seidel};
pub use pivoting::{PivotingSettings, block_pivoting};
pub use problem::{BoxError, BoxProblem, BoxReport, BoxState, BoxWorkspace};
