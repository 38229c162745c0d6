//! Thousands of insertions and withdrawals (J6).

use super::{FORCES, Watch, scene};
use crate::insertion::setup::{BEVEL, Numerics, Scene, distance, wire};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::time::Instant;
use stylet_mesh::random::SplitMix64;
use stylet_mesh::{SimplexMesh, VertexId};
use stylet_physics::coupling::CouplingNode;
use stylet_physics::insertion::{BaseMotion, Insertion, InsertionError};
use stylet_physics::material::Solid;
use stylet_solver::team::Team;

/// Step, s, speed, m/s, depth, m.
const DT: f64 = 0.02;
const SPEED: f64 = 0.2;
const DEPTH: f64 = 0.06;
/// Steps that the needle is moved sideways outside, and those that it is left alone.
const ASIDE: (u32, u32) = (15, 5);
/// Angles, degrees, from one edge of depth on; those of the 2009 paper are 10.3 and 160.
const ANGLES: (f64, f64) = (8.0, 165.0);
/// Relative change of the volume.
const VOLUME: f64 = 1e-12;

pub(in crate::stability) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let cycles = if options.quick { 5 } else { 1000 };
    for (name, random) in [("J6 one path", false), ("J6 random paths", true)] {
        if options.stopped() {
            return;
        }
        say(&format!("{name}, {cycles} times"));
        let row = row(name, random, cycles, options);
        let restored = row.more.get("restored").copied().unwrap_or(0.0);
        report.figures.push(Figure::at_least(
            format!("{name}: withdrawals that restore the mesh"),
            restored,
            f64::from(cycles),
        ));
        report.rows.push(row);
    }
}

/// What all cycles together have shown.
struct Cycles {
    done: u32,
    restored: u32,
    /// Least and largest angle, degrees.
    angles: (f64, f64),
    volume: f64,
    moved: f64,
    watch: Watch,
}

fn row(name: &str, random: bool, cycles: u32, options: &BenchOptions) -> Row {
    let since = Instant::now();
    let mut seen = Cycles { done: 0, restored: 0, angles: (180.0, 0.0), volume: 0.0, moved: 0.0, watch: Watch::new() };
    let plain = scene(5, 0.45, FORCES, Vec::new());
    let bevel = if random { BEVEL } else { 0.0 };
    let scene = Scene { needle: wire(super::ENTRY, bevel), ..plain };
    let result = scene.start(&Numerics::default(), &Team::new(options.threads)).map_err(|e| e.to_string());
    let result =
        result.and_then(|mut run| all(&mut run, random, cycles, options, &mut seen).map_err(|error| error.to_string()));
    let mut row = Row { case: name.into(), threads: options.threads, ..Row::default() };
    row.seconds = Some(since.elapsed().as_secs_f64());
    row.note = result.err().map_or_else(String::new, |error| format!("cycle {}: {error}", seen.done + 1));
    row.ok = row.note.is_empty()
        && seen.restored == cycles
        && seen.volume <= VOLUME
        && seen.angles.0 >= ANGLES.0
        && seen.angles.1 <= ANGLES.1;
    if !row.ok && row.note.is_empty() {
        row.note =
            format!("angles {:.1} to {:.1}°, {} of {cycles} restored", seen.angles.0, seen.angles.1, seen.restored);
    }
    row.more = Numbers::from([
        ("cycles", f64::from(seen.done)),
        ("restored", f64::from(seen.restored)),
        ("min_deg", seen.angles.0),
        ("max_deg", seen.angles.1),
        ("volume", seen.volume),
        ("moved_mm", 1e3 * seen.moved),
        ("min_j", seen.watch.smallest_j),
        ("unjoined", seen.watch.unjoined as f64),
    ]);
    row
}

fn all(
    run: &mut Insertion<Solid>,
    random: bool,
    cycles: u32,
    options: &BenchOptions,
    seen: &mut Cycles,
) -> Result<(), InsertionError> {
    let start = run.mesh().clone();
    let mut numbers = SplitMix64::new(11);
    for _ in 0..cycles {
        if options.stopped() {
            return Ok(());
        }
        if random {
            aside(run, &mut numbers)?;
        }
        let steps = (DEPTH / SPEED / DT).round() as u32;
        for back in [false, true] {
            for _ in 0..steps + if back { 0 } else { 1 } {
                let insert = if back { -SPEED } else { SPEED };
                one(run, BaseMotion { insert, ..BaseMotion::default() }, seen)?;
            }
        }
        // The skin may have been drawn along: on until the tip is out.
        for _ in 0..steps {
            if !run.needles()[0].is_inside() {
                break;
            }
            one(run, BaseMotion { insert: -SPEED, ..BaseMotion::default() }, seen)?;
        }
        // Back to the length of the start.
        let left = -run.needles()[0].inserted;
        let motion = BaseMotion { insert: left / DT, ..BaseMotion::default() };
        run.step(&[motion], DT)?;
        seen.done += 1;
        seen.restored += u32::from(!run.needles()[0].is_inside() && same_topology(run.mesh(), &start));
        seen.volume = seen.volume.max((volume(run.mesh()) / volume(&start) - 1.0).abs());
        let moved = run.mesh().points().iter().zip(start.points()).map(|(p, q)| distance(p, q));
        seen.moved = seen.moved.max(moved.fold(0.0, f64::max));
    }
    Ok(())
}

/// Moves the sleeve to another place before the same face, and turns it.
fn aside(run: &mut Insertion<Solid>, numbers: &mut SplitMix64) -> Result<(), InsertionError> {
    let at = run.needles()[0].shaft.place(1);
    let seconds = DT * f64::from(ASIDE.0);
    // The middle half of the face.
    let mut aim = || super::SIDE * (0.25 + 0.5 * numbers.unit());
    let (y, z) = (aim(), aim());
    let sleeve = [0.0, (y - at[1]) / seconds, (z - at[2]) / seconds];
    let spin = 2.0 * std::f64::consts::PI * numbers.unit() / seconds;
    for _ in 0..ASIDE.0 {
        run.step(&[BaseMotion { sleeve, spin, insert: 0.0 }], DT)?;
    }
    for _ in 0..ASIDE.1 {
        run.step(&[BaseMotion::default()], DT)?;
    }
    Ok(())
}

fn one(run: &mut Insertion<Solid>, motion: BaseMotion, seen: &mut Cycles) -> Result<(), InsertionError> {
    let step = run.step(&[motion], DT)?;
    seen.watch.look(run, &step);
    let deep = |tip: &CouplingNode| run.mesh().points()[tip.vertex as usize][0] > super::SIDE / 5.0;
    if run.needles()[0].nodes().last().is_some_and(deep) {
        let mesh = run.mesh().clone();
        let (least, most) = run.remesher().angles_deg(&mesh);
        seen.angles = (seen.angles.0.min(least), seen.angles.1.max(most));
    }
    Ok(())
}

/// Whether the same cells have the same vertices.
fn same_topology(mesh: &SimplexMesh<3, 4>, start: &SimplexMesh<3, 4>) -> bool {
    let sets = |mesh: &SimplexMesh<3, 4>| {
        let mut cells: Vec<[VertexId; 4]> = mesh
            .cells()
            .map(|cell| {
                let mut vertices = mesh.cell(cell);
                vertices.sort_unstable();
                vertices
            })
            .collect();
        cells.sort_unstable();
        cells
    };
    mesh.n_vertices() == start.n_vertices() && sets(mesh) == sets(start)
}

fn volume(mesh: &SimplexMesh<3, 4>) -> f64 {
    mesh.cells().map(|cell| stylet_mesh::geometry::signed_measure(&mesh.corners(cell)).abs()).sum()
}
