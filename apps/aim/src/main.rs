//! An example of an app on the framework, on its public interface alone: how far from its target does a needle end?
//!
//! ```text
//! cargo run --release -p stylet-aim -- out/aim
//! ```
//!
//! A block of tissue of 10 cm, of 15 kPa with a stiffer lump of 60 kPa in it, held at its back and sides. Four needles are
//! aimed straight at a point in the lump, 6 cm deep, pushed until their tip is as deep as the target was, and held until all is
//! at rest. The target has moved by then, and the tip was bent: the table and the picture show by how much. A bevel tip that
//! spins while it is pushed goes straight on the whole; steel is bent by neither.

use std::error::Error;
use std::path::PathBuf;
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{SimplexMesh, VertexId};
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::coupling::CoupledSettings;
use stylet_physics::insertion::{BaseMotion, Insertion, NeedleSettings, UniformInteraction};
use stylet_physics::material::FixedCorotated;
use stylet_physics::rod::RodStiffness;
use stylet_plot::{Chart, Series, Style};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// Side of the block, m; cells along it.
const SIDE: f64 = 0.1;
const CELLS: usize = 10;
/// Where the needles are aimed at, m, in the undeformed block.
const TARGET: [f64; 3] = [0.06, 0.05, 0.05];
/// Step, s, and speed of the needle, m/s.
const DT: f64 = 0.02;
const SPEED: f64 = 0.02;

type Tissue = Insertion<FixedCorotated>;

/// A needle, and how it is turned while it is pushed.
#[derive(Clone, Copy)]
struct Trial {
    name: &'static str,
    stiffness: RodStiffness,
    linear_density: f64,
    bevel: f64,
    /// rad/s
    spin: f64,
}

/// How a trial ended, m and N.
struct Outcome {
    path: Vec<(f64, f64)>,
    tip: [f64; 3],
    target: [f64; 3],
    force: f64,
    steps: usize,
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "out/aim".into()));
    std::fs::create_dir_all(&folder)?;
    println!("{:<28}{:>14}{:>14}{:>14}{:>10}", "needle", "error (mm)", "target (mm)", "bent (mm)", "base (N)");
    let mut series = Vec::new();
    for trial in trials()? {
        let outcome = run(&trial)?;
        let error = distance(&outcome.tip, &outcome.target);
        let moved = distance(&outcome.target, &TARGET);
        let bent = (outcome.tip[1] - TARGET[1]).hypot(outcome.tip[2] - TARGET[2]);
        println!(
            "{:<28}{:>14.2}{:>14.2}{:>14.2}{:>10.2}",
            trial.name,
            1e3 * error,
            1e3 * moved,
            1e3 * bent,
            outcome.force
        );
        eprintln!("  {} steps of {} ms", outcome.steps, 1e3 * DT);
        series.push(Series {
            name: trial.name.into(),
            points: outcome.path,
            style: Style::Line,
            dashed: false,
            colour: None,
        });
    }
    let aim = Series {
        name: "aimed at".into(),
        points: vec![(1e3 * TARGET[0], 0.0)],
        style: Style::Points,
        dashed: false,
        colour: None,
    };
    let chart = Chart {
        title: "Where the tips went".into(),
        x_label: "depth (mm)".into(),
        y_label: "off the line (mm)".into(),
        series: series.into_iter().chain([aim]).collect(),
        ..Chart::default()
    };
    chart.write(folder.join("paths.svg"))?;
    println!("paths: {}", folder.join("paths.svg").display());
    Ok(())
}

fn trials() -> Result<Vec<Trial>, Box<dyn Error>> {
    let (nitinol, steel) = (60e9, 200e9);
    let disc = |diameter: f64| std::f64::consts::FRAC_PI_4 * diameter * diameter;
    let wire = |name, diameter: f64, spin| -> Result<Trial, Box<dyn Error>> {
        let stiffness = RodStiffness::round(nitinol, 0.33, diameter)?;
        Ok(Trial { name, stiffness, linear_density: 6450.0 * disc(diameter), bevel: 5.0_f64.to_radians(), spin })
    };
    let (outer, inner) = (1.27e-3, 0.838e-3);
    let tube = Trial {
        name: "steel tube 18 G",
        stiffness: RodStiffness::tube(steel, 0.3, outer, inner)?,
        linear_density: 7900.0 * (disc(outer) - disc(inner)),
        bevel: 5.0_f64.to_radians(),
        spin: 0.0,
    };
    Ok(vec![
        wire("nitinol wire 0.83 mm", 0.83e-3, 0.0)?,
        wire("the same, spun", 0.83e-3, 4.0 * std::f64::consts::PI)?,
        Trial { name: "steel tube 18 G", ..tube },
        Trial { name: "the same, symmetric tip", bevel: 0.0, ..tube },
    ])
}

fn run(trial: &Trial) -> Result<Outcome, Box<dyn Error>> {
    let mut tissue = tissue()?;
    let base = [-0.102, TARGET[1], TARGET[2]];
    let wire = NeedleSettings::nitinol(base, [1.0, 0.0, 0.0])?;
    let needle = NeedleSettings {
        stiffness: trial.stiffness,
        linear_density: trial.linear_density,
        bevel: trial.bevel,
        damping: 1e-4,
        ..wire
    };
    tissue.add_needle(needle)?;
    let (mut path, mut steps) = (Vec::new(), 0);
    let push = BaseMotion { insert: SPEED, spin: trial.spin, ..BaseMotion::default() };
    while tissue.needles()[0].shaft.tip()[0] < TARGET[0] && steps < 1000 {
        tissue.step(&[push], DT)?;
        steps += 1;
        let tip = tissue.needles()[0].shaft.tip();
        if tissue.needles()[0].is_inside() {
            path.push((1e3 * tip[0], 1e3 * (tip[2] - TARGET[2])));
        }
    }
    let force = tissue.needles()[0].base_force[0];
    for _ in 0..100 {
        tissue.step(&[BaseMotion::default()], DT)?;
        steps += 1;
    }
    // The mesh has changed on the way: the target is a place of the undeformed block.
    let at = tissue.mesh().locate(TARGET).ok_or("the target is not in the block")?;
    let target = weigh(&tissue, &tissue.mesh().cell(at.cell), &at.barycentric);
    Ok(Outcome { path, tip: tissue.needles()[0].shaft.tip(), target, force, steps })
}

/// The block, at rest.
fn tissue() -> Result<Tissue, Box<dyn Error>> {
    let mesh = block()?;
    let laws =
        [(0, FixedCorotated::from_young_poisson(15e3, 0.45)?), (1, FixedCorotated::from_young_poisson(60e3, 0.45)?)];
    let mut body = Body::with_materials(&mesh, &laws, 1.0)?;
    body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0))?;
    let mut held = Subspace::new(mesh.n_vertex_slots());
    for vertex in mesh.vertices() {
        let x = mesh.point(vertex);
        if x[0] > SIDE - 1e-9 || (1..3).any(|k| x[k] < 1e-9 || x[k] > SIDE - 1e-9) {
            held.set(vertex.index(), Constraint::Fixed)?;
        }
    }
    let mut settings = CoupledSettings::new(DT, 0.2 * SIDE / CELLS as f64);
    settings.dynamics.damping.stiffness = 0.01;
    let forces = UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.5 };
    let team = Team::new(2);
    body.set_team(&team);
    Ok(Insertion::new(mesh, body, held, settings, forces, [0.0; 3], &team)?)
}

/// Cubes of six tetrahedra; those near the target are of another region.
fn block() -> Result<SimplexMesh<3, 4>, Box<dyn Error>> {
    let plain = kuhn_box::<3, 4>([0.0; 3], [SIDE; 3], [CELLS; 3])?;
    let cells: Vec<[u32; 4]> = plain.cells().map(|cell| plain.cell(cell).map(|v| v.0)).collect();
    let region = |cell: &[u32; 4]| {
        let middle: [f64; 3] =
            std::array::from_fn(|k| cell.iter().map(|&v| plain.points()[v as usize][k]).sum::<f64>() / 4.0);
        u32::from(distance(&middle, &TARGET) < 0.02)
    };
    let regions: Vec<u32> = cells.iter().map(region).collect();
    Ok(SimplexMesh::with_regions(plain.points().to_vec(), cells, regions)?)
}

/// The place of a weighted mean of vertices in the deformed tissue.
fn weigh(tissue: &Tissue, vertices: &[VertexId; 4], weights: &[f64; 4]) -> [f64; 3] {
    let u = &tissue.state().u;
    let place = |k: usize, i: usize| tissue.mesh().point(vertices[i])[k] + u[3 * vertices[i].index() + k];
    std::array::from_fn(|k| (0..4).map(|i| weights[i] * place(k, i)).sum())
}

fn distance(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
}
