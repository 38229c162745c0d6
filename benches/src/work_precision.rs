//! Error against run time, for every method, preconditioner and tolerance: on the linear static load and on the sideways
//! nonlinear insertion.

use crate::fields::{Field, differences, errors, failed, mean_max_mm, solve, with};
use crate::timing::median;
use crate::{BenchError, BenchOptions, Report, Row};
use stylet_plot::{Chart, Series, Style};

const PRECONDITIONERS: [&str; 3] = ["none", "jacobi", "block-jacobi"];

/// One problem of the suite.
struct Problem {
    scene: &'static str,
    about: &'static str,
    keys: Vec<String>,
    methods: &'static [&'static str],
    tolerances: &'static [f64],
    repeats: usize,
}

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("work-precision", options.threads);
    for problem in problems(options.quick) {
        let mut exact = problem.keys.clone();
        exact.extend(with(&[
            ("solver.tolerance", &1e-10),
            ("solver.preconditioner", &"block-jacobi"),
            ("solver.max_iterations", &100_000),
        ]));
        say(&format!("{}: reference at 1e-10", problem.scene));
        let reference = solve(problem.scene, &exact, options.threads)?.field();
        for method in problem.methods {
            for preconditioner in PRECONDITIONERS {
                for &tolerance in problem.tolerances {
                    if options.stopped() {
                        return Ok(report);
                    }
                    say(&format!("{}: {method}, {preconditioner}, {tolerance:e}", problem.scene));
                    let row = one(&problem, method, preconditioner, tolerance, &reference, options.threads);
                    report.rows.push(row);
                }
            }
        }
        if let Some(folder) = &options.out {
            let svg = chart(&problem, &report).to_svg()?;
            report.write(folder, &format!("work-precision-{}.svg", problem.scene), &svg)?;
        }
    }
    Ok(report)
}

fn problems(quick: bool) -> [Problem; 2] {
    [
        Problem {
            scene: "slab2d-static",
            about: "linear static load, h3/h7",
            keys: with(&[("mesh.h_ref", &7), ("solver.max_iterations", &20_000)]),
            methods: &["cg", "nonlinear-cg", "newton-cg"],
            tolerances: if quick { &[1e-2, 1e-6] } else { &[1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8] },
            repeats: if quick { 1 } else { 9 },
        },
        Problem {
            scene: "slab2d-sideways",
            about: "neo-Hookean insertion to 20 mm, speed 0.3",
            // The needle settles at each position, so that all runs go through the same equilibria.
            keys: with(&[
                ("needle.speed", &0.3),
                ("needle.depth", &0.02),
                ("needle.rearrange", &"settle"),
                ("solver.max_iterations", &2000),
            ]),
            methods: &["nonlinear-cg", "newton-cg"],
            tolerances: if quick { &[3e-2, 1e-4] } else { &[1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-6] },
            repeats: if quick { 1 } else { 3 },
        },
    ]
}

fn one(
    problem: &Problem,
    method: &str,
    preconditioner: &str,
    tolerance: f64,
    reference: &Field,
    threads: usize,
) -> Row {
    let mut keys = problem.keys.clone();
    keys.extend(with(&[
        ("solver.method", &method),
        ("solver.preconditioner", &preconditioner),
        ("solver.tolerance", &tolerance),
    ]));
    let base = Row {
        case: problem.scene.into(),
        method: method.into(),
        preconditioner: preconditioner.into(),
        tolerance: Some(tolerance),
        threads,
        ..Row::default()
    };
    match solve(problem.scene, &keys, threads) {
        Err(error) => Row {
            method: base.method,
            preconditioner: base.preconditioner,
            tolerance: base.tolerance,
            ..failed(base.case, threads, &error)
        },
        Ok(solved) => {
            let again = (1..problem.repeats).filter_map(|_| Some(solve(problem.scene, &keys, threads).ok()?.seconds));
            let mut seconds: Vec<f64> = again.chain([solved.seconds]).collect();
            Row {
                ok: solved.converged,
                error: errors(mean_max_mm(&differences(&solved.field(), reference))),
                iterations: Some(solved.iterations),
                seconds: Some(median(&mut seconds)),
                note: if solved.converged { String::new() } else { "some solves ran out of iterations".into() },
                ..base
            }
        }
    }
}

fn chart(problem: &Problem, report: &Report) -> Chart {
    let mut series = Vec::new();
    for (index, method) in problem.methods.iter().enumerate() {
        for (dash, preconditioner) in PRECONDITIONERS.iter().enumerate() {
            let rows = report.rows.iter().filter(|row| {
                row.ok && row.case == problem.scene && row.method == *method && row.preconditioner == *preconditioner
            });
            // The second field of the point is an error: it cannot be shown below what rounding leaves of it.
            let points =
                rows.filter_map(|row| Some((1e3 * row.seconds?, row.error.get("mean_mm")?.max(1e-12)))).collect();
            series.push(Series {
                name: format!("{method}, {preconditioner}"),
                points,
                style: Style::LinePoints,
                dashed: dash == 0,
                colour: Some(index * PRECONDITIONERS.len() + dash),
            });
        }
    }
    Chart {
        title: format!("Error against run time: {}", problem.about),
        x_label: "run time (ms)".into(),
        y_label: "mean error against tolerance 1e-10 (mm)".into(),
        log_x: true,
        log_y: true,
        series,
        ..Chart::default()
    }
}
