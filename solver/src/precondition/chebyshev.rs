//! Chebyshev polynomials in `D⁺ A`: a preconditioner, and the smoother of the multilevel ones.

use super::projected::ProjectedOperator;
use super::scratch::Scratch;
use super::spectrum::{Vectors, largest_eigenvalue};
use super::{Preconditioner, PreconditionerError};
use crate::real::Real;
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::CHUNK;
use crate::{Block, LinearOperator};

/// What a Lanczos estimate of the largest eigenvalue is multiplied with, since it comes from below.
const MARGIN: f64 = 1.1;

/// Which polynomial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChebyshevSettings {
    /// Number of diagonal solves, at least one; the polynomial takes one product fewer.
    pub degree: usize,
    /// The error is damped on `[λ/ratio, λ]`, where `λ` bounds the spectrum of `D⁺ A` from above; above one.
    pub ratio: f64,
}

impl ChebyshevSettings {
    /// Degree `degree` on the upper nine tenths of the spectrum. Wider intervals save a tenth of the iterations of static
    /// elasticity, and double those of time steps, whose spectrum is short.
    #[must_use]
    pub fn new(degree: usize) -> Self {
        Self { degree, ratio: 10.0 }
    }

    pub(super) fn validate(self) -> Result<Self, PreconditionerError> {
        if self.degree == 0 {
            return Err(PreconditionerError::Parameter { name: "degree", value: 0.0 });
        }
        if !(self.ratio > 1.0 && self.ratio.is_finite()) {
            return Err(PreconditionerError::Parameter { name: "ratio", value: self.ratio });
        }
        Ok(self)
    }
}

/// `M⁻¹ = q(D⁺ A) D⁺` with the polynomial `q` for which `1 − t q(t)` is smallest on an interval of the spectrum, in the
/// maximum norm. Needs products alone, so a team shares all of it.
///
/// Source: Adams, Brezina, Hu & Tuminaro, *Parallel multigrid smoothing: polynomial versus Gauss–Seidel*, J. Comput. Phys.
/// 188 (2003); recurrence: Saad, *Iterative Methods for Sparse Linear Systems*, 2nd ed. (2003), Algorithm 12.1.
#[derive(Clone, Debug, Default)]
pub struct Chebyshev<const B: usize> {
    a: ProjectedOperator<B>,
    polynomial: Polynomial,
    scratch: Scratch<Vectors>,
}

impl<const B: usize> Chebyshev<B> {
    /// The preconditioner of `P_W A P_W`; `matrix` must be symmetric.
    ///
    /// # Errors
    /// [`PreconditionerError::Parameter`] if the settings make no sense, [`PreconditionerError::Shape`],
    /// [`PreconditionerError::NotFinite`], [`PreconditionerError::NotPositive`] names a diagonal block without an inverse,
    /// [`PreconditionerError::Indefinite`] if the estimate of the spectrum meets a negative curvature.
    pub fn new(
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        settings: ChebyshevSettings,
    ) -> Result<Self, PreconditionerError> {
        let mut this = Self::default();
        this.rebuild(matrix, subspace, settings)?;
        Ok(this)
    }

    /// As [`new`](Self::new), in the memory at hand.
    ///
    /// # Errors
    /// As [`new`](Self::new); the preconditioner is then of no use until a rebuild succeeds.
    pub fn rebuild(
        &mut self,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        settings: ChebyshevSettings,
    ) -> Result<(), PreconditionerError> {
        let settings = settings.validate()?;
        self.a.rebuild(&Team::serial(), matrix, subspace)?;
        self.polynomial = Polynomial::new(&self.a, &Team::serial(), settings, self.scratch.get_mut())?;
        Ok(())
    }

    /// Upper bound of the spectrum of `D⁺ A` that the polynomial was made for: the estimate and its margin.
    #[must_use]
    pub fn upper(&self) -> f64 {
        self.polynomial.upper
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.a.memory_bytes() + self.scratch.lock().memory_bytes()
    }
}

impl<const B: usize> Preconditioner for Chebyshev<B> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        self.apply_on(&Team::serial(), r, z);
    }

    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        let n = self.a.dim();
        assert!(r.len() == n && z.len() == n, "Chebyshev preconditioner of {n} rows");
        let work = &mut *self.scratch.lock();
        work.r.copy_from_slice(r);
        self.polynomial.smooth(&self.a, team, Guess::Zero, z, work);
    }
}

/// What a smoother starts from.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Guess {
    /// `x = 0`, whatever it holds.
    Zero,
    /// The present `x`.
    Present,
}

/// The polynomial alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Polynomial {
    degree: usize,
    lower: f64,
    pub upper: f64,
}

impl Polynomial {
    /// The polynomial for the spectrum of `a`; sizes `work`.
    pub fn new<const B: usize, T: Real>(
        a: &ProjectedOperator<B, T>,
        team: &Team,
        settings: ChebyshevSettings,
        work: &mut Vectors<T>,
    ) -> Result<Self, PreconditionerError> {
        let largest =
            largest_eigenvalue(a, team, work).map_err(|curvature| PreconditionerError::Indefinite { curvature })?;
        let upper = if largest > 0.0 { MARGIN * largest } else { 1.0 };
        Ok(Self { degree: settings.degree, lower: upper / settings.ratio, upper })
    }

    /// `x ← x + q(D⁺ A) D⁺ r`, where `work.r` holds the residual `r` of `x` and is used up.
    pub fn smooth<const B: usize, T: Real>(
        &self,
        a: &ProjectedOperator<B, T>,
        team: &Team,
        guess: Guess,
        x: &mut [T],
        work: &mut Vectors<T>,
    ) {
        let (centre, half) = (0.5 * (self.upper + self.lower), 0.5 * (self.upper - self.lower));
        let sigma = centre / half;
        let mut rho = 1.0 / sigma;
        let Vectors { r, d, q, .. } = work;
        let first = Step { alpha: 1.0 / centre, beta: 0.0, stage: Stage::First(guess) };
        first.run(team, &a.projected.inverses, q, r, d, x);
        for _ in 1..self.degree {
            a.apply_on(team, d, q);
            let next = 1.0 / (2.0 * sigma - rho);
            let step = Step { alpha: 2.0 * next / half, beta: next * rho, stage: Stage::Later };
            step.run(team, &a.projected.inverses, q, r, d, x);
            rho = next;
        }
    }

    /// The residual after [`smooth`](Self::smooth), in `work.r`: one product.
    pub fn residual_after<const B: usize, T: Real>(
        &self,
        a: &ProjectedOperator<B, T>,
        team: &Team,
        work: &mut Vectors<T>,
    ) {
        a.apply_on(team, &work.d, &mut work.q);
        team.axpy(-T::ONE, &work.q, &mut work.r);
    }
}

/// One step of the recurrence, in one pass over the vectors.
#[derive(Clone, Copy)]
struct Step {
    alpha: f64,
    beta: f64,
    stage: Stage,
}

#[derive(Clone, Copy, PartialEq)]
enum Stage {
    /// `d ← α D⁺ r`, `x ← x + d` or `x ← d`.
    First(Guess),
    /// `r ← r − q`, `d ← β d + α D⁺ r`, `x ← x + d`.
    Later,
}

impl Step {
    fn run<const B: usize, T: Real>(
        self,
        team: &Team,
        inverses: &[Block<B, T>],
        q: &[T],
        r: &mut [T],
        d: &mut [T],
        x: &mut [T],
    ) {
        const { assert!(CHUNK.is_multiple_of(B), "nodes of a block size that does not divide a chunk") };
        let n = x.len();
        let (r, mut d, mut x) = (team.split(r), team.split(d).into_iter(), team.split(x).into_iter());
        let mut parts = r.map(|r| (r, d.next().unwrap_or_default(), x.next().unwrap_or_default()));
        team.each(&mut parts[..team.size()], |member, (r, d, x)| {
            let range = team.share(n, member);
            self.pass(&inverses[range.start / B..range.end / B], &q[range], r, d, x);
        });
    }

    fn pass<const B: usize, T: Real>(self, inverses: &[Block<B, T>], q: &[T], r: &mut [T], d: &mut [T], x: &mut [T]) {
        let q = q.as_chunks::<B>().0.iter();
        let (r, d) = (r.as_chunks_mut::<B>().0.iter_mut(), d.as_chunks_mut::<B>().0.iter_mut());
        let nodes = inverses.iter().zip(q).zip(r).zip(d).zip(x.as_chunks_mut::<B>().0);
        let Self { stage, .. } = self;
        let (alpha, beta) = (T::from_f64(self.alpha), T::from_f64(self.beta));
        // Not compiled for wider vectors: blocks of nine numbers would be shuffled for longer than they are multiplied.
        match stage {
            Stage::First(guess) => {
                for ((((inverse, _), r), d), x) in nodes {
                    for i in 0..B {
                        d[i] = alpha * row_times(&inverse[i], r);
                        x[i] = if guess == Guess::Zero { d[i] } else { x[i] + d[i] };
                    }
                }
            }
            Stage::Later => {
                for ((((inverse, q), r), d), x) in nodes {
                    (0..B).for_each(|i| r[i] -= q[i]);
                    for i in 0..B {
                        d[i] = beta * d[i] + alpha * row_times(&inverse[i], r);
                        x[i] += d[i];
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn row_times<const B: usize, T: Real>(row: &[T; B], r: &[T; B]) -> T {
    (1..B).fold(row[0] * r[0], |sum, j| sum + row[j] * r[j])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `T_k`, also outside of [-1, 1].
    fn chebyshev(k: usize, x: f64) -> f64 {
        let (mut before, mut now) = (1.0, x);
        for _ in 1..k {
            (before, now) = (now, 2.0 * x * now - before);
        }
        now
    }

    /// On eigenvectors of `D⁻¹ A`, here of the path graph, one application multiplies `D⁻¹` by
    /// `(1 − T_k((b + a − 2λ)/(b − a)) / T_k((b + a)/(b − a))) / λ`.
    #[test]
    fn is_the_polynomial() {
        let n = 30;
        let mut a = BlockCsr::<1>::new(n);
        for i in 0..n {
            let cols: Vec<u32> = (i.saturating_sub(1)..(i + 2).min(n)).map(|j| j as u32).collect();
            let blocks: Vec<_> = cols.iter().map(|&j| if j as usize == i { [[2.0]] } else { [[-1.0]] }).collect();
            a.set_row(i, &cols, &blocks).unwrap();
        }
        for degree in 1..6 {
            let settings = ChebyshevSettings { degree, ratio: 7.0 };
            let m = Chebyshev::new(&a, &Subspace::new(n), settings).unwrap();
            let (low, high) = (m.upper() / 7.0, m.upper());
            for mode in 1..=n {
                let angle = std::f64::consts::PI * mode as f64 / (n as f64 + 1.0);
                let lambda = 1.0 - angle.cos();
                let v: Vec<f64> = (1..=n).map(|i| (angle * i as f64).sin()).collect();
                let left = chebyshev(degree, (high + low - 2.0 * lambda) / (high - low))
                    / chebyshev(degree, (high + low) / (high - low));
                let factor = (1.0 - left) / lambda / 2.0;
                let mut z = vec![f64::NAN; n];
                m.apply(&v, &mut z);
                assert!(z.iter().zip(&v).all(|(z, v)| (z - factor * v).abs() < 1e-11), "{degree} {mode}");
            }
        }
    }
}
