//! Location of random points in uniformly refined meshes, and in start meshes of the same size.

use super::times;
use crate::timing::median;
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use stylet_mesh::random::SplitMix64;
use stylet_mesh::{MeshChange, SimplexMesh, generate::kuhn_box};

const POINTS: usize = 200_000;

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let repeats = if options.quick { 1 } else { 11 };
    let refined_2d = refined::<2, 3>(18);
    let refined_3d = refined::<3, 4>(15);
    say("524,288 triangles");
    case(report, "locate 2D, refined from 2", &refined_2d, repeats, Some(0.3));
    say("196,608 tetrahedra");
    case(report, "locate 3D, refined from 6", &refined_3d, repeats, Some(0.5));
    say("start meshes");
    let start_2d = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [512; 2]).expect("a box");
    let start_3d = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [32; 3]).expect("a box");
    case(report, "locate 2D, start mesh", &start_2d, repeats, None);
    case(report, "locate 3D, start mesh", &start_3d, repeats, None);
}

fn refined<const D: usize, const N: usize>(rounds: usize) -> SimplexMesh<D, N> {
    let mut mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D]).expect("a unit box");
    for _ in 0..rounds {
        let all: Vec<_> = mesh.cells().collect();
        mesh.bisect(&all, &mut MeshChange::default()).expect("room");
    }
    mesh
}

fn case<const D: usize, const N: usize>(
    report: &mut Report,
    case: &str,
    mesh: &SimplexMesh<D, N>,
    repeats: usize,
    most_us: Option<f64>,
) {
    let points = points::<D>();
    let (mut seconds, (), missed) =
        times(repeats, || (), |()| points.iter().filter(|&&p| mesh.locate(p).is_none()).count());
    row(report, case, "locate", mesh.n_cells(), median(&mut seconds), missed, 0.0);
    // A snapshot of the forest for many points, and what it takes to make.
    let (mut build, (), _) =
        times(repeats, || (), |()| std::hint::black_box(mesh.locator()).locate(points[0]).is_some());
    let locator = mesh.locator();
    let (mut seconds, (), missed) =
        times(repeats, || (), |()| points.iter().filter(|&&p| locator.locate(p).is_none()).count());
    let seconds = median(&mut seconds);
    row(report, case, "locator", mesh.n_cells(), seconds, missed, median(&mut build));
    let (name, us) = (format!("{case}, locator: us a point"), 1e6 * seconds / POINTS as f64);
    report.figures.push(match most_us {
        Some(most) => Figure::at_most(name, us, most),
        None => Figure::plain(name, us),
    });
}

fn row(report: &mut Report, case: &str, method: &str, cells: usize, seconds: f64, missed: usize, build: f64) {
    let each = seconds / POINTS as f64;
    let more = Numbers::from([
        ("cells", cells as f64),
        ("points", POINTS as f64),
        ("missed", missed as f64),
        ("us_each", 1e6 * each),
        ("build_ms", 1e3 * build),
    ]);
    report.rows.push(Row {
        case: case.into(),
        method: method.into(),
        threads: 1,
        ok: missed == 0,
        seconds: Some(each),
        more,
        note: if missed == 0 { String::new() } else { format!("{missed} points not found") },
        ..Row::default()
    });
}

/// Random points in the unit box, the same on every run.
fn points<const D: usize>() -> Vec<[f64; D]> {
    let mut random = SplitMix64::new(1);
    (0..POINTS).map(|_| std::array::from_fn(|_| random.unit())).collect()
}
