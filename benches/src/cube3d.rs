//! Figures 6.13 and 6.14: a needle in a cube, linear and neo-Hookean, each beside the same with one generation more.

use crate::fields::with;
use crate::timing::median;
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row, page};
use std::fmt::Write as _;
use stylet_needle::{builtin, simulation};

/// Material and generations of the figures, and the cells that they name.
const PUBLISHED: [(&str, u32, Option<f64>); 3] =
    [("linear", 12, Some(2420.0)), ("linear", 20, None), ("neo-hookean", 20, Some(29562.0))];
/// Those of a quick look.
const QUICK: [(&str, u32, Option<f64>); 2] = [("linear", 12, Some(2420.0)), ("neo-hookean", 12, None)];
/// Runs whose median time is told.
const REPEATS: usize = 3;
/// Seconds that the last of [`PUBLISHED`] may take, and times the linear run of the same mesh.
const LIMITS: (f64, f64) = (60.0, 6.0);

/// One insertion.
#[derive(Clone, Copy, Debug, Default)]
struct Insertion {
    tetrahedra: usize,
    cycles: usize,
    iterations: u64,
    unconverged: u64,
    /// Force along the needle at its base, N.
    force: f64,
    /// Depth of the tip in the undeformed tissue, m.
    tip: f64,
    seconds: f64,
}

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("cube3d", options.threads);
    let cases: &[_] = if options.quick { &QUICK } else { &PUBLISHED };
    for &(model, fold, published) in cases {
        if options.stopped() {
            break;
        }
        say(&format!("{model}, {fold} and {} generations", fold + 1));
        let ours = insert(model, fold, options)?;
        let finer = insert(model, fold + 1, options)?;
        report.rows.push(row(model, fold, published, ours, Some(finer), options.threads));
        report.rows.push(row(model, fold + 1, None, finer, None, options.threads));
    }
    report.figures = figures(&report);
    if let Some(folder) = &options.out {
        let text = markdown(&report, options.quick);
        report.write(folder, "cube3d.md", &text)?;
    }
    Ok(report)
}

fn insert(model: &str, fold: u32, options: &BenchOptions) -> Result<Insertion, BenchError> {
    let scene = builtin::open("cube3d-insertion", &with(&[("material.model", &model), ("mesh.fold", &fold)]))?;
    let (mut last, mut seconds) = (Insertion::default(), Vec::new());
    for _ in 0..if options.quick { 1 } else { REPEATS } {
        let mut run = simulation::start_cube(&scene, options.threads)?;
        while !run.finished() && !options.stopped() {
            run.step()?;
        }
        let summary = run.summary(&[]);
        let along_x = |of: Option<&Vec<f64>>| of.and_then(|x| x.first().copied()).unwrap_or(f64::NAN);
        let needle = summary.needle.as_ref();
        seconds.push(summary.wall_s);
        last = Insertion {
            tetrahedra: summary.elements,
            cycles: summary.steps,
            iterations: summary.solver.iterations_total,
            unconverged: summary.solver.unconverged_solves,
            force: along_x(needle.map(|needle| &needle.base_force)),
            tip: along_x(needle.map(|needle| &needle.tip_reference)),
            seconds: 0.0,
        };
    }
    Ok(Insertion { seconds: median(&mut seconds), ..last })
}

fn row(
    model: &str,
    fold: u32,
    published: Option<f64>,
    ours: Insertion,
    finer: Option<Insertion>,
    threads: usize,
) -> Row {
    let mut row = Row {
        case: case(model, fold),
        threads,
        ok: ours.unconverged == 0,
        iterations: Some(ours.iterations),
        seconds: Some(ours.seconds),
        more: Numbers::from([
            ("tetrahedra", ours.tetrahedra as f64),
            ("cycles", ours.cycles as f64),
            ("force_n", ours.force),
            ("tip_mm", 1e3 * ours.tip),
        ]),
        published: published.map(|count| ("tetrahedra", count)).into_iter().collect(),
        ..Row::default()
    };
    if ours.unconverged > 0 {
        row.note = format!("{} solves ran out of iterations", ours.unconverged);
    }
    if let Some(finer) = finer {
        row.error.insert("force", (ours.force / finer.force - 1.0).abs());
        row.error.insert("tip_mm", 1e3 * (ours.tip - finer.tip).abs());
    }
    row
}

fn case(model: &str, fold: u32) -> String {
    format!("{model}, {fold} generations")
}

fn figures(report: &Report) -> Vec<Figure> {
    let [linear, neo_hookean] = ["linear", "neo-hookean"].map(|model| report.row(&case(model, 20)));
    let mut figures = Vec::new();
    if let Some(seconds) = neo_hookean.and_then(|row| row.seconds) {
        figures.push(Figure::at_most("neo-Hookean at 20 generations, s", seconds, LIMITS.0));
    }
    let (Some(linear), Some(neo_hookean)) = (linear, neo_hookean) else { return figures };
    let of = |name: &str| [linear, neo_hookean].map(|row| row.more[name]);
    let [cells, as_many] = of("tetrahedra");
    figures.push(Figure::within("its tetrahedra over those of linear", as_many / cells, 1.0, 1.0));
    let ratio = neo_hookean.seconds.zip(linear.seconds).map_or(f64::NAN, |(ours, linear)| ours / linear);
    figures.push(Figure::at_most("its time over that of linear", ratio, LIMITS.1));
    figures
}

/// The page as Markdown.
fn markdown(report: &Report, quick: bool) -> String {
    let mut text = page::head("A needle in a cube", report, quick);
    text += "Seconds are wall time of the cycles, the median of three runs.\n\n";
    if !report.figures.is_empty() {
        text += &page::figures(&report.figures);
        text.push('\n');
    }
    text += "Scene `cube3d-insertion`: a cube of side 0.1 m, E = 34 kPa, ν = 0.34, fixed at the bottom, six tetrahedra at the \
             start; a rigid needle of radius 1 mm comes 65 mm deep from the left, cells that touch it are bisected to so many \
             generations. Published counts: Nienhuys, *Cutting in deformable objects* (2003), Figures 6.13 and 6.14. The last \
             two columns are differences from one generation more, in the base force and in the place that the tip has come to \
             in the undeformed tissue.\n\n\
             | tissue, generations | tetrahedra | published | cycles | iterations | base force, N | tip, mm | s | force | tip, mm |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    for row in &report.rows {
        let number = |name: &str| row.more.get(name).copied().unwrap_or(f64::NAN);
        let published = row.published.get("tetrahedra").map_or_else(String::new, f64::to_string);
        let force = row.error.get("force").map_or_else(String::new, |share| format!("{:.1} %", 100.0 * share));
        let tip = row.error.get("tip_mm").map_or_else(String::new, |tip| format!("{tip:.3}"));
        let _ = writeln!(
            text,
            "| {} | {} | {published} | {} | {} | {:.3} | {:.3} | {:.3} | {force} | {tip} |",
            row.case,
            number("tetrahedra"),
            number("cycles"),
            row.iterations.unwrap_or(0),
            number("force_n"),
            number("tip_mm"),
            row.seconds.unwrap_or(f64::NAN),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(seconds: f64, cells: usize) -> Report {
        let linear = Insertion { tetrahedra: 100, force: 4.0, tip: 0.06, seconds: 0.5, ..Insertion::default() };
        let neo_hookean = Insertion { tetrahedra: cells, seconds, ..linear };
        let finer = Insertion { force: 5.0, tip: 0.061, ..linear };
        let rows = vec![
            row("linear", 20, None, linear, Some(finer), 2),
            row("neo-hookean", 20, Some(29562.0), neo_hookean, None, 2),
        ];
        let mut report = Report { rows, ..Report::new("cube3d", 2) };
        report.figures = figures(&report);
        report
    }

    #[test]
    fn targets_are_time_and_the_same_mesh() {
        let misses = |report: Report| report.figures.iter().filter(|figure| !figure.reached()).count();
        assert_eq!(report(2.9, 100).figures.len(), 3);
        assert_eq!(misses(report(2.9, 100)), 0);
        assert_eq!(misses(report(3.1, 100)), 1);
        assert_eq!(misses(report(61.0, 101)), 3);
    }

    #[test]
    fn the_page_shows_published_counts_and_differences() {
        let page = markdown(&report(2.0, 100), false);
        assert!(page.contains("| neo-hookean, 20 generations | 100 | 29562 |"), "{page}");
        assert!(page.contains("| 20.0 % | 1.000 |"), "{page}");
    }

    #[test]
    fn the_cube_comes_to_its_end_with_either_tissue() {
        let options = BenchOptions { quick: true, threads: 1, ..BenchOptions::default() };
        let [linear, neo_hookean] = ["linear", "neo-hookean"].map(|model| insert(model, 12, &options).unwrap());
        assert!(linear.unconverged == 0 && neo_hookean.unconverged == 0);
        assert_eq!(linear.tetrahedra, neo_hookean.tetrahedra);
        assert!(
            linear.force > 1.0 && (neo_hookean.force / linear.force - 1.0).abs() < 0.1,
            "{linear:?} {neo_hookean:?}"
        );
    }
}
