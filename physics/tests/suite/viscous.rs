//! Bodies damped by the rates of stretching: the matrix against the stress, its invariants, and motions.

use crate::support::{YOUNG, clamped, distorted_box, random_vector};
use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};
use proptest::prelude::*;
use stylet_mesh::{MeshChange, SimplexMesh, geometry};
use stylet_physics::body::{Body, BodyError, Density, MassKind};
use stylet_physics::dynamics::{Damping, Drive, DynamicsSettings, Integrator, Solution};
use stylet_physics::material::{Corotated, Hyperelastic, Lame, Linear, NeoHookean, RotationTangent, Viscosity};
use stylet_solver::LinearOperator;
use stylet_solver::energy::Energy;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;
use stylet_solver::vector::{dot, norm2};

const TAU: f64 = 5e-3;

fn neo() -> NeoHookean {
    NeoHookean::from_young_poisson(YOUNG, 0.4).unwrap()
}

fn viscous<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, viscosity: Viscosity) -> Body<D, N, NeoHookean>
where
    NeoHookean: Hyperelastic<D>,
{
    let mut body = Body::new(mesh, neo(), 0.7).unwrap();
    body.set_viscosity(0, viscosity).unwrap();
    body
}

/// Forces of the rates `v` at `u`, element by element from the stress.
fn forces<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    viscosity: &Viscosity,
    u: &[f64],
    v: &[f64],
) -> Vec<f64> {
    let mut force = vec![0.0; u.len()];
    for cell in mesh.cells() {
        let gradients = geometry::gradients(&mesh.corners(cell)).unwrap();
        let vertices = mesh.cell(cell);
        let gradient = |field: &[f64]| {
            SMatrix::<f64, D, D>::from_fn(|i, k| {
                (0..N).map(|a| field[vertices[a].index() * D + i] * gradients[a][k]).sum::<f64>()
            })
        };
        let stress = viscosity.stress(&(SMatrix::identity() + gradient(u)), &gradient(v));
        for a in 0..N {
            for i in 0..D {
                let pull: f64 = (0..D).map(|k| stress[(i, k)] * gradients[a][k]).sum();
                force[vertices[a].index() * D + i] += 0.7 * mesh.volume(cell) * pull;
            }
        }
    }
    force
}

fn product<const D: usize>(matrix: &BlockCsr<D>, v: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; v.len()];
    matrix.apply(v, &mut out);
    out
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Inverted elements too.
    #[test]
    fn the_matrix_gives_the_forces_of_the_stress(psi in 1.0..100.0f64, share in -0.6..10.0f64, size in 0.0..0.06f64, seed in 0..1000u64) {
        let viscosity = Viscosity::new(psi, share * psi).unwrap();
        let (flat, solid) = (distorted_box::<2, 3>(3, 0.1, seed), distorted_box::<3, 4>(2, 0.1, seed));
        check(&flat, &viscosity, size, seed)?;
        check(&solid, &viscosity, size, seed)?;
    }

    /// A body that turns without strain is not held back.
    #[test]
    fn turning_costs_nothing(axis in prop::array::uniform3(-2.0..2.0f64), spin in prop::array::uniform3(-2.0..2.0f64)) {
        let mesh = distorted_box::<3, 4>(2, 0.1, 5);
        let mut body = viscous(&mesh, Viscosity::new(3.0, 20.0).unwrap());
        let (turn, spin) = (Rotation3::new(Vector3::from(axis)).into_inner(), Vector3::from(spin));
        let (mut u, mut v) = (Vec::new(), Vec::new());
        for x in mesh.points() {
            let x = Vector3::from(*x);
            u.extend(((turn - Matrix3::identity()) * x).iter());
            v.extend(spin.cross(&(turn * x)).iter());
        }
        body.evaluate_damping(&u).unwrap();
        let matrix = body.damping().unwrap().0;
        let scale = norm2(&product(matrix, &random_vector(v.len(), 0.2, 1)));
        prop_assert!(norm2(&product(matrix, &v)) <= 1e-12 * scale);
    }
}

fn check<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    viscosity: &Viscosity,
    size: f64,
    seed: u64,
) -> Result<(), TestCaseError>
where
    NeoHookean: Hyperelastic<D>,
{
    let mut body = viscous(mesh, *viscosity);
    let (u, v) = (random_vector(body.dim(), size, seed), random_vector(body.dim(), 1.0, seed + 1));
    body.evaluate_damping(&u).unwrap();
    let matrix = body.damping().unwrap().0;
    let (found, expected) = (product(matrix, &v), forces(mesh, viscosity, &u, &v));
    let error = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    prop_assert!(error <= 1e-10 * norm2(&expected), "{error:e} against {:e}", norm2(&expected));
    prop_assert!(dot(&v, &found) >= 0.0);
    let w = random_vector(v.len(), 1.0, seed + 2);
    let (across, back) = (dot(&w, &found), dot(&v, &product(matrix, &w)));
    prop_assert!((across - back).abs() <= 1e-12 * norm2(&found) * norm2(&w));
    Ok(())
}

/// The bits of one made afresh, in whatever parts, by however many threads.
#[test]
fn the_matrix_follows_the_mesh() {
    let mut mesh = distorted_box::<3, 4>(8, 0.1, 3);
    let viscosity = Viscosity::new(3.0, 20.0).unwrap();
    let mut body = viscous(&mesh, viscosity);
    for k in 0..3 {
        let mut change = MeshChange::default();
        mesh.refine_around([0.03 + 0.02 * f64::from(k), 0.04, 0.05], 0.01, &mut change).unwrap();
        body.apply_change(&mesh, &change).unwrap();
        let u = random_vector(body.dim(), 1e-3, 9);
        body.evaluate_damping(&u).unwrap();
        for (threads, parts) in [(1, false), (2, false), (8, false), (2, true)] {
            let mut fresh = viscous(&mesh, viscosity);
            fresh.set_threads(threads);
            if parts {
                let parts: Vec<u32> = (0..fresh.n_vertices() as u32).map(|vertex| vertex * 7 % 5).collect();
                fresh.set_partition(&parts).unwrap();
            }
            fresh.evaluate_damping(&u).unwrap();
            assert!(fresh.damping().unwrap().0 == body.damping().unwrap().0, "{threads} threads, parts: {parts}");
        }
    }
}

/// Kelvin and Voigt's solid is what damping in proportion to a stiffness with held rotations is, in every solution.
#[test]
fn kelvin_and_voigt_is_damping_by_the_stiffness() {
    let law = Corotated::from_young_poisson(YOUNG, 0.4).unwrap().with_rotation(RotationTangent::Held);
    let linear = Linear::from_young_poisson(YOUNG, 0.4).unwrap();
    for solution in [Solution::Linearised, Solution::Newton { max_iterations: 50 }] {
        agree(law, law.lame(), solution);
        agree(linear, linear.lame(), solution);
    }
}

fn agree<M: Hyperelastic<3>>(law: M, lame: Lame, solution: Solution) {
    let mesh = distorted_box::<3, 4>(2, 0.1, 5);
    let run = |by_stiffness: bool| {
        let mut body = Body::new(&mesh, law.clone(), 1.0).unwrap();
        if !by_stiffness {
            body.set_viscosity(0, Viscosity::kelvin_voigt(lame, TAU).unwrap()).unwrap();
        }
        let damping = Damping { mass: 0.0, stiffness: if by_stiffness { TAU } else { 0.0 } };
        let u = swing(&mesh, &mut body, damping, solution, 20);
        assert!(u.iter().any(|u| u.abs() > 1e-3));
        u
    };
    let (expected, found) = (run(true), run(false));
    let error = expected.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(error < 1e-10, "{solution:?}: {error:e} m");
}

/// Where a held body is after some steps under its weight, thrown upwards.
fn swing<M: Hyperelastic<3>>(
    mesh: &SimplexMesh<3, 4>,
    body: &mut Body<3, 4, M>,
    damping: Damping,
    solution: Solution,
    steps: usize,
) -> Vec<f64> {
    body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
    let held = clamped(mesh, |x| x[0] < 1e-9);
    let mut weight = vec![0.0; body.dim()];
    body.add_gravity(&[0.0, 0.0, -9.81], &mut weight);
    let mut drive = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
    let mut settings = DynamicsSettings { solution, damping, ..DynamicsSettings::new(2e-3) };
    settings.stop.tolerance = 1e-12;
    let mut it = Integrator::new(settings, &Team::serial());
    let mut v = vec![0.0; body.dim()];
    for (node, x) in mesh.points().iter().enumerate() {
        v[3 * node + 2] = 5.0 * x[0];
    }
    let rest = vec![0.0; body.dim()];
    let mut state = it.start_moving(body, &held, &mut drive, rest, v).unwrap();
    for _ in 0..steps {
        it.step(body, &held, &mut drive, &mut state).unwrap();
    }
    state.u
}

/// Newton's method on a viscous body minimises what it differentiates, and one viscous region calms the whole.
#[test]
fn a_viscous_region_takes_the_energy_of_a_body() {
    let start = distorted_box::<3, 4>(3, 0.1, 5);
    let cells: Vec<[u32; 4]> = start.cells().map(|cell| start.cell(cell).map(|v| v.0)).collect();
    let regions =
        start.cells().map(|cell| u32::from(start.corners(cell).iter().map(|x| x[0]).sum::<f64>() > 0.2)).collect();
    let mesh = SimplexMesh::with_regions(start.points().to_vec(), cells, regions).unwrap();
    let energy = |viscous: bool| {
        let mut body = Body::with_materials(&mesh, &[(0, neo()), (1, neo())], 1.0).unwrap();
        if viscous {
            body.set_viscosity(1, Viscosity::new(30.0, 60.0).unwrap()).unwrap();
            let missing = body.set_viscosity(7, Viscosity::new(30.0, 60.0).unwrap());
            assert!(matches!(missing, Err(BodyError::UnknownRegion { region: 7, .. })), "{missing:?}");
        }
        body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
        let free = Subspace::new(body.n_vertices());
        let u: Vec<f64> = mesh.points().iter().flat_map(|x| [0.1 * x[0], -0.05 * x[1], 0.0]).collect();
        let solution = Solution::Newton { max_iterations: 50 };
        let mut it = Integrator::new(DynamicsSettings { solution, ..DynamicsSettings::new(2e-3) }, &Team::serial());
        let rest = vec![0.0; u.len()];
        let mut nothing = |_: f64, _: &mut Drive| ();
        let mut state = it.start_moving(&mut body, &free, &mut nothing, u, rest).unwrap();
        let before = it.balance(&mut body, &state).total();
        for _ in 0..100 {
            it.step(&mut body, &free, &mut nothing, &mut state).unwrap();
        }
        it.balance(&mut body, &state).total() / before
    };
    let (calmed, free) = (energy(true), energy(false));
    assert!(free > 0.9 && calmed < 0.05, "{calmed} of the energy is left, {free} without viscosity");
}

/// A body without viscosity keeps nothing for it.
#[test]
fn bodies_without_viscosity_pay_nothing() {
    let mesh = distorted_box::<3, 4>(2, 0.1, 5);
    let mut body = Body::new(&mesh, neo(), 1.0).unwrap();
    body.linearize(&vec![0.0; body.dim()]);
    let before = body.memory_bytes();
    body.evaluate_damping(&vec![0.0; body.dim()]).unwrap();
    assert!(body.damping().is_none() && !body.is_viscous());
    assert_eq!(body.memory_bytes(), before);
}
