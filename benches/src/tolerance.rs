//! Table 6.1: how the tolerance of the residual shows in the displacement.

use crate::fields::{differences, errors, failed, mean_max_mm, solve, static_reference, with};
use crate::published::TABLE_6_1;
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use stylet_plot::{Chart, Series, Style};

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("tolerance", options.threads);
    let level = if options.quick { 6 } else { 7 };
    let uniform = with(&[("mesh.h_start", &level), ("mesh.h_ref", &level)]);
    say(&format!("reference on the uniform h{level} mesh at 1e-8"));
    let reference = static_reference("slab2d-static", &uniform, options.threads)?;
    for (tolerance, mean, max) in TABLE_6_1 {
        if options.stopped() {
            break;
        }
        say(&format!("tolerance {tolerance}"));
        let mut keys = uniform.clone();
        keys.extend(with(&[("solver.tolerance", &tolerance)]));
        let case = format!("h{level}/h{level} eps {tolerance}");
        report.rows.push(match solve("slab2d-static", &keys, options.threads) {
            Err(error) => failed(case, options.threads, &error),
            Ok(solved) => Row {
                case,
                method: "cg".into(),
                preconditioner: "none".into(),
                tolerance: Some(tolerance),
                threads: options.threads,
                ok: solved.converged,
                error: errors(mean_max_mm(&differences(&solved.field(), &reference))),
                iterations: Some(solved.iterations),
                seconds: Some(solved.seconds),
                published: Numbers::from([("mean_mm", mean), ("max_mm", max)]),
                ..Row::default()
            },
        });
    }
    let ratios = report.rows.iter().filter_map(|row| Some(row.error.get("mean_mm")? / row.published.get("mean_mm")?));
    let worst = ratios.map(|ratio| ratio.max(1.0 / ratio)).fold(f64::NAN, f64::max);
    report.figures.push(Figure::at_most("largest factor between our means and the published ones", worst, 3.0));
    let means: Vec<f64> = report.rows.iter().filter_map(|row| row.error.get("mean_mm").copied()).collect();
    let rises = means.windows(2).filter(|pair| pair[1] >= pair[0]).count();
    report.figures.push(Figure::at_most("tolerances at which a tighter one has no smaller error", rises as f64, 0.0));
    if let Some(folder) = &options.out {
        let series = |name: &str, of: &dyn Fn(&Row) -> Option<f64>, dashed, colour| Series {
            name: name.into(),
            points: report.rows.iter().filter_map(|row| Some((row.tolerance?, of(row)?))).collect(),
            style: Style::LinePoints,
            dashed,
            colour: Some(colour),
        };
        let chart = Chart {
            title: "Displacement error against the tolerance of the residual (Table 6.1)".into(),
            x_label: "tolerance".into(),
            y_label: "error (mm)".into(),
            log_x: true,
            log_y: true,
            series: vec![
                series("mean", &|row| row.error.get("mean_mm").copied(), false, 0),
                series("mean, published", &|row| row.published.get("mean_mm").copied(), true, 0),
                series("maximum", &|row| row.error.get("max_mm").copied(), false, 1),
                series("maximum, published", &|row| row.published.get("max_mm").copied(), true, 1),
            ],
            ..Chart::default()
        };
        let svg = chart.to_svg()?;
        report.write(folder, "tolerance.svg", &svg)?;
    }
    Ok(report)
}
