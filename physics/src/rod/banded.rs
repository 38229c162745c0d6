//! Factors of matrices whose blocks lie within two nodes of the diagonal, as those of a rod do.

use stylet_solver::nonlinear::HessianPreconditioner;
use stylet_solver::precondition::Preconditioner;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;

/// Nodes to either side of the diagonal.
const REACH: usize = 2;
/// Entries left of the diagonal in a scalar row.
const BAND: usize = 3 * REACH + 2;

/// A matrix that has no factor of this kind.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BandedError {
    /// Matrix and subspace have different numbers of nodes.
    #[error("matrix has {rows} block rows, subspace has {nodes} nodes")]
    Shape {
        /// Block rows of the matrix.
        rows: usize,
        /// Nodes of the subspace.
        nodes: usize,
    },
    /// A block outside the band.
    #[error("block ({row}, {col}) is more than two nodes from the diagonal")]
    OutsideBand {
        /// Block row.
        row: usize,
        /// Block column.
        col: usize,
    },
    /// A pivot is zero to rounding errors, or not finite.
    #[error("pivot {pivot:e} of node {node}: the matrix is singular on the allowed moves")]
    Singular {
        /// Node.
        node: usize,
        /// The pivot.
        pivot: f64,
    },
}

/// `P A P + s (1 - P) = L D L'` without exchanging rows, `P` the projection onto the allowed moves: on these it solves `A`.
///
/// The number of negative pivots is that of negative eigenvalues on the allowed moves (Sylvester). Factoring the same number of
/// nodes again allocates nothing. A matrix that is not positive definite may have no factor although it is regular, and one with
/// small pivots is inexact: where that matters the matrix is to be made definite first.
///
/// As a preconditioner it takes pivots for positive, which makes the preconditioner positive definite.
#[derive(Clone, Debug, Default)]
pub struct BandedFactor {
    /// Rows of `L` left of the diagonal, nearest last, and `D`.
    rows: Vec<[f64; BAND]>,
    pivots: Vec<f64>,
    negative: usize,
    subspace: Subspace<3>,
}

impl BandedFactor {
    /// An empty factor.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Factors a symmetric matrix on the moves that the subspace allows.
    ///
    /// # Errors
    /// [`BandedError`]; the factor is then of no use.
    pub fn factor(&mut self, a: &BlockCsr<3>, w: &Subspace<3>) -> Result<(), BandedError> {
        let n = a.n_rows();
        if n != w.n_nodes() {
            return Err(BandedError::Shape { rows: n, nodes: w.n_nodes() });
        }
        self.subspace.clone_from(w);
        self.load(a, w)?;
        self.negative = 0;
        for i in 0..3 * n {
            self.eliminate(i)?;
        }
        Ok(())
    }

    /// Lower triangle of the matrix, constraints in it.
    fn load(&mut self, a: &BlockCsr<3>, w: &Subspace<3>) -> Result<(), BandedError> {
        let n = a.n_rows();
        self.rows.clear();
        self.rows.resize(3 * n, [0.0; BAND]);
        self.pivots.clear();
        self.pivots.resize(3 * n, 0.0);
        for row in 0..n {
            let (columns, blocks) = a.row(row);
            for (&col, block) in columns.iter().zip(blocks) {
                let col = col as usize;
                if row.abs_diff(col) > REACH {
                    return Err(BandedError::OutsideBand { row, col });
                }
                if col <= row {
                    self.load_block(w, row, col, block);
                }
            }
        }
        Ok(())
    }

    fn load_block(&mut self, w: &Subspace<3>, row: usize, col: usize, block: &[[f64; 3]; 3]) {
        let (left, right) = (w.get(row), w.get(col));
        // Rows, then columns: P A P.
        let half = block.map(|r| right.project(r));
        let mut projected = [[0.0; 3]; 3];
        for l in 0..3 {
            let column = left.project([half[0][l], half[1][l], half[2][l]]);
            (0..3).for_each(|k| projected[k][l] = column[k]);
        }
        if row == col {
            let scale = (0..3).map(|k| block[k][k].abs()).fold(0.0, f64::max);
            let scale = if scale > 0.0 && scale.is_finite() { scale } else { 1.0 };
            for k in 0..3 {
                let unit: [f64; 3] = std::array::from_fn(|l| f64::from(l == k));
                let allowed = left.project(unit);
                (0..3).for_each(|l| projected[k][l] += scale * (unit[l] - allowed[l]));
            }
        }
        for (k, entries) in projected.iter().enumerate() {
            let i = 3 * row + k;
            for (l, &value) in entries.iter().enumerate() {
                let j = 3 * col + l;
                if j < i {
                    self.rows[i][BAND + j - i] = value;
                } else if j == i {
                    self.pivots[i] = value;
                }
            }
        }
    }

    /// Row `i` of the factor, with the products `l_ij d_j` in place of `l_ij` until the pivot is known.
    fn eliminate(&mut self, i: usize) -> Result<(), BandedError> {
        let mut row = self.rows[i];
        let first = i.saturating_sub(BAND);
        for j in first..i {
            // Columns that rows i and j share.
            let other = &self.rows[j];
            let mut value = row[BAND + j - i];
            for k in first..j {
                value -= row[BAND + k - i] * other[BAND + k - j];
            }
            row[BAND + j - i] = value;
        }
        let diagonal = self.pivots[i];
        let (mut pivot, mut size) = (diagonal, diagonal.abs());
        for j in first..i {
            let product = row[BAND + j - i];
            let l = product / self.pivots[j];
            pivot -= product * l;
            size = size.max((product * l).abs());
            row[BAND + j - i] = l;
        }
        self.rows[i] = row;
        self.pivots[i] = pivot;
        if !pivot.is_finite() || pivot.abs() <= BAND as f64 * f64::EPSILON * size {
            return Err(BandedError::Singular { node: i / 3, pivot });
        }
        self.negative += usize::from(pivot < 0.0);
        Ok(())
    }

    /// Number of negative eigenvalues on the allowed moves.
    #[must_use]
    pub fn n_negative(&self) -> usize {
        self.negative
    }

    /// `x <- P A^-1 P x`.
    ///
    /// # Panics
    /// If `x` does not have three numbers for each node.
    pub fn solve(&self, x: &mut [f64]) {
        self.solve_with(x, |pivot| pivot);
    }

    fn solve_with(&self, x: &mut [f64], pivot: impl Fn(f64) -> f64) {
        assert_eq!(x.len(), self.pivots.len(), "right side of a factor");
        self.subspace.project(x);
        let n = x.len();
        for i in 0..n {
            for j in i.saturating_sub(BAND)..i {
                x[i] -= self.rows[i][BAND + j - i] * x[j];
            }
        }
        for i in 0..n {
            x[i] /= pivot(self.pivots[i]);
        }
        for i in (0..n).rev() {
            for j in i.saturating_sub(BAND)..i {
                x[j] -= self.rows[i][BAND + j - i] * x[i];
            }
        }
        self.subspace.project(x);
    }
}

impl Preconditioner for BandedFactor {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
        self.solve_with(z, f64::abs);
    }
}

impl HessianPreconditioner<3> for BandedFactor {
    fn follow(&mut self, hessian: &BlockCsr<3>, w: &Subspace<3>) -> bool {
        self.factor(hessian, w).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector, SymmetricEigen};
    use proptest::prelude::*;
    use stylet_solver::subspace::Constraint;

    /// A symmetric matrix of `n` nodes with numbers from `entries`, `shift` added to the diagonal.
    fn matrix(n: usize, entries: &[f64], shift: f64) -> BlockCsr<3> {
        let mut next = entries.iter().copied().cycle();
        let mut dense = DMatrix::zeros(3 * n, 3 * n);
        for i in 0..3 * n {
            for j in 0..=i {
                if i / 3 - j / 3 <= REACH {
                    dense[(i, j)] = next.next().unwrap_or(0.0);
                    dense[(j, i)] = dense[(i, j)];
                }
            }
            dense[(i, i)] += shift;
        }
        let mut sparse = BlockCsr::new(n);
        for i in 0..n {
            let columns: Vec<u32> = (i.saturating_sub(REACH)..(i + REACH + 1).min(n)).map(|j| j as u32).collect();
            let block =
                |j: u32| std::array::from_fn(|k| std::array::from_fn(|l| dense[(3 * i + k, 3 * j as usize + l)]));
            sparse.set_row(i, &columns, &columns.iter().map(|&j| block(j)).collect::<Vec<_>>()).unwrap();
        }
        sparse
    }

    fn subspace(n: usize, held: &[u8]) -> Subspace<3> {
        let mut w = Subspace::new(n);
        for (node, kind) in held.iter().take(n).enumerate() {
            let constraint = match kind {
                0 => Constraint::Fixed,
                1 => Constraint::Line([0.6, 0.0, 0.8]),
                2 => Constraint::Plane([0.0, -0.8, 0.6]),
                _ => Constraint::Free,
            };
            w.set(node, constraint).unwrap();
        }
        w
    }

    /// `P A P`.
    fn projected(a: &BlockCsr<3>, w: &Subspace<3>) -> DMatrix<f64> {
        let n = 3 * a.n_rows();
        DMatrix::from_columns(
            &(0..n)
                .map(|j| {
                    let (mut unit, mut column) = (vec![0.0; n], vec![0.0; n]);
                    unit[j] = 1.0;
                    w.project(&mut unit);
                    stylet_solver::LinearOperator::apply(a, &unit, &mut column);
                    w.project(&mut column);
                    DVector::from_vec(column)
                })
                .collect::<Vec<_>>(),
        )
    }

    proptest! {
        #[test]
        fn a_factor_solves_and_counts(
            n in 1..9usize,
            entries in proptest::collection::vec(-1.0..1.0f64, 60),
            held in proptest::collection::vec(0..8u8, 9),
            shift in prop_oneof![Just(12.0), -3.0..3.0f64],
            x in proptest::collection::vec(-1.0..1.0f64, 27),
        ) {
            let (a, w) = (matrix(n, &entries, shift), subspace(n, &held));
            let p = projected(&a, &w);
            let mut x = x[..3 * n].to_vec();
            w.project(&mut x);
            let mut b = (&p * DVector::from_column_slice(&x)).as_slice().to_vec();
            let eigen = SymmetricEigen::new(p).eigenvalues;
            let smallest = eigen.iter().map(|e| e.abs()).filter(|&e| e > 1e-12).fold(f64::INFINITY, f64::min);
            let mut factor = BandedFactor::new();
            if shift < 12.0 && (factor.factor(&a, &w).is_err() || smallest < 1e-3) {
                return Ok(()); // without exchanges of rows some indefinite matrices have no factor
            }
            factor.factor(&a, &w).unwrap();
            prop_assert_eq!(factor.n_negative(), eigen.iter().filter(|&&e| e < -1e-12).count());
            let small = factor.pivots.iter().map(|p| p.abs()).fold(f64::INFINITY, f64::min);
            factor.solve(&mut b);
            for (b, x) in b.iter().zip(&x) {
                prop_assert!((b - x).abs() < 1e-9 / small.powi(2).min(1.0), "{b} for {x}");
            }
        }
    }

    #[test]
    fn what_has_no_factor_is_an_error() {
        let mut factor = BandedFactor::new();
        let a = matrix(3, &[0.5], 12.0);
        assert_eq!(factor.factor(&a, &Subspace::new(2)), Err(BandedError::Shape { rows: 3, nodes: 2 }));
        let singular = factor.factor(&matrix(3, &[1.0], 0.0), &Subspace::new(3));
        assert!(matches!(singular, Err(BandedError::Singular { node: 0, .. })), "{singular:?}");
        let mut wide = BlockCsr::<3>::new(4);
        wide.set_row(3, &[0, 3], &[[[1.0; 3]; 3]; 2]).unwrap();
        assert_eq!(factor.factor(&wide, &Subspace::new(4)), Err(BandedError::OutsideBand { row: 3, col: 0 }));
    }
}
