//! Validation sheet J on small meshes: an inverted element (J3), contrast (J4), threads (J12), and laws that refuse inversion.

use crate::support::{YOUNG, clamped, solve};
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{CellId, SimplexMesh};
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::dynamics::{Damping, Drive, DynamicsError, DynamicsSettings, Integrator, Scheme, Solution, State};
use stylet_physics::material::{NeoHookean, Solid, StVenantKirchhoff};
use stylet_solver::energy::Energy;
use stylet_solver::team::Team;

const SIDE: f64 = 0.1;

fn tetrahedron(solid: Solid) -> Body<3, 4, Solid> {
    let corners = [[0.0; 3], [SIDE, 0.0, 0.0], [0.0, SIDE, 0.0], [0.0, 0.0, SIDE]];
    let mesh = SimplexMesh::<3, 4>::new(corners.to_vec(), vec![[0, 1, 2, 3]]).unwrap();
    Body::new(&mesh, solid, 1.0).unwrap()
}

/// Force on the last node towards where it came from, `beyond` heights behind the opposite face.
fn force_back(body: &mut Body<3, 4, Solid>, beyond: f64) -> f64 {
    let (mut u, mut internal) = ([0.0; 12], [0.0; 12]);
    u[11] = -(1.0 + beyond) * SIDE;
    body.internal_force(&u, &mut internal);
    -internal[11]
}

#[test]
fn a_node_pushed_through_the_opposite_face_is_pushed_back() {
    for poisson in [0.3, 0.45, 0.495] {
        for model in ["linear", "corotated", "fixed-corotated", "stable-neo-hookean"] {
            let mut body = tetrahedron(Solid::from_young_poisson(model, YOUNG, poisson).unwrap());
            // From one height to three the shortest way back for corotated elasticity is half a turn, not through the face.
            let depths: &[f64] = if model == "corotated" { &[0.5, 5.0] } else { &[0.5, 1.0, 5.0] };
            for &depth in depths {
                let force = force_back(&mut body, depth);
                assert!(force.is_finite() && force > 0.0, "{model}, {poisson}, {depth} heights: {force} N");
            }
            let (before, after) = (force_back(&mut body, -1e-9), force_back(&mut body, 1e-9));
            assert!((after - before).abs() < 1e-6 * before, "{model}, {poisson}: {before} N, {after} N");
        }
    }
}

#[test]
fn bone_hardly_moves_beside_fat() {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [SIDE; 3], [4; 3]).unwrap();
    let ids: Vec<CellId> = mesh.cells().collect();
    let height = |cell: CellId| mesh.corners(cell).iter().map(|x| 0.25 * x[2]).sum::<f64>();
    let regions = ids.iter().map(|&cell| if height(cell) < 0.5 * SIDE { 1 } else { 2 }).collect();
    let cells = ids.iter().map(|&cell| mesh.cell(cell).map(|v| v.0)).collect();
    let mesh = SimplexMesh::<3, 4>::with_regions(mesh.points().to_vec(), cells, regions).unwrap();
    let held = clamped(&mesh, |x| x[2] < 1e-9);
    for model in ["linear", "neo-hookean", "corotated", "fixed-corotated", "stable-neo-hookean"] {
        let layer = |young| Solid::from_young_poisson(model, young, 0.3).unwrap();
        let mut body = Body::with_materials(&mesh, &[(1, layer(1e9)), (2, layer(1e4))], 1.0).unwrap();
        body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
        let (mut load, mut u) = (vec![0.0; body.dim()], vec![0.0; body.dim()]);
        body.add_gravity(&[9.81, 0.0, 0.0], &mut load);
        solve(&mut body, &held, &load, &mut u, 1e-6);
        let largest = |upper: bool| {
            let moved = mesh.points().iter().zip(u.as_chunks::<3>().0).filter(|(x, _)| (x[2] > 0.5001 * SIDE) == upper);
            moved.flat_map(|(_, u)| u).fold(0.0_f64, |most, u| most.max(u.abs()))
        };
        let (bone, fat) = (largest(false), largest(true));
        assert!(fat > 1e-3 * SIDE && bone < 1e-4 * fat, "{model}: bone {bone} m, fat {fat} m");
    }
}

/// A cube flattened onto its bottom after 60 steps on some threads.
fn flattened(model: &str, threads: usize) -> State {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [SIDE; 3], [4; 3]).unwrap();
    let mut body = Body::new(&mesh, Solid::from_young_poisson(model, YOUNG, 0.3).unwrap(), 1.0).unwrap();
    body.set_threads(threads);
    body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
    let held = clamped(&mesh, |x| x[2] < 1e-9);
    let settings = DynamicsSettings {
        scheme: Scheme::BackwardEuler,
        solution: Solution::Newton { max_iterations: 100 },
        damping: Damping { mass: 0.0, stiffness: 1e-3 },
        ..DynamicsSettings::new(5e-3)
    };
    let mut it = Integrator::new(settings, &Team::new(threads));
    let u: Vec<f64> = mesh.points().iter().flat_map(|x| [0.0, 0.0, -x[2]]).collect();
    let mut nothing = |_: f64, _: &mut Drive| ();
    let rest = vec![0.0; u.len()];
    let mut state = it.start_moving(&mut body, &held, &mut nothing, u, rest).unwrap();
    for _ in 0..60 {
        it.step(&mut body, &held, &mut nothing, &mut state).unwrap();
    }
    state
}

#[test]
fn threads_do_not_change_the_bits_of_a_recovery() {
    for model in ["linear", "corotated", "fixed-corotated", "stable-neo-hookean"] {
        let bits = |threads| {
            let state = flattened(model, threads);
            [state.u, state.v, state.a].concat().iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        };
        let one = bits(1);
        assert!([2, 8].into_iter().all(|threads| bits(threads) == one), "{model}");
    }
}

#[test]
fn laws_that_end_at_flat_elements_refuse_a_crushed_start() {
    let solids = [
        Solid::NeoHookean(NeoHookean::from_young_poisson(YOUNG, 0.3).unwrap()),
        Solid::StVenantKirchhoff(StVenantKirchhoff::from_young_poisson(YOUNG, 0.3).unwrap()),
    ];
    for solid in solids {
        let mut body = tetrahedron(solid);
        body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
        let held = stylet_solver::subspace::Subspace::new(4);
        let mut u = vec![0.0; 12];
        u[11] = -2.0 * SIDE;
        let mut it = Integrator::new(DynamicsSettings::new(1e-3), &Team::serial());
        let refused = it.start_moving(&mut body, &held, &mut |_, _| (), u, vec![0.0; 12]);
        let Err(DynamicsError::Inverted { cell, jacobian, t }) = refused else { panic!("{refused:?}") };
        assert!(cell == CellId(0) && (jacobian + 1.0).abs() < 1e-12 && t == 0.0);
    }
}
