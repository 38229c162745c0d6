//! The report as one page of documentation.

use super::{POISSON, crush};
use crate::report::short;
use crate::{Report, Row, page};
use std::fmt::Write as _;
use stylet_physics::material::Solid;

/// Tests of a needle, and what they are about.
const NEEDLE: [(&str, &str); 6] = [
    (
        "J5",
        "A flexible needle in nearly incompressible tissue: 60 mm deep in a cube of 0.1 m, held; change of the whole volume, spread \
         of det F over the cells at the end and by how much it grew from 100 steps after the insertion",
    ),
    (
        "J6",
        "Insertions to 60 mm and withdrawals, along one path and along random ones: meshes restored, dihedral angles from one edge \
         of depth on, change of the volume, farthest move of a vertex",
    ),
    ("J7", "Steps of 2 ms to 2 s and speeds up to 5 m/s: 60 mm in, held for 20 steps, out"),
    (
        "J8",
        "A needle that is stuck pulled with many times the force of friction and cutting, reversals in every step, a whip of 2 mm \
         at 100 Hz; error of its length, and displacement after 300 steps of rest",
    ),
    ("J9", "Friction and cutting of nothing and of no end: largest force at a node, depth, trials"),
    ("J10", "Degenerate paths: through vertices, along edges, faces and skin, past the body, out at the back"),
];

/// The page as Markdown.
pub(super) fn markdown(report: &Report, quick: bool) -> String {
    let (cells, seeds) = crush::size(quick);
    let mut page = page::head("Stability", report, quick);
    page += "Seconds are wall time of one run, with as many runs at a time as there are threads.\n\n";
    page += &page::figures(&report.figures);
    let _ = write!(
        page,
        "\n## Crushed and scrambled cubes\n\n\
         A cube of side 0.1 m, {cells} × {cells} × {cells} cells of six tetrahedra, its bottom fixed, E = 34 kPa, 1000 kg/m³, \
         damping time 10 ms, no load. Backward Euler, 10 ms and longer where little moves, full Newton to 1e-4 of the forces of \
         the step, finer where that moves nothing any more. Collapse: all free nodes start at one point, on a plane, on a line. Scramble: uniform at random in the box, \
         {seeds} seeds.\n\n\
         *Recovered*: all J > 0 and every displacement below 1e-3 of the side; *latest*, when the last of them came to rest. \
         *Elsewhere*: another equilibrium, free forces below 1e-4 E per face. *Moving*: neither after 100 s. *Unconverged*: steps \
         that ended above the tolerance, at less energy than they began, with elements inverted. *Worst*: the largest \
         displacement of a run at its end, in sides.\n\n\
         St. Venant-Kirchhoff and neo-Hookean tissue has no energy where J ≤ 0 and says so; the invertible laws continue it. Nearer \
         to ν = 0.5 the other laws have equilibria with elements inside out or folded, in which scrambles end.\n",
    );
    for name in ["J1 collapse", "J2 scramble"] {
        let _ = write!(
            page,
            "\n### {name}\n\n| law | ν | recovered | latest, s | elsewhere | moving | worst | least J | Newton steps | unconverged | s |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n"
        );
        each(report, name, |model, poisson, row| crush_line(&mut page, model, poisson, row));
    }
    page += "\n## One element: a node through the opposite face (J3)\n\n\
             Force towards where the node came from, over E times the square of the height, 0.5, 1 and 5 heights beyond the face; \
             then the relative jump of the force at J = 0. A law without energy there has no force.\n\n\
             | law | ν | 0.5 | 1 | 5 | jump | |\n|---|---:|---:|---:|---:|---:|---|\n";
    each(report, "J3 one element", |model, poisson, row| {
        let cell = |name: &str| row.more.get(name).map_or_else(String::new, |x| format!("{x:.3e}"));
        let [half, one, five, jump] = ["back_0.5", "back_1", "back_5", "jump"].map(cell);
        let _ = writeln!(page, "| {model} | {poisson} | {half} | {one} | {five} | {jump} | {} |", row.note);
    });
    page += "\n## Bone bonded to fat (J4)\n\n\
             The lower half of the cube has E = 1e9 Pa, the upper one 1e4 Pa; its weight acts sideways. Static, Newton-CG to 1e-6.\n\n\
             | law | ν | fat, mm | bone over fat | Newton steps | CG iterations | s | |\n|---|---:|---:|---:|---:|---:|---:|---|\n";
    each(report, "J4 bone and fat", |model, poisson, row| {
        let cell = |name: &str| row.more.get(name).map_or_else(String::new, |x| format!("{x:.3e}"));
        let [fat, ratio] = ["fat_mm", "bone_over_fat"].map(cell);
        let cg = row.more.get("cg").map_or_else(String::new, f64::to_string);
        let newton = row.iterations.map_or_else(String::new, |count| count.to_string());
        let seconds = row.seconds.unwrap_or(f64::NAN);
        let _ =
            writeln!(page, "| {model} | {poisson} | {fat} | {ratio} | {newton} | {cg} | {seconds:.2} | {} |", row.note);
    });
    page += "\n## Hostile input (J11)\n\n| input | answer |\n|---|---|\n";
    for row in report.rows.iter().filter(|row| row.case.starts_with("J11 ")) {
        let _ = writeln!(page, "| {} | {} |", &row.case[4..], row.note);
    }
    for (test, about) in NEEDLE {
        let _ = write!(page, "\n## {about} ({test})\n\n");
        numbers(&mut page, report.rows.iter().filter(|row| row.case.split(' ').next() == Some(test)));
    }
    page += "\n## Threads (J12)\n\n| run | steps | runs | with other bits | |\n|---|---:|---:|---:|---|\n";
    for row in report.rows.iter().filter(|row| row.case.starts_with("J12 ")) {
        let cell = |name: &str| row.more.get(name).map_or_else(String::new, f64::to_string);
        let [steps, runs, differing] = ["steps", "runs", "differing"].map(cell);
        let _ = writeln!(page, "| {} | {steps} | {runs} | {differing} | {} |", &row.case[4..], row.note);
    }
    page
}

/// Rows with whatever numbers they have; those that failed say why.
fn numbers<'r>(page: &mut String, rows: impl Iterator<Item = &'r Row> + Clone) {
    let mut names: Vec<&str> = rows.clone().flat_map(|row| row.more.keys().copied()).collect();
    names.sort_unstable();
    names.dedup();
    let _ = writeln!(page, "| | {} | |", names.join(" | "));
    let _ = writeln!(page, "|---|{}---|", "---:|".repeat(names.len()));
    for row in rows {
        let cells: Vec<String> =
            names.iter().map(|name| row.more.get(name).map_or_else(String::new, |x| short(*x))).collect();
        let verdict = if row.ok { String::new() } else { "**failed** ".into() };
        let case = row.case.split_once(' ').map_or("", |(_, case)| case);
        let _ = writeln!(page, "| {case} | {} | {verdict}{} |", cells.join(" | "), row.note);
    }
}

/// Every row of a test, law by law.
fn each(report: &Report, test: &str, mut line: impl FnMut(&str, f64, &Row)) {
    for model in Solid::MODELS {
        for poisson in POISSON {
            if let Some(row) = report.row(&format!("{test}, {model}, ν {poisson}")) {
                line(model, poisson, row);
            }
        }
    }
}

fn crush_line(page: &mut String, model: &str, poisson: f64, row: &Row) {
    let count = |name: &str| row.more.get(name).copied().unwrap_or(0.0);
    let Some(worst) = row.error.get("worst") else {
        let _ = writeln!(page, "| {model} | {poisson} | refused: {} | | | | | | | | |", row.note);
        return;
    };
    let latest = row.more.get("latest_s").map_or_else(String::new, |t| format!("{t:.1}"));
    let _ = writeln!(
        page,
        "| {model} | {poisson} | {}/{} | {latest} | {} | {} | {worst:.1e} | {:.3} | {} | {} | {:.2} |",
        count("recovered"),
        count("runs"),
        count("elsewhere"),
        count("moving"),
        count("min_j"),
        row.iterations.unwrap_or(0),
        count("unconverged"),
        row.seconds.unwrap_or(f64::NAN),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Figure, Numbers};

    #[test]
    fn runs_misses_and_refusals_are_on_the_page() {
        let case = |test: &str, model: &str| format!("{test}, {model}, ν 0.3");
        let back = Row {
            case: case("J1 collapse", "corotated"),
            ok: true,
            error: Numbers::from([("worst", 2e-5)]),
            iterations: Some(77),
            seconds: Some(1.5),
            more: Numbers::from([
                ("runs", 3.0),
                ("recovered", 2.0),
                ("elsewhere", 1.0),
                ("latest_s", 4.25),
                ("min_j", 0.9),
                ("unconverged", 5.0),
            ]),
            ..Row::default()
        };
        let refused =
            Row { case: case("J1 collapse", "neo-hookean"), note: "cell 7 is inverted".into(), ..Row::default() };
        let element = Row {
            case: case("J3 one element", "linear"),
            ok: true,
            more: Numbers::from([("back_0.5", 0.5), ("back_1", 1.0), ("back_5", 2.0), ("jump", 1e-9)]),
            ..Row::default()
        };
        let hostile = Row { case: "J11 no tetrahedron".into(), ok: true, note: "no cells".into(), ..Row::default() };
        let mut report = Report { rows: vec![back, refused, element, hostile], ..Report::new("stability", 2) };
        report.figures.push(Figure::at_least("share", 0.5, 1.0));
        let text = markdown(&report, true);
        for part in [
            "| share | 0.500 | at least 1 | **missed** |",
            "3 × 3 × 3 cells",
            "| corotated | 0.3 | 2/3 | 4.2 | 1 | 0 | 2.0e-5 | 0.900 | 77 | 5 | 1.50 |",
            "| neo-hookean | 0.3 | refused: cell 7 is inverted |",
            "| linear | 0.3 | 5.000e-1 | 1.000e0 | 2.000e0 | 1.000e-9 |  |",
            "| no tetrahedron | no cells |",
        ] {
            assert!(text.contains(part), "{part}:\n{text}");
        }
    }
}
