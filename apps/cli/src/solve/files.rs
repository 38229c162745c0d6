//! The files of a system.

use crate::exit::Failure;
use std::fs::File;
use std::io::{BufReader, BufWriter, Error, ErrorKind, Write as _};
use std::path::Path;
use stylet_solver::matrix_market::{self, ReadError};
use stylet_solver::sparse::ScalarCsr;

/// Reads a matrix.
///
/// # Errors
/// Names the file and, if it is that far, the line.
pub fn read_matrix(path: &Path) -> Result<ScalarCsr, Failure> {
    matrix_market::read_matrix(open(path)?).map_err(|error| unreadable(path, &error))
}

/// Reads a vector.
///
/// # Errors
/// Names the file and, if it is that far, the line.
pub fn read_vector(path: &Path) -> Result<Vec<f64>, Failure> {
    matrix_market::read_vector(open(path)?).map_err(|error| unreadable(path, &error))
}

/// Opens a file for reading.
///
/// # Errors
/// Names the file.
pub fn open(path: &Path) -> Result<BufReader<File>, Failure> {
    let fail = |what: &str| Failure::bad_input(format!("{}: {what}", path.display()));
    if path.is_dir() {
        return Err(fail("this is a folder, expected was a file"));
    }
    File::open(path).map(BufReader::new).map_err(|error| match error.kind() {
        ErrorKind::NotFound => fail("no such file"),
        _ => fail(&error.to_string()),
    })
}

fn unreadable(path: &Path, error: &ReadError) -> Failure {
    Failure::bad_input(format!("{}, {error}", path.display()))
}

/// Writes a vector to a file that is whole or not there.
///
/// # Errors
/// Names the file.
pub fn write_vector(path: &Path, vector: &[f64]) -> Result<(), Failure> {
    let fail = |error: Error| Failure::bad_input(format!("{}: {error}", path.display()));
    let Some(name) = path.file_name() else {
        return Err(Failure::bad_input(format!("--out: found {}, expected a file name", path.display())));
    };
    let temporary = path.with_file_name(format!(".{}.{}.part", name.to_string_lossy(), std::process::id()));
    let written = File::create(&temporary).and_then(|file| {
        let mut file = BufWriter::new(file);
        matrix_market::write_vector(&mut file, vector)?;
        file.flush()
    });
    written.and_then(|()| std::fs::rename(&temporary, path)).map_err(|error| {
        // The first error is the one to report.
        let _ = std::fs::remove_file(&temporary);
        fail(error)
    })
}
