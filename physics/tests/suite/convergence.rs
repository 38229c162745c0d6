//! Order of P1 elements on manufactured solutions: a smooth displacement is prescribed, the body force that balances it
//! follows from the material, `b = -Div P`, and the error in L2 must fall as h^2.

use crate::support::{YOUNG, clamped, mapped_box, solve};
use nalgebra::SMatrix;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::Body;
use stylet_physics::material::{Corotated, Hyperelastic, Linear, NeoHookean, PlaneStress, StableNeoHookean};

/// Amplitude of the displacement, in units of the side: strains of up to some 20 %.
const AMPLITUDE: f64 = 0.05;

/// Phases and wave numbers: component `i` is `AMPLITUDE sin(w_i . x + p_i)`.
fn wave<const D: usize>(i: usize) -> ([f64; D], f64) {
    let all = [[2.1, 1.3, 0.9], [-1.1, 2.3, 1.4], [1.2, -0.8, 1.9]];
    (std::array::from_fn(|k| all[i][k]), 0.4 + i as f64)
}

fn argument<const D: usize>(i: usize, x: &[f64; D]) -> f64 {
    let (w, phase) = wave::<D>(i);
    phase + (0..D).map(|k| w[k] * x[k]).sum::<f64>()
}

fn exact<const D: usize>(x: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| AMPLITUDE * argument(i, x).sin())
}

/// `b_i = -sum_jkl dP_ij/dF_kl d2u_k/dx_j dx_l`.
fn body_force<const D: usize>(material: &impl Hyperelastic<D>, x: &[f64; D]) -> [f64; D] {
    let gradient = SMatrix::<f64, D, D>::from_fn(|i, k| AMPLITUDE * wave::<D>(i).0[k] * argument(i, x).cos());
    let f = SMatrix::<f64, D, D>::identity() + gradient;
    let mut b = [0.0; D];
    for j in 0..D {
        let df = SMatrix::<f64, D, D>::from_fn(|k, l| {
            let (w, _) = wave::<D>(k);
            -AMPLITUDE * w[l] * w[j] * argument(k, x).sin()
        });
        let dp = material.stress_differential(&f, &df);
        for i in 0..D {
            b[i] -= dp[(i, j)];
        }
    }
    b
}

/// Points of a rule of degree two in the simplex, in barycentric coordinates; their weights are equal.
fn rule<const N: usize>() -> [[f64; N]; N] {
    let (near, far) = if N == 3 { (2.0 / 3.0, 1.0 / 6.0) } else { (0.585_410_196_624_968_5, 0.138_196_601_125_010_5) };
    std::array::from_fn(|q| std::array::from_fn(|a| if a == q { near } else { far }))
}

fn l2_error<const D: usize, const N: usize, M: Hyperelastic<D>>(n: usize, material: M) -> f64 {
    let mesh: SimplexMesh<D, N> = mapped_box([n; D], |x| *x);
    let mut body = Body::new(&mesh, material.clone(), 1.0).unwrap();
    let mut load = vec![0.0; D * mesh.n_vertex_slots()];
    let mut u = load.clone();
    let on_boundary = |x: &[f64; D]| x.iter().any(|&t| !(1e-9..=1.0 - 1e-9).contains(&t));
    for (v, x) in mesh.points().iter().enumerate() {
        // Linear problems start at rest; nonlinear ones at the interpolant, as the outer layer would start inverted.
        if on_boundary(x) || !M::IS_LINEAR {
            u[v * D..][..D].copy_from_slice(&exact(x));
        }
    }
    let place = |corners: &[[f64; D]; N], l: &[f64; N]| -> [f64; D] {
        std::array::from_fn(|k| (0..N).map(|a| l[a] * corners[a][k]).sum())
    };
    for cell in mesh.cells() {
        let (corners, weight) = (mesh.corners(cell), mesh.volume(cell) / N as f64);
        for l in rule::<N>() {
            let b = body_force(&material, &place(&corners, &l));
            for (a, v) in mesh.cell(cell).iter().enumerate() {
                for k in 0..D {
                    load[v.index() * D + k] += weight * l[a] * b[k];
                }
            }
        }
    }
    solve(&mut body, &clamped(&mesh, on_boundary), &load, &mut u, 1e-10);
    let mut square = 0.0;
    for cell in mesh.cells() {
        let (corners, weight, vertices) = (mesh.corners(cell), mesh.volume(cell) / N as f64, mesh.cell(cell));
        for l in rule::<N>() {
            let exact = exact(&place(&corners, &l));
            for k in 0..D {
                let found: f64 = (0..N).map(|a| l[a] * u[vertices[a].index() * D + k]).sum();
                square += weight * (found - exact[k]).powi(2);
            }
        }
    }
    square.sqrt()
}

#[track_caller]
fn second_order(name: &str, error: impl Fn(usize) -> f64, n: usize) {
    let errors = [n, 2 * n, 4 * n].map(error);
    let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
    println!("{name}: errors {errors:?}, orders {orders:?}");
    assert!(orders.iter().all(|&order| order >= 1.9), "{name}: orders {orders:?}");
    assert!(errors[2] < 0.01 * AMPLITUDE, "{name}: error {}", errors[2]);
}

#[test]
fn triangles() {
    let linear = Linear::from_young_poisson(YOUNG, 0.34).unwrap();
    let neo = NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap();
    second_order("linear, plane strain", |n| l2_error::<2, 3, _>(n, linear), 8);
    second_order("linear, plane stress", |n| l2_error::<2, 3, _>(n, PlaneStress::new(linear)), 8);
    second_order("NH, plane strain", |n| l2_error::<2, 3, _>(n, neo), 8);
    second_order("NH, plane stress", |n| l2_error::<2, 3, _>(n, PlaneStress::new(neo)), 8);
}

#[test]
fn tetrahedra() {
    let linear = Linear::from_young_poisson(YOUNG, 0.34).unwrap();
    second_order("linear", |n| l2_error::<3, 4, _>(n, linear), 5);
    let neo = NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap();
    second_order("NH", |n| l2_error::<3, 4, _>(n, neo), 5);
    let stable = StableNeoHookean::from_young_poisson(YOUNG, 0.34).unwrap();
    second_order("stable NH", |n| l2_error::<3, 4, _>(n, stable), 5);
    let corotated = Corotated::from_young_poisson(YOUNG, 0.34).unwrap();
    second_order("corotated", |n| l2_error::<3, 4, _>(n, corotated), 5);
}
