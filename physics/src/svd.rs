//! Signed singular values and polar rotations of 2 x 2 and 3 x 3 matrices, one at a time and in lanes.
//!
//! `F = U diag(sigma) V^T` with rotations `U`, `V` (determinant +1) and `sigma_1 >= .. >= |sigma_D|`: the last value takes
//! the sign of `det F`. The rotation `R = U V^T` is the one closest to `F` in the Frobenius norm, for inverted `F` too.
//!
//! Method: one-sided Jacobi on the columns of `F` (no square of `F` is formed, so small values keep their digits), columns
//! sorted, then a Givens QR factorisation whose triangle is diagonal up to round-off and whose `Q` is a rotation however
//! singular `F` is. Scalar and lane forms are one code and give the same bits.
//!
//! Sources: Irving, Teran & Fedkiw (2004), *Invertible finite elements for robust simulation of large deformation*, section
//! 4 (the convention); Golub & Van Loan, *Matrix Computations*, 4th ed. (2013), section 8.6.3 (one-sided Jacobi); McAdams,
//! Selle, Tamstorf, Teran & Sifakis (2011), *Computing the singular value decomposition of 3x3 matrices with minimal
//! branching*, sections 4 and 5 (sorting and QR); Higham (1986), *Computing the polar decomposition*, (3.5).

use crate::lanes::{
    LANES, Lane, Pack, PackMatrix, any_not, cofactor, determinant_by, lane_of, pack, single, times_transpose, unpack,
};
use nalgebra::SMatrix;
use pulp::{Arch, NullaryFnOnce};

/// `F = U diag(sigma) V^T`, see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedSvd<const D: usize> {
    /// A rotation.
    pub u: SMatrix<f64, D, D>,
    /// Descending; only the last may be negative.
    pub sigma: [f64; D],
    /// A rotation.
    pub v: SMatrix<f64, D, D>,
}

/// The signed decomposition of any finite matrix, `D = 2` or `3`; NaN where an entry is not finite.
pub fn signed_svd<const D: usize>(f: &SMatrix<f64, D, D>) -> SignedSvd<D> {
    let svd = signed_svd_pack(&single(f));
    SignedSvd { u: lane_of(&svd.u, 0), sigma: svd.sigma.map(|s| s.0[0]), v: lane_of(&svd.v, 0) }
}

/// The rotation closest to `F`, `D = 2` or `3`; the identity for `F = 0`, NaN where an entry is not finite.
pub fn polar_rotation<const D: usize>(f: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    lane_of(&polar(&single(f)).rotation, 0)
}

/// The differential `dR` of [`polar_rotation`] in the direction `dF`. Where the sum of two signed singular values falls
/// below 1e-6 (there `R` jumps) that sum is taken for it.
pub fn polar_rotation_differential<const D: usize>(
    f: &SMatrix<f64, D, D>,
    df: &SMatrix<f64, D, D>,
) -> SMatrix<f64, D, D> {
    let SignedSvd { u, sigma, v } = signed_svd(f);
    let turned = u.transpose() * df * v;
    let spin = SMatrix::<f64, D, D>::from_fn(|i, k| {
        let sum = sigma[i] + sigma[k];
        (turned[(i, k)] - turned[(k, i)]) / if sum < SMALLEST_PAIR { SMALLEST_PAIR } else { sum }
    });
    u * spin * v.transpose()
}

/// Sums of two singular values at which derivatives of the rotation, which grow like their inverse, stop growing.
pub(crate) const SMALLEST_PAIR: f64 = 1e-6;

/// The rotations closest to the matrices of a group.
#[inline(always)]
pub fn polar_rotation_lanes<const D: usize>(f: &[[Lane; D]; D]) -> [[Lane; D]; D] {
    unpack(polar::<D, LANES>(&pack(f)).rotation)
}

/// The decomposition in packs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackSvd<const D: usize, const L: usize> {
    pub u: PackMatrix<D, L>,
    pub sigma: [Pack<L>; D],
    pub v: PackMatrix<D, L>,
}

/// Far more sweeps than any 3 x 3 matrix needs (four or five): Jacobi's method converges quadratically.
const MAX_SWEEPS: usize = 12;

/// Columns whose cosine is below the root of this are orthogonal.
const ORTHOGONAL: f64 = 1e-30;

/// Squared columns smaller than this share of the largest entry squared are zero: their products would underflow.
const NEGLIGIBLE: f64 = 1e-100;

/// The decompositions of a group. Out of line: it is long, and called from many kernels.
#[inline(never)]
pub(crate) fn signed_svd_pack<const D: usize, const L: usize>(f: &PackMatrix<D, L>) -> PackSvd<D, L> {
    if L == 1 {
        return decompose(f);
    }
    Arch::new().dispatch(Decompose(f))
}

/// A type and not a closure: a closure that only borrows is called through a shim that the compiler need not inline into
/// the code for wide vectors.
struct Decompose<'a, const D: usize, const L: usize>(&'a PackMatrix<D, L>);

impl<const D: usize, const L: usize> NullaryFnOnce for Decompose<'_, D, L> {
    type Output = PackSvd<D, L>;
    #[inline(always)]
    fn call(self) -> PackSvd<D, L> {
        decompose(self.0)
    }
}

#[inline(always)]
fn decompose<const D: usize, const L: usize>(f: &PackMatrix<D, L>) -> PackSvd<D, L> {
    let scale = power_of_two_below(largest_entry(f));
    let inverse = Pack::ONE / scale;
    // Columns: column j of F V is b[j].
    let (mut b, mut v) = ([[Pack::ZERO; D]; D], [[Pack::ZERO; D]; D]);
    for j in 0..D {
        for i in 0..D {
            b[j][i] = f[i][j] * inverse;
        }
        v[j][j] = Pack::ONE;
    }
    let mut svd = diagonalise(b, v);
    for j in 0..D {
        svd.sigma[j] = svd.sigma[j] * scale;
    }
    svd
}

/// The decomposition from the columns `b` of `F V` and `v` of a rotation `V`.
#[inline(always)]
fn diagonalise<const D: usize, const L: usize>(mut b: PackMatrix<D, L>, mut v: PackMatrix<D, L>) -> PackSvd<D, L> {
    const { assert!(1 <= D && D <= 3, "singular values of matrices up to 3 x 3") };
    for _ in 0..MAX_SWEEPS {
        let mut rotated = Pack::ZERO;
        for p in 0..D {
            for q in p + 1..D {
                rotated += orthogonalise(&mut b, &mut v, p, q);
            }
        }
        if !any_not(&(-rotated).above(-0.5)) {
            break;
        }
    }
    sort(&mut b, &mut v);
    let u = triangularise(&mut b);
    let mut svd = PackSvd { u, sigma: [Pack::ZERO; D], v: [[Pack::ZERO; D]; D] };
    for j in 0..D {
        svd.sigma[j] = b[j][j];
        for i in 0..D {
            svd.v[i][j] = v[j][i];
        }
    }
    svd
}

#[inline(always)]
fn largest_entry<const D: usize, const L: usize>(f: &PackMatrix<D, L>) -> Pack<L> {
    let mut largest = Pack::ZERO;
    for row in f {
        for x in row {
            largest = x.abs().max(largest);
        }
    }
    largest
}

/// The power of two at or below a positive number (one at least as large as the smallest normal number): scaling by it
/// is exact.
#[inline(always)]
fn power_of_two_below<const L: usize>(x: Pack<L>) -> Pack<L> {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    x.map(|x| f64::from_bits(x.to_bits() & EXPONENT)).max(Pack::splat(f64::MIN_POSITIVE))
}

#[inline(always)]
fn dot<const D: usize, const L: usize>(a: &[Pack<L>; D], b: &[Pack<L>; D]) -> Pack<L> {
    let mut sum = a[0] * b[0];
    for i in 1..D {
        sum += a[i] * b[i];
    }
    sum
}

/// Rotates columns `p` and `q` of `b` and `v` until those of `b` are orthogonal; one where a lane needed it.
#[inline(always)]
fn orthogonalise<const D: usize, const L: usize>(
    b: &mut PackMatrix<D, L>,
    v: &mut PackMatrix<D, L>,
    p: usize,
    q: usize,
) -> Pack<L> {
    let (pp, qq, pq) = (dot(&b[p], &b[p]), dot(&b[q], &b[q]), dot(&b[p], &b[q]));
    let bound = (pp * qq) * ORTHOGONAL;
    let relevant = Pack::splat(NEGLIGIBLE).where_less(pp.max(qq), pq * pq, Pack::ZERO);
    let needed = bound.where_less(relevant, Pack::ONE, Pack::ZERO);
    // tan(2 angle) = x / d, the smaller of the two angles.
    let (d, x) = (qq - pp, pq + pq);
    let long = d.abs() + (d * d + x * x).sqrt();
    let reciprocal = Pack::ONE / (long * long + x * x).sqrt();
    let signed = d.where_less(Pack::ZERO, -x, x);
    let c = bound.where_less(relevant, long * reciprocal, Pack::ONE);
    let s = bound.where_less(relevant, signed * reciprocal, Pack::ZERO);
    rotate_columns(b, p, q, c, s);
    rotate_columns(v, p, q, c, s);
    needed
}

#[inline(always)]
fn rotate_columns<const D: usize, const L: usize>(
    m: &mut PackMatrix<D, L>,
    p: usize,
    q: usize,
    c: Pack<L>,
    s: Pack<L>,
) {
    for i in 0..D {
        let (x, y) = (m[p][i], m[q][i]);
        (m[p][i], m[q][i]) = (c * x - s * y, s * x + c * y);
    }
}

/// Longest column first. A swap turns one of the two round, so that `v` stays a rotation.
#[inline(always)]
fn sort<const D: usize, const L: usize>(b: &mut PackMatrix<D, L>, v: &mut PackMatrix<D, L>) {
    for p in 0..D {
        for q in p + 1..D {
            let (short, long) = (dot(&b[p], &b[p]), dot(&b[q], &b[q]));
            for m in [&mut *b, &mut *v] {
                for i in 0..D {
                    let (x, y) = (m[p][i], m[q][i]);
                    m[p][i] = short.where_less(long, y, x);
                    m[q][i] = short.where_less(long, -x, y);
                }
            }
        }
    }
}

/// `Q` of `B = Q R` by Givens rotations of rows, a rotation itself; `b` becomes `R`, by columns.
#[inline(always)]
fn triangularise<const D: usize, const L: usize>(b: &mut PackMatrix<D, L>) -> PackMatrix<D, L> {
    let mut q = [[Pack::ZERO; D]; D];
    for i in 0..D {
        q[i][i] = Pack::ONE;
    }
    for column in 0..D - 1 {
        for row in column + 1..D {
            let (x, y) = (b[column][column], b[column][row]);
            let square = x * x + y * y;
            let (tiny, reciprocal) = (Pack::splat(NEGLIGIBLE * NEGLIGIBLE), Pack::ONE / square.sqrt());
            let c = square.where_less(tiny, Pack::ONE, x * reciprocal);
            let s = square.where_less(tiny, Pack::ZERO, y * reciprocal);
            for j in column..D {
                let (x, y) = (b[j][column], b[j][row]);
                (b[j][column], b[j][row]) = (c * x + s * y, c * y - s * x);
            }
            for i in 0..D {
                let (x, y) = (q[i][column], q[i][row]);
                (q[i][column], q[i][row]) = (c * x + s * y, c * y - s * x);
            }
        }
    }
    q
}

/// Steps of Newton's iteration for the polar factor: singular values from 0.25 to 4 reach round-off.
const POLAR_STEPS: usize = 7;

/// The last step of a quadratic iteration that has converged to round-off.
const CONVERGED: f64 = 1e-8;

/// The rotation closest to `F`, and in which lanes no singular values were needed.
pub(crate) struct Polar<const D: usize, const L: usize> {
    pub rotation: PackMatrix<D, L>,
    /// Lanes in which every sum of two singular values is well above zero, so that the rotation has a derivative.
    pub regular: [bool; L],
}

/// The rotation closest to `F`.
///
/// In space by Newton's iteration `X <- (X + X^-T)/2` from `F`, which does not leave the matrices of positive determinant;
/// lanes in which it has not converged (strongly deformed, singular or inverted ones) take `U V^T`.
#[inline(always)]
pub(crate) fn polar<const D: usize, const L: usize>(f: &PackMatrix<D, L>) -> Polar<D, L> {
    if D == 2 {
        return plane_rotation(f);
    }
    let mut x = *f;
    let mut change = Pack::<L>::ZERO;
    let first = determinant_by(f, &cofactor(f));
    let mut done = [false; L];
    for _ in 0..POLAR_STEPS {
        let cof = cofactor(&x);
        let half = Pack::splat(0.5) / determinant_by(&x, &cof);
        let mut square = Pack::<L>::ZERO;
        for i in 0..D {
            for k in 0..D {
                let next = x[i][k] * 0.5 + cof[i][k] * half;
                let step = next - x[i][k];
                square += step * step;
                // A lane that has converged rests, so that it does not depend on the others.
                for l in 0..L {
                    x[i][k].0[l] = if done[l] { x[i][k].0[l] } else { next.0[l] };
                }
            }
        }
        for l in 0..L {
            change.0[l] = if done[l] { change.0[l] } else { square.0[l] };
            done[l] = change.0[l] < CONVERGED * CONVERGED;
        }
        if !any_not(&done) {
            break;
        }
    }
    let mut regular = [false; L];
    for l in 0..L {
        regular[l] = first.0[l] > 0.0 && change.0[l] < CONVERGED * CONVERGED;
    }
    if any_not(&regular) {
        let svd = signed_svd_pack(f);
        let rotation = times_transpose(&svd.u, &svd.v);
        for i in 0..D {
            for k in 0..D {
                for l in 0..L {
                    x[i][k].0[l] = if regular[l] { x[i][k].0[l] } else { rotation[i][k].0[l] };
                }
            }
        }
    }
    Polar { rotation: x, regular }
}

/// In the plane the rotation has a closed form; the identity where `F` is a reflection, to which all are equally close.
#[inline(always)]
fn plane_rotation<const D: usize, const L: usize>(f: &PackMatrix<D, L>) -> Polar<D, L> {
    /// The sum of both singular values from which on the rotation counts as well determined.
    const WELL_DETERMINED: f64 = 1e-3;
    let scale = power_of_two_below(largest_entry(f));
    let inverse = Pack::ONE / scale;
    let (x, y) = ((f[0][0] + f[1][1]) * inverse, (f[1][0] - f[0][1]) * inverse);
    let square = x * x + y * y;
    let root = square.sqrt();
    let (tiny, reciprocal) = (Pack::splat(NEGLIGIBLE), Pack::ONE / root);
    let c = square.where_less(tiny, Pack::ONE, x * reciprocal);
    let s = square.where_less(tiny, Pack::ZERO, y * reciprocal);
    let mut rotation = [[Pack::ZERO; D]; D];
    (rotation[0][0], rotation[0][1], rotation[1][0], rotation[1][1]) = (c, -s, s, c);
    Polar { rotation, regular: (root * scale).above(WELL_DETERMINED) }
}

#[cfg(test)]
mod tests;
