//! Constraints, checked: `A x + Cᵀy = b`, `C x = d`.

use super::args::SolveArgs;
use super::files::{read_matrix, read_vector};
use super::input::sized;
use crate::exit::Failure;
use std::path::Path;
use stylet_solver::LinearOperator;
use stylet_solver::linear::{
    CgSettings, ConstrainedError, ConstrainedWorkspace, ConstraintError, ConstraintPreconditioner, Constraints,
    Elimination, EliminationError, EliminationWorkspace, KrylovSettings, constrained_cg, elimination_cg,
};
use stylet_solver::sparse::{BlockCsr, ScalarCsr};
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::Subspace;
use stylet_solver::vector::norm2;

/// A stop rule that is never asked: for calls that evaluate, and do not iterate.
const EVALUATE: StopRule = StopRule { tolerance: 0.5, criterion: Criterion::External, round_floor: 0.0 };

/// Constraints and the projection onto their kernel.
pub struct Saddle {
    pub constraints: Constraints,
    pub matrix: ScalarCsr,
    /// `[I Cᵀ; C 0]`, factored.
    projector: ConstraintPreconditioner<1>,
}

impl Saddle {
    /// Reads constraints on the unknowns of a matrix.
    ///
    /// # Errors
    /// Names the file and the row; among others of a constraint that depends on the others or contradicts them.
    pub fn read(path: &Path, args: &SolveArgs, a: &ScalarCsr) -> Result<Self, Failure> {
        let matrix = read_matrix(path)?;
        let refuse = |what: String| Failure::bad_input(format!("{}: {what}", path.display()));
        let (m, n) = (matrix.n_rows(), a.n_rows());
        if matrix.n_cols() != n {
            let (found, a) = (matrix.n_cols(), args.matrix.display());
            return Err(refuse(format!("{found} columns, expected {n}, one for each row of {a}")));
        }
        if m == 0 {
            return Err(refuse("no rows, expected a constraint".to_owned()));
        }
        let d = match &args.constraint_rhs {
            None => vec![0.0; m],
            Some(path) => {
                sized(path, read_vector(path)?, m, "constraint", args.constraints.as_deref().unwrap_or(path))?
            }
        };
        let mut constraints = Constraints::new(n);
        for row in 0..m {
            let (cols, values) = matrix.row(row);
            if values.iter().all(|value| *value == 0.0) {
                return Err(refuse(format!("row {}: no entry other than zero, expected a constraint", row + 1)));
            }
            constraints.push(cols, values, d[row]).map_err(|error| refuse(error.to_string()))?;
        }
        let free = Subspace::new(n);
        match ConstraintPreconditioner::new(&identity(n), &free, &constraints) {
            Ok(projector) => Ok(Self { constraints, matrix, projector }),
            Err(ConstrainedError::Constraint(ConstraintError::Dependent { row })) => {
                Err(refuse(dependence(&free, &constraints, row)))
            }
            Err(other) => Err(refuse(other.to_string())),
        }
    }

    /// The smallest `x` with `C x = d`.
    ///
    /// # Errors
    /// Numbers that overflow.
    pub fn particular(&self, a: &impl LinearOperator) -> Result<Vec<f64>, ConstrainedError> {
        let mut x = vec![0.0; self.constraints.dim()];
        self.project(a, &vec![0.0; x.len()], &mut x)?;
        Ok(x)
    }

    /// The `y` for which `b − A x − Cᵀy` is smallest.
    ///
    /// # Errors
    /// Numbers that overflow.
    pub fn multipliers(&self, a: &impl LinearOperator, b: &[f64], x: &[f64]) -> Result<Vec<f64>, ConstrainedError> {
        self.project(a, b, &mut x.to_vec())
    }

    fn project(&self, a: &impl LinearOperator, b: &[f64], x: &mut [f64]) -> Result<Vec<f64>, ConstrainedError> {
        let mut y = vec![0.0; self.constraints.n_rows()];
        let settings = KrylovSettings { stop: EVALUATE, max_iterations: 0 };
        constrained_cg(a, &self.projector, b, x, &mut y, &settings, &mut ConstrainedWorkspace::new())?;
        Ok(y)
    }

    /// `‖C x − d‖`, relative to `‖d‖ + ‖C‖ ‖x‖` in the Frobenius norm.
    pub fn violation(&self, x: &[f64]) -> f64 {
        let mut gap = vec![0.0; self.constraints.n_rows()];
        self.constraints.gap(x, &mut gap);
        let values: Vec<f64> = self.matrix.entries().map(|(_, _, value)| value).collect();
        let scale = norm2(self.constraints.right_side()) + norm2(&values) * norm2(x);
        if scale > 0.0 { norm2(&gap) / scale } else { 0.0 }
    }

    /// `[A Cᵀ; C 0]`.
    ///
    /// # Errors
    /// More rows than 32-bit indices can name.
    pub fn assemble(&self, a: &ScalarCsr) -> Result<BlockCsr<1>, String> {
        let n = a.n_rows();
        let dim = n + self.matrix.n_rows();
        let index =
            |i: usize| u32::try_from(i).map_err(|_| format!("{dim} rows are more than 32-bit indices can name"));
        let mut triplets = Vec::with_capacity(a.n_entries() + 2 * self.matrix.n_entries());
        for (i, j, value) in a.entries() {
            triplets.push((index(i)?, index(j)?, value));
        }
        for (i, j, value) in self.matrix.entries() {
            let (i, j) = (index(n + i)?, index(j)?);
            triplets.extend([(i, j, value), (j, i, value)]);
        }
        let whole = ScalarCsr::from_triplets(dim, dim, &triplets).map_err(|error| error.to_string())?;
        whole.to_blocks().map_err(|error| error.to_string())
    }
}

/// Whether a constraint that depends on the others at least agrees with them.
fn dependence(free: &Subspace<1>, constraints: &Constraints, row: usize) -> String {
    let n = constraints.dim();
    let one = identity(n);
    let solve = |e: Elimination<1>| {
        let settings = CgSettings { stop: EVALUATE, max_iterations: 0 };
        let zero = vec![0.0; n];
        elimination_cg(&one, &e, &zero, &mut zero.clone(), &settings, &mut EliminationWorkspace::new())
    };
    match Elimination::new(&one, free, constraints).and_then(solve) {
        Err(EliminationError::Constraint(ConstraintError::Contradictory { row, gap })) => {
            let row = row + 1;
            format!("row {row}: its left side is a combination of other constraints, its right side is {gap:e} off")
        }
        _ => format!("row {}: a combination of other constraints, expected independent ones", row + 1),
    }
}

fn identity(n: usize) -> BlockCsr<1> {
    let mut one = BlockCsr::new(n);
    for i in 0..n {
        one.set_row(i, &[i as u32], &[[[1.0]]]).expect("n rows were read with 32-bit indices");
    }
    one
}
