//! Work and precision: every method on every case, to several tolerances.

use super::methods::{Kind, METHODS, Method, Prepared, settings, smoothed_aggregation};
use super::systems::{Case, cube, layered};
use super::threads_text;
use crate::timing::median;
use crate::{BenchError, BenchOptions, Numbers, Report, Row};
use std::time::Instant;
use stylet_plot::{Chart, Series, Style};
use stylet_solver::LinearOperator;
use stylet_solver::linear::{CgWorkspace, projected_cg};
use stylet_solver::sparse::Frozen;
use stylet_solver::stop::Stop;
use stylet_solver::team::Team;
use stylet_solver::vector::{dot, norm2, xpby};

/// The tolerance that the targets are about.
pub(super) const TARGET: f64 = 1e-5;
/// Relative residual of the reference solutions.
const REFERENCE: f64 = 1e-10;
/// A true residual may exceed the tolerance by this factor, since methods watch that of a recurrence.
const MARGIN: f64 = 1.01;

/// How long and how often.
#[derive(Clone, Copy)]
struct Effort {
    turns: usize,
    /// A method that took this long, s, sits out the turns that are left.
    seconds: f64,
}

/// The cases of a system.
struct Group {
    cases: Vec<Case>,
    tolerances: &'static [f64],
    large: bool,
    /// Whether one thread is tried beside two.
    serial: bool,
    effort: Effort,
}

/// Steps of time, s; none is static.
const STEPS: [Option<f64>; 3] = [None, Some(20e-3), Some(1e-3)];

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) -> Result<(), BenchError> {
    for make in groups(options.quick) {
        if options.stopped() {
            return Ok(());
        }
        let group = make();
        for case in &group.cases {
            let Some(exact) = reference(case, options.threads) else {
                report.rows.push(Row {
                    case: case.name.clone(),
                    note: "no reference solution".into(),
                    ..Row::default()
                });
                continue;
            };
            let most = options.threads.clamp(1, 2);
            for threads in if group.serial { 1..=most } else { most..=most } {
                if options.stopped() {
                    return Ok(());
                }
                say(&format!("{}: {}", case.name, threads_text(threads)));
                let rows = measure(case, &group, threads, &exact, options);
                report.rows.extend(rows);
            }
            if let Some(folder) = &options.out
                && let Some(chart) = chart(&case.name, &report.rows)
            {
                report.write(folder, &format!("solvers-{}.svg", file_name(&case.name)), &chart.to_svg()?)?;
            }
        }
    }
    Ok(())
}

/// Systems are made when their turn comes: the large one takes memory.
fn groups(quick: bool) -> Vec<Box<dyn Fn() -> Group>> {
    let effort = Effort { turns: 7, seconds: 0.15 };
    let small: &[f64] = &[1e-2, 1e-3, TARGET, 1e-8];
    let of = |system: super::systems::System, steps: &[Option<f64>]| steps.iter().map(|&dt| system.case(dt)).collect();
    if quick {
        let effort = Effort { turns: 2, seconds: 0.05 };
        let cases = move || of(cube(13, 0.34), &[None, Some(1e-3)]);
        return vec![Box::new(move || Group {
            cases: cases(),
            tolerances: &[1e-2, TARGET],
            large: false,
            serial: false,
            effort,
        })];
    }
    let mut all: Vec<Box<dyn Fn() -> Group>> = Vec::new();
    for poisson in [0.34, 0.45, 0.49] {
        let cases = move || of(cube(13, poisson), &STEPS);
        all.push(Box::new(move || Group { cases: cases(), tolerances: small, large: false, serial: true, effort }));
    }
    for poisson in [0.34, 0.45, 0.49] {
        let cases = move || of(layered(poisson), if poisson == 0.34 { &STEPS } else { &STEPS[..1] });
        all.push(Box::new(move || Group { cases: cases(), tolerances: small, large: false, serial: true, effort }));
    }
    let effort = Effort { turns: 3, seconds: 1.0 };
    for poisson in [0.34, 0.45, 0.49] {
        let cases = move || of(cube(36, poisson), if poisson == 0.34 { &STEPS } else { &STEPS[..1] });
        all.push(Box::new(move || Group {
            cases: cases(),
            tolerances: &[1e-3, TARGET],
            large: true,
            serial: poisson == 0.34,
            effort,
        }));
    }
    all
}

/// The solution to a much smaller residual.
fn reference(case: &Case, threads: usize) -> Option<Vec<f64>> {
    let team = Team::new(threads.min(2));
    let m = smoothed_aggregation(case, &team).ok()?;
    let mut x = vec![0.0; case.load.len()];
    let a = Frozen::<3>::new(&case.matrix);
    let ws = &mut CgWorkspace::on(&team);
    let report = projected_cg(&a, &m, &case.free, &case.load, &mut x, &settings(REFERENCE), ws).ok()?;
    (report.stop == Stop::Converged).then_some(x)
}

/// `‖b − A x‖ / ‖b‖`.
pub(super) fn relative_residual(case: &Case, x: &[f64]) -> f64 {
    let mut r = vec![0.0; x.len()];
    case.matrix.apply(x, &mut r);
    xpby(&case.load, -1.0, &mut r);
    norm2(&r) / norm2(&case.load)
}

/// `‖x − exact‖ / ‖exact‖` in the norm of the energy.
fn energy_error(case: &Case, x: &[f64], exact: &[f64]) -> f64 {
    let mut y = vec![0.0; x.len()];
    let mut energy = |x: &[f64]| {
        case.matrix.apply(x, &mut y);
        dot(x, &y)
    };
    let difference: Vec<f64> = x.iter().zip(exact).map(|(x, exact)| x - exact).collect();
    (energy(&difference) / energy(exact)).sqrt()
}

/// A method on its way through the turns.
struct Runner<'a> {
    method: &'static Method,
    prepared: Prepared<'a>,
    set_ups: Vec<f64>,
    /// By tolerance.
    solves: Vec<Vec<f64>>,
    spent: f64,
}

/// All methods on one case, in turns. Set-up is timed from nothing, solves with a warm workspace.
fn measure(case: &Case, group: &Group, threads: usize, exact: &[f64], options: &BenchOptions) -> Vec<Row> {
    let team = Team::new(threads);
    let mut rows = Vec::new();
    let mut runners: Vec<Runner> = Vec::new();
    let mut x = vec![0.0; case.load.len()];
    for method in METHODS.iter().filter(|method| tried(method, group.large, threads, options.quick)) {
        let base = Row {
            case: case.name.clone(),
            method: method.solver.into(),
            preconditioner: method.preconditioner.into(),
            threads,
            ..Row::default()
        };
        let begin = Instant::now();
        let mut prepared = match (method.set_up)(case, &team) {
            Ok(prepared) => prepared,
            Err(note) => {
                rows.push(Row { note, ..base });
                continue;
            }
        };
        let mut set_ups = vec![begin.elapsed().as_secs_f64()];
        let mut solves = vec![Vec::new(); group.tolerances.len()];
        for (&tolerance, times) in group.tolerances.iter().zip(&mut solves) {
            x.fill(0.0);
            let row = Row { tolerance: Some(tolerance), ..base.clone() };
            let since = Instant::now();
            let outcome = (prepared.solve)(tolerance, &mut x);
            times.push(since.elapsed().as_secs_f64());
            rows.push(match outcome {
                Err(note) => Row { note, ..row },
                Ok(solved) => {
                    let residual = relative_residual(case, &x);
                    let reached = solved.stop == Stop::Converged && residual <= MARGIN * tolerance;
                    Row {
                        ok: reached,
                        iterations: Some(solved.iterations as u64),
                        error: Numbers::from([("residual", residual), ("energy", energy_error(case, &x, exact))]),
                        more: Numbers::from([("products", prepared.products as f64)]),
                        note: if reached { String::new() } else { format!("{:?}", solved.stop) },
                        ..row
                    }
                }
            });
        }
        // The first pass warms up; of a method that takes long it is all there is.
        let spent = begin.elapsed().as_secs_f64();
        if spent < group.effort.seconds {
            set_ups.clear();
            solves.iter_mut().for_each(Vec::clear);
        }
        runners.push(Runner { method, prepared, set_ups, solves, spent });
    }
    for _ in 0..group.effort.turns {
        for runner in &mut runners {
            if runner.spent < group.effort.seconds && (runner.set_ups.is_empty() || !options.stopped()) {
                runner.turn(case, &team, group.tolerances, &mut x);
            }
        }
    }
    for runner in &mut runners {
        for (tolerance, solves) in group.tolerances.iter().zip(&mut runner.solves) {
            let row = rows.iter_mut().find(|row| {
                row.method == runner.method.solver
                    && row.preconditioner == runner.method.preconditioner
                    && row.tolerance == Some(*tolerance)
            });
            if let Some(row) = row {
                let (set_up, solve) = (median(&mut runner.set_ups), median(solves));
                row.seconds = Some(set_up + solve);
                row.stages = Numbers::from([("set-up", set_up), ("solve", solve)]);
            }
        }
    }
    rows
}

/// Peers have one thread; what takes long on the large system is left out there.
fn tried(method: &Method, large: bool, threads: usize, quick: bool) -> bool {
    match method.kind {
        Kind::Ours => true,
        Kind::Small => !large,
        Kind::Direct => !large && !quick,
        Kind::Peer => !large && (threads == 1 || quick),
        Kind::DirectPeer => !large && (threads == 1 || quick),
    }
}

impl Runner<'_> {
    fn turn(&mut self, case: &Case, team: &Team, tolerances: &[f64], x: &mut [f64]) {
        let begin = Instant::now();
        let fresh = (self.method.set_up)(case, team);
        self.set_ups.push(begin.elapsed().as_secs_f64());
        drop(fresh);
        for (&tolerance, times) in tolerances.iter().zip(&mut self.solves) {
            x.fill(0.0);
            let since = Instant::now();
            // Failures stand in the rows already.
            let _ = (self.prepared.solve)(tolerance, x);
            times.push(since.elapsed().as_secs_f64());
        }
        self.spent += begin.elapsed().as_secs_f64();
    }
}

/// Error against time on the most threads, one line per method; peers dashed.
fn chart(case: &str, rows: &[Row]) -> Option<Chart> {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.ok && row.case == case).collect();
    let most = rows.iter().map(|row| row.threads).max()?;
    let mut series = Vec::new();
    for (colour, method) in METHODS.iter().enumerate() {
        let peer = method.kind.is_peer();
        let of_method = rows.iter().filter(|row| {
            row.method == method.solver && row.preconditioner == method.preconditioner && (row.threads == most || peer)
        });
        let points: Vec<(f64, f64)> =
            of_method.filter_map(|row| Some((1e3 * row.seconds?, *row.error.get("energy")?))).collect();
        if points.is_empty() {
            continue;
        }
        let name = format!("{}, {}", method.solver, method.preconditioner);
        series.push(Series { name, points, style: Style::LinePoints, dashed: peer, colour: Some(colour) });
    }
    Some(Chart {
        title: format!("{case}: error against time, {} (peers: one)", threads_text(most)),
        x_label: "set-up and solve (ms)".into(),
        y_label: "relative error in the energy norm".into(),
        log_x: true,
        log_y: true,
        series,
        ..Chart::default()
    })
}

/// `13k, ν 0.34, 1 ms` as `13k-0.34-1ms`.
pub(super) fn file_name(case: &str) -> String {
    case.replace("ν ", "").replace(", ", "-").replace(' ', "")
}
