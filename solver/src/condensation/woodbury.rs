//! Updates of low rank.

use super::lu::Lu;
use crate::vector::{axpy, dot, first_not_finite};

/// Solves with `A₁ = A₀ + U C Uᵀ`, where `A₀` and `C` are symmetric and solving with `A₀` is known: for matrices in which `k` dofs or springs
/// changed, `k` small.
///
/// ```text
/// A₁⁻¹ = A₀⁻¹ − Z C (I + Uᵀ Z C)⁻¹ Zᵀ     Z = A₀⁻¹ U,  n x k
/// ```
///
/// `C` may be singular, as that of an element that is taken out is. A build costs `k` solves, a correction `4 n k` flops; both
/// allocate nothing once their size has been seen.
///
/// Source: Woodbury (1950); Henderson & Searle, *On deriving the inverse of a sum of matrices*, SIAM Review 23 (1981), eq. (23).
#[derive(Clone, Debug, Default)]
pub struct Woodbury {
    n: usize,
    k: usize,
    /// Columns of `U` and of `Z`, `n` entries each.
    u: Vec<f64>,
    z: Vec<f64>,
    c: Vec<f64>,
    middle: Lu,
    /// `Uᵀ x`, and `C` times what becomes of it.
    coefficients: Vec<f64>,
    weights: Vec<f64>,
}

/// A change that cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WoodburyError {
    /// A part has the wrong length.
    #[error("{what} has {len} entries, not {expected}")]
    Shape {
        /// Which part.
        what: &'static str,
        /// Its length.
        len: usize,
        /// The length it should have.
        expected: usize,
    },
    /// NaN or an infinity.
    #[error("entry {index} of {what} is not finite")]
    NotFinite {
        /// Which part.
        what: &'static str,
        /// Its first bad entry.
        index: usize,
    },
    /// `A₁` is singular up to rounding.
    #[error("pivot {pivot:e} at column {column} of the term: the changed matrix is singular")]
    Singular {
        /// Column of `U`.
        column: usize,
        /// The pivot that should not have been zero.
        pivot: f64,
    },
}

impl Woodbury {
    /// No change of nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Prepares `A₁ = A₀ + U C Uᵀ`: `u` holds the `k` columns of `U` one after the other, `n` entries each, `c` the rows of `C`;
    /// `solve` overwrites a vector `b` by `A₀⁻¹ b`.
    ///
    /// # Errors
    /// [`WoodburyError`]; the object is then of no use until a build succeeds.
    pub fn build(
        &mut self,
        n: usize,
        u: &[f64],
        c: &[f64],
        mut solve: impl FnMut(&mut [f64]),
    ) -> Result<(), WoodburyError> {
        let k = c.len().isqrt();
        for (what, len, expected) in [("C", c.len(), k * k), ("U", u.len(), n * k)] {
            if len != expected {
                return Err(WoodburyError::Shape { what, len, expected });
            }
        }
        finite("U", u)?;
        finite("C", c)?;
        (self.n, self.k) = (n, k);
        for (kept, given) in [(&mut self.u, u), (&mut self.z, u), (&mut self.c, c)] {
            kept.clear();
            kept.extend_from_slice(given);
        }
        self.coefficients.resize(k, 0.0);
        self.weights.resize(k, 0.0);
        for column in self.z.chunks_exact_mut(n.max(1)) {
            solve(column);
        }
        finite("A₀⁻¹ U", &self.z)?;
        let (u, z, row) = (&self.u, &self.z, &mut self.coefficients);
        let fill = |s: &mut [f64]| {
            for i in 0..k {
                for (j, value) in row.iter_mut().enumerate() {
                    *value = dot(&u[i * n..(i + 1) * n], &z[j * n..(j + 1) * n]);
                }
                let s = &mut s[i * k..(i + 1) * k];
                for (l, value) in row.iter().enumerate() {
                    axpy(*value, &c[l * k..(l + 1) * k], s);
                }
                s[i] += 1.0;
            }
        };
        self.middle.factor(k, fill).map_err(|(column, pivot)| WoodburyError::Singular { column, pivot })
    }

    /// Rank of the change, at most: number of columns of `U`.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.k
    }

    /// Turns `x = A₀⁻¹ b` into `A₁⁻¹ b`.
    ///
    /// # Panics
    /// If `x` does not have `n` entries.
    pub fn correct(&mut self, x: &mut [f64]) {
        let n = self.n;
        assert_eq!(x.len(), n, "correction of a vector of {n} entries");
        for (coefficient, u) in self.coefficients.iter_mut().zip(self.u.chunks_exact(n.max(1))) {
            *coefficient = dot(u, x);
        }
        self.weigh();
        for (weight, z) in self.weights.iter().zip(self.z.chunks_exact(n.max(1))) {
            axpy(-weight, z, x);
        }
    }

    /// Turns `A₀⁻¹`, by rows, into `A₁⁻¹`: `2 n² k` flops.
    ///
    /// # Panics
    /// If the inverse does not have `n` squared entries.
    pub fn correct_inverse(&mut self, inverse: &mut [f64]) {
        let n = self.n;
        assert_eq!(inverse.len(), n * n, "inverse of a matrix of {n} rows");
        // Row i of Z C (I + Uᵀ Z C)⁻¹ Zᵀ is that of its transpose; see `weigh`.
        for (i, row) in inverse.chunks_exact_mut(n.max(1)).enumerate() {
            for (j, coefficient) in self.coefficients.iter_mut().enumerate() {
                *coefficient = self.z[j * n + i];
            }
            self.weigh();
            for (weight, z) in self.weights.iter().zip(self.z.chunks_exact(n.max(1))) {
                axpy(-weight, z, row);
            }
        }
    }

    /// `weights ← C (I + Uᵀ Z C)⁻¹ coefficients`. For symmetric `A₀` and `C` that matrix is symmetric.
    fn weigh(&mut self) {
        self.middle.solve(&mut self.coefficients);
        for (weight, c) in self.weights.iter_mut().zip(self.c.chunks_exact(self.k.max(1))) {
            *weight = dot(c, &self.coefficients);
        }
    }
}

fn finite(what: &'static str, v: &[f64]) -> Result<(), WoodburyError> {
    match first_not_finite(v) {
        Some(index) => Err(WoodburyError::NotFinite { what, index }),
        None => Ok(()),
    }
}
