//! Taylor tests: does a derivative belong to its function?

use crate::energy::Energy;
use crate::vector::{axpy, dot, norm2};

/// Observed order of the remainder of `E(x + h d) ≈ E(x) + h ∇E(x)·d` as `h` goes from 1e-2 to 1e-3: 2 for a correct
/// gradient, 1 for a wrong one, infinite where the energy is linear. Choose `|direction|` such that 1e-2 of it bends the
/// energy clearly yet mildly.
pub fn taylor_gradient(energy: &mut impl Energy, x: &[f64], direction: &[f64]) -> f64 {
    let mut g = vec![0.0; x.len()];
    energy.gradient(x, &mut g);
    let (value, slope) = (energy.value(x), dot(&g, direction));
    let scale = value.abs() + 1e-2 * slope.abs();
    order(scale, |h| (energy.value(&moved(x, h, direction)) - value - h * slope).abs())
}

/// Observed order of the remainder of `∇E(x + h d) ≈ ∇E(x) + h H d`, in the 2-norm, as `h` goes from 1e-2 to 1e-3: 2 for
/// a correct Hessian, 1 for a wrong one, infinite where the gradient is linear. Linearises the energy at `x`.
pub fn taylor_hessian(energy: &mut impl Energy, x: &[f64], direction: &[f64]) -> f64 {
    let (mut g, mut hd, mut moved_g) = (vec![0.0; x.len()], vec![0.0; x.len()], vec![0.0; x.len()]);
    energy.gradient(x, &mut g);
    energy.linearize(x);
    energy.hessian_apply(direction, &mut hd);
    let scale = norm2(&g) + 1e-2 * norm2(&hd);
    order(scale, |h| {
        energy.gradient(&moved(x, h, direction), &mut moved_g);
        axpy(-1.0, &g, &mut moved_g);
        axpy(-h, &hd, &mut moved_g);
        norm2(&moved_g)
    })
}

fn moved(x: &[f64], h: f64, direction: &[f64]) -> Vec<f64> {
    x.iter().zip(direction).map(|(x, d)| x + h * d).collect()
}

/// A remainder of rounding errors alone, relative to `scale`, means that there is nothing left to expand.
fn order(scale: f64, mut remainder: impl FnMut(f64) -> f64) -> f64 {
    let (coarse, fine) = (remainder(1e-2), remainder(1e-3));
    if coarse <= 1e-13 * scale || fine == 0.0 {
        return f64::INFINITY;
    }
    (coarse / fine).log10()
}
