//! Drives needles through the built-in bodies as the scenes of flexible needles do, without forces: only the remesher and
//! paths like theirs. Prints the extreme angles of what the needles changed, once they have been inside for twenty steps.
//!
//! ```text
//! cargo run --release -p stylet-anatomy --example needle_angles -- [paths of each body] [first seed]
//! ```
//!
//! In the environment, `WORST=1` tells of each path that leaves the published angles what its worst cell is; `ONLY` is part of
//! the name of the bodies to be taken.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Instant;
use stylet_anatomy::plan::{Effort, Plan, built_in};
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::random::SplitMix64;
use stylet_mesh::remesh::{Motion, NeedleId, Outcome, Remesher};
use stylet_mesh::{CellId, MeshChange, SimplexMesh, VertexId, quality};

/// Smallest and largest angle of Chentanez et al. (2009), degrees.
const PUBLISHED: (f64, f64) = (10.3, 160.0);
/// Steps that do not count.
const SHALLOW: usize = 20;
/// Distance from the sides of a body that needles keep, mean edges.
const CLEAR: f64 = 0.5;

/// A body and how needles go into it, along the first axis.
struct Case {
    name: &'static str,
    mesh: SimplexMesh<3, 4>,
    /// Where the needle of the scene goes in, and how far from there others do, m.
    entry: [f64; 2],
    aside: f64,
    step: f64,
    depth: f64,
    /// Of the path at most, 1/m.
    curvature: f64,
}

fn body(name: &str) -> Result<SimplexMesh<3, 4>, Box<dyn std::error::Error>> {
    let shapes = built_in(name).ok_or("no such body")??;
    let made = Plan::of_shapes(&shapes).mesh(&Effort::default(), &mut |_| ControlFlow::Continue(()))?;
    Ok(made.tets.into_mesh()?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1).map(|arg| arg.parse::<u64>());
    let n = args.next().transpose()?.unwrap_or(50);
    let first = args.next().transpose()?.unwrap_or(0);
    let (prostate, cylinders, gel) = (body("prostate")?, body("two-cylinders")?, body("gel-block")?);
    let cube = kuhn_box::<3, 4>([0.0; 3], [0.1; 3], [5; 3])?;
    let case = |name, mesh: &SimplexMesh<3, 4>, entry, aside, step, depth, curvature| Case {
        name,
        mesh: mesh.clone(),
        entry,
        aside,
        step,
        depth,
        curvature,
    };
    let cases = [
        case("prostate-flexible", &prostate, [-0.0075, -0.012], 0.002, 4e-4, 0.062, 4.0),
        case("prostate-flexible-vigorous", &prostate, [-0.0075, 0.003], 0.002, 1.2e-3, 0.062, 4.0),
        case("prostate-stiff", &prostate, [-0.0075, 0.001], 0.002, 4e-4, 0.062, 0.0),
        case("prostate, anywhere", &prostate, [0.0, 0.0], 0.025, 4e-4, 0.062, 4.0),
        case("two-cylinders", &cylinders, [0.0, 0.0], 0.002, 4e-4, 0.1, 3.0),
        case("two-cylinders, anywhere", &cylinders, [0.0, 0.0], 0.01, 4e-4, 0.1, 3.0),
        case("gel-single-bend", &gel, [0.1325, 0.0195], 0.002, 5e-4, 0.13, 2.0),
        case("gel-vigorous", &gel, [0.1325, 0.0195], 0.002, 2e-3, 0.1, 2.0),
        case("two-needles", &gel, [0.0825, 0.0195], 0.002, 5e-4, 0.06, 2.0),
        case("gel, anywhere", &gel, [0.1325, 0.0195], 0.01, 5e-4, 0.1, 2.0),
        case("a cube (J6)", &cube, [0.05, 0.05], 0.025, 4e-3, 0.06, 3.0),
    ];
    let only = std::env::var("ONLY").unwrap_or_default();
    for case in cases.iter().filter(|case| case.name.contains(&only)) {
        let mut seen = Seen::new();
        for seed in first..first + n {
            run(case, seed, &mut seen);
        }
        seen.print(case.name);
    }
    Ok(())
}

/// What the paths of a case have shown.
struct Seen {
    angles: (f64, f64),
    /// Of cells that are worse than those of the start in their place.
    worse: (f64, f64),
    steps: usize,
    outside: usize,
    advances: usize,
    seconds: f64,
    extremes: Vec<(f64, f64, u64)>,
    failed: usize,
    changed: usize,
}

impl Seen {
    fn new() -> Self {
        let none = (180.0, 0.0);
        Self {
            angles: none,
            worse: none,
            steps: 0,
            outside: 0,
            advances: 0,
            seconds: 0.0,
            extremes: Vec::new(),
            failed: 0,
            changed: 0,
        }
    }

    fn print(&mut self, name: &str) {
        let outside = self.extremes.iter().filter(|e| e.0 < PUBLISHED.0 || e.1 > PUBLISHED.1).count();
        println!(
            "{name}: {:.2} to {:.2} deg, of worse cells {:.2} to {:.2}; {:.2} % of steps and {outside} of {} paths outside; \
             {:.1} us per advance, {} failed, {} not restored",
            self.angles.0,
            self.angles.1,
            self.worse.0,
            self.worse.1,
            100.0 * self.outside as f64 / self.steps as f64,
            self.extremes.len(),
            1e6 * self.seconds / self.advances as f64,
            self.failed,
            self.changed,
        );
        self.extremes.sort_by(|a, b| a.0.total_cmp(&b.0));
        println!("    least: {:.1?}", self.extremes.iter().take(5).collect::<Vec<_>>());
        self.extremes.sort_by(|a, b| b.1.total_cmp(&a.1));
        println!("    most:  {:.1?}", self.extremes.iter().take(5).collect::<Vec<_>>());
    }
}

fn run(case: &Case, seed: u64, seen: &mut Seen) {
    let (mut mesh, mut remesher, start) = (case.mesh.clone(), Remesher::new(), &case.mesh);
    let mut random = SplitMix64::new(seed);
    let entry = case.entry.map(|x| x + case.aside * (2.0 * random.unit() - 1.0));
    let lowest = start.points().iter().map(|x| x[0]).fold(f64::INFINITY, f64::min);
    let mut tip = [lowest - 1e-5, entry[0], entry[1]];
    let (turn, curvature) = (std::f64::consts::TAU * random.unit(), case.curvature * random.unit());
    let slope = [0.05, 0.05].map(|most: f64| most * (2.0 * random.unit() - 1.0));
    let needle = remesher.add_needle(&mesh, tip).expect("a tip outside");
    let mut extremes = (180.0_f64, 0.0_f64, String::new());
    let edge = mean_edge(start);
    let sides = sides(start, edge);
    let n_steps = (case.depth / case.step) as usize;
    let (mut shallow, mut inside) = (f64::INFINITY, 0);
    let mut advance = |remesher: &mut Remesher<3, 4>, mesh: &mut SimplexMesh<3, 4>, to, motion| {
        let since = Instant::now();
        let done = remesher.advance(mesh, needle, to, motion, &mut MeshChange::default());
        seen.seconds += since.elapsed().as_secs_f64();
        seen.advances += 1;
        done
    };
    let mut look = |remesher: &Remesher<3, 4>, mesh: &SimplexMesh<3, 4>, what: &str| {
        let (all, worse, text) = angles(case, mesh, remesher, needle, what);
        seen.angles = (seen.angles.0.min(all.0), seen.angles.1.max(all.1));
        seen.worse = (seen.worse.0.min(worse.0), seen.worse.1.max(worse.1));
        seen.steps += 1;
        seen.outside += usize::from(worse.0 < PUBLISHED.0 || worse.1 > PUBLISHED.1);
        if worse.0 < extremes.0 {
            extremes.2 = text;
        }
        (extremes.0, extremes.1) = (extremes.0.min(worse.0), extremes.1.max(worse.1));
    };
    for i in 0..n_steps {
        let way = i as f64 * case.step;
        let mut heading = [1.0, slope[0] + curvature * way * turn.cos(), slope[1] + curvature * way * turn.sin()];
        let norm = heading.iter().map(|x| x * x).sum::<f64>().sqrt();
        heading = heading.map(|x| x / norm);
        // A tip in deforming tissue trembles.
        let noise: [f64; 3] = std::array::from_fn(|_| 0.05 * (2.0 * random.unit() - 1.0));
        let to = std::array::from_fn(|k| tip[k] + case.step * (heading[k] + noise[k]));
        if (1..3).any(|k| to[k] < sides[0][k] || to[k] > sides[1][k]) {
            break;
        }
        match advance(&mut remesher, &mut mesh, to, Motion::Penetrating) {
            Ok(report) if report.outcome == Outcome::Inside => inside += 1,
            Ok(report) if report.outcome == Outcome::Beyond => break,
            Ok(_) => {}
            Err(error) => {
                println!("    {} {seed} in {i}: {error}", case.name);
                seen.failed += 1;
                break;
            }
        }
        tip = to;
        if inside > SHALLOW || case.name.contains("J6") && tip[0] > lowest + 0.02 {
            shallow = shallow.min(tip[0]).min(lowest + edge);
            look(&remesher, &mesh, &format!("in {i}"));
        }
    }
    for i in 0..2 * n_steps {
        let Some(to) = behind(&mesh, &remesher, needle, case.step) else { break };
        if let Err(error) = advance(&mut remesher, &mut mesh, to, Motion::Retracting) {
            println!("    {} {seed} out {i}: {error}", case.name);
            seen.failed += 1;
            break;
        }
        if remesher.nodes(needle).len() > 0 && to[0] > shallow {
            look(&remesher, &mesh, &format!("out {i}"));
        }
    }
    remesher.withdraw(&mut mesh, needle, &mut MeshChange::default()).expect("a needle alone comes out");
    let same =
        mesh.points() == start.points() && mesh.cells().all(|c| start.is_live(c) && start.cell(c) == mesh.cell(c));
    seen.changed += usize::from(!same || mesh.n_cells() != start.n_cells());
    if std::env::var_os("WORST").is_some() && (extremes.0 < PUBLISHED.0 || extremes.1 > PUBLISHED.1) {
        println!("    {} {seed}: {:.2} {:.2}: {}", case.name, extremes.0, extremes.1, extremes.2);
    }
    seen.extremes.push((extremes.0, extremes.1, seed));
}

/// The edge of a regular tetrahedron of the mean volume.
fn mean_edge(mesh: &SimplexMesh<3, 4>) -> f64 {
    (6.0 * std::f64::consts::SQRT_2 * mesh.total_volume() / mesh.n_cells() as f64).cbrt()
}

/// A box around what is not close to the skin: needles turn back at its sides, since close to the skin cells cannot but be flat.
fn sides(mesh: &SimplexMesh<3, 4>, edge: f64) -> [[f64; 3]; 2] {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for x in mesh.points() {
        for k in 0..3 {
            low[k] = low[k].min(x[k] + CLEAR * edge);
            high[k] = high[k].max(x[k] - CLEAR * edge);
        }
    }
    [low, high]
}

/// The point of the channel at a distance behind the tip.
fn behind(mesh: &SimplexMesh<3, 4>, remesher: &Remesher<3, 4>, needle: NeedleId, by: f64) -> Option<[f64; 3]> {
    let nodes: Vec<[f64; 3]> = remesher.nodes(needle).map(|v| mesh.point(v)).collect();
    let mut left = by;
    for pair in nodes.windows(2).rev() {
        let long = (0..3).map(|k| (pair[1][k] - pair[0][k]).powi(2)).sum::<f64>().sqrt();
        if left < long {
            return Some(std::array::from_fn(|k| pair[1][k] + left / long * (pair[0][k] - pair[1][k])));
        }
        left -= long;
    }
    None
}

type Looked = ((f64, f64), (f64, f64), String);

/// The extreme angles of what differs from the start, those of what is worse than that, and what the worst cell is.
fn angles(case: &Case, mesh: &SimplexMesh<3, 4>, remesher: &Remesher<3, 4>, needle: NeedleId, what: &str) -> Looked {
    let start = &case.mesh;
    let (mut all, mut worse) = ((180.0_f64, 0.0_f64), (180.0_f64, 0.0_f64));
    let mut text = String::new();
    for c in mesh.cells() {
        let corners = mesh.corners(c);
        if start.is_live(c) && start.cell(c) == mesh.cell(c) && start.corners(c) == corners {
            continue;
        }
        let angles = quality::angles_deg(&corners);
        all = (all.0.min(angles.0), all.1.max(angles.1));
        let is_good = angles.0 >= PUBLISHED.0 && angles.1 <= PUBLISHED.1;
        let before = if is_good { (180.0, 0.0) } else { before(start, mesh, c) };
        if !is_good && (angles.0 < worse.0.min(before.0) || angles.1 > worse.1.max(before.1)) {
            let cell = tell(mesh, remesher, needle, c);
            text = format!(
                "{what}, {:.2} to {:.2}, before {:.2} to {:.2}: {cell}",
                angles.0, angles.1, before.0, before.1
            );
        }
        if angles.0 < before.0 {
            worse.0 = worse.0.min(angles.0);
        }
        if angles.1 > before.1 {
            worse.1 = worse.1.max(angles.1);
        }
    }
    (all, worse, text)
}

/// The angles of the cell of the start that is where a cell is, or was the same with its vertices in place.
fn before(start: &SimplexMesh<3, 4>, mesh: &SimplexMesh<3, 4>, c: CellId) -> (f64, f64) {
    let corners = mesh.corners(c);
    let middle = std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0);
    let is_same = start.is_live(c) && start.cell(c) == mesh.cell(c);
    let host = if is_same { Some(c) } else { start.locate(middle).map(|found| found.cell) };
    host.map_or((180.0, 0.0), |host| quality::angles_deg(&start.corners(host)))
}

/// What the vertices of a cell are: `n` and the place among the nodes of the needle, `s` on the skin, `r` and the number of
/// regions around.
fn tell(mesh: &SimplexMesh<3, 4>, remesher: &Remesher<3, 4>, needle: NeedleId, c: CellId) -> String {
    let nodes: Vec<VertexId> = remesher.nodes(needle).collect();
    let mut skin = BTreeSet::new();
    for (cell, facet) in mesh.boundary_facets() {
        skin.extend((0..4).filter(|&i| i != facet).map(|i| mesh.cell(cell)[i]));
    }
    let mut star = Vec::new();
    let mut words = Vec::new();
    for v in mesh.cell(c) {
        mesh.star(v, &mut star);
        let regions: BTreeSet<u32> = star.iter().map(|&c| mesh.region(c)).collect();
        let node = nodes.iter().position(|&n| n == v).map_or(String::new(), |at| format!("n{at}/{}", nodes.len()));
        let skin = if skin.contains(&v) { "s" } else { "" };
        words.push(format!("[{} {node} {skin} r{}]", v.0, regions.len()));
    }
    words.join(" ")
}
