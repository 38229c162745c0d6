//! The pages of documentation, and the plot of `lazy-tissue`.

use crate::{Report, page};
use stylet_plot::{Chart, Series, Style};

/// What both suites are about, and what they found.
pub(super) fn markdown(title: &str, about: &str, report: &Report, quick: bool) -> String {
    let mut text = page::head(title, report, quick);
    text += "A cube of side 0.1 m, 13 × 13 × 13 cells of six tetrahedra, inner nodes moved by up to 15 % of a cell; the face x = 0.1 m \
             is clamped, and the cube is released under its weight along -y, for 200 steps of the trapezoid rule, each linearised \
             once. The corotated law with held rotations, E = 34 kPa, ν = 0.45, 1000 kg/m³; conjugate gradients with block Jacobi to \
             1e-5.\n\n";
    text += about;
    text += "\n\n";
    text += &page::figures(&report.figures);
    // The first line of the table is in the head.
    let table = report.table();
    let rows = table.split_once("\n\n").map_or("", |(_, rows)| rows.split("\n\n").next().unwrap_or(rows));
    text + "\n```text\n" + rows.trim_end() + "\n```\n"
}

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
