//! Forces and tangents of rods against differences of energies and forces, and what a rigid motion leaves as it is.

use crate::support::allocations::allocations;
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use stylet_physics::rod::{HeldEnds, Rod, RodLoad, RodPotential, RodStiffness, Tangent, parallel_transport};
use stylet_solver::LinearOperator;
use stylet_solver::check::{taylor_gradient, taylor_hessian};
use stylet_solver::energy::Energy;
use stylet_solver::sparse::BlockCsr;

const DIRECTOR: [f64; 3] = [0.0, 1.0, 0.0];
/// Stretch, bending and twist of one order of magnitude at these lengths: no term hides another.
const STIFFNESS: RodStiffness = RodStiffness { bending: 1.3, twisting: 0.9, stretching: 4.0 };

/// A random curved, twisted and stretched rod that begins roughly along the first axis.
#[derive(Clone, Debug)]
struct Case {
    rod: Rod,
    x: Vec<f64>,
}

fn case(natural: f64) -> impl Strategy<Value = Case> {
    (2..7usize)
        .prop_flat_map(move |edges| {
            let numbers = |len, size: f64| {
                proptest::collection::vec(-1.0..=1.0f64, len)
                    .prop_map(move |v| v.into_iter().map(|x| x * size).collect::<Vec<_>>())
            };
            (numbers(3 * edges, 0.7), numbers(edges, 0.3), numbers(edges, 2.0), numbers(2 * (edges - 1), natural))
        })
        .prop_map(|(turns, lengths, angles, natural)| {
            let mut rod = Rod::new(lengths.iter().map(|l| 1.0 + l).collect(), STIFFNESS, 1.0).unwrap();
            rod.set_angles(&angles).unwrap();
            rod.set_rest_curvatures(natural.as_chunks::<2>().0).unwrap();
            let mut x = vec![0.1, -0.2, 0.3];
            for d in turns.as_chunks::<3>().0 {
                let from = x[x.len() - 3..].to_vec();
                x.extend([from[0] + 1.0 + 0.5 * d[0], from[1] + d[1], from[2] + d[2]]);
            }
            Case { rod, x }
        })
}

impl Case {
    /// The rod with its nodes moved by `h` along `p`, and no edge spun.
    fn moved(&self, p: &[f64], h: f64) -> Self {
        let x: Vec<f64> = self.x.iter().zip(p).map(|(x, p)| x + h * p).collect();
        let mut rod = self.rod.clone();
        rod.carry_angles(&self.x, &DIRECTOR, &x, &DIRECTOR).unwrap();
        Self { rod, x }
    }

    fn energy(&mut self) -> f64 {
        self.rod.energy(&self.x, &DIRECTOR)
    }

    fn forces(&mut self, twist: bool) -> Vec<f64> {
        let mut force = vec![0.0; self.x.len()];
        self.rod.add_force(&self.x, &DIRECTOR, &mut force);
        if twist {
            self.rod.add_twist_force(&self.x, &DIRECTOR, &mut force);
        }
        force
    }

    fn tangent(&mut self, kind: Tangent, twist: bool) -> BlockCsr<3> {
        let mut matrix = BlockCsr::new(0);
        self.rod.tangent(&self.x, &DIRECTOR, kind, twist, &mut matrix);
        matrix
    }

    /// Twisting moments as they are, whatever the angles: what twist is to a rod whose angles are in equilibrium.
    fn twist_forces_at_moments_of(&mut self, other: &Self) -> Vec<f64> {
        let mut force = vec![0.0; self.x.len()];
        self.rod.set_angles(other.rod.angles()).unwrap();
        self.rod.add_twist_force(&self.x, &DIRECTOR, &mut force);
        force
    }
}

fn unit(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|i| f64::from(i == k)).collect()
}

fn dense(matrix: &BlockCsr<3>, n: usize) -> Vec<Vec<f64>> {
    (0..n)
        .map(|k| {
            let mut column = vec![0.0; n];
            matrix.apply(&unit(n, k), &mut column);
            column
        })
        .collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    let error = norm(&found.iter().zip(expected).map(|(a, b)| a - b).collect::<Vec<_>>());
    assert!(error <= tolerance * (norm(expected) + 1.0), "{error:e}: {found:?} for {expected:?}");
}

/// Symmetric part of the central differences of `forces`, with the sign of a stiffness, columns one after the other.
fn differences(n: usize, forces: impl Fn(&[f64], f64) -> Vec<f64>) -> Vec<f64> {
    // The fourth-order formula: truncation and rounding errors are both below the tolerance.
    let h = 1e-3;
    let columns: Vec<Vec<f64>> = (0..n)
        .map(|k| {
            let p = unit(n, k);
            let at = [-2.0, -1.0, 1.0, 2.0].map(|s: f64| forces(&p, s * h));
            (0..n).map(|i| -(at[0][i] - 8.0 * at[1][i] + 8.0 * at[2][i] - at[3][i]) / (12.0 * h)).collect()
        })
        .collect();
    let symmetric = |i: usize, j: usize| 0.5 * (columns[i][j] + columns[j][i]);
    (0..n * n).map(|at| symmetric(at / n, at % n)).collect()
}

proptest! {

    #[test]
    fn forces_are_the_gradient_of_the_energy(mut case in case(1.5)) {
        let n = case.x.len();
        let force = case.forces(true);
        let found: Vec<f64> = (0..n).map(|k| {
            let (p, h) = (unit(n, k), 1e-3);
            let at = [-2.0, -1.0, 1.0, 2.0].map(|s: f64| case.moved(&p, s * h).energy());
            -(at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * h)
        }).collect();
        assert_close(&found, &force, 1e-6);
    }

    #[test]
    fn tangents_are_the_derivative_of_the_forces(mut case in case(1.5)) {
        let n = case.x.len();
        let matrix = case.tangent(Tangent::Exact, false);
        let found = differences(n, |p, h| case.moved(p, h).forces(false));
        assert_close(&dense(&matrix, n).concat(), &found, 1e-6);
    }

    #[test]
    fn twist_adds_its_tangent_at_constant_moments(mut case in case(0.0)) {
        let n = case.x.len();
        let (with, without) = (case.tangent(Tangent::Exact, true), case.tangent(Tangent::Exact, false));
        let found = differences(n, |p, h| case.moved(p, h).twist_forces_at_moments_of(&case));
        let twist: Vec<f64> =
            dense(&with, n).concat().iter().zip(dense(&without, n).concat()).map(|(a, b)| a - b).collect();
        assert_close(&twist, &found, 1e-6);
    }

    #[test]
    fn the_gauss_newton_tangent_is_semidefinite(mut case in case(1.5)) {
        let n = case.x.len();
        let matrix = case.tangent(Tangent::GaussNewton, false);
        let columns = dense(&matrix, n);
        let m = nalgebra::DMatrix::from_fn(n, n, |i, j| columns[j][i]);
        prop_assert!((&m - m.transpose()).norm() < 1e-12 * m.norm());
        let smallest = m.symmetric_eigen().eigenvalues.min();
        prop_assert!(smallest > -1e-12, "{smallest:e}");
    }

    #[test]
    fn rigid_motions_change_nothing(mut case in case(1.5), axis in [-3.0..3.0f64, -3.0..3.0, -3.0..3.0]) {
        let turn = Rotation3::new(Vector3::from(axis));
        let rotate = |v: &[f64]| v.as_chunks::<3>().0.iter().flat_map(|v| <[f64; 3]>::from(turn * Vector3::from(*v))).collect::<Vec<_>>();
        let x: Vec<f64> = rotate(&case.x).iter().enumerate().map(|(k, x)| x + [3.0, -1.0, 2.0][k % 3]).collect();
        let director: [f64; 3] = (turn * Vector3::from(DIRECTOR)).into();
        let energy = case.energy();
        prop_assert!((case.rod.energy(&x, &director) - energy).abs() < 1e-12 * (1.0 + energy));
        let expected = rotate(&case.forces(true));
        let mut force = vec![0.0; x.len()];
        case.rod.add_force(&x, &director, &mut force);
        case.rod.add_twist_force(&x, &director, &mut force);
        assert_close(&force, &expected, 1e-11);
    }

    #[test]
    fn forces_have_no_resultant(mut case in case(1.5)) {
        let (bending, all) = (case.forces(false), case.forces(true));
        let size = norm(&all) + 1.0;
        for force in [bending, all] {
            let sum = force.as_chunks::<3>().0.iter().fold(Vector3::zeros(), |sum, f| sum + Vector3::from(*f));
            prop_assert!(sum.norm() < 1e-12 * size, "{sum:?}");
        }
    }
}

#[test]
fn a_rod_at_rest_bears_no_force() {
    // Naturally bent and twisted: laid out from its own curvatures.
    let mut case = Case { rod: Rod::new(vec![0.5; 12], STIFFNESS, 1.0).unwrap(), x: Vec::new() };
    let natural: Vec<[f64; 2]> =
        (0..11).map(|i| [0.8 * (0.3 * f64::from(i)).cos(), 0.8 * (0.3 * f64::from(i)).sin()]).collect();
    case.rod.set_rest_curvatures(&natural).unwrap();
    let (mut at, mut t, mut u) = (Vector3::zeros(), Vector3::new(1.0, 0.0, 0.0), Vector3::from(DIRECTOR));
    case.x.extend(at.iter());
    for k in natural.iter().map(Some).chain([None]) {
        at += t * 0.5;
        case.x.extend(at.iter());
        let Some(k) = k else { break };
        // |kb| = 2 tan(angle / 2) about the axis perpendicular to curvature and tangent.
        let v = t.cross(&u);
        let (curvature, size) = (u * k[0] + v * k[1], 0.5 * k[0].hypot(k[1]));
        let axis = nalgebra::Unit::new_normalize(t.cross(&curvature));
        let next = Rotation3::from_axis_angle(&axis, 2.0 * (0.5 * size).atan()) * t;
        u = Vector3::from(parallel_transport(u.into(), t.into(), next.into()));
        t = next;
    }
    assert!(case.energy() < 1e-28);
    assert!(norm(&case.forces(true)) < 1e-13);
}

#[test]
fn a_known_tangent_is_written_in_place() {
    let x: Vec<f64> = (0..6).flat_map(|i| [f64::from(i), 0.1 * f64::from(i * i), 0.0]).collect();
    let mut case = Case { rod: Rod::new(vec![1.0; 5], STIFFNESS, 1.0).unwrap(), x };
    let mut matrix = case.tangent(Tangent::Exact, false);
    let before = matrix.clone();
    let mut force = vec![0.0; case.x.len()];
    let mut frames = Vec::with_capacity(5);
    case.rod.tangent(&case.x, &DIRECTOR, Tangent::GaussNewton, true, &mut matrix);
    let allocated = allocations(|| {
        case.rod.add_force(&case.x, &DIRECTOR, &mut force);
        case.rod.add_twist_force(&case.x, &DIRECTOR, &mut force);
        case.rod.frames(&case.x, &DIRECTOR, &mut frames);
        case.rod.tangent(&case.x, &DIRECTOR, Tangent::Exact, false, &mut matrix);
    });
    assert_eq!(allocated, 0);
    assert_eq!(matrix, before);
    assert_eq!((matrix.row(0).0, matrix.row(3).0), (&[0, 1, 2][..], &[1, 2, 3, 4, 5][..]));
}

#[test]
fn the_potential_of_a_loaded_rod_has_the_right_derivatives() {
    // A straight rod has no twist when one end is free: the tangent is the whole second derivative.
    let mut rod = Rod::new(vec![1.0, 0.8, 1.2, 1.0, 0.9], STIFFNESS, 1.0).unwrap();
    let x = crate::support::random_vector(18, 0.4, 7);
    let x: Vec<f64> = x.iter().enumerate().map(|(i, x)| x + if i % 3 == 0 { (i / 3) as f64 } else { 0.0 }).collect();
    let load = RodLoad { forces: crate::support::random_vector(18, 1.0, 8), couple: [0.3, -0.7, 1.1] };
    let ends = HeldEnds { start: Some(0.4), end: None };
    let direction = crate::support::random_vector(18, 0.5, 9);
    let mut potential = RodPotential::new(&mut rod, DIRECTOR, &load, &ends).unwrap();
    for order in [taylor_gradient(&mut potential, &x, &direction), taylor_hessian(&mut potential, &x, &direction)] {
        assert!((1.9..2.1).contains(&order), "order {order}");
    }
}

#[test]
fn held_ends_make_forces_that_are_the_gradient_of_what_is_left() {
    // Naturally curved, wound up, both ends held in space on edges that stay where they are.
    let mut rod = Rod::new(vec![1.0; 7], STIFFNESS, 1.0).unwrap();
    let natural: Vec<[f64; 2]> = (0..6).map(|i| [0.3, 0.1 * f64::from(i)]).collect();
    rod.set_rest_curvatures(&natural).unwrap();
    rod.set_angles(&[0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]).unwrap();
    let x = crate::support::random_vector(24, 0.3, 17);
    let x: Vec<f64> = x.iter().enumerate().map(|(i, x)| x + if i % 3 == 0 { (i / 3) as f64 } else { 0.0 }).collect();
    let mut direction = crate::support::random_vector(24, 0.5, 19);
    direction[..6].fill(0.0);
    direction[18..].fill(0.0);
    let load = RodLoad::new(8);
    let ends = HeldEnds { start: Some(0.0), end: Some([0.1, -0.9, 0.2]) };
    let mut potential = RodPotential::new(&mut rod, DIRECTOR, &load, &ends).unwrap();
    let order = taylor_gradient(&mut potential, &x, &direction);
    assert!((1.9..2.1).contains(&order), "order {order}");
}

#[test]
fn places_without_frames_have_no_energy_to_stay_at() {
    let mut rod = Rod::new(vec![1.0; 3], STIFFNESS, 1.0).unwrap();
    let (load, ends) = (RodLoad::new(4), HeldEnds { start: Some(0.0), end: Some(DIRECTOR) });
    let mut potential = RodPotential::new(&mut rod, DIRECTOR, &load, &ends).unwrap();
    let folded = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let flat = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0];
    for x in [folded, flat] {
        assert_eq!(potential.value(&x), f64::INFINITY);
        let mut g = [0.0; 12];
        potential.gradient(&x, &mut g);
        assert!(g.iter().any(|g| g.is_nan()));
    }
}
