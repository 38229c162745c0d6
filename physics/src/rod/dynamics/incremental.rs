//! What a step of time minimises, and matrices that are sums of stiffness and mass.

use crate::dynamics::{Coefficients, Damping};
use crate::rod::RodPotential;
use stylet_solver::LinearOperator;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::sparse::BlockCsr;

/// `|x - x^|_M^2 / 2 cx + E(x) + (cx / 2 cv) v.D v` with `v = v^ + (x - x^) cv / cx`, `D` as at the start of the step. Where it
/// is smallest the equation of motion holds at the end of the step.
pub(super) struct Incremental<'a> {
    pub potential: RodPotential<'a>,
    pub coefficients: Coefficients,
    pub damping: Damping,
    /// Stiffness at the start of the step, used if damping is proportional to it.
    pub stiffness: &'a BlockCsr<3>,
    /// By node.
    pub mass: &'a [f64],
    pub x_hat: &'a [f64],
    pub v_hat: &'a [f64],
    /// Velocity and damping force.
    pub scratch: &'a mut [Vec<f64>; 2],
}

impl Incremental<'_> {
    /// Leaves the velocity at `x` and the damping force there in the scratch vectors.
    fn damp(&mut self, x: &[f64]) {
        let [v, dv] = &mut *self.scratch;
        let rate = self.coefficients.cv / self.coefficients.cx;
        for i in 0..x.len() {
            v[i] = self.v_hat[i] + rate * (x[i] - self.x_hat[i]);
        }
        apply_damping(self.damping, self.stiffness, self.mass, v, dv);
    }
}

/// Overwrites `dv` with `(damping.mass M + damping.stiffness K) v`.
pub(super) fn apply_damping(damping: Damping, stiffness: &BlockCsr<3>, mass: &[f64], v: &[f64], dv: &mut [f64]) {
    dv.fill(0.0);
    if damping.stiffness > 0.0 {
        stiffness.apply(v, dv);
        dv.iter_mut().for_each(|d| *d *= damping.stiffness);
    }
    for i in 0..v.len() {
        dv[i] += damping.mass * mass[i / 3] * v[i];
    }
}

/// Adds `share` of the mass to the diagonal.
pub(super) fn add_mass(matrix: &mut BlockCsr<3>, mass: &[f64], share: f64) {
    for (i, &m) in mass.iter().enumerate() {
        if let Some(block) = matrix.get_mut(i, i) {
            (0..3).for_each(|k| block[k][k] += share * m);
        }
    }
}

/// Adds `share` of another matrix with the same pattern.
pub(super) fn add_scaled(matrix: &mut BlockCsr<3>, other: &BlockCsr<3>, share: f64) {
    for i in 0..matrix.n_rows() {
        let to = matrix.row_mut(i).1.as_flattened_mut().as_flattened_mut();
        let from = other.row(i).1.as_flattened().as_flattened();
        to.iter_mut().zip(from).for_each(|(to, from)| *to += share * from);
    }
}

/// Overwrites `matrix` with `share` of another one.
pub(super) fn copy_scaled(matrix: &mut BlockCsr<3>, other: &BlockCsr<3>, share: f64) {
    let n = other.n_rows();
    if matrix.n_rows() != n || (0..n).any(|i| matrix.row(i).0 != other.row(i).0) {
        matrix.clone_from(other);
    }
    for i in 0..n {
        matrix.row_mut(i).1.fill([[0.0; 3]; 3]);
    }
    add_scaled(matrix, other, share);
}

impl Energy for Incremental<'_> {
    fn dim(&self) -> usize {
        self.potential.dim()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        let mut energy = self.potential.value(x);
        self.damp(x);
        let c = &self.coefficients;
        let [v, dv] = &*self.scratch;
        for i in 0..x.len() {
            let inertia = self.mass[i / 3] * (x[i] - self.x_hat[i]).powi(2) / (2.0 * c.cx);
            energy += inertia + 0.5 * c.cx / c.cv * v[i] * dv[i];
        }
        energy
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.potential.gradient(x, g);
        self.damp(x);
        for i in 0..x.len() {
            g[i] += self.mass[i / 3] * (x[i] - self.x_hat[i]) / self.coefficients.cx + self.scratch[1][i];
        }
    }

    fn linearize(&mut self, x: &[f64]) {
        self.potential.linearize(x);
        let (c, damping) = (&self.coefficients, self.damping);
        let matrix = self.potential.matrix_mut();
        if damping.stiffness > 0.0 {
            add_scaled(matrix, self.stiffness, damping.stiffness * c.cv / c.cx);
        }
        add_mass(matrix, self.mass, (1.0 + damping.mass * c.cv) / c.cx);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.potential.hessian_apply(p, hp);
    }

    fn value_round_off(&self) -> f64 {
        self.potential.value_round_off()
    }
}

impl BlockHessian<3> for Incremental<'_> {
    fn matrix(&self) -> &BlockCsr<3> {
        self.potential.matrix()
    }
}
