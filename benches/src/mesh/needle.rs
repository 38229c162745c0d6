//! The needle remesher: thousands of cycles in and out, on three kinds of paths, in two boxes.

use crate::{BenchOptions, Figure, Numbers, Report, Row};
use stylet_mesh::{
    SimplexMesh,
    generate::kuhn_box,
    remesh::{
        CycleSettings, Operations, RemeshError, Remesher, drive,
        paths::{PathKind, path},
    },
};

/// Steps after the skin from which angles count.
const SHALLOW: usize = 20;
/// Part of the mean edge that a step is long.
const STEP: f64 = 0.2;

/// The sums over the cycles of one kind.
#[derive(Default)]
struct Sums {
    cycles: usize,
    steps: usize,
    deep: usize,
    /// Deep steps with an angle below 8 or above 165 degrees.
    narrow: usize,
    seconds: f64,
    angles: Option<(f64, f64)>,
    restored: usize,
    position_error: f64,
    operations: Operations,
}

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    // Ten thousand in all.
    let cycles = if options.quick { 20 } else { 1_667 };
    for parts in [7, 13] {
        for kind in [PathKind::Straight, PathKind::Curved, PathKind::Random] {
            if options.stopped() {
                return;
            }
            let case = format!("needle {kind:?}, {} tets", 6 * parts * parts * parts).to_lowercase();
            say(&case);
            cycle_row(options, say, report, case, kind, parts, cycles);
        }
    }
}

/// The mean edge of the unit cube in `parts` parts per axis: per vertex 3 edges, 3 diagonals of faces, 1 of the part.
fn mean_edge(parts: usize) -> f64 {
    (3.0 + 3.0 * 2_f64.sqrt() + 3_f64.sqrt()) / 7.0 / parts as f64
}

fn cycle_row(
    options: &BenchOptions,
    say: &mut dyn FnMut(&str),
    report: &mut Report,
    case: String,
    kind: PathKind,
    parts: usize,
    cycles: usize,
) {
    let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [parts; 3]).expect("a box");
    let slots = mesh.n_slots();
    let mut sums = Sums::default();
    let mut trouble = String::new();
    for seed in 0..cycles as u64 {
        if options.stopped() {
            break;
        }
        if seed > 0 && seed.is_multiple_of(1000) {
            say(&format!("{case}: {seed} cycles"));
        }
        if let Err(error) = one(&mut mesh, kind, parts, seed, &mut sums) {
            trouble = format!("cycle {seed}: {error}");
            break;
        }
    }
    let sound = mesh.check_invariants();
    let restored = sums.restored == sums.cycles && sums.position_error <= 1e-12;
    if trouble.is_empty() && !restored {
        trouble = format!("{} of {} cycles restored the mesh", sums.restored, sums.cycles);
    }
    if let (true, Err(error)) = (trouble.is_empty(), sound) {
        trouble = error.to_string();
    }
    let (min, max) = sums.angles.unwrap_or((f64::NAN, f64::NAN));
    let each = sums.seconds / sums.steps as f64;
    let narrow = 100.0 * sums.narrow as f64 / sums.deep as f64;
    report.figures.push(Figure::at_most(format!("{case}: us a step"), 1e6 * each, 50.0));
    if parts < 13 {
        report.figures.push(Figure::plain(format!("{case}: % of steps outside 8 to 165 deg"), narrow));
    } else if kind == PathKind::Random {
        report.figures.push(Figure::at_most(format!("{case}: % of steps outside 8 to 165 deg"), narrow, 0.1));
    } else {
        report.figures.push(Figure::at_least(format!("{case}: smallest angle, deg"), min, 10.3));
        report.figures.push(Figure::at_most(format!("{case}: largest angle, deg"), max, 160.0));
    }
    let [snaps, edges, faces, cells, ..] = sums.operations.on_faces.map(f64::from);
    report.rows.push(Row {
        case,
        threads: 1,
        ok: trouble.is_empty(),
        seconds: Some(each),
        error: Numbers::from([("position", sums.position_error)]),
        more: Numbers::from([
            ("cycles", sums.cycles as f64),
            ("steps", sums.steps as f64),
            ("restored", sums.restored as f64),
            ("min_angle_deg", min),
            ("max_angle_deg", max),
            ("outside_8_165_%", narrow),
            ("snaps", snaps),
            ("edge_splits", edges),
            ("face_splits", faces),
            ("tet_splits", cells),
            ("undone", f64::from(sums.operations.undone)),
            ("slots_grown", (mesh.n_slots() - slots) as f64),
        ]),
        note: trouble,
        ..Row::default()
    });
}

fn one(
    mesh: &mut SimplexMesh<3, 4>,
    kind: PathKind,
    parts: usize,
    seed: u64,
    sums: &mut Sums,
) -> Result<(), RemeshError> {
    let edge = mean_edge(parts);
    let path = path(kind, [0.0; 3], [1.0; 3], edge, seed);
    let settings = CycleSettings { step: STEP * edge, measure_angles: true, shallow_steps: SHALLOW + 1 };
    let (mut deep, mut narrow) = (0, 0);
    let report = drive(mesh, &mut Remesher::new(), &path, &settings, |step, _, _, _, _| {
        if step.depth > SHALLOW {
            deep += 1;
            narrow += usize::from(step.min_angle_deg < 8.0 || step.max_angle_deg > 165.0);
        }
    })?;
    let (min, max) = sums.angles.unwrap_or((180.0, 0.0));
    sums.angles = Some((min.min(report.min_angle_deg), max.max(report.max_angle_deg)));
    sums.cycles += 1;
    sums.steps += report.steps;
    sums.deep += deep;
    sums.narrow += narrow;
    sums.seconds += report.seconds;
    sums.restored += usize::from(report.topology_restored);
    sums.position_error = sums.position_error.max(report.max_position_error);
    sums.operations.add(&report.operations);
    Ok(())
}
