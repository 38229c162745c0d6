//! How a static solve went.

use stylet_solver::stop::Stop;

/// How a static solve went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticReport {
    /// Why the last load step ended: [`Stop::Converged`], or [`Stop::Stalled`] where rounding errors are reached.
    pub stop: Stop,
    /// Load steps that converged.
    pub load_steps: usize,
    /// Load steps that failed and were tried again with half the increment.
    pub failed_steps: usize,
    /// Iterations of the method, all steps together.
    pub iterations: usize,
    /// Iterations of the linear solves inside (Newton), or products (otherwise).
    pub inner_iterations: usize,
    /// Free residual of the last iterate, N.
    pub residual_norm: f64,
    /// Norm of the forces that hold the constrained nodes, N.
    pub reaction_norm: f64,
}
