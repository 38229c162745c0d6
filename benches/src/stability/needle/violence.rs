//! Pulls, reversals and whips of a needle that is stuck, and friction and cutting of nothing and of no end (J8, J9).

use super::{FORCES, Watch, scene};
use crate::insertion::setup::{FRAME, Leg, Numerics, SPEED, Scene};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use stylet_physics::insertion::{BaseMotion, Insertion, Interaction, UniformInteraction};
use stylet_physics::material::Solid;
use stylet_solver::team::Team;

/// m.
const DEPTH: f64 = 0.04;
/// Holds whatever pulls.
const ENDLESS: f64 = 1e9;
/// Speed of pulls, m/s, and how long they may last, s.
const PULL: f64 = 0.2;
const PULL_TIME: f64 = 1.5;
/// Whip: frequency, Hz, amplitude, m, step, s.
const WHIP: (f64, f64, f64) = (100.0, 2e-3, 1e-3);
/// Steps within which a body comes to rest, the speed that is rest, m/s, and for a needle that cannot slip the displacement, in
/// sides.
const REST: (usize, f64, f64) = (1000, 1e-5, 1e-3);
/// Most error of the length, %, but for the strongest pull, which must only be bounded, and recover.
const LENGTH: f64 = 1.0;
/// Force on a node that is none, N, and trials.
const NOTHING: f64 = 1e-9;
const TRIALS: usize = 10;

pub(in crate::stability) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let cells = if options.quick { 4 } else { 6 };
    let mut failed = 0;
    let mut add = |report: &mut Report, row: Row| {
        failed += usize::from(!row.ok);
        report.rows.push(row);
    };
    for (times, strict) in [(10.0, true), (1000.0, false)] {
        say(&format!("J8 pull of {times} times the load"));
        let case = format!("J8 pull of {times} times the load");
        let row = judged(case, cells, ENDLESS, options, strict, |run, watch| pull(run, times, watch));
        add(report, row);
    }
    say("J8 reversal in every step");
    add(report, judged("J8 reversal in every step".into(), cells, FORCES.friction, options, true, reverse));
    say("J8 whip");
    add(report, judged("J8 whip at 100 Hz".into(), cells, FORCES.friction, options, true, whip));
    report.figures.push(Figure::at_most("J8: violence that is not survived", failed as f64, 0.0));
}

/// Friction that is another from a moment on.
struct Switched {
    after: f64,
    switched: Arc<AtomicBool>,
}

impl Interaction for Switched {
    fn friction(&self, _: u32, _: &[f64; 3]) -> f64 {
        if self.switched.load(Ordering::Relaxed) { self.after } else { FORCES.friction }
    }

    fn viscosity(&self, _: u32, _: &[f64; 3]) -> f64 {
        FORCES.viscosity
    }

    fn cutting(&self, _: u32, _: &[f64; 3]) -> f64 {
        FORCES.cutting
    }
}

/// A needle pushed in, then treated as `treat` says, then left at rest.
fn judged(
    case: String,
    cells: usize,
    friction: f64,
    options: &BenchOptions,
    strict: bool,
    treat: impl Fn(&mut Insertion<Solid>, &mut Watch) -> Result<f64, String>,
) -> Row {
    let mut row = Row { case, threads: options.threads, ..Row::default() };
    let scene = scene(cells, 0.45, FORCES, vec![Leg::insert(DEPTH, SPEED), Leg::hold(0.2)]);
    let mut watch = Watch::new();
    let result = treated(&scene, friction, options, &mut watch, treat);
    match result {
        Err(error) => row.note = error,
        Ok(Treated { most, rest, speed, seconds }) => {
            row.more = Numbers::from([
                ("most_n", most),
                ("length_%", watch.length),
                ("min_j", watch.smallest_j),
                ("rest_sides", rest),
                ("rest_m_s", speed),
                ("rest_s", seconds),
                ("inconsistent", f64::from(watch.inconsistent)),
            ]);
            if strict && watch.length > LENGTH {
                row.note = format!("the needle is {:.2} % longer or shorter", watch.length);
            } else if speed.is_nan() || speed > REST.1 {
                row.note = format!("moves at {speed:.2e} m/s after it was left alone");
            } else if friction >= ENDLESS && rest > REST.2 {
                row.note = format!("displaced by {rest:.2e} sides after it was left alone");
            }
        }
    }
    row.ok = row.note.is_empty();
    row
}

/// How a treatment ended.
struct Treated {
    /// The largest force at the base, N.
    most: f64,
    /// The largest displacement at rest beyond that before the treatment, in sides; what slips stays displaced.
    rest: f64,
    /// The largest displacement of the last step over its length, m/s: the trapezoid rule leaves stiff modes with velocities that
    /// change sign in every step and move nothing.
    speed: f64,
    /// How long the rest took, s.
    seconds: f64,
}

fn treated(
    scene: &Scene,
    friction: f64,
    options: &BenchOptions,
    watch: &mut Watch,
    treat: impl Fn(&mut Insertion<Solid>, &mut Watch) -> Result<f64, String>,
) -> Result<Treated, String> {
    let words = |error: &dyn std::fmt::Display| error.to_string();
    let switched = Arc::new(AtomicBool::new(false));
    let forces = Switched { after: friction, switched: Arc::clone(&switched) };
    let team = Team::new(options.threads);
    let mut run = scene.start_with(&Numerics::default(), &team, forces).map_err(|e| words(&e))?;
    let pushed = scene.follow(&mut run, FRAME, |_, _, _| ControlFlow::Continue(()));
    pushed.map_err(|e| words(&e))?;
    switched.store(true, Ordering::Relaxed);
    let before = run.state().u.clone();
    let most = treat(&mut run, watch)?;
    let mut treated = Treated { most, rest: f64::NAN, speed: f64::NAN, seconds: 0.0 };
    for _ in 0..REST.0 {
        let last = run.state().u.clone();
        run.step(&[BaseMotion::default()], FRAME).map_err(|e| words(&e))?;
        treated.seconds += FRAME;
        treated.rest = largest_move(&run.state().u, &before) / super::SIDE;
        treated.speed = largest_move(&run.state().u, &last) / FRAME;
        if treated.speed <= REST.1 && (friction < ENDLESS || treated.rest <= REST.2) {
            break;
        }
    }
    Ok(treated)
}

/// The largest displacement between two states, m.
fn largest_move(to: &[f64], from: &[f64]) -> f64 {
    let moves: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
    super::largest(&moves)
}

/// Pulls at the base with so many times the force of friction and cutting, then goes back.
fn pull(run: &mut Insertion<Solid>, times: f64, watch: &mut Watch) -> Result<f64, String> {
    let load = times * (FORCES.cutting + FORCES.friction * DEPTH);
    let (mut most, mut steps) = (0.0_f64, 0);
    while most < load && FRAME * f64::from(steps) < PULL_TIME {
        most = most.max(moved(run, [-PULL, 0.0, 0.0], FRAME, watch)?);
        steps += 1;
    }
    for _ in 0..steps {
        moved(run, [PULL, 0.0, 0.0], FRAME, watch)?;
    }
    Ok(most)
}

/// Forwards and backwards, the other way in every step.
fn reverse(run: &mut Insertion<Solid>, watch: &mut Watch) -> Result<f64, String> {
    let mut most = 0.0_f64;
    for k in 0..500 {
        let insert = if k % 2 == 0 { 0.1 } else { -0.1 };
        most = most.max(step(run, BaseMotion { insert, ..BaseMotion::default() }, FRAME, watch)?);
    }
    Ok(most)
}

/// The sleeve from side to side.
fn whip(run: &mut Insertion<Solid>, watch: &mut Watch) -> Result<f64, String> {
    let (frequency, amplitude, dt) = WHIP;
    let at = |k: i32| amplitude * (2.0 * PI * frequency * dt * f64::from(k)).sin();
    let mut most = 0.0_f64;
    for k in 0..300 {
        most = most.max(moved(run, [0.0, (at(k + 1) - at(k)) / dt, 0.0], dt, watch)?);
    }
    Ok(most)
}

fn moved(run: &mut Insertion<Solid>, sleeve: [f64; 3], dt: f64, watch: &mut Watch) -> Result<f64, String> {
    step(run, BaseMotion { sleeve, ..BaseMotion::default() }, dt, watch)
}

/// Force at the base after a step, N.
fn step(run: &mut Insertion<Solid>, motion: BaseMotion, dt: f64, watch: &mut Watch) -> Result<f64, String> {
    let step = run.step(&[motion], dt).map_err(|error| error.to_string())?;
    if !watch.look(run, &step) {
        return Err(format!("displaced by {:.1} sides at {:.4} s", watch.largest, run.state().t));
    }
    Ok(run.needles()[0].base_force.iter().map(|f| f * f).sum::<f64>().sqrt())
}

/// J9.
pub(in crate::stability) fn friction(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let cells = if options.quick { 4 } else { 6 };
    let mut failed = 0;
    for friction in [0.0, ENDLESS] {
        for cutting in [0.0, ENDLESS] {
            if options.stopped() {
                return;
            }
            say(&format!("J9 friction {friction:e} N/m, cutting {cutting:e} N"));
            let row = sliding(cells, friction, cutting, options);
            failed += usize::from(!row.ok);
            report.rows.push(row);
        }
    }
    report.figures.push(Figure::at_most("J9: friction and cutting that are not as told", failed as f64, 0.0));
}

/// Pushes the needle: it slides where nothing holds it, and drags the tissue along where it cannot cut or slide.
fn sliding(cells: usize, friction: f64, cutting: f64, options: &BenchOptions) -> Row {
    let within = UniformInteraction { friction, viscosity: 0.0, cutting };
    let legs = vec![Leg::insert(0.5 * DEPTH, SPEED), Leg::insert(-0.25 * DEPTH, SPEED)];
    let scene = scene(cells, 0.45, within, legs);
    let (mut watch, mut force, mut deepest) = (Watch::new(), 0.0_f64, 0.0_f64);
    let result = scene.start(&Numerics::default(), &Team::new(options.threads)).map_err(|e| e.to_string());
    let result = result.and_then(|mut run| {
        let followed = scene.follow(&mut run, FRAME, |insertion, step, _| {
            let needle = &insertion.needles()[0];
            force = needle.forces.iter().fold(force, |most, f| most.max(f.abs()));
            deepest = deepest.max(needle.depth());
            if watch.look(insertion, step) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        followed.map_err(|error| error.to_string())
    });
    let mut row = Row {
        case: format!("J9 friction {friction:e} N/m, cutting {cutting:e} N"),
        threads: options.threads,
        more: Numbers::from([
            ("force_n", force),
            ("depth_mm", 1e3 * deepest),
            ("most_trials", watch.most_trials as f64),
            ("inconsistent", f64::from(watch.inconsistent)),
            ("min_j", watch.smallest_j),
        ]),
        ..Row::default()
    };
    row.note = match result {
        Err(error) => error,
        Ok(()) if watch.most_trials > TRIALS => format!("{} trials", watch.most_trials),
        Ok(()) if friction == 0.0 && cutting == 0.0 && force > NOTHING => format!("a force of {force:e} N"),
        Ok(()) if cutting > 0.0 && deepest > 1e-6 => format!("it cut {deepest:e} m deep"),
        Ok(()) => String::new(),
    };
    row.ok = row.note.is_empty();
    row
}
