//! What the nonlinear methods share: the measure of an iterate, the report, the errors.

use crate::energy::Energy;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRule, StopRuleError};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{first_not_finite, norm2};

/// How a minimisation went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonlinearReport {
    /// Why it ended; the iterate is kept in any case.
    pub stop: Stop,
    /// Accepted steps.
    pub iterations: usize,
    /// Iterations of the linear solves inside.
    pub inner_iterations: usize,
    /// Gradient evaluations.
    pub gradients: usize,
    /// Energy evaluations.
    pub values: usize,
    /// Calls of [`Energy::linearize`].
    pub linearizations: usize,
    /// Products with the Hessian.
    pub products: usize,
    /// `‖P_W ∇E‖₂` of the iterate returned.
    pub residual_norm: f64,
    /// `‖(I − P_W) ∇E‖₂`: norm of the reaction forces.
    pub reaction_norm: f64,
    /// What the residual norm was last compared with.
    pub threshold: f64,
}

/// Why a minimisation could not be carried out. `x` then holds the last accepted iterate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NonlinearError {
    /// A vector, the subspace or the Hessian does not fit the energy.
    #[error("energy has {dim} variables, {what} has {len}")]
    Shape {
        /// Which argument.
        what: &'static str,
        /// Number of variables of the energy.
        dim: usize,
        /// Length of the argument.
        len: usize,
    },
    /// The stopping rule, or the norm of the external forces, makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// A setting makes no sense.
    #[error("{name} is {value}: {expected}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// The starting point holds NaN or an infinity.
    #[error("entry {index} of the starting point is not finite")]
    StartNotFinite {
        /// First entry that is not finite.
        index: usize,
    },
    /// The gradient is not finite where the iteration stands: the starting point lies outside the domain.
    #[error("entry {index} of the gradient is not finite at iteration {iteration}")]
    GradientNotFinite {
        /// First entry that is not finite, or 0 if only the norm overflows.
        index: usize,
        /// Iteration, 0 at the start.
        iteration: usize,
    },
    /// The energy is not finite where the iteration stands: the starting point lies outside the domain.
    #[error("the energy is {value} at iteration {iteration}")]
    EnergyNotFinite {
        /// Its value.
        value: f64,
        /// Iteration, 0 at the start.
        iteration: usize,
    },
    /// The product of the Hessian and a finite vector is not finite.
    #[error("entry {index} of a Hessian product is not finite at iteration {iteration}")]
    HessianNotFinite {
        /// First entry that is not finite, or 0 if only a sum overflows.
        index: usize,
        /// Iteration, 0 at the start.
        iteration: usize,
    },
    /// The preconditioner is not positive definite on the subspace, or its product is not finite.
    #[error("gᵀM⁻¹g = {value:e} at iteration {iteration}: the preconditioner is not positive definite")]
    PreconditionerNotPositive {
        /// The value that should have been positive and finite.
        value: f64,
        /// Iteration, 0 at the start.
        iteration: usize,
    },
}

/// `gᵀM⁻¹g` as a preconditioner gives it: no error if rounding has made it zero.
pub(super) fn positive(value: f64, iteration: usize) -> Result<f64, NonlinearError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(NonlinearError::PreconditionerNotPositive { value, iteration })
}

/// Evaluations so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub iterations: usize,
    pub inner_iterations: usize,
    pub gradients: usize,
    pub values: usize,
    pub linearizations: usize,
    pub products: usize,
}

/// Norms of the two parts of a gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct Norms {
    pub residual: f64,
    pub reaction: f64,
}

/// What does not change during a minimisation.
pub(super) struct Problem<'a, const B: usize> {
    pub w: &'a Subspace<B>,
    pub stop: &'a StopRule,
    pub external_norm: f64,
}

impl<'a, const B: usize> Problem<'a, B> {
    pub fn new(
        energy: &impl Energy,
        w: &'a Subspace<B>,
        stop: &'a StopRule,
        external_norm: f64,
        x: &[f64],
    ) -> Result<Self, NonlinearError> {
        stop.validate()?;
        if !(external_norm >= 0.0 && external_norm.is_finite()) {
            return Err(StopRuleError::ExternalNorm(external_norm).into());
        }
        let dim = energy.dim();
        for (what, len) in [("x", x.len()), ("the subspace", w.dim())] {
            if len != dim {
                return Err(NonlinearError::Shape { what, dim, len });
            }
        }
        if let Some(index) = first_not_finite(x) {
            return Err(NonlinearError::StartNotFinite { index });
        }
        Ok(Self { w, stop, external_norm })
    }

    /// `g ← P_W ∇E(x)`, `reaction ← (I − P_W) ∇E(x)`; norms that are not finite tell of a point outside the domain.
    pub fn gradient(
        &self,
        energy: &mut impl Energy,
        x: &[f64],
        g: &mut [f64],
        reaction: &mut [f64],
        counts: &mut Counts,
    ) -> Norms {
        energy.gradient(x, g);
        counts.gradients += 1;
        self.w.split(g, reaction);
        Norms { residual: norm2(g), reaction: norm2(reaction) }
    }

    /// `z ← P_W M⁻¹ g`.
    pub fn precondition(&self, team: &Team, m: &(impl Preconditioner + ?Sized), g: &[f64], z: &mut [f64]) {
        m.apply_on(team, g, z);
        self.w.project(z);
    }

    /// [`gradient`](Self::gradient) at the start, which must be finite.
    pub fn first_gradient(
        &self,
        energy: &mut impl Energy,
        x: &[f64],
        g: &mut [f64],
        reaction: &mut [f64],
        counts: &mut Counts,
    ) -> Result<Norms, NonlinearError> {
        let norms = self.gradient(energy, x, g, reaction, counts);
        if norms.residual.is_finite() && norms.reaction.is_finite() {
            return Ok(norms);
        }
        self.w.add_complement(reaction, g);
        let index = first_not_finite(g).unwrap_or(0);
        Err(NonlinearError::GradientNotFinite { index, iteration: 0 })
    }

    pub fn threshold(&self, norms: Norms) -> f64 {
        self.stop.threshold(self.external_norm, norms.reaction)
    }

    pub fn report(&self, stop: Stop, norms: Norms, counts: &Counts) -> NonlinearReport {
        NonlinearReport {
            stop,
            iterations: counts.iterations,
            inner_iterations: counts.inner_iterations,
            gradients: counts.gradients,
            values: counts.values,
            linearizations: counts.linearizations,
            products: counts.products,
            residual_norm: norms.residual,
            reaction_norm: norms.reaction,
            threshold: self.threshold(norms),
        }
    }
}
