//! Bisection of every cell, again and again, until there are a million.

use super::{description, times};
use crate::timing::median;
use crate::{BenchOptions, Figure, Report, Row};
use stylet_mesh::{CellId, MeshChange, SimplexMesh, generate::kuhn_box};

/// Leaves to reach.
const LEAVES: usize = 1_000_000;

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    // Leaves per second, bytes per leaf, shapes.
    case::<2, 3>(options, say, report, 7e6, Some(80.0), 1.0);
    case::<3, 4>(options, say, report, 5e6, Some(88.0), 3.0);
    case::<4, 5>(options, say, report, 1e6, None, 4.0);
}

fn case<const D: usize, const N: usize>(
    options: &BenchOptions,
    say: &mut dyn FnMut(&str),
    report: &mut Report,
    rate: f64,
    bytes: Option<f64>,
    shapes: f64,
) {
    let case = format!("uniform {D}D");
    say(&case);
    let target = if options.quick { LEAVES / 10 } else { LEAVES };
    let start = || kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D]).expect("a unit box");
    let (mut seconds, mesh, ()) = times(if options.quick { 1 } else { 5 }, start, |mesh| bisect_to(mesh, target));
    let seconds = median(&mut seconds);
    let leaves = mesh.n_cells() as f64;
    let mut more = description(&mesh);
    more.insert("leaves_per_second", leaves / seconds);
    let few_shapes = more["shapes"] <= shapes;
    report.figures.push(Figure::at_least(format!("{case}: leaves per second"), leaves / seconds, rate));
    if let Some(bytes) = bytes {
        report.figures.push(Figure::at_most(format!("{case}: bytes per leaf"), more["bytes_per_leaf"], bytes));
    }
    report.rows.push(Row {
        case,
        threads: 1,
        ok: few_shapes,
        seconds: Some(seconds),
        more,
        note: if few_shapes { String::new() } else { format!("more than {shapes} shapes") },
        ..Row::default()
    });
}

/// Bisects all cells until there are at least so many.
fn bisect_to<const D: usize, const N: usize>(mesh: &mut SimplexMesh<D, N>, leaves: usize) {
    let mut change = MeshChange::default();
    while mesh.n_cells() < leaves {
        let all: Vec<CellId> = mesh.cells().collect();
        change.clear();
        mesh.bisect(&all, &mut change).expect("room for a million cells");
    }
}
