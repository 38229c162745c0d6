//! Line and surface loads: exact integrals, total force and moment.

use crate::support::{distorted_box, slab};
use proptest::prelude::*;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{LoadError, boundary_traction, segment_load};

/// Work of a load on a displacement field given by its values at the vertices.
fn work<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    load: &[f64],
    u: impl Fn(&[f64; D]) -> [f64; D],
) -> f64 {
    let values = mesh.points().iter().flat_map(u);
    load.iter().zip(values).map(|(f, u)| f * u).sum()
}

fn random_point<const D: usize>() -> impl Strategy<Value = [f64; D]> {
    prop::collection::vec(0.0..0.1f64, D).prop_map(|x| std::array::from_fn(|k| x[k]))
}

/// Against `integral of q(s) d.u(x(s)) ds` for affine `u`, by Simpson's rule on each linear piece of the density.
fn exact_on_affine_fields<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    a: &[f64; D],
    b: &[f64; D],
) -> Result<(), TestCaseError> {
    let length = (0..D).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt();
    prop_assume!(length > 1e-3);
    let density = [(0.0, 3.0), (0.3 * length, 7.0), (0.3 * length, 1.0), (0.8 * length, -2.0), (length, 5.0)];
    let direction: [f64; D] = std::array::from_fn(|k| 0.4 + k as f64);
    let mut load = vec![0.0; D * mesh.n_vertex_slots()];
    segment_load(mesh, a, b, &density, &direction, &mut load).unwrap();
    let field = |x: &[f64; D]| -> [f64; D] { std::array::from_fn(|k| 1.0 + 30.0 * x[k] - 20.0 * x[(k + 1) % D]) };
    let power = |s: f64, q: f64| {
        let x: [f64; D] = std::array::from_fn(|k| a[k] + (b[k] - a[k]) * s / length);
        q * (0..D).map(|k| direction[k] * field(&x)[k]).sum::<f64>()
    };
    let expected: f64 = density
        .windows(2)
        .map(|pair| {
            let ((s0, q0), (s1, q1)) = (pair[0], pair[1]);
            (s1 - s0) / 6.0 * (power(s0, q0) + 4.0 * power(0.5 * (s0 + s1), 0.5 * (q0 + q1)) + power(s1, q1))
        })
        .sum();
    let found = work(mesh, &load, field);
    let scale = 10.0 * length * 10.0;
    prop_assert!((found - expected).abs() <= 1e-11 * scale, "work {found}, expected {expected}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn segments_anywhere(a in random_point::<2>(), b in random_point::<2>(), c in random_point::<3>(), d in random_point::<3>()) {
        exact_on_affine_fields(&slab(3, 6), &a, &b)?;
        exact_on_affine_fields(&distorted_box::<3, 4>(4, 0.1, 3), &c, &d)?;
    }

    /// Along edges, through vertices, on the boundary.
    #[test]
    fn segments_along_mesh_lines(i in 0usize..=8, j in 0usize..=8, k in 0usize..=8) {
        prop_assume!(i != j);
        let at = |i: usize| 0.1 / 8.0 * i as f64;
        exact_on_affine_fields(&slab(3, 3), &[at(i), at(k)], &[at(j), at(k)])?;
        exact_on_affine_fields(&slab(3, 3), &[at(k), at(i)], &[at(k), at(j)])?;
        exact_on_affine_fields(&slab(3, 3), &[at(i), at(j)], &[at(j), at(i)])?;
    }
}

/// On an edge the consistent load is the textbook one: a hat function's share of a uniform density.
#[test]
fn uniform_density_on_a_line_of_nodes() {
    let mesh = slab(3, 3);
    let mut load = vec![0.0; 2 * mesh.n_vertex_slots()];
    segment_load(&mesh, &[0.0, 0.05], &[0.1, 0.05], &[(0.0, 8.0), (0.1, 8.0)], &[1.0, 0.0], &mut load).unwrap();
    for (v, x) in mesh.points().iter().enumerate() {
        let on_line = (x[1] - 0.05).abs() < 1e-9;
        let end = x[0] < 1e-9 || x[0] > 0.1 - 1e-9;
        let expected = if !on_line {
            0.0
        } else if end {
            0.05
        } else {
            0.1
        };
        assert!((load[2 * v] - expected).abs() < 1e-12, "{x:?}: {}", load[2 * v]);
        assert_eq!(load[2 * v + 1], 0.0);
    }
}

#[test]
fn loads_that_cannot_be_are_errors() {
    let mesh = slab(2, 2);
    let mut load = vec![0.0; 2 * mesh.n_vertex_slots()];
    let q = [(0.0, 1.0), (0.1, 1.0)];
    let mut apply = |a: [f64; 2], b: [f64; 2], q: &[(f64, f64)]| segment_load(&mesh, &a, &b, q, &[1.0, 0.0], &mut load);
    assert!(matches!(apply([0.05, 0.05], [0.15, 0.05], &q), Err(LoadError::Outside { .. })));
    assert!(matches!(apply([0.2, 0.2], [0.3, 0.2], &q), Err(LoadError::Outside { .. })));
    assert!(matches!(apply([0.0, 0.05], [0.05, 0.05], &q), Err(LoadError::Outside { .. })), "density beyond the end");
    assert!(matches!(apply([0.05, 0.05], [0.05, 0.05], &q), Err(LoadError::Segment { .. })));
    assert!(matches!(apply([f64::NAN, 0.05], [0.05, 0.05], &q), Err(LoadError::Segment { .. })));
    assert!(matches!(
        apply([0.0, 0.05], [0.1, 0.05], &[(0.0, f64::INFINITY), (0.1, 0.0)]),
        Err(LoadError::Segment { .. })
    ));
    assert!(matches!(
        apply([0.0, 0.05], [0.1, 0.05], &[(0.1, 1.0), (0.0, 1.0)]),
        Err(LoadError::Places { index: 1, .. })
    ));
    assert!(load.iter().all(|&f| f == 0.0), "a refused load adds nothing");
    let short = &mut load[1..];
    assert!(matches!(segment_load(&mesh, &[0.0; 2], &[0.1; 2], &q, &[1.0, 0.0], short), Err(LoadError::Shape { .. })));
    assert!(matches!(boundary_traction(&mesh, 1.0, |_| true, &[0.0; 2], short), Err(LoadError::Shape { .. })));
}

/// The area of a box, and a pressure on all sides of it that sums to nothing.
#[test]
fn tractions_on_a_box() {
    let mesh = distorted_box::<3, 4>(3, 0.1, 5);
    let mut load = vec![0.0; 3 * mesh.n_vertex_slots()];
    for k in 0..3 {
        for (side, sign) in [(0.0, 1.0), (0.1, -1.0)] {
            let mut traction = [0.0; 3];
            traction[k] = 100.0 * sign;
            let area = boundary_traction(&mesh, 1.0, |x| (x[k] - side).abs() < 1e-9, &traction, &mut load).unwrap();
            assert!((area - 0.01).abs() < 1e-14);
        }
    }
    for k in 0..3 {
        assert!(load.iter().skip(k).step_by(3).sum::<f64>().abs() < 1e-14);
    }
    // Work of the pressure on x -> x: -p div(x) V.
    assert!((work(&mesh, &load, |x| *x) + 100.0 * 3.0 * 1e-3).abs() < 1e-12);
}
