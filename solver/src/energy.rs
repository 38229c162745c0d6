//! What the nonlinear methods know of a problem.

use crate::sparse::BlockCsr;

/// A function of `dim` variables to be minimised.
pub trait Energy {
    /// Number of variables.
    fn dim(&self) -> usize;

    /// The energy at `x`; `f64::INFINITY` outside its domain, so that a line search backs away.
    fn value(&mut self, x: &[f64]) -> f64;

    /// Overwrites `g` with the gradient at `x`.
    fn gradient(&mut self, x: &[f64], g: &mut [f64]);

    /// Makes the Hessian at `x`, or a positive approximation of it, the one that [`hessian_apply`](Self::hessian_apply)
    /// applies. May put the work off until it is asked for.
    fn linearize(&mut self, x: &[f64]);

    /// Overwrites `hp` with the product of the Hessian and `p`.
    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]);

    /// The largest `t` up to `limit` such that `x + s p` lies in the domain for all `0 ≤ s < t`; zero if `x` does not, or if
    /// a number is not finite. An energy may spend less on a small limit than on a large or infinite one.
    fn max_step(&mut self, x: &[f64], p: &[f64], limit: f64) -> f64 {
        let _ = (x, p);
        limit
    }

    /// Rounding errors that a value may hold beyond a few units in its own last place, because its terms cancel: two values
    /// that differ by no more are the same to a line search, which then goes by the gradient. Zero by default.
    fn value_round_off(&self) -> f64 {
        0.0
    }
}

/// An energy whose Hessian is assembled in blocks.
pub trait BlockHessian<const B: usize>: Energy {
    /// The Hessian at the point of the last [`linearize`](Energy::linearize).
    fn matrix(&self) -> &BlockCsr<B>;
}

/// Methods compiled for `&mut dyn BlockHessian` serve every energy.
impl<E: Energy + ?Sized> Energy for &mut E {
    fn dim(&self) -> usize {
        (**self).dim()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        (**self).value(x)
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        (**self).gradient(x, g);
    }

    fn linearize(&mut self, x: &[f64]) {
        (**self).linearize(x);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        (**self).hessian_apply(p, hp);
    }

    fn max_step(&mut self, x: &[f64], p: &[f64], limit: f64) -> f64 {
        (**self).max_step(x, p, limit)
    }

    fn value_round_off(&self) -> f64 {
        (**self).value_round_off()
    }
}

impl<const B: usize, E: BlockHessian<B> + ?Sized> BlockHessian<B> for &mut E {
    fn matrix(&self) -> &BlockCsr<B> {
        (**self).matrix()
    }
}
