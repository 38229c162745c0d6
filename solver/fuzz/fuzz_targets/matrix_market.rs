#![no_main]

// Any bytes are a matrix of finite numbers or an error with a line; and what was read can be written and read again as the same.

use stylet_solver::matrix_market::{read_matrix, read_vector, write_matrix, write_vector};
use stylet_solver::sparse::ScalarCsr;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    match read_matrix(bytes) {
        Ok(matrix) => check(&matrix),
        // Showing an error must not fail either.
        Err(error) => assert!(error.line > 0 && error.to_string().len() < 500),
    }
    match read_vector(bytes) {
        Ok(vector) => {
            let mut copy = Vec::new();
            write_vector(&mut copy, &vector).expect("finite numbers");
            assert_eq!(read_vector(&copy[..]).expect("what was written"), vector);
        }
        Err(error) => assert!(error.line > 0 && error.to_string().len() < 500),
    }
});

fn check(matrix: &ScalarCsr) {
    let (n_rows, n_cols) = (matrix.n_rows(), matrix.n_cols());
    assert!(matrix.entries().all(|(i, j, value)| i < n_rows && j < n_cols && value.is_finite()));
    let mut copy = Vec::new();
    write_matrix(&mut copy, matrix).expect("memory");
    let back = read_matrix(&copy[..]);
    assert_eq!(back.expect("what was written"), *matrix);
    assert_eq!(matrix.to_blocks::<1>().is_ok(), n_rows == n_cols);
    assert_eq!(matrix.to_blocks::<2>().is_ok(), n_rows == n_cols && n_rows % 2 == 0);
}
