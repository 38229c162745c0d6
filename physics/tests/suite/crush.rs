//! A crushed or scrambled cube comes back to rest, for laws that are defined under inversion: validation sheet J1 and J2 on a
//! small mesh, at Poisson's ratio 0.3.

use crate::support::{YOUNG, clamped, random};
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::dynamics::{Damping, Drive, DynamicsSettings, Integrator, Scheme, Solution};
use stylet_physics::material::{Corotated, FixedCorotated, Hyperelastic, StableNeoHookean};
use stylet_solver::team::Team;
use stylet_solver::vector::norm2;

const SIDE: f64 = 0.1;

/// Where a vertex is at the start.
type Crush = fn(&[f64; 3], &mut u64) -> [f64; 3];

fn crushes() -> [(&'static str, Crush); 4] {
    [
        ("point", |_, _| [0.5 * SIDE; 3]),
        ("plane", |x, _| [x[0], x[1], 0.0]),
        ("line", |x, _| [0.5 * SIDE, 0.5 * SIDE, x[2]]),
        ("scramble", |_, state| std::array::from_fn(|_| 0.5 * SIDE * (1.0 + random(state)))),
    ]
}

/// How a run went.
struct Recovery {
    /// Largest displacement at the end, in sides.
    size: f64,
    /// Smallest `J` at the end.
    jacobian: f64,
    /// Simulated time, s.
    t: f64,
    newton: usize,
    /// Steps that ended above the tolerance.
    unconverged: u32,
}

fn recover<M: Hyperelastic<3>>(material: M, cells: usize, crush: Crush) -> Recovery {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [SIDE; 3], [cells; 3]).unwrap();
    let mut body = Body::new(&mesh, material, 1.0).unwrap();
    body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
    let held = clamped(&mesh, |x| x[2] < 1e-9);
    let mut seed = 7;
    let start = |x: &[f64; 3]| {
        let to = if x[2] < 1e-9 { *x } else { crush(x, &mut seed) };
        std::array::from_fn::<f64, 3, _>(|k| to[k] - x[k])
    };
    let u: Vec<f64> = mesh.points().iter().flat_map(start).collect();
    let damping = Damping { mass: 0.0, stiffness: 0.01 };
    let solution = Solution::Newton { max_iterations: 300 };
    let mut settings =
        DynamicsSettings { scheme: Scheme::BackwardEuler, solution, damping, ..DynamicsSettings::new(0.01) };
    settings.stop.tolerance = 1e-4;
    let mut it = Integrator::new(settings, &Team::serial());
    let mut nothing = |_: f64, _: &mut Drive| ();
    let v = vec![0.0; u.len()];
    let mut state = it.start_moving(&mut body, &held, &mut nothing, u, v).unwrap();
    let (mut newton, mut unconverged) = (0, 0);
    let mut forces = vec![0.0; state.u.len()];
    body.internal_force(&state.u, &mut forces);
    let elastic = norm2(&forces);
    while state.t < 10.0 {
        let step = it.step(&mut body, &held, &mut nothing, &mut state).unwrap();
        // The first step too is measured by the forces that it starts from, not by those of a place it will not go to.
        assert!(newton > 0 || step.threshold < 0.1 * elastic, "{} N against {elastic} N", step.threshold);
        (newton, unconverged) = (newton + step.newton_iterations, unconverged + step.unconverged);
        let size = state.u.iter().fold(0.0f64, |m, u| m.max(u.abs()));
        let speed = state.v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if size < 1e-4 * SIDE && speed < 1e-3 * SIDE {
            break;
        }
    }
    let size = state.u.iter().fold(0.0f64, |m, u| m.max(u.abs())) / SIDE;
    let jacobian = body.smallest_jacobian(&state.u).unwrap().1;
    Recovery { size, jacobian, t: state.t, newton, unconverged }
}

fn all<M: Hyperelastic<3>>(name: &str, material: M, cells: usize) {
    for (crush, start) in crushes() {
        let Recovery { size, jacobian, t, newton, unconverged } = recover(material.clone(), cells, start);
        println!("{name} from a {crush}: {size:.1e} of the side, J > {jacobian:.4}, {t:.2} s, {newton} Newton steps");
        assert!(size < 1e-3 && jacobian > 0.0, "{name} from a {crush}: {size} of the side, smallest J {jacobian}");
        // With so many Newton steps none needs to end early.
        assert_eq!(unconverged, 0, "{name} from a {crush}");
    }
}

#[test]
fn corotated() {
    all("corotated", Corotated::from_young_poisson(YOUNG, 0.3).unwrap(), 4);
}

#[test]
fn fixed_corotated() {
    all("fixed corotated", FixedCorotated::from_young_poisson(YOUNG, 0.3).unwrap(), 4);
}

#[test]
fn stable_neo_hookean() {
    all("stable neo-Hookean", StableNeoHookean::from_young_poisson(YOUNG, 0.3).unwrap(), 4);
}
