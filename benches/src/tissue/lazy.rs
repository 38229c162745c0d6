//! `stylet bench lazy-tissue`: what it saves, and costs, to evaluate only the element stiffnesses that have changed.

use super::{POISSON, Released, Step, mesh, page, product_seconds, size};
use crate::timing::{median, ratio};
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use stylet_mesh::SimplexMesh;
use stylet_physics::body::LazyRule;
use stylet_solver::team::Team;

/// Table 1 of the 2009 paper, for the needle in prostate tissue: share updated (%), time of forces and Jacobian (ms), that
/// as a share of the frame without lazy updates (%), error of the needle tip (%).
const PUBLISHED: [(f64, [f64; 4]); 4] = [
    (0.0, [100.0, 12.42, 100.0, 0.0]),
    (100.0, [7.96, 3.83, 82.37, 0.06]),
    (1000.0, [3.65, 2.52, 79.68, 0.19]),
    (10_000.0, [0.58, 2.12, 78.89, 0.16]),
];

/// Thresholds of our measure, N/m.
const OURS: [f64; 4] = [3.0, 10.0, 30.0, 100.0];
/// Those that the figures are about: the published one, and ours of about the error that was published for it.
const CHOSEN: (f64, f64) = (1000.0, 100.0);

const ABOUT: &str = "Only elements that have changed by more than a threshold are evaluated anew. `(12)` is the measure of \
    Chentanez et al. (2009), in N/m; ours is `LazyRule::Stiffness`, in N/m. `products` are medians of the time over that of a product \
    with the stiffness on the same threads; `probe_%` is the difference of the mean displacement of the face x = 0 from the run \
    that evaluates everything; published numbers are those of their Table 1, for a needle in prostate tissue on another machine. \
    With steps of 1 ms (12) errs more for the same time: it needs the singular vectors of every element in every step, jumps where \
    two stretches coincide, and does not see an element that turns as a whole.\n\n\
    ![Error against the time of forces and Jacobian](lazy-tissue.svg)";

/// Step and damping time, s. Long steps without damping are no run: one linearised step of the trapezoid rule gains energy.
const RUNS: [(f64, f64); 3] = [(SHORT, 0.0), (SHORT, 10e-3), (20e-3, 10e-3)];
const SHORT: f64 = 1e-3;
/// Those that the figures are about.
const JUDGED: [(f64, f64); 2] = [(SHORT, 0.0), (20e-3, 10e-3)];

/// One rule along a run.
struct Arm {
    rule: LazyRule,
    released: Released,
    /// Of each step, s: product, forces, Jacobian, matrix, solve, whole.
    times: [Vec<f64>; 6],
    iterations: usize,
    updated: u64,
    /// Why it did not come to its end.
    failed: Option<String>,
}

impl Arm {
    fn take(&mut self, product: f64, step: &Step) {
        let [forces, linearize, matrix, solve] = step.stages;
        for (times, t) in self.times.iter_mut().zip([product, forces, linearize, matrix, solve, step.seconds]) {
            times.push(t);
        }
        self.iterations += step.report.iterations;
        self.updated += step.report.elements_updated;
    }

    /// Median of the ratios of one time and the product.
    fn products(&self, time: usize) -> f64 {
        ratio(&self.times[time], &self.times[0])
    }
}

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("lazy-tissue", options.threads);
    let (mesh, team) = (mesh(options.quick), Team::new(options.threads));
    for (dt, damping) in RUNS {
        if options.stopped() {
            break;
        }
        let case = format!("dt {} ms, damping {} ms", 1e3 * dt, 1e3 * damping);
        say(&case);
        let arms = all_rules(&mesh, dt, damping, &team, options)?;
        rows(&case, &mesh, &arms, options.threads, &mut report);
        if JUDGED.contains(&(dt, damping)) {
            figures(&case, &mesh, dt, &arms, options.quick, &mut report);
        }
    }
    if let Some(folder) = &options.out {
        report.write(folder, "lazy-tissue.svg", &page::error_against_time(&report).to_svg()?)?;
        let page = page::markdown("Lazy Jacobians", ABOUT, &report, options.quick);
        report.write(folder, "lazy-tissue.md", &page)?;
    }
    Ok(report)
}

fn rules() -> Vec<LazyRule> {
    let published = PUBLISHED.iter().map(|&(threshold, _)| LazyRule::Rotation(threshold));
    published.chain(OURS.map(LazyRule::Stiffness)).collect()
}

/// Runs all rules, one after the other: side by side they would take the caches from each other, as no application does.
/// Each step is compared with a product of its own moment.
fn all_rules(
    mesh: &SimplexMesh<3, 4>,
    dt: f64,
    damping: f64,
    team: &Team,
    options: &BenchOptions,
) -> Result<Vec<Arm>, BenchError> {
    let frozen = Released::new(mesh, dt, damping, LazyRule::Always, None, team)?.product();
    let x = vec![1.0; frozen.n_rows() * 3];
    let mut y = x.clone();
    let mut arms = Vec::new();
    for rule in rules() {
        let released = Released::new(mesh, dt, damping, rule, None, team)?;
        let mut arm = Arm { rule, released, times: Default::default(), iterations: 0, updated: 0, failed: None };
        for _ in 0..size(options.quick).1 {
            if options.stopped() {
                break;
            }
            let product = product_seconds(&frozen, team, &x, &mut y);
            match arm.released.step() {
                Ok(step) => arm.take(product, &step),
                Err(error) => {
                    arm.failed = Some(error.to_string());
                    break;
                }
            }
        }
        arms.push(arm);
    }
    Ok(arms)
}

fn rows(case: &str, mesh: &SimplexMesh<3, 4>, arms: &[Arm], threads: usize, report: &mut Report) {
    for arm in arms {
        let steps = arm.times[0].len().max(1) as f64;
        let mut times = arm.times.clone();
        let [_, forces, linearize, _, _, whole] = &mut times;
        let tissue = median(forces) + median(linearize);
        let full = arms.first().map_or(f64::NAN, |eager| eager.products(5));
        let (method, published) = match arm.rule {
            LazyRule::Rotation(threshold) => (
                format!("(12), {threshold}"),
                PUBLISHED.iter().find(|(published, _)| *published == threshold).map(|(_, numbers)| numbers),
            ),
            LazyRule::Stiffness(threshold) => (format!("ours, {threshold} N/m"), None),
            _ => ("all".into(), None),
        };
        let mut row = Row {
            case: case.into(),
            method,
            threads,
            ok: arm.failed.is_none(),
            note: arm.failed.clone().unwrap_or_default(),
            error: Numbers::from([("probe_%", 100.0 * error(mesh, arm, &arms[0]))]),
            iterations: Some((arm.iterations as f64 / steps).round() as u64),
            seconds: Some(median(whole)),
            more: Numbers::from([
                ("updated_%", 100.0 * arm.updated as f64 / steps / mesh.n_cells() as f64),
                ("F&J_ms", 1e3 * tissue),
                ("frame_%", 100.0 * arm.products(5) / full),
                ("forces_products", arm.products(1)),
                ("jacobian_products", arm.products(2)),
                ("step_products", arm.products(5)),
            ]),
            ..Row::default()
        };
        if let Some([updated, tissue, frame, error]) = published {
            row.published =
                [("updated_%", *updated), ("F&J_ms", *tissue), ("frame_%", *frame), ("probe_%", *error)].into();
        }
        report.rows.push(row);
    }
}

/// Relative difference at the probe from the run that evaluates everything.
fn error(mesh: &SimplexMesh<3, 4>, arm: &Arm, eager: &Arm) -> f64 {
    let (found, exact) = (arm.released.probe(mesh), eager.released.probe(mesh));
    let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    norm(std::array::from_fn(|k| found[k] - exact[k])) / norm(exact)
}

fn figures(case: &str, mesh: &SimplexMesh<3, 4>, dt: f64, arms: &[Arm], quick: bool, report: &mut Report) {
    let at = |rule: LazyRule| arms.iter().find(|arm| arm.rule == rule);
    let (Some(published), Some(ours)) = (at(LazyRule::Rotation(CHOSEN.0)), at(LazyRule::Stiffness(CHOSEN.1))) else {
        return;
    };
    // A small body is not what the targets are about.
    let at_most = |name: String, value: f64, most: f64| {
        if quick { Figure::plain(name, value) } else { Figure::at_most(name, value, most) }
    };
    for (arm, name) in [(published, "(12) at 1000"), (ours, "ours at 100 N/m")] {
        let lazy = arm.products(2);
        report.figures.push(at_most(format!("{case}: lazy Jacobian, {name}, products"), lazy, 25.0));
        let error = 100.0 * error(mesh, arm, &arms[0]);
        report.figures.push(at_most(format!("{case}: probe error, {name}, %"), error, 0.2));
    }
    let most = if dt == SHORT { 60.0 } else { 300.0 };
    report.figures.extend([
        at_most(format!("{case}: forces, products"), arms[0].products(1), 20.0),
        at_most(format!("{case}: full Jacobian, products"), arms[0].products(2), 60.0),
        at_most(format!("{case}: whole step, ours at 100 N/m, ν {POISSON}, products"), ours.products(5), most),
    ]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BenchOptions;

    /// Every rule has its row in every run, evaluates less the higher its threshold, and errs little with damping.
    #[test]
    fn a_quick_look_has_every_rule() {
        let options = BenchOptions { quick: true, threads: 1, ..BenchOptions::default() };
        let report = run(&options, &mut |_| {}).unwrap();
        assert_eq!(report.rows.len(), RUNS.len() * rules().len());
        for runs in report.rows.chunks(rules().len()) {
            for rules in runs.chunks(PUBLISHED.len()) {
                assert!(rules.windows(2).all(|pair| pair[1].more["updated_%"] <= pair[0].more["updated_%"]));
            }
            assert_eq!((runs[0].more["updated_%"], runs[0].error["probe_%"]), (100.0, 0.0));
            assert!(runs[5].error["probe_%"] < 1.0, "{:?}", runs[5]);
        }
    }
}
