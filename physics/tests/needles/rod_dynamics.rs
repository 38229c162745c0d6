//! Rods in time: periods and damping of a mode, conservation, order, and what must not blow up.

use crate::support::allocations::allocations;
use crate::support::rods::{DIRECTOR, End, Straight};
use nalgebra::{DMatrix, SymmetricEigen};
use stylet_physics::dynamics::{Damping, Scheme, Solution};
use stylet_physics::rod::{
    HeldEnds, Rod, RodBalance, RodDynamicsError, RodDynamicsSettings, RodIntegrator, RodLoad, RodState,
    RodStaticSettings, RodStep, RodStiffness, Tangent, solve_rod,
};
use stylet_solver::LinearOperator;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;

const SOFT: RodStiffness = RodStiffness { bending: 1.0, twisting: 0.75, stretching: 2e3 };
/// Nitinol wire, 0.83 mm.
const WIRE: RodStiffness = RodStiffness { bending: 1.397763e-3, twisting: 1.05e-3, stretching: 32464.0 };
const NEWTON: Solution = Solution::Newton { max_iterations: 200 };

/// A rod, what acts on it, and where it is.
struct Run {
    rod: Rod,
    settings: RodDynamicsSettings,
    load: RodLoad,
    ends: HeldEnds,
    subspace: Subspace<3>,
    state: RodState,
    integrator: RodIntegrator,
}

impl Run {
    fn new(rod: Straight, settings: RodDynamicsSettings) -> Self {
        let load = RodLoad::new(rod.n_nodes());
        let state = RodState::at_rest(rod.x, DIRECTOR);
        let (rod, subspace) = (rod.rod, rod.subspace);
        Self { rod, settings, load, ends: HeldEnds::default(), subspace, state, integrator: RodIntegrator::new() }
    }

    fn start(&mut self) {
        let Self { settings, load, ends, subspace, .. } = self;
        self.integrator.start(&mut self.rod, &RodStep { settings, load, ends, subspace }, &mut self.state).unwrap();
    }

    fn step(&mut self) -> Result<(), RodDynamicsError> {
        let Self { settings, load, ends, subspace, .. } = self;
        let step = RodStep { settings, load, ends, subspace };
        self.integrator.step(&mut self.rod, &step, &mut self.state).map(|_| ())
    }

    fn balance(&mut self) -> RodBalance {
        RodBalance::of(&mut self.rod, &self.state)
    }
}

/// A lateral mode of the straight rod: circular frequency and shape.
fn mode(rod: &mut Rod, x: &[f64], subspace: &Subspace<3>, number: usize) -> (f64, Vec<f64>) {
    let n = x.len();
    let mut matrix = BlockCsr::new(0);
    rod.tangent(x, &DIRECTOR, Tangent::Exact, false, &mut matrix);
    let mut k = DMatrix::zeros(n, n);
    for j in 0..n {
        let (mut unit, mut column) = (vec![0.0; n], vec![0.0; n]);
        unit[j] = 1.0;
        subspace.project(&mut unit);
        matrix.apply(&unit, &mut column);
        subspace.project(&mut column);
        for i in 0..n {
            k[(i, j)] = column[i] / (rod.node_mass(i / 3) * rod.node_mass(j / 3)).sqrt();
        }
    }
    let eigen = SymmetricEigen::new(k);
    let lateral = |v: usize| (0..n / 3).map(|i| eigen.eigenvectors[(3 * i + 1, v)].powi(2)).sum::<f64>() > 0.999;
    let mut order: Vec<usize> = (0..n).filter(|&v| eigen.eigenvalues[v] > 1e-6 && lateral(v)).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let v = order[number];
    let shape = (0..n).map(|i| eigen.eigenvectors[(i, v)] / rod.node_mass(i / 3).sqrt()).collect();
    (eigen.eigenvalues[v].sqrt(), shape)
}

/// Amplitudes of a mode at the ends of steps, in units of the first one.
fn swing(steps: usize, w_dt: f64, damping: impl Fn(f64) -> Damping) -> (Run, Vec<f64>) {
    let mut c = Straight::cantilever(1.0, 12, SOFT);
    // The plane across the other direction of bending: the modes there come in no pairs.
    for node in 2..c.n_nodes() {
        c.subspace.set(node, stylet_solver::subspace::Constraint::Plane([0.0, 0.0, 1.0])).unwrap();
    }
    let (w, shape) = mode(&mut c.rod, &c.x, &c.subspace, 1);
    let settings = RodDynamicsSettings { damping: damping(w), ..RodDynamicsSettings::new(w_dt / w) };
    let mut run = Run::new(c, settings);
    let rest = run.state.x.clone();
    let size = 1e-7;
    run.state.x.iter_mut().zip(&shape).for_each(|(x, s)| *x += size * s);
    run.start();
    let mut amplitudes = Vec::new();
    for _ in 0..=steps {
        let q: f64 =
            (0..rest.len()).map(|i| run.rod.node_mass(i / 3) * shape[i] * (run.state.x[i] - rest[i])).sum::<f64>();
        amplitudes.push(q / size);
        run.step().unwrap();
    }
    (run, amplitudes)
}

#[test]
fn a_mode_has_the_period_of_the_trapezoid_rule() {
    for (w_dt, ratio) in [(0.1, 1.000833), (0.5, 1.020497), (1.0, 1.078405), (2.0, 1.273240), (5.0, 2.100329)] {
        let (_, q) = swing(200, w_dt, |_| Damping::default());
        // q(k+1) + q(k-1) = 2 cos(phase) q(k)
        let (mut products, mut squares) = (0.0, 0.0);
        for k in 1..200 {
            products += (q[k + 1] + q[k - 1]) * q[k];
            squares += 2.0 * q[k] * q[k];
        }
        let phase = (products / squares).acos();
        println!("w dt {w_dt}: {}", w_dt / phase);
        assert!((w_dt / phase - ratio).abs() < 2e-6, "w dt {w_dt}: {}", w_dt / phase);
        let largest = q.iter().fold(0.0_f64, |m, q| m.max(q.abs()));
        assert!((largest - 1.0).abs() < 2e-2 * w_dt.max(1.0), "{largest}");
    }
}

#[test]
fn a_mode_is_damped_as_the_theory_says() {
    // Half of the ratio 0.05 from the mass, half from the stiffness; w = 2 pi.
    let damping = |w: f64| Damping { mass: 0.05 * w, stiffness: 0.05 / w };
    for (dt, r, phase) in [(0.1, 0.9718035, 6.082046 * 0.1), (0.25, 0.9525487, 5.325037 * 0.25)] {
        let (_, q) = swing(12, std::f64::consts::TAU * dt, damping);
        let wedge = |k: usize| q[k] * q[k] - q[k + 1] * q[k - 1];
        let found = (wedge(8) / wedge(7)).sqrt();
        assert!((found - r).abs() < 1e-6, "dt {dt}: {found}");
        let cos = (q[8] + found * found * q[6]) / (2.0 * found * q[7]);
        assert!((cos.acos() - phase).abs() < 2e-6, "dt {dt}: {}", cos.acos());
    }
}

#[test]
fn a_falling_rod_is_on_the_parabola() {
    for solution in [Solution::Linearised, NEWTON] {
        let mut free = Straight::new(0.2, 10, [End::Free; 2], WIRE);
        free.subspace = Subspace::new(free.n_nodes());
        let settings = RodDynamicsSettings { solution, ..RodDynamicsSettings::new(0.01) };
        let mut run = Run::new(free, settings);
        run.load.add_weight(&run.rod, &[0.0, 0.0, -9.81]);
        run.start();
        for _ in 0..20 {
            run.step().unwrap();
        }
        for node in run.state.x.as_chunks::<3>().0 {
            assert!((node[2] + 0.5 * 9.81 * 0.04).abs() < 1e-11, "{}", node[2]);
        }
    }
}

/// A free straight rod, set off turning and bending.
fn tumbling(settings: RodDynamicsSettings) -> Run {
    let mut free = Straight::new(1.0, 8, [End::Free; 2], SOFT);
    free.subspace = Subspace::new(free.n_nodes());
    let mut run = Run::new(free, settings);
    for (node, v) in run.state.v.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        let s = node as f64 / 8.0 - 0.5;
        *v = [0.3, 4.0 * s, 8.0 * s * s - 0.5];
    }
    run.start();
    run
}

/// A rod that is naturally curved out of every plane, clamped where it is straight and let go.
fn curling(settings: RodDynamicsSettings) -> Run {
    let mut clamped = Straight::cantilever(1.0, 8, SOFT);
    let natural: Vec<[f64; 2]> = (0..7).map(|i| [1.2, 1.0 - 0.4 * f64::from(i)]).collect();
    clamped.rod.set_rest_curvatures(&natural).unwrap();
    let mut run = Run::new(clamped, settings);
    run.ends.start = Some(0.0);
    run.start();
    run
}

#[test]
fn a_tumbling_rod_keeps_momentum_and_energy() {
    let settings = RodDynamicsSettings {
        solution: NEWTON,
        implicit_twist: true,
        tolerance: 1e-12,
        ..RodDynamicsSettings::new(1e-3)
    };
    let mut run = tumbling(settings);
    let before = run.balance();
    for _ in 0..500 {
        run.step().unwrap();
    }
    let after = run.balance();
    for k in 0..3 {
        assert!((after.momentum[k] - before.momentum[k]).abs() < 1e-10);
        // Not conserved exactly by the trapezoid rule.
        assert!((after.angular_momentum[k] - before.angular_momentum[k]).abs() < 1e-3);
    }
    let drift = (after.elastic + after.kinetic) / (before.elastic + before.kinetic) - 1.0;
    println!("{before:?} {after:?} energy drift {drift:e}");
    assert!(drift.abs() < 1e-3, "{drift:e}");
}

/// Orders of the error at `t = 0.1` against steps of a sixteenth.
fn orders(make: fn(RodDynamicsSettings) -> Run, solution: Solution, implicit_twist: bool) -> Vec<f64> {
    let end = |dt: f64| {
        let settings =
            RodDynamicsSettings { solution, implicit_twist, tolerance: 1e-11, ..RodDynamicsSettings::new(dt) };
        let mut run = make(settings);
        for _ in 0..(0.1 / dt).round() as usize {
            run.step().unwrap();
        }
        run.state.x
    };
    let reference = end(1e-3 / 16.0);
    let errors =
        [1e-3, 5e-4, 2.5e-4].map(|dt| end(dt).iter().zip(&reference).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt());
    println!("{solution:?} implicit twist {implicit_twist}: {errors:?}");
    errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect()
}

#[test]
fn the_trapezoid_rule_is_of_second_order() {
    type Make = fn(RodDynamicsSettings) -> Run;
    let cases = [(curling as Make, NEWTON), (tumbling, NEWTON), (tumbling, Solution::Linearised)];
    for (make, solution) in cases {
        let orders = orders(make, solution, true);
        assert!(orders.iter().all(|order| (1.8..2.4).contains(order)), "{solution:?}: {orders:?}");
    }
}

#[test]
fn what_is_left_out_of_the_tangent_leaves_first_order() {
    // Linearised steps do not see the angles follow the positions; explicit twist is that at the start of the step.
    for (solution, implicit_twist) in [(Solution::Linearised, true), (Solution::Linearised, false), (NEWTON, false)] {
        let orders = orders(curling, solution, implicit_twist);
        assert!(orders.iter().all(|&order| order > 0.9), "{solution:?}, {implicit_twist}: {orders:?}");
    }
}

#[test]
fn a_damped_rod_comes_to_rest_where_statics_say() {
    let c = Straight::cantilever(1.0, 12, SOFT);
    let (mut rod, subspace, mut x) = (c.rod.clone(), c.subspace.clone(), c.x.clone());
    let settings =
        RodDynamicsSettings { scheme: Scheme::BackwardEuler, solution: NEWTON, ..RodDynamicsSettings::new(10.0) };
    let mut run = Run::new(c, settings);
    run.load.forces[3 * 12 + 1] = 2.0;
    run.load.couple[0] = 0.2;
    run.load.couple[2] = 0.5;
    run.start();
    for _ in 0..30 {
        run.step().unwrap();
    }
    let statics = RodStaticSettings { tolerance: 1e-10, ..RodStaticSettings::default() };
    solve_rod(&mut rod, DIRECTOR, &run.load, &run.ends, &subspace, &mut x, &statics).unwrap();
    for (dynamic, at_rest) in run.state.x.iter().zip(&x) {
        assert!((dynamic - at_rest).abs() < 1e-7, "{dynamic} {at_rest}");
    }
}

#[test]
fn a_wound_rod_writhes_above_the_critical_torque_alone() {
    for (share, implicit_twist) in [(0.85, false), (0.85, true), (1.2, false), (1.2, true)] {
        let n = 20;
        let mut s = Straight::new(0.2, n, [End::Clamped; 2], WIRE);
        let torque = share * 8.98682 * WIRE.bending / 0.2;
        let angles: Vec<f64> = (0..n).map(|j| j as f64 * s.h * torque / WIRE.twisting).collect();
        s.rod.set_angles(&angles).unwrap();
        let settings = RodDynamicsSettings { implicit_twist, ..RodDynamicsSettings::new(1e-4) };
        let mut run = Run::new(s, settings);
        let (sin, cos) = angles[n - 1].sin_cos();
        run.ends = HeldEnds { start: Some(0.0), end: Some([0.0, cos, sin]) };
        for node in 2..n - 1 {
            run.state.x[3 * node + 1] = 1e-6 * (std::f64::consts::PI * node as f64 / n as f64).sin().powi(2);
        }
        run.start();
        let mut largest = 0.0_f64;
        for _ in 0..4000 {
            run.step().unwrap();
            largest = run.state.x.as_chunks::<3>().0.iter().fold(largest, |m, x| m.max(x[1].hypot(x[2])));
        }
        println!("{share} implicit {implicit_twist}: {largest:e}");
        assert_eq!(largest > 1e-4, share > 1.0, "{share} of the critical torque: deflection {largest:e} m");
    }
}

/// Largest relative change of the length of a needle whose base is moved to and fro across it by 1 mm at 100 Hz.
fn stretch_of_shaken(settings: RodDynamicsSettings) -> f64 {
    let mut run = Run::new(Straight::cantilever(0.2, 40, WIRE), settings);
    run.rod = Rod::new(run.rod.rest_lengths().to_vec(), WIRE, 3.5e-3).unwrap();
    run.start();
    let rest: f64 = run.rod.rest_lengths().iter().sum();
    let w = std::f64::consts::TAU * 100.0;
    let mut largest = 0.0_f64;
    for _ in 0..400 {
        let middle = run.state.t + 0.5 * settings.dt;
        for node in 0..2 {
            run.state.v[3 * node + 1] = 1e-3 * w * (w * middle).cos();
        }
        run.step().unwrap();
        let nodes = run.state.x.as_chunks::<3>().0;
        let edge = |e: &[[f64; 3]]| (0..3).map(|k| (e[1][k] - e[0][k]).powi(2)).sum::<f64>().sqrt();
        largest = largest.max((nodes.windows(2).map(edge).sum::<f64>() / rest - 1.0).abs());
    }
    largest
}

#[test]
fn a_shaken_needle_keeps_its_length() {
    for dt in [1e-3, 2e-3, 1e-2] {
        // Linearised steps overshoot in stretch, which the trapezoid rule alone never forgets.
        let damping = Damping { mass: 0.0, stiffness: 1e-4 };
        let damped = RodDynamicsSettings { tangent: Tangent::GaussNewton, damping, ..RodDynamicsSettings::new(dt) };
        let euler = RodDynamicsSettings { scheme: Scheme::BackwardEuler, ..RodDynamicsSettings::new(dt) };
        let solved = RodDynamicsSettings { solution: NEWTON, ..euler };
        for (settings, bound) in [(damped, 0.002), (euler, 0.002), (solved, 1e-5)] {
            let largest = stretch_of_shaken(settings);
            assert!(largest < bound, "length changes by {largest:e} with {settings:?}");
        }
    }
}

#[test]
fn a_refused_step_changes_nothing() {
    let mut run = Run::new(Straight::cantilever(0.2, 8, WIRE), RodDynamicsSettings::new(1e-3));
    run.start();
    let (rod, state) = (run.rod.clone(), run.state.clone());
    run.settings.dt = -1.0;
    assert!(matches!(run.step(), Err(RodDynamicsError::Setting { name: "dt", .. })));
    run.settings.dt = 1e-3;
    run.load.forces[7] = f64::NAN;
    assert!(matches!(run.step(), Err(RodDynamicsError::Rod(_))));
    run.load.forces.pop();
    assert!(matches!(run.step(), Err(RodDynamicsError::Rod(_))));
    run.load = RodLoad::new(9);
    run.load.forces[25] = 1.0;
    run.settings.solution = Solution::Newton { max_iterations: 0 };
    assert!(matches!(run.step(), Err(RodDynamicsError::NotConverged { .. })));
    assert_eq!((&run.rod, &run.state), (&rod, &state));
}

#[test]
fn warm_linearised_steps_allocate_nothing() {
    for tangent in [Tangent::Exact, Tangent::GaussNewton] {
        let mut run = curling(RodDynamicsSettings { tangent, ..RodDynamicsSettings::new(1e-3) });
        (0..2).for_each(|_| run.step().unwrap());
        assert_eq!(allocations(|| run.step().unwrap()), 0);
    }
}

#[test]
fn a_run_is_resumed_from_a_file() {
    let settings = RodDynamicsSettings { implicit_twist: true, ..RodDynamicsSettings::new(1e-3) };
    let mut whole = tumbling(settings);
    (0..5).for_each(|_| whole.step().unwrap());
    let text = serde_json::to_string(&(&whole.rod, &whole.state)).unwrap();
    let mut resumed = tumbling(settings);
    (resumed.rod, resumed.state) = serde_json::from_str(&text).unwrap();
    for run in [&mut whole, &mut resumed] {
        (0..5).for_each(|_| run.step().unwrap());
    }
    assert_eq!((&whole.rod, &whole.state), (&resumed.rod, &resumed.state));
}
