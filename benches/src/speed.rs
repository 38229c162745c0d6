//! Tables 6.4 and 6.5: what the speed of the insertion costs and what it does to the result; how much of the time is
//! matrix products; and what a neo-Hookean material costs against a linear one.

use crate::fields::{Field, differences, errors, failed, mean_max_mm, solve, with};
use crate::published::{TABLE_6_4, TABLE_6_5, Timing};
use crate::timing::{Product, median, product_seconds};
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use stylet_needle::{NeedleError, builtin, simulation};
use stylet_plot::{Chart, Series, Style};

/// A product is timed every so many cycles.
const SAMPLE_EVERY: usize = 50;

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("speed", options.threads);
    let slow = if options.quick { 0.02 } else { 0.005 };
    say(&format!("reference at speed {slow}"));
    let reference = solve("slab2d-insertion", &with(&[("needle.speed", &slow)]), options.threads)?.field();
    for (h_ref, lines) in &TABLE_6_5 {
        for line in lines {
            // The slowest insertions are the longest runs.
            if options.stopped() || (options.quick && line.speed < 0.03) {
                break;
            }
            say(&format!("h3/h{h_ref} at speed {}", line.speed));
            let row = insertion(options, *h_ref, line, &reference);
            report.rows.push(row);
        }
    }
    for (h_ref, lines) in &TABLE_6_5 {
        for line in lines.iter().filter(|line| line.speed == 0.1 || line.speed == 0.03) {
            compare(&mut report, *h_ref, line);
        }
    }
    overhead(options, say, &mut report)?;
    materials(options, say, &mut report)?;
    if let Some(folder) = &options.out {
        let svg = chart(&report).to_svg()?;
        report.write(folder, "speed.svg", &svg)?;
    }
    Ok(report)
}

fn case_of(h_ref: i64, speed: f64) -> String {
    format!("h3/h{h_ref} speed {speed}")
}

/// One line of Table 6.5, with the error against a slow insertion (Table 6.4) for h6.
fn insertion(options: &BenchOptions, h_ref: i64, line: &Timing, reference: &Field) -> Row {
    let case = case_of(h_ref, line.speed);
    let keys = with(&[("needle.speed", &line.speed), ("mesh.h_ref", &h_ref)]);
    let repeats = if options.quick { 1 } else { 5 };
    let solved = match solve("slab2d-insertion", &keys, options.threads) {
        Ok(solved) => solved,
        Err(error) => return failed(case, options.threads, &error),
    };
    let again = (1..repeats).filter_map(|_| Some(solve("slab2d-insertion", &keys, options.threads).ok()?.seconds));
    let mut seconds: Vec<f64> = again.chain([solved.seconds]).collect();
    let seconds = median(&mut seconds);
    let summary = solved.run.summary(&[]);
    let mut published = Numbers::from([
        ("cycles", line.cycles),
        ("mean_iterations", line.mean),
        ("max_iterations", line.most),
        ("update_hz", line.cycles / line.seconds),
    ]);
    let mut error = Numbers::new();
    if h_ref == 6 {
        error = errors(mean_max_mm(&differences(&solved.field(), reference)));
        if let Some(&(_, mean, max)) = TABLE_6_4.iter().find(|row| row.0 == line.speed) {
            published.extend([("mean_mm", mean), ("max_mm", max)]);
        }
    }
    let needle = summary.needle.unwrap_or_default();
    Row {
        case,
        method: "cg".into(),
        preconditioner: "none".into(),
        tolerance: Some(0.03),
        threads: options.threads,
        ok: solved.converged,
        error,
        iterations: Some(solved.iterations),
        seconds: Some(seconds),
        more: Numbers::from([
            ("cycles", summary.steps as f64),
            ("mean_iterations", summary.solver.iterations_mean),
            ("max_iterations", summary.solver.iterations_max as f64),
            ("update_hz", summary.steps as f64 / seconds),
            ("tip_reference_mm", 1e3 * needle.tip_reference[0]),
            ("base_force_n", needle.base_force[0]),
        ]),
        published,
        note: note_on(line.speed).into(),
        ..Row::default()
    }
}

/// What to know of a line of the table.
fn note_on(speed: f64) -> &'static str {
    if speed >= 0.3 {
        "which nodes break loose in a cycle depends on relaxation errors; above speed 1, tissue is passed before it is loaded"
    } else if speed <= 0.01 {
        "the published needle seems to start some mm inside: its cycles times its stride make 65 to 66 mm"
    } else {
        ""
    }
}

/// The figures of one line that has targets.
fn compare(report: &mut Report, h_ref: i64, line: &Timing) {
    let case = case_of(h_ref, line.speed);
    let Some(row) = report.row(&case).filter(|row| row.ok) else { return };
    let ours = |name: &str| row.more.get(name).copied().unwrap_or(f64::NAN);
    let figures = [
        Figure::within(format!("{case}: cycles over published"), ours("cycles") / line.cycles, 0.9, 1.1),
        Figure::within(
            format!("{case}: mean iterations over published"),
            ours("mean_iterations") / line.mean,
            0.8,
            1.2,
        ),
        Figure::within(format!("{case}: tip in the body, mm"), ours("tip_reference_mm"), 60.0, 69.0),
        Figure::within(format!("{case}: force at the base, N"), ours("base_force_n"), 2.5, 4.5),
    ];
    report.figures.extend(figures);
}

/// One insertion whose matrix is timed on the way.
struct Sampled {
    seconds: f64,
    products: f64,
    cycles: usize,
    stages: Numbers,
    iterations: u64,
    last: Product,
}

/// Runs an insertion; the sum over cycles of (iterations + 2) products, each at the last time that was measured. The
/// measurements themselves are not part of the seconds.
fn sampled(keys: &[String], threads: usize) -> Result<Sampled, NeedleError> {
    let scene = builtin::open("slab2d-insertion", keys)?;
    let mut run = simulation::start(&scene, threads)?;
    let (mut products, mut product) = (0.0, 0.0);
    while !run.finished() {
        let row = run.step()?;
        if (row.step - 1).is_multiple_of(SAMPLE_EVERY) {
            product = product_seconds(run.stiffness(), 5);
        }
        products += (row.iterations + 2) as f64 * product;
    }
    let summary = run.summary(&[]);
    Ok(Sampled {
        seconds: summary.wall_s,
        products,
        cycles: summary.steps,
        stages: summary.stages.iter().map(|(name, seconds, _)| (name, seconds)).collect(),
        iterations: summary.solver.iterations_total,
        last: Product::of(run.stiffness(), 15),
    })
}

/// How much more than its matrix products an insertion at speed 0.03 costs.
fn overhead(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) -> Result<(), BenchError> {
    for h_ref in [6, 7] {
        if options.stopped() {
            break;
        }
        say(&format!("overhead of h3/h{h_ref} at speed 0.03"));
        let keys = with(&[("needle.speed", &0.03), ("mesh.h_ref", &h_ref)]);
        let mut runs = Vec::new();
        for _ in 0..if options.quick { 3 } else { 9 } {
            runs.push(sampled(&keys, options.threads)?);
        }
        let mut factors: Vec<f64> = runs.iter().map(|run| run.seconds / run.products).collect();
        let mut seconds: Vec<f64> = runs.iter().map(|run| run.seconds).collect();
        let (factor, seconds) = (median(&mut factors), median(&mut seconds));
        let mut shares: Vec<f64> = runs.iter().map(|run| run.last.ours / run.last.sprs).collect();
        let share = median(&mut shares);
        let Some(run) = runs.first() else { continue };
        report.rows.push(Row {
            case: format!("h3/h{h_ref} speed 0.03 linear, sampled"),
            method: "cg".into(),
            preconditioner: "none".into(),
            tolerance: Some(0.03),
            threads: options.threads,
            ok: true,
            iterations: Some(run.iterations),
            seconds: Some(seconds),
            more: Numbers::from([
                ("overhead_factor", factor),
                ("cycles", run.cycles as f64),
                ("us_per_cycle", 1e6 * seconds / run.cycles as f64),
                ("product_us", 1e6 * run.last.ours),
                ("sprs_product_us", 1e6 * run.last.sprs),
            ]),
            stages: run.stages.clone(),
            note: "measured with its matrix sampled every 50 cycles; the same scene in turns is the baseline below"
                .into(),
            ..Row::default()
        });
        report.figures.push(Figure::at_most(format!("overhead_factor, h3/h{h_ref}"), factor, 2.5));
        report.figures.push(Figure::at_most(format!("our product over that of sprs, h3/h{h_ref}"), share, 0.5));
    }
    Ok(())
}

/// A neo-Hookean cycle against a linear one, in turns.
fn materials(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) -> Result<(), BenchError> {
    for h_ref in [6, 7] {
        if options.stopped() {
            break;
        }
        say(&format!("neo-Hookean against linear, h3/h{h_ref} at speed 0.03"));
        let keys = |model: &str| with(&[("needle.speed", &0.03), ("mesh.h_ref", &h_ref), ("material.model", &model)]);
        let mut ratios = Vec::new();
        let mut seconds = Vec::new();
        let mut last = None;
        for _ in 0..if options.quick { 1 } else { 7 } {
            let linear = solve("slab2d-insertion", &keys("linear"), options.threads)?;
            let neo = solve("slab2d-insertion", &keys("neo-hookean"), options.threads)?;
            let per_cycle = |solved: &crate::fields::Solved| solved.seconds / solved.run.steps() as f64;
            ratios.push(per_cycle(&neo) / per_cycle(&linear));
            seconds.push(neo.seconds);
            last = Some(neo);
        }
        let Some(neo) = last else { continue };
        let (ratio, seconds) = (median(&mut ratios), median(&mut seconds));
        let summary = neo.run.summary(&[]);
        report.rows.push(Row {
            case: format!("h3/h{h_ref} speed 0.03 neo-hookean"),
            method: "newton-cg".into(),
            preconditioner: "none".into(),
            tolerance: Some(0.03),
            threads: options.threads,
            ok: neo.converged,
            iterations: Some(neo.iterations),
            seconds: Some(seconds),
            more: Numbers::from([
                ("cycles", summary.steps as f64),
                ("us_per_cycle", 1e6 * seconds / summary.steps as f64),
                ("mean_iterations", summary.solver.iterations_mean),
                ("over_linear", ratio),
            ]),
            stages: summary.stages.iter().map(|(name, seconds, _)| (name, seconds)).collect(),
            note: "force and linearize are parts of solve".into(),
            ..Row::default()
        });
        report.figures.push(Figure::at_most(format!("neo-Hookean cycle over linear cycle, h3/h{h_ref}"), ratio, 6.0));
    }
    Ok(())
}

fn chart(report: &Report) -> Chart {
    let mut series = Vec::new();
    for (index, (h_ref, lines)) in TABLE_6_5.iter().enumerate() {
        let ours = lines.iter().filter_map(|line| {
            Some((line.speed, *report.row(&case_of(*h_ref, line.speed))?.more.get("mean_iterations")?))
        });
        let make = |name: String, points, dashed| Series {
            name,
            points,
            style: Style::LinePoints,
            dashed,
            colour: Some(index),
        };
        series.push(make(format!("h3/h{h_ref}"), ours.collect(), false));
        series.push(make(format!("h3/h{h_ref}, published"), lines.iter().map(|l| (l.speed, l.mean)).collect(), true));
    }
    Chart {
        title: "Iterations per cycle against the speed of the insertion (Table 6.5)".into(),
        x_label: "speed (h_ref per cycle)".into(),
        y_label: "mean iterations per cycle".into(),
        log_x: true,
        series,
        ..Chart::default()
    }
}
