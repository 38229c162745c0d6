//! Every material on the same static scenes in three dimensions, on meshes each of which halves the cells of the last.

mod page;
mod scenes;

use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use scenes::{Deed, Outcome, SCENES, SMALL, Scene};
use stylet_physics::material::Solid;
use stylet_physics::statics::StaticError;
use stylet_plot::{Chart, Series, Style};

/// Pa.
const YOUNG: f64 = 34e3;
/// Low enough for linear tetrahedra not to lock.
const POISSON: f64 = 0.4;
/// kg/m³.
const DENSITY: f64 = 1000.0;
/// Of the forces at the constraints.
const TOLERANCE: f64 = 1e-6;

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("materials3d", options.threads);
    let mut curves = Vec::new();
    for scene in &SCENES {
        for model in Solid::MODELS {
            if options.stopped() {
                break;
            }
            say(&format!("{}, {model}", scene.name));
            // The last is the reference of the one before it.
            let finer: &[usize] = if options.quick { &[1, 2] } else { &[1, 2, 4] };
            let solved: Vec<_> = finer.iter().map(|&finer| scene.solve(model, finer, options.threads)).collect();
            if let (Deed::Compress(_), true, [.., Ok(outcome), _]) = (scene.deed, scene.name != SMALL, &solved[..]) {
                curves.push(curve(scene, model, outcome));
            }
            report.rows.push(row(scene, model, solved, options.threads));
        }
    }
    report.figures = figures(&report.rows);
    if let Some(folder) = &options.out {
        let chart = Chart {
            title: "Block of 0.1 m compressed between bonded plates".into(),
            x_label: "compression (%)".into(),
            y_label: "force (N)".into(),
            series: curves,
            ..Chart::default()
        };
        report.write(folder, "materials3d-compression.svg", &chart.to_svg()?)?;
        let page = page::markdown(&report, options.quick);
        report.write(folder, "materials3d.md", &page)?;
    }
    Ok(report)
}

/// The row of the mesh before the last; its error is the difference from the last.
fn row(scene: &Scene, model: &str, solved: Vec<Result<Outcome, StaticError>>, threads: usize) -> Row {
    let mut row =
        Row { case: scene.name.into(), method: model.into(), tolerance: Some(TOLERANCE), threads, ..Row::default() };
    let answers: Vec<Option<f64>> =
        solved.iter().map(|solved| solved.as_ref().ok().map(|outcome| scene.answer(outcome))).collect();
    let mut finest_first = solved.into_iter().rev();
    let (reference, Some(outcome)) = (finest_first.next(), finest_first.next()) else { return row };
    let outcome = match outcome {
        Ok(outcome) => outcome,
        Err(error) => {
            row.note = error.to_string();
            return row;
        }
    };
    row.ok = true;
    if let Some(Err(error)) = reference {
        row.note = format!("no finer reference: {error}");
    }
    row.iterations = Some(outcome.newton as u64);
    row.seconds = Some(outcome.seconds);
    row.more = Numbers::from([
        ("tetrahedra", outcome.tetrahedra as f64),
        ("force_n_or_nm", outcome.force()),
        ("cg", outcome.cg as f64),
        ("min_j", outcome.smallest_j),
    ]);
    // Ends that are turned have none.
    if outcome.displacement != 0.0 {
        row.more.insert("displacement_mm", 1e3 * outcome.displacement);
    }
    if let [.., Some(ours), Some(better)] = answers[..] {
        row.error.insert("relative", ((ours - better) / better).abs());
    }
    if let [Some(coarse), Some(ours), Some(better)] = answers[..] {
        // What the difference falls by when the cells are halved.
        row.more.insert("falls_by", ((coarse - ours) / (ours - better)).abs());
    }
    row
}

fn figures(rows: &[Row]) -> Vec<Figure> {
    let mut figures = Vec::new();
    let falls: Vec<f64> = rows.iter().filter_map(|row| row.more.get("falls_by").copied()).collect();
    if let Some(least) = falls.into_iter().min_by(f64::total_cmp) {
        figures.push(Figure::at_least("least fall of the error per halving of the cells", least, 1.6));
    }
    let small: Vec<f64> =
        rows.iter().filter(|row| row.case == SMALL).filter_map(|row| row.more.get("force_n_or_nm").copied()).collect();
    let ends = small.iter().copied().min_by(f64::total_cmp).zip(small.iter().copied().max_by(f64::total_cmp));
    if let Some((least, most)) = ends {
        figures.push(Figure::at_most(
            "spread of the force over the laws at small strain",
            (most / least - 1.0).abs(),
            1e-3,
        ));
    }
    figures
}

/// Force against compression.
fn curve(scene: &Scene, model: &str, outcome: &Outcome) -> Series {
    let points = scene.percents().into_iter().zip(outcome.forces.iter().map(|force| force.abs()));
    Series {
        name: model.into(),
        points: std::iter::once((0.0, 0.0)).chain(points).collect(),
        style: Style::Line,
        ..Series::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_law_agrees_at_small_strain_and_is_on_the_page() {
        let small = SCENES.iter().find(|scene| scene.name == SMALL).unwrap();
        let rows: Vec<Row> =
            Solid::MODELS.map(|model| row(small, model, [1, 2].map(|n| small.solve(model, n, 1)).into(), 1)).into();
        // Three cells a side are a tenth too stiff.
        assert!(rows.iter().all(|row| row.ok && row.error["relative"] < 0.12), "{rows:?}");
        let figures = figures(&rows);
        assert!(figures.len() == 1 && figures[0].reached(), "{figures:?}");
        let report = Report { rows, ..Report::new("materials3d", 1) };
        let page = page::markdown(&report, true);
        for model in Solid::MODELS {
            assert!(page.contains(&format!("\n| {model} | ")), "{model}: {page}");
        }
    }

    #[test]
    fn a_law_that_fails_stands_there_with_its_reason() {
        let failed = || Err(StaticError::LoadStep { name: "load step", value: 0.0 });
        let row = row(&SCENES[0], "linear", vec![failed(), failed()], 1);
        assert!(!row.ok && row.note.contains("load step"), "{}", row.note);
        let report = Report { rows: vec![row], ..Report::new("materials3d", 1) };
        assert!(page::markdown(&report, true).contains("| linear | failed: "));
    }

    #[test]
    fn errors_are_those_of_the_answer() {
        let outcome = |force: f64| Outcome {
            forces: vec![force],
            displacement: 0.5,
            newton: 1,
            cg: 2,
            smallest_j: 0.9,
            seconds: 0.0,
            tetrahedra: 6,
        };
        let twisted = &SCENES[2];
        let row = row(twisted, "linear", [1.4, 1.1, 1.0].map(|force| Ok(outcome(force))).into(), 1);
        assert!((row.error["relative"] - 0.1).abs() < 1e-12 && (row.more["falls_by"] - 3.0).abs() < 1e-12);
        assert_eq!(row.more["force_n_or_nm"], 1.1);
    }
}
