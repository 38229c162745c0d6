use super::*;
use crate::Block;
use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, Side};
use proptest::prelude::*;

fn numbers(len: usize) -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec(-1.0..1.0f64, len)
}

/// `G Gᵀ + I/2`, symmetric positive definite.
fn spd(n: usize, g: &[f64]) -> Mat<f64> {
    Mat::from_fn(n, n, |i, j| (0..n).map(|k| g[i * n + k] * g[j * n + k]).sum::<f64>() + 0.5 * f64::from(i == j))
}

fn rows(a: &Mat<f64>) -> Vec<f64> {
    (0..a.nrows() * a.ncols()).map(|k| a[(k / a.ncols(), k % a.ncols())]).collect()
}

fn close(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

proptest! {
    /// `C` of rank `rank`, which may be less than `k`, or zero.
    #[test]
    fn woodbury_is_the_inverse_of_the_changed_matrix(
        (n, k, rank, g, u, v, b) in (1usize..12, 0usize..5, 0usize..5).prop_flat_map(|(n, k, rank)| {
            (Just(n), Just(k), Just(rank.min(k)), numbers(n * n), numbers(n * k), numbers(k * rank.min(k)), numbers(n))
        })
    ) {
        let a0 = spd(n, &g);
        let c = Mat::from_fn(k, k, |i, j| (0..rank).map(|l| v[i * rank + l] * v[j * rank + l]).sum::<f64>());
        let u_matrix = Mat::from_fn(n, k, |i, j| u[j * n + i]);
        let a1 = &a0 + &u_matrix * &c * u_matrix.transpose();
        let llt = a0.llt(Side::Lower).unwrap();
        let solve = |x: &mut [f64]| {
            let solution = llt.solve(Mat::from_fn(n, 1, |i, _| x[i]));
            x.iter_mut().enumerate().for_each(|(i, x)| *x = solution[(i, 0)]);
        };
        let mut woodbury = Woodbury::new();
        woodbury.build(n, &u, &rows(&c), solve).unwrap();
        prop_assert_eq!(woodbury.rank(), k);

        let mut x = b.clone();
        solve(&mut x);
        woodbury.correct(&mut x);
        let expected = a1.llt(Side::Lower).unwrap().solve(Mat::from_fn(n, 1, |i, _| b[i]));
        prop_assert!(close(&x, &rows(&expected), 1e-10));

        let mut inverse = rows(&llt.inverse());
        woodbury.correct_inverse(&mut inverse);
        prop_assert!(close(&inverse, &rows(&a1.llt(Side::Lower).unwrap().inverse()), 1e-10));
    }

    /// After any exchanges: forces and displacements that belong together do so in `M`, and `M` is what elimination makes of the
    /// compliance.
    #[test]
    fn swaps_are_the_mixed_response(
        (m, g, dofs, f) in (1usize..12).prop_flat_map(|m| {
            (Just(m), numbers(m * m), proptest::collection::vec(0..m, 0..30), numbers(m))
        })
    ) {
        let c = spd(m, &g);
        let mut condensed = CondensedMatrix::new(m, &rows(&c)).unwrap();
        for dof in dofs {
            let other = match condensed.prescribed()[dof] {
                Prescribed::Force => Prescribed::Displacement,
                Prescribed::Displacement => Prescribed::Force,
            };
            prop_assert!(condensed.prescribe(dof, other).unwrap());
            prop_assert!(!condensed.prescribe(dof, other).unwrap());
        }
        let u = rows(&(&c * Mat::from_fn(m, 1, |i, _| f[i])));
        let held = |i: usize| condensed.prescribed()[i] == Prescribed::Displacement;
        let x: Vec<f64> = (0..m).map(|i| if held(i) { u[i] } else { f[i] }).collect();
        let expected: Vec<f64> = (0..m).map(|i| if held(i) { f[i] } else { u[i] }).collect();
        let mut y = vec![0.0; m];
        condensed.apply(&x, &mut y);
        prop_assert!(close(&y, &expected, 1e-8), "{:?} {:?}", y, expected);
        prop_assert!(condensed.drift() < 1e-10);

        let before = condensed.matrix().to_vec();
        condensed.refresh().unwrap();
        prop_assert!(close(condensed.matrix(), &before, 1e-8) && condensed.swaps() == 0);
        // All back: the compliance.
        for dof in 0..m {
            condensed.prescribe(dof, Prescribed::Force).unwrap();
        }
        prop_assert!(close(condensed.matrix(), &rows(&c), 1e-8));
        // All held: the stiffness.
        for dof in (0..m).rev() {
            condensed.prescribe(dof, Prescribed::Displacement).unwrap();
        }
        prop_assert!(close(condensed.matrix(), &rows(&c.llt(Side::Lower).unwrap().inverse()), 1e-8));
    }

    #[test]
    fn rotated_nodes_keep_the_eigenvalues(
        (nodes, g, angles) in (1usize..5).prop_flat_map(|n| (Just(n), numbers(9 * n * n), numbers(3 * n)))
    ) {
        let m = 3 * nodes;
        let k = spd(m, &g);
        let frames: Vec<Block<3>> = angles.chunks(3).map(|a| frame(a[0] * 3.0, a[1] * 3.0, a[2] * 3.0)).collect();
        let r = Mat::from_fn(m, m, |i, j| if i / 3 == j / 3 { frames[i / 3][i % 3][j % 3] } else { 0.0 });
        let expected = r.transpose() * &k * &r;
        let mut rotated = rows(&k);
        rotate_nodes(&mut rotated, &frames).unwrap();
        prop_assert!(close(&rotated, &rows(&expected), 1e-12));
        let eigenvalues = |a: &Mat<f64>| a.self_adjoint_eigenvalues(Side::Lower).unwrap();
        let rotated_matrix = Mat::from_fn(m, m, |i, j| rotated[i * m + j]);
        prop_assert!(close(&eigenvalues(&rotated_matrix), &eigenvalues(&k), 1e-11));
        // One node after the other, and back.
        for (node, frame) in frames.iter().enumerate() {
            let back: Block<3> = std::array::from_fn(|i| std::array::from_fn(|j| frame[j][i]));
            rotate_node(&mut rotated, nodes, node, &back).unwrap();
        }
        prop_assert!(close(&rotated, &rows(&k), 1e-12));
    }
}

/// Turns about the three axes, one after the other.
fn frame(a: f64, b: f64, c: f64) -> Block<3> {
    let turn = |axis: usize, angle: f64| -> Mat<f64> {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut r = Mat::<f64>::identity(3, 3);
        (r[(i, i)], r[(i, j)], r[(j, i)], r[(j, j)]) = (angle.cos(), -angle.sin(), angle.sin(), angle.cos());
        r
    };
    let r = turn(0, a) * turn(1, b) * turn(2, c);
    std::array::from_fn(|i| std::array::from_fn(|j| r[(i, j)]))
}

#[test]
fn drift_of_many_swaps_is_measured_and_removed() {
    let m = 30usize;
    // An elastic half-plane's slowly decaying compliance.
    let compliance: Vec<f64> = (0..m * m).map(|k| 1.0 / (1.0 + (k / m).abs_diff(k % m) as f64)).collect();
    let mut condensed = CondensedMatrix::new(m, &compliance).unwrap();
    for step in 0..5000 {
        let dof = (step * 7 + step / 30) % m;
        let to = if step % 3 == 0 { Prescribed::Displacement } else { Prescribed::Force };
        condensed.prescribe(dof, to).unwrap();
    }
    assert!(condensed.swaps() > 1000, "{}", condensed.swaps());
    let drift = condensed.drift();
    assert!(drift > 1e-15 && drift < 1e-10, "{drift:e}");
    condensed.refresh().unwrap();
    assert!(condensed.drift() < 1e-14, "{:e}", condensed.drift());
    // A number spoilt is seen.
    condensed.matrix[3] += 1e-6;
    assert!(condensed.drift() > 1e-9);
}

#[test]
fn what_cannot_be_exchanged_names_its_dof() {
    // Dofs 0 and 1 move as one: with both displacements given, the forces are not determined.
    let compliance = [1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 2.0];
    let mut condensed = CondensedMatrix::new(3, &compliance).unwrap();
    condensed.prescribe(0, Prescribed::Displacement).unwrap();
    let before = condensed.clone();
    let error = condensed.prescribe(1, Prescribed::Displacement).unwrap_err();
    assert_eq!(error, SwapError::SingularPivot { dof: 1, pivot: 0.0 });
    assert_eq!(condensed, before);
    assert_eq!(condensed.prescribe(3, Prescribed::Force), Err(SwapError::DofOutOfRange { dof: 3, m: 3 }));
    assert_eq!(CondensedMatrix::new(2, &compliance).unwrap_err(), SwapError::Shape { m: 2, len: 9 });
    let mut bad = compliance;
    bad[5] = f64::NAN;
    assert_eq!(CondensedMatrix::new(3, &bad).unwrap_err(), SwapError::NotFinite { row: 1, col: 2 });
    bad = compliance;
    bad[8] = -1.0;
    assert_eq!(CondensedMatrix::new(3, &bad).unwrap_err(), SwapError::SingularPivot { dof: 2, pivot: -1.0 });
}

#[test]
fn a_change_that_makes_the_matrix_singular_is_refused() {
    let mut woodbury = Woodbury::new();
    let identity = |_: &mut [f64]| {};
    let u = [1.0, 0.0, 0.0, 1.0];
    let singular = woodbury.build(2, &u, &[1.0, 0.0, 0.0, -1.0], identity).unwrap_err();
    assert_eq!(singular, WoodburyError::Singular { column: 1, pivot: 0.0 });
    let shape = WoodburyError::Shape { what: "C", len: 3, expected: 1 };
    assert_eq!(woodbury.build(2, &u, &[1.0; 3], identity), Err(shape));
    let shape = WoodburyError::Shape { what: "U", len: 4, expected: 2 };
    assert_eq!(woodbury.build(2, &u, &[1.0], identity), Err(shape));
    let nan = WoodburyError::NotFinite { what: "C", index: 0 };
    assert_eq!(woodbury.build(2, &u[..2], &[f64::NAN], identity), Err(nan));
    let nan = WoodburyError::NotFinite { what: "A₀⁻¹ U", index: 0 };
    assert_eq!(woodbury.build(2, &u[..2], &[1.0], |x| x.fill(f64::NAN)), Err(nan));
}

#[test]
fn frames_that_are_none_are_refused() {
    let mut k = vec![1.0; 16];
    let turn = [[0.0, -1.0], [1.0, 0.0]];
    assert_eq!(rotate_nodes(&mut k, &[turn]), Err(RotationError::Shape { nodes: 1, block: 2, len: 16 }));
    assert_eq!(rotate_node(&mut k, 2, 2, &turn), Err(RotationError::NodeOutOfRange { node: 2, nodes: 2 }));
    let skew = [[1.0, 0.5], [0.0, 1.0]];
    assert_eq!(rotate_nodes(&mut k, &[turn, skew]), Err(RotationError::NotOrthonormal { node: 1, difference: 0.5 }));
    let nan = rotate_node(&mut k, 2, 0, &[[f64::NAN, 0.0], [0.0, 1.0]]);
    assert!(matches!(nan, Err(RotationError::NotOrthonormal { node: 0, .. })));
    assert_eq!(k, vec![1.0; 16]);
}
