//! The system as it was given, checked.

use super::args::{Method, Precision, Precond, SolveArgs};
use super::coordinates::Coordinates;
use super::files::{read_matrix, read_vector};
use super::saddle::Saddle;
use crate::exit::Failure;
use std::path::Path;
use stylet_solver::sparse::ScalarCsr;

/// Mirrored entries may differ by this much, relative to the largest entry of their rows: more than rounding, less than a
/// number that was printed with few digits.
const SYMMETRY: f64 = 1e-10;

/// A system that can be handed to a method.
pub struct Problem {
    pub matrix: ScalarCsr,
    pub b: Vec<f64>,
    pub saddle: Option<Saddle>,
    pub coordinates: Option<Coordinates>,
    /// Rows that belong to one node.
    pub block: usize,
    pub method: Method,
    pub precond: Precond,
    /// Why the method cannot work, although the input is sound.
    pub not_definite: Option<String>,
}

impl Problem {
    /// Reads and checks everything.
    ///
    /// # Errors
    /// Names the option, or the file and the row.
    pub fn read(args: &SolveArgs) -> Result<Self, Failure> {
        let (method, precond) = choose(args)?;
        let matrix = read_matrix(&args.matrix)?;
        let n = matrix.n_rows();
        check_matrix(&args.matrix, &matrix)?;
        let coordinates = args.coords.as_deref().map(Coordinates::read).transpose()?;
        let block = block_size(args, n, coordinates.as_ref())?;
        let b = match &args.right_side {
            None => vec![1.0; n],
            Some(path) => sized(path, read_vector(path)?, n, "row", &args.matrix)?,
        };
        let not_definite = check_diagonal(&args.matrix, &matrix, method, precond)?;
        let saddle = args.constraints.as_deref().map(|path| Saddle::read(path, args, &matrix)).transpose()?;
        Ok(Self { matrix, b, saddle, coordinates, block, method, precond, not_definite })
    }
}

/// Method and preconditioner, if the options make sense together.
fn choose(args: &SolveArgs) -> Result<(Method, Precond), Failure> {
    let refuse = |line: String| Err(Failure::bad_input(line));
    let constrained = args.constraints.is_some();
    let method = args.method.unwrap_or(if constrained { Method::ProjectedCg } else { Method::Cg });
    match method.wants_constraints() {
        Some(true) if !constrained => {
            return refuse(format!("--method: found {method}, expected it together with --constraints"));
        }
        Some(false) if constrained => {
            let expected = "kkt-cg, minres, projected-cg, null-space, ldlt or lblt";
            return refuse(format!("--method: found {method} together with --constraints, expected {expected}"));
        }
        _ => {}
    }
    if let Some(precond) = args.precond.filter(|_| !method.takes_preconditioner()) {
        let why = if method.is_direct() { "which needs none" } else { "which has its own" };
        return refuse(format!("--precond: found {precond} together with --method {method}, {why}"));
    }
    if args.precision == Precision::Mixed && !method.is_direct() && method != Method::Cg {
        let expected = "cg, cholesky, ldlt or lblt";
        return refuse(format!("--precision: found mixed together with --method {method}, expected {expected}"));
    }
    let default = if method == Method::Cg { Precond::BlockJacobi } else { Precond::None };
    let precond = args.precond.unwrap_or(default);
    if args.precision == Precision::Mixed && !matches!(precond, Precond::None | Precond::BlockJacobi) {
        let expected = "none or block-jacobi";
        return refuse(format!("--precond: found {precond} together with --precision mixed, expected {expected}"));
    }
    Ok((method, precond))
}

fn check_matrix(path: &Path, matrix: &ScalarCsr) -> Result<(), Failure> {
    let refuse = |what: String| Err(Failure::bad_input(format!("{}: {what}", path.display())));
    let (n_rows, n_cols) = (matrix.n_rows(), matrix.n_cols());
    if n_rows == 0 || n_cols == 0 {
        return refuse(format!("{n_rows} x {n_cols}, expected a matrix that is not empty"));
    }
    if n_rows != n_cols {
        return refuse(format!("{n_rows} x {n_cols}, expected a square matrix"));
    }
    match matrix.find_asymmetry(SYMMETRY) {
        None => Ok(()),
        Some(pair) => {
            let (i, j) = (pair.row + 1, pair.col + 1);
            let (below, above) = (pair.below, pair.above);
            refuse(format!("entry ({i}, {j}) is {below:?}, entry ({j}, {i}) is {above:?}, expected a symmetric matrix"))
        }
    }
}

fn block_size(args: &SolveArgs, n: usize, coordinates: Option<&Coordinates>) -> Result<usize, Failure> {
    let matrix = args.matrix.display();
    let block = match (args.block, coordinates) {
        (Some(block), Some(coordinates)) if block != coordinates.dimension => {
            let found = coordinates.dimension;
            let line =
                format!("--block: found {block} together with --coords of {found} numbers a line, expected {found}");
            return Err(Failure::bad_input(line));
        }
        (Some(block), _) => block,
        (None, coordinates) => coordinates.map_or(1, |coordinates| coordinates.dimension),
    };
    if !n.is_multiple_of(block) {
        let line = format!("{matrix}: {n} rows, expected a multiple of the {block} rows of a node");
        return Err(Failure::bad_input(line));
    }
    match (coordinates, &args.coords) {
        (Some(coordinates), Some(path)) if coordinates.n_nodes() != n / block => {
            let (found, expected, path) = (coordinates.n_nodes(), n / block, path.display());
            let line =
                format!("{path}: {found} nodes, expected {expected}: {matrix} has {n} rows, {block} for each node");
            Err(Failure::bad_input(line))
        }
        _ => Ok(block),
    }
}

/// Looks for a diagonal entry that a method cannot work with: zero is bad input, a negative one means that the matrix is
/// not positive definite, which is returned.
fn check_diagonal(
    path: &Path,
    matrix: &ScalarCsr,
    method: Method,
    precond: Precond,
) -> Result<Option<String>, Failure> {
    let needed_by = match method {
        Method::Cg | Method::Cholesky | Method::ProjectedCg => format!("--method {method}"),
        _ if precond != Precond::None => format!("--precond {precond}"),
        _ => return Ok(None),
    };
    let diagonal = |row| matrix.get(row, row).unwrap_or(0.0);
    let Some(row) = (0..matrix.n_rows()).find(|&row| diagonal(row) <= 0.0) else { return Ok(None) };
    let (value, number) = (diagonal(row), row + 1);
    if value < 0.0 {
        return Ok(Some(format!(
            "row {number}: diagonal entry {value:?}: not positive definite, as {needed_by} needs it"
        )));
    }
    let path = path.display();
    let line = format!("{path}: row {number}: diagonal entry 0, expected a positive one for {needed_by}");
    Err(Failure::bad_input(line))
}

/// A vector of a file, if it has the length of another file's matrix.
pub fn sized(path: &Path, vector: Vec<f64>, n: usize, what: &str, of: &Path) -> Result<Vec<f64>, Failure> {
    if vector.len() == n {
        return Ok(vector);
    }
    let (path, found, of) = (path.display(), vector.len(), of.display());
    Err(Failure::bad_input(format!("{path}: {found} entries, expected {n}, one for each {what} of {of}")))
}
