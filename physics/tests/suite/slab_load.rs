//! The slab of Nienhuys (2003) under a line load: 10 N/m along y = 0.05 for x from 0 to 0.07, and 0.3 N more on its last
//! 2.5 mm. Plane stress, right edge fixed, E 34 kPa, nu 0.34; reference values from high-order elements.

use crate::support::{YOUNG, clamped, probe, slab, solve};
use stylet_mesh::{MeshChange, SimplexMesh};
use stylet_physics::body::{Body, segment_load};
use stylet_physics::material::{Hyperelastic, Linear, NeoHookean, PlaneStress};

/// The slab with legs of level `start`, and around the load down to level `finest`, each level in a band of eight of its
/// legs on either side: the stress falls off with the distance from the load, not at once.
fn graded_slab(start: i32, finest: i32) -> SimplexMesh<2, 3> {
    let mut mesh = slab(start, start);
    for level in start + 1..=finest {
        let leg = 0.1 * 0.5f64.powi(level);
        for band in -8..=8 {
            let y = 0.05 + leg * f64::from(band);
            let end = 0.07 + 8.0 * leg;
            mesh.refine_along([0.0, y], [end, y], leg * 2f64.sqrt(), &mut MeshChange::default()).unwrap();
        }
    }
    mesh
}

#[track_caller]
fn check<M: Hyperelastic<2>>(name: &str, material: M, line: [f64; 5], side: [f64; 2], corner: [f64; 2]) {
    let mesh = graded_slab(7, 10);
    let mut body = Body::new(&mesh, material, 0.01).unwrap();
    let mut load = vec![0.0; 2 * mesh.n_vertex_slots()];
    let density = [(0.0, 10.0), (0.0675, 10.0), (0.0675, 130.0), (0.07, 130.0)];
    segment_load(&mesh, &[0.0, 0.05], &[0.07, 0.05], &density, &[1.0, 0.0], &mut load).unwrap();
    assert!((load.iter().step_by(2).sum::<f64>() - 1.0).abs() < 1e-12, "0.7 N and 0.3 N");
    let mut u = vec![0.0; load.len()];
    solve(&mut body, &clamped(&mesh, |x| x[0] > 0.1 - 1e-9), &load, &mut u, 1e-9);

    let compare = |what: &str, found: f64, table: f64, tolerance: f64| {
        println!("{name} {what}: {found:.4} mm, table {table} mm ({:.2} %)", 100.0 * (found / table - 1.0));
        assert!((found - table).abs() <= tolerance, "{name} {what}: {found} mm, table {table} +- {tolerance} mm");
    };
    let mm = |p: [f64; 2]| probe(&mesh, &u, p).map(|x| 1e3 * x);
    for (x, table) in [0.0, 0.025, 0.05, 0.07, 0.085].into_iter().zip(line) {
        // Four digits of the table, and what the mesh leaves: most at the end of the load.
        let tolerance = 0.002 * table;
        compare(&format!("u_x({x})"), mm([x, 0.05])[0], table, tolerance);
    }
    for (place, p, table) in [("side", [0.05, 0.025], side), ("corner", [0.0, 0.1], corner)] {
        for k in 0..2 {
            compare(place, mm(p)[k], table[k], 0.002 * table[0]);
        }
    }
}

#[test]
fn h8_linear() {
    let material = PlaneStress::new(Linear::from_young_poisson(YOUNG, 0.34).unwrap());
    check("linear", material, [2.4676, 2.3424, 2.0001, 1.9867, 0.6257], [1.1312, -0.1937], [0.8615, -0.4449]);
}

#[test]
fn h8_neo_hookean() {
    let material = PlaneStress::new(NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap());
    check("NH", material, [2.4587, 2.3180, 1.9709, 1.9484, 0.6187], [1.1059, -0.1933], [0.8329, -0.4635]);
}

/// On three uniform meshes the error of the line's displacements falls 1.6 times or more per halving of h, and what they
/// extrapolate to is within 1 % of the table.
#[track_caller]
fn converges<M: Hyperelastic<2>>(material: M, line: [f64; 5]) {
    let places = [0.0, 0.025, 0.05, 0.07, 0.085];
    let on_level = |level: i32| -> Vec<f64> {
        let mesh = slab(level, level);
        let mut body = Body::new(&mesh, material.clone(), 0.01).unwrap();
        let mut load = vec![0.0; 2 * mesh.n_vertex_slots()];
        let density = [(0.0, 10.0), (0.0675, 10.0), (0.0675, 130.0), (0.07, 130.0)];
        segment_load(&mesh, &[0.0, 0.05], &[0.07, 0.05], &density, &[1.0, 0.0], &mut load).unwrap();
        let mut u = vec![0.0; load.len()];
        solve(&mut body, &clamped(&mesh, |x| x[0] > 0.1 - 1e-9), &load, &mut u, 1e-9);
        places.iter().map(|&x| 1e3 * probe(&mesh, &u, [x, 0.05])[0]).collect()
    };
    let levels = [5, 6, 7].map(on_level);
    let error = |found: &[f64]| found.iter().zip(line).map(|(f, t)| (f - t).powi(2)).sum::<f64>().sqrt();
    let errors = [0, 1, 2].map(|k| error(&levels[k]));
    for pair in errors.windows(2) {
        assert!(pair[0] / pair[1] >= 1.6, "errors {errors:?} mm");
    }
    for (index, table) in line.into_iter().enumerate() {
        let [a, b, c] = [0, 1, 2].map(|k: usize| levels[k][index]);
        // Aitken's limit of the three values. At the end of the load, which falls on another part of an edge at each level,
        // the values follow no power of h: there the finest one must do.
        let limit = if index == 3 { c } else { c - (c - b).powi(2) / ((c - b) - (b - a)) };
        assert!((limit / table - 1.0).abs() < 0.01, "place {index}: {a}, {b}, {c} mm, limit {limit}, table {table}");
    }
}

#[test]
fn h8_converges_on_three_meshes() {
    let linear = Linear::from_young_poisson(YOUNG, 0.34).unwrap();
    converges(PlaneStress::new(linear), [2.4676, 2.3424, 2.0001, 1.9867, 0.6257]);
    let neo_hookean = NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap();
    converges(PlaneStress::new(neo_hookean), [2.4587, 2.3180, 1.9709, 1.9484, 0.6187]);
}
