//! How a static problem is solved.

use super::StaticError;
#[cfg(feature = "direct")]
use stylet_solver::linear::direct::Method;
use stylet_solver::nonlinear::{Direction, StepModel};
use stylet_solver::stop::StopRule;

/// How the equilibrium is found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StaticMethod {
    /// Projected conjugate gradients: linear materials only.
    Cg,
    /// A factor of the stiffness, its solve refined: linear materials only. Newton-CG with
    /// [`Preconditioning::Factor`] is the same for others.
    #[cfg(feature = "direct")]
    Direct(Method),
    /// Projected nonlinear conjugate gradients, preconditioned by the stiffness at the start of each load step.
    NonlinearCg {
        /// How a direction follows from the last one.
        direction: Direction,
        /// How the length of a step is guessed.
        step: StepModel,
    },
    /// Limited-memory BFGS, preconditioned by the stiffness at the start of each load step.
    Lbfgs,
    /// Projected Newton-CG.
    NewtonCg,
}

impl StaticMethod {
    /// Whether it solves one linear system, and so takes bodies of constant stiffness only.
    #[must_use]
    pub fn is_linear(self) -> bool {
        match self {
            Self::Cg => true,
            #[cfg(feature = "direct")]
            Self::Direct(_) => true,
            _ => false,
        }
    }
}

/// What the iterations of a method are preconditioned with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Preconditioning {
    /// Nothing.
    None,
    /// The diagonal.
    Jacobi,
    /// The diagonal blocks, restricted to each node's subspace.
    BlockJacobi,
    /// Symmetric successive over-relaxation.
    Ssor,
    /// Incomplete Cholesky factors without fill.
    IncompleteCholesky,
    /// Three Chebyshev smoothings.
    Chebyshev,
    /// Smoothed aggregation that keeps translations.
    Aggregation,
    /// The Cholesky factor of the stiffness.
    #[cfg(feature = "direct")]
    Factor,
}

/// How a static problem is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticSettings {
    /// The method.
    pub method: StaticMethod,
    /// Its preconditioner.
    pub preconditioning: Preconditioning,
    /// When an equilibrium is accurate enough.
    pub stop: StopRule,
    /// Iterations of the method per load step.
    pub max_iterations: usize,
    /// First load step, as a share of the load, in `(0, 1]`; doubled after a success and halved after a failure.
    pub first_step: f64,
    /// The load step below which the solve gives up, in `(0, 1]`.
    pub smallest_step: f64,
}

impl StaticSettings {
    /// Block Jacobi, the whole load at once, halved down to 1/1024 of it; 100 Newton steps or 100,000 of the others.
    #[must_use]
    pub fn new(method: StaticMethod, stop: StopRule) -> Self {
        let max_iterations = if method == StaticMethod::NewtonCg { 100 } else { 100_000 };
        let preconditioning = Preconditioning::BlockJacobi;
        Self { method, preconditioning, stop, max_iterations, first_step: 1.0, smallest_step: 1.0 / 1024.0 }
    }

    pub(super) fn validate(&self) -> Result<(), StaticError> {
        for (name, value) in [("first_step", self.first_step), ("smallest_step", self.smallest_step)] {
            if !(value > 0.0 && value <= 1.0) {
                return Err(StaticError::LoadStep { name, value });
            }
        }
        Ok(self.stop.validate()?)
    }
}
