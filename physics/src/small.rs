//! Determinants and cofactors of 1 x 1 to 3 x 3 matrices, one name for every dimension.

use nalgebra::SMatrix;

/// `det F`.
#[inline(always)]
pub(crate) fn determinant<const D: usize>(f: &SMatrix<f64, D, D>) -> f64 {
    const { assert!(1 <= D && D <= 3, "bodies live in one to three dimensions") };
    match D {
        1 => f[(0, 0)],
        2 => f[(0, 0)] * f[(1, 1)] - f[(0, 1)] * f[(1, 0)],
        _ => {
            f[(0, 0)] * (f[(1, 1)] * f[(2, 2)] - f[(1, 2)] * f[(2, 1)])
                + f[(0, 1)] * (f[(1, 2)] * f[(2, 0)] - f[(1, 0)] * f[(2, 2)])
                + f[(0, 2)] * (f[(1, 0)] * f[(2, 1)] - f[(1, 1)] * f[(2, 0)])
        }
    }
}

/// `det(I + H) - 1` without the cancellation of `det F - 1` at small `H`.
#[inline(always)]
pub(crate) fn determinant_minus_one<const D: usize>(h: &SMatrix<f64, D, D>) -> f64 {
    match D {
        1 => h[(0, 0)],
        2 => h[(0, 0)] + h[(1, 1)] + determinant(h),
        _ => {
            let minor = |i: usize, j: usize| h[(i, i)] * h[(j, j)] - h[(i, j)] * h[(j, i)];
            h[(0, 0)] + h[(1, 1)] + h[(2, 2)] + (minor(0, 1) + minor(0, 2) + minor(1, 2)) + determinant(h)
        }
    }
}

/// The cofactor matrix `J F^-T`, a polynomial in `F`: defined for singular `F` too.
#[inline(always)]
pub(crate) fn cofactor<const D: usize>(f: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut c = SMatrix::<f64, D, D>::zeros();
    match D {
        1 => c[(0, 0)] = 1.0,
        2 => {
            c[(0, 0)] = f[(1, 1)];
            c[(0, 1)] = -f[(1, 0)];
            c[(1, 0)] = -f[(0, 1)];
            c[(1, 1)] = f[(0, 0)];
        }
        _ => {
            for i in 0..D {
                let (i1, i2) = ((i + 1) % D, (i + 2) % D);
                for j in 0..D {
                    let (j1, j2) = ((j + 1) % D, (j + 2) % D);
                    c[(i, j)] = f[(i1, j1)] * f[(i2, j2)] - f[(i1, j2)] * f[(i2, j1)];
                }
            }
        }
    }
    c
}

/// `A : B`, the sum of the products of the entries.
#[inline(always)]
pub(crate) fn contract<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> f64 {
    let mut sum = 0.0;
    for j in 0..D {
        for i in 0..D {
            sum += a[(i, j)] * b[(i, j)];
        }
    }
    sum
}

/// `A^T B`.
#[inline(always)]
pub(crate) fn transpose_times<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut c = SMatrix::<f64, D, D>::zeros();
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                c[(i, j)] += a[(k, i)] * b[(k, j)];
            }
        }
    }
    c
}

/// `A B`.
#[inline(always)]
pub(crate) fn times<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut c = SMatrix::<f64, D, D>::zeros();
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                c[(i, j)] += a[(i, k)] * b[(k, j)];
            }
        }
    }
    c
}

/// `M g` for each shape gradient.
#[inline(always)]
pub(crate) fn map_gradients<const D: usize, const N: usize>(
    m: &SMatrix<f64, D, D>,
    gradients: &[[f64; D]; N],
) -> [[f64; D]; N] {
    let mut out = [[0.0; D]; N];
    for a in 0..N {
        for i in 0..D {
            for j in 0..D {
                out[a][i] += m[(i, j)] * gradients[a][j];
            }
        }
    }
    out
}

/// `a . b`.
#[inline(always)]
pub(crate) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for i in 0..D {
        sum += a[i] * b[i];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `F cof(F)^T = det(F) I` and `det(I + H) - 1` in each dimension.
    fn check<const D: usize>() {
        let f = SMatrix::<f64, D, D>::from_fn(|i, j| if i == j { 1.3 } else { 0.2 * i as f64 - 0.3 * j as f64 });
        let product = f * cofactor(&f).transpose();
        assert!((product - SMatrix::<f64, D, D>::identity() * determinant(&f)).norm() < 1e-14);
        let h = f - SMatrix::<f64, D, D>::identity();
        assert!((determinant_minus_one(&h) - (determinant(&f) - 1.0)).abs() < 1e-14);
    }

    #[test]
    fn cofactor_and_determinant_agree() {
        check::<1>();
        check::<2>();
        check::<3>();
    }
}
