//! Fig 6.12: three materials on one sideways insertion.

use crate::fields::{Field, differences, errors, mean_max_mm, solve, with};
use crate::published::{FIGURE_6_12_TIP_MM, FIGURE_6_12_TRIANGLES};
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::time::Instant;
use stylet_needle::simulation::{self, Simulation};
use stylet_needle::{NeedleError, builtin};
use stylet_plot::{Chart, MeshPanel, MeshPicture, Polyline, Series, Style};

const MODELS: [&str; 3] = ["linear", "st-venant-kirchhoff", "neo-hookean"];

/// One material's run, to its end or as far as it goes.
struct Run {
    model: &'static str,
    run: Box<dyn Simulation>,
    error: Option<NeedleError>,
    seconds: f64,
    /// Tip in the undeformed body, m.
    tip_path: Vec<[f64; 2]>,
    /// Depth, mm, and force along the needle at its base, N.
    force: Vec<(f64, f64)>,
    /// The most iterations of a cycle.
    most: u64,
}

impl Run {
    fn field(&self) -> Field {
        Field { mesh: self.run.mesh().clone(), u: self.run.displacement().to_vec() }
    }
}

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("materials", options.threads);
    let speed = if options.quick { 0.1 } else { 0.01 };
    let mut runs: Vec<Run> = Vec::new();
    for model in MODELS {
        if options.stopped() {
            break;
        }
        say(&format!("{model} at speed {speed}"));
        let run = drive(model, speed, options)?;
        let error = if run.error.is_none() && !options.stopped() {
            error_of(&run, speed, options, say)
        } else {
            Numbers::new()
        };
        report.rows.push(row(&run, error, options.threads));
        runs.push(run);
    }
    let tip = |model: &str| {
        let run = runs.iter().find(|run| run.model == model && run.error.is_none())?;
        run.run.summary(&[]).needle.map(|needle| needle.tip_reference)
    };
    if let (Some(a), Some(b)) = (tip("linear"), tip("neo-hookean")) {
        let difference = 1e3 * (a[0] - b[0]).hypot(a[1] - b[1]);
        let name = format!("tip in the body, linear against neo-Hookean, mm (published: about {FIGURE_6_12_TIP_MM})");
        report.figures.push(Figure::plain(name, difference));
    }
    for model in ["linear", "neo-hookean"] {
        let most = report.row(model).and_then(|row| row.more.get("max_iterations").copied()).unwrap_or(f64::NAN);
        report.figures.push(Figure::at_most(format!("most iterations of a cycle, {model}"), most, 1000.0));
    }
    if let Some(folder) = &options.out {
        let svg = picture(&runs)?;
        report.write(folder, "materials.svg", &svg)?;
        let svg = forces(&runs).to_svg()?;
        report.write(folder, "materials-force.svg", &svg)?;
    }
    Ok(report)
}

/// Runs the scene with one material, and keeps what there is when it fails.
fn drive(model: &'static str, speed: f64, options: &BenchOptions) -> Result<Run, BenchError> {
    let keys = with(&[("material.model", &model), ("needle.speed", &speed)]);
    let scene = builtin::open("slab2d-sideways", &keys)?;
    let run = simulation::start(&scene, options.threads)?;
    let mut this = Run { model, run, error: None, seconds: 0.0, tip_path: Vec::new(), force: Vec::new(), most: 0 };
    while !this.run.finished() && !options.stopped() {
        let since = Instant::now();
        let step = this.run.step();
        this.seconds += since.elapsed().as_secs_f64();
        match step {
            Err(error) => {
                this.error = Some(error);
                break;
            }
            Ok(row) => {
                if row.step % 20 == 1 {
                    this.tip_path.extend(tip_reference(&*this.run));
                }
                let (depth, force) = stylet_needle::history::depth_and_force::<2>(&row);
                this.force.push((1e3 * depth, force[0]));
                this.most = this.most.max(row.iterations);
            }
        }
    }
    Ok(this)
}

/// The displacement's difference from a run with half the mesh sizes and a tenth of the tolerance.
fn error_of(run: &Run, speed: f64, options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Numbers {
    say(&format!("{}: reference at h4/h7 and tolerance 0.003", run.model));
    let fine = with(&[
        ("material.model", &run.model),
        ("mesh.h_start", &4),
        ("mesh.h_ref", &7),
        ("needle.speed", &speed),
        ("solver.tolerance", &0.003),
        ("solver.max_iterations", &10_000),
    ]);
    match solve("slab2d-sideways", &fine, options.threads) {
        Ok(fine) => errors(mean_max_mm(&differences(&run.field(), &fine.field()))),
        Err(error) => {
            say(&format!("{}: no reference: {error}", run.model));
            Numbers::new()
        }
    }
}

fn row(run: &Run, error: Numbers, threads: usize) -> Row {
    let summary = run.run.summary(&[]);
    let needle = summary.needle.unwrap_or_default();
    let published = if run.model == "neo-hookean" && run.error.is_none() {
        Numbers::from([("triangles", FIGURE_6_12_TRIANGLES)])
    } else {
        Numbers::new()
    };
    Row {
        case: run.model.into(),
        method: if run.model == "linear" { "cg" } else { "newton-cg" }.into(),
        preconditioner: "none".into(),
        tolerance: Some(0.03),
        threads,
        ok: run.error.is_none() && summary.converged,
        error,
        iterations: Some(summary.solver.iterations_total),
        seconds: Some(run.seconds),
        more: Numbers::from([
            ("cycles", summary.steps as f64),
            ("triangles", summary.elements as f64),
            ("mean_iterations", summary.solver.iterations_mean),
            ("max_iterations", run.most as f64),
            ("tip_x_mm", 1e3 * needle.tip_reference[0]),
            ("tip_y_mm", 1e3 * needle.tip_reference[1]),
            ("base_force_n", needle.base_force[0]),
        ]),
        published,
        note: match &run.error {
            Some(error) => error.to_string(),
            None if summary.solver.unconverged_solves > 0 => {
                format!("{} solves ran out of iterations", summary.solver.unconverged_solves)
            }
            None if run.model == "neo-hookean" => {
                "the force density is calibrated on the straight insertion; the published run's own is not known".into()
            }
            None => String::new(),
        },
        ..Row::default()
    }
}

/// Deformed and undeformed meshes with the needle and its way through the body (Fig 6.12).
fn picture(runs: &[Run]) -> Result<String, BenchError> {
    let mut drawn = Vec::new();
    for undeformed in [false, true] {
        for run in runs {
            let state = match (&run.error, undeformed) {
                (Some(_), false) => ", where it stopped",
                (_, false) => "",
                (_, true) => ", undeformed",
            };
            let shaft = run.run.needle().map_or_else(Vec::new, |needle| vec![needle.base(), needle.tip()]);
            let line = Polyline {
                points: if undeformed { run.tip_path.clone() } else { shaft },
                label: if undeformed { "way of the tip" } else { "needle" }.into(),
                tip: !undeformed,
                ..Polyline::default()
            };
            drawn.push((format!("{}{state}", run.model), run.field().drawn(if undeformed { 0.0 } else { 1.0 }), line));
        }
    }
    let panel = MeshPanel {
        title: "One sideways insertion, three materials (Fig 6.12)".into(),
        pictures: drawn
            .iter()
            .map(|(title, d, line)| MeshPicture { title: title.clone(), lines: vec![line.clone()], ..d.picture() })
            .collect(),
        columns: runs.len(),
        colour_label: "displacement (mm)".into(),
        ..MeshPanel::default()
    };
    Ok(panel.to_svg()?)
}

fn forces(runs: &[Run]) -> Chart {
    let series = |run: &Run| Series {
        name: run.model.into(),
        points: run.force.clone(),
        style: Style::Line,
        ..Series::default()
    };
    Chart {
        title: "Force along the needle at its base".into(),
        x_label: "depth (mm)".into(),
        y_label: "force (N)".into(),
        series: runs.iter().map(series).collect(),
        ..Chart::default()
    }
}

/// Where the tip is in the undeformed slab, m.
fn tip_reference(run: &dyn Simulation) -> Option<[f64; 2]> {
    run.summary(&[]).needle?.tip_reference.try_into().ok()
}
