//! Forces inside and on an endless solid: validation sheet H4 (a point force, Kelvin's solution), H5 (a force spread along
//! a segment) and H6 (a point force on a half space, Boussinesq's solution). The exact displacement is prescribed where the
//! mesh ends.

mod support;

use std::f64::consts::PI;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::segment_load;
use stylet_physics::material::Linear;
use stylet_solver::subspace::{Constraint, Subspace};
use support::halvings::Halvings;
use support::multigrid::equilibrium;
use support::{YOUNG, clamped, constrain, mapped_box, probe};

const POISSON: f64 = 0.45;
const SHEAR: f64 = YOUNG / (2.0 * (1.0 + POISSON));

fn linear() -> Linear {
    Linear::from_young_poisson(YOUNG, POISSON).unwrap()
}

/// Kelvin's displacement (m) at `x` (m) from the point force `p` (N):
/// `u = ((3 - 4 nu) p + (p.x) x / r^2) / (16 pi mu (1 - nu) r)`.
fn kelvin(p: &[f64; 3], x: &[f64; 3]) -> [f64; 3] {
    let r = x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let along = (0..3).map(|k| p[k] * x[k]).sum::<f64>() / (r * r);
    let scale = 1.0 / (16.0 * PI * SHEAR * (1.0 - POISSON) * r);
    std::array::from_fn(|k| scale * ((3.0 - 4.0 * POISSON) * p[k] + along * x[k]))
}

/// Boussinesq's displacement (m) at `x` (m), `x_3` into the half space, of the force `p` (N) along axis 3 at the origin.
fn boussinesq(p: f64, x: &[f64; 3]) -> [f64; 3] {
    let [x, y, z] = *x;
    let r = (x * x + y * y + z * z).sqrt();
    let scale = p / (4.0 * PI * SHEAR * r);
    let radial = z / (r * r) - (1.0 - 2.0 * POISSON) / (r + z);
    [scale * radial * x, scale * radial * y, scale * (2.0 * (1.0 - POISSON) + z * z / (r * r))]
}

/// The displacement (m) at `x` (m) of the uniform line density `q` (N/m) in direction 3 from the origin to `length` on axis 3:
/// Kelvin's solution integrated, `integral of q ((3 - 4 nu) / R + (z - s)^2 / R^3) ds` along and `q (z - s) r / R^3` across.
fn kelvin_segment(q: f64, length: f64, x: &[f64; 3]) -> [f64; 3] {
    let (r, scale) = (x[0].hypot(x[1]), q / (16.0 * PI * SHEAR * (1.0 - POISSON)));
    // With t = z - s from z - length to z: integrals of 1/R, t^2/R^3 and t/R^3.
    let (from, to) = (x[2] - length, x[2]);
    let (near, far) = (r.hypot(from), r.hypot(to));
    let inverse = if r > 0.0 { (to / r).asinh() - (from / r).asinh() } else { (to / from).abs().ln().abs() };
    let across = 1.0 / near - 1.0 / far;
    let square = inverse - to / far + from / near;
    [scale * across * x[0], scale * across * x[1], scale * ((3.0 - 4.0 * POISSON) * inverse + square)]
}

#[track_caller]
fn close(found: [f64; 3], table_um: [f64; 3], digit: f64) {
    for k in 0..3 {
        assert!((1e6 * found[k] - table_um[k]).abs() <= 0.5001 * digit, "{found:?} m, table {table_um:?} um");
    }
}

const FORCE: [f64; 3] = [0.2, 0.0, 0.5];

#[test]
fn the_closed_forms_give_the_tables() {
    close(kelvin(&FORCE, &[0.01, 0.0, 0.0]), [135.750, 0.0, 185.113], 1e-3);
    close(kelvin(&FORCE, &[0.0, 0.0, 0.02]), [37.0227, 0.0, 169.687], 1e-3);
    close(kelvin(&FORCE, &[0.01; 3]), [84.3127, 41.5626, 148.438], 1e-3);
    for ([r, z], [u_r, u_z]) in SEGMENT {
        close(kelvin_segment(10.0, 0.07, &[r, 0.0, z]), [u_r, 0.0, u_z], 1e-3);
    }
    for ([r, z], [u_r, u_z]) in HALF_SPACE {
        close(boussinesq(0.5, &[r, 0.0, z]), [u_r, 0.0, u_z], 1e-3);
    }
}

/// The displacement where it is known and prescribed, zero elsewhere.
fn prescribed(mesh: &SimplexMesh<3, 4>, on: impl Fn(&[f64; 3]) -> bool, exact: impl Fn(&[f64; 3]) -> [f64; 3]) -> Vec<f64> {
    mesh.points().iter().flat_map(|x| if on(x) { exact(x) } else { [0.0; 3] }).collect()
}

/// Nodes on the planes `x = 0` and `y = 0` stay there, those of the axis on both; nodes that are fixed stay fixed.
fn symmetric(mesh: &SimplexMesh<3, 4>, fixed: impl Fn(&[f64; 3]) -> bool) -> Subspace<3> {
    let mut free = clamped(mesh, &fixed);
    constrain(mesh, &mut free, Constraint::Plane([1.0, 0.0, 0.0]), |x| x[0] == 0.0 && !fixed(x));
    constrain(mesh, &mut free, Constraint::Plane([0.0, 1.0, 0.0]), |x| x[1] == 0.0 && !fixed(x));
    constrain(mesh, &mut free, Constraint::Line([0.0, 0.0, 1.0]), |x| x[0] == 0.0 && x[1] == 0.0 && !fixed(x));
    free
}

/// H4 in cubes of edge `0.1 / n` m, the half of the box beyond the plane of symmetry: the force on the central node, Kelvin's
/// displacement on the faces. Largest relative error of the nodes at 4 edges and more from the force.
fn kelvin_error(n: usize) -> f64 {
    let (side, h) = (0.1, 0.1 / n as f64);
    let mesh: SimplexMesh<3, 4> =
        mapped_box([n, n / 2, n], |[x, y, z]| [side * (x - 0.5), 0.5 * side * y, side * (z - 0.5)]);
    let faces = |x: &[f64; 3]| x.iter().any(|x| x.abs() > 0.5 * side - 1e-9);
    let mut free = clamped(&mesh, faces);
    constrain(&mesh, &mut free, Constraint::Plane([0.0, 1.0, 0.0]), |x| x[1] == 0.0 && !faces(x));
    let u = prescribed(&mesh, faces, |x| kelvin(&FORCE, x));
    let mut load = vec![0.0; u.len()];
    let norm = |x: &[f64; 3]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let centre = mesh.points().iter().position(|x| norm(x) < 1e-9).unwrap();
    for k in 0..3 {
        load[3 * centre + k] = 0.5 * FORCE[k];
    }
    let u = equilibrium(&mesh, linear(), &free, &load, u, 1);
    let mut worst = 0.0f64;
    let mut worst_at = vec![0.0f64; 40];
    for (v, x) in mesh.points().iter().enumerate().filter(|(_, x)| norm(x) > h) {
        let exact = kelvin(&FORCE, x);
        let error: [f64; 3] = std::array::from_fn(|k| u[3 * v + k] - exact[k]);
        let shell = (norm(x) / h).round() as usize;
        if shell < 40 { worst_at[shell] = worst_at[shell].max(norm(&error) / norm(&exact)); }
        if norm(x) >= 4.0 * h {
        worst = worst.max(norm(&error) / norm(&exact));
        }
    }
    println!("H4, n {n}: worst error {:.2} %, {worst_at:.4?}", 100.0 * worst);
    worst
}

#[test]
fn h4_kelvin() {
    for n in [20, 40] { assert!(kelvin_error(n) <= 0.02);}
}

/// `(r, z)` (m) and `(u_r, u_z)` (um) of 10 N/m along the axis from 0 to 70 mm.
const SEGMENT: [([f64; 2], [f64; 2]); 4] = [
    ([0.005, 0.035], [0.0, 297.855]),
    ([0.010, 0.070], [26.4891, 148.927]),
    ([0.020, 0.0], [-22.3765, 103.758]),
    ([0.010, 0.100], [6.6864, 78.6471]),
];

/// H5 in a quarter of the space around the segment.
#[test]
fn h5_segment_load() {
    let exact = |x: &[f64; 3]| kelvin_segment(10.0, 0.07, x);
    let values = |n: usize| {
        // From 0 to 40 mm away, and from -35 to 105 mm along the segment, which ends at planes of the mesh.
        let mesh: SimplexMesh<3, 4> =
            mapped_box([6 * n, 6 * n, 12 * n], |[x, y, z]| [0.04 * x.powf(1.5), 0.04 * y.powf(1.5), 0.14 * z - 0.035]);
        let ends = |x: &[f64; 3]| x[0].max(x[1]) > 0.04 - 1e-9 || (x[2] - 0.035).abs() > 0.07 - 1e-9;
        let mut load = vec![0.0; 3 * mesh.n_vertex_slots()];
        let density = [(0.0, 2.5), (0.07, 2.5)];
        segment_load(&mesh, &[0.0; 3], &[0.0, 0.0, 0.07], &density, &[0.0, 0.0, 1.0], &mut load).unwrap();
        let u = equilibrium(&mesh, linear(), &symmetric(&mesh, ends), &load, prescribed(&mesh, ends, exact), 1);
        let at = |[r, z]: [f64; 2]| probe(&mesh, &u, [r, 0.0, z]);
        SEGMENT.iter().flat_map(|(p, _)| [1e6 * at(*p)[0], 1e6 * at(*p)[2]]).collect()
    };
    let table = SEGMENT.map(|(_, u)| u);
    let found = Halvings::new(values);
    found.assert_falls("H5, um", table.as_flattened());
    found.assert_limit::<2>("H5", table.as_flattened(), 0.01);
}

/// `(r, z)` (m) and `(u_r, u_z)` (um) of 0.5 N on the surface of a half space.
const HALF_SPACE: [([f64; 2], [f64; 2]); 4] = [
    ([0.010, 0.0], [-33.9375, 373.312]),
    ([0.020, 0.0], [-16.96875, 186.656]),
    ([0.010, 0.010], [110.047, 383.958]),
    ([0.0, 0.020], [0.0, 356.343]),
];

/// H6 in a quarter of the half space.
#[test]
fn h6_boussinesq() {
    let side = 0.04;
    let values = |n: usize| {
        let mesh: SimplexMesh<3, 4> = mapped_box([8 * n; 3], |x| x.map(|t| side * t.powf(1.5)));
        let ends = |x: &[f64; 3]| x.iter().any(|x| *x > side - 1e-9);
        let mut load = vec![0.0; 3 * mesh.n_vertex_slots()];
        let corner = mesh.points().iter().position(|x| *x == [0.0; 3]).unwrap();
        load[3 * corner + 2] = 0.5 / 4.0;
        let u = prescribed(&mesh, ends, |x| boussinesq(0.5, x));
        let u = equilibrium(&mesh, linear(), &symmetric(&mesh, ends), &load, u, 1);
        let at = |[r, z]: [f64; 2]| probe(&mesh, &u, [r, 0.0, z]);
        HALF_SPACE.iter().flat_map(|(p, _)| [1e6 * at(*p)[0], 1e6 * at(*p)[2]]).collect()
    };
    let table = HALF_SPACE.map(|(_, u)| u);
    let found = Halvings::new(values);
    found.assert_falls("H6, um", table.as_flattened());
    found.assert_limit::<2>("H6", table.as_flattened(), 0.01);
}
