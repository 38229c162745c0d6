//! The linear solve inside Newton's method: conjugate gradients from zero that stop at negative curvature.

use crate::LinearOperator;
use crate::precondition::Preconditioner;
use crate::subspace::Subspace;
use crate::vector::{self, dot, norm2};

/// Vectors of the solve; `step` is the result.
#[derive(Clone, Debug, Default)]
pub(super) struct Vectors {
    pub step: Vec<f64>,
    r: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    z: Vec<f64>,
}

impl Vectors {
    pub fn resize(&mut self, n: usize) {
        let Self { step, r, p, q, z } = self;
        for v in [step, r, p, q, z] {
            v.resize(n, 0.0);
        }
    }
}

/// How the solve went.
pub(super) struct Outcome {
    pub iterations: usize,
    /// `‖P_W (g + H step)‖₂`.
    pub residual: f64,
}

/// Solves `P_W H P_W step = −g` up to a residual norm of `target`. At a direction of negative curvature the step so far is
/// kept; if it is the very first one, that direction is followed as far as if its curvature had the other sign. `None` if a
/// product is not finite.
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithm 7.1.
pub(super) fn solve<const B: usize>(
    h: &impl LinearOperator,
    m: &dyn Preconditioner,
    w: &Subspace<B>,
    g: &[f64],
    target: f64,
    max_iterations: usize,
    v: &mut Vectors,
) -> Option<Outcome> {
    let Vectors { step, r, p, q, z } = v;
    step.fill(0.0);
    for (r, g) in r.iter_mut().zip(g) {
        *r = -g;
    }
    let mut residual = norm2(r);
    let mut rz = precondition(m, w, r, z)?;
    p.copy_from_slice(z);
    for iteration in 1..=max_iterations {
        if rz <= 0.0 {
            // Squares of the residual underflow: nothing is left to solve.
            return Some(Outcome { iterations: iteration - 1, residual });
        }
        let curvature = h.apply_dot(p, q);
        if !curvature.is_finite() {
            return None;
        }
        if curvature <= 0.0 {
            if iteration == 1 {
                let length = if curvature < 0.0 { rz / -curvature } else { 1.0 };
                vector::axpy(length, p, step);
            }
            return Some(Outcome { iterations: iteration, residual });
        }
        w.project(q);
        let alpha = rz / curvature;
        residual = vector::step_residual(alpha, p, q, step, r).sqrt();
        if residual <= target {
            return Some(Outcome { iterations: iteration, residual });
        }
        let before = rz;
        rz = precondition(m, w, r, z)?;
        vector::xpby(z, rz / before, p);
    }
    Some(Outcome { iterations: max_iterations, residual })
}

/// `z ← P_W M⁻¹ r` and `rᵀz`; `None` unless that is finite.
fn precondition<const B: usize>(m: &dyn Preconditioner, w: &Subspace<B>, r: &[f64], z: &mut [f64]) -> Option<f64> {
    m.apply(r, z);
    w.project(z);
    let rz = dot(r, z);
    rz.is_finite().then_some(rz)
}
