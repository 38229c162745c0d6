//! Equilibria of rods with closed forms: the elastica under forces and moments, chains, naturally curved rods.

use crate::support::rods::{DIRECTOR, Straight, assert_second_order};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};
use stylet_physics::rod::{HeldEnds, Rod, RodLoad, RodStaticError, RodStaticSettings, RodStiffness, solve_rod};
use stylet_solver::subspace::{Constraint, Subspace};

/// `EI = 1`; strains below 1e-5 at the loads here.
const STIFF: RodStiffness = RodStiffness { bending: 1.0, twisting: 0.75, stretching: 1e6 };
const SETTINGS: RodStaticSettings = RodStaticSettings { tolerance: 1e-8, max_iterations: 2000 };

fn node(x: &[f64], i: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&x[3 * i..3 * i + 3])
}

fn length(x: &[f64]) -> f64 {
    (1..x.len() / 3).map(|i| (node(x, i) - node(x, i - 1)).norm()).sum()
}

/// A cantilever of length 1, brought to its load in steps.
fn bent(n: usize, steps: usize, mut load_at: impl FnMut(f64, &Rod, &mut RodLoad)) -> Straight {
    let mut c = Straight::cantilever(1.0, n, STIFF);
    for step in 1..=steps {
        let mut load = RodLoad::new(c.n_nodes());
        load_at(step as f64 / steps as f64, &c.rod, &mut load);
        let ends = HeldEnds::default();
        let report = solve_rod(&mut c.rod, DIRECTOR, &load, &ends, &c.subspace, &mut c.x, &SETTINGS).unwrap();
        println!(
            "n {n}, step {step}: {} steps, {} inner, residual {:e}",
            report.iterations, report.inner_iterations, report.residual_norm
        );
    }
    let stretch = length(&c.x) / (n as f64 * c.h) - 1.0;
    assert!(stretch.abs() < 1e-3, "length changes by {stretch:e}");
    c
}

/// Tip position relative to the table, over the length 1.
fn tip_error(c: &Straight, table: [f64; 2]) -> f64 {
    let tip = node(&c.x, c.n_nodes() - 1);
    (tip.x - table[0]).hypot(tip.y - table[1]).hypot(tip.z)
}

#[test]
fn a_dead_force_at_the_tip_bends_an_elastica() {
    for (a, table) in [
        (0.5, [0.984081, 0.162144]),
        (1.0, [0.943567, 0.301721]),
        (2.0, [0.839358, 0.493457]),
        (5.0, [0.612372, 0.713792]),
        (10.0, [0.445004, 0.810609]),
    ] {
        let errors = [10, 20, 40].map(|n| {
            let steps = (2.0 * a) as usize;
            let c = bent(n, steps, |share, _, load| load.forces[3 * n + 1] = share * a);
            tip_error(&c, table)
        });
        if a <= 2.0 {
            assert!(errors[1] < 0.005, "a = {a}: error {errors:?} of the length");
        }
        assert_second_order(&format!("a = {a}"), &errors);
    }
}

#[test]
fn the_slope_at_the_tip_is_that_of_the_elastica() {
    // The last edge has the tangent of the tip up to second order, for the curvature ends in zero.
    for (a, degrees) in [(1.0, 26.4335_f64), (2.0, 44.7910)] {
        let errors = [10, 20, 40].map(|n| {
            let c = bent(n, 4, |share, _, load| load.forces[3 * n + 1] = share * a);
            let edge = node(&c.x, n) - node(&c.x, n - 1);
            (edge.y.atan2(edge.x) - degrees.to_radians()).abs()
        });
        assert_second_order(&format!("slope at a = {a}"), &errors);
    }
}

#[test]
fn a_moment_at_the_tip_bends_an_arc() {
    for m in [0.5 * PI, TAU] {
        let errors = [16, 32, 64].map(|n| {
            // The couple acts on the tangent of the last edge, which is in the middle of it: there the arc ends.
            let l = (n as f64 - 1.0) / (n as f64 - 0.5);
            let c = bent(n, 12, |share, _, load| load.couple[2] = share * m / l);
            let tip = (node(&c.x, n) + node(&c.x, n - 1)) / (2.0 * l);
            (tip.x - m.sin() / m).hypot(tip.y - (1.0 - m.cos()) / m).hypot(tip.z)
        });
        assert!(errors[2] < 0.005, "m = {m}: error {errors:?} of the length");
        assert_second_order(&format!("m = {m}"), &errors);
    }
}

#[test]
fn a_dead_load_along_the_rod_bends_an_elastica() {
    for (a, table) in [(1.0, [0.991246, 0.123471]), (5.0, [0.846657, 0.495905])] {
        let errors = [10, 20, 40].map(|n| {
            let c = bent(n, 4, |share, rod, load| load.add_weight(rod, &[0.0, share * a, 0.0]));
            tip_error(&c, table)
        });
        if a <= 2.0 {
            assert!(errors[1] < 0.005, "a = {a}: error {errors:?} of the length");
        }
        assert_second_order(&format!("a = {a}"), &errors);
    }
}

#[test]
fn a_chain_hangs_as_a_catenary() {
    let sag = |n: usize| {
        let stiffness = RodStiffness { bending: 0.0, twisting: 0.0, stretching: 1e4 };
        let mut rod = Rod::new(vec![0.2 / n as f64; n], stiffness, 1e-2).unwrap();
        let mut load = RodLoad::new(n + 1);
        load.add_weight(&rod, &[0.0, 0.0, -9.81]);
        // Two straight legs, a little too long: every edge is drawn from the start.
        let depth = (0.1005_f64.powi(2) - 0.075_f64.powi(2)).sqrt();
        let mut x: Vec<f64> = (0..=n)
            .flat_map(|i| {
                let s = i as f64 / n as f64;
                [0.15 * s, 0.0, -depth * (1.0 - (2.0 * s - 1.0).abs())]
            })
            .collect();
        let mut subspace = Subspace::new(n + 1);
        subspace.set(0, Constraint::Fixed).unwrap();
        subspace.set(n, Constraint::Fixed).unwrap();
        let settings = RodStaticSettings { tolerance: 1e-9, ..SETTINGS };
        solve_rod(&mut rod, DIRECTOR, &load, &HeldEnds::default(), &subspace, &mut x, &settings).unwrap();
        -x[3 * (n / 2) + 2]
    };
    let errors = [10, 20, 40].map(|n| (sag(n) - 0.0588668).abs());
    assert!(errors[1] < 0.005 * 0.0588668);
    assert_second_order("sag", &errors);
}

/// Radius and pitch of the screw that takes each node to the next.
fn helix(x: &[f64], i: usize) -> [f64; 2] {
    let bend = |i: usize| node(x, i + 1) - 2.0 * node(x, i) + node(x, i - 1);
    let (d0, d1) = (bend(i), bend(i + 1));
    let axis = d0.cross(&d1).normalize();
    let angle = d0.angle(&d1);
    [d0.norm() / (2.0 * (1.0 - angle.cos())), TAU * (node(x, i + 1) - node(x, i)).dot(&axis) / angle]
}

#[test]
fn natural_curvature_and_torsion_make_a_helix() {
    let (curvature, torsion, l) = (20.0, 10.0, 0.35);
    let errors = [20, 40, 80].map(|n| {
        let stiffness = RodStiffness { bending: 1.4e-3, twisting: 1.05e-3, stretching: 1e3 };
        let mut c = Straight::cantilever(l, n, stiffness);
        let turn = |i: usize| torsion * i as f64 * c.h;
        let natural: Vec<[f64; 2]> = (1..n).map(|i| [curvature * turn(i).cos(), curvature * turn(i).sin()]).collect();
        let (steps, mut iterations) = (10, 0);
        for step in 1..=steps {
            let share = f64::from(step) / f64::from(steps);
            let part: Vec<[f64; 2]> = natural.iter().map(|k| k.map(|k| k * share)).collect();
            c.rod.set_rest_curvatures(&part).unwrap();
            let ends = HeldEnds { start: Some(0.0), end: None };
            let settings = RodStaticSettings { tolerance: 1e-9, ..SETTINGS };
            let load = RodLoad::new(n + 1);
            let report = solve_rod(&mut c.rod, DIRECTOR, &load, &ends, &c.subspace, &mut c.x, &settings).unwrap();
            iterations += report.iterations;
        }
        // Nothing but its nature acts on it, so it is at rest.
        let energy = c.rod.energy(&c.x, &DIRECTOR);
        println!("n {n}: {iterations} steps, energy {energy:e}");
        assert!(energy < 1e-15, "{energy:e} J");
        assert!(c.rod.angles().iter().all(|a| a.abs() < 1e-5));
        let [radius, pitch] = helix(&c.x, n / 2);
        (radius / 0.04 - 1.0).hypot(pitch / 0.125664 - 1.0)
    });
    assert_second_order("helix", &errors);
}

#[test]
fn what_cannot_be_solved_is_an_error() {
    let mut c = Straight::cantilever(1.0, 5, STIFF);
    let mut solve = |load: &RodLoad, ends: &HeldEnds| {
        solve_rod(&mut c.rod, DIRECTOR, load, ends, &c.subspace, &mut c.x.clone(), &SETTINGS).unwrap_err()
    };
    let ends = HeldEnds::default();
    assert!(matches!(solve(&RodLoad::new(5), &ends), RodStaticError::Rod(_)));
    let mut load = RodLoad::new(6);
    load.forces[4] = f64::NAN;
    assert!(matches!(solve(&load, &ends), RodStaticError::Rod(_)));
    load.forces[4] = 0.0;
    load.couple[1] = f64::INFINITY;
    assert!(matches!(solve(&load, &ends), RodStaticError::Rod(_)));
    // The last director cannot point along its edge.
    load.couple[1] = 0.0;
    load.forces[17] = 1.0;
    let along = HeldEnds { start: Some(0.0), end: Some([1.0, 0.0, 0.0]) };
    assert!(matches!(solve(&load, &along), RodStaticError::Nonlinear(_)));
}
