//! A cube, held at the bottom, whose other nodes start at a point, on a plane, on a line, or anywhere in the box.

use super::{DENSITY, POISSON, SIDE, YOUNG, largest, law};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use rayon::prelude::*;
use std::time::Instant;
use stylet_mesh::SimplexMesh;
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::random::SplitMix64;
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
/// Newton's first and last tolerance, shares of the forces of a step, and what it is multiplied by when a step moves nothing
/// any more: crushed elements push hard on what holds the body, and beside that the forces that still move it are small.
const TOLERANCE: (f64, f64) = (1e-4, 1e-10);
const TIGHTER: f64 = 1e-2;
/// A body must be back within this time, s; others are followed up to the second.
const DURATION: f64 = 10.0;
const FOLLOWED: f64 = 100.0;
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
    /// In motion after [`FOLLOWED`].
    Moving,
    Refused(String),
}

struct Run {
    end: End,
    /// When it ended, s.
    t: f64,
    /// Largest displacement component, in sides.
    error: f64,
    smallest_j: f64,
    steps: u64,
    newton: usize,
    unconverged: u32,
    seconds: f64,
}

/// One row: a test, and what it is run with.
struct Case {
    test: &'static str,
    model: &'static str,
    poisson: f64,
    crushes: Vec<Crush>,
}

impl Case {
    fn name(&self) -> String {
        format!("{}, {}, ν {}", self.test, self.model, self.poisson)
    }

    fn must_recover(&self) -> bool {
        self.poisson == POISSON[0] && REQUIRED.contains(&self.model)
    }
}

/// Cells along a side, and seeds of scrambles.
pub(super) const fn size(quick: bool) -> (usize, u64) {
    if quick { (3, 1) } else { (8, 10) }
}

fn cases(seeds: u64) -> Vec<Case> {
    let collapses = vec![Crush::Point, Crush::Plane, Crush::Line];
    let scrambles = (1..=seeds).map(Crush::Scramble).collect();
    let mut cases = Vec::new();
    for (test, crushes) in [("J1 collapse", collapses), ("J2 scramble", scrambles)] {
        for poisson in POISSON {
            let case = |model| Case { test, model, poisson, crushes: crushes.clone() };
            cases.extend(Solid::MODELS.map(case));
        }
    }
    cases
}

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let (cells, seeds) = size(options.quick);
    for case in cases(seeds) {
        if options.stopped() {
            return;
        }
        say(&case.name());
        let runs = all(law(case.model, case.poisson), cells, &case.crushes, options);
        if case.must_recover() {
            let name = format!("{}: share recovered within {DURATION} s", case.name());
            report.figures.push(Figure::at_least(name, in_time(&runs), 1.0));
        }
        report.rows.push(row(case.name(), &runs));
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

/// The share of runs that came back within [`DURATION`].
fn in_time(runs: &[Run]) -> f64 {
    let back = runs.iter().filter(|run| run.end == End::Recovered && run.t <= DURATION).count();
    back as f64 / runs.len() as f64
}

fn row(case: String, runs: &[Run]) -> Row {
    let count = |end: &End| runs.iter().filter(|run| run.end == *end).count() as f64;
    let refusal = runs.iter().find_map(|run| match &run.end {
        End::Refused(reason) => Some(reason.clone()),
        _ => None,
    });
    let recovered = || runs.iter().filter(|run| run.end == End::Recovered);
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
    if let Some(worst) = recovered().map(|run| run.error).max_by(f64::total_cmp) {
        row.error.insert("recovered", worst);
    }
    if let Some(latest) = recovered().map(|run| run.t).max_by(f64::total_cmp) {
        row.more.insert("latest_s", latest);
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
    let mut run = Run {
        end: End::Moving,
        t: 0.0,
        error: 0.0,
        smallest_j: 0.0,
        steps: 0,
        newton: 0,
        unconverged: 0,
        seconds: 0.0,
    };
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
    let mut settings = settings();
    let mut it = Integrator::new(settings, &Team::serial());
    let mut nothing = |_: f64, _: &mut Drive| ();
    let u = crushed(&mesh, crush);
    let (no_load, mut residual) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    let mut state = it.start_moving(&mut body, &held, &mut nothing, u, no_load.clone())?;
    let mut forces = 0.0;
    while state.t < FOLLOWED {
        let step = it.step(&mut body, &held, &mut nothing, &mut state)?;
        (run.t, run.steps, run.newton) = (state.t, state.step, run.newton + step.newton_iterations);
        run.unconverged += step.unconverged;
        body.residual(&state.u, &no_load, &mut residual);
        held.project(&mut residual);
        forces = norm2(&residual) / (YOUNG * SIDE * SIDE);
        let speed = largest(&state.v) / SIDE;
        run.error = largest(&state.u) / SIDE;
        if (run.error < REST.0 && speed < REST.1) || (forces < SETTLED.0 && speed < SETTLED.1) {
            break;
        }
        if step.newton_iterations == 0 && settings.stop.tolerance > TOLERANCE.1 {
            settings.stop.tolerance = (TIGHTER * settings.stop.tolerance).max(TOLERANCE.1);
            it = Integrator::new(settings, &Team::serial());
        }
    }
    run.smallest_j = body.smallest_jacobian(&state.u).map_or(f64::NAN, |(_, jacobian)| jacobian);
    run.end = end(run.error, run.smallest_j, forces);
    Ok(())
}

/// How a run has ended with such a displacement, smallest J, and free forces.
fn end(error: f64, smallest_j: f64, forces: f64) -> End {
    if error < RECOVERED && smallest_j > 0.0 {
        End::Recovered
    } else if forces < EQUILIBRIUM {
        End::Elsewhere
    } else {
        End::Moving
    }
}

fn settings() -> DynamicsSettings {
    let mut settings = DynamicsSettings {
        scheme: Scheme::BackwardEuler,
        solution: Solution::Newton { max_iterations: NEWTON_STEPS },
        damping: Damping { mass: 0.0, stiffness: DAMPING },
        adaptive: Some(Adaptive { tolerance: STEP_ERROR * SIDE, smallest: DAMPING, largest: LONGEST }),
        ..DynamicsSettings::new(DAMPING)
    };
    settings.stop.tolerance = TOLERANCE.0;
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
    let mut random = SplitMix64::new(match crush {
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
    fn an_end_is_known_by_its_place_its_elements_and_its_forces() {
        for (error, smallest_j, forces, expected) in [
            (9e-4, 0.9, 1.0, End::Recovered),
            (9e-4, -0.1, 9e-5, End::Elsewhere),
            (2e-3, 0.9, 9e-5, End::Elsewhere),
            (0.5, -0.1, 9e-5, End::Elsewhere),
            (0.5, -0.1, 2e-4, End::Moving),
            (f64::NAN, f64::NAN, f64::NAN, End::Moving),
        ] {
            assert_eq!(end(error, smallest_j, forces), expected, "{error} {smallest_j} {forces}");
        }
    }

    #[test]
    fn a_row_counts_ends_and_knows_who_came_in_time() {
        let run = |end: End, t: f64, error: f64| Run {
            end,
            t,
            error,
            smallest_j: 0.5,
            steps: 10,
            newton: 20,
            unconverged: 1,
            seconds: 2.0,
        };
        let runs = [
            run(End::Recovered, 2.0, 1e-5),
            run(End::Recovered, 12.0, 1e-4),
            run(End::Elsewhere, 5.0, 0.7),
            run(End::Moving, 100.0, f64::NAN),
        ];
        let row = row("a case".into(), &runs);
        let counts = ["runs", "recovered", "elsewhere", "moving", "latest_s", "unconverged"].map(|name| row.more[name]);
        assert_eq!(counts, [4.0, 2.0, 1.0, 1.0, 12.0, 4.0]);
        assert_eq!(in_time(&runs), 0.25);
        // What is not a number is not lost among numbers.
        assert!(row.error["worst"].is_nan() && row.error["recovered"] == 1e-4 && row.iterations == Some(80));
    }

    #[test]
    fn a_quick_look_leaves_out_no_law_and_no_ratio() {
        let names = |quick| -> Vec<String> { cases(size(quick).1).iter().map(Case::name).collect() };
        assert_eq!(names(true), names(false));
        assert_eq!(names(true).len(), 2 * POISSON.len() * Solid::MODELS.len());
        let quick = cases(size(true).1);
        assert!(quick.iter().all(|case| !case.crushes.is_empty()));
        assert_eq!(quick.iter().filter(|case| case.must_recover()).count(), 2 * REQUIRED.len());
    }

    #[test]
    fn a_body_that_rests_elsewhere_is_followed_until_it_rests() {
        // Elements held crushed push with a thousand times the force that ends a run.
        let run = recover(law("fixed-corotated", 0.495), 4, Crush::Scramble(1));
        assert!(run.end == End::Elsewhere && run.error > 0.1 && run.t < DURATION, "{:?} at {} s", run.end, run.t);
    }

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
