use super::*;
use crate::small::determinant;
use nalgebra::{DMatrix, Matrix2, Matrix3, Rotation2, Rotation3, Vector3};
use proptest::prelude::*;

fn diagonal<const D: usize>(sigma: &[f64; D]) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|i, k| if i == k { sigma[i] } else { 0.0 })
}

/// Rotations, order, sign and reconstruction, to 1e-12 of the norm; the values against those of nalgebra.
fn check<const D: usize>(f: &SMatrix<f64, D, D>) {
    let SignedSvd { u, sigma, v } = signed_svd(f);
    let identity = SMatrix::<f64, D, D>::identity();
    for q in [&u, &v, &polar_rotation(f)] {
        assert!((q.transpose() * q - identity).norm() <= 1e-14, "{f}: not orthogonal {q}");
        assert!(determinant(q) > 0.0, "{f}: not a rotation {q}");
    }
    // Scaled by a power of two, so that the norms themselves neither overflow nor underflow.
    let largest = f.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let (g, values) = (f / largest, sigma.map(|s| s / largest));
    let rebuilt = u * diagonal(&values) * v.transpose();
    assert!((rebuilt - g).norm() <= 1e-14 * (1.0 + g.norm()), "{f}: rebuilt {rebuilt}");
    for k in 1..D {
        assert!(values[k - 1] >= values[k].abs() - 1e-15 && values[k - 1] >= 0.0, "{f}: order {sigma:?}");
    }
    let mut peer: Vec<f64> = DMatrix::from_column_slice(D, D, g.as_slice()).singular_values().iter().copied().collect();
    peer.sort_by(|a, b| b.total_cmp(a));
    for (found, peer) in values.iter().zip(&peer) {
        assert!((found.abs() - peer).abs() <= 1e-12 * (1.0 + g.norm()), "{f}: {sigma:?} against {peer}");
    }
    // The rotation is the closest: R^T F is symmetric.
    let stretch = polar_rotation(f).transpose() * g;
    assert!((stretch - stretch.transpose()).norm() <= 1e-12 * (1.0 + g.norm()), "{f}: stretch {stretch}");
}

/// A group of four matrices gives the bits of each alone.
fn check_lanes<const D: usize>(matrices: &[SMatrix<f64, D, D>; LANES]) {
    let mut group = [[Pack::ZERO; D]; D];
    for (lane, f) in matrices.iter().enumerate() {
        for i in 0..D {
            for k in 0..D {
                group[i][k].0[lane] = f[(i, k)];
            }
        }
    }
    let (svd, polar) = (signed_svd_pack(&group), polar_rotation_lanes(&unpack(group)));
    for (lane, f) in matrices.iter().enumerate() {
        let alone = signed_svd(f);
        assert_eq!(lane_of(&svd.u, lane), alone.u);
        assert_eq!(lane_of(&svd.v, lane), alone.v);
        assert_eq!(svd.sigma.map(|s| s.0[lane]), alone.sigma);
        assert_eq!(lane_of(&pack(&polar), lane), polar_rotation(f));
    }
}

/// Values of any size, repeated, zero, tiny, and negative.
fn stretches<const D: usize>() -> impl Strategy<Value = [f64; D]> {
    let one = prop_oneof![
        4 => -2.0..2.0f64,
        1 => Just(0.0),
        1 => Just(1.0),
        1 => Just(-1.0),
        2 => (-18.0..0.0f64).prop_map(|e| 10f64.powf(e)),
    ];
    prop::collection::vec(one, D).prop_map(|s| std::array::from_fn(|i| s[i]))
}

fn plane() -> impl Strategy<Value = Matrix2<f64>> {
    (stretches::<2>(), -3.2..3.2f64, -3.2..3.2f64, -140.0..140.0f64)
        .prop_map(|(s, a, b, e)| Rotation2::new(a).matrix() * diagonal(&s) * Rotation2::new(b).matrix() * 10f64.powf(e))
}

fn space() -> impl Strategy<Value = Matrix3<f64>> {
    let axis = || prop::array::uniform3(-2.0..2.0f64);
    (stretches::<3>(), axis(), axis(), -140.0..140.0f64).prop_map(|(s, a, b, e)| {
        let [a, b] = [a, b].map(|a| Rotation3::new(Vector3::from(a)));
        a.matrix() * diagonal(&s) * b.matrix() * 10f64.powf(e)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn decompositions_in_the_plane(f in plane(), g in plane(), h in plane()) {
        check(&f);
        check_lanes(&[f, g, h, Matrix2::identity()]);
    }

    #[test]
    fn decompositions_in_space(f in space(), g in space(), h in space()) {
        check(&f);
        check_lanes(&[f, g, h, Matrix3::identity()]);
    }

    /// Moderate deformations, where the rotation comes from Newton's iteration: it is `U V^T`.
    #[test]
    fn rotations_of_both_methods_agree(h in prop::array::uniform9(-0.4..0.4f64)) {
        let f = Matrix3::identity() + Matrix3::from_row_slice(&h);
        let svd = signed_svd(&f);
        // The rotation is as well determined as the sum of the two smallest values is large.
        let gap = svd.sigma[1] + svd.sigma[2];
        prop_assert!((polar_rotation(&f) - svd.u * svd.v.transpose()).norm() <= 1e-14 / gap.min(1.0));
    }
}

#[test]
fn special_matrices() {
    for f in [
        Matrix3::zeros(),
        Matrix3::identity(),
        -Matrix3::identity(),
        Matrix3::from_element(1.0),
        Matrix3::from_diagonal(&Vector3::new(1.0, 1e-200, -1e-200)),
        Matrix3::from_diagonal(&Vector3::new(1e-308, 1e-310, 0.0)),
        Matrix3::from_element(5e-324),
        Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
        Matrix3::new(0.0, 0.0, 1e300, 0.0, 0.0, 0.0, 1e-300, 0.0, 0.0),
        Matrix3::from_element(5e307),
    ] {
        check(&f);
    }
    for f in [
        Matrix2::zeros(),
        Matrix2::new(1.0, 0.0, 0.0, -1.0),
        Matrix2::new(0.0, 1.0, 1.0, 0.0),
        Matrix2::new(0.0, 0.0, 1e300, 0.0),
    ] {
        check(&f);
    }
}

/// No hang and no panic, and what comes out cannot be mistaken for a rotation.
#[test]
fn not_finite_in_not_finite_out() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for place in 0..9 {
            let mut f = Matrix3::identity();
            f[place] = bad;
            let (svd, r) = (signed_svd(&f), polar_rotation(&f));
            assert!(svd.sigma.iter().any(|s| !s.is_finite()), "{f}: {svd:?}");
            assert!(r.iter().any(|x| !x.is_finite()), "{f}: {r}");
        }
        assert!(polar_rotation(&Matrix2::new(bad, 0.0, 0.0, 1.0)).iter().any(|x| !x.is_finite()));
    }
}
