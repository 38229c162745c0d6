//! Files that other programs wrote; `tests/data/README.md` says which.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use stylet_solver::matrix_market::{read_matrix, read_vector};

fn sample(name: &str) -> BufReader<File> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/matrix_market").join(name);
    BufReader::new(File::open(path).unwrap())
}

#[test]
fn files_of_scipy_are_read() {
    let a = read_matrix(sample("poisson-4x4.mtx")).unwrap();
    assert_eq!((a.n_rows(), a.n_entries(), a.is_symmetric()), (16, 64, true));
    assert_eq!(
        (a.get(5, 5), a.get(5, 4), a.get(5, 9), a.get(5, 10)),
        (Some(4.0 / 3.0), Some(-1.0 / 3.0), Some(-1.0 / 3.0), None)
    );
    let b = read_vector(sample("load.mtx")).unwrap();
    assert_eq!(b.len(), 16);
    assert!(b.iter().zip(1..).all(|(b, i)| (b - f64::from(i).sin()).abs() <= f64::EPSILON));
    let c = read_matrix(sample("constraints.mtx")).unwrap();
    assert_eq!((c.n_rows(), c.n_cols()), (2, 16));
    assert_eq!(c.entries().collect::<Vec<_>>(), [(0, 0, 1.0), (0, 5, -1.0), (1, 15, 0.1)]);
}
