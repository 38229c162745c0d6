//! A needle in nearly incompressible tissue, held for thousands of steps (J5).

use super::{FORCES, MODELS, Watch, named, scene};
use crate::insertion::setup::{FRAME, Leg, Numerics, SPEED};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::ops::ControlFlow;
use std::time::Instant;
use stylet_mesh::geometry::signed_measure;
use stylet_physics::insertion::Insertion;
use stylet_physics::material::Solid;
use stylet_solver::team::Team;

const POISSON: f64 = 0.495;
/// m.
const DEPTH: f64 = 0.06;
/// Steps after the insertion before the pattern is looked at first.
const SETTLED: usize = 100;
/// Change of the whole volume, %, and growth of the spread of J between then and the end, that pass.
const LIMITS: (f64, f64) = (1.0, 1.05);

pub(in crate::stability) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let (cells, steps) = if options.quick { (4, 400) } else { (6, 10_000) };
    for model in MODELS {
        if options.stopped() {
            return;
        }
        say(&format!("J5 near incompressibility, {model}"));
        report.rows.push(row(model, cells, steps, options));
    }
    let failed = report.rows.iter().filter(|row| row.case.starts_with("J5 ") && !row.ok).count();
    report.figures.push(Figure::at_most("J5: laws that change their volume or checker, or fail", failed as f64, 0.0));
}

fn row(model: &'static str, cells: usize, steps: usize, options: &BenchOptions) -> Row {
    let mut row =
        Row { case: named("J5 near incompressibility", model, POISSON), threads: options.threads, ..Row::default() };
    let since = Instant::now();
    let pushed = (DEPTH / SPEED / FRAME).round() as usize;
    let legs = vec![Leg::insert(DEPTH, SPEED), Leg::hold(FRAME * steps.saturating_sub(pushed) as f64)];
    let scene = scene(cells, POISSON, FORCES, legs);
    let numerics = Numerics { model, ..Numerics::default() };
    let mut watch = Watch::new();
    let (mut done, mut settled) = (0, (0.0, 0.0));
    let result = scene.start(&numerics, &Team::new(options.threads)).map_err(|e| e.to_string()).and_then(|mut run| {
        let followed = scene.follow(&mut run, FRAME, |insertion, step, _| {
            done += 1;
            if done == pushed + SETTLED {
                settled = volume(insertion);
            }
            let bounded = watch.look(insertion, step);
            if bounded && !options.stopped() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        followed.map_err(|error| error.to_string()).map(|()| volume(&run))
    });
    row.seconds = Some(since.elapsed().as_secs_f64());
    match result {
        Err(error) => row.note = error,
        Ok((change, spread)) => {
            let growth = spread / settled.1;
            row.ok = done == steps && change < LIMITS.0 && growth <= LIMITS.1;
            row.more = Numbers::from([
                ("steps", done as f64),
                ("volume_%", change),
                ("spread_of_j", spread),
                ("growth", growth),
                ("min_j", watch.smallest_j),
            ]);
        }
    }
    row
}

/// Change of the whole volume, %, and the standard deviation of det F over the cells, weighted by volume.
fn volume(insertion: &Insertion<Solid>) -> (f64, f64) {
    let (mesh, u) = (insertion.mesh(), &insertion.state().u);
    let (mut rest, mut now, mut squares) = (0.0, 0.0, 0.0);
    for cell in mesh.cells() {
        let x = mesh.corners(cell);
        let vertices = mesh.cell(cell);
        let y: [[f64; 3]; 4] =
            std::array::from_fn(|i| std::array::from_fn(|k| x[i][k] + u[3 * vertices[i].index() + k]));
        let (before, after) = (signed_measure(&x), signed_measure(&y));
        rest += before.abs();
        now += after * before.signum();
        squares += after * after / before.abs();
    }
    let mean = now / rest;
    (100.0 * (mean - 1.0).abs(), (squares / rest - mean * mean).max(0.0).sqrt())
}
