//! The matrix as the types of other libraries, and back.
//!
//! Where a library stores what a [`ScalarCsr`] does not, the way back settles it: columns are sorted, entries of one place
//! added up, and NaN, infinities and sizes that blocks do not divide refused.

/// Blocks go to and from another library's type by way of scalars.
#[cfg(any(feature = "sprs", feature = "direct", feature = "nalgebra"))]
macro_rules! blocks_through_scalars {
    ($foreign:ty) => {
        impl<const B: usize> From<&BlockCsr<B>> for $foreign {
            fn from(matrix: &BlockCsr<B>) -> Self {
                matrix.to_scalar_csr().into()
            }
        }

        impl<const B: usize> TryFrom<&$foreign> for BlockCsr<B> {
            type Error = ConversionError;

            fn try_from(matrix: &$foreign) -> Result<Self, ConversionError> {
                ScalarCsr::try_from(matrix)?.to_blocks()
            }
        }
    };
}

#[cfg(feature = "direct")]
mod to_faer {
    use crate::sparse::{BlockCsr, ConversionError, ScalarCsr};
    use faer::sparse::{SparseColMat, SparseRowMat, SparseRowMatRef, SymbolicSparseRowMat};

    blocks_through_scalars!(SparseRowMat<usize, f64>);
    blocks_through_scalars!(SparseColMat<usize, f64>);

    impl From<ScalarCsr> for SparseRowMat<usize, f64> {
        fn from(matrix: ScalarCsr) -> Self {
            let (n_rows, n_cols) = (matrix.n_rows(), matrix.n_cols());
            let (indptr, indices, values) = matrix.into_parts();
            Self::new(SymbolicSparseRowMat::new_checked(n_rows, n_cols, indptr, None, indices), values)
        }
    }

    impl From<ScalarCsr> for SparseColMat<usize, f64> {
        fn from(matrix: ScalarCsr) -> Self {
            SparseRowMat::from(matrix.transpose()).into_transpose()
        }
    }

    impl TryFrom<&SparseRowMat<usize, f64>> for ScalarCsr {
        type Error = ConversionError;

        fn try_from(matrix: &SparseRowMat<usize, f64>) -> Result<Self, ConversionError> {
            scalar(matrix.as_ref())
        }
    }

    impl TryFrom<&SparseColMat<usize, f64>> for ScalarCsr {
        type Error = ConversionError;

        fn try_from(matrix: &SparseColMat<usize, f64>) -> Result<Self, ConversionError> {
            scalar(matrix.transpose()).map(|transposed| transposed.transpose()).map_err(ConversionError::transposed)
        }
    }

    fn scalar(matrix: SparseRowMatRef<'_, usize, f64>) -> Result<ScalarCsr, ConversionError> {
        let row = |i| matrix.symbolic().col_idx_of_row(i).zip(matrix.val_of_row(i).iter().copied());
        ScalarCsr::from_rows(matrix.ncols(), (0..matrix.nrows()).map(row))
    }
}

#[cfg(feature = "sprs")]
mod to_sprs {
    use crate::sparse::{BlockCsr, ConversionError, ScalarCsr};
    use sprs::CsMat;
    use std::ops::Range;

    blocks_through_scalars!(CsMat<f64>);

    impl From<ScalarCsr> for CsMat<f64> {
        /// Stored by rows.
        fn from(matrix: ScalarCsr) -> Self {
            let shape = (matrix.n_rows(), matrix.n_cols());
            let (indptr, indices, values) = matrix.into_parts();
            Self::new(shape, indptr, indices, values)
        }
    }

    impl TryFrom<&CsMat<f64>> for ScalarCsr {
        type Error = ConversionError;

        /// From either order of storage.
        fn try_from(matrix: &CsMat<f64>) -> Result<Self, ConversionError> {
            let (indptr, indices, values) = (matrix.indptr(), matrix.indices(), matrix.data());
            let entries =
                |range: Range<usize>| indices[range.clone()].iter().copied().zip(values[range].iter().copied());
            let stored = Self::from_rows(matrix.inner_dims(), indptr.iter_outer_sz().map(entries));
            if matrix.is_csr() {
                return stored;
            }
            stored.map(|transposed| transposed.transpose()).map_err(ConversionError::transposed)
        }
    }
}

#[cfg(feature = "nalgebra")]
mod to_nalgebra {
    use crate::sparse::{BlockCsr, ConversionError, ScalarCsr};
    use nalgebra_sparse::CsrMatrix;

    blocks_through_scalars!(CsrMatrix<f64>);

    impl From<ScalarCsr> for CsrMatrix<f64> {
        fn from(matrix: ScalarCsr) -> Self {
            let (n_rows, n_cols) = (matrix.n_rows(), matrix.n_cols());
            let (indptr, indices, values) = matrix.into_parts();
            Self::try_from_csr_data(n_rows, n_cols, indptr, indices, values)
                .expect("columns in range that ascend strictly")
        }
    }

    impl TryFrom<&CsrMatrix<f64>> for ScalarCsr {
        type Error = ConversionError;

        fn try_from(matrix: &CsrMatrix<f64>) -> Result<Self, ConversionError> {
            let (indptr, indices, values) = matrix.csr_data();
            Self::new(matrix.ncols(), indptr.to_vec(), indices.to_vec(), values.to_vec())
        }
    }
}
