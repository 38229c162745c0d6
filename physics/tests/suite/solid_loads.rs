//! Forces inside and on linear solids: validation sheet H4 (a point force in space, Kelvin's solution), H5 (a force spread
//! along a segment), H6 (a point force on a half space, Boussinesq's solution) and H7 (a cube under a line load). Where a
//! mesh ends in the middle of a solid, the exact displacement is prescribed.

use crate::support::halvings::Halvings;
use crate::support::multigrid::equilibrium;
use crate::support::{YOUNG, clamped, constrain, mapped_box, probe};
use std::f64::consts::PI;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::segment_load;
use stylet_physics::material::Linear;
use stylet_solver::subspace::{Constraint, Subspace};

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
fn close(found: [f64; 3], table_um: [f64; 3]) {
    for k in 0..3 {
        assert!((1e6 * found[k] - table_um[k]).abs() <= 0.5001e-3, "{found:?} m, table {table_um:?} um");
    }
}

const FORCE: [f64; 3] = [0.2, 0.0, 0.5];

#[test]
fn the_closed_forms_give_the_tables() {
    close(kelvin(&FORCE, &[0.01, 0.0, 0.0]), [135.750, 0.0, 185.113]);
    close(kelvin(&FORCE, &[0.0, 0.0, 0.02]), [37.0227, 0.0, 169.687]);
    close(kelvin(&FORCE, &[0.01; 3]), [84.3127, 41.5626, 148.438]);
    for ([r, z], [u_r, u_z]) in SEGMENT {
        close(kelvin_segment(10.0, 0.07, &[r, 0.0, z]), [u_r, 0.0, u_z]);
    }
    for ([r, z], [u_r, u_z]) in HALF_SPACE {
        close(boussinesq(0.5, &[r, 0.0, z]), [u_r, 0.0, u_z]);
    }
}

/// The displacement where it is known and prescribed, zero elsewhere.
fn prescribed(
    mesh: &SimplexMesh<3, 4>,
    on: impl Fn(&[f64; 3]) -> bool,
    exact: impl Fn(&[f64; 3]) -> [f64; 3],
) -> Vec<f64> {
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

/// An octant of a box of side 0.1 m, the force at its corner, and the displacement of a force of 1 N along one axis.
struct Octant {
    mesh: SimplexMesh<3, 4>,
    u: Vec<f64>,
}

impl Octant {
    /// Parts grow away from the planes of symmetry.
    fn new(n: usize, axis: usize) -> Self {
        let side = 0.05;
        let mesh: SimplexMesh<3, 4> = mapped_box([n; 3], |x| x.map(|t| side * t.powf(1.5)));
        let faces = |x: &[f64; 3]| x.iter().any(|x| *x > side - 1e-9);
        let unit = |axis: usize| std::array::from_fn(|k| f64::from(u8::from(k == axis)));
        let mut free = clamped(&mesh, faces);
        for across in (0..3).filter(|&k| k != axis) {
            constrain(&mesh, &mut free, Constraint::Plane(unit(across)), |x| x[across] == 0.0 && !faces(x));
        }
        // Across the force the field is odd; and on the axis of the force both planes meet.
        let only_along = |x: &[f64; 3]| x[axis] == 0.0 || (0..3).filter(|&k| x[k] == 0.0).count() > 1;
        constrain(&mesh, &mut free, Constraint::Line(unit(axis)), |x| only_along(x) && !faces(x));
        let start = prescribed(&mesh, faces, |x| kelvin(&unit(axis), x));
        let mut load = vec![0.0; start.len()];
        let corner = mesh.points().iter().position(|x| *x == [0.0; 3]).unwrap();
        load[3 * corner + axis] = 1.0 / 8.0;
        let u = equilibrium(&mesh, linear(), &free, &load, start, 1);
        Self { mesh, u }
    }
}

/// Points (m) and displacements (um) of the force `FORCE`.
const SPACE: [([f64; 3], [f64; 3]); 3] = [
    ([0.010, 0.0, 0.0], [135.750, 0.0, 185.113]),
    ([0.0, 0.0, 0.020], [37.0227, 0.0, 169.687]),
    ([0.010, 0.010, 0.010], [84.3127, 41.5626, 148.438]),
];

/// H4: Kelvin's displacement on the faces of a box of side 0.1 m.
///
/// On cubes of edge `h` the error of linear tetrahedra is about `7 (h / r)^2` at this Poisson's ratio: above the 2 % of the
/// sheet up to 18 edges from the force. So the rule of three meshes, and 2 % on the finest from 15 mm on.
#[test]
fn h4_kelvin() {
    let norm = |x: &[f64; 3]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let values = |n: usize| {
        let [across, along] = [0, 2].map(|axis| Octant::new(7 * n, axis));
        let u: Vec<f64> = across.u.iter().zip(&along.u).map(|(a, b)| FORCE[0] * a + FORCE[2] * b).collect();
        if n == 4 {
            let distant = along.mesh.points().iter().zip(u.chunks_exact(3)).filter(|(x, _)| norm(x) >= 0.015);
            let errors = distant.map(|(x, u)| {
                let exact = kelvin(&FORCE, x);
                norm(&std::array::from_fn(|k| u[k] - exact[k])) / norm(&exact)
            });
            let worst = errors.fold(0.0, f64::max);
            println!("H4: from 15 mm on {:.2} %", 100.0 * worst);
            assert!(worst <= 0.02, "{worst}");
        }
        SPACE.iter().flat_map(|(p, _)| probe(&along.mesh, &u, *p)).map(|u| 1e6 * u).collect()
    };
    let table = SPACE.map(|(_, u)| u);
    let found = Halvings::new(values);
    found.assert_falls("H4, um", table.as_flattened());
    found.assert_limit::<3>("H4", table.as_flattened(), 0.01);
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

/// Points (m) and displacements (um) of the cube of H7, the first two of the load's axis being zero.
const CUBE: [([f64; 3], [f64; 2]); 6] = [
    ([0.0125, 0.0, 0.100], [-56.2, -229.5]),
    ([0.0125, 0.0, 0.080], [9.84, -238.2]),
    ([0.0125, 0.0, 0.060], [20.9, -190.3]),
    ([0.0125, 0.0, 0.040], [36.9, -114.9]),
    ([0.0125, 0.0, 0.020], [19.3, -39.6]),
    ([0.050, 0.0, 0.100], [-25.3, -67.3]),
];
const CUBE_CORNER: f64 = -29.2;

/// H7 on a quarter of the cube: 0.1 m, fixed at the bottom, 10 N/m downwards on the axis over the top 60 mm.
#[test]
fn h7_line_load_in_a_cube() {
    let values = |n: usize| {
        // Parts grow away from the axis, with a plane of nodes at 12.5 mm.
        let grade = |t: &f64| 0.05 * t.powf(4f64.ln() / 3f64.ln());
        let mesh: SimplexMesh<3, 4> = mapped_box([6 * n, 6 * n, 15 * n], |[x, y, z]| [grade(x), grade(y), 0.1 * z]);
        let mut load = vec![0.0; 3 * mesh.n_vertex_slots()];
        let density = [(0.0, 2.5), (0.06, 2.5)];
        segment_load(&mesh, &[0.0, 0.0, 0.04], &[0.0, 0.0, 0.1], &density, &[0.0, 0.0, -1.0], &mut load).unwrap();
        let start = vec![0.0; load.len()];
        let u = equilibrium(&mesh, linear(), &symmetric(&mesh, |x| x[2] == 0.0), &load, start, 1);
        let um = |p: [f64; 3]| probe(&mesh, &u, p).map(|u| 1e6 * u);
        let mut values: Vec<f64> = CUBE.iter().flat_map(|(p, _)| [um(*p)[0], um(*p)[2]]).collect();
        values.push(um([0.05, 0.05, 0.1])[2]);
        values
    };
    let mut table = CUBE.map(|(_, u)| u).as_flattened().to_vec();
    table.push(CUBE_CORNER);
    let found = Halvings::new(values);
    found.assert_falls("H7, um", &table);
    for (found, table) in found.limit.iter().zip(&table) {
        println!("H7: limit {found:.3} um, table {table} um");
    }
    // Half a percent of the largest displacement. On the surface, where the load ends beside the first point, linear
    // tetrahedra of this size leave 0.7 %: there the rule of three meshes, 1 %.
    for (k, (found, table)) in found.limit.iter().zip(&table).enumerate() {
        let share = if k < 2 { 0.01 } else { 0.005 };
        assert!((found - table).abs() <= share * 238.2, "H7, value {k}: {found} um, table {table} um");
    }
}
