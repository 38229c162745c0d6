//! Time integration against closed forms: an oscillator of one degree of freedom, free fall, a free body, and the order of
//! convergence. The figures are those of validation sheet F.

use crate::support::allocations::allocations;
use crate::support::{YOUNG, at, clamped, distorted_box, random_vector};
use std::f64::consts::PI;
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{SimplexMesh, VertexId};
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::dynamics::{Damping, Drive, DynamicsSettings, Integrator, Scheme, Solution, State};
use stylet_physics::material::{Hyperelastic, Linear, NeoHookean, StVenantKirchhoff};
use stylet_solver::energy::Energy;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// Newton's method, far enough for the order of the scheme to show.
const NEWTON: Solution = Solution::Newton { max_iterations: 50 };

fn tight(dt: f64) -> DynamicsSettings {
    let mut settings = DynamicsSettings::new(dt);
    settings.stop.tolerance = 1e-13;
    settings
}

/// A bar of one element, held at one end: an oscillator of angular frequency `omega` (rad/s).
fn oscillator(omega: f64) -> (Body<1, 2, Linear>, Subspace<1>) {
    let mesh = kuhn_box::<1, 2>([0.0], [1.0], [1]).unwrap();
    let material = Linear::from_young_poisson(1.0, 0.0).unwrap();
    let mut body = Body::new(&mesh, material, 1.0).unwrap();
    // k = 1 N/m, and half of the mass of the bar at its free end.
    body.set_mass(MassKind::Lumped, &Density::Uniform(2.0 / (omega * omega))).unwrap();
    let mut held = Subspace::new(2);
    held.set(0, Constraint::Fixed).unwrap();
    (body, held)
}

fn nothing(_: f64, _: &mut Drive) {}

/// Places of the oscillator after each of `n` steps, released at 1 m, and its energies.
fn swing(omega: f64, settings: DynamicsSettings, n: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut body, held) = oscillator(omega);
    let mut it = Integrator::new(settings, &Team::serial());
    let mut state = it.start_moving(&mut body, &held, &mut nothing, vec![0.0, 1.0], vec![0.0; 2]).unwrap();
    let (mut places, mut energies) = (vec![1.0], vec![it.balance(&mut body, &state).total()]);
    for _ in 0..n {
        it.step(&mut body, &held, &mut nothing, &mut state).unwrap();
        places.push(state.u[1]);
        energies.push(it.balance(&mut body, &state).total());
    }
    (places, energies)
}

/// Growth `r` and phase of one step from four places in a row, which obey `x2 = 2 r cos(phase) x1 - r^2 x0`.
fn amplification(x: &[f64]) -> (f64, f64) {
    let det = x[1] * x[1] - x[0] * x[2];
    let b = (x[1] * x[2] - x[0] * x[3]) / det;
    let c = (x[2] * x[2] - x[1] * x[3]) / det;
    let r = c.sqrt();
    (r, (b / (2.0 * r)).acos())
}

/// F1: the period grows as theory says, and energy is kept to round-off.
#[test]
fn an_undamped_oscillator() {
    for (step, ratio) in [(0.1, 1.000833), (0.5, 1.020497), (1.0, 1.078405), (2.0, 1.273240), (5.0, 2.100329)] {
        let omega = 3.0;
        let (places, energies) = swing(omega, tight(step / omega), 200);
        let (r, phase) = amplification(&places[50..]);
        let exact = 0.5 * step / (0.5 * step).atan();
        assert!((step / phase - ratio).abs() <= 0.6e-6, "w dt {step}: period ratio {}", step / phase);
        assert!((step / phase / exact - 1.0).abs() < 1e-9 && (r - 1.0).abs() < 1e-9);
        let drift = energies.iter().map(|e| (e / energies[0] - 1.0).abs()).fold(0.0, f64::max);
        assert!(drift < 1e-12, "w dt {step}: energy drifts by {drift:e}");
    }
}

/// F2: damping ratio 0.05, by mass or by stiffness.
#[test]
fn a_damped_oscillator() {
    let omega = 2.0 * PI;
    for (dt, growth, frequency, ratio, exact_ratio) in
        [(0.1, 0.9718035, 6.082046, 0.0470263, 0.0469744), (0.25, 0.9525487, 5.325037, 0.0365174, 0.0364930)]
    {
        for damping in
            [Damping { mass: 2.0 * 0.05 * omega, stiffness: 0.0 }, Damping { mass: 0.0, stiffness: 2.0 * 0.05 / omega }]
        {
            let (places, _) = swing(omega, DynamicsSettings { damping, ..tight(dt) }, 20);
            let (r, phase) = amplification(&places[4..]);
            let decay = -r.ln();
            assert!((r - growth).abs() <= 0.6e-7, "dt {dt}: growth {r}");
            assert!((phase / dt - frequency).abs() <= 0.6e-6, "dt {dt}: frequency {}", phase / dt);
            assert!((decay / phase - ratio).abs() <= 0.6e-7, "dt {dt}: {}", decay / phase);
            assert!((decay / decay.hypot(phase) - exact_ratio).abs() <= 0.6e-7);
        }
    }
}

/// Backward Euler: `1 / |1 - i w dt|` per step.
#[test]
fn backward_euler_dissipates() {
    let (omega, dt) = (3.0, 0.2);
    let settings = DynamicsSettings { scheme: Scheme::BackwardEuler, ..tight(dt) };
    let (places, energies) = swing(omega, settings, 30);
    let (r, phase) = amplification(&places[10..]);
    assert!((r - 1.0 / (1.0f64).hypot(omega * dt)).abs() < 1e-9 && (phase - (omega * dt).atan()).abs() < 1e-9);
    assert!(energies.windows(2).all(|e| e[1] < e[0]));
}

/// A block of a soft solid without supports.
fn block<M: Hyperelastic<3>>(material: M, kind: MassKind) -> (SimplexMesh<3, 4>, Body<3, 4, M>) {
    let mesh = distorted_box::<3, 4>(3, 0.1, 4);
    let mut body = Body::new(&mesh, material, 1.0).unwrap();
    body.set_mass(kind, &Density::Uniform(1000.0)).unwrap();
    (mesh, body)
}

fn neo() -> NeoHookean {
    NeoHookean::from_young_poisson(YOUNG, 0.45).unwrap()
}

/// F3: free fall is the exact parabola, whatever the step.
#[test]
fn free_fall() {
    for (kind, solution) in [(MassKind::Lumped, Solution::Linearised), (MassKind::Consistent, NEWTON)] {
        for dt in [1e-3, 0.02, 0.3] {
            let (_, mut body) = block(neo(), kind);
            let free = Subspace::new(body.n_vertices());
            let mut weight = vec![0.0; body.dim()];
            body.add_gravity(&[0.0, -2.0, -9.81], &mut weight);
            let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
            let mut it = Integrator::new(DynamicsSettings { solution, ..tight(dt) }, &Team::serial());
            let mut state = it.start(&mut body, &free, &mut drive).unwrap();
            for _ in 0..10 {
                it.step(&mut body, &free, &mut drive, &mut state).unwrap();
            }
            let depth = 0.5 * (10.0 * dt) * (10.0 * dt);
            for u in state.u.chunks_exact(3) {
                let error = u[0].abs() + (u[1] + 2.0 * depth).abs() + (u[2] + 9.81 * depth).abs();
                assert!(error < 1e-10 * 9.81 * depth, "{kind:?}, dt {dt}: {u:?} at depth {depth}");
            }
        }
    }
}

/// A free body that swings and turns for 0.1 s: how much of its linear and of its angular momentum is lost.
fn momentum_lost(kind: MassKind, solution: Solution, dt: f64) -> [f64; 2] {
    let (mesh, mut body) = block(neo(), kind);
    let free = Subspace::new(body.n_vertices());
    let mut it = Integrator::new(DynamicsSettings { solution, balance: true, ..tight(dt) }, &Team::serial());
    let spin = |x: &[f64; 3]| [0.3 - 4.0 * x[1], 4.0 * x[0] + 2.0 * x[2], 0.1 - 2.0 * x[1]];
    let v: Vec<f64> = mesh.points().iter().flat_map(spin).collect();
    let u = random_vector(v.len(), 1e-3, 8);
    let mut state = it.start_moving(&mut body, &free, &mut nothing, u, v).unwrap();
    let moments = |body: &Body<3, 4, NeoHookean>, state: &State| {
        [body.momentum(&state.v), body.angular_momentum(mesh.points(), &state.u, &state.v)]
    };
    let before = moments(&body, &state);
    while state.t < 0.1 - 1e-9 {
        let report = it.step(&mut body, &free, &mut nothing, &mut state).unwrap();
        let balance = report.balance.unwrap();
        assert!(balance.strain > 1e-6 && balance.kinetic > 1e-3 && balance.momentum == body.momentum(&state.v));
    }
    let now = moments(&body, &state);
    let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    std::array::from_fn(|k| norm(std::array::from_fn(|i| now[k][i] - before[k][i])) / norm(before[k]))
}

/// Momentum stays what it was to the tolerance of the solves. Angular momentum is not kept by the trapezoid rule: what is
/// lost is of second order in the step.
#[test]
fn a_free_body_keeps_its_momentum() {
    for (kind, solution) in [(MassKind::Lumped, Solution::Linearised), (MassKind::Consistent, NEWTON)] {
        let [coarse, fine] = [2e-3, 1e-3].map(|dt| momentum_lost(kind, solution, dt));
        println!("{kind:?}: {coarse:?}, {fine:?}");
        assert!(coarse[0] < 1e-9 && fine[0] < 1e-9, "{kind:?}: momentum {coarse:?}, {fine:?}");
        assert!(fine[1] < 0.02 && coarse[1] / fine[1] > 3.0, "{kind:?}: angular momentum {coarse:?}, {fine:?}");
    }
}

/// A linear body keeps its energy to round-off, whatever its shape.
#[test]
fn a_linear_body_keeps_its_energy() {
    for (kind, dt) in [(MassKind::Lumped, 2e-3), (MassKind::Consistent, 0.05)] {
        let (mesh, mut body) = block(Linear::from_young_poisson(YOUNG, 0.45).unwrap(), kind);
        let held = clamped(&mesh, |x| x[2] < 1e-9);
        let mut weight = vec![0.0; body.dim()];
        body.add_gravity(&[0.0, 0.0, -9.81], &mut weight);
        let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
        let mut it = Integrator::new(DynamicsSettings { balance: true, ..tight(dt) }, &Team::serial());
        let mut state = it.start(&mut body, &held, &mut drive).unwrap();
        for _ in 0..100 {
            let balance = it.step(&mut body, &held, &mut drive, &mut state).unwrap().balance.unwrap();
            let size = balance.strain + balance.kinetic;
            assert!(size > 0.0 && balance.total().abs() < 1e-11 * size, "{kind:?}: {balance:?}");
        }
    }
}

/// The end of a cantilever let go under gravity, after 60 ms in steps of `dt`.
fn cantilever<M: Hyperelastic<3>>(material: M, solution: Solution, damping: Damping, dt: f64) -> Vec<f64> {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [0.1, 0.04, 0.04], [4, 1, 1]).unwrap();
    let mut body = Body::new(&mesh, material, 1.0).unwrap();
    body.set_mass(MassKind::Consistent, &Density::Uniform(1000.0)).unwrap();
    let held = clamped(&mesh, |x| x[0] < 1e-9);
    let mut weight = vec![0.0; body.dim()];
    body.add_gravity(&[0.0, 0.0, -9.81], &mut weight);
    let mut drive = |t: f64, drive: &mut Drive| {
        // Smooth, so that the order shows.
        let share = (t / 0.05).min(1.0);
        let share = share * share * (3.0 - 2.0 * share);
        drive.load.iter_mut().zip(&weight).for_each(|(load, weight)| *load = 4.0 * share * weight);
    };
    let mut settings = DynamicsSettings { solution, damping, ..tight(dt) };
    settings.stop.tolerance = 1e-10;
    settings.max_halvings = 0;
    let mut it = Integrator::new(settings, &Team::serial());
    let mut state = it.start(&mut body, &held, &mut drive).unwrap();
    while state.t < 0.06 - 1e-9 {
        let report = it.step(&mut body, &held, &mut drive, &mut state).unwrap();
        assert_eq!(report.substeps, 1);
    }
    state.u
}

/// The end state of a run in steps of a length.
type Run<'a> = &'a dyn Fn(f64) -> Vec<f64>;

/// F4: the error against a run of dt/16 falls fourfold with dt, for one linearised step as for Newton's method.
#[test]
fn second_order_in_time() {
    let stvk = StVenantKirchhoff::from_young_poisson(YOUNG, 0.3).unwrap();
    let runs: [(&str, Run); 4] = [
        ("NH, linearised", &|dt| cantilever(neo(), Solution::Linearised, Damping::default(), dt)),
        ("NH, Newton", &|dt| cantilever(neo(), NEWTON, Damping::default(), dt)),
        ("StVK, linearised", &|dt| cantilever(stvk, Solution::Linearised, Damping::default(), dt)),
        ("NH, mass damping", &|dt| cantilever(neo(), Solution::Linearised, Damping { mass: 5.0, stiffness: 0.0 }, dt)),
    ];
    for (name, run) in runs {
        let coarse = 4e-3;
        let reference = run(coarse / 16.0);
        let size = reference.iter().map(|u| u.abs()).fold(0.0, f64::max);
        let error = |dt: f64| run(dt).iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size;
        let errors = [error(coarse), error(coarse / 2.0), error(coarse / 4.0)];
        let drops = [errors[0] / errors[1], errors[1] / errors[2]];
        println!("{name}: errors {errors:?}, drops {drops:?}");
        // Against the run of dt/16 the drops of an error c dt^2 are (1 - 1/256) / (1/4 - 1/256) = 4.05 and 4.2.
        assert!(drops.iter().all(|&drop| drop > 3.6), "{name}: errors {errors:?}, drops {drops:?}");
        assert!(errors[2] < 0.02, "{name}: {errors:?}");
    }
}

/// A node that is led along a path is where the path says, and the body follows.
#[test]
fn prescribed_motion() {
    let (mesh, mut body) = block(neo(), MassKind::Lumped);
    let lid = |x: &[f64; 3]| x[2] > 0.1 - 1e-9;
    let held = clamped(&mesh, |x| x[2] < 1e-9 || lid(x));
    let path = |t: f64| (5e-3 * (1.0 - (20.0 * t).cos()), 0.1 * (20.0 * t).sin());
    let top: Vec<usize> = mesh.points().iter().enumerate().filter(|(_, x)| lid(x)).map(|(v, _)| v).collect();
    let mut drive = |t: f64, drive: &mut Drive| {
        for &v in &top {
            (drive.displacement[3 * v], drive.velocity[3 * v]) = path(t);
        }
    };
    for solution in [Solution::Linearised, NEWTON] {
        let settings = DynamicsSettings {
            solution,
            damping: Damping { mass: 0.0, stiffness: 5e-3 },
            ..DynamicsSettings::new(2e-3)
        };
        let mut it = Integrator::new(settings, &Team::serial());
        let mut state = it.start(&mut body, &held, &mut drive).unwrap();
        for _ in 0..200 {
            it.step(&mut body, &held, &mut drive, &mut state).unwrap();
        }
        let (place, velocity) = path(state.t);
        for &v in &top {
            assert!((state.u[3 * v] - place).abs() < 1e-12 && state.u[3 * v + 2].abs() < 1e-15);
            assert!((state.v[3 * v] - velocity).abs() < 1e-12);
        }
        // Slow beside the shear wave: near simple shear.
        let middle = mesh.points().iter().position(|x| (x[2] - 0.1 / 3.0).abs() < 1e-9 && x[0] < 1e-9).unwrap();
        let share = at::<3>(&state.u, VertexId::new(middle))[0] / place;
        assert!((share - 1.0 / 3.0).abs() < 0.1, "{solution:?}: {share}");
    }
}

/// States at the end of a run in the given settings.
fn run(settings: DynamicsSettings, team: &Team, steps: usize) -> (State, Body<3, 4, NeoHookean>, Integrator<3>) {
    let (mesh, mut body) = block(neo(), MassKind::Lumped);
    body.set_threads(team.size());
    let held = clamped(&mesh, |x| x[2] < 1e-9);
    let mut it = Integrator::new(settings, team);
    let mut weight = vec![0.0; body.dim()];
    body.add_gravity(&[3.0, 0.0, -9.81], &mut weight);
    let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
    let mut state = it.start(&mut body, &held, &mut drive).unwrap();
    for _ in 0..steps {
        it.step(&mut body, &held, &mut drive, &mut state).unwrap();
    }
    (state, body, it)
}

/// Steps of adaptive length hold the error down, and grow again.
#[test]
fn adaptive_steps() {
    let adaptive = stylet_physics::dynamics::Adaptive { tolerance: 2e-6, smallest: 1e-5, largest: 0.02 };
    let damping = Damping { mass: 0.0, stiffness: 0.02 };
    let settings = DynamicsSettings { adaptive: Some(adaptive), damping, ..tight(0.02) };
    let (mesh, mut body) = block(neo(), MassKind::Lumped);
    let held = clamped(&mesh, |x| x[2] < 1e-9);
    let mut it = Integrator::new(settings, &Team::serial());
    let mut weight = vec![0.0; body.dim()];
    body.add_gravity(&[0.0, 0.0, -9.81], &mut weight);
    let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
    let mut state = it.start(&mut body, &held, &mut drive).unwrap();
    let mut lengths = Vec::new();
    while state.t < 1.0 {
        let before = state.t;
        let report = it.step(&mut body, &held, &mut drive, &mut state).unwrap();
        assert!(report.error <= adaptive.tolerance || report.dt == adaptive.smallest);
        assert!((state.t - before - report.dt).abs() < 1e-12);
        lengths.push(report.dt);
    }
    assert!(lengths[0] < 0.01, "the release needs short steps: {}", lengths[0]);
    assert_eq!(*lengths.last().unwrap(), 0.02, "at rest steps are long");
}

/// A step that is too long for the material is made in parts: the linear answer to sixty times its weight turns the block
/// inside out.
#[test]
fn steps_are_halved_where_they_invert_elements() {
    let (mesh, mut body) = block(neo(), MassKind::Lumped);
    let held = clamped(&mesh, |x| x[2] < 1e-9);
    let damping = Damping { mass: 0.0, stiffness: 0.02 };
    let mut it = Integrator::new(DynamicsSettings { damping, ..tight(0.05) }, &Team::serial());
    let mut weight = vec![0.0; body.dim()];
    body.add_gravity(&[0.0, 0.0, -60.0 * 9.81], &mut weight);
    let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
    let mut state = it.start(&mut body, &held, &mut drive).unwrap();
    let mut parts = 0;
    for _ in 0..4 {
        let report = it.step(&mut body, &held, &mut drive, &mut state).unwrap();
        parts += report.substeps;
        assert!(body.smallest_jacobian(&state.u).unwrap().1 > 0.0);
    }
    assert!(parts > 4, "{parts} parts");
    assert!((state.t - 0.2).abs() < 1e-15);
}

/// A run that is saved and resumed has the bits of one that goes on, lazy or not; so has one on other threads.
#[test]
fn resumed_runs_have_the_same_bits() {
    for (solution, lazy) in [(Solution::Linearised, 0.0), (Solution::Linearised, 0.02), (NEWTON, 0.0)] {
        let damping = Damping { mass: 0.1, stiffness: 2e-3 };
        let settings = DynamicsSettings { solution, damping, ..DynamicsSettings::new(4e-3) };
        let make = || {
            let (mesh, mut body) = block(neo(), MassKind::Lumped);
            body.set_lazy(lazy);
            (clamped(&mesh, |x| x[2] < 1e-9), body)
        };
        let drive = &mut |t: f64, drive: &mut Drive| drive.load.iter_mut().for_each(|f| *f = 0.02 * (30.0 * t).sin());
        let (held, mut body) = make();
        let mut it = Integrator::new(settings, &Team::serial());
        let mut state = it.start(&mut body, &held, drive).unwrap();
        for _ in 0..8 {
            it.step(&mut body, &held, drive, &mut state).unwrap();
        }
        let text = serde_json::to_string(&it.save(&body, &state)).unwrap();
        let mut resumed: State = serde_json::from_str(&text).unwrap();
        let (_, mut other) = make();
        let mut again = Integrator::new(settings, &Team::serial());
        again.resume(&mut other, &held, &resumed).unwrap();
        for _ in 0..8 {
            let a = it.step(&mut body, &held, drive, &mut state).unwrap();
            let b = again.step(&mut other, &held, drive, &mut resumed).unwrap();
            assert_eq!(a, b, "{solution:?}, lazy {lazy}");
        }
        assert_eq!(it.save(&body, &state), again.save(&other, &resumed), "{solution:?}, lazy {lazy}");
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let mesh = distorted_box::<3, 4>(9, 0.1, 5); // above the size at which threads are used
    let run = |threads: usize, lazy: f64| {
        let mut body = Body::new(&mesh, neo(), 1.0).unwrap();
        body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
        body.set_threads(threads);
        body.set_lazy(lazy);
        let held = clamped(&mesh, |x| x[2] < 1e-9);
        let mut weight = vec![0.0; body.dim()];
        body.add_gravity(&[0.0, 0.0, -9.81], &mut weight);
        let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
        let mut it = Integrator::new(DynamicsSettings::new(5e-3), &Team::new(threads));
        let mut state = it.start(&mut body, &held, &mut drive).unwrap();
        for _ in 0..6 {
            it.step(&mut body, &held, &mut drive, &mut state).unwrap();
        }
        it.save(&body, &state)
    };
    for lazy in [0.0, 0.01] {
        let one = run(1, lazy);
        assert!(run(2, lazy) == one && run(8, lazy) == one, "lazy {lazy}");
    }
}

/// A step on a mesh that has not changed allocates nothing, whatever it solves.
#[test]
fn warm_steps_allocate_nothing() {
    for solution in [Solution::Linearised, NEWTON] {
        let (mesh, mut body) = block(neo(), MassKind::Lumped);
        let held = clamped(&mesh, |x| x[0] == 0.0);
        let mut weight = vec![0.0; body.dim()];
        body.add_gravity(&[0.0, 0.0, -9.81], &mut weight);
        let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
        let damping = Damping { mass: 1.0, stiffness: 1e-3 };
        let mut it = Integrator::new(DynamicsSettings { solution, damping, ..tight(2e-3) }, &Team::serial());
        let mut state = it.start(&mut body, &held, &mut drive).unwrap();
        let mut step = || {
            it.step(&mut body, &held, &mut drive, &mut state).unwrap();
        };
        (0..3).for_each(|_| step());
        assert_eq!(allocations(|| (0..5).for_each(|_| step())), 0, "{solution:?}");
    }
}

/// F4: what steps far longer than the motion dissipate. Backward Euler with Newton's method never gains energy and loses
/// nearly all of it; the trapezoid rule with one linearised step gains energy, or cannot be made.
#[test]
fn dissipation_of_large_steps() {
    let run = |scheme: Scheme, solution: Solution, dt: f64| {
        let (mesh, mut body) = block(neo(), MassKind::Lumped);
        let free = Subspace::new(body.n_vertices());
        let u: Vec<f64> = mesh.points().iter().flat_map(|x| [0.5 * x[0], -0.2 * x[1], -0.2 * x[2]]).collect();
        let mut settings = DynamicsSettings { scheme, solution, ..DynamicsSettings::new(dt) };
        settings.stop.tolerance = 1e-9;
        let mut it = Integrator::new(settings, &Team::serial());
        let rest = vec![0.0; u.len()];
        let mut state = it.start_moving(&mut body, &free, &mut nothing, u, rest).unwrap();
        let mut energies = vec![it.balance(&mut body, &state).total()];
        for _ in 0..20 {
            if it.step(&mut body, &free, &mut nothing, &mut state).is_err() {
                break;
            }
            energies.push(it.balance(&mut body, &state).total());
        }
        energies
    };
    // The block oscillates in about 20 ms.
    for (dt, left) in [(2e-3, 0.3), (20e-3, 1e-5), (200e-3, 1e-5)] {
        let energies = run(Scheme::BackwardEuler, NEWTON, dt);
        assert_eq!(energies.len(), 21, "dt {dt}");
        // Up to what the tolerance of the steps leaves.
        assert!(energies.windows(2).all(|e| e[1] <= e[0] + 1e-9 * energies[0]), "dt {dt}: {energies:?}");
        assert!(energies[20] < left * energies[0], "dt {dt}: {energies:?}");
    }
    let largest = |energies: &[f64]| energies.iter().fold(0.0f64, |most, e| most.max(e / energies[0]));
    let small = run(Scheme::TRAPEZOID, Solution::Linearised, 2e-3);
    assert!(small.len() == 21 && largest(&small) < 1.1, "{small:?}");
    let large = run(Scheme::TRAPEZOID, Solution::Linearised, 20e-3);
    assert!(largest(&large) > 2.0, "{large:?}");
}

#[test]
fn bad_input_is_an_error() {
    use stylet_physics::dynamics::DynamicsError;
    let (mesh, mut body) = block(neo(), MassKind::Lumped);
    let held = clamped(&mesh, |x| x[2] < 1e-9);
    let start = |settings: DynamicsSettings, body: &mut Body<3, 4, NeoHookean>, held: &Subspace<3>| {
        Integrator::new(settings, &Team::serial()).start(body, held, &mut nothing)
    };
    let good = DynamicsSettings::new(1e-3);
    for (name, settings) in [
        ("dt", DynamicsSettings { dt: 0.0, ..good }),
        ("dt", DynamicsSettings { dt: f64::NAN, ..good }),
        ("beta", DynamicsSettings { scheme: Scheme::Newmark { beta: 0.0, gamma: 0.5 }, ..good }),
        ("gamma", DynamicsSettings { scheme: Scheme::Newmark { beta: 0.25, gamma: 0.4 }, ..good }),
        ("damping.mass", DynamicsSettings { damping: Damping { mass: -1.0, stiffness: 0.0 }, ..good }),
        ("damping.stiffness", DynamicsSettings { damping: Damping { mass: 0.0, stiffness: f64::INFINITY }, ..good }),
        ("max_halvings", DynamicsSettings { max_halvings: 21, ..good }),
    ] {
        match start(settings, &mut body, &held) {
            Err(DynamicsError::Setting { name: found, .. }) => assert_eq!(found, name),
            other => panic!("{name}: {other:?}"),
        }
    }
    assert!(matches!(start(good, &mut body, &Subspace::new(3)), Err(DynamicsError::Shape { len: 9, .. })));
    let mut massless = Body::new(&mesh, neo(), 1.0).unwrap();
    assert_eq!(start(good, &mut massless, &held), Err(DynamicsError::NoMass));
    let mut it = Integrator::new(good, &Team::serial());
    let mut nan = |_: f64, drive: &mut Drive| drive.load[7] = f64::NAN;
    assert!(matches!(it.start(&mut body, &held, &mut nan), Err(DynamicsError::NotFinite { index: 7, .. })));
    // Turned inside out, where the law does not allow it.
    let inside_out: Vec<f64> = mesh.points().iter().flat_map(|x| [0.0, 0.0, -2.0 * x[2]]).collect();
    let mut it = Integrator::new(good, &Team::serial());
    let still = vec![0.0; inside_out.len()];
    let state = State { dt: 1e-3, u: inside_out, v: still.clone(), a: still, ..State::default() };
    let error = it.step(&mut body, &held, &mut nothing, &mut state.clone()).unwrap_err();
    assert!(matches!(error, DynamicsError::Inverted { .. }), "{error}");
    let _ = run(good, &Team::serial(), 1);
}
