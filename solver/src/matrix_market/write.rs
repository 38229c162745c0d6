//! Writing.

use crate::sparse::ScalarCsr;
use std::io::{Error, ErrorKind, Result, Write};

/// Writes a matrix, stored zeros included: the lower half if it is symmetric to the last bit, all of it otherwise. Numbers are in
/// the shortest form that reads back as the same one. `writer` should be buffered.
///
/// # Errors
/// What the writer says.
pub fn write_matrix(writer: &mut (impl Write + ?Sized), matrix: &ScalarCsr) -> Result<()> {
    let symmetric = matrix.is_symmetric();
    let is_written = |row: usize, col: usize| !symmetric || col <= row;
    let n_written = matrix.entries().filter(|&(row, col, _)| is_written(row, col)).count();
    let symmetry = if symmetric { "symmetric" } else { "general" };
    writeln!(writer, "%%MatrixMarket matrix coordinate real {symmetry}")?;
    writeln!(writer, "{} {} {n_written}", matrix.n_rows(), matrix.n_cols())?;
    for (row, col, value) in matrix.entries().filter(|&(row, col, _)| is_written(row, col)) {
        writeln!(writer, "{} {} {value:?}", row + 1, col + 1)?;
    }
    Ok(())
}

/// Writes a vector as a dense matrix with one column. Numbers are in the shortest form that reads back as the same one. `writer`
/// should be buffered.
///
/// # Errors
/// What the writer says, and [`ErrorKind::InvalidInput`] for an entry that is not finite, before anything is written.
pub fn write_vector(writer: &mut (impl Write + ?Sized), vector: &[f64]) -> Result<()> {
    if let Some(at) = vector.iter().position(|value| !value.is_finite()) {
        let message = format!("entry {} is {}, expected a finite number", at + 1, vector[at]);
        return Err(Error::new(ErrorKind::InvalidInput, message));
    }
    writeln!(writer, "%%MatrixMarket matrix array real general")?;
    writeln!(writer, "{} 1", vector.len())?;
    vector.iter().try_for_each(|value| writeln!(writer, "{value:?}"))
}
