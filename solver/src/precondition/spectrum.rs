//! The largest eigenvalue of `D⁺ A` on `W`.

use super::block_jacobi::multiply;
use super::projected::ProjectedOperator;
use crate::LinearOperator;
use crate::memory::bytes_of_all;
use crate::real::Real;
use crate::team::Team;

/// Steps of the recurrence. Its largest Ritz value is then within a few per cent for elasticity and for Laplacians.
const STEPS: usize = 12;

/// Working vectors of the length of the matrix.
#[derive(Clone, Debug, Default)]
pub(super) struct Vectors<T = f64> {
    /// A residual.
    pub r: Vec<T>,
    /// A step.
    pub d: Vec<T>,
    /// A product.
    pub q: Vec<T>,
    /// A preconditioned residual, or a correction.
    pub z: Vec<T>,
}

impl<T> Vectors<T> {
    /// Bytes that they take, spare room included.
    pub fn memory_bytes(&self) -> usize {
        bytes_of_all([&self.r, &self.d, &self.q, &self.z])
    }
}

impl<T: Real> Vectors<T> {
    pub fn resize(&mut self, n: usize) {
        for v in [&mut self.r, &mut self.d, &mut self.q, &mut self.z] {
            v.resize(n, T::ZERO);
        }
    }
}

/// A lower bound of the largest eigenvalue, usually within a few per cent of it: the largest Ritz value of the Lanczos
/// process, here in the form of conjugate gradients preconditioned by `D⁺`, from a start vector that depends on the size
/// alone. `Err` holds a negative curvature: the matrix is then not positive semidefinite. 0 if `W` holds nothing but 0.
///
/// Source: Golub & Van Loan, *Matrix Computations*, 4th ed. (2013), sections 10.3 and 11.3.
pub(super) fn largest_eigenvalue<const B: usize, T: Real>(
    a: &ProjectedOperator<B, T>,
    team: &Team,
    work: &mut Vectors<T>,
) -> Result<f64, f64> {
    work.resize(a.dim());
    let Vectors { r, d: p, q, z } = work;
    start(a, r);
    let mut tridiagonal = Tridiagonal::default();
    multiply(&a.projected.inverses, r, z);
    let mut rz = team.dot(r, z);
    let first = rz;
    p.copy_from_slice(z);
    let (mut alpha_before, mut beta) = (1.0, 0.0);
    for _ in 0..STEPS {
        if rz <= T::EPSILON.to_f64() * first {
            break; // the Krylov space is exhausted: the Ritz values are eigenvalues
        }
        let curvature = a.apply_dot_on(team, p, q);
        if curvature < -4096.0 * T::EPSILON.to_f64() * rz {
            return Err(curvature);
        }
        if curvature <= 0.0 {
            break;
        }
        let alpha = rz / curvature;
        tridiagonal.push(1.0 / alpha + beta / alpha_before, f64::sqrt(beta) / alpha_before);
        team.axpy(T::from_f64(-alpha), q, r);
        multiply(&a.projected.inverses, r, z);
        let next = team.dot(r, z);
        beta = next / rz;
        team.xpby(z, T::from_f64(beta), p);
        (rz, alpha_before) = (next, alpha);
    }
    Ok(tridiagonal.largest_eigenvalue())
}

/// Numbers in (-1, 1) that look random (SplitMix64), projected.
fn start<const B: usize, T: Real>(a: &ProjectedOperator<B, T>, r: &mut [T]) {
    let mut state = 0u64;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    for ((r, block), constraint) in
        r.as_chunks_mut::<B>().0.iter_mut().zip(&a.projected.inverses).zip(&a.projected.constraints)
    {
        // The residual of a smooth right side: large where the diagonal is, or soft nodes would hide behind stiff ones.
        let scale = block.iter().enumerate().map(|(k, row)| row[k].to_f64()).sum::<f64>();
        let scale = if scale > 0.0 { scale.sqrt().recip() } else { 0.0 };
        *r = constraint.project(std::array::from_fn(|_| scale * next())).map(T::from_f64);
    }
}

/// A symmetric tridiagonal matrix that grows by one row at a time.
#[derive(Default)]
struct Tridiagonal {
    diagonal: [f64; STEPS],
    /// `off[k]` couples `k - 1` and `k`.
    off: [f64; STEPS],
    n: usize,
}

impl Tridiagonal {
    fn push(&mut self, diagonal: f64, off: f64) {
        self.diagonal[self.n] = diagonal;
        self.off[self.n] = off;
        self.n += 1;
    }

    /// By bisection on the number of eigenvalues above a value (Sturm's sequence).
    fn largest_eigenvalue(&self) -> f64 {
        let reach = |k: usize| {
            let after = if k + 1 < self.n { self.off[k + 1] } else { 0.0 };
            let before = if k > 0 { self.off[k] } else { 0.0 };
            self.diagonal[k] + before.abs() + after.abs()
        };
        let (mut low, mut high) = (0.0, (0..self.n).map(reach).fold(0.0, f64::max));
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.all_below(middle) { high = middle } else { low = middle }
        }
        high
    }

    fn all_below(&self, value: f64) -> bool {
        let mut pivot = 1.0;
        (0..self.n).all(|k| {
            let coupling = if k > 0 { self.off[k] * self.off[k] / pivot } else { 0.0 };
            pivot = value - self.diagonal[k] - coupling;
            pivot > 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::BlockCsr;
    use crate::subspace::Subspace;

    /// The path graph's Laplacian with Dirichlet ends: `D⁻¹ A` has the largest eigenvalue `1 + cos(π/(n+1))`.
    #[test]
    fn the_estimate_is_near_the_eigenvalue_and_not_above() {
        for n in [1, 2, 5, 200] {
            let mut a = BlockCsr::<1>::new(n);
            for i in 0..n {
                let cols: Vec<u32> = (i.saturating_sub(1)..(i + 2).min(n)).map(|j| j as u32).collect();
                let blocks: Vec<_> = cols.iter().map(|&j| if j as usize == i { [[2.0]] } else { [[-1.0]] }).collect();
                a.set_row(i, &cols, &blocks).unwrap();
            }
            let mut projected = ProjectedOperator::<1>::default();
            projected.rebuild(&Team::serial(), &a, &Subspace::new(n)).unwrap();
            let exact = 1.0 + (std::f64::consts::PI / (n as f64 + 1.0)).cos();
            let estimate = largest_eigenvalue(&projected, &Team::serial(), &mut Vectors::default()).unwrap();
            assert!(estimate <= exact * (1.0 + 1e-12) && estimate >= 0.95 * exact, "{n}: {estimate} {exact}");
            if n <= STEPS {
                assert!((estimate - exact).abs() < 1e-10, "{n}: {estimate} {exact}");
            }
        }
    }
}
