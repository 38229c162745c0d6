//! `stylet bench work-precision-insertion`: error of the tip against run time, over steps, tolerances, thresholds, laws and
//! methods for the coupled system.

use super::page;
use super::setup::{
    FRAME, GEL, Layers, Leg, Numerics, SPEED, Scene, Tissue, distance, prostate, prostate_flexible, wire,
};
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::ops::ControlFlow;
use stylet_physics::body::LazyRule;
use stylet_physics::coupling::{CouplingMethod, SearchSettings};
use stylet_physics::insertion::UniformInteraction;
use stylet_plot::{Chart, Series, Style};
use stylet_solver::team::Team;

/// m.
const DEPTH: f64 = 0.04;
/// Steps, s, and how much shorter those of the reference are than a frame.
const STEPS: [f64; 4] = [0.04, FRAME, 0.01, 0.005];
const SHORTER: f64 = 8.0;
/// Lattice of the finer mesh: 56,735 cells for 13,314.
const FINER: f64 = 7.8 / 4.2;
const METHODS: [(&str, CouplingMethod); 4] = [
    ("null space", CouplingMethod::NullSpace),
    ("KKT, CG", CouplingMethod::KktCg),
    ("KKT, MINRES", CouplingMethod::KktMinres),
    ("constraint-preconditioned", CouplingMethod::ConstraintPreconditioned),
];
const TOLERANCES: [f64; 4] = [1e-3, 1e-4, 1e-6, 1e-7];
const MODELS: [&str; 3] = ["linear", "corotated", "stable-neo-hookean"];
/// Tolerance of references.
const TIGHT: f64 = 1e-8;

const ABOUT: &str = "The flexible needle pushed 40 mm into the prostate at 20 mm/s (a quick look: into a block of gel). `tip_mm` is the \
    distance of its tip, in the world, from that of a run on the same mesh with an eighth of a frame of 20 ms, solved to 1e-8, with \
    the same law and nothing lazy; `finer_mm` its distance from that of the same run on a mesh of 56,735 cells for 13,314, which is \
    mostly the error of the mesh. Friction states are checked at a hundred times the tolerance of the solution.\n\n\
    ![Error of the tip against time](work-precision-insertion.svg)";

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("work-precision-insertion", options.threads);
    let team = Team::new(options.threads);
    let (scene, finer) = if options.quick { (block(6), block(9)) } else { (organs(1.0)?, organs(FINER)?) };
    let mut bench = Bench { options, team: &team, finer: None, same: Vec::new() };
    let reference = Numerics { dt: FRAME / SHORTER, search: to(TIGHT), ..Numerics::default() };
    say("reference on the finer mesh");
    let on_finer = bench.insert(&finer, &reference)?;
    report.rows.push(bench.row("finer mesh, reference", "null space", &reference, &on_finer));
    bench.finer = on_finer.failed.is_none().then_some(on_finer.tip);
    for (case, method, numerics) in runs(options.quick) {
        if options.stopped() {
            break;
        }
        if bench.reference(numerics.model).is_none() {
            say(&format!("reference, {}", numerics.model));
            let own = Numerics { model: numerics.model, ..reference };
            let run = bench.insert(&scene, &own)?;
            bench.same.push((numerics.model, run.failed.is_none().then_some(run.tip)));
            report.rows.push(bench.row(&format!("reference, {}", numerics.model), "null space", &own, &run));
        }
        say(&format!("{case}, {method}"));
        let run = bench.insert(&scene, &numerics)?;
        report.rows.push(bench.row(&case, method, &numerics, &run));
    }
    report.figures = figures(&report);
    if let Some(folder) = &options.out {
        report.write(folder, "work-precision-insertion.svg", &chart(&report).to_svg()?)?;
        let page = page::markdown("Error of the tip against time", ABOUT, &report, options.quick);
        report.write(folder, "work-precision-insertion.md", &page)?;
    }
    Ok(report)
}

fn organs(refine: f64) -> Result<Scene, BenchError> {
    let legs = vec![Leg::insert(DEPTH, SPEED)];
    Ok(Scene { legs, ..prostate_flexible(prostate(refine)?, 0.0) })
}

fn block(cells: usize) -> Scene {
    let within = UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.2 };
    Scene {
        name: "a block",
        tissue: Tissue::gel_box([0.06; 3], [cells; 3], GEL, |x| x[0] > 0.06 - 1e-9),
        needle: wire([0.0, 0.0303, 0.0298], super::setup::BEVEL),
        layers: Layers { within, ..Layers::default() },
        legs: vec![Leg::insert(DEPTH, SPEED)],
    }
}

fn to(tolerance: f64) -> SearchSettings {
    SearchSettings { check_tolerance: 100.0 * tolerance, solve_tolerance: tolerance, ..SearchSettings::default() }
}

/// Case, method, and how it is computed.
fn runs(quick: bool) -> Vec<(String, &'static str, Numerics)> {
    let standard = Numerics { search: to(1e-5), ..Numerics::default() };
    let name = |dt: f64| format!("steps of {} ms", 1e3 * dt);
    let mut runs = Vec::new();
    for (method, coupling) in METHODS {
        for dt in if quick { &STEPS[..2] } else { &STEPS[..] } {
            runs.push((name(*dt), method, Numerics { dt: *dt, coupling, ..standard }));
        }
    }
    for tolerance in TOLERANCES {
        runs.push((format!("tolerance {tolerance:e}"), "null space", Numerics { search: to(tolerance), ..standard }));
    }
    for threshold in [0.003, 0.01, 0.03] {
        let lazy = LazyRule::Strain(threshold);
        runs.push((format!("lazy, strain {threshold}"), "null space", Numerics { lazy, ..standard }));
    }
    for threshold in [100.0, 1000.0, 10_000.0] {
        let lazy = LazyRule::Rotation(threshold);
        runs.push((format!("lazy, (12) at {threshold}"), "null space", Numerics { lazy, ..standard }));
    }
    for model in if quick { &MODELS[..1] } else { &MODELS[..] } {
        runs.push(((*model).to_owned(), "null space", Numerics { model, ..standard }));
    }
    runs
}

struct Bench<'b> {
    options: &'b BenchOptions,
    team: &'b Team,
    /// Tips of the references: on the finer mesh, and by law on the same one.
    finer: Option<[f64; 3]>,
    same: Vec<(&'static str, Option<[f64; 3]>)>,
}

/// How one run ended.
struct Run {
    tip: [f64; 3],
    seconds: f64,
    iterations: usize,
    steps: usize,
    failed: Option<String>,
}

impl Bench<'_> {
    fn reference(&self, model: &str) -> Option<&(&'static str, Option<[f64; 3]>)> {
        self.same.iter().find(|(known, _)| *known == model)
    }

    fn insert(&self, scene: &Scene, numerics: &Numerics) -> Result<Run, BenchError> {
        let mut insertion = scene.start(numerics, self.team)?;
        let mut run = Run { tip: [0.0; 3], seconds: 0.0, iterations: 0, steps: 0, failed: None };
        let followed = scene.follow(&mut insertion, numerics.dt, |_, step, seconds| {
            run.seconds += seconds;
            run.iterations += step.iterations;
            run.steps += 1;
            if self.options.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        run.failed = followed.err().map(|error| error.to_string());
        run.tip = insertion.needles()[0].shaft.tip();
        Ok(run)
    }

    fn row(&self, case: &str, method: &str, numerics: &Numerics, run: &Run) -> Row {
        let mut row = Row {
            case: case.into(),
            method: method.into(),
            tolerance: Some(numerics.search.solve_tolerance),
            threads: self.options.threads,
            ok: run.failed.is_none(),
            note: run.failed.clone().unwrap_or_default(),
            iterations: Some(run.iterations as u64),
            seconds: Some(run.seconds),
            more: Numbers::from([
                ("dt_ms", 1e3 * numerics.dt),
                ("frame_ms", 1e3 * run.seconds / run.steps.max(1) as f64),
            ]),
            ..Row::default()
        };
        if let (true, Some((_, Some(tip)))) = (row.ok, self.reference(numerics.model)) {
            row.error.insert("tip_mm", 1e3 * distance(&run.tip, tip));
        }
        if let (true, Some(tip)) = (row.ok, self.finer) {
            row.error.insert("finer_mm", 1e3 * distance(&run.tip, &tip));
        }
        row
    }
}

/// How many times longer the published way takes than ours, for a frame of 20 ms, and what limits the error.
fn figures(report: &Report) -> Vec<Figure> {
    let of =
        |case: &str, method: &str| report.rows.iter().find(|row| row.case == case && row.method == method && row.ok);
    let frame = format!("steps of {} ms", 1e3 * FRAME);
    let mut figures = Vec::new();
    if let Some(ours) = of(&frame, METHODS[0].0) {
        if let Some(error) = ours.error.get("tip_mm") {
            figures.push(Figure::plain("20 ms, null space: tip error of steps and solves, mm", *error));
        }
        if let Some(error) = ours.error.get("finer_mm") {
            figures.push(Figure::plain("20 ms, null space: tip error with that of the mesh, mm", *error));
        }
        for (method, _) in &METHODS[1..] {
            if let (Some(other), Some(seconds)) = (of(&frame, method), ours.seconds) {
                let times = other.seconds.unwrap_or(f64::NAN) / seconds;
                figures.push(Figure::plain(format!("20 ms: time of {method} over that of the null space"), times));
            }
        }
    }
    figures
}

/// Error against time, a line for each method over the steps and for each other choice at 20 ms.
fn chart(report: &Report) -> Chart {
    let line = |name: &str, picks: &dyn Fn(&Row) -> bool| Series {
        name: name.into(),
        points: report
            .rows
            .iter()
            .filter(|row| row.ok && picks(row))
            .filter_map(|row| Some((row.seconds?, *row.error.get("tip_mm")?)))
            .filter(|(_, error)| *error > 0.0)
            .collect(),
        style: Style::LinePoints,
        ..Series::default()
    };
    let mut series: Vec<Series> = METHODS
        .iter()
        .map(|(method, _)| {
            line(&format!("{method}, steps of 40 to 5 ms"), &|row| {
                row.method == *method && row.case.starts_with("steps of")
            })
        })
        .collect();
    series.push(line("tolerance 1e-3 to 1e-7", &|row| row.case.starts_with("tolerance")));
    series.push(line("lazy by strain", &|row| row.case.starts_with("lazy, strain")));
    series.push(line("lazy by (12)", &|row| row.case.starts_with("lazy, (12)")));
    series.push(Series { style: Style::Points, ..line("other laws", &|row| MODELS.contains(&row.case.as_str())) });
    series.retain(|series| !series.points.is_empty());
    let frame = format!("steps of {} ms", 1e3 * FRAME);
    let mesh = report.rows.iter().find(|row| row.case == frame && row.ok).and_then(|row| row.error.get("finer_mm"));
    Chart {
        title: "A needle pushed 40 mm into the prostate: error of the tip against time".into(),
        x_label: "time (s) for 2 s of insertion".into(),
        y_label: "distance of the tip from the reference (mm)".into(),
        log_x: true,
        log_y: true,
        series,
        levels: mesh
            .map(|&mm| (mm, "on this mesh, from the reference on a finer one".to_owned()))
            .into_iter()
            .collect(),
        ..Chart::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All methods for the coupled system end in the same place, up to the tolerance.
    #[test]
    fn methods_agree() {
        let options = BenchOptions { threads: 1, quick: true, ..BenchOptions::default() };
        let scene = Scene { legs: vec![Leg::insert(0.012, SPEED)], ..block(4) };
        let team = Team::serial();
        let bench = Bench { options: &options, team: &team, finer: None, same: Vec::new() };
        let standard = Numerics { search: to(1e-7), ..Numerics::default() };
        let ours = bench.insert(&scene, &standard).unwrap();
        assert!(ours.failed.is_none());
        for (name, coupling) in METHODS {
            let other = bench.insert(&scene, &Numerics { coupling, ..standard }).unwrap();
            assert!(other.failed.is_none(), "{name}: {:?}", other.failed);
            assert!(distance(&ours.tip, &other.tip) < 1e-5, "{name}: {:?} {:?}", ours.tip, other.tip);
        }
    }
}
