//! `stylet bench lazy`: needle insertion with only the element stiffnesses that have changed (Table 1).

use super::page;
use super::setup::{FRAME, Leg, Numerics, SPEED, Scene, distance, prostate, prostate_flexible};
use crate::timing::median;
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::ops::ControlFlow;
use stylet_physics::body::LazyRule;
use stylet_solver::team::Team;

/// Table 1 of the 2009 paper: threshold, share updated (%), forces and Jacobian (ms), frame (% of that without lazy updates),
/// error of the tip (%).
const PUBLISHED: [(f64, [f64; 4]); 4] = [
    (0.0, [100.0, 12.42, 100.0, 0.0]),
    (100.0, [7.96, 3.83, 82.37, 0.06]),
    (1000.0, [3.65, 2.52, 79.68, 0.19]),
    (10_000.0, [0.58, 2.12, 78.89, 0.16]),
];
/// Thresholds of our measures: N/m, and relative.
const STIFFNESS: [f64; 3] = [10.0, 100.0, 1000.0];
const STRAIN: [f64; 3] = [0.003, 0.01, 0.03];
/// Seconds of insertion.
const DURATION: f64 = 4.0;
const QUICK: f64 = 1.0;
/// Tip error that is not seen, %, the share of the frame that must be saved, %, and that of a full Jacobian that is no burden.
const UNSEEN: f64 = 0.2;
const SAVED: f64 = 15.0;

const ABOUT: &str = "The flexible needle pushed into the prostate at 20 mm/s for four seconds, 200 frames of 20 ms, with element \
    stiffnesses evaluated anew only where a measure has grown beyond a threshold: `(12)` is that of Chentanez et al. (2009), N/m; \
    *stiffness* (N/m) and *strain* are `LazyRule::Stiffness` and `LazyRule::Strain`. `F&J_ms` is the time of forces and Jacobians \
    in a frame, `frame_%` the median frame over that without lazy updates, `tip_%` how far the tip ends from where it ends without \
    them, over the length that was pushed in. Published numbers are those of their Table 1, on seven threads of another machine.";

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("lazy", options.threads);
    let seconds = if options.quick { QUICK } else { DURATION };
    let legs = vec![Leg::insert(SPEED * seconds, SPEED)];
    let scene = Scene { legs, ..prostate_flexible(prostate(1.0)?, 0.0) };
    let team = Team::new(options.threads);
    let mut eager: Option<Arm> = None;
    for rule in rules() {
        if options.stopped() {
            break;
        }
        say(&format!("{rule:?}"));
        let arm = arm(&scene, rule, options, &team)?;
        report.rows.push(row(&arm, eager.as_ref().unwrap_or(&arm), SPEED * seconds, options.threads));
        if eager.is_none() {
            eager = Some(arm);
        }
    }
    if let Some(eager) = &eager {
        report.figures = figures(&report, eager, options.quick);
    }
    if let Some(folder) = &options.out {
        let page = page::markdown("Lazy Jacobians under a needle", ABOUT, &report, options.quick);
        report.write(folder, "lazy.md", &page)?;
    }
    Ok(report)
}

/// That which evaluates everything first.
fn rules() -> Vec<LazyRule> {
    let mut rules = vec![LazyRule::Always];
    rules.extend(PUBLISHED.map(|(threshold, _)| LazyRule::Rotation(threshold)));
    rules.extend(STIFFNESS.map(LazyRule::Stiffness));
    rules.extend(STRAIN.map(LazyRule::Strain));
    rules
}

/// One rule along a run.
struct Arm {
    rule: LazyRule,
    /// Of each frame: forces, Jacobian, whole, s.
    times: [Vec<f64>; 3],
    updated: u64,
    /// Evaluations that a rule that spares nothing makes.
    all: u64,
    tip: [f64; 3],
    failed: Option<String>,
}

impl Arm {
    /// Medians: forces, Jacobian, whole, s.
    fn medians(&self) -> [f64; 3] {
        self.times.clone().map(|mut times| median(&mut times))
    }
}

fn arm(scene: &Scene, rule: LazyRule, options: &BenchOptions, team: &Team) -> Result<Arm, BenchError> {
    let mut insertion = scene.start(&Numerics { lazy: rule, ..Numerics::default() }, team)?;
    let mut arm = Arm { rule, times: Default::default(), updated: 0, all: 0, tip: [0.0; 3], failed: None };
    let mut before = [0.0; 2];
    let followed = scene.follow(&mut insertion, FRAME, |insertion, step, seconds| {
        let times = insertion.times().tissue;
        let now = [times.forces.seconds, times.linearize.seconds];
        for (times, t) in arm.times.iter_mut().zip([now[0] - before[0], now[1] - before[1], seconds]) {
            times.push(t);
        }
        before = now;
        arm.updated += step.elements_updated;
        arm.all += u64::from(step.substeps + step.halvings) * insertion.mesh().n_cells() as u64;
        if options.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    arm.tip = insertion.needles()[0].shaft.tip();
    arm.failed = followed.err().map(|error| error.to_string());
    Ok(arm)
}

fn row(arm: &Arm, eager: &Arm, pushed: f64, threads: usize) -> Row {
    let [forces, jacobian, whole] = arm.medians();
    let (method, published) = match arm.rule {
        LazyRule::Rotation(threshold) => (
            format!("(12), {threshold} N/m"),
            PUBLISHED.iter().find(|(published, _)| *published == threshold).map(|(_, numbers)| *numbers),
        ),
        LazyRule::Stiffness(threshold) => (format!("stiffness, {threshold} N/m"), None),
        LazyRule::Strain(threshold) => (format!("strain, {threshold}"), None),
        _ => ("all".into(), None),
    };
    let mut row = Row {
        case: "prostate flexible".into(),
        method,
        threads,
        ok: arm.failed.is_none(),
        note: arm.failed.clone().unwrap_or_default(),
        error: Numbers::from([("tip_%", 100.0 * distance(&arm.tip, &eager.tip) / pushed)]),
        seconds: Some(whole),
        more: Numbers::from([
            ("updated_%", 100.0 * arm.updated as f64 / arm.all.max(1) as f64),
            ("F&J_ms", 1e3 * (forces + jacobian)),
            ("F&J_share_%", 100.0 * (forces + jacobian) / whole),
            ("frame_%", 100.0 * whole / eager.medians()[2]),
        ]),
        ..Row::default()
    };
    if let Some([updated, tissue, frame, error]) = published {
        row.published = [("updated_%", updated), ("F&J_ms", tissue), ("frame_%", frame), ("tip_%", error)].into();
    }
    row
}

/// What is saved without being seen; or the share of a full Jacobian, where there is next to nothing to save.
fn figures(report: &Report, eager: &Arm, quick: bool) -> Vec<Figure> {
    let [_, jacobian, whole] = eager.medians();
    let share = 100.0 * jacobian / whole;
    let unseen = report.rows.iter().filter(|row| row.ok && row.error["tip_%"] <= UNSEEN);
    let least = unseen.map(|row| row.more["frame_%"]).fold(100.0, f64::min);
    let (share_name, saved_name) =
        ("full Jacobian, % of the frame", "frame saved with a tip error of at most 0.2 %, best rule, %");
    if quick {
        return vec![Figure::plain(share_name, share), Figure::plain(saved_name, 100.0 - least)];
    }
    if share < SAVED {
        return vec![Figure::at_most(share_name, share, SAVED), Figure::plain(saved_name, 100.0 - least)];
    }
    vec![Figure::plain(share_name, share), Figure::at_least(saved_name, 100.0 - least, SAVED)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insertion::setup::{GEL, Layers, Tissue, wire};

    /// Threshold 0 of every measure that sees all changes gives the bits of no laziness; higher ones evaluate less.
    #[test]
    fn higher_thresholds_evaluate_less() {
        let scene = Scene {
            name: "a block",
            tissue: Tissue::gel_box([0.05; 3], [5; 3], GEL, |x| x[0] > 0.05 - 1e-9),
            needle: wire([0.0, 0.0253, 0.0247], 0.1),
            layers: Layers::default(),
            legs: vec![Leg::insert(0.02, SPEED)],
        };
        let options = BenchOptions { threads: 1, ..BenchOptions::default() };
        let team = Team::serial();
        let eager = arm(&scene, LazyRule::Always, &options, &team).unwrap();
        // Cells are counted after a step, which may have made some.
        assert!(eager.failed.is_none() && eager.updated.abs_diff(eager.all) * 1000 < eager.all);
        let mut last = eager.updated;
        for threshold in [1e-4, 0.01, 0.1] {
            let lazy = arm(&scene, LazyRule::Strain(threshold), &options, &team).unwrap();
            assert!(lazy.failed.is_none() && lazy.updated < last, "{threshold}: {} {last}", lazy.updated);
            assert!(distance(&lazy.tip, &eager.tip) < 0.01 * 0.02, "{:?} {:?}", lazy.tip, eager.tip);
            last = lazy.updated;
        }
    }
}
