//! The pages of documentation of these suites.

use crate::{Report, page};

/// What a suite is about, its figures, and its table.
pub(super) fn markdown(title: &str, about: &str, report: &Report, quick: bool) -> String {
    let mut text = page::head(title, report, quick);
    text += about;
    text += "\n\n";
    text += &page::figures(&report.figures);
    // The first line of the table is in the head, and its figures are above.
    let table = report.table();
    let tables = table.split("\n\n").skip(1).take(if report.figures.is_empty() { usize::MAX } else { groups(report) });
    for rows in tables {
        text += "\n```text\n";
        text += rows.trim_matches('\n');
        text += "\n```\n";
    }
    text
}

/// Tables that the report is printed as: rows with other results are another one.
fn groups(report: &Report) -> usize {
    report.rows.chunk_by(|a, b| a.more.keys().eq(b.more.keys())).count()
}
