//! An energy under dead loads.

use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::vector;

/// `W(u) - f.u`: its minimiser balances the load `f` (N, flat like `u`).
#[derive(Debug)]
pub struct Loaded<'a, E> {
    energy: &'a mut E,
    load: &'a [f64],
}

impl<'a, E: Energy> Loaded<'a, E> {
    /// Puts `energy` under `load`.
    ///
    /// # Panics
    /// If their dimensions differ.
    pub fn new(energy: &'a mut E, load: &'a [f64]) -> Self {
        assert_eq!(load.len(), energy.dim(), "one load component per displacement component");
        Self { energy, load }
    }
}

impl<E: Energy> Energy for Loaded<'_, E> {
    fn dim(&self) -> usize {
        self.energy.dim()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        self.energy.value(x) - vector::dot(self.load, x)
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.energy.gradient(x, g);
        vector::axpy(-1.0, self.load, g);
    }

    fn linearize(&mut self, x: &[f64]) {
        self.energy.linearize(x);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.energy.hessian_apply(p, hp);
    }

    fn max_step(&mut self, x: &[f64], p: &[f64], limit: f64) -> f64 {
        self.energy.max_step(x, p, limit)
    }
}

impl<const B: usize, E: BlockHessian<B>> BlockHessian<B> for Loaded<'_, E> {
    fn matrix(&self) -> &BlockCsr<B> {
        self.energy.matrix()
    }
}
