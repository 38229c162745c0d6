//! The linear solve inside Newton's method: conjugate gradients from zero that stop at negative curvature.

use crate::LinearOperator;
use crate::memory::bytes_of_all;
use crate::precondition::Preconditioner;
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector;

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

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        bytes_of_all([&self.step, &self.r, &self.p, &self.q, &self.z])
    }
}

/// What is solved, and by whom.
pub(super) struct System<'a, const B: usize> {
    pub team: &'a Team,
    pub h: &'a dyn LinearOperator,
    pub m: &'a dyn Preconditioner,
    pub w: &'a Subspace<B>,
}

/// How the solve went.
pub(super) struct Outcome {
    pub iterations: usize,
    /// `‖P_W (g + H step)‖₂`.
    pub residual: f64,
}

/// Why there is no step.
pub(super) enum Broken {
    /// A product with the Hessian is not finite.
    Hessian,
    /// `gᵀM⁻¹g` is negative or not finite.
    Preconditioner(f64),
}

/// Solves `P_W H P_W step = −g` up to a residual norm of `target`. At a direction of negative curvature the step so far is
/// kept; if it is the very first one, that direction is followed as far as if its curvature had the other sign. The team makes
/// the products, with the same bits as one thread.
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithm 7.1.
pub(super) fn solve<const B: usize>(
    system: &System<B>,
    g: &[f64],
    target: f64,
    max_iterations: usize,
    v: &mut Vectors,
) -> Result<Outcome, Broken> {
    let &System { team, h, m: _, w } = system;
    let Vectors { step, r, p, q, z } = v;
    step.fill(0.0);
    for (r, g) in r.iter_mut().zip(g) {
        *r = -g;
    }
    let mut residual = team.norm2(r);
    let mut rz = system.precondition(r, z)?;
    if rz < 0.0 {
        return Err(Broken::Preconditioner(rz));
    }
    p.copy_from_slice(z);
    for iteration in 1..=max_iterations {
        if rz <= 0.0 {
            // Squares of the residual underflow: nothing is left to solve.
            return Ok(Outcome { iterations: iteration - 1, residual });
        }
        let curvature = h.apply_dot_on(team, p, q);
        if !curvature.is_finite() {
            return Err(Broken::Hessian);
        }
        if curvature <= 0.0 {
            if iteration == 1 {
                let length = if curvature < 0.0 { rz / -curvature } else { 1.0 };
                team.axpy(length, p, step);
            }
            return Ok(Outcome { iterations: iteration, residual });
        }
        w.project(q);
        let alpha = rz / curvature;
        residual = vector::step_residual(alpha, p, q, step, r).sqrt();
        if residual <= target {
            return Ok(Outcome { iterations: iteration, residual });
        }
        let before = rz;
        rz = system.precondition(r, z)?;
        team.xpby(z, rz / before, p);
    }
    Ok(Outcome { iterations: max_iterations, residual })
}

impl<const B: usize> System<'_, B> {
    /// `z ← P_W M⁻¹ r` and `rᵀz`, which must be finite.
    fn precondition(&self, r: &[f64], z: &mut [f64]) -> Result<f64, Broken> {
        self.m.apply_on(self.team, r, z);
        self.w.project(z);
        let rz = self.team.dot(r, z);
        if rz.is_finite() { Ok(rz) } else { Err(Broken::Preconditioner(rz)) }
    }
}
