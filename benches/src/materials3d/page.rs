//! The report as one page of documentation.

use super::scenes::SCENES;
use super::{DENSITY, POISSON, TOLERANCE, YOUNG};
use crate::{Report, Row, page};
use std::fmt::Write as _;

/// The page as Markdown.
pub(super) fn markdown(report: &Report, quick: bool) -> String {
    let mut text = page::head("Materials in three dimensions", report, quick);
    text += "Seconds are wall time of one solve.\n\n";
    text += &page::figures(&report.figures);
    let _ = write!(
        text,
        "\nE = {:.0} kPa, ν = {POISSON}, {DENSITY:.0} kg/m³; right simplices, six a cell. Newton-CG to {TOLERANCE:e} of the \
         forces at the constraints. *Error*: of the displacement under a load, of the force of a motion, against a mesh with \
         twice the cells along each axis. *Falls by*: the same difference between the mesh with half the cells and this one, \
         over it; 2 at order 1, 4 at order 2; corners between held and free faces keep uniform meshes below that. \
         St. Venant-Kirchhoff tissue softens under compression until an element is flat, which is a property of that law; \
         continued below a stretch (invertible), it goes on with less force than the others.\n",
        1e-3 * YOUNG,
    );
    for scene in &SCENES {
        let rows: Vec<&Row> = report.rows.iter().filter(|row| row.case == scene.name).collect();
        let Some(first) = rows.first() else { continue };
        let heading = scene.name[..1].to_uppercase() + &scene.name[1..];
        let count = first.more.get("tetrahedra").map_or_else(String::new, |count| format!(" {count} tetrahedra."));
        let _ = write!(
            text,
            "\n## {heading}\n\n{}{count}\n\n\
             | law | force | displacement, mm | error | falls by | least J | Newton steps | CG iterations | s |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
            scene.about,
        );
        rows.iter().for_each(|row| line(&mut text, row));
    }
    text
}

fn line(page: &mut String, row: &Row) {
    if !row.ok {
        let _ = writeln!(page, "| {} | failed: {} | | | | | | | |", row.method, row.note);
        return;
    }
    let number = |name: &str| row.more.get(name).copied().unwrap_or(f64::NAN);
    let error = row.error.get("relative").map_or_else(String::new, |error| format!("{:.2} %", 100.0 * error));
    let falls = row.more.get("falls_by").map_or_else(String::new, |ratio| format!("{ratio:.2}"));
    let _ = writeln!(
        page,
        "| {} | {} | {} | {error} | {falls} | {:.3} | {} | {} | {:.3} |",
        row.method,
        digits(number("force_n_or_nm")),
        row.more.get("displacement_mm").map_or_else(String::new, |&mm| digits(mm)),
        number("min_j"),
        row.iterations.unwrap_or(0),
        number("cg"),
        row.seconds.unwrap_or(f64::NAN),
    );
}

/// Four digits.
fn digits(x: f64) -> String {
    let places = if x == 0.0 || !x.is_finite() { 0 } else { (3 - x.abs().log10().floor() as i32).max(0) as usize };
    format!("{x:.places$}")
}
