//! The static driver: every method finds the same equilibrium, load steps adapt, failures name the culprit.

#[path = "../../examples/cook.rs"]
mod cook;

use crate::support::{YOUNG, clamped, random_vector, slab, stop};
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{Body, boundary_traction};
use stylet_physics::material::{Hyperelastic, Linear, NeoHookean, PlaneStress, StVenantKirchhoff};
use stylet_physics::statics::Preconditioning;
use stylet_physics::statics::{StaticError, StaticMethod, StaticReport, StaticSettings, StaticWorkspace, solve_static};
use stylet_solver::nonlinear::{Direction, StepModel};
use stylet_solver::stop::Stop;

/// A slab pulled to the left by `force` (N), clamped on the right.
fn pull<M: Hyperelastic<2>>(
    mesh: &SimplexMesh<2, 3>,
    material: M,
    force: f64,
    settings: &StaticSettings,
) -> (Result<StaticReport, StaticError>, Vec<f64>) {
    let mut body = Body::new(mesh, material, 0.01).unwrap();
    let mut load = vec![0.0; 2 * mesh.n_vertex_slots()];
    boundary_traction(mesh, 0.01, |x| x[0] < 1e-9, &[-force / 1e-3, 0.3 * force / 1e-3], &mut load).unwrap();
    let mut u = vec![0.0; load.len()];
    let subspace = clamped(mesh, |x| x[0] > 0.1 - 1e-9);
    let outcome = solve_static(&mut body, &subspace, &load, &mut u, settings, &mut StaticWorkspace::default());
    (outcome, u)
}

const METHODS: [StaticMethod; 3] = [
    StaticMethod::NewtonCg,
    StaticMethod::NonlinearCg { direction: Direction::PolakRibierePlus, step: StepModel::Curvature },
    StaticMethod::NonlinearCg { direction: Direction::PolakRibierePlus, step: StepModel::Secant },
];

#[test]
fn all_methods_find_one_equilibrium() {
    let mesh = slab(3, 5);
    let neo = PlaneStress::new(NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap());
    let linear = PlaneStress::new(Linear::from_young_poisson(YOUNG, 0.34).unwrap());
    for preconditioning in [Preconditioning::None, Preconditioning::Jacobi, Preconditioning::BlockJacobi] {
        let solutions: Vec<_> = METHODS
            .into_iter()
            .map(|method| {
                let settings = StaticSettings { preconditioning, ..StaticSettings::new(method, stop(1e-9)) };
                let (report, u) = pull(&mesh, neo, 2.0, &settings);
                assert_eq!(report.unwrap().stop, Stop::Converged);
                let (report, of_linear) = pull(&mesh, linear, 2.0, &settings);
                assert_eq!(report.unwrap().stop, Stop::Converged);
                (u, of_linear)
            })
            .collect();
        let cg = StaticSettings { preconditioning, ..StaticSettings::new(StaticMethod::Cg, stop(1e-9)) };
        let (report, by_cg) = pull(&mesh, linear, 2.0, &cg);
        assert_eq!(report.unwrap().stop, Stop::Converged);
        let largest = by_cg.iter().fold(0.0f64, |m, u| m.max(u.abs()));
        assert!(largest > 5e-3, "a load that moves the slab: {largest} m");
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        for (of_neo, of_linear) in &solutions {
            assert!(apart(of_neo, &solutions[0].0) <= 1e-6 * largest);
            assert!(apart(of_linear, &by_cg) <= 1e-6 * largest);
        }
        assert!(apart(&solutions[0].0, &by_cg) > 0.01 * largest, "the materials differ");
    }
}

#[test]
fn cook_example_rises_as_it_should() {
    // 5.321 in the limit; P1 triangles on 64 x 64 are stiffer by 2.4 %.
    let rise = cook::rise(64).unwrap();
    assert!((rise - 5.321).abs() < 0.03 * 5.321, "{rise}");
}

/// St. Venant-Kirchhoff has no equilibrium beyond its limit load in compression: the solve says so and keeps the last
/// equilibrium.
#[test]
fn a_collapse_is_an_error_that_names_the_cell() {
    let mesh = slab(3, 3);
    let stvk = StVenantKirchhoff::from_young_poisson(YOUNG, 0.0).unwrap();
    let settings = StaticSettings { max_iterations: 40, ..StaticSettings::new(StaticMethod::NewtonCg, stop(1e-8)) };
    // P(s) = E/2 (s^3 - s) is smallest at s = 1/sqrt 3: 0.192 E, here 6.5 N on 1e-3 m^2.
    let (outcome, u) = pull(&mesh, stvk, -20.0, &settings);
    let Err(StaticError::Blocked { load_factor, jacobian, .. }) = outcome else { panic!("{outcome:?}") };
    assert!(load_factor < 6.6 / 20.0, "equilibrium beyond the limit load: {load_factor}");
    assert!(jacobian.is_finite() && jacobian < 1.0);
    assert!(u.iter().all(|u| u.is_finite()));
    let body = Body::new(&mesh, stvk, 0.01).unwrap();
    assert!(body.inverted(&u).is_none() && body.strain_energy(&u).is_finite());
}

#[test]
fn bad_input_is_an_error() {
    let mesh = slab(2, 2);
    let neo = NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap();
    let newton = StaticSettings::new(StaticMethod::NewtonCg, stop(1e-8));
    assert!(matches!(
        pull(&mesh, neo, 1.0, &StaticSettings::new(StaticMethod::Cg, stop(1e-8))).0,
        Err(StaticError::NotLinear)
    ));
    for first_step in [0.0, -1.0, 2.0, f64::NAN] {
        let settings = StaticSettings { first_step, ..newton };
        assert!(matches!(pull(&mesh, neo, 1.0, &settings).0, Err(StaticError::LoadStep { name: "first_step", .. })));
    }
    assert!(matches!(
        pull(&mesh, neo, 1.0, &StaticSettings::new(StaticMethod::NewtonCg, stop(-1.0))).0,
        Err(StaticError::StopRule(_))
    ));
    assert!(pull(&mesh, neo, f64::NAN, &newton).0.is_err());
    let linear = Linear::from_young_poisson(YOUNG, 0.34).unwrap();
    let short = StaticSettings { max_iterations: 2, ..StaticSettings::new(StaticMethod::Cg, stop(1e-8)) };
    assert!(matches!(pull(&mesh, linear, 1.0, &short).0, Err(StaticError::IterationLimit { iterations: 2, .. })));

    let mut body = Body::new(&mesh, neo, 0.01).unwrap();
    let subspace = clamped(&mesh, |x| x[0] > 0.1 - 1e-9);
    let n = 2 * mesh.n_vertex_slots();
    let mut tangled = random_vector(n, 0.1, 1);
    let load = vec![0.0; n];
    let mut ws = StaticWorkspace::default();
    let outcome = solve_static(&mut body, &subspace, &load, &mut tangled, &newton, &mut ws);
    let Err(StaticError::InvertedAtStart { cell, jacobian }) = outcome else { panic!("{outcome:?}") };
    assert!(jacobian <= 0.0 && mesh.is_live(cell));
    let outcome = solve_static(&mut body, &subspace, &load[1..], &mut tangled, &newton, &mut ws);
    assert!(matches!(outcome, Err(StaticError::Shape { what: "the load", .. })));
}
