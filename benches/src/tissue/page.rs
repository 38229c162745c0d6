//! The plot of `lazy-tissue`.

use crate::Report;
use stylet_plot::{Chart, Series, Style};

/// Error at the probe against the time of forces and Jacobian, a line per run and measure.
pub(super) fn error_against_time(report: &Report) -> Chart {
    let mut series = Vec::new();
    for (dash, measure) in ["(12)", "ours"].into_iter().enumerate() {
        for (colour, rows) in report.rows.chunk_by(|a, b| a.case == b.case).enumerate() {
            let rows = rows.iter().filter(|row| row.method.starts_with(measure));
            let points = rows.filter_map(|row| Some((*row.more.get("F&J_ms")?, *row.error.get("probe_%")?)));
            let case = report.rows.chunk_by(|a, b| a.case == b.case).nth(colour).map_or("", |rows| &rows[0].case);
            series.push(Series {
                name: format!("{measure}, {case}"),
                // Those that evaluate everything have no error, and no place on a logarithmic axis.
                points: points.filter(|(_, error)| *error > 0.0).collect(),
                style: Style::LinePoints,
                dashed: dash == 0,
                colour: Some(colour),
            });
        }
    }
    Chart {
        title: "Lazy Jacobians: error after the last step against the time of forces and Jacobian".into(),
        x_label: "forces and Jacobian (ms per step)".into(),
        y_label: "relative error at the probe (%)".into(),
        log_y: true,
        series,
        ..Chart::default()
    }
}
