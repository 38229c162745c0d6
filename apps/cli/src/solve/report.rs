//! What a solve has to say.

use super::args::{Precond, SolveArgs};
use super::input::Problem;
use super::methods::Solution;
use crate::args::threads_or_all;
use crate::exit::Failure;
use crate::facts::{Facts, print_json, seconds};
use serde_json::{Value, json};

/// The result, for people and for programs.
pub struct Report {
    pub x: Vec<f64>,
    /// Why this is no solution.
    pub reason: Option<String>,
    method: String,
    rows: usize,
    nonzeros: usize,
    constraints: Option<usize>,
    json: Value,
    facts: Vec<(&'static str, String)>,
}

impl Report {
    /// Puts everything together.
    pub fn new(problem: &Problem, args: &SolveArgs, solution: Solution, read_s: f64) -> Self {
        let Problem { matrix, method, precond, block, saddle, .. } = problem;
        let (rows, nonzeros) = (matrix.n_rows(), matrix.n_entries());
        let constraints = saddle.as_ref().map(|saddle| saddle.constraints.n_rows());
        let solve_s = median(&solution.solve_s);
        let precond = method.takes_preconditioner().then_some(*precond);
        let json = json!({
            "schema": 1, "matrix": args.matrix.display().to_string(), "rows": rows, "nonzeros": nonzeros,
            "block": block, "constraints": constraints, "method": method.to_string(),
            "precond": precond.map(|precond| precond.to_string()), "precision": args.precision.to_string(),
            "threads": threads_or_all(args.threads), "tolerance": args.tol, "converged": solution.reason.is_none(),
            "reason": solution.reason, "iterations": solution.iterations,
            "relative_residual": finite(solution.relative_residual),
            "constraint_residual": solution.constraint_residual.and_then(finite),
            "read_s": read_s, "setup_s": solution.setup_s, "solve_s": solve_s, "repeats": solution.solve_s.len(),
            "matrix_bytes": solution.matrix_bytes, "product_gb_s": solution.product_gb_s,
        });
        let mut facts = vec![(
            "iterations",
            format!("{}, relative residual {:.1e}", solution.iterations, solution.relative_residual),
        )];
        if let Some(violation) = solution.constraint_residual {
            facts.push(("constraints", format!("met to {violation:.1e}")));
        }
        facts.push(("set-up", seconds(solution.setup_s)));
        match solution.solve_s.len() {
            0 => {}
            1 => facts.push(("solve", seconds(solve_s))),
            n => facts.push(("solve", format!("{}, median of {n}", seconds(solve_s)))),
        }
        let megabytes = solution.matrix_bytes as f64 * 1e-6;
        facts.push(("matrix", format!("{megabytes:.1} MB, product at {:.1} GB/s", solution.product_gb_s)));
        let method = match precond {
            None | Some(Precond::None) => method.to_string(),
            Some(precond) => format!("{method} with {precond}"),
        };
        Self { x: solution.x, reason: solution.reason, method, rows, nonzeros, constraints, json, facts }
    }

    /// Prints it.
    ///
    /// # Errors
    /// Standard output that cannot be written.
    pub fn print(&self, args: &SolveArgs) -> Result<(), Failure> {
        if args.json {
            return print_json(&self.json);
        }
        let constraints = self.constraints.map_or(String::new(), |m| format!(", {m} constraints"));
        let (rows, nonzeros, method) = (self.rows, self.nonzeros, &self.method);
        let mut facts =
            Facts::new(&format!("{}: {rows} rows, {nonzeros} entries{constraints}; {method}", args.matrix.display()));
        self.facts.iter().for_each(|(name, value)| facts.add(name, value));
        if let Some(path) = &args.out {
            facts.add("wrote", path.display());
        }
        facts.print()
    }
}

/// JSON has no other numbers.
fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}
