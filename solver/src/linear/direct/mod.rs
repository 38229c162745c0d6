//! Sparse factorisations of symmetric matrices, by faer.
//!
//! A [`Symbolic`] analysis belongs to a pattern and is shared; a [`Factor`] in `f64` or `f32` holds the numbers and is
//! refactored in its own memory. Constraints change values only: what is factored is `P A P + s (I − P)` with the projection
//! `P` of a [`Subspace`](crate::subspace::Subspace), whose pattern is that of `A`, so that one analysis serves them all.
//!
//! A factor alone does not say how well it solves. [`refine`](super::refine()) with the factor as `M` does: it evaluates the
//! residual in `f64`, mends what can be mended, and reports what is left.
//!
//! ```
//! use std::sync::Arc;
//! use stylet_solver::linear::direct::{Factor, FillOrder, Method, Symbolic};
//! use stylet_solver::linear::{RefineSettings, RefineWorkspace, refine};
//! use stylet_solver::sparse::BlockCsr;
//! use stylet_solver::stop::{Criterion, Stop, StopRule};
//! use stylet_solver::subspace::{Constraint, Subspace};
//!
//! let mut a = BlockCsr::<1>::new(2);
//! a.set_row(0, &[0, 1], &[[[2.0]], [[-1.0]]])?;
//! a.set_row(1, &[0, 1], &[[[-1.0]], [[2.0]]])?;
//! let symbolic = Arc::new(Symbolic::new(&a, FillOrder::MinimumDegree)?);
//! let mut w = Subspace::new(2);
//! let mut factor = Factor::<1, f32>::new(symbolic, Method::Llt, &a, &w)?;
//! w.set(1, Constraint::Fixed)?;
//! factor.refactor(&a, &w)?; // other values, other constraints, the same analysis
//!
//! let mut x = [0.0, 3.0]; // node 1 is held at 3
//! let stop = StopRule { tolerance: 1e-14, criterion: Criterion::Reaction, round_floor: 0.0 };
//! let settings = RefineSettings { stop, max_iterations: 10 };
//! let report = refine(&a, &factor, &w, &[1.0, 0.0], &mut x, &settings, &mut RefineWorkspace::new())?;
//! assert_eq!(report.stop, Stop::Converged);
//! assert!((x[0] - 2.0).abs() < 1e-13 && x[1] == 3.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod calls;
mod elimination;
mod factor;
mod lower;
mod numeric;
mod symbolic;

pub use factor::Factor;
pub use numeric::FactorNumber;
pub use symbolic::{FillOrder, Symbolic};

use crate::ordering::MinimumDegreeError;
#[cfg(feature = "metis")]
use crate::ordering::NestedDissectionError;
use faer::sparse::FaerError;

/// Which factors a matrix is split into. None of them changes the order of elimination across supernodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// `L Lᵀ` of a positive definite matrix.
    Llt,
    /// `L D Lᵀ` with a diagonal `D` of either sign: for quasi-definite matrices, which have it in any order.
    Ldlt,
    /// `L B Lᵀ` with blocks of one and two rows in `B`, pivots chosen after Bunch and Kaufman inside each supernode.
    Lblt,
}

/// Why a matrix has no factor, or a factor does not solve.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DirectError {
    /// Two arguments do not fit each other.
    #[error("{what} has length {len}, not {expected}")]
    Shape {
        /// Which argument.
        what: &'static str,
        /// The length it should have.
        expected: usize,
        /// Its length.
        len: usize,
    },
    /// The matrix has other columns in this row than the one that was analysed.
    #[error("block row {row} has another pattern than when it was analysed")]
    PatternChanged {
        /// Block row.
        row: usize,
    },
    /// A block is stored, its mirror image is not.
    #[error("block ({row}, {col}) is stored, block ({col}, {row}) is not")]
    PatternNotSymmetric {
        /// Block row.
        row: usize,
        /// Block column.
        col: usize,
    },
    /// An entry differs from its mirror image by more than rounding.
    #[error("entries ({row}, {col}) and ({col}, {row}) differ by {difference:e}")]
    NotSymmetric {
        /// Row.
        row: usize,
        /// Column.
        col: usize,
        /// By how much.
        difference: f64,
    },
    /// An entry is NaN or infinite, or too large for the number format of the factor.
    #[error("entry ({row}, {col}) of the matrix is not finite in the format of the factor")]
    NotFinite {
        /// Row.
        row: usize,
        /// Column.
        col: usize,
    },
    /// An entry of a right side is NaN or infinite.
    #[error("entry {index} of the right side is not finite")]
    RightSideNotFinite {
        /// Its index.
        index: usize,
    },
    /// A pivot of `L Lᵀ` is negative, or positive by rounding alone.
    #[error("pivot {pivot:e} in row {row}: not positive definite")]
    NotPositiveDefinite {
        /// Row, in the caller's numbering; the rows eliminated before it are positive definite.
        row: usize,
        /// The pivot that should have been positive.
        pivot: f64,
    },
    /// A pivot of `L D Lᵀ` or `L B Lᵀ` is zero or not finite: the matrix is singular, or needs other pivots.
    #[error("pivot {pivot:e} in row {row}: singular, or not to be eliminated in this order")]
    Singular {
        /// Row, in the caller's numbering.
        row: usize,
        /// The pivot.
        pivot: f64,
    },
    /// The factor does not give back a known solution: the matrix is singular up to rounding, or the pivots are bad.
    #[error("a known solution comes back with a relative error of {error:e}: singular up to rounding, or bad pivots")]
    IllConditioned {
        /// Largest error of an entry; the entries of the solution are near one.
        error: f64,
    },
    /// The analysis has no supernodes, inside which [`Method::Lblt`] would choose its pivots.
    #[error("a factor without supernodes leaves no choice of pivots: analyse the matrix as indefinite")]
    NoPivots,
    /// The last refactorisation failed.
    #[error("there is no factor: the last factorisation failed")]
    NoFactor,
    /// Memory or indices ran out.
    #[error("faer gave up: {0:?}")]
    Faer(FaerError),
    /// There is no minimum-degree order.
    #[error(transparent)]
    MinimumDegree(#[from] MinimumDegreeError),
    /// There is no nested-dissection order.
    #[cfg(feature = "metis")]
    #[error(transparent)]
    NestedDissection(#[from] NestedDissectionError),
}

impl From<FaerError> for DirectError {
    fn from(error: FaerError) -> Self {
        Self::Faer(error)
    }
}
