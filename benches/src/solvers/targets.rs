//! What the rows of [`grid`](super::grid) come to.

use super::grid::TARGET;
use super::methods::{Kind, METHODS};
use crate::{Figure, Report, Row};

/// Times faster than the best peer that a solve on the 13k system should be.
const SPEED_UPS: [(&str, f64); 4] = [
    ("13k, ν 0.34, 1 ms", 3.0),
    ("13k, ν 0.34, 20 ms", 3.0),
    ("13k, ν 0.34, static", 3.0),
    ("13k, ν 0.49, static", 2.0),
];

pub(super) fn add(report: &mut Report) {
    let mut figures = Vec::new();
    for (case, least) in SPEED_UPS {
        let ours = fastest(&report.rows, case, Kind::is_ours);
        let peer = fastest(&report.rows, case, Kind::is_peer);
        if let (Some((ours, ours_s)), Some((peer, peer_s))) = (ours, peer) {
            let name = format!("{case}, to 1e-5: times faster than the best peer ({}; {})", name(ours), name(peer));
            figures.push(Figure::at_least(name, peer_s / ours_s, least));
        }
    }
    let aggregation = |case: &str| Some(row(&report.rows, case, "cg", "smoothed-aggregation")?.iterations? as f64);
    for (size, most) in [("13k", 25.0), ("280k", 32.0)] {
        let Some(at_34) = aggregation(&format!("{size}, ν 0.34, static")) else { continue };
        figures.push(Figure::at_most(
            format!("{size}, ν 0.34, static, to 1e-5: iterations, smoothed aggregation"),
            at_34,
            most,
        ));
        if let Some(at_45) = aggregation(&format!("{size}, ν 0.45, static")) {
            let name = format!("{size}, smoothed aggregation: iterations at ν 0.45 over those at 0.34");
            figures.push(Figure::at_most(name, at_45 / at_34, 2.0));
        }
    }
    let sa = report.rows.iter().find(|row| row.preconditioner == "smoothed-aggregation" && row.ok);
    if let Some(products) = sa.and_then(|row| row.more.get("products")) {
        figures.push(Figure::plain("smoothed aggregation: fine products per iteration", *products));
    }
    let large = "280k, ν 0.34, static";
    let plain = row(&report.rows, large, "cg", "block-jacobi").and_then(|row| row.seconds);
    if let (Some(plain), Some((best, seconds))) = (plain, fastest(&report.rows, large, Kind::is_ours)) {
        let name = format!("{large}, to 1e-5: set-up and solve over plain block-Jacobi PCG ({})", name(best));
        figures.push(Figure::at_most(name, seconds / plain, 0.35));
    }
    report.figures.extend(figures);
}

/// A row of a case at the target's tolerance, on the most threads.
fn row<'a>(rows: &'a [Row], case: &str, method: &str, preconditioner: &str) -> Option<&'a Row> {
    let of_case = rows.iter().filter(|row| row.ok && row.case == case && row.tolerance == Some(TARGET));
    let of_method = of_case.filter(|row| row.method == method && row.preconditioner == preconditioner);
    of_method.max_by_key(|row| row.threads)
}

/// The quickest row of a case among methods of some kinds, and its seconds, set-up included.
fn fastest<'a>(rows: &'a [Row], case: &str, kinds: impl Fn(Kind) -> bool) -> Option<(&'a Row, f64)> {
    let methods = METHODS.iter().filter(|method| kinds(method.kind));
    let found = methods.filter_map(|method| row(rows, case, method.solver, method.preconditioner));
    found.filter_map(|row| Some((row, row.seconds?))).min_by(|a, b| a.1.total_cmp(&b.1))
}

fn name(row: &Row) -> String {
    format!("{}, {}", row.method, row.preconditioner)
}
