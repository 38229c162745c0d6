//! A time step as a minimisation.

use super::StageTimes;
use super::following::{Following, Weights};
use super::scheme::Coefficients;
use super::settings::Damping;
use crate::body::Body;
use crate::material::Hyperelastic;
use std::time::Instant;
use stylet_solver::LinearOperator;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;
use stylet_solver::vector;

/// `|u - u^|_M^2 / 2 cx + W(u) - f.u + (cx / 2 cv) v.D v` with `v = v^ + (cv / cx)(u - u^)`: its gradient is what the
/// equation of motion leaves, its Hessian that matrix over `cx`.
///
/// Source: Radovitzky & Ortiz (1999), Comput. Methods Appl. Mech. Eng. 172, for Newmark's method.
pub(super) struct Incremental<'a, const D: usize, const N: usize, M> {
    pub body: &'a mut Body<D, N, M>,
    pub coefficients: Coefficients,
    pub damping: Damping,
    pub load: &'a [f64],
    /// `u^` and `v^`.
    pub u_hat: &'a [f64],
    pub v_hat: &'a [f64],
    /// The damping matrix but for what is in proportion to the mass, and its number; there if that is not zero.
    pub lagged: Option<(&'a BlockCsr<D>, u64)>,
    pub hessian: &'a mut Following<D>,
    pub scratch: [&'a mut Vec<f64>; 3],
    /// Rounding errors of the strain energy, J.
    pub round_off: f64,
    pub elements_updated: u64,
    pub times: StageTimes,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Incremental<'_, D, N, M> {
    /// Where the minimisation starts: at `u`, where free nodes have gone on as they did, or where they were at the start of the
    /// step if that has less energy. What is found has then no more than the start had: no step gains energy out of nothing.
    pub fn choose_start(&mut self, before: &[f64], subspace: &Subspace<D>, u: &mut [f64], other: &mut [f64]) {
        other.copy_from_slice(before);
        let (stay, moved) = (other.as_chunks_mut::<D>().0, u.as_chunks::<D>().0);
        for (node, constraint) in subspace.constrained() {
            let (free, held) = (constraint.project(stay[node]), constraint.project(moved[node]));
            stay[node] = std::array::from_fn(|k| free[k] + moved[node][k] - held[k]);
        }
        let energy = self.value(other);
        if energy < self.value(u) {
            u.copy_from_slice(other);
        }
    }

    /// Size of the forces of the step, N: the load, and elastic forces and inertia where the step and the minimisation start.
    /// A start that [`choose_start`](Self::choose_start) has turned down would say nothing: what a crushed body would do if it
    /// went on for a step may be beyond all forces that it ever meets.
    pub fn scale(&mut self, before: &[f64], u: &[f64], force: &mut [f64]) -> f64 {
        let mut scale = vector::norm2(self.load);
        for u in [before, u] {
            self.difference(u);
            let since = Instant::now();
            self.body.internal_force(u, force);
            self.times.forces.add(since);
            let [d, _, product] = &mut self.scratch;
            self.body.apply_mass(d, product);
            let elastic = vector::norm2(force);
            // An element that is flat has no finite force in some laws.
            scale += vector::norm2(product) / self.coefficients.cx + if elastic.is_finite() { elastic } else { 0.0 };
        }
        scale
    }

    /// Fills the scratch vectors: `u - u^`, `v`, and room for a product.
    fn difference(&mut self, u: &[f64]) {
        let rate = self.coefficients.cv / self.coefficients.cx;
        let [d, v, _] = &mut self.scratch;
        for (((d, v), (u, u_hat)), v_hat) in
            d.iter_mut().zip(v.iter_mut()).zip(u.iter().zip(self.u_hat)).zip(self.v_hat)
        {
            *d = u - u_hat;
            *v = v_hat + rate * *d;
        }
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Energy for Incremental<'_, D, N, M> {
    fn dim(&self) -> usize {
        self.body.dim()
    }

    fn value(&mut self, u: &[f64]) -> f64 {
        self.difference(u);
        let Coefficients { cx, cv, .. } = self.coefficients;
        let since = Instant::now();
        let strain = self.body.value(u);
        self.times.forces.add(since);
        let [d, v, product] = &mut self.scratch;
        self.body.apply_mass(d, product);
        let mut value = 0.5 / cx * vector::dot(d, product) + strain - vector::dot(self.load, u);
        let half_ratio = 0.5 * cx / cv;
        if self.damping.mass > 0.0 {
            self.body.apply_mass(v, product);
            value += half_ratio * self.damping.mass * vector::dot(v, product);
        }
        if let Some((lagged, _)) = self.lagged {
            lagged.apply(v, product);
            value += half_ratio * vector::dot(v, product);
        }
        if value.is_nan() { f64::INFINITY } else { value }
    }

    fn gradient(&mut self, u: &[f64], g: &mut [f64]) {
        self.difference(u);
        let since = Instant::now();
        self.body.gradient(u, g);
        self.times.forces.add(since);
        vector::axpy(-1.0, self.load, g);
        let [d, v, product] = &mut self.scratch;
        self.body.apply_mass(d, product);
        vector::axpy(1.0 / self.coefficients.cx, product, g);
        if self.damping.mass > 0.0 {
            self.body.apply_mass(v, product);
            vector::axpy(self.damping.mass, product, g);
        }
        if let Some((lagged, _)) = self.lagged {
            lagged.apply(v, product);
            vector::axpy(1.0, product, g);
        }
    }

    fn linearize(&mut self, u: &[f64]) {
        let since = Instant::now();
        self.body.linearize(u);
        let since = self.times.linearize.add(since);
        self.elements_updated += self.body.elements_updated() as u64;
        let Coefficients { cx, cv, .. } = self.coefficients;
        let mass = 1.0 / cx + self.damping.mass * cv / cx;
        let weights = Weights { stiffness: 1.0, mass, lagged: cv / cx };
        // A pattern beyond 32-bit indices has failed when the body was built.
        if self.hessian.follow(self.body, weights, self.lagged).is_err() {
            self.hessian.reset();
        }
        self.times.matrix.add(since);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.hessian.matrix.apply(p, hp);
    }

    fn max_step(&mut self, u: &[f64], p: &[f64], limit: f64) -> f64 {
        self.body.max_step(u, p, limit)
    }

    fn value_round_off(&self) -> f64 {
        self.round_off
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> BlockHessian<D> for Incremental<'_, D, N, M> {
    fn matrix(&self) -> &BlockCsr<D> {
        &self.hessian.matrix
    }
}
