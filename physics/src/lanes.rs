//! Numbers side by side: element kernels work on [`LANES`] elements at a time.
//!
//! A kernel is written once for `Pack`, a short array of numbers with the arithmetic of one, and compiled for one
//! lane (the scalar form) and for [`LANES`]. Lanes never mix and no product is fused with a sum, so that both give the
//! same bits.

use nalgebra::SMatrix;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use stylet_solver::real::Real;

/// Elements that are computed side by side: the width of the vector units that the kernels are compiled for.
pub const LANES: usize = 4;

/// One number per element of a group.
pub type Lane = [f64; LANES];

/// `L` numbers with the arithmetic of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pack<const L: usize, T = f64>(pub [T; L]);

/// A matrix of packs, `[row][column]`.
pub(crate) type PackMatrix<const D: usize, const L: usize, T = f64> = [[Pack<L, T>; D]; D];

impl<const L: usize, T: Real> Pack<L, T> {
    pub const ZERO: Self = Self([T::ZERO; L]);
    pub const ONE: Self = Self([T::ONE; L]);

    #[inline(always)]
    pub fn splat(x: T) -> Self {
        Self([x; L])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut out = [T::ZERO; L];
        for l in 0..L {
            out[l] = f(self.0[l], other.0[l]);
        }
        Self(out)
    }

    #[inline(always)]
    pub fn map(self, f: impl Fn(T) -> T) -> Self {
        let mut out = [T::ZERO; L];
        for l in 0..L {
            out[l] = f(self.0[l]);
        }
        Self(out)
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(T::sqrt)
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        self.map(T::abs)
    }

    /// Which lanes lie above a bound.
    #[inline(always)]
    pub fn above(self, bound: T) -> [bool; L] {
        let mut out = [false; L];
        for l in 0..L {
            out[l] = self.0[l] > bound;
        }
        out
    }

    /// The larger one; `other` where `self` is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// `yes` where `self < bound`, otherwise `no` (also where one is NaN).
    #[inline(always)]
    pub fn where_less(self, bound: Self, yes: Self, no: Self) -> Self {
        let mut out = [T::ZERO; L];
        for l in 0..L {
            out[l] = if self.0[l] < bound.0[l] { yes.0[l] } else { no.0[l] };
        }
        Self(out)
    }
}

impl<const L: usize, T: Real> Add for Pack<L, T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const L: usize, T: Real> Sub for Pack<L, T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const L: usize, T: Real> Mul for Pack<L, T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const L: usize, T: Real> Mul<T> for Pack<L, T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        self.map(|a| a * factor)
    }
}

impl<const L: usize, T: Real> Div for Pack<L, T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
}

impl<const L: usize, T: Real> Neg for Pack<L, T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const L: usize, T: Real> AddAssign for Pack<L, T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize, T: Real> SubAssign for Pack<L, T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// An array by its entries. (The array methods of the standard library are not always inlined, and then cost a call.)
#[inline(always)]
pub(crate) fn array_of<const D: usize, const L: usize>(entry: impl Fn(usize) -> Pack<L>) -> [Pack<L>; D] {
    let mut out = [Pack::ZERO; D];
    for i in 0..D {
        out[i] = entry(i);
    }
    out
}

/// A matrix by its entries.
#[inline(always)]
pub(crate) fn matrix_of<const R: usize, const C: usize, const L: usize>(
    entry: impl Fn(usize, usize) -> Pack<L>,
) -> [[Pack<L>; C]; R] {
    let mut out = [[Pack::ZERO; C]; R];
    for i in 0..R {
        for k in 0..C {
            out[i][k] = entry(i, k);
        }
    }
    out
}

/// Whether one of the lanes is not.
#[inline(always)]
pub(crate) fn any_not<const L: usize>(lanes: &[bool; L]) -> bool {
    let mut all = true;
    for l in 0..L {
        all &= lanes[l];
    }
    !all
}

/// One matrix as a pack of one lane.
#[inline(always)]
pub(crate) fn single<const D: usize>(m: &SMatrix<f64, D, D>) -> PackMatrix<D, 1> {
    matrix_of(|i, k| Pack([m[(i, k)]]))
}

/// One lane of a matrix of packs.
#[inline(always)]
pub(crate) fn lane_of<const D: usize, const L: usize>(m: &PackMatrix<D, L>, lane: usize) -> SMatrix<f64, D, D> {
    let mut out = SMatrix::zeros();
    for i in 0..D {
        for k in 0..D {
            out[(i, k)] = m[i][k].0[lane];
        }
    }
    out
}

/// One lane of a matrix of lanes.
#[inline(always)]
pub(crate) fn lane_matrix<const D: usize>(f: &[[Lane; D]; D], lane: usize) -> SMatrix<f64, D, D> {
    let mut m = SMatrix::zeros();
    for i in 0..D {
        for k in 0..D {
            m[(i, k)] = f[i][k][lane];
        }
    }
    m
}

/// A matrix of lanes as packs.
#[inline(always)]
pub(crate) fn pack<const D: usize>(f: &[[Lane; D]; D]) -> PackMatrix<D, LANES> {
    matrix_of(|i, k| Pack(f[i][k]))
}

/// A matrix of packs as lanes.
#[inline(always)]
pub(crate) fn unpack<const D: usize>(f: PackMatrix<D, LANES>) -> [[Lane; D]; D] {
    let mut out = [[[0.0; LANES]; D]; D];
    for i in 0..D {
        for k in 0..D {
            out[i][k] = f[i][k].0;
        }
    }
    out
}

/// `A B`.
#[inline(always)]
pub(crate) fn times<const D: usize, const L: usize, T: Real>(
    a: &PackMatrix<D, L, T>,
    b: &PackMatrix<D, L, T>,
) -> PackMatrix<D, L, T> {
    let mut c = [[Pack::ZERO; D]; D];
    for i in 0..D {
        for j in 0..D {
            let mut sum = a[i][0] * b[0][j];
            for k in 1..D {
                sum += a[i][k] * b[k][j];
            }
            c[i][j] = sum;
        }
    }
    c
}

/// `A B^T`.
#[inline(always)]
pub(crate) fn times_transpose<const D: usize, const L: usize, T: Real>(
    a: &PackMatrix<D, L, T>,
    b: &PackMatrix<D, L, T>,
) -> PackMatrix<D, L, T> {
    let mut c = [[Pack::ZERO; D]; D];
    for i in 0..D {
        for j in 0..D {
            let mut sum = a[i][0] * b[j][0];
            for k in 1..D {
                sum += a[i][k] * b[j][k];
            }
            c[i][j] = sum;
        }
    }
    c
}

/// `A^T B`.
#[inline(always)]
pub(crate) fn transpose_times<const D: usize, const L: usize, T: Real>(
    a: &PackMatrix<D, L, T>,
    b: &PackMatrix<D, L, T>,
) -> PackMatrix<D, L, T> {
    let mut c = [[Pack::ZERO; D]; D];
    for i in 0..D {
        for j in 0..D {
            let mut sum = a[0][i] * b[0][j];
            for k in 1..D {
                sum += a[k][i] * b[k][j];
            }
            c[i][j] = sum;
        }
    }
    c
}

/// The cofactor matrix `J F^-T`, for `D = 2, 3`.
#[inline(always)]
pub(crate) fn cofactor<const D: usize, const L: usize>(f: &PackMatrix<D, L>) -> PackMatrix<D, L> {
    let mut c = [[Pack::ZERO; D]; D];
    if D == 2 {
        c[0][0] = f[1][1];
        c[0][1] = -f[1][0];
        c[1][0] = -f[0][1];
        c[1][1] = f[0][0];
        return c;
    }
    for i in 0..D {
        let (i1, i2) = ((i + 1) % D, (i + 2) % D);
        for j in 0..D {
            let (j1, j2) = ((j + 1) % D, (j + 2) % D);
            c[i][j] = f[i1][j1] * f[i2][j2] - f[i1][j2] * f[i2][j1];
        }
    }
    c
}

/// `det F` from the cofactors of its first row.
#[inline(always)]
pub(crate) fn determinant_by<const D: usize, const L: usize>(
    f: &PackMatrix<D, L>,
    cofactor: &PackMatrix<D, L>,
) -> Pack<L> {
    let mut sum = f[0][0] * cofactor[0][0];
    for k in 1..D {
        sum += f[0][k] * cofactor[0][k];
    }
    sum
}

/// `det F - 1` without cancellation, with the bits of [`small::determinant_minus_one`](crate::small::determinant_minus_one)
/// at `F - I`; for `D = 2, 3`.
#[inline(always)]
pub(crate) fn determinant_minus_one<const D: usize, const L: usize>(f: &PackMatrix<D, L>) -> Pack<L> {
    let mut h = *f;
    for i in 0..D {
        h[i][i] = f[i][i] - Pack::ONE;
    }
    if D == 2 {
        return h[0][0] + h[1][1] + (h[0][0] * h[1][1] - h[0][1] * h[1][0]);
    }
    let h = |i: usize, k: usize| h[i % D][k % D];
    let minor = |i: usize, j: usize| h(i, i) * h(j, j) - h(i, j) * h(j, i);
    let determinant = h(0, 0) * (h(1, 1) * h(2, 2) - h(1, 2) * h(2, 1))
        + h(0, 1) * (h(1, 2) * h(2, 0) - h(1, 0) * h(2, 2))
        + h(0, 2) * (h(1, 0) * h(2, 1) - h(1, 1) * h(2, 0));
    h(0, 0) + h(1, 1) + h(2, 2) + (minor(0, 1) + minor(0, 2) + minor(1, 2)) + determinant
}

/// `A : B`, the sum of the products of the entries.
#[inline(always)]
pub(crate) fn contract<const D: usize, const L: usize>(a: &PackMatrix<D, L>, b: &PackMatrix<D, L>) -> Pack<L> {
    let mut sum = Pack::ZERO;
    for i in 0..D {
        for k in 0..D {
            sum += a[i][k] * b[i][k];
        }
    }
    sum
}

/// The derivative of the cofactor matrix in the direction `dF`, for `D = 2, 3`.
#[inline(always)]
pub(crate) fn cofactor_differential<const D: usize, const L: usize>(
    f: &PackMatrix<D, L>,
    df: &PackMatrix<D, L>,
) -> PackMatrix<D, L> {
    if D == 2 {
        return cofactor(df);
    }
    let mut c = [[Pack::ZERO; D]; D];
    for i in 0..D {
        let (i1, i2) = ((i + 1) % D, (i + 2) % D);
        for j in 0..D {
            let (j1, j2) = ((j + 1) % D, (j + 2) % D);
            c[i][j] =
                (f[i1][j1] * df[i2][j2] + df[i1][j1] * f[i2][j2]) - (f[i1][j2] * df[i2][j1] + df[i1][j2] * f[i2][j1]);
        }
    }
    c
}
