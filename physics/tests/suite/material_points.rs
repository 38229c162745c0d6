//! Material points: stretches and shears of one element, whose free sides are found by Newton's method in the test.
//!
//! Each value is compared twice: with the equation solved here (1e-10) and with a table computed independently (half of
//! its last digit).

use nalgebra::{Matrix3, Vector3};
use stylet_physics::material::{Corotated, FixedCorotated, Hyperelastic, Linear, NeoHookean, StVenantKirchhoff};

const YOUNG: f64 = 34e3;

/// The stretch of the free sides at which the stress component on them vanishes, by Newton's method from `start`.
fn free_stretch(material: &impl Hyperelastic<3>, f: impl Fn(f64) -> Matrix3<f64>, start: f64) -> f64 {
    let mut b = start;
    for _ in 0..100 {
        let df = f(1.0) - f(0.0);
        let stress = material.first_piola_kirchhoff(&f(b))[(2, 2)];
        let slope = material.stress_differential(&f(b), &df)[(2, 2)];
        let step = stress / slope;
        b -= step.clamp(-0.5 * b, 0.5 * b);
        if step.abs() < 1e-15 {
            break;
        }
    }
    let stress = material.first_piola_kirchhoff(&f(b));
    assert!(stress[(2, 2)].abs() < 1e-10 * YOUNG, "the free side carries {} Pa", stress[(2, 2)]);
    b
}

fn uniaxial(s: f64) -> impl Fn(f64) -> Matrix3<f64> {
    move |b| Matrix3::from_diagonal(&Vector3::new(s, b, b))
}

fn equibiaxial(s: f64) -> impl Fn(f64) -> Matrix3<f64> {
    move |b| Matrix3::from_diagonal(&Vector3::new(s, s, b))
}

/// Half a unit of the last of `digits` significant digits of `value`.
fn half_digit(value: f64, digits: i32) -> f64 {
    0.5 * 10f64.powi(value.abs().log10().floor() as i32 + 1 - digits)
}

#[track_caller]
fn check_table(name: &str, computed: f64, table: f64, digits: i32) {
    let tolerance = half_digit(table, digits) * (1.0 + 1e-9);
    assert!((computed - table).abs() <= tolerance, "{name}: computed {computed}, table {table} +- {tolerance}");
}

#[track_caller]
fn check_exact(name: &str, computed: f64, exact: f64) {
    assert!((computed - exact).abs() <= 1e-10 * exact.abs(), "{name}: computed {computed}, exact {exact}");
}

#[test]
fn uniaxial_linear_for_any_poisson_ratio() {
    for nu in [0.0, 0.3, 0.34, 0.45, 0.49] {
        let material = Linear::from_young_poisson(YOUNG, nu).unwrap();
        for (s, stress, b) in
            [(0.7, -10200.0, 1.0 + 0.3 * nu), (1.2, 6800.0, 1.0 - 0.2 * nu), (1.5, 17000.0, 1.0 - 0.5 * nu)]
        {
            let found = free_stretch(&material, uniaxial(s), 1.0);
            check_exact("stretch", found, b);
            check_exact("stress", material.first_piola_kirchhoff(&uniaxial(s)(found))[(0, 0)], stress);
        }
    }
}

#[test]
fn uniaxial_st_venant_kirchhoff_for_any_poisson_ratio() {
    for nu in [0.0, 0.3, 0.34, 0.45, 0.49] {
        let material = StVenantKirchhoff::from_young_poisson(YOUNG, nu).unwrap();
        for (s, stress, shrink) in [(0.7, -6069.0, -0.51), (1.2, 8976.0, 0.44), (1.5, 31875.0, 1.25)] {
            let found = free_stretch(&material, uniaxial(s), 1.0);
            check_exact("stretch", found, (1.0f64 - shrink * nu).sqrt());
            check_exact("stress", material.first_piola_kirchhoff(&uniaxial(s)(found))[(0, 0)], stress);
        }
    }
}

#[test]
fn uniaxial_neo_hookean() {
    let table = [
        (0.34, 0.7, -13622.8, 1.11430),
        (0.34, 1.2, 5936.03, 0.937295),
        (0.34, 1.5, 12770.2, 0.860296),
        (0.45, 0.7, -14699.0, 1.16945),
        (0.45, 1.2, 5791.28, 0.920459),
        (0.45, 1.5, 12201.2, 0.830037),
        (0.49, 0.7, -15098.4, 1.19010),
        (0.49, 1.2, 5741.67, 0.914391),
        (0.49, 1.5, 12009.4, 0.819214),
    ];
    for (nu, s, stress, stretch) in table {
        let material = NeoHookean::from_young_poisson(YOUNG, nu).unwrap();
        let (mu, lambda) = (material.lame().mu(), material.lame().lambda());
        let b = free_stretch(&material, uniaxial(s), 1.0);
        let p = material.first_piola_kirchhoff(&uniaxial(s)(b))[(0, 0)];
        // Free sides: mu (b - 1/b) + lambda (J - 1) s b = 0 with J = s b^2; it gives the axial stress without lambda.
        assert!((mu * (b - 1.0 / b) + lambda * (s * b * b - 1.0) * s * b).abs() < 1e-10 * YOUNG);
        check_exact("stress", p, mu * (s - 1.0 / s) - mu * (b * b - 1.0) / s);
        check_table("stress", p, stress, 6);
        check_table("stretch", b, stretch, 6);
    }
}

#[test]
fn equibiaxial_linear_and_st_venant_kirchhoff() {
    let linear = Linear::from_young_poisson(YOUNG, 0.45).unwrap();
    for (s, stress, stretch) in [(0.7, -18545.5, 1.49091), (1.2, 12363.6, 0.672727), (1.5, 30909.1, 0.181818)] {
        let b = free_stretch(&linear, equibiaxial(s), 1.0);
        let p = linear.first_piola_kirchhoff(&equibiaxial(s)(b))[(0, 0)];
        check_exact("stress", p, YOUNG * (s - 1.0) / 0.55);
        check_exact("stretch", b, 1.0 - 2.0 * 0.45 / 0.55 * (s - 1.0));
        check_table("stress", p, stress, 6);
        check_table("stretch", b, stretch, 6);
    }
    let stvk = StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap();
    for (s, stress, stretch) in [(0.7, -11034.5, 1.35445), (1.2, 16320.0, 0.529150)] {
        let b = free_stretch(&stvk, equibiaxial(s), 1.0);
        let p = stvk.first_piola_kirchhoff(&equibiaxial(s)(b))[(0, 0)];
        let green = 0.5 * (s * s - 1.0);
        check_exact("stress", p, s * YOUNG * green / 0.55);
        check_exact("stretch", b, (1.0 - 2.0 * 2.0 * 0.45 / 0.55 * green).sqrt());
        check_table("stress", p, stress, 6);
        check_table("stretch", b, stretch, 6);
    }
}

#[test]
fn equibiaxial_neo_hookean() {
    let table = [
        (0.34, 0.7, -18470.9, 1.22848),
        (0.34, 1.2, 8494.34, 0.797832),
        (0.34, 1.5, 16388.5, 0.558836),
        (0.45, 0.7, -34332.1, 1.59368),
        (0.45, 1.2, 8878.15, 0.728900),
        (0.45, 1.5, 15787.8, 0.479673),
        (0.49, 0.7, -52205.3, 1.92170),
        (0.49, 1.2, 9011.54, 0.701568),
        (0.49, 1.5, 15563.2, 0.451552),
    ];
    for (nu, s, stress, stretch) in table {
        let material = NeoHookean::from_young_poisson(YOUNG, nu).unwrap();
        let mu = material.lame().mu();
        let b = free_stretch(&material, equibiaxial(s), 1.0);
        let p = material.first_piola_kirchhoff(&equibiaxial(s)(b))[(0, 0)];
        check_exact("stress", p, mu * (s - 1.0 / s) - mu * (b * b - 1.0) / s);
        check_table("stress", p, stress, 6);
        check_table("stretch", b, stretch, 6);
    }
}

#[test]
fn simple_shear() {
    let f = Matrix3::identity() + Matrix3::new(0.0, 0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for nu in [0.0, 0.34, 0.45, 0.49] {
        let material = NeoHookean::from_young_poisson(YOUNG, nu).unwrap();
        let (mu, p) = (material.lame().mu(), material.first_piola_kirchhoff(&f));
        check_exact("P12", p[(0, 1)], 0.6 * mu);
        check_exact("P21", p[(1, 0)], 0.6 * mu);
        assert!(p[(0, 0)].abs() < 1e-10 * mu && p[(1, 1)].abs() < 1e-10 * mu);
        // Cauchy stress, J = 1.
        check_exact("s11", (p * f.transpose())[(0, 0)], mu * 0.36);
    }
    let p = StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap().first_piola_kirchhoff(&f);
    check_table("P12", p[(0, 1)], 20962.8, 6);
    check_table("P21", p[(1, 0)], 7034.48, 6);
    check_table("P11", p[(0, 0)], 23213.8, 6);
}

/// The stretch at which an equibiaxial St. Venant-Kirchhoff sheet would lose its thickness has no solution beyond it.
#[test]
fn equibiaxial_st_venant_kirchhoff_runs_out_of_thickness() {
    let material = StVenantKirchhoff::from_young_poisson(YOUNG, 0.45).unwrap();
    // P33 stays positive however thin the sheet becomes.
    for b in [1.0, 0.5, 0.1, 1e-3, 1e-6] {
        assert!(material.first_piola_kirchhoff(&equibiaxial(1.5)(b))[(2, 2)] > 0.0);
    }
}

#[test]
fn uniaxial_corotated_for_any_poisson_ratio() {
    for nu in [0.0, 0.3, 0.34, 0.45, 0.49] {
        let material = Corotated::from_young_poisson(YOUNG, nu).unwrap();
        for (s, stress, b) in
            [(0.7, -10200.0, 1.0 + 0.3 * nu), (1.2, 6800.0, 1.0 - 0.2 * nu), (1.5, 17000.0, 1.0 - 0.5 * nu)]
        {
            let found = free_stretch(&material, uniaxial(s), 1.0);
            check_exact("stretch", found, b);
            check_exact("stress", material.first_piola_kirchhoff(&uniaxial(s)(found))[(0, 0)], stress);
        }
    }
}

#[test]
fn stretches_of_the_fixed_corotated_law() {
    let uniaxial_table = [
        (0.34, 0.7, -12109.5, 1.11162),
        (0.34, 1.2, 6327.67, 0.936736),
        (0.34, 1.5, 14748.9, 0.857883),
        (0.45, 0.7, -13592.7, 1.16767),
        (0.45, 1.2, 6124.95, 0.920174),
        (0.45, 1.5, 13941.3, 0.828888),
        (0.49, 0.7, -14200.8, 1.18966),
        (0.49, 1.2, 6053.35, 0.914325),
        (0.49, 1.5, 13665.0, 0.818949),
    ];
    for (nu, s, stress, stretch) in uniaxial_table {
        let material = FixedCorotated::from_young_poisson(YOUNG, nu).unwrap();
        let (mu, lambda) = (material.lame().mu(), material.lame().lambda());
        let b = free_stretch(&material, uniaxial(s), 1.0);
        let p = material.first_piola_kirchhoff(&uniaxial(s)(b))[(0, 0)];
        // Free sides: 2 mu (b - 1) + lambda (J - 1) s b = 0; it gives the axial stress without lambda.
        assert!((2.0 * mu * (b - 1.0) + lambda * (s * b * b - 1.0) * s * b).abs() < 1e-10 * YOUNG);
        check_exact("stress", p, 2.0 * mu * (s - 1.0) - 2.0 * mu * (b - 1.0) * b / s);
        check_table("stress", p, stress, 6);
        check_table("stretch", b, stretch, 6);
    }
    let material = FixedCorotated::from_young_poisson(YOUNG, 0.45).unwrap();
    for (s, stress, stretch) in [(0.7, -34928.1, 1.54053), (1.2, 8594.08, 0.724020), (1.5, 15616.0, 0.467806)] {
        let b = free_stretch(&material, equibiaxial(s), 1.0);
        let p = material.first_piola_kirchhoff(&equibiaxial(s)(b))[(0, 0)];
        let mu = material.lame().mu();
        check_exact("stress", p, 2.0 * mu * (s - 1.0) - 2.0 * mu * (b - 1.0) * b / s);
        check_table("stress", p, stress, 6);
        check_table("stretch", b, stretch, 6);
    }
}

#[test]
fn equibiaxial_corotated() {
    let material = Corotated::from_young_poisson(YOUNG, 0.45).unwrap();
    for (s, stress, stretch) in [(0.7, -18545.5, 1.49091), (1.2, 12363.6, 0.672727), (1.5, 30909.1, 0.181818)] {
        let b = free_stretch(&material, equibiaxial(s), 1.0);
        let p = material.first_piola_kirchhoff(&equibiaxial(s)(b))[(0, 0)];
        check_exact("stress", p, YOUNG * (s - 1.0) / 0.55);
        check_exact("stretch", b, 1.0 - 2.0 * 0.45 / 0.55 * (s - 1.0));
        check_table("stress", p, stress, 6);
        check_table("stretch", b, stretch, 6);
    }
}

#[test]
fn simple_shear_of_the_corotated_laws() {
    let f = Matrix3::identity() + Matrix3::new(0.0, 0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let p = Corotated::from_young_poisson(YOUNG, 0.45).unwrap().first_piola_kirchhoff(&f);
    check_table("P12", p[(0, 1)], 10001.2, 6);
    check_table("P21", p[(1, 0)], 4067.78, 6);
    check_table("P11", p[(0, 0)], 9889.01, 6);
    let p = FixedCorotated::from_young_poisson(YOUNG, 0.45).unwrap().first_piola_kirchhoff(&f);
    check_table("P12", p[(0, 1)], 7331.15, 6);
    check_table("P21", p[(1, 0)], 6737.81, 6);
    check_table("P11", p[(0, 0)], 988.901, 6);
    // A shear of the wrong sign: a property of the law near incompressibility.
    let p = Corotated::from_young_poisson(YOUNG, 0.49).unwrap().first_piola_kirchhoff(&f);
    check_table("P21", p[(1, 0)], -7589.66, 6);
}
