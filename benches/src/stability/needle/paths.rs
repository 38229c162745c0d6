//! Paths through vertices, along edges and faces, along the skin, and out at the back (J10).

use super::{FORCES, Watch, scene};
use crate::insertion::setup::{FRAME, Leg, Numerics, SPEED, Scene, length};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::ops::ControlFlow;
use stylet_physics::insertion::NeedleSettings;
use stylet_solver::team::Team;

/// Cells along a side: vertices are 20 mm apart.
const CELLS: usize = 5;
/// Length of the needle outside its sleeve at the start, m.
const LENGTH: f64 = 0.03;

/// A line.
struct Path {
    what: &'static str,
    /// Where the tip is at the start, m, and where it goes.
    tip: [f64; 3],
    direction: [f64; 3],
    /// How far, m.
    way: f64,
}

const PATHS: [Path; 9] = [
    Path {
        what: "along edges, through their vertices",
        tip: [-0.002, 0.04, 0.04],
        direction: [1.0, 0.0, 0.0],
        way: 0.062,
    },
    Path { what: "obliquely through a vertex", tip: [-0.008, 0.016, 0.028], direction: [2.0, 1.0, 0.5], way: 0.07 },
    Path { what: "within faces", tip: [-0.002, 0.04, 0.047], direction: [1.0, 0.0, 0.0], way: 0.062 },
    Path { what: "within faces, aslant", tip: [-0.002, 0.047, 0.047], direction: [1.0, 0.0, 0.0], way: 0.062 },
    Path { what: "from a vertex of the skin", tip: [0.0, 0.04, 0.04], direction: [1.0, 0.0, 0.0], way: 0.05 },
    Path { what: "along the skin, at depth 0", tip: [0.0, -0.002, 0.051], direction: [0.0, 1.0, 0.0], way: 0.05 },
    Path { what: "tangent to the skin", tip: [-0.001, 0.03, 0.051], direction: [0.02, 1.0, 0.0], way: 0.06 },
    Path { what: "past the body", tip: [-0.01, 0.2, 0.051], direction: [1.0, 0.0, 0.0], way: 0.08 },
    Path { what: "out at the back", tip: [0.051, -0.002, 0.049], direction: [0.0, 1.0, 0.0], way: 0.12 },
];

pub(in crate::stability) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let mut failed = 0;
    for path in &PATHS {
        if options.stopped() {
            return;
        }
        say(&format!("J10 {}", path.what));
        let row = row(path, options);
        failed += usize::from(!row.ok);
        report.rows.push(row);
    }
    report.figures.push(Figure::at_most("J10: paths without a defined outcome", failed as f64, 0.0));
}

/// In and out; an error is an outcome too, and leaves a sound mesh.
fn row(path: &Path, options: &BenchOptions) -> Row {
    let legs = vec![Leg::insert(path.way, SPEED), Leg::insert(-path.way - 0.01, SPEED)];
    let plain = scene(CELLS, 0.45, FORCES, legs);
    let unit = path.direction.map(|d| d / length(&path.direction));
    let base = std::array::from_fn(|k| path.tip[k] - LENGTH * unit[k]);
    let needle = NeedleSettings {
        base,
        direction: path.direction,
        bevel_direction: [0.0, 0.0, 1.0],
        length: LENGTH,
        ..plain.needle.clone()
    };
    let scene = Scene { needle, ..plain };
    let mut row = Row { case: format!("J10 {}", path.what), threads: options.threads, ..Row::default() };
    let mut run = match scene.start(&Numerics::default(), &Team::new(options.threads)) {
        Ok(run) => run,
        Err(error) => {
            (row.ok, row.note) = (true, error.to_string());
            return row;
        }
    };
    let (start, vertices) = (run.mesh().n_cells(), run.mesh().n_vertices());
    let (mut watch, mut blocked, mut deepest) = (Watch::new(), 0, 0.0_f64);
    let mut bounded = true;
    let outcome = scene.follow(&mut run, FRAME, |insertion, step, _| {
        blocked += step.blocked;
        deepest = deepest.max(insertion.needles()[0].depth());
        bounded = watch.look(insertion, step);
        if bounded { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    row.more = Numbers::from([
        ("depth_mm", 1e3 * deepest),
        ("blocked", f64::from(blocked)),
        ("min_j", watch.smallest_j),
        ("cells_left", run.mesh().n_cells() as f64 - start as f64),
    ]);
    let outside = !run.needles()[0].is_inside();
    let sound = run.mesh().check_invariants().map_err(|error| error.to_string());
    let restored = run.mesh().n_cells() == start && run.mesh().n_vertices() == vertices;
    (row.ok, row.note) = match (outcome, sound) {
        (_, Err(broken)) => (false, broken),
        (Err(error), Ok(())) => (watch.smallest_j.is_finite(), error.to_string()),
        (Ok(()), Ok(())) if !bounded => (false, format!("displaced by {:.1} sides", watch.largest)),
        (Ok(()), Ok(())) if !outside => (false, "the needle is still inside".into()),
        (Ok(()), Ok(())) if !restored => (false, "the mesh is not restored".into()),
        (Ok(()), Ok(())) => (true, "in and out, the mesh restored".into()),
    };
    row
}
