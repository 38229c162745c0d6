//! Table 6.6: what it costs that needle nodes lie beside the needle, against moving them onto it.

use crate::fields::{Field, Solved, differences, errors, failed, mean_max_mm, solve, static_reference, with};
use crate::published::{TABLE_6_6_DIFFERENCE, TABLE_6_6_WITH, TABLE_6_6_WITHOUT};
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use stylet_plot::{MeshPanel, MeshPicture};

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("conformance", options.threads);
    let mut fields: Vec<Option<Field>> = Vec::new();
    let mut discretisation = Vec::new();
    say("reference on the uniform h7 mesh, not relocated");
    let reference = static_reference("slab2d-tilted", &[], options.threads)?;
    for (relocate, published) in [(true, TABLE_6_6_WITH), (false, TABLE_6_6_WITHOUT)] {
        let keys = with(&[("needle.relocate", &relocate)]);
        let name = if relocate { "with relocation" } else { "without relocation" };
        say(name);
        let case = format!("h3/h6 {name} against h7");
        match solve("slab2d-tilted", &keys, options.threads) {
            Err(error) => {
                report.rows.push(failed(case, options.threads, &error));
                fields.push(None);
            }
            Ok(solved) => {
                let field = solved.field();
                let (mean, max) = mean_max_mm(&differences(&field, &reference));
                discretisation.push(mean);
                report.rows.push(row(case, (mean, max), published, Some(&solved), options.threads));
                fields.push(Some(field));
            }
        }
    }
    if let [Some(relocated), Some(plain)] = &fields[..] {
        let same_node: Vec<f64> = (0..plain.mesh.n_vertex_slots())
            .map(|v| (relocated.u[2 * v] - plain.u[2 * v]).hypot(relocated.u[2 * v + 1] - plain.u[2 * v + 1]))
            .collect();
        let (mean, max) = mean_max_mm(&same_node);
        let moved = relocated.mesh.points().iter().zip(plain.mesh.points()).filter(|(a, b)| a != b).count();
        let case = "h3/h6 with against without, node by node".into();
        let mut row = row(case, (mean, max), TABLE_6_6_DIFFERENCE, None, options.threads);
        row.more.insert("nodes_moved", moved as f64);
        report.rows.push(row);
        let published = TABLE_6_6_DIFFERENCE.0;
        report.figures.push(Figure::within("mean difference node by node, mm", mean, published / 2.0, published * 2.0));
        let least = discretisation.iter().copied().fold(f64::INFINITY, f64::min);
        report.figures.push(Figure::at_most("its ratio to the discretisation error", mean / least, 1.0));
        if let Some(folder) = &options.out {
            let svg = picture(relocated, plain)?;
            report.write(folder, "conformance.svg", &svg)?;
        }
    }
    Ok(report)
}

fn row(case: String, error: (f64, f64), published: (f64, f64), solved: Option<&Solved>, threads: usize) -> Row {
    Row {
        case,
        method: "cg".into(),
        preconditioner: "none".into(),
        tolerance: Some(1e-4),
        threads,
        ok: solved.is_none_or(|s| s.converged),
        error: errors(error),
        iterations: solved.map(|s| s.iterations),
        seconds: solved.map(|s| s.seconds),
        published: Numbers::from([("mean_mm", published.0), ("max_mm", published.1)]),
        ..Row::default()
    }
}

/// Both deformed meshes, coloured by displacement (Fig 6.11).
fn picture(relocated: &Field, plain: &Field) -> Result<String, BenchError> {
    let drawn = [("without relocation", plain.drawn(1.0)), ("with relocation", relocated.drawn(1.0))];
    let panel = MeshPanel {
        title: "Load along a tilted line (Fig 6.11)".into(),
        pictures: drawn.iter().map(|(title, d)| MeshPicture { title: (*title).into(), ..d.picture() }).collect(),
        columns: 2,
        colour_label: "displacement (mm)".into(),
        ..MeshPanel::default()
    };
    Ok(panel.to_svg()?)
}
