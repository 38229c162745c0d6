//! Refinement around a point and along a needle: exact counts, times, and the way back to the start mesh.

use super::{description, expect, times};
use crate::timing::median;
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::time::Instant;
use stylet_mesh::{MeshChange, SimplexMesh, Sweep, generate::kuhn_box};

/// The needle of the three-dimensional cases.
const NEEDLE: [[f64; 3]; 2] = [[-0.01, 0.431, 0.527], [0.713, 0.489, 0.561]];

#[allow(clippy::approx_constant, reason = "a coordinate, not a logarithm")]
const POINT_4D: [f64; 4] = [0.3141, 0.2718, 0.5772, 0.6931];

pub(super) fn run(options: &BenchOptions, _say: &mut dyn FnMut(&str), report: &mut Report) {
    let repeats = if options.quick { 5 } else { 51 };
    let counts =
        [("leaves", 501.0), ("vertices", 257.0), ("shapes", 1.0), ("min_angle_deg", 45.0), ("max_angle_deg", 90.0)];
    point::<2, 3>(report, repeats, [0.3141, 0.2718], 20, Some(0.15), &counts);
    let counts =
        [("leaves", 2104.0), ("vertices", 417.0), ("shapes", 3.0), ("min_angle_deg", 45.0), ("max_angle_deg", 120.0)];
    point::<3, 4>(report, repeats, [0.3141, 0.2718, 0.5772], 7, Some(0.5), &counts);
    point::<4, 5>(report, repeats, POINT_4D, 4, None, &[("shapes", 4.0)]);
    needle(report, repeats);
}

fn unit<const D: usize, const N: usize>() -> SimplexMesh<D, N> {
    kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D]).expect("a unit box")
}

fn point<const D: usize, const N: usize>(
    report: &mut Report,
    repeats: usize,
    at: [f64; D],
    exponent: i32,
    most_ms: Option<f64>,
    expected: &[(&'static str, f64)],
) {
    let case = format!("point {D}D 2^-{exponent}");
    let (mut seconds, mesh, outcome) =
        times(repeats, unit::<D, N>, |mesh| mesh.refine_around(at, 2_f64.powi(-exponent), &mut MeshChange::default()));
    let seconds = median(&mut seconds);
    let sound = outcome.map_err(|e| e.to_string()).and_then(|_| mesh.check_invariants().map_err(|e| e.to_string()));
    let mut row = Row {
        case: case.clone(),
        threads: 1,
        ok: sound.is_ok(),
        seconds: Some(seconds),
        more: description(&mesh),
        note: sound.err().unwrap_or_default(),
        ..Row::default()
    };
    expect(&mut row, expected);
    report.rows.push(row);
    if let Some(most) = most_ms {
        report.figures.push(Figure::at_most(format!("{case}: ms"), 1e3 * seconds, most));
    }
}

/// The mesh refined along the needle, and coarsened to the start mesh again.
fn needle(report: &mut Report, repeats: usize) {
    let [a, b] = NEEDLE;
    let size = 2_f64.powi(-7);
    let refine = |mesh: &mut SimplexMesh<3, 4>| mesh.refine_along(a, b, size, &mut MeshChange::default());
    let (mut seconds, mesh, _) = times(repeats, unit::<3, 4>, refine);
    let seconds = median(&mut seconds);
    let mut row = Row {
        case: "needle 3D 2^-7, refine".into(),
        threads: 1,
        ok: true,
        seconds: Some(seconds),
        more: description(&mesh),
        ..Row::default()
    };
    let counts =
        [("leaves", 16758.0), ("vertices", 3135.0), ("shapes", 3.0), ("min_angle_deg", 45.0), ("max_angle_deg", 120.0)];
    expect(&mut row, &counts);
    report.rows.push(row);
    report.figures.push(Figure::at_most("needle 3D 2^-7, refine: ms", 1e3 * seconds, 4.0));

    let start = unit::<3, 4>();
    let coarsen = |mesh: &mut SimplexMesh<3, 4>| mesh.coarsen_everywhere(&mut MeshChange::default());
    let (mut seconds, coarse, _) = times(repeats, || mesh.clone(), coarsen);
    let seconds = median(&mut seconds);
    let same = coarse.cells().eq(start.cells())
        && start.cells().all(|c| coarse.cell(c) == start.cell(c))
        && start.vertices().all(|v| coarse.is_vertex(v) && coarse.point(v) == start.point(v));
    let mut row = Row {
        case: "needle 3D 2^-7, coarsen".into(),
        threads: 1,
        ok: same,
        seconds: Some(seconds),
        // What was made stays reserved: bytes per leaf would say nothing.
        more: description(&coarse).into_iter().filter(|(name, _)| *name != "bytes_per_leaf").collect(),
        note: if same { String::new() } else { "not the start mesh".into() },
        ..Row::default()
    };
    if same {
        expect(&mut row, &[("leaves", 6.0), ("vertices", 8.0)]);
    }
    report.rows.push(row);
    report.figures.push(Figure::at_most("needle 3D 2^-7, coarsen: ms", 1e3 * seconds, 5.0));
    sweep(report, size);
}

/// A segment 20 sizes long that advances by its size 64 times: at each step the leaves must be those from scratch.
fn sweep(report: &mut Report, size: f64) {
    let [a, b] = NEEDLE;
    let length = (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt();
    let at = |steps: usize| {
        let t = (steps as f64 * size / length).min(1.0);
        std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
    };
    let (mut mesh, mut sweep, mut change) = (unit::<3, 4>(), Sweep::new(size), MeshChange::default());
    let (mut seconds, mut same) = (Vec::new(), 0);
    for step in 0..64 {
        let (tail, tip) = (at(step), at(step + 20));
        change.clear();
        let since = Instant::now();
        let outcome = sweep.follow(&mut mesh, tail, tip, &mut change);
        // The first step brings the whole segment.
        if step > 0 {
            seconds.push(since.elapsed().as_secs_f64());
        }
        let mut scratch = unit::<3, 4>();
        let again = scratch.refine_along(tail, tip, size, &mut MeshChange::default());
        same += usize::from(outcome.is_ok() && again.is_ok() && leaf_set(&mesh) == leaf_set(&scratch));
    }
    let seconds = median(&mut seconds);
    report.rows.push(Row {
        case: "needle step of 2^-7".into(),
        threads: 1,
        ok: same == 64,
        seconds: Some(seconds),
        more: Numbers::from([("steps", 64.0), ("as_from_scratch", same as f64)]),
        note: if same == 64 { String::new() } else { "leaves differ from those from scratch".into() },
        ..Row::default()
    });
    report.figures.push(Figure::at_most("needle step of 2^-7: ms", 1e3 * seconds, 0.2));
}

/// The leaves as sorted lists of the bits of their corners.
fn leaf_set(mesh: &SimplexMesh<3, 4>) -> Vec<[[u64; 3]; 4]> {
    let mut cells: Vec<[[u64; 3]; 4]> = mesh
        .cells()
        .map(|c| {
            let mut corners = mesh.corners(c).map(|p| p.map(|x| (x + 0.0).to_bits()));
            corners.sort_unstable();
            corners
        })
        .collect();
    cells.sort_unstable();
    cells
}
