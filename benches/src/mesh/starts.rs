//! Random Delaunay start meshes with random marks: conforming, of the same volume, back to the start, no hang.

use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::time::Instant;
use stylet_mesh::{CellId, MeshChange, SimplexMesh, generate::random_delaunay};

/// Rounds of random marks on each mesh.
const ROUNDS: u64 = 4;

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let seeds = if options.quick { 10 } else { 1_000 };
    case::<2, 3>(options, say, report, 40, seeds);
    case::<3, 4>(options, say, report, 30, seeds);
    case::<4, 5>(options, say, report, 12, seeds);
}

fn case<const D: usize, const N: usize>(
    options: &BenchOptions,
    say: &mut dyn FnMut(&str),
    report: &mut Report,
    points: usize,
    seeds: u64,
) {
    let case = format!("random start meshes {D}D");
    say(&case);
    let since = Instant::now();
    let (mut done, mut leaves, mut worst, mut trouble) = (0, 0, 0.0_f64, String::new());
    for seed in 0..seeds {
        if options.stopped() {
            break;
        }
        match one::<D, N>(points, seed) {
            Ok((n, error)) => (done, leaves, worst) = (done + 1, leaves + n, worst.max(error)),
            Err(error) => trouble = format!("seed {seed}: {error}"),
        }
    }
    report.figures.push(Figure::at_most(format!("{case}: seeds that failed"), (seeds - done) as f64, 0.0));
    report.rows.push(Row {
        case,
        threads: 1,
        ok: trouble.is_empty(),
        seconds: Some(since.elapsed().as_secs_f64()),
        error: Numbers::from([("volume", worst)]),
        more: Numbers::from([("seeds", done as f64), ("leaves", leaves as f64)]),
        note: trouble,
        ..Row::default()
    });
}

/// The leaves after the marks, and the relative error of their volume.
fn one<const D: usize, const N: usize>(points: usize, seed: u64) -> Result<(usize, f64), String> {
    let start = random_delaunay::<D, N>(points, seed).map_err(|e| e.to_string())?;
    let mut mesh: SimplexMesh<D, N> = start.clone();
    for round in 0..ROUNDS {
        // One cell in sixteen, by a multiplicative hash of its id.
        let hash = |c: &CellId| (u64::from(c.0) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15 ^ (seed << 8) ^ round) >> 60;
        let marked: Vec<CellId> = mesh.cells().filter(|c| hash(c) == 0).collect();
        mesh.bisect(&marked, &mut MeshChange::default()).map_err(|e| e.to_string())?;
    }
    mesh.check_invariants().map_err(|e| e.to_string())?;
    let (leaves, volume) = (mesh.n_cells(), mesh.total_volume());
    let error = (volume - start.total_volume()).abs() / start.total_volume();
    if error > 1e-12 {
        return Err(format!("the volume changed by {error:e} of itself"));
    }
    mesh.coarsen_everywhere(&mut MeshChange::default());
    let same = mesh.cells().eq(start.cells()) && start.cells().all(|c| mesh.cell(c) == start.cell(c));
    let same = same && start.vertices().all(|v| mesh.point(v) == start.point(v));
    if same { Ok((leaves, error)) } else { Err("coarsening does not lead back to the start mesh".into()) }
}
