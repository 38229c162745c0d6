//! Matrices and vectors in Matrix Market files, the exchange format that every linear algebra package reads.
//!
//! ```text
//! %%MatrixMarket matrix coordinate real symmetric      banner: format, field, symmetry
//! % a comment
//! 3 3 4                                                rows, columns, entries that follow
//! 1 1 2.0                                              row, column, value, counted from 1
//! 2 2 2.0
//! 3 2 -1.0
//! 3 3 2.0
//! ```
//!
//! Read are the formats `coordinate` and `array` (dense, column by column), the fields `real`, `integer` and `pattern` (every
//! entry is 1), and the symmetries `general`, `symmetric` and `skew-symmetric`. `complex` and `hermitian` are refused. A file is
//! user input: whatever it holds, the answer is a matrix of finite numbers or a [`ReadError`] that names the line, and
//! memory grows with what was read, not with what the file announces.
//!
//! Where the published description leaves a choice:
//!
//! * Entries of one place are added up, in the order of the file, as by `scipy.io.mmread` and Eigen's `loadMarket`.
//! * A file that says `symmetric` lists one half of the matrix, by the description the lower one. Writers that list the upper
//!   half exist, and are read, as by `scipy.io.mmread`, which mirrors whatever it finds. A file that lists entries on
//!   both sides of the diagonal is refused: such readers would double them silently.
//! * A skew-symmetric file may state diagonal entries if they are zero.
//! * Comments and blank lines may stand anywhere after the banner; words of the banner may be in any case.
//! * More than [`MOST_EMPTY`] rows or columns are read only if the file has as many entries.
//!
//! Of the readers on crates.io, that of `sprs` 0.11 sizes arrays by the header and says of any defect but "Bad matrix market
//! file", and that of `nalgebra-sparse` 0.12 keeps a syntax tree of the whole file and names no line for a bad index:
//! hence this one.
//!
//! Source: Boisvert, Pozo & Remington, *The Matrix Market Exchange Formats: Initial Design*, NISTIR 5935 (1996).
//!
//! ```
//! use stylet_solver::matrix_market::{read_matrix, write_matrix};
//!
//! let file = "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 2\n2 1 -1\n2 2 2\n";
//! let a = read_matrix(file.as_bytes())?;
//! assert_eq!(a.row(0), (&[0, 1][..], &[2.0, -1.0][..]));
//! let blocks = a.to_blocks::<2>()?;
//! assert_eq!(blocks.get(0, 0), Some(&[[2.0, -1.0], [-1.0, 2.0]]));
//!
//! let mut copy = Vec::new();
//! write_matrix(&mut copy, &a)?;
//! assert_eq!(read_matrix(&copy[..])?, a);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod header;
mod lines;
mod read;
mod write;

pub use error::{Problem, ReadError};
pub use read::{MOST_EMPTY, read_matrix, read_vector};
pub use write::{write_matrix, write_vector};

#[cfg(test)]
mod tests;
