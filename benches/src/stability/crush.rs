//! A cube, held at the bottom, whose other nodes start at a point, on a plane, on a line, or anywhere in the box.

use super::{DENSITY, POISSON, SIDE, YOUNG, largest, law};
use crate::random::SplitMix64;
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use rayon::prelude::*;
use std::time::Instant;
use stylet_mesh::SimplexMesh;
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::dynamics::{
    Adaptive, Damping, Drive, DynamicsError, DynamicsSettings, Integrator, Scheme, Solution,
};
use stylet_physics::material::Solid;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;
use stylet_solver::vector::norm2;

/// Laws of which every run at the first of [`POISSON`] must come back.
const REQUIRED: [&str; 3] = ["corotated", "fixed-corotated", "stable-neo-hookean"];
/// Damping time, and the first and shortest step, s.
const DAMPING: f64 = 0.01;
/// The longest step, s, and the displacement error of a step, in sides: steps grow when little moves any more.
const LONGEST: f64 = 0.25;
const STEP_ERROR: f64 = 0.05;
/// Newton steps per time step.
const NEWTON_STEPS: usize = 100;
/// End of a run, s.
const DURATION: f64 = 10.0;
/// A body this close to its rest shape, in sides, has come back.
const RECOVERED: f64 = 1e-3;
/// A run goes on down to this displacement and speed, in sides and sides per second.
const REST: (f64, f64) = (1e-4, 1e-3);
/// A body elsewhere is in equilibrium if the free forces, in the 2-norm, are below this share of `E` times a face.
const EQUILIBRIUM: f64 = 1e-4;
/// It is not followed further below this share, at this speed in sides per second.
const SETTLED: (f64, f64) = (1e-6, 1e-5);

/// Where a node starts.
#[derive(Clone, Copy, Debug)]
pub(super) enum Crush {
    Point,
    Plane,
    Line,
    /// Uniform in the box, by this seed.
    Scramble(u64),
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
enum End {
    Recovered,
    /// At rest, but not in the rest shape.
    Elsewhere,
    /// In motion after [`DURATION`].
    Moving,
    Refused(String),
}

struct Run {
    end: End,
    /// Largest displacement component, in sides.
    error: f64,
    smallest_j: f64,
    steps: u64,
    newton: usize,
    unconverged: u32,
    seconds: f64,
}

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let cells = if options.quick { 4 } else { 8 };
    let seeds = if options.quick { 2 } else { 10 };
    let collapses = [Crush::Point, Crush::Plane, Crush::Line].to_vec();
    let scrambles = (1..=seeds).map(Crush::Scramble).collect();
    for (name, crushes) in [("J1 collapse", collapses), ("J2 scramble", scrambles)] {
        for poisson in POISSON {
            for model in Solid::MODELS {
                if options.stopped() {
                    return;
                }
                say(&format!("{name}, {model}, ν {poisson}"));
                let runs = all(law(model, poisson), cells, &crushes, options);
                let row = row(format!("{name}, {model}, ν {poisson}"), &runs);
                if poisson == POISSON[0] && REQUIRED.contains(&model) {
                    let share = row.more["recovered"] / row.more["runs"];
                    report.figures.push(Figure::at_least(format!("{}: share recovered", row.case), share, 1.0));
                }
                report.rows.push(row);
            }
        }
    }
    let wild = report.rows.iter().filter(|row| row.error.values().any(|error| !error.is_finite())).count();
    report.figures.push(Figure::at_most("rows with a displacement that is not finite", wild as f64, 0.0));
}

/// The runs of one law, as many at a time as there are threads; each has the bits of one that is alone.
fn all(solid: Solid, cells: usize, crushes: &[Crush], options: &BenchOptions) -> Vec<Run> {
    let run = |crush: &Crush| (!options.stopped()).then(|| recover(solid, cells, *crush));
    match rayon::ThreadPoolBuilder::new().num_threads(options.threads).build() {
        Ok(pool) => pool.install(|| crushes.par_iter().filter_map(run).collect()),
        Err(_) => crushes.iter().filter_map(run).collect(),
    }
}

fn row(case: String, runs: &[Run]) -> Row {
    let count = |end: &End| runs.iter().filter(|run| run.end == *end).count() as f64;
    let refusal = runs.iter().find_map(|run| match &run.end {
        End::Refused(reason) => Some(reason.clone()),
        _ => None,
    });
    let of_recovered = runs.iter().filter(|run| run.end == End::Recovered);
    let finished: Vec<&Run> = runs.iter().filter(|run| !matches!(run.end, End::Refused(_))).collect();
    let mut row = Row { case, threads: 1, ok: refusal.is_none(), note: refusal.unwrap_or_default(), ..Row::default() };
    row.more = Numbers::from([
        ("runs", runs.len() as f64),
        ("recovered", count(&End::Recovered)),
        ("elsewhere", count(&End::Elsewhere)),
        ("moving", count(&End::Moving)),
    ]);
    if finished.is_empty() {
        return row;
    }
    // Beside a run that recovered the others tell where they are, not how wrong they are: the notes say so.
    row.error.insert("worst", largest(&finished.iter().map(|run| run.error).collect::<Vec<_>>()));
    if let Some(worst) = of_recovered.map(|run| run.error).max_by(f64::total_cmp) {
        row.error.insert("recovered", worst);
    }
    let sum = |of: fn(&Run) -> f64| finished.iter().map(|run| of(run)).sum::<f64>();
    row.iterations = Some(finished.iter().map(|run| run.newton as u64).sum());
    row.seconds = Some(sum(|run| run.seconds) / finished.len() as f64);
    row.more.insert("steps", sum(|run| run.steps as f64));
    row.more.insert("unconverged", sum(|run| f64::from(run.unconverged)));
    row.more.insert("min_j", finished.iter().map(|run| run.smallest_j).fold(f64::INFINITY, f64::min));
    row
}

fn recover(solid: Solid, cells: usize, crush: Crush) -> Run {
    let mut run =
        Run { end: End::Moving, error: 0.0, smallest_j: 0.0, steps: 0, newton: 0, unconverged: 0, seconds: 0.0 };
    let since = Instant::now();
    if let Err(error) = follow(solid, cells, crush, &mut run) {
        run.end = End::Refused(error.to_string());
    }
    run.seconds = since.elapsed().as_secs_f64();
    run
}

fn follow(solid: Solid, cells: usize, crush: Crush, run: &mut Run) -> Result<(), DynamicsError> {
    let (mesh, held) = cube(cells);
    let mut body = Body::new(&mesh, solid, 1.0)?;
    body.set_mass(MassKind::Lumped, &Density::Uniform(DENSITY))?;
    let mut it = Integrator::new(settings(), &Team::serial());
    let mut nothing = |_: f64, _: &mut Drive| ();
    let u = crushed(&mesh, crush);
    let (no_load, mut residual) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    let mut state = it.start_moving(&mut body, &held, &mut nothing, u, no_load.clone())?;
    let mut forces = 0.0;
    while state.t < DURATION {
        let step = it.step(&mut body, &held, &mut nothing, &mut state)?;
        (run.steps, run.newton) = (state.step, run.newton + step.newton_iterations);
        run.unconverged += step.unconverged;
        body.residual(&state.u, &no_load, &mut residual);
        held.project(&mut residual);
        forces = norm2(&residual) / (YOUNG * SIDE * SIDE);
        let speed = largest(&state.v) / SIDE;
        run.error = largest(&state.u) / SIDE;
        if (run.error < REST.0 && speed < REST.1) || (forces < SETTLED.0 && speed < SETTLED.1) {
            break;
        }
    }
    run.smallest_j = body.smallest_jacobian(&state.u).map_or(f64::NAN, |(_, jacobian)| jacobian);
    run.end = match () {
        () if run.error < RECOVERED && run.smallest_j > 0.0 => End::Recovered,
        () if forces < EQUILIBRIUM => End::Elsewhere,
        () => End::Moving,
    };
    Ok(())
}

fn settings() -> DynamicsSettings {
    let mut settings = DynamicsSettings {
        scheme: Scheme::BackwardEuler,
        solution: Solution::Newton { max_iterations: NEWTON_STEPS },
        damping: Damping { mass: 0.0, stiffness: DAMPING },
        adaptive: Some(Adaptive { tolerance: STEP_ERROR * SIDE, smallest: DAMPING, largest: LONGEST }),
        ..DynamicsSettings::new(DAMPING)
    };
    settings.stop.tolerance = 1e-4;
    settings
}

/// The cube, and what holds its bottom.
pub(super) fn cube(cells: usize) -> (SimplexMesh<3, 4>, Subspace<3>) {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [SIDE; 3], [cells; 3]).expect("a box");
    let mut held = Subspace::new(mesh.n_vertex_slots());
    for (vertex, x) in mesh.points().iter().enumerate() {
        if is_bottom(x) {
            held.set(vertex, Constraint::Fixed).expect("a vertex of the mesh");
        }
    }
    (mesh, held)
}

fn is_bottom(x: &[f64; 3]) -> bool {
    x[2] < 1e-9 * SIDE
}

/// The displacement of the crushed cube, m.
pub(super) fn crushed(mesh: &SimplexMesh<3, 4>, crush: Crush) -> Vec<f64> {
    let mut random = SplitMix64(match crush {
        Crush::Scramble(seed) => seed,
        _ => 0,
    });
    let mut place = |x: &[f64; 3]| match crush {
        Crush::Point => [0.5 * SIDE; 3],
        Crush::Plane => [x[0], x[1], 0.0],
        Crush::Line => [0.5 * SIDE, 0.5 * SIDE, x[2]],
        Crush::Scramble(_) => std::array::from_fn(|_| SIDE * random.unit()),
    };
    let displacement = |x: &[f64; 3]| -> [f64; 3] {
        if is_bottom(x) {
            return [0.0; 3];
        }
        let to = place(x);
        std::array::from_fn(|k| to[k] - x[k])
    };
    mesh.points().iter().flat_map(displacement).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_that_ends_at_flat_elements_says_so_and_another_comes_back() {
        let refused = recover(law("st-venant-kirchhoff", 0.3), 2, Crush::Plane);
        let End::Refused(reason) = &refused.end else { panic!("{:?}", refused.end) };
        assert!(reason.contains("is inverted at t = 0 s"), "{reason}");
        let back = recover(law("stable-neo-hookean", 0.3), 2, Crush::Plane);
        assert!(back.end == End::Recovered && back.smallest_j > 0.9, "{:?}", back.end);
        let row = row("a case".into(), &[refused, back]);
        assert!(!row.ok && row.more["recovered"] == 1.0 && row.error["worst"] < 1e-3);
    }
}
