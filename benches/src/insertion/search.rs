//! `stylet bench friction-search`: how many trials and iterations it takes to find which nodes stick (Table 3).

use super::page;
use super::setup::{FRAME, Numerics, Scene, published_scenes};
use crate::timing::median;
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::ops::ControlFlow;
use stylet_physics::coupling::{SearchMethod, SearchSettings};
use stylet_physics::insertion::InsertionReport;
use stylet_solver::team::Team;

/// Table 3 of the 2009 paper, by run: trials and iterations by linear solve, each least, mean and most.
const PUBLISHED: [(&str, [f64; 6]); 5] = [
    ("prostate flexible", [1.0, 1.41, 10.0, 18.0, 205.0, 652.0]),
    ("prostate stiff", [1.0, 1.23, 4.0, 12.0, 225.0, 536.0]),
    ("two cylinders", [1.0, 1.02, 2.0, 42.0, 213.0, 474.0]),
    ("gel single bend", [1.0, 1.17, 4.0, 46.0, 234.0, 343.0]),
    ("gel double bend", [1.0, 1.04, 3.0, 54.0, 413.0, 686.0]),
];
/// Names of these columns.
const COLUMNS: [&str; 6] = ["trials_1_min", "trials_2_mean", "trials_3_max", "cg_1_min", "cg_2_mean", "cg_3_max"];
/// Share of the steps of the prostate that were consistent within ten trials, %.
const PUBLISHED_CONSISTENT: f64 = 99.6;
/// Iterations of a search over those of a solve with known states that count as reached.
const MOST_OVER_KNOWN: f64 = 1.3;

const ABOUT: &str = "The five runs of Table 3 of Chentanez et al. (2009): in, held, and out again, 20 mm/s, frames of 20 ms; \
    friction 12 N/m, 200 N s/m², friction states checked at 1e-3 and solved to 1e-5, at most ten trials. *published* is their \
    Algorithm 3, each step from zero; *ours* starts from the best combination of the last velocities and accelerations, and \
    replaces states that failed by those of the complementarity problem with the estimated compliance; \
    *condensed* solves that problem with the true compliance first, one linear solve for each node. `cg_*` are iterations of one \
    linear solve, in trials; `over_known` is the sum of all iterations, condensed columns included, over that of solves that start \
    with the states that were found; `consistent_%` counts the steps (and parts of steps) whose states satisfy all conditions \
    within ten trials.";

/// The searches that are compared.
fn methods() -> [(&'static str, SearchSettings); 3] {
    let ours = SearchSettings { count_known: true, ..SearchSettings::default() };
    [
        ("published", SearchSettings { count_known: true, ..SearchSettings::published() }),
        ("ours", ours),
        ("condensed", SearchSettings { method: SearchMethod::Condensed, ..ours }),
    ]
}

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("friction-search", options.threads);
    let team = Team::new(options.threads);
    for scene in published_scenes(options.quick)? {
        for (method, search) in methods() {
            if options.stopped() {
                break;
            }
            say(&format!("{}, {method}", scene.name));
            report.rows.push(row(&scene, method, search, options, &team)?);
        }
    }
    report.figures = figures(&report);
    if let Some(folder) = &options.out {
        let page = page::markdown("Which nodes stick", ABOUT, &report, options.quick);
        report.write(folder, "friction-search.md", &page)?;
    }
    Ok(report)
}

/// Sums over the steps of a run.
#[derive(Default)]
struct Tally {
    steps: u32,
    sum: InsertionReport,
    fewest: Option<usize>,
    seconds: Vec<f64>,
}

impl Tally {
    fn take(&mut self, step: &InsertionReport, seconds: f64) {
        self.steps += 1;
        self.seconds.push(seconds);
        let sum = &mut self.sum;
        sum.substeps += step.substeps;
        sum.halvings += step.halvings;
        sum.trials += step.trials;
        sum.most_trials = sum.most_trials.max(step.most_trials);
        sum.iterations += step.iterations;
        sum.condensed_iterations += step.condensed_iterations;
        sum.known_iterations += step.known_iterations;
        sum.most_iterations = sum.most_iterations.max(step.most_iterations);
        sum.consistent += step.consistent;
        sum.blocked += step.blocked;
        self.fewest = Some(self.fewest.map_or(step.fewest_iterations, |few| few.min(step.fewest_iterations)));
    }
}

fn row(
    scene: &Scene,
    method: &str,
    search: SearchSettings,
    options: &BenchOptions,
    team: &Team,
) -> Result<Row, BenchError> {
    let numerics = Numerics { search, ..Numerics::default() };
    let mut insertion = scene.start(&numerics, team)?;
    let mut tally = Tally::default();
    let followed = scene.follow(&mut insertion, FRAME, |_, step, seconds| {
        tally.take(step, seconds);
        if options.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let parts = f64::from(tally.sum.substeps.max(1));
    let searched = (tally.sum.iterations - tally.sum.condensed_iterations) as f64;
    let numbers = [
        1.0,
        tally.sum.trials as f64 / parts,
        tally.sum.most_trials as f64,
        tally.fewest.unwrap_or(0) as f64,
        searched / tally.sum.trials.max(1) as f64,
        tally.sum.most_iterations as f64,
    ];
    let mut row = Row {
        case: scene.name.into(),
        method: method.into(),
        threads: options.threads,
        ok: followed.is_ok(),
        note: followed.err().map_or_else(String::new, |error| error.to_string()),
        iterations: Some(tally.sum.iterations as u64),
        seconds: Some(median(&mut tally.seconds)),
        more: COLUMNS.into_iter().zip(numbers).collect(),
        ..Row::default()
    };
    row.more.extend(Numbers::from([
        ("steps", f64::from(tally.steps)),
        ("parts", parts),
        ("consistent_%", 100.0 * f64::from(tally.sum.consistent) / parts),
        ("over_known", tally.sum.iterations as f64 / tally.sum.known_iterations.max(1) as f64),
    ]));
    if let Some((_, published)) = PUBLISHED.iter().find(|(name, _)| *name == scene.name) {
        row.published = COLUMNS.into_iter().zip(*published).collect();
        if scene.name == PUBLISHED[0].0 {
            row.published.insert("consistent_%", PUBLISHED_CONSISTENT);
        }
    }
    Ok(row)
}

fn figures(report: &Report) -> Vec<Figure> {
    let mut figures = Vec::new();
    for row in report.rows.iter().filter(|row| row.method == "ours") {
        let of = |name: &str| row.more.get(name).copied().unwrap_or(f64::NAN);
        figures.push(Figure::at_least(format!("{}: steps consistent, %", row.case), of("consistent_%"), 100.0));
        let name = format!("{}: iterations over those with known states", row.case);
        figures.push(Figure::at_most(name, of("over_known"), MOST_OVER_KNOWN));
    }
    figures
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insertion::setup::{GEL, Layers, Leg, SPEED, Tissue, wire};
    use stylet_physics::insertion::UniformInteraction;

    /// All three searches find the same states, so the same numbers of steps; known states cost least.
    #[test]
    fn searches_go_the_same_way() {
        let scene = Scene {
            name: "a block",
            tissue: Tissue::gel_box([0.05; 3], [5; 3], GEL, |x| x[0] > 0.05 - 1e-9),
            needle: wire([0.0, 0.0253, 0.0247], 0.1),
            layers: Layers {
                within: UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.2 },
                ..Layers::default()
            },
            legs: vec![Leg::insert(0.015, SPEED), Leg::insert(-0.005, SPEED)],
        };
        let options = BenchOptions { threads: 1, ..BenchOptions::default() };
        let mut steps = None;
        for (method, search) in methods() {
            let row = row(&scene, method, search, &options, &Team::serial()).unwrap();
            assert!(row.ok && row.more["steps"] >= 50.0, "{row:?}");
            assert_eq!(*steps.get_or_insert(row.more["steps"]), row.more["steps"], "{row:?}");
            assert!(row.more["over_known"] >= 1.0 && row.more["trials_3_max"] <= 11.0, "{row:?}");
            assert!(method == "published" || row.more["consistent_%"] == 100.0, "{row:?}");
        }
    }
}
