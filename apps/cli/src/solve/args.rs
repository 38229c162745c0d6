//! The arguments of `stylet solve`.

use crate::args::{count, threads};
use clap::{Args, ValueEnum};
use std::fmt;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  stylet solve A.mtx                                      right side of ones, conjugate gradients
  stylet solve A.mtx b.mtx --precond smoothed-aggregation --coords nodes.txt --out x.mtx
  stylet solve A.mtx b.mtx --method cholesky --repeat 5 --json
  stylet solve A.mtx b.mtx --constraints C.mtx --constraint-rhs d.mtx --method null-space

A is symmetric. With --constraints, A x + C'y = b and C x = d are solved for x.
Files are in the Matrix Market format; rows are counted from 1.
Exit codes: 0 done; 2 bad input; 3 not converged, or not positive definite for a method that needs it (x is written all
the same); 130 stopped by Ctrl-C.";

/// `stylet solve`
#[derive(Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub struct SolveArgs {
    /// The matrix: square and symmetric.
    #[arg(value_name = "A.mtx")]
    pub matrix: PathBuf,
    /// The right side: one column [default: all ones].
    #[arg(value_name = "b.mtx")]
    pub right_side: Option<PathBuf>,
    /// How to solve [default: cg; with constraints projected-cg].
    #[arg(long, value_enum)]
    pub method: Option<Method>,
    /// Preconditioner of cg, minres and kkt-cg [default: block-jacobi for cg, none for the others].
    #[arg(long, value_enum)]
    pub precond: Option<Precond>,
    /// Constraints C x = d: a matrix with a column for each row of A.
    #[arg(long, value_name = "C.mtx")]
    pub constraints: Option<PathBuf>,
    /// The right side d of the constraints [default: zero].
    #[arg(long, value_name = "d.mtx", requires = "constraints")]
    pub constraint_rhs: Option<PathBuf>,
    /// Coordinates of the nodes, one node a line, 2 or 3 numbers: rigid moves for two-level and smoothed-aggregation,
    /// which use constants without it.
    #[arg(long, value_name = "FILE")]
    pub coords: Option<PathBuf>,
    /// Rows of A that belong to one node: 1, 2 or 3 [default: 1, or as many as --coords has numbers a line].
    #[arg(long, value_name = "B", value_parser = block_size, allow_negative_numbers = true)]
    pub block: Option<usize>,
    /// Largest residual, relative to the right side.
    #[arg(long, value_name = "T", value_parser = tolerance, default_value = "1e-8", allow_negative_numbers = true)]
    pub tol: f64,
    /// Most iterations, or corrections of a direct solve.
    #[arg(long, value_name = "N", value_parser = count, default_value = "10000", allow_negative_numbers = true)]
    pub max_iterations: usize,
    /// Most threads to use [default: one for each core]; their number does not change the results.
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Number format of the work; the residual is always evaluated in f64.
    #[arg(long, value_enum, default_value_t = Precision::F64)]
    pub precision: Precision,
    /// Solve N times, and report the median time.
    #[arg(long, value_name = "N", value_parser = count, default_value = "1", allow_negative_numbers = true)]
    pub repeat: usize,
    /// Write x to this file.
    #[arg(long, value_name = "x.mtx")]
    pub out: Option<PathBuf>,
    /// Print one JSON object, and nothing else.
    #[arg(long)]
    pub json: bool,
    /// No progress on standard error.
    #[arg(long)]
    pub quiet: bool,
}

/// How to solve.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Method {
    /// Preconditioned conjugate gradients: A positive definite.
    Cg,
    /// MINRES: A of either sign; with constraints the whole system [A C'; C 0].
    Minres,
    /// Sparse L L' by faer: A positive definite.
    Cholesky,
    /// Sparse L D L' with a diagonal D of either sign.
    Ldlt,
    /// Sparse L B L' with blocks of one and two rows in B, chosen after Bunch and Kaufman.
    Lblt,
    /// Conjugate gradients on the indefinite system [A C'; C 0], as published; may fail.
    KktCg,
    /// Conjugate gradients preconditioned by the constraints: A positive definite where C x = 0.
    ProjectedCg,
    /// Conjugate gradients without the unknowns that the constraints determine.
    NullSpace,
}

impl Method {
    /// Whether the method wants constraints; `None` if it works with and without.
    pub fn wants_constraints(self) -> Option<bool> {
        match self {
            Self::Cg | Self::Cholesky => Some(false),
            Self::KktCg | Self::ProjectedCg | Self::NullSpace => Some(true),
            Self::Minres | Self::Ldlt | Self::Lblt => None,
        }
    }

    /// Whether the method factors the matrix.
    pub fn is_direct(self) -> bool {
        matches!(self, Self::Cholesky | Self::Ldlt | Self::Lblt)
    }

    /// Whether the method takes a preconditioner of the caller's.
    pub fn takes_preconditioner(self) -> bool {
        matches!(self, Self::Cg | Self::Minres | Self::KktCg)
    }
}

/// Preconditioners.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Precond {
    /// No preconditioner.
    None,
    /// The diagonal.
    Jacobi,
    /// The diagonal block of every node.
    BlockJacobi,
    /// Symmetric block Gauss-Seidel with relaxation.
    Ssor,
    /// Incomplete Cholesky factors without fill.
    Ic0,
    /// A Chebyshev polynomial of the matrix, degree 4.
    Chebyshev,
    /// A few large aggregates of nodes, solved directly, and a smoother.
    TwoLevel,
    /// Algebraic multigrid by smoothed aggregation.
    SmoothedAggregation,
}

/// Number formats.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Precision {
    /// 64 bits throughout.
    F64,
    /// Conjugate gradients with none or block-jacobi, or a factor, in 32 bits, corrected by residuals in 64.
    Mixed,
}

/// The word on the command line.
fn word(value: &impl ValueEnum, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    f.write_str(value.to_possible_value().as_ref().map_or("", |value| value.get_name()))
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        word(self, f)
    }
}

impl fmt::Display for Precond {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        word(self, f)
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        word(self, f)
    }
}

fn block_size(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|b| (1..=3).contains(b)).ok_or_else(|| "1, 2 or 3".to_owned())
}

fn tolerance(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|t| *t > 0.0 && *t < 1.0).ok_or_else(|| "a number above 0 and below 1".to_owned())
}
