//! Exchange of what is prescribed at a dof.

use crate::vector::{axpy, dot, first_not_finite};
use serde::{Deserialize, Serialize};

/// What is given at a dof; the other of the two follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Prescribed {
    /// The force, N.
    Force,
    /// The displacement, m.
    Displacement,
}

/// The response `y = M x` of the dofs kept: `x_i` is the prescribed one of force and displacement of dof `i`, `y_i` the other.
///
/// With all forces prescribed `M` is the compliance, with all displacements the stiffness. Exchanging the two at dof `i`, as when
/// a node begins to stick or to slip along an axis, is one pivot on `m_ii`, exact and O(m²):
///
/// ```text
/// m_ii ← 1/m_ii    m_ij ← −m_ij/m_ii    m_ji ← m_ji/m_ii    m_jk ← m_jk − m_ji m_ik/m_ii
/// ```
///
/// A second exchange restores `M` up to rounding, which adds up over many: [`drift`](Self::drift) measures it against the
/// compliance, which is kept, and [`refresh`](Self::refresh) removes it.
///
/// Source: Göksel, MSc thesis, University of British Columbia (2004); James & Pai, *ArtDefo*, SIGGRAPH 1999 (capacitance
/// matrix); Goodnight, *A tutorial on the SWEEP operator*, The American Statistician 33 (1979).
#[derive(Clone, Debug, PartialEq)]
pub struct CondensedMatrix {
    m: usize,
    compliance: Vec<f64>,
    pub(super) matrix: Vec<f64>,
    prescribed: Vec<Prescribed>,
    swaps: usize,
    /// Row and column of the pivot; `x` and `y` of a measurement.
    row: Vec<f64>,
    column: Vec<f64>,
}

/// A matrix that cannot be condensed, or an exchange that cannot be made; the matrix is then unchanged.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SwapError {
    /// The compliance is not square.
    #[error("compliance of {m} dofs has {len} entries")]
    Shape {
        /// Number of dofs.
        m: usize,
        /// Number of entries.
        len: usize,
    },
    /// NaN or an infinity.
    #[error("entry ({row}, {col}) of the compliance is not finite")]
    NotFinite {
        /// Its row.
        row: usize,
        /// Its column.
        col: usize,
    },
    /// There is no such dof.
    #[error("dof {dof} is out of range: there are {m}")]
    DofOutOfRange {
        /// The dof asked for.
        dof: usize,
        /// Number of dofs.
        m: usize,
    },
    /// What would be prescribed does not determine the rest.
    #[error("pivot {pivot:e} at dof {dof}: its force and displacement cannot be exchanged")]
    SingularPivot {
        /// The dof.
        dof: usize,
        /// The pivot, m/N or N/m, that should have been positive.
        pivot: f64,
    },
}

impl CondensedMatrix {
    /// The response of `m` dofs with the symmetric positive definite `compliance`, m/N, by rows; all forces are prescribed.
    ///
    /// # Errors
    /// [`SwapError::Shape`], [`SwapError::NotFinite`]; [`SwapError::SingularPivot`] names a dof whose compliance is not positive.
    pub fn new(m: usize, compliance: &[f64]) -> Result<Self, SwapError> {
        let len = compliance.len();
        if m.checked_mul(m) != Some(len) {
            return Err(SwapError::Shape { m, len });
        }
        if let Some(index) = first_not_finite(compliance) {
            return Err(SwapError::NotFinite { row: index / m, col: index % m });
        }
        for dof in 0..m {
            let pivot = compliance[dof * m + dof];
            if pivot <= 0.0 {
                return Err(SwapError::SingularPivot { dof, pivot });
            }
        }
        Ok(Self {
            m,
            compliance: compliance.to_vec(),
            matrix: compliance.to_vec(),
            prescribed: vec![Prescribed::Force; m],
            swaps: 0,
            row: vec![0.0; m],
            column: vec![0.0; m],
        })
    }

    /// What is prescribed at each dof.
    #[must_use]
    pub fn prescribed(&self) -> &[Prescribed] {
        &self.prescribed
    }

    /// `M`, by rows.
    #[must_use]
    pub fn matrix(&self) -> &[f64] {
        &self.matrix
    }

    /// Exchanges since the matrix was made or refreshed.
    #[must_use]
    pub fn swaps(&self) -> usize {
        self.swaps
    }

    /// `y = M x`.
    ///
    /// # Panics
    /// If a vector does not have one entry per dof.
    pub fn apply(&self, x: &[f64], y: &mut [f64]) {
        assert!(x.len() == self.m && y.len() == self.m, "response of {} dofs", self.m);
        for (i, y) in y.iter_mut().enumerate() {
            *y = dot(&self.matrix[i * self.m..(i + 1) * self.m], x);
        }
    }

    /// Exchanges force and displacement at one dof, unless `prescribed` is so already. Returns whether it did.
    ///
    /// # Errors
    /// [`SwapError::DofOutOfRange`], [`SwapError::SingularPivot`].
    pub fn prescribe(&mut self, dof: usize, prescribed: Prescribed) -> Result<bool, SwapError> {
        let m = self.m;
        let old = *self.prescribed.get(dof).ok_or(SwapError::DofOutOfRange { dof, m })?;
        if old == prescribed {
            return Ok(false);
        }
        self.pivot(dof)?;
        self.prescribed[dof] = prescribed;
        self.swaps += 1;
        Ok(true)
    }

    /// How far the response is from that of the compliance: the largest `|u − C f|`, divided by the largest sum of the magnitudes
    /// of the terms of a `(C f)_i`, for forces and displacements that `M` says belong together. Zero up to rounding, O(m²).
    pub fn drift(&mut self) -> f64 {
        let m = self.m;
        let (mut x, mut y) = (std::mem::take(&mut self.row), std::mem::take(&mut self.column));
        for i in 0..m {
            // Signs that follow no pattern; compliances scale the displacements.
            let sign = if (i * i + i / 3) % 5 < 2 { -1.0 } else { 1.0 };
            x[i] = match self.prescribed[i] {
                Prescribed::Force => sign,
                Prescribed::Displacement => sign * self.compliance[i * m + i],
            };
        }
        self.apply(&x, &mut y);
        for i in 0..m {
            if self.prescribed[i] == Prescribed::Displacement {
                std::mem::swap(&mut x[i], &mut y[i]);
            }
        }
        let (force, displacement) = (&x, &y);
        let (mut difference, mut scale) = (0.0f64, f64::MIN_POSITIVE);
        for (c, u) in self.compliance.chunks_exact(m.max(1)).zip(displacement) {
            difference = difference.max((u - dot(c, force)).abs());
            scale = scale.max(c.iter().zip(force).map(|(c, f)| (c * f).abs()).sum());
        }
        (self.row, self.column) = (x, y);
        difference / scale
    }

    /// Makes `M` from the compliance afresh: one pivot per dof whose displacement is prescribed, ascending.
    ///
    /// # Errors
    /// [`SwapError::SingularPivot`]; all forces are then prescribed.
    pub fn refresh(&mut self) -> Result<(), SwapError> {
        self.matrix.copy_from_slice(&self.compliance);
        self.swaps = 0;
        for dof in 0..self.m {
            if self.prescribed[dof] == Prescribed::Displacement
                && let Err(error) = self.pivot(dof)
            {
                self.matrix.copy_from_slice(&self.compliance);
                self.prescribed.fill(Prescribed::Force);
                return Err(error);
            }
        }
        Ok(())
    }

    fn pivot(&mut self, dof: usize) -> Result<(), SwapError> {
        let Self { m, matrix, row, column, .. } = self;
        let m = *m;
        let pivot = matrix[dof * m + dof];
        // The pivot lies between 0 and the compliance of the dof alone, or above its inverse.
        let compliance = self.compliance[dof * m + dof];
        let scale = match self.prescribed[dof] {
            Prescribed::Force => compliance,
            Prescribed::Displacement => 1.0 / compliance,
        };
        if !(pivot > m as f64 * f64::EPSILON * scale && pivot.is_finite()) {
            return Err(SwapError::SingularPivot { dof, pivot });
        }
        for (j, line) in matrix.chunks_exact(m).enumerate() {
            column[j] = line[dof];
        }
        for (to, from) in row.iter_mut().zip(&matrix[dof * m..(dof + 1) * m]) {
            *to = from / pivot;
        }
        for (j, line) in matrix.chunks_exact_mut(m).enumerate() {
            if j != dof {
                axpy(-column[j], row, line);
                line[dof] = column[j] / pivot;
            }
        }
        for (to, from) in matrix[dof * m..(dof + 1) * m].iter_mut().zip(&*row) {
            *to = -from;
        }
        matrix[dof * m + dof] = 1.0 / pivot;
        Ok(())
    }
}
