//! The bits of a run on 1, 2 and 8 threads, and of the same run again.

use super::crush::{Crush, crushed, cube};
use super::{DENSITY, law};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::time::Instant;
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::dynamics::{Damping, Drive, DynamicsError, DynamicsSettings, Integrator, Scheme, Solution, State};
use stylet_solver::team::Team;

/// The first is run again at the end.
const THREADS: [usize; 4] = [1, 2, 8, 1];
const MODELS: [&str; 4] = ["linear", "corotated", "fixed-corotated", "stable-neo-hookean"];

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let (cells, steps) = if options.quick { (4, 50) } else { (6, 1000) };
    let mut different = 0;
    for model in MODELS {
        if options.stopped() {
            return;
        }
        say(&format!("J12 threads, {model}"));
        let since = Instant::now();
        let ends: Result<Vec<State>, DynamicsError> =
            THREADS.iter().map(|&threads| end(model, cells, steps, threads)).collect();
        let mut row = Row {
            case: format!("J12 1, 2, 8 threads, {model}, ν 0.3"),
            threads: 8,
            seconds: Some(since.elapsed().as_secs_f64()),
            more: Numbers::from([("steps", f64::from(steps))]),
            ..Row::default()
        };
        match ends {
            Err(error) => row.note = error.to_string(),
            Ok(ends) => {
                let differing = ends.iter().filter(|end| bits(end) != bits(&ends[0])).count();
                row.ok = differing == 0;
                row.more.insert("runs", ends.len() as f64);
                row.more.insert("differing", differing as f64);
            }
        }
        different += usize::from(!row.ok);
        report.rows.push(row);
    }
    report.figures.push(Figure::at_most("J12: laws whose bits differ", different as f64, 0.0));
}

/// A flattened cube that swings back.
fn end(model: &str, cells: usize, steps: u32, threads: usize) -> Result<State, DynamicsError> {
    let (mesh, held) = cube(cells);
    let mut body = Body::new(&mesh, law(model, 0.3), 1.0)?;
    body.set_threads(threads);
    body.set_mass(MassKind::Lumped, &Density::Uniform(DENSITY))?;
    let settings = DynamicsSettings {
        scheme: Scheme::TRAPEZOID,
        solution: Solution::Newton { max_iterations: 100 },
        damping: Damping { mass: 1.0, stiffness: 1e-3 },
        ..DynamicsSettings::new(1e-3)
    };
    let mut it = Integrator::new(settings, &Team::new(threads));
    let mut nothing = |_: f64, _: &mut Drive| ();
    let u = crushed(&mesh, Crush::Plane);
    let rest = vec![0.0; u.len()];
    let mut state = it.start_moving(&mut body, &held, &mut nothing, u, rest)?;
    for _ in 0..steps {
        it.step(&mut body, &held, &mut nothing, &mut state)?;
    }
    Ok(state)
}

fn bits(state: &State) -> Vec<u64> {
    [&state.u, &state.v, &state.a].into_iter().flatten().map(|x| x.to_bits()).collect()
}
