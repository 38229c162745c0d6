//! Derivatives, objectivity and definiteness of every material, on random deformation gradients.

use nalgebra::{Matrix2, Matrix3, Rotation2, Rotation3, SMatrix, Vector3};
use proptest::prelude::*;
use stylet_physics::lanes::{LANES, Lane};
use stylet_physics::material::{
    Corotated, FixedCorotated, Hyperelastic, Invertible, Linear, NeoHookean, PlaneStress, Solid, StVenantKirchhoff,
    StableNeoHookean,
};

const YOUNG: f64 = 34e3;

/// A check of every solid, in two dimensions (plane strain) or three.
macro_rules! each_solid {
    ($nu:expr, $check:ident, $($arg:expr),+) => {{
        let stvk = StVenantKirchhoff::from_young_poisson(YOUNG, $nu).unwrap();
        let neo = NeoHookean::from_young_poisson(YOUNG, $nu).unwrap();
        $check(&Linear::from_young_poisson(YOUNG, $nu).unwrap(), "linear", $($arg),+)?;
        $check(&stvk, "StVK", $($arg),+)?;
        $check(&neo, "NH", $($arg),+)?;
        each_invertible!($nu, $check, $($arg),+);
    }};
}

/// A check of every nonlinear solid that is defined under inversion.
macro_rules! each_invertible {
    ($nu:expr, $check:ident, $($arg:expr),+) => {{
        let stvk = StVenantKirchhoff::from_young_poisson(YOUNG, $nu).unwrap();
        let neo = NeoHookean::from_young_poisson(YOUNG, $nu).unwrap();
        $check(&Corotated::from_young_poisson(YOUNG, $nu).unwrap(), "corotated", $($arg),+)?;
        $check(&FixedCorotated::from_young_poisson(YOUNG, $nu).unwrap(), "fixed corotated", $($arg),+)?;
        $check(&StableNeoHookean::from_young_poisson(YOUNG, $nu).unwrap(), "stable NH", $($arg),+)?;
        $check(&Invertible::new(stvk), "invertible StVK", $($arg),+)?;
        $check(&Invertible::new(neo), "invertible NH", $($arg),+)?;
    }};
}

/// A check of every material of two dimensions (plane strain, then plane stress).
macro_rules! each_2d {
    ($nu:expr, $check:ident, $($arg:expr),+) => {{
        let linear = Linear::from_young_poisson(YOUNG, $nu).unwrap();
        let stvk = StVenantKirchhoff::from_young_poisson(YOUNG, $nu).unwrap();
        let neo = NeoHookean::from_young_poisson(YOUNG, $nu).unwrap();
        each_solid!($nu, $check, $($arg),+);
        $check(&PlaneStress::new(linear), "plane stress linear", $($arg),+)?;
        $check(&PlaneStress::new(stvk), "plane stress StVK", $($arg),+)?;
        $check(&PlaneStress::new(neo), "plane stress NH", $($arg),+)?;
    }};
}

/// Random matrices `I + H` with entries of `H` up to `size`.
pub fn gradient<const D: usize>(size: f64) -> impl Strategy<Value = SMatrix<f64, D, D>> {
    prop::collection::vec(-size..size, D * D)
        .prop_map(|h| SMatrix::<f64, D, D>::identity() + SMatrix::<f64, D, D>::from_column_slice(&h))
}

/// Random directions of norm one.
pub fn direction<const D: usize>() -> impl Strategy<Value = SMatrix<f64, D, D>> {
    prop::collection::vec(-1.0..1.0f64, D * D)
        .prop_map(|h| SMatrix::<f64, D, D>::from_column_slice(&h))
        .prop_filter("a direction", |h| h.norm() > 0.1)
        .prop_map(|h| h / h.norm())
}

/// Whether a remainder falls as `h^2`: the logarithm of its drop over a decade is two, unless the second order term is
/// itself small (then it is three) or the remainder is round-off (below `1e-11` of the modulus). Where the terms of second
/// and third order cancel at one of the steps, the next decade decides; a wrong derivative has order one in both.
fn order_is_two(remainder: impl Fn(f64) -> f64) -> bool {
    let falls = |h: f64| {
        let (coarse, fine) = (remainder(h), remainder(0.1 * h));
        fine < 1e-11 * YOUNG || (coarse / fine).log10() > 1.9
    };
    falls(1e-3) || falls(1e-4)
}

pub fn taylor<const D: usize>(
    m: &impl Hyperelastic<D>,
    name: &str,
    f: &SMatrix<f64, D, D>,
    df: &SMatrix<f64, D, D>,
) -> Result<(), TestCaseError> {
    let (w, p, dp) = (m.energy_density(f), m.first_piola_kirchhoff(f), m.stress_differential(f, df));
    if w.is_infinite() {
        return Ok(());
    }
    let energy = |h: f64| (m.energy_density(&(f + df * h)) - w - h * p.dot(df)).abs();
    prop_assert!(order_is_two(energy), "{name}: stress, remainders {} {}", energy(1e-3), energy(1e-4));
    let stress = |h: f64| (m.first_piola_kirchhoff(&(f + df * h)) - p - dp * h).norm();
    prop_assert!(order_is_two(stress), "{name}: differential, remainders {} {}", stress(1e-3), stress(1e-4));

    // Central differences of the energy, 1e-7 relative to the modulus.
    let h = 1e-5;
    let slope = (m.energy_density(&(f + df * h)) - m.energy_density(&(f - df * h))) / (2.0 * h);
    prop_assert!((slope - p.dot(df)).abs() <= 1e-7 * YOUNG.max(p.norm()), "{name}: {slope} against {}", p.dot(df));

    // The tangent is the differential on a basis, and symmetric.
    let tangent = m.tangent(f);
    prop_assert!((tangent.apply(df) - dp).norm() <= 1e-12 * (YOUNG + dp.norm()), "{name}: tangent");
    for j in 0..D {
        for l in 0..D {
            let asymmetry = (tangent.blocks[j][l] - tangent.blocks[l][j].transpose()).norm();
            prop_assert!(asymmetry <= 1e-12 * (YOUNG + tangent.blocks[j][l].norm()), "{name}: symmetry");
        }
    }
    Ok(())
}

/// `P(I) = 0`, and for nonlinear laws `P(R F) = R P(F)`, `W(R F) = W(F)`.
pub fn objective<const D: usize, M: Hyperelastic<D>>(
    m: &M,
    name: &str,
    f: &SMatrix<f64, D, D>,
    r: &SMatrix<f64, D, D>,
) -> Result<(), TestCaseError> {
    let identity = SMatrix::<f64, D, D>::identity();
    prop_assert!(m.first_piola_kirchhoff(&identity).norm() <= 1e-13 * YOUNG, "{name}: stress at rest");
    prop_assert!(m.energy_density(&identity).abs() <= 1e-13 * YOUNG, "{name}: energy at rest");
    if M::IS_LINEAR || m.energy_density(f).is_infinite() {
        return Ok(());
    }
    let (p, turned) = (m.first_piola_kirchhoff(f), m.first_piola_kirchhoff(&(r * f)));
    prop_assert!((turned - r * p).norm() <= 1e-12 * (YOUNG + p.norm()), "{name}: {turned} against {}", r * p);
    let (w, turned) = (m.energy_density(f), m.energy_density(&(r * f)));
    prop_assert!((w - turned).abs() <= 1e-12 * (YOUNG + w), "{name}: {w} against {turned}");
    Ok(())
}

/// The closed form of the element stiffness against the contraction of the tangent.
pub fn closed_stiffness<const D: usize, const N: usize>(
    m: &impl Hyperelastic<D>,
    name: &str,
    f: &SMatrix<f64, D, D>,
    gradients: &[[f64; D]; N],
) -> Result<(), TestCaseError> {
    if m.energy_density(f).is_infinite() {
        return Ok(());
    }
    let zero = [[0.0; D]; D];
    let (mut closed, mut generic) = (vec![zero; N * (N + 1) / 2], vec![zero; N * (N + 1) / 2]);
    m.element_stiffness(f, gradients, 0.7, &mut closed);
    m.tangent(f).element_stiffness(gradients, 0.7, &mut generic);
    let norm = |k: &[[[f64; D]; D]]| k.iter().flatten().flatten().map(|x| x * x).sum::<f64>().sqrt();
    let difference: Vec<_> = closed
        .iter()
        .zip(&generic)
        .map(|(x, y)| std::array::from_fn(|i| std::array::from_fn(|k| x[i][k] - y[i][k])))
        .collect();
    prop_assert!(norm(&difference) <= 1e-12 * (YOUNG + norm(&generic)), "{name}");
    Ok(())
}

/// The projection is semidefinite, idempotent, and leaves a semidefinite tangent alone.
fn projection<const D: usize>(
    m: &impl Hyperelastic<D>,
    name: &str,
    f: &SMatrix<f64, D, D>,
    df: &SMatrix<f64, D, D>,
) -> Result<(), TestCaseError> {
    if m.energy_density(f).is_infinite() {
        return Ok(());
    }
    let tangent = m.tangent(f);
    let projected = tangent.projected();
    let scale = tangent.blocks.iter().flatten().map(|b| b.norm_squared()).sum::<f64>().sqrt();
    let (before, after) = (tangent.apply(df).dot(df), projected.apply(df).dot(df));
    prop_assert!(after >= -1e-11 * scale, "{name}: curvature {after}");
    prop_assert!(after >= before - 1e-11 * scale, "{name}: the projection only adds");
    prop_assert!((projected.projected().apply(df) - projected.apply(df)).norm() <= 1e-11 * scale, "{name}: idempotent");
    Ok(())
}

/// Triangles and tetrahedra of any shape: the last `N - 1` gradients are free, the first makes their sum zero.
pub fn shape_gradients<const D: usize, const N: usize>(rows: &SMatrix<f64, D, D>) -> [[f64; D]; N] {
    let mut g = [[0.0; D]; N];
    for a in 1..N {
        for i in 0..D {
            g[a][i] = rows[(a - 1, i)];
            g[0][i] -= g[a][i];
        }
    }
    g
}

/// The analytic projection is the numeric one.
pub fn analytic_projection<const D: usize>(
    m: &impl Hyperelastic<D>,
    name: &str,
    f: &SMatrix<f64, D, D>,
    df: &SMatrix<f64, D, D>,
) -> Result<(), TestCaseError> {
    if m.energy_density(f).is_infinite() {
        return Ok(());
    }
    let tangent = m.tangent(f);
    let (numeric, analytic) = (tangent.projected().apply(df), m.projected_tangent(f).apply(df));
    let scale = tangent.blocks.iter().flatten().map(|b| b.norm_squared()).sum::<f64>().sqrt();
    prop_assert!((numeric - analytic).norm() <= 1e-9 * (YOUNG + scale), "{name}: {numeric} against {analytic}");
    Ok(())
}

/// Groups of elements give the bits of single ones, whatever stands in the other lanes.
pub fn groups<const D: usize, const N: usize>(
    m: &impl Hyperelastic<D>,
    name: &str,
    f: &[SMatrix<f64, D, D>; LANES],
    g: &[[f64; D]; N],
) -> Result<(), TestCaseError> {
    let lanes = f.map(|f| m.energy_density(&f));
    let mut group = [[[0.0; LANES]; D]; D];
    for (lane, f) in f.iter().enumerate() {
        for i in 0..D {
            for k in 0..D {
                group[i][k][lane] = f[(i, k)];
            }
        }
    }
    prop_assert_eq!(m.energy_lanes(&group), lanes, "{}: energies", name);
    let (stress, gradients): (_, [[Lane; D]; N]) = (m.stress_lanes(&group), g.map(|g| g.map(|x| [x; LANES])));
    let (mut held, mut projected) = (vec![[[[0.0; LANES]; D]; D]; N * (N + 1) / 2], Vec::new());
    projected.clone_from(&held);
    m.element_stiffness_lanes(&group, &gradients, &[0.7; LANES], false, &mut held);
    m.element_stiffness_lanes(&group, &gradients, &[0.7; LANES], true, &mut projected);
    let mut upper = vec![[[0.0; D]; D]; N * (N + 1) / 2];
    for (lane, f) in f.iter().enumerate().filter(|&(lane, _)| lanes[lane].is_finite()) {
        let p = m.first_piola_kirchhoff(f).transpose();
        let at =
            |blocks: &[[[Lane; D]; D]]| -> Vec<f64> { blocks.iter().flatten().flatten().map(|x| x[lane]).collect() };
        prop_assert_eq!(at(&[stress]), p.as_slice(), "{}: stress", name);
        m.element_stiffness(f, g, 0.7, &mut upper);
        prop_assert_eq!(at(&held), upper.as_flattened().as_flattened(), "{}: stiffness", name);
        // Not to the bit: a single projected tangent is expanded before it is contracted.
        m.projected_tangent(f).element_stiffness(g, 0.7, &mut upper);
        let scale = upper.iter().flatten().flatten().fold(YOUNG, |m, x| m.max(x.abs()));
        for (x, y) in at(&projected).iter().zip(upper.as_flattened().as_flattened()) {
            prop_assert!((x - y).abs() <= 1e-11 * scale, "{name}: projected stiffness {x} against {y}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn derivatives_2d(nu in 0.0..0.49, f in gradient::<2>(0.35), df in direction::<2>()) {
        each_2d!(nu, taylor, &f, &df);
    }

    #[test]
    fn derivatives_3d(nu in 0.0..0.49, f in gradient::<3>(0.25), df in direction::<3>()) {
        each_solid!(nu, taylor, &f, &df);
    }

    #[test]
    fn objectivity_2d(nu in 0.0..0.49, f in gradient::<2>(0.35), angle in -3.2..3.2f64) {
        let r: Matrix2<f64> = Rotation2::new(angle).into_inner();
        each_2d!(nu, objective, &f, &r);
    }

    #[test]
    fn objectivity_3d(nu in 0.0..0.49, f in gradient::<3>(0.25), axis in prop::array::uniform3(-2.0..2.0f64)) {
        let r: Matrix3<f64> = Rotation3::new(Vector3::from(axis)).into_inner();
        each_solid!(nu, objective, &f, &r);
    }

    #[test]
    fn closed_forms_of_the_stiffness(nu in 0.0..0.49, f in gradient::<2>(0.35), g in gradient::<2>(2.0),
                                     f3 in gradient::<3>(0.25), g3 in gradient::<3>(2.0)) {
        each_2d!(nu, closed_stiffness, &f, &shape_gradients::<2, 3>(&g));
        each_solid!(nu, closed_stiffness, &f3, &shape_gradients::<3, 4>(&g3));
    }

    #[test]
    fn projection_to_semidefinite(nu in 0.0..0.49, f in gradient::<2>(0.8), df in direction::<2>(),
                                  f3 in gradient::<3>(0.6), df3 in direction::<3>()) {
        each_2d!(nu, projection, &f, &df);
        each_solid!(nu, projection, &f3, &df3);
    }

    #[test]
    fn analytic_projections(nu in 0.0..0.49, f in gradient::<2>(0.8), df in direction::<2>(),
                            f3 in gradient::<3>(0.6), df3 in direction::<3>()) {
        each_solid!(nu, analytic_projection, &f, &df);
        each_solid!(nu, analytic_projection, &f3, &df3);
    }

    #[test]
    fn groups_of_elements(nu in 0.0..0.49, f in prop::array::uniform4(gradient::<2>(0.8)), g in gradient::<2>(2.0),
                          f3 in prop::array::uniform4(gradient::<3>(0.6)), g3 in gradient::<3>(2.0)) {
        each_2d!(nu, groups, &f, &shape_gradients::<2, 3>(&g));
        each_solid!(nu, groups, &f3, &shape_gradients::<3, 4>(&g3));
        for model in Solid::MODELS {
            let solid = Solid::from_young_poisson(model, YOUNG, nu).unwrap();
            groups(&solid, model, &f, &shape_gradients::<2, 3>(&g))?;
            groups(&solid, model, &f3, &shape_gradients::<3, 4>(&g3))?;
        }
    }

    /// Plane strain is the three-dimensional law at `F33 = 1`; plane stress the one at the `F33` found by Newton's
    /// method on `P33 = 0`, energy and in-plane stress alike.
    #[test]
    fn two_dimensional_laws_are_the_solid(nu in 0.0..0.4999, f in gradient::<2>(0.35)) {
        plane_laws(&Linear::from_young_poisson(YOUNG, nu).unwrap(), &f, |m| (PlaneStress::new(*m), |p, f| p.thickness_stretch(f)))?;
        plane_laws(&StVenantKirchhoff::from_young_poisson(YOUNG, nu).unwrap(), &f, |m| (PlaneStress::new(*m), |p, f| p.thickness_stretch(f)))?;
        plane_laws(&NeoHookean::from_young_poisson(YOUNG, nu).unwrap(), &f, |m| (PlaneStress::new(*m), |p, f| p.thickness_stretch(f)))?;
    }
}

fn solid_gradient(f: &Matrix2<f64>, q: f64) -> Matrix3<f64> {
    Matrix3::new(f[(0, 0)], f[(0, 1)], 0.0, f[(1, 0)], f[(1, 1)], 0.0, 0.0, 0.0, q)
}

pub type Stretch<P> = fn(&P, &Matrix2<f64>) -> f64;

pub fn plane_laws<M: Hyperelastic<3> + Hyperelastic<2>, P: Hyperelastic<2>>(
    solid: &M,
    f: &Matrix2<f64>,
    thin: impl Fn(&M) -> (P, Stretch<P>),
) -> Result<(), TestCaseError> {
    let (thin, stretch) = thin(solid);
    let in_plane = |p: Matrix3<f64>| p.fixed_view::<2, 2>(0, 0).into_owned();
    if <M as Hyperelastic<2>>::energy_density(solid, f).is_finite() {
        let full = solid_gradient(f, 1.0);
        let strain: Matrix2<f64> = <M as Hyperelastic<2>>::first_piola_kirchhoff(solid, f);
        let of_solid = <M as Hyperelastic<3>>::first_piola_kirchhoff(solid, &full);
        prop_assert!((strain - in_plane(of_solid)).norm() <= 1e-12 * (YOUNG + of_solid.norm()));
        let (w2, w3) =
            (<M as Hyperelastic<2>>::energy_density(solid, f), <M as Hyperelastic<3>>::energy_density(solid, &full));
        prop_assert!((w2 - w3).abs() <= 1e-12 * (YOUNG + w3), "plane strain energy {w2} against {w3}");
    }
    if thin.energy_density(f).is_finite() {
        // Newton on P33(q) = 0 from the far side, with a guard that keeps q positive.
        let (mut q, mut axis) = (1.0, Matrix3::zeros());
        axis[(2, 2)] = 1.0;
        for _ in 0..200 {
            let full = solid_gradient(f, q);
            let residual = <M as Hyperelastic<3>>::first_piola_kirchhoff(solid, &full)[(2, 2)];
            let slope = <M as Hyperelastic<3>>::stress_differential(solid, &full, &axis)[(2, 2)];
            let next = q - residual / slope;
            q = if next > 0.0 || <M as Hyperelastic<2>>::IS_LINEAR { next } else { 0.5 * q };
        }
        prop_assert!((q - stretch(&thin, f)).abs() <= 1e-9 * q.abs().max(1.0), "q = {q} against {}", stretch(&thin, f));
        // At the closed form itself the solid is free of stress in the third direction.
        let full = solid_gradient(f, stretch(&thin, f));
        let of_solid = <M as Hyperelastic<3>>::first_piola_kirchhoff(solid, &full);
        let stiff = <M as Hyperelastic<3>>::stress_differential(solid, &full, &axis)[(2, 2)];
        prop_assert!(of_solid[(2, 2)].abs() <= 1e-13 * stiff.max(YOUNG), "P33 = {}", of_solid[(2, 2)]);
        let stress = thin.first_piola_kirchhoff(f);
        prop_assert!((stress - in_plane(of_solid)).norm() <= 1e-12 * (stiff + of_solid.norm()));
        let (w2, w3) = (thin.energy_density(f), <M as Hyperelastic<3>>::energy_density(solid, &full));
        prop_assert!((w2 - w3).abs() <= 1e-12 * (stiff + w3), "plane stress energy {w2} against {w3}");
    }
    Ok(())
}

/// Outside the domain the energy is infinite, never NaN, and nothing panics.
#[test]
fn energies_outside_the_domain_are_infinite() {
    let (stvk, neo) = (
        StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap(),
        NeoHookean::from_young_poisson(YOUNG, 0.45).unwrap(),
    );
    let bad = [
        Matrix2::new(-1.0, 0.0, 0.0, 1.0),
        Matrix2::zeros(),
        Matrix2::new(f64::NAN, 0.0, 0.0, 1.0),
        Matrix2::new(f64::INFINITY, 0.0, 0.0, 1.0),
        Matrix2::new(1e308, 1e308, -1e308, 1e308),
    ];
    for f in &bad {
        assert_eq!(stvk.energy_density(f), f64::INFINITY, "{f}");
        assert_eq!(neo.energy_density(f), f64::INFINITY, "{f}");
        assert_eq!(PlaneStress::new(stvk).energy_density(f), f64::INFINITY, "{f}");
        assert_eq!(PlaneStress::new(neo).energy_density(f), f64::INFINITY, "{f}");
        let (_, _) = (neo.first_piola_kirchhoff(f), neo.tangent(f).projected());
        let _ = (PlaneStress::new(neo).first_piola_kirchhoff(f), PlaneStress::new(stvk).tangent(f).projected());
    }
    let linear = Linear::from_young_poisson(YOUNG, 0.45).unwrap();
    assert!(linear.energy_density(&bad[0]).is_finite(), "linear elasticity is defined for every F");
    assert_eq!(linear.energy_density(&bad[2]), f64::INFINITY);
}

#[test]
fn poisson_ratio_zero_keeps_the_thickness() {
    let neo = PlaneStress::new(NeoHookean::from_young_poisson(YOUNG, 0.0).unwrap());
    assert_eq!(neo.thickness_stretch(&Matrix2::new(1.3, 0.2, -0.1, 0.9)), 1.0);
}

/// The neo-Hookean law refuses a negative Poisson's ratio, the others take it; none takes 0.5, -1 or NaN.
#[test]
fn ranges_of_poisson_ratio() {
    assert!(NeoHookean::from_young_poisson(YOUNG, -0.2).is_err());
    assert!(
        Linear::from_young_poisson(YOUNG, -0.2).is_ok() && StVenantKirchhoff::from_young_poisson(YOUNG, -0.2).is_ok()
    );
    for nu in [0.5, -1.0, f64::NAN] {
        assert!(Linear::from_young_poisson(YOUNG, nu).is_err());
        assert!(StVenantKirchhoff::from_young_poisson(YOUNG, nu).is_err());
        assert!(NeoHookean::from_young_poisson(YOUNG, nu).is_err());
    }
}

/// Constants from a file are checked like constants from a program.
#[test]
fn stored_materials_are_checked() {
    let neo = PlaneStress::new(NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap());
    let text = serde_json::to_string(&neo).unwrap();
    assert_eq!(serde_json::from_str::<PlaneStress<NeoHookean>>(&text).unwrap(), neo);
    let read = |lame: &str| {
        let text = format!("{{\"lame\":{lame}}}");
        (serde_json::from_str::<NeoHookean>(&text).is_ok(), serde_json::from_str::<Linear>(&text).is_ok())
    };
    assert_eq!(read("{\"mu\":1.0,\"lambda\":2.0}"), (true, true));
    assert_eq!(read("{\"mu\":1.0,\"lambda\":-0.5}"), (false, true));
    assert_eq!(read("{\"mu\":-1.0,\"lambda\":2.0}"), (false, false));
}
