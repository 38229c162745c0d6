//! Angles of rods: in equilibrium, carried, and refused.

use crate::support::rods::{DIRECTOR, End, Straight};
use proptest::prelude::*;
use stylet_physics::rod::{HeldEnds, Rod, RodError, RodStiffness};

const STIFFNESS: RodStiffness = RodStiffness { bending: 1.4e-3, twisting: 1.05e-3, stretching: 3.2e4 };

fn straight(n: usize) -> Straight {
    Straight::new(0.2, n, [End::Pinned; 2], STIFFNESS)
}

#[test]
fn a_free_end_follows_the_base_without_twist() {
    let mut s = straight(12);
    s.rod.settle_angles(&s.x, &DIRECTOR, Some(0.7), None, None).unwrap();
    assert!(s.rod.angles().iter().all(|&a| a == 0.7));
    assert!(s.rod.energy(&s.x, &DIRECTOR) < 1e-20);
    assert_eq!(s.rod.twist_torque(), 0.0);
}

#[test]
fn two_held_ends_share_the_twist_evenly() {
    let mut s = straight(12);
    s.rod.settle_angles(&s.x, &DIRECTOR, Some(0.0), Some(5.0), None).unwrap();
    // Angles belong to the middles of edges: the length between the ends that are held is one edge less.
    let torque = STIFFNESS.twisting * 5.0 / (0.2 - s.h);
    for node in 1..12 {
        assert!((s.rod.twisting_moment(node) - torque).abs() < 1e-12 * torque);
    }
    assert!((s.rod.twist_torque() + torque).abs() < 1e-12 * torque);
    assert!((s.rod.base_torque(&s.x, &DIRECTOR).unwrap() + torque).abs() < 1e-12 * torque);
    // A straight rod bears its twist without force.
    let mut force = vec![0.0; s.x.len()];
    s.rod.add_twist_force(&s.x, &DIRECTOR, &mut force);
    assert!(force.iter().all(|f| f.abs() < 1e-12 * torque));
}

#[test]
fn torques_along_the_shaft_wind_it_up() {
    // Friction `q` per length against a base that is turned: the angle lags by `q s (L - s / 2) / GJ`.
    let (n, q) = (20, -0.003);
    let mut s = straight(n);
    let torques = vec![q * s.h; n];
    s.rod.settle_angles(&s.x, &DIRECTOR, Some(1.0), None, Some(&torques)).unwrap();
    for (j, angle) in s.rod.angles().iter().enumerate() {
        // Exact sum of the discrete rod.
        let lag: f64 = (1..=j).map(|node| q * s.h * (n - node) as f64 * s.h / STIFFNESS.twisting).sum();
        assert!((angle - 1.0 - lag).abs() < 1e-12, "edge {j}: {angle}");
    }
    let base = s.rod.base_torque(&s.x, &DIRECTOR).unwrap();
    assert!((base + q * s.h * (n - 1) as f64).abs() < 1e-12);
}

proptest! {
    /// Energies at angles that are moved from those in equilibrium are higher, and the torque that is left is none.
    #[test]
    fn settled_angles_minimise_the_energy(
        y in proptest::collection::vec([-0.01..0.01f64, -0.01..0.01], 9),
        natural in proptest::collection::vec([-40.0..40.0f64, -40.0..40.0], 7),
        start in proptest::option::of(-3.0..3.0f64),
        end in proptest::option::of(-3.0..3.0f64),
        moved in proptest::collection::vec(-1.0..1.0f64, 8),
    ) {
        let mut s = straight(8);
        for (x, y) in s.x.as_chunks_mut::<3>().0.iter_mut().zip(&y) {
            x[1..].copy_from_slice(y);
        }
        s.rod.set_rest_curvatures(&natural).unwrap();
        s.rod.settle_angles(&s.x, &DIRECTOR, start, end, None).unwrap();
        let angles = s.rod.angles().to_vec();
        prop_assert!(start.is_none_or(|a| angles[0] == a) && end.is_none_or(|a| angles[7] == a));
        let at = |h: f64| {
            let mut rod = s.rod.clone();
            let moved: Vec<f64> = angles.iter().enumerate().map(|(j, a)| {
                let held = (j == 0 && start.is_some()) || (j == 7 && end.is_some());
                a + if held { 0.0 } else { h * moved[j] }
            }).collect();
            rod.set_angles(&moved).unwrap();
            rod.energy(&s.x, &DIRECTOR)
        };
        let (low, high, here) = (at(-1e-3), at(1e-3), at(0.0));
        let slope = (high - low) / 2e-3;
        prop_assert!(slope.abs() < 1e-7 * (1.0 + here), "slope {slope:e}");
        prop_assert!(low + high > 2.0 * here - 1e-14, "not a minimum: {low} {here} {high}");
    }

    /// A rod bent and brought back with its edges not spinning has its old angles, whichever the configuration between.
    #[test]
    fn angles_are_carried_there_and_back(y in proptest::collection::vec([-0.01..0.01f64, -0.01..0.01], 9)) {
        let mut s = straight(8);
        s.rod.settle_angles(&s.x, &DIRECTOR, Some(0.0), Some(9.0), None).unwrap();
        let mut bent = s.x.clone();
        for (x, y) in bent.as_chunks_mut::<3>().0.iter_mut().zip(&y) {
            x[1..].copy_from_slice(y);
        }
        let before = s.rod.angles().to_vec();
        s.rod.carry_angles(&s.x, &DIRECTOR, &bent, &DIRECTOR).unwrap();
        s.rod.carry_angles(&bent, &DIRECTOR, &s.x, &DIRECTOR).unwrap();
        for (a, b) in s.rod.angles().iter().zip(&before) {
            prop_assert!((a - b).abs() < 1e-12);
        }
    }
}

#[test]
fn an_end_held_in_space_is_twisted_by_the_way_of_the_rod() {
    // A quarter turn up, a quarter turn aside, a quarter turn back: the solid angle within is an eighth of the sphere.
    let stiffness = RodStiffness { bending: 1.0, twisting: 2.0, stretching: 1.0 };
    let mut rod = Rod::new(vec![1.0; 4], stiffness, 1.0).unwrap();
    let x = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]].concat();
    let director = [0.0, 1.0, 0.0];
    let angle = rod.angle_towards(&x, &director, 3, &director).unwrap();
    assert!((angle.abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{angle}");
    let ends = HeldEnds { start: Some(0.0), end: Some(director) };
    rod.settle_held(&x, &director, &ends).unwrap();
    for node in 1..4 {
        assert!((rod.twisting_moment(node) - 2.0 * angle / 3.0).abs() < 1e-12);
    }
    let mut frames = Vec::new();
    rod.frames(&x, &director, &mut frames);
    let m1 = frames[3][1];
    assert!((0..3).all(|k| (m1[k] - director[k]).abs() < 1e-12), "{m1:?}");
}

#[test]
fn another_discretisation_is_another_rod() {
    let mut s = straight(4);
    let (lengths, angles, natural) = ([0.03, 0.07, 0.1], [0.1, 0.2, 0.4], [[1.0, 0.0], [0.0, 2.0]]);
    s.rod.replace(&lengths, &angles, &natural).unwrap();
    let mut other = Rod::new(lengths.to_vec(), STIFFNESS, 1.0).unwrap();
    other.set_angles(&angles).unwrap();
    other.set_rest_curvatures(&natural).unwrap();
    assert_eq!(s.rod, other);
    let x = [0.0, 0.0, 0.0, 0.03, 0.0, 0.0, 0.1, 0.01, 0.0, 0.2, 0.0, 0.01];
    assert_eq!(s.rod.energy(&x, &DIRECTOR), other.energy(&x, &DIRECTOR));
    // Where it is finer or coarser, the mass follows.
    let mass: f64 = (0..4).map(|node| s.rod.node_mass(node)).sum();
    assert!((mass - 0.2).abs() < 1e-15);
    s.rod.set_rest_length(1, 0.05).unwrap();
    assert_eq!((s.rod.node_length(0), s.rod.node_length(1), s.rod.node_length(3)), (0.015, 0.04, 0.05));
}

#[test]
fn bad_input_is_refused_and_changes_nothing() {
    let mut s = straight(4);
    let before = s.rod.clone();
    let rod = &mut s.rod;
    assert!(matches!(Rod::new(vec![], STIFFNESS, 1.0), Err(RodError::Shape { .. })));
    assert!(matches!(Rod::new(vec![1.0, 0.0], STIFFNESS, 1.0), Err(RodError::Entry { index: 1, .. })));
    assert!(matches!(Rod::new(vec![1.0], STIFFNESS, f64::NAN), Err(RodError::Value { .. })));
    let negative = RodStiffness { bending: -1.0, ..STIFFNESS };
    assert!(matches!(Rod::new(vec![1.0], negative, 1.0), Err(RodError::Value { name: "bending stiffness", .. })));
    assert!(matches!(rod.set_angles(&[0.0; 3]), Err(RodError::Shape { found: 3, expected: 4, .. })));
    assert!(matches!(rod.set_angles(&[0.0, 0.0, f64::NAN, 0.0]), Err(RodError::Entry { index: 2, .. })));
    assert!(matches!(rod.set_rest_curvatures(&[[0.0; 2]; 4]), Err(RodError::Shape { .. })));
    assert!(matches!(rod.set_rest_curvatures(&[[0.0, f64::INFINITY]; 3]), Err(RodError::Entry { .. })));
    assert!(matches!(rod.set_rest_length(4, 1.0), Err(RodError::Shape { .. })));
    assert!(matches!(rod.set_rest_length(1, -1.0), Err(RodError::Entry { index: 1, .. })));
    assert!(rod.replace(&[1.0; 3], &[0.0; 3], &[[0.0; 2]; 3]).is_err());
    assert!(rod.replace(&[], &[], &[]).is_err());
    let x = &mut s.x;
    let unbalanced = rod.settle_angles(x, &DIRECTOR, None, None, Some(&[1.0; 4]));
    assert_eq!(unbalanced, Err(RodError::Unbalanced { sum: 4.0 }));
    assert!(rod.settle_angles(x, &DIRECTOR, Some(f64::NAN), None, None).is_err());
    assert!(rod.settle_angles(x, &DIRECTOR, Some(0.0), None, Some(&[1.0; 3])).is_err());
    // Nodes 1 and 2 in one place, then an edge that goes back on its predecessor.
    x.copy_within(3..6, 6);
    let degenerate = rod.settle_angles(x, &DIRECTOR, Some(0.0), Some(1.0), None);
    assert_eq!(degenerate, Err(RodError::Degenerate { edge: 1 }));
    x.copy_within(0..3, 6);
    let degenerate = rod.settle_angles(x, &DIRECTOR, Some(0.0), Some(1.0), None);
    assert_eq!(degenerate, Err(RodError::Degenerate { edge: 1 }));
    assert_eq!(*rod, before);
}

#[test]
fn a_rod_survives_a_file() {
    let mut s = straight(4);
    s.rod.set_angles(&[0.1, 0.2, 0.3, 0.4]).unwrap();
    s.rod.set_rest_curvatures(&[[1.0, 2.0], [3.0, 4.0], [5.0, 1.0 / 3.0]]).unwrap();
    let text = serde_json::to_string(&s.rod).unwrap();
    assert_eq!(serde_json::from_str::<Rod>(&text).unwrap(), s.rod);
    let wrong = text.replace("0.05", "-0.05");
    assert_ne!(wrong, text);
    assert!(serde_json::from_str::<Rod>(&wrong).unwrap_err().to_string().contains("rest length 0"));
}
