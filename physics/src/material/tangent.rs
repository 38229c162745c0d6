//! The fourth-order tangent `dP/dF`, and its projection to the positive semidefinite ones.

use super::fill_upper;
use nalgebra::SMatrix;

/// The tangent `A = dP/dF`, Pa: `blocks[j][l][(i, k)]` is `dP_ij / dF_kl`.
///
/// As a matrix of `D^2` rows (index `j D + i`) it is symmetric, because `P` is the gradient of an energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangent<const D: usize> {
    /// Entries, see above.
    pub blocks: [[SMatrix<f64, D, D>; D]; D],
}

/// Negative eigenvalues down to this share of the norm are round-off (an unloaded body has zero ones: the spins).
const ROUND_OFF: f64 = 1e-12;

/// Enough sweeps of Jacobi's method for any 9 x 9 matrix; it converges quadratically, in practice after six.
const MAX_SWEEPS: usize = 30;

/// Row-major `n` x `n` with `n = D^2 <= 9`.
type Square = [[f64; 9]; 9];

impl<const D: usize> Tangent<D> {
    const N: usize = D * D;

    /// From the map `dF -> dP`, applied to each basis matrix.
    pub fn from_columns(mut differential: impl FnMut(&SMatrix<f64, D, D>) -> SMatrix<f64, D, D>) -> Self {
        let mut blocks = [[SMatrix::zeros(); D]; D];
        for l in 0..D {
            for k in 0..D {
                let mut df = SMatrix::zeros();
                df[(k, l)] = 1.0;
                let dp = differential(&df);
                for j in 0..D {
                    for i in 0..D {
                        blocks[j][l][(i, k)] = dp[(i, j)];
                    }
                }
            }
        }
        Self { blocks }
    }

    /// `A : dF`.
    pub fn apply(&self, df: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let mut dp = SMatrix::zeros();
        for j in 0..D {
            for l in 0..D {
                for i in 0..D {
                    for k in 0..D {
                        dp[(i, j)] += self.blocks[j][l][(i, k)] * df[(k, l)];
                    }
                }
            }
        }
        dp
    }

    /// Blocks of the element stiffness, as [`Hyperelastic::element_stiffness`](super::Hyperelastic::element_stiffness).
    ///
    /// # Panics
    /// If `upper` does not hold `N (N + 1) / 2` blocks.
    pub fn element_stiffness<const N: usize>(
        &self,
        gradients: &[[f64; D]; N],
        weight: f64,
        upper: &mut [[[f64; D]; D]],
    ) {
        fill_upper::<D, N>(upper, |a, b| {
            let mut k = [[0.0; D]; D];
            for j in 0..D {
                for l in 0..D {
                    let scale = weight * gradients[a][j] * gradients[b][l];
                    for row in 0..D {
                        for column in 0..D {
                            k[row][column] += scale * self.blocks[j][l][(row, column)];
                        }
                    }
                }
            }
            k
        });
    }

    /// The nearest positive semidefinite tangent in the Frobenius norm: negative eigenvalues become zero.
    ///
    /// A tangent that already is semidefinite up to round-off comes back unchanged. Entries that are not finite come
    /// back as they are.
    ///
    /// Source: Teran, Sifakis, Irving & Fedkiw (2005), *Robust quasistatic finite elements and flesh simulation*.
    #[must_use]
    pub fn projected(&self) -> Self {
        let mut a = self.to_square();
        let norm = a.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
        if !norm.is_finite() || is_positive(&a, Self::N, ROUND_OFF * norm) {
            return *self;
        }
        let vectors = jacobi_eigenvectors(&mut a, Self::N, norm);
        let mut clamped = [[0.0; 9]; 9];
        for m in 0..Self::N {
            let value = a[m][m].max(0.0);
            for r in 0..Self::N {
                for c in 0..Self::N {
                    clamped[r][c] += value * (vectors[r][m] * vectors[c][m]);
                }
            }
        }
        Self::from_square(&clamped)
    }

    fn to_square(self) -> Square {
        let mut a = [[0.0; 9]; 9];
        for r in 0..Self::N {
            for c in 0..Self::N {
                // The mean of both halves: symmetric to the last bit.
                let entry = |r: usize, c: usize| self.blocks[r / D][c / D][(r % D, c % D)];
                a[r][c] = 0.5 * (entry(r, c) + entry(c, r));
            }
        }
        a
    }

    fn from_square(a: &Square) -> Self {
        let block = |j: usize, l: usize| SMatrix::from_fn(|i, k| a[j * D + i][l * D + k]);
        Self { blocks: std::array::from_fn(|j| std::array::from_fn(|l| block(j, l))) }
    }
}

/// Whether `A + shift I` has a Cholesky factorisation.
fn is_positive(a: &Square, n: usize, shift: f64) -> bool {
    let mut lower = *a;
    for c in 0..n {
        let pivot = lower[c][c] + shift - (0..c).map(|m| lower[c][m] * lower[c][m]).sum::<f64>();
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let root = pivot.sqrt();
        lower[c][c] = root;
        for r in c + 1..n {
            let sum: f64 = (0..c).map(|m| lower[r][m] * lower[c][m]).sum();
            lower[r][c] = (lower[r][c] - sum) / root;
        }
    }
    true
}

/// Cyclic Jacobi: on return `a` is diagonal to round-off and the columns of the result are its eigenvectors.
///
/// Source: Golub & Van Loan, *Matrix Computations*, 4th ed. (2013), section 8.5.
fn jacobi_eigenvectors(a: &mut Square, n: usize, norm: f64) -> Square {
    let mut vectors = [[0.0; 9]; 9];
    for m in 0..n {
        vectors[m][m] = 1.0;
    }
    for _ in 0..MAX_SWEEPS {
        let off: f64 = (0..n).flat_map(|r| (0..r).map(move |c| (r, c))).map(|(r, c)| a[r][c] * a[r][c]).sum();
        if off.sqrt() <= 1e-15 * norm {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] != 0.0 {
                    rotate(a, &mut vectors, n, p, q);
                }
            }
        }
    }
    vectors
}

/// One Jacobi rotation that annihilates `a[p][q]`.
fn rotate(a: &mut Square, vectors: &mut Square, n: usize, p: usize, q: usize) {
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for m in 0..n {
        let (x, y) = (a[m][p], a[m][q]);
        (a[m][p], a[m][q]) = (c * x - s * y, s * x + c * y);
    }
    for m in 0..n {
        let (x, y) = (a[p][m], a[q][m]);
        (a[p][m], a[q][m]) = (c * x - s * y, s * x + c * y);
        let (x, y) = (vectors[m][p], vectors[m][q]);
        (vectors[m][p], vectors[m][q]) = (c * x - s * y, s * x + c * y);
    }
}
