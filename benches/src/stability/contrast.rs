//! Bone bonded to fat: two layers, one a hundred thousand times stiffer.

use super::{DENSITY, POISSON, SIDE, largest};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::time::Instant;
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{CellId, SimplexMesh};
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::material::Solid;
use stylet_physics::statics::{StaticMethod, StaticSettings, StaticWorkspace, solve_static};
use stylet_solver::energy::Energy;
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// Young's moduli by region, Pa.
const LAYERS: [(u32, f64); 2] = [(1, 1e9), (2, 1e4)];
/// m/s², sideways.
const GRAVITY: [f64; 3] = [9.81, 0.0, 0.0];
const TOLERANCE: f64 = 1e-6;

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let cells = if options.quick { 4 } else { 8 };
    let mut most: f64 = 0.0;
    for poisson in POISSON {
        for model in Solid::MODELS {
            if options.stopped() {
                return;
            }
            say(&format!("J4 bone and fat, {model}, ν {poisson}"));
            let row = row(model, poisson, cells, options.threads);
            most = most.max(row.more.get("bone_over_fat").copied().unwrap_or(0.0));
            report.rows.push(row);
        }
    }
    let name = "J4: most displacement of bone over that of fat, runs that converge";
    report.figures.push(Figure::at_most(name, most, 1e-4));
}

fn row(model: &str, poisson: f64, cells: usize, threads: usize) -> Row {
    let mut row = Row {
        case: format!("J4 bone and fat, {model}, ν {poisson}"),
        tolerance: Some(TOLERANCE),
        threads,
        ..Row::default()
    };
    let solids = LAYERS
        .map(|(region, young)| (region, Solid::from_young_poisson(model, young, poisson).expect("a law of the list")));
    let mesh = layers(cells);
    let mut body = Body::with_materials(&mesh, &solids, 1.0).expect("a law for each region");
    body.set_mass(MassKind::Lumped, &Density::Uniform(DENSITY)).expect("a density");
    let mut held = Subspace::new(body.n_vertices());
    for (vertex, _) in mesh.points().iter().enumerate().filter(|(_, x)| x[2] < 1e-9 * SIDE) {
        held.set(vertex, Constraint::Fixed).expect("a vertex of the mesh");
    }
    let (mut load, mut u) = (vec![0.0; body.dim()], vec![0.0; body.dim()]);
    body.add_gravity(&GRAVITY, &mut load);
    let stop = StopRule { tolerance: TOLERANCE, criterion: Criterion::External, round_floor: 0.0 };
    let settings = StaticSettings::new(StaticMethod::NewtonCg, stop);
    let since = Instant::now();
    let mut workspace = StaticWorkspace::on(&Team::new(threads));
    let solved = solve_static(&mut body, &held, &load, &mut u, &settings, &mut workspace);
    row.seconds = Some(since.elapsed().as_secs_f64());
    match solved {
        Err(error) => row.note = error.to_string(),
        Ok(solved) => {
            row.ok = true;
            row.iterations = Some(solved.iterations as u64);
            let of = |wanted: fn(f64) -> bool| {
                let moved = mesh.points().iter().zip(u.as_chunks::<3>().0).filter(|(x, _)| wanted(x[2]));
                moved.map(|(_, u)| largest(u)).fold(0.0, f64::max)
            };
            let (bone, fat) = (of(|z| z <= (0.5 + 1e-9) * SIDE), of(|z| z > (0.5 + 1e-9) * SIDE));
            row.more = Numbers::from([
                ("bone_over_fat", bone / fat),
                ("fat_mm", 1e3 * fat),
                ("cg", solved.inner_iterations as f64),
                ("load_steps", solved.load_steps as f64),
            ]);
        }
    }
    row
}

/// A cube whose lower half is region 1.
fn layers(cells: usize) -> SimplexMesh<3, 4> {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [SIDE; 3], [cells; 3]).expect("a box");
    let ids: Vec<CellId> = mesh.cells().collect();
    let region = |cell: CellId| if mesh.corners(cell).iter().map(|x| x[2]).sum::<f64>() < 2.0 * SIDE { 1 } else { 2 };
    let regions = ids.iter().map(|&cell| region(cell)).collect();
    let cells = ids.iter().map(|&cell| mesh.cell(cell).map(|v| v.0)).collect();
    SimplexMesh::with_regions(mesh.points().to_vec(), cells, regions).expect("the same mesh")
}
