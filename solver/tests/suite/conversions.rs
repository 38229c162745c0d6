//! Block matrices to other libraries and back.

use crate::common::{elasticity, system};
use faer::sparse::{SparseColMat, SparseRowMat, Triplet};
use nalgebra_sparse::CsrMatrix;
use proptest::prelude::*;
use sprs::{CsMat, TriMat};
use stylet_solver::LinearOperator;
use stylet_solver::sparse::{BlockCsr, ConversionError, ScalarCsr};

fn rectangular() -> ScalarCsr {
    ScalarCsr::from_triplets(2, 4, &[(0, 3, 1.0), (0, 1, -2.0), (1, 0, 3.0), (0, 3, 0.5)]).unwrap()
}

#[test]
fn triplets_are_sorted_and_added_up() {
    let a = rectangular();
    assert_eq!((a.n_rows(), a.n_cols(), a.n_entries()), (2, 4, 3));
    assert_eq!(
        (a.row(0), a.get(1, 0), a.get(1, 1), a.get(2, 0)),
        ((&[1, 3][..], &[-2.0, 1.5][..]), Some(3.0), None, None)
    );
    assert_eq!(a.transpose().row(3), (&[0][..], &[1.5][..]));
    assert_eq!(a.transpose().transpose(), a);
}

#[test]
fn a_rectangular_matrix_comes_back_from_every_library() {
    let a = rectangular();
    assert_eq!(ScalarCsr::try_from(&SparseRowMat::from(a.clone())).unwrap(), a);
    assert_eq!(ScalarCsr::try_from(&SparseColMat::from(a.clone())).unwrap(), a);
    assert_eq!(ScalarCsr::try_from(&CsMat::from(a.clone())).unwrap(), a);
    assert_eq!(ScalarCsr::try_from(&CsMat::from(a.clone()).to_csc()).unwrap(), a);
    assert_eq!(ScalarCsr::try_from(&CsrMatrix::from(a.clone())).unwrap(), a);
}

#[test]
fn entries_land_where_other_libraries_have_them() {
    let a = elasticity::cube(2, 0.3).a;
    let (row, col) = (SparseRowMat::from(&a), SparseColMat::from(&a));
    let (sprs, nalgebra) = (CsMat::from(&a), CsrMatrix::from(&a));
    for (i, j, value) in a.to_scalar_csr().entries() {
        assert_eq!((row.get(i, j), col.get(i, j), sprs.get(i, j)), (Some(&value), Some(&value), Some(&value)));
        assert_eq!(nalgebra.get_entry(i, j).unwrap().into_value(), value);
    }
    // Storage by columns is told from storage by rows.
    let b = TriMat::from_triplets((2, 2), vec![0, 1, 1], vec![1, 0, 1], vec![1.0, 2.0, 3.0]);
    for b in [b.to_csr::<usize>(), b.to_csc()] {
        assert_eq!(BlockCsr::<2>::try_from(&b).unwrap().get(0, 0), Some(&[[0.0, 1.0], [2.0, 3.0]]));
    }
    let triplets = [Triplet::new(1, 0, 4.0), Triplet::new(1, 0, 1.0), Triplet::new(1, 1, 0.0)];
    let c = SparseColMat::<usize, f64>::try_new_from_triplets(2, 2, &triplets).unwrap();
    assert_eq!(BlockCsr::<1>::try_from(&c).unwrap().row(1), (&[0, 1][..], &[[[5.0]], [[0.0]]][..]));
}

#[test]
fn what_is_no_block_matrix_is_refused() {
    let a = rectangular();
    assert_eq!(a.to_blocks::<2>().unwrap_err(), ConversionError::NotSquare { n_rows: 2, n_cols: 4 });
    let three = ScalarCsr::from_triplets(3, 3, &[]).unwrap();
    let error = three.to_blocks::<2>().unwrap_err();
    assert_eq!(error.to_string(), "3 rows are no multiple of the block size 2");
    assert_eq!(BlockCsr::<2>::try_from(&CsMat::from(three)).unwrap_err(), error);

    let nan = TriMat::from_triplets((2, 3), vec![1], vec![2], vec![f64::NAN]);
    for nan in [nan.to_csr::<usize>(), nan.to_csc()] {
        let error = ScalarCsr::try_from(&nan).unwrap_err();
        assert_eq!(error.to_string(), "entry (1, 2) is NaN, expected was a finite number");
    }
    for (indptr, indices, expected) in [
        (vec![0, 2], vec![0, 2], "entry (0, 2) lies outside a matrix of 1 x 2"),
        (vec![0, 2], vec![1, 1], "columns of row 0 do not ascend: 1 follows 1"),
        (vec![0, 1], vec![0, 1], "row pointers from 0 to 1 over 1 rows do not fit 2 columns and 2 numbers"),
        (vec![0, 3, 2], vec![0, 1], "row pointers from 0 to 2 over 2 rows do not fit 2 columns and 2 numbers"),
        (vec![], vec![0, 1], "row pointers from 1 to 0 over 0 rows do not fit 2 columns and 2 numbers"),
    ] {
        assert_eq!(ScalarCsr::new(2, indptr, indices, vec![1.0; 2]).unwrap_err().to_string(), expected);
    }
    let outside = ScalarCsr::from_triplets(1, 1, &[(1, 0, 1.0)]).unwrap_err();
    assert_eq!(outside.to_string(), "entry (1, 0) lies outside a matrix of 1 x 1");
}

#[test]
fn asymmetry_names_a_pair_of_entries() {
    let a = ScalarCsr::from_triplets(3, 3, &[(0, 2, 1.0), (2, 0, 1.0 + 1e-9), (1, 1, 5.0), (2, 1, 3.0)]).unwrap();
    let found = a.find_asymmetry(1e-8).unwrap();
    assert_eq!((found.row, found.col, found.below, found.above), (2, 1, 3.0, 0.0));
    assert_eq!(a.find_asymmetry(1e-10).unwrap().col, 0);
    let upper = ScalarCsr::from_triplets(2, 2, &[(0, 1, 1.0)]).unwrap();
    let found = upper.find_asymmetry(0.5).unwrap();
    assert_eq!((found.row, found.col, found.below, found.above), (1, 0, 0.0, 1.0));
    assert!(elasticity::cube(2, 0.3).a.to_scalar_csr().find_asymmetry(1e-12).is_none());
}

proptest! {
    #[test]
    fn blocks_come_back_from_every_library(s in system::<3>(), x in proptest::collection::vec(-1.0..1.0f64, 36)) {
        let a = &s.a;
        prop_assert_eq!(&BlockCsr::<3>::try_from(&SparseRowMat::from(a)).unwrap(), a);
        prop_assert_eq!(&BlockCsr::<3>::try_from(&SparseColMat::from(a)).unwrap(), a);
        prop_assert_eq!(&BlockCsr::<3>::try_from(&CsMat::from(a)).unwrap(), a);
        prop_assert_eq!(&BlockCsr::<3>::try_from(&CsrMatrix::from(a)).unwrap(), a);
        // Blocks of another size are the same operator.
        let single = a.to_scalar_csr().to_blocks::<1>().unwrap();
        let (mut y, mut z) = (vec![0.0; a.dim()], vec![0.0; a.dim()]);
        a.apply(&x[..a.dim()], &mut y);
        single.apply(&x[..a.dim()], &mut z);
        let largest = y.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        prop_assert!(y.iter().zip(&z).all(|(y, z)| (y - z).abs() <= 1e-13 * largest.max(1.0)));
    }
}
