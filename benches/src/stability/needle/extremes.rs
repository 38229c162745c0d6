//! Steps a hundred times as long and speeds a hundred times as high as any that are asked for (J7).

use super::{FORCES, Watch, scene};
use crate::insertion::setup::{FRAME, Leg, Numerics, SPEED};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use stylet_physics::insertion::{BaseMotion, Insertion};
use stylet_physics::material::Solid;
use stylet_solver::team::Team;

/// Factors of the step, and speeds, m/s.
const STEPS: [f64; 4] = [0.1, 1.0, 10.0, 100.0];
const SPEEDS: [f64; 4] = [0.0, SPEED, 0.5, 5.0];
/// m; a needle that is not pushed is brought to half of it first.
const DEPTH: f64 = 0.06;
/// Steps that it is held.
const HELD: usize = 20;
/// Most mm between a node of the needle and its node of the tissue.
const GAP: f64 = 1e-9;

pub(in crate::stability) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let mut failed = 0;
    for factor in STEPS {
        for speed in SPEEDS {
            if options.stopped() {
                return;
            }
            say(&format!("J7 steps of {} ms, {speed} m/s", 1e3 * factor * FRAME));
            let row = row(factor * FRAME, speed, options);
            failed += usize::from(!row.ok);
            report.rows.push(row);
        }
    }
    report.figures.push(Figure::at_most("J7: steps and speeds that fail", failed as f64, 0.0));
}

fn row(dt: f64, speed: f64, options: &BenchOptions) -> Row {
    let mut row = Row {
        case: format!("J7 steps of {} ms, {speed} m/s", (1e5 * dt).round() / 100.0),
        threads: options.threads,
        ..Row::default()
    };
    let cells = if options.quick { 4 } else { 6 };
    let scene = scene(cells, 0.45, FORCES, vec![Leg::insert(0.5 * DEPTH, SPEED)]);
    let (mut watch, mut sum) = (Watch::new(), [0_u64; 3]);
    let result = scene.start(&Numerics::default(), &Team::new(options.threads)).map_err(|e| e.to_string());
    let result = result.and_then(|mut run| {
        if speed == 0.0 {
            let gone = scene.follow(&mut run, FRAME, |_, _, _| std::ops::ControlFlow::Continue(()));
            gone.map_err(|error| error.to_string())?;
        }
        in_and_out(&mut run, dt, speed, &mut watch, &mut sum)
    });
    row.note = result.err().unwrap_or_default();
    if row.note.is_empty() && !(watch.gap <= GAP && watch.unjoined == 0) {
        row.note = format!("a gap of {:e} m, {} edges that are not there", watch.gap, watch.unjoined);
    }
    row.ok = row.note.is_empty();
    row.more = Numbers::from([
        ("steps", sum[0] as f64),
        ("parts", sum[1] as f64),
        ("blocked", sum[2] as f64),
        ("min_j", watch.smallest_j),
        ("largest_sides", watch.largest),
        ("length_%", watch.length),
        ("most_trials", watch.most_trials as f64),
    ]);
    row
}

/// To the depth, held, and out, at one speed; where a step would go further, one that goes as far.
fn in_and_out(
    run: &mut Insertion<Solid>,
    dt: f64,
    speed: f64,
    watch: &mut Watch,
    sum: &mut [u64; 3],
) -> Result<(), String> {
    let mut legs = vec![(0.0, HELD, dt)];
    if speed > 0.0 {
        let h = dt.min(DEPTH / speed);
        let steps = (DEPTH / (speed * h)).round() as usize;
        legs = vec![(speed, steps, h), (0.0, HELD, dt), (-speed, steps, h)];
    }
    for (insert, steps, h) in legs {
        for _ in 0..steps {
            let step = run.step(&[BaseMotion { insert, ..BaseMotion::default() }], h).map_err(|e| e.to_string())?;
            *sum = [sum[0] + 1, sum[1] + u64::from(step.substeps), sum[2] + u64::from(step.blocked)];
            if !watch.look(run, &step) {
                return Err(format!("displaced by {:.1} sides at {:.4} s", watch.largest, run.state().t));
            }
        }
    }
    Ok(())
}
