//! A preconditioner in `f32` for vectors in `f64`.

use super::Preconditioner;
use super::scratch::Scratch;
use crate::team::Team;

/// Rounds the residual to `f32`, applies `M⁻¹` there, and gives the result in `f64`: a multilevel cycle reads half the bytes.
///
/// The residual is scaled by a power of two first, so that it leaves the range of `f32` in neither direction. Rounding
/// perturbs `M⁻¹` by parts in 10⁷, a nonsymmetric part among them, which conjugate gradients do not notice at the tolerances
/// of simulations. Unlike [`mixed_cg`](crate::linear::mixed_cg) the method itself stays in `f64`, so that it takes no more
/// iterations where the condition of the matrix is high.
#[derive(Clone, Debug, Default)]
pub struct SinglePrecision<P> {
    inner: P,
    scratch: Scratch<Vectors>,
}

#[derive(Clone, Debug, Default)]
struct Vectors {
    r: Vec<f32>,
    z: Vec<f32>,
}

impl<P> SinglePrecision<P> {
    /// Wraps a preconditioner.
    pub fn new(inner: P) -> Self {
        Self { inner, scratch: Scratch::default() }
    }

    /// The preconditioner.
    pub fn inner(&self) -> &P {
        &self.inner
    }

    /// The preconditioner, to rebuild it.
    pub fn inner_mut(&mut self) -> &mut P {
        &mut self.inner
    }
}

impl<P: Preconditioner<f32> + Send> Preconditioner for SinglePrecision<P> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.apply_on(&Team::serial(), r, z);
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        let Vectors { r: r32, z: z32 } = &mut *self.scratch.lock();
        r32.resize(r.len(), 0.0);
        z32.resize(z.len(), 0.0);
        let scale = power_of_two(r.iter().fold(0.0, |largest, v| v.abs().max(largest)));
        convert(team, r, r32, |r| (r / scale) as f32);
        self.inner.apply_on(team, r32, z32);
        convert(team, z32, z, |z| f64::from(z) * scale);
    }
}

/// Each number of `from`, converted, to the same place of `to`.
fn convert<A: Copy + Sync, B: Send>(team: &Team, from: &[A], to: &mut [B], rule: impl Fn(A) -> B + Sync) {
    let n = from.len();
    team.each(&mut team.split(to)[..team.size()], |member, to| {
        for (to, from) in to.iter_mut().zip(&from[team.share(n, member)]) {
            *to = rule(*from);
        }
    });
}

/// The power of two at or below a positive number, at least the smallest normal one; 1 for zero and for what is not finite.
fn power_of_two(value: f64) -> f64 {
    if value > 0.0 && value.is_finite() {
        f64::from_bits(value.max(f64::MIN_POSITIVE).to_bits() & f64::INFINITY.to_bits())
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::precondition::BlockJacobi;
    use crate::sparse::BlockCsr;
    use crate::subspace::Subspace;

    #[test]
    fn any_size_of_residual_keeps_seven_digits() {
        let mut a = BlockCsr::<2>::new(2);
        a.set_row(0, &[0], &[[[3.0, 1.0], [1.0, 5.0]]]).unwrap();
        a.set_row(1, &[1], &[[[7.0, 0.0], [0.0, 0.1]]]).unwrap();
        let w = Subspace::new(2);
        let exact = BlockJacobi::new(&a, &w).unwrap();
        let single = SinglePrecision::new(BlockJacobi::in_single_precision(&a, &w).unwrap());
        for size in [1e-290, 1e-40, 1.0, 1e30, 1e290] {
            let r = [0.3, -1.0, 0.7, 0.2].map(|v| v * size);
            let (mut z, mut expected) = ([f64::NAN; 4], [0.0; 4]);
            single.apply(&r, &mut z);
            exact.apply(&r, &mut expected);
            for (z, expected) in z.iter().zip(expected) {
                assert!((z - expected).abs() <= 1e-6 * size, "{size:e}: {z:e} {expected:e}");
            }
        }
        let mut z = [1.0; 4];
        single.apply(&[0.0; 4], &mut z);
        assert_eq!(z, [0.0; 4]);
    }
}
