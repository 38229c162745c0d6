//! Laws that are defined for every deformation gradient: derivatives at inverted ones, the way back, ranges, damping.

use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};
use proptest::prelude::*;
use stylet_physics::material::{
    Corotated, Hyperelastic, Invertible, Lame, MaterialError, NeoHookean, RotationTangent, Solid, StVenantKirchhoff,
    Viscosity,
};
use stylet_physics::svd::signed_svd;

const YOUNG: f64 = 34e3;

/// The nonlinear laws that are defined for every `F`.
pub const SURVIVORS: [&str; 5] =
    ["corotated", "fixed-corotated", "stable-neo-hookean", "invertible-st-venant-kirchhoff", "invertible-neo-hookean"];

fn solid(model: &str, nu: f64) -> Solid {
    Solid::from_young_poisson(model, YOUNG, nu).unwrap()
}

pub fn matrix<const D: usize>(size: f64) -> impl Strategy<Value = SMatrix<f64, D, D>> {
    prop::collection::vec(-size..size, D * D).prop_map(|h| SMatrix::from_column_slice(&h))
}

/// Stress and differential against differences of fourth order of the energy and of the stress, at a distance from the
/// places where a law has a kink: `sigma_i + sigma_k = 0`, and the thresholds of continued laws.
pub fn derivatives<const D: usize>(
    m: &impl Hyperelastic<D>,
    model: &str,
    nu: f64,
    f: &SMatrix<f64, D, D>,
    df: &SMatrix<f64, D, D>,
) -> Result<(), TestCaseError> {
    let svd = signed_svd(f);
    let gap = svd.sigma[D - 2] + svd.sigma[D - 1];
    prop_assume!(df.norm() > 0.1);
    prop_assume!(gap > 0.2 && svd.sigma.iter().all(|s| (s - 0.25).abs() > 0.01 && (s - 0.65).abs() > 0.01));
    let (h, df) = (1e-3, df / df.norm());
    let p = m.first_piola_kirchhoff(f);
    let w = |t: f64| m.energy_density(&(f + df * t));
    let slope = (8.0 * (w(h) - w(-h)) - (w(2.0 * h) - w(-2.0 * h))) / (12.0 * h);
    let scale = YOUNG / (1.0 - 2.0 * nu) * (1.0 + f.norm_squared() * f.norm_squared());
    prop_assert!((slope - p.dot(&df)).abs() <= 1e-7 * scale, "{model}: slope {slope} against {}", p.dot(&df));
    let stress = |t: f64| m.first_piola_kirchhoff(&(f + df * t));
    let dp = ((stress(h) - stress(-h)) * 8.0 - (stress(2.0 * h) - stress(-2.0 * h))) / (12.0 * h);
    let found = m.stress_differential(f, &df);
    prop_assert!((dp - found).norm() <= 1e-6 * scale, "{model}: differential {found} against {dp}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn derivatives_under_inversion(which in 0..SURVIVORS.len(), nu in prop::sample::select(vec![0.0, 0.3, 0.45, 0.495]),
                                   f in matrix::<3>(1.5), df in matrix::<3>(1.0),
                                   f2 in matrix::<2>(1.5), df2 in matrix::<2>(1.0)) {
        let (model, law) = (SURVIVORS[which], solid(SURVIVORS[which], nu));
        derivatives(&law, model, nu, &f, &df)?;
        derivatives(&law, model, nu, &f2, &df2)?;
    }

    /// `P(R F) = R P(F)` for inverted `F` too.
    #[test]
    fn objectivity_under_inversion(which in 0..SURVIVORS.len(), f in matrix::<3>(1.5),
                                   axis in prop::array::uniform3(-2.0..2.0f64)) {
        let svd = signed_svd(&f);
        prop_assume!(svd.sigma[1] + svd.sigma[2] > 1e-2);
        let (m, r) = (solid(SURVIVORS[which], 0.45), Rotation3::new(Vector3::from(axis)).into_inner());
        let (p, turned) = (m.first_piola_kirchhoff(&f), m.first_piola_kirchhoff(&(r * f)));
        prop_assert!((turned - r * p).norm() <= 1e-10 * (YOUNG + p.norm()), "{turned} against {}", r * p);
    }

    /// The power of damping is never negative, a rigid motion costs none, and the differential is the derivative.
    #[test]
    fn damping(psi in 0.1..10.0f64, share in -0.6..10.0f64, f in matrix::<3>(1.5), rate in matrix::<3>(3.0),
               df in matrix::<3>(1.0)) {
        let viscosity = Viscosity::new(psi, share * psi).unwrap();
        let scale = psi * (1.0 + share.abs());
        prop_assert!(viscosity.stress(&f, &rate).dot(&rate) >= -1e-12 * scale * rate.norm_squared());
        let stretch = stylet_physics::svd::polar_rotation(&f).transpose() * f;
        let svd = signed_svd(&f);
        prop_assume!(svd.sigma[1] + svd.sigma[2] > 0.2);
        prop_assert!((stretch - stretch.transpose()).norm() <= 1e-13 * (1.0 + f.norm()));
        let spin = (rate - rate.transpose()) * 0.5;
        let rotation = stylet_physics::svd::polar_rotation(&f);
        prop_assert!(viscosity.stress(&rotation, &(spin * rotation)).norm() <= 1e-12 * scale * spin.norm());
        let at = |t: f64| viscosity.stress(&(f + df * t), &rate);
        let h = 1e-3;
        let difference = ((at(h) - at(-h)) * 8.0 - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let found = viscosity.stress_differential(&f, &rate, &df);
        prop_assert!((difference - found).norm() <= 1e-5 * scale * rate.norm(), "{found} against {difference}");
    }

    /// Held rotations: semidefinite everywhere, and exact in an unstrained element however it is turned.
    #[test]
    fn held_rotations(f in matrix::<3>(1.5), df in matrix::<3>(1.0), axis in prop::array::uniform3(-2.0..2.0f64)) {
        let exact = Corotated::from_young_poisson(YOUNG, 0.45).unwrap();
        let held = exact.with_rotation(RotationTangent::Held);
        prop_assert!(held.stress_differential(&f, &df).dot(&df) >= -1e-10 * YOUNG * df.norm_squared());
        let r = Rotation3::new(Vector3::from(axis)).into_inner();
        let difference = held.stress_differential(&r, &df) - exact.stress_differential(&r, &df);
        prop_assert!(difference.norm() <= 1e-11 * YOUNG * df.norm());
        prop_assert_eq!(held.first_piola_kirchhoff(&f), exact.first_piola_kirchhoff(&f));
    }
}

/// J3: a corner pushed through the opposite face by 0.5, 1 and 5 heights. The force points back, and is finite; across
/// `J = 0` and everywhere else it is continuous.
#[test]
fn j3_single_element_inversion() {
    for model in SURVIVORS {
        for nu in [0.3, 0.45, 0.495] {
            let m = solid(model, nu);
            // The corner over the face z = 0 at height h: F = diag(1, 1, h), and the force on it is -P33 times an area.
            let force = |h: f64| -m.first_piola_kirchhoff(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, h)))[(2, 2)];
            for depth in [0.5, 1.0, 5.0] {
                let back = force(-depth);
                assert!(back.is_finite() && back > 0.0, "{model}, nu {nu}, {depth} heights: {back} Pa");
            }
            let (above, below) = (force(1e-9), force(-1e-9));
            assert!((above - below).abs() <= 1e-6 * above.abs(), "{model}: {above} against {below} across J = 0");
        }
    }
}

/// Without an extension an inverted element has no energy, and says so.
#[test]
fn plain_laws_refuse_inversion() {
    let f = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -0.5));
    for model in Solid::MODELS {
        let m = solid(model, 0.45);
        let refuses = Hyperelastic::<3>::requires_positive_j(&m);
        assert_eq!(refuses, ["st-venant-kirchhoff", "neo-hookean"].contains(&model), "{model}");
        assert_eq!(m.energy_density(&f).is_infinite(), refuses, "{model}");
    }
}

/// Above its threshold a continued law is the law.
#[test]
fn continued_laws_above_their_threshold() {
    let f = Matrix3::new(1.1, 0.2, -0.1, 0.05, 0.9, 0.1, 0.0, -0.2, 1.2);
    for nu in [0.0, 0.3, 0.45] {
        let neo = NeoHookean::from_young_poisson(YOUNG, nu).unwrap();
        let stvk = StVenantKirchhoff::from_young_poisson(YOUNG, nu).unwrap();
        let p = neo.first_piola_kirchhoff(&f);
        assert!((Invertible::new(neo).first_piola_kirchhoff(&f) - p).norm() <= 1e-12 * YOUNG + 1e-12 * p.norm());
        let p = stvk.first_piola_kirchhoff(&f);
        assert!((Invertible::new(stvk).first_piola_kirchhoff(&f) - p).norm() <= 1e-12 * YOUNG + 1e-12 * p.norm());
    }
}

#[test]
fn parameters_out_of_range_are_errors() {
    for model in Solid::MODELS {
        for young in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Solid::from_young_poisson(model, young, 0.3).unwrap_err();
            assert!(matches!(error, MaterialError::YoungModulus { .. }), "{model}: {error}");
        }
        for nu in [0.5, -1.0, f64::NAN, f64::INFINITY] {
            let error = Solid::from_young_poisson(model, YOUNG, nu).unwrap_err();
            assert!(matches!(error, MaterialError::PoissonRatio { .. }), "{model}: {error}");
        }
        let law = solid(model, 0.3);
        assert_eq!(law.model(), model);
        let text = serde_json::to_string(&law).unwrap();
        assert!(text.starts_with(&format!("{{\"model\":\"{model}\"")), "{text}");
        assert_eq!(serde_json::from_str::<Solid>(&text).unwrap(), law);
    }
    let unknown = Solid::from_young_poisson("rubber", YOUNG, 0.3).unwrap_err().to_string();
    assert!(unknown.contains("rubber") && unknown.contains("fixed-corotated"), "{unknown}");
    let neo = NeoHookean::from_young_poisson(YOUNG, 0.3).unwrap();
    for threshold in [0.0, 1.0, -0.1, f64::NAN] {
        assert!(matches!(Invertible::with_threshold(neo, threshold), Err(MaterialError::Threshold { .. })));
    }
    assert!(Invertible::with_threshold(StVenantKirchhoff::from_young_poisson(YOUNG, 0.3).unwrap(), 0.5).is_err());
    let lame = Lame::from_young_poisson(YOUNG, 0.45).unwrap();
    assert!(
        Viscosity::new(0.0, 0.0).is_err()
            && Viscosity::new(1.0, -0.7).is_err()
            && Viscosity::new(f64::NAN, 0.0).is_err()
    );
    assert!(Viscosity::kelvin_voigt(lame, -1.0).is_err());
    assert_eq!(Viscosity::kelvin_voigt(lame, 0.01).unwrap().psi(), 0.01 * lame.mu());
}
