//! Patch tests: affine displacements on distorted meshes give constant stress; rigid motions give no force.

use crate::support::{YOUNG, clamped, distorted_box, random_vector, solve};
use nalgebra::{Matrix2, Matrix3, Rotation3, SMatrix, SVector, Vector3};
use stylet_mesh::SimplexMesh;
use stylet_physics::body::Body;
use stylet_physics::material::{
    Corotated, FixedCorotated, Hyperelastic, Invertible, Linear, NeoHookean, PlaneStress, StVenantKirchhoff,
    StableNeoHookean,
};

const SIDE: f64 = 0.1;

fn on_boundary<const D: usize>(x: &[f64; D]) -> bool {
    x.iter().any(|t| !(1e-9 * SIDE..=SIDE * (1.0 - 1e-9)).contains(t))
}

/// The displacement `(F - I) X` at every vertex.
fn affine<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, f: &SMatrix<f64, D, D>) -> Vec<f64> {
    let h = f - SMatrix::<f64, D, D>::identity();
    mesh.points().iter().flat_map(|x| (h * SVector::from(*x)).as_slice().to_vec()).collect()
}

/// Prescribes `f` on the boundary, solves from `start`, and checks positions, stress and energy density in every cell.
fn patch<const D: usize, const N: usize, M: Hyperelastic<D>>(
    mesh: &SimplexMesh<D, N>,
    material: M,
    f: &SMatrix<f64, D, D>,
    start: &SMatrix<f64, D, D>,
) -> (SMatrix<f64, D, D>, f64) {
    let mut body = Body::new(mesh, material.clone(), 1.0).unwrap();
    let exact = affine(mesh, f);
    let mut u = affine(mesh, start);
    for (v, x) in mesh.points().iter().enumerate() {
        if on_boundary(x) {
            u[v * D..][..D].copy_from_slice(&exact[v * D..][..D]);
        }
    }
    let subspace = clamped(mesh, on_boundary);
    solve(&mut body, &subspace, &vec![0.0; u.len()], &mut u, 1e-13);
    for (found, exact) in u.iter().zip(&exact) {
        assert!((found - exact).abs() <= 1e-10 * SIDE, "displacement {found}, exact {exact}");
    }
    let stress = material.first_piola_kirchhoff(f);
    for cell in mesh.cells() {
        let found = body.stress(cell, &u).unwrap();
        // Gradients of displacements known to 1e-10 of the size of a cell.
        assert!((found - stress).norm() <= 1e-8 * YOUNG, "stress {found} in {cell:?}");
    }
    (stress, body.strain_energy(&u) / mesh.total_volume())
}

fn b1() -> Matrix3<f64> {
    Matrix3::identity() + Matrix3::new(0.05, 0.02, -0.01, 0.01, -0.03, 0.02, -0.02, 0.015, 0.04)
}

#[track_caller]
fn close(found: f64, table: f64, half_digit: f64) {
    assert!((found - table).abs() <= half_digit * 1.001, "{found}, table {table}");
}

#[test]
fn b1_affine_displacement_in_space() {
    let (mesh, rest) = (distorted_box::<3, 4>(4, SIDE, 7), Matrix3::identity());
    let table = |stress: Matrix3<f64>, rows: [f64; 9]| {
        for (k, value) in rows.into_iter().enumerate() {
            close(stress[(k / 3, k % 3)], value, if value > 999.0 { 5e-4 } else { 5e-5 });
        }
    };
    let (p, w) = patch(&mesh, Linear::from_young_poisson(YOUNG, 0.45).unwrap(), &b1(), &rest);
    table(p, [7503.448, 351.7241, -351.7241, 351.7241, 5627.586, 410.3448, -351.7241, 410.3448, 7268.966]);
    close(w, 266.2845, 5e-5);
    let (p, w) = patch(&mesh, NeoHookean::from_young_poisson(YOUNG, 0.45).unwrap(), &b1(), &rest);
    table(p, [7366.822, 287.4228, -213.0727, 219.9353, 6020.566, 313.6477, -283.9915, 279.2913, 7201.543]);
    close(w, 256.2213, 5e-5);
    let (p, w) = patch(&mesh, StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap(), &b1(), &rest);
    close(p[(0, 0)], 8293.328, 5e-4);
    close(p[(0, 1)], 490.0543, 5e-5);
    close(p[(1, 0)], 417.3104, 5e-5);
    close(w, 290.5419, 5e-5);
    let (p, w) = patch(&mesh, Corotated::from_young_poisson(YOUNG, 0.45).unwrap(), &b1(), &rest);
    close(p[(0, 0)], 7509.556, 5e-4);
    close(p[(0, 1)], 385.3625, 5e-5);
    close(p[(1, 0)], 318.2812, 5e-5);
    close(w, 266.6771, 5e-5);
    let (_, w) = patch(&mesh, FixedCorotated::from_young_poisson(YOUNG, 0.45).unwrap(), &b1(), &rest);
    close(w, 257.0397, 5e-5);
    // No table: the stress is that of the material point.
    patch(&mesh, StableNeoHookean::from_young_poisson(YOUNG, 0.45).unwrap(), &b1(), &rest);
    // Above the threshold the continued law is the law.
    let (_, w) = patch(&mesh, Invertible::new(NeoHookean::from_young_poisson(YOUNG, 0.45).unwrap()), &b1(), &rest);
    close(w, 256.2213, 5e-5);
    let (_, w) =
        patch(&mesh, Invertible::new(StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap()), &b1(), &rest);
    close(w, 290.5419, 5e-5);
}

/// The same after a rigid rotation: stress `R P`, the same energy; and nothing under the rotation alone.
fn rotated<M: Hyperelastic<3>>(material: M) {
    let mesh = distorted_box::<3, 4>(4, SIDE, 8);
    let r: Matrix3<f64> = Rotation3::new(Vector3::new(0.3, -0.5, 0.8)).into_inner();
    let (plain, w) = patch(&mesh, material.clone(), &b1(), &Matrix3::identity());
    let (turned, w_turned) = patch(&mesh, material.clone(), &(r * b1()), &r);
    assert!((turned - r * plain).norm() <= 1e-11 * plain.norm());
    assert!((w - w_turned).abs() <= 1e-10 * w, "{w} against {w_turned}");

    let mut body = Body::new(&mesh, material, 1.0).unwrap();
    let u = affine(&mesh, &r);
    let mut force = vec![0.0; u.len()];
    body.internal_force(&u, &mut force);
    let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
    assert!(largest <= 1e-9 * YOUNG * SIDE * SIDE, "force {largest} N");
    assert!(body.strain_energy(&u).abs() <= 1e-20 * YOUNG);
}

#[test]
fn b2_rotated_patch() {
    rotated(NeoHookean::from_young_poisson(YOUNG, 0.45).unwrap());
    rotated(StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap());
    rotated(Corotated::from_young_poisson(YOUNG, 0.45).unwrap());
    rotated(FixedCorotated::from_young_poisson(YOUNG, 0.45).unwrap());
    rotated(StableNeoHookean::from_young_poisson(YOUNG, 0.45).unwrap());
    rotated(Invertible::new(NeoHookean::from_young_poisson(YOUNG, 0.45).unwrap()));
    rotated(Invertible::new(StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap()));
}

#[test]
fn b3_plane_stress_patch_of_macneal_and_harder() {
    let mesh = distorted_box::<2, 3>(5, SIDE, 9);
    let f = Matrix2::identity() + Matrix2::new(1e-3, 5e-4, 5e-4, 1e-3);
    let (stress, _) =
        patch(&mesh, PlaneStress::new(Linear::from_young_poisson(1e6, 0.25).unwrap()), &f, &Matrix2::identity());
    assert!((stress - Matrix2::new(4000.0 / 3.0, 400.0, 400.0, 4000.0 / 3.0)).norm() <= 1e-9 * 1e3);
}

/// Affine displacements of plane stress and plane strain at large strain: the mesh reproduces the material point.
#[test]
fn b3_nonlinear_patches_in_the_plane() {
    let mesh = distorted_box::<2, 3>(5, SIDE, 10);
    let f = Matrix2::new(1.12, 0.08, -0.05, 0.93);
    // Interior nodes start a tenth of the way back: from rest, the outer elements would start almost crushed.
    let rest = f * 0.9 + Matrix2::identity() * 0.1;
    let (stvk, neo) = (
        StVenantKirchhoff::from_young_poisson(YOUNG, 0.34).unwrap(),
        NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap(),
    );
    patch(&mesh, stvk, &f, &rest);
    patch(&mesh, neo, &f, &rest);
    patch(&mesh, PlaneStress::new(stvk), &f, &rest);
    let (_, w) = patch(&mesh, PlaneStress::new(neo), &f, &rest);
    let expected = PlaneStress::new(neo).energy_density(&f);
    assert!((w - expected).abs() <= 1e-10 * expected);
}

/// Translations and (for nonlinear materials) rotations give no force; internal forces and their moments sum to zero.
fn balance<const D: usize, const N: usize, M: Hyperelastic<D>>(
    mesh: &SimplexMesh<D, N>,
    material: M,
    r: &SMatrix<f64, D, D>,
) {
    let mut body = Body::new(mesh, material, 1.0).unwrap();
    let n = D * mesh.n_vertex_slots();
    let scale = YOUNG * SIDE.powi(D as i32 - 1);
    let mut force = vec![0.0; n];
    let largest = |force: &[f64]| force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
    body.internal_force(&vec![0.37 * SIDE; n], &mut force);
    assert!(largest(&force) <= 1e-9 * scale, "translation: {} N", largest(&force));
    if !M::IS_LINEAR {
        body.internal_force(&affine(mesh, r), &mut force);
        assert!(largest(&force) <= 1e-9 * scale, "rotation: {} N", largest(&force));
    }
    let u = random_vector(n, 0.02 * SIDE, 5);
    body.internal_force(&u, &mut force);
    assert!(largest(&force) > 1e-3 * scale, "the state is not free of force");
    for i in 0..D {
        let sum: f64 = (0..mesh.n_vertices()).map(|v| force[v * D + i]).sum();
        assert!(sum.abs() <= 1e-12 * scale * D as f64, "total force {sum} N");
        for j in 0..i {
            // Moments about the deformed positions; about the rest positions in the small-strain theory.
            let position = |v: usize, k: usize| mesh.points()[v][k] + if M::IS_LINEAR { 0.0 } else { u[v * D + k] };
            let moment: f64 = (0..mesh.n_vertices())
                .map(|v| position(v, i) * force[v * D + j] - position(v, j) * force[v * D + i])
                .sum();
            assert!(moment.abs() <= 1e-12 * scale * SIDE, "moment {moment} N m");
        }
    }
}

#[test]
fn b4_rigid_motions_and_balance() {
    let r3: Matrix3<f64> = Rotation3::new(Vector3::new(0.3, -0.5, 0.8)).into_inner();
    let r2 = nalgebra::Rotation2::new(0.9).into_inner();
    let (flat, solid) = (distorted_box::<2, 3>(6, SIDE, 11), distorted_box::<3, 4>(4, SIDE, 12));
    let (linear, stvk, neo) = (
        Linear::from_young_poisson(YOUNG, 0.45).unwrap(),
        StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap(),
        NeoHookean::from_young_poisson(YOUNG, 0.45).unwrap(),
    );
    balance(&solid, linear, &r3);
    balance(&solid, stvk, &r3);
    balance(&solid, neo, &r3);
    balance(&solid, Corotated::from_young_poisson(YOUNG, 0.45).unwrap(), &r3);
    balance(&solid, FixedCorotated::from_young_poisson(YOUNG, 0.45).unwrap(), &r3);
    balance(&solid, StableNeoHookean::from_young_poisson(YOUNG, 0.45).unwrap(), &r3);
    balance(&solid, Invertible::new(stvk), &r3);
    balance(&solid, Invertible::new(neo), &r3);
    balance(&flat, linear, &r2);
    balance(&flat, stvk, &r2);
    balance(&flat, neo, &r2);
    balance(&flat, PlaneStress::new(linear), &r2);
    balance(&flat, PlaneStress::new(stvk), &r2);
    balance(&flat, PlaneStress::new(neo), &r2);
}
