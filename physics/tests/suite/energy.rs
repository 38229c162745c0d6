//! The body as an energy: gradient, Hessian, safe steps, definiteness.

use crate::support::{YOUNG, distorted_box, random_vector, slab};
use stylet_physics::body::{Body, Loaded};
use stylet_physics::material::{Hyperelastic, Linear, NeoHookean, PlaneStress, StVenantKirchhoff};
use stylet_solver::energy::{BlockHessian, Energy};

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn moved(u: &[f64], t: f64, p: &[f64]) -> Vec<f64> {
    u.iter().zip(p).map(|(u, p)| u + t * p).collect()
}

/// Taylor remainders of energy and gradient under a load fall as `h^2`.
fn taylor<const D: usize, const N: usize, M: Hyperelastic<D>>(mut body: Body<D, N, M>, size: f64) {
    let n = body.dim();
    let (u, p, load) = (random_vector(n, size, 1), random_vector(n, size, 2), random_vector(n, 1e-3, 3));
    let mut energy = Loaded::new(&mut body, &load);
    let (mut g, mut hp, mut moved_g) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let value = energy.value(&u);
    energy.gradient(&u, &mut g);
    energy.linearize(&u);
    energy.hessian_apply(&p, &mut hp);
    let mut remainders = |t: f64| {
        let x = moved(&u, t, &p);
        energy.gradient(&x, &mut moved_g);
        let stiff: Vec<f64> = (0..n).map(|i| moved_g[i] - g[i] - t * hp[i]).collect();
        ((energy.value(&x) - value - t * dot(&g, &p)).abs(), dot(&stiff, &stiff).sqrt())
    };
    let (coarse, fine) = (remainders(1e-1), remainders(1e-2));
    let order = (coarse.0 / fine.0).log10();
    assert!(order > 1.9, "energy: order {order}");
    let rounding = 1e-12 * dot(&g, &g).sqrt();
    let order = (coarse.1 / fine.1).log10();
    assert!(order > 1.9 || fine.1 < rounding, "gradient: order {order}");
    // Symmetry.
    let q = random_vector(n, size, 4);
    let mut hq = vec![0.0; n];
    energy.hessian_apply(&q, &mut hq);
    assert!((dot(&p, &hq) - dot(&q, &hp)).abs() <= 1e-12 * dot(&hp, &hp).sqrt() * dot(&q, &q).sqrt());
    assert_eq!(energy.matrix().n_rows() * D, n);
}

#[test]
fn gradient_and_hessian() {
    let (linear, stvk, neo) = (
        Linear::from_young_poisson(YOUNG, 0.34).unwrap(),
        StVenantKirchhoff::from_young_poisson(YOUNG, 0.34).unwrap(),
        NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap(),
    );
    let (flat, solid) = (slab(3, 5), distorted_box::<3, 4>(3, 0.1, 4));
    taylor(Body::new(&flat, PlaneStress::new(linear), 0.01).unwrap(), 2e-4);
    taylor(Body::new(&flat, PlaneStress::new(stvk), 0.01).unwrap(), 2e-4);
    taylor(Body::new(&flat, PlaneStress::new(neo), 0.01).unwrap(), 2e-4);
    taylor(Body::new(&flat, stvk, 0.01).unwrap(), 2e-4);
    taylor(Body::new(&flat, neo, 0.01).unwrap(), 2e-4);
    taylor(Body::new(&solid, linear, 1.0).unwrap(), 1e-3);
    taylor(Body::new(&solid, stvk, 1.0).unwrap(), 1e-3);
    taylor(Body::new(&solid, neo, 1.0).unwrap(), 1e-3);
}

/// The matrix of a linear body gives the energy and forces that its elements give.
#[test]
fn linear_bodies_are_their_matrix() {
    let mesh = distorted_box::<3, 4>(3, 0.1, 6);
    let mut body = Body::new(&mesh, Linear::from_young_poisson(YOUNG, 0.45).unwrap(), 1.0).unwrap();
    let u = random_vector(body.dim(), 1e-3, 1);
    let (by_matrix, by_elements) = (body.value(&u), body.strain_energy(&u));
    assert!((by_matrix - by_elements).abs() <= 1e-13 * by_elements, "{by_matrix} against {by_elements}");
    assert_eq!(body.max_step(&u, &u, f64::INFINITY), f64::INFINITY);
    assert_eq!(body.elements_linearized(), 0);
}

/// Just below the largest step no element is inverted and the energy is finite; just above, one is and it is not.
fn largest_step<const D: usize, const N: usize, M: Hyperelastic<D>>(mut body: Body<D, N, M>, size: f64) {
    for seed in 0..20 {
        let (u, p) = (random_vector(body.dim(), size, seed), random_vector(body.dim(), size, 100 + seed));
        let t = body.max_step(&u, &p, f64::INFINITY);
        assert!(t > 0.0 && t.is_finite());
        // A limit cuts off and changes no bits.
        assert_eq!(body.max_step(&u, &p, 0.3 * t), 0.3 * t);
        assert_eq!(body.max_step(&u, &p, 1.0001 * t), t);
        assert_eq!(body.max_step(&u, &p, 3.0 * t), t);
        let (below, above) = (moved(&u, t * (1.0 - 1e-6), &p), moved(&u, t * (1.0 + 1e-6), &p));
        assert!(body.inverted(&below).is_none() && body.value(&below).is_finite());
        let cell = body.inverted(&above).expect("an inverted cell");
        assert!(body.smallest_jacobian(&above).unwrap().1 <= 0.0 && body.deformation_gradient(cell, &above).is_some());
        assert_eq!(body.value(&above), f64::INFINITY);
        assert_eq!(body.max_step(&above, &p, 1.0), 0.0);
        // A step that changes nothing is safe at any length.
        assert_eq!(body.max_step(&u, &vec![0.0; p.len()], f64::INFINITY), f64::INFINITY);
        assert_eq!(body.max_step(&u, &vec![f64::NAN; p.len()], 2.0), 0.0);
    }
}

#[test]
fn steps_stop_at_the_first_inversion() {
    let neo = NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap();
    largest_step(Body::new(&slab(3, 5), neo, 0.01).unwrap(), 3e-4);
    largest_step(Body::new(&distorted_box::<3, 4>(3, 0.1, 7), neo, 1.0).unwrap(), 1.5e-3);
}

/// Under compression the exact Hessian is indefinite, the projected one is not.
#[test]
fn projected_hessians_are_semidefinite() {
    let mesh = distorted_box::<3, 4>(3, 0.1, 8);
    let mut body = Body::new(&mesh, StVenantKirchhoff::from_young_poisson(YOUNG, 0.34).unwrap(), 1.0).unwrap();
    let u: Vec<f64> = mesh.points().iter().flatten().map(|x| -0.45 * x).collect();
    let lowest = |body: &Body<3, 4, _>| {
        let mut hp = vec![0.0; u.len()];
        let curvature = |seed| {
            let p = random_vector(u.len(), 1.0, seed);
            body.hessian_apply(&p, &mut hp);
            dot(&p, &hp)
        };
        (0..20).map(curvature).fold(f64::INFINITY, f64::min)
    };
    body.linearize(&u);
    assert!(lowest(&body) < 0.0, "exact: {}", lowest(&body));
    body.set_projection(true);
    body.linearize(&u);
    assert!(lowest(&body) >= 0.0, "projected: {}", lowest(&body));
    // Where the exact one is definite the projection leaves it alone.
    let (rest, mut plain) = (vec![0.0; u.len()], body.clone());
    plain.set_projection(false);
    body.linearize(&rest);
    plain.linearize(&rest);
    let p = random_vector(u.len(), 1.0, 9);
    let (mut a, mut b) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    body.hessian_apply(&p, &mut a);
    plain.hessian_apply(&p, &mut b);
    let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    assert!(dot(&difference, &difference).sqrt() <= 1e-12 * dot(&b, &b).sqrt());
}
