//! Input that makes no sense: each must come back as an error.

use super::{DENSITY, SIDE, YOUNG, law};
use crate::{BenchOptions, Figure, Report, Row};
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::dynamics::{Drive, DynamicsSettings, Integrator};
use stylet_physics::material::Solid;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;

/// What is wrong with the input, and what it is answered with.
type Case = (String, Result<(), String>);

pub(super) fn run(_: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    say("J11 hostile input");
    let cases: Vec<Case> = materials().into_iter().chain(meshes()).chain(bodies()).collect();
    let accepted = cases.iter().filter(|(_, answer)| answer.is_ok()).count();
    report.rows.extend(cases.into_iter().map(|(what, answer)| Row {
        case: format!("J11 {what}"),
        threads: 1,
        ok: answer.is_err(),
        note: answer.err().unwrap_or_else(|| "accepted".into()),
        ..Row::default()
    }));
    report.figures.push(Figure::at_most("J11: hostile input that is accepted", accepted as f64, 0.0));
}

fn materials() -> Vec<Case> {
    let mut constants = [f64::NAN, f64::INFINITY, -YOUNG, 0.0].map(|young| (young, 0.3)).to_vec();
    constants.extend([f64::NAN, 0.5, -1.0].map(|poisson| (YOUNG, poisson)));
    let answers = constants.into_iter().map(|(young, poisson)| {
        let refused =
            |model: &&str| Solid::from_young_poisson(model, young, poisson).map(drop).map_err(|e| e.to_string());
        // One law that accepts them is enough to fail.
        let answers: Vec<Result<(), String>> = Solid::MODELS.iter().map(refused).collect();
        let answer = answers.iter().find(|answer| answer.is_ok()).unwrap_or(&answers[0]).clone();
        (format!("E = {young:e} Pa, ν = {poisson}, all laws"), answer)
    });
    answers.collect()
}

fn meshes() -> Vec<Case> {
    let points = |scale: f64| vec![[0.0; 3], [scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale]];
    let mut edge = points(SIDE);
    edge[1] = edge[0];
    let mut absent = points(SIDE);
    absent[2][1] = f64::NAN;
    let tet = [0, 1, 2, 3];
    let inputs = [
        ("no tetrahedron", Vec::new(), Vec::new()),
        ("the same tetrahedron twice", points(SIDE), vec![tet, tet]),
        ("a tetrahedron and its mirror image", points(SIDE), vec![tet, [1, 0, 2, 3]]),
        ("an edge of length 0", edge, vec![tet]),
        ("a corner that is not a number", absent, vec![tet]),
        ("corners at 1e308 m", points(1e308), vec![tet]),
        ("a vertex that does not exist", points(SIDE), vec![[0, 1, 2, 4]]),
        ("a vertex twice", points(SIDE), vec![[0, 1, 2, 2]]),
    ];
    let answer = |points, cells| {
        let mesh = SimplexMesh::<3, 4>::new(points, cells).map_err(|e| e.to_string())?;
        Body::new(&mesh, law("neo-hookean", 0.3), 1.0).map(drop).map_err(|e| e.to_string())
    };
    inputs.into_iter().map(|(what, points, cells)| (what.to_owned(), answer(points, cells))).collect()
}

fn bodies() -> Vec<Case> {
    let corners = [[0.0; 3], [SIDE, 0.0, 0.0], [0.0, SIDE, 0.0], [0.0, 0.0, SIDE]];
    let mesh = SimplexMesh::<3, 4>::new(corners.to_vec(), vec![[0, 1, 2, 3]]).expect("a cell with volume");
    let steps = |density: f64, dt: f64, load: f64| -> Result<(), String> {
        let mut body = Body::new(&mesh, law("neo-hookean", 0.3), 1.0).map_err(|e| e.to_string())?;
        body.set_mass(MassKind::Lumped, &Density::Uniform(density)).map_err(|e| e.to_string())?;
        let mut it = Integrator::new(DynamicsSettings::new(dt), &Team::serial());
        let mut drive = |_: f64, drive: &mut Drive| drive.load.fill(load);
        let free = Subspace::new(body.n_vertices());
        let mut state = it.start(&mut body, &free, &mut drive).map_err(|e| e.to_string())?;
        it.step(&mut body, &free, &mut drive, &mut state).map(drop).map_err(|e| e.to_string())
    };
    let mut cases: Vec<Case> = [0.0, -1.0, f64::NAN, f64::INFINITY]
        .map(|density| (format!("{density} kg/m³"), steps(density, 1e-3, 0.0)))
        .to_vec();
    cases.extend([0.0, -1.0, f64::NAN].map(|dt| (format!("a step of {dt} s"), steps(DENSITY, dt, 0.0))));
    cases.push(("a load that is not a number".into(), steps(DENSITY, 1e-3, f64::NAN)));
    cases
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_hostile_is_accepted() {
        for (what, answer) in materials().into_iter().chain(meshes()).chain(bodies()) {
            assert!(answer.is_err(), "{what} is accepted");
        }
    }
}
