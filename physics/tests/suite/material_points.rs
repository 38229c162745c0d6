//! Material points: stretches and shears of one element, whose free sides are found by Newton's method in the test.
//!
//! Each value is compared twice: with the equation solved here (1e-10) and with a table computed independently (half of
//! its last digit); and with the law of plane stress, which has to find the free side by itself.

use nalgebra::{Matrix3, Vector3};
use stylet_physics::material::{Hyperelastic, Lame, PlaneStress, Solid};

const YOUNG: f64 = 34e3;

/// A stretched element: the stretch that is given, and that of the free sides.
type Stretched = fn(f64, f64) -> Matrix3<f64>;

const UNIAXIAL: Stretched = |s, b| Matrix3::from_diagonal(&Vector3::new(s, b, b));

const EQUIBIAXIAL: Stretched = |s, b| Matrix3::from_diagonal(&Vector3::new(s, s, b));

/// Poisson's ratio, stretch, nominal stress (Pa) and stretch of the free sides.
type Row = [f64; 4];

fn solid(model: &str, nu: f64) -> Solid {
    Solid::from_young_poisson(model, YOUNG, nu).unwrap()
}

/// The stretch of the free sides at which the stress component on them vanishes, by Newton's method from 1.
fn free_stretch(law: &Solid, f: impl Fn(f64) -> Matrix3<f64>) -> f64 {
    let mut b = 1.0;
    for _ in 0..100 {
        let df = f(1.0) - f(0.0);
        let stress = law.first_piola_kirchhoff(&f(b))[(2, 2)];
        let slope = law.stress_differential(&f(b), &df)[(2, 2)];
        let step = stress / slope;
        b -= step.clamp(-0.5 * b, 0.5 * b);
        if step.abs() < 1e-15 {
            break;
        }
    }
    let stress = law.first_piola_kirchhoff(&f(b));
    assert!(stress[(2, 2)].abs() < 1e-10 * YOUNG, "the free side carries {} Pa", stress[(2, 2)]);
    b
}

/// The stretch of the free sides and the stress along the stretch; the law of plane stress finds the same.
#[track_caller]
fn stretch(law: &Solid, stretched: Stretched, s: f64) -> (f64, f64) {
    let b = free_stretch(law, |b| stretched(s, b));
    let f = stretched(s, b);
    let p: Matrix3<f64> = law.first_piola_kirchhoff(&f);
    let (thin, in_plane) = (PlaneStress::new(*law), f.fixed_view::<2, 2>(0, 0).into_owned());
    check_exact("thickness", thin.thickness_stretch(&in_plane), b);
    let of_sheet = thin.first_piola_kirchhoff(&in_plane);
    assert!((of_sheet[(0, 0)] - p[(0, 0)]).abs() <= 1e-10 * YOUNG, "sheet {of_sheet}, solid {p}");
    assert!((of_sheet[(1, 1)] - p[(1, 1)]).abs() <= 1e-10 * YOUNG, "sheet {of_sheet}, solid {p}");
    (b, p[(0, 0)])
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

/// Rows of a table of six digits, and the law's own equations at the stretch `b` that is found: `free(lame, b, dj)` is the
/// stress on the free sides, where `dj = (J - 1) J / b`, and `axial(mu, s, b)` what follows for the stress without `lambda`.
#[track_caller]
fn check_rows(
    model: &str,
    stretched: Stretched,
    rows: &[Row],
    free: fn(Lame, f64, f64) -> f64,
    axial: fn(f64, f64, f64) -> f64,
) {
    for &[nu, s, stress, free_side] in rows {
        let law = solid(model, nu);
        let (b, p) = stretch(&law, stretched, s);
        let j = stretched(s, b).determinant();
        assert!(free(law.lame(), b, (j - 1.0) * j / b).abs() < 1e-10 * YOUNG, "{model}: the free side at {s}");
        check_exact("stress", p, axial(law.lame().mu(), s, b));
        check_table("stress", p, stress, 6);
        check_table("stretch", b, free_side, 6);
    }
}

#[test]
fn uniaxial_linear_and_corotated_for_any_poisson_ratio() {
    for model in ["linear", "corotated"] {
        for nu in [0.0, 0.3, 0.34, 0.45, 0.49] {
            for (s, stress, free) in
                [(0.7, -10200.0, 1.0 + 0.3 * nu), (1.2, 6800.0, 1.0 - 0.2 * nu), (1.5, 17000.0, 1.0 - 0.5 * nu)]
            {
                let (b, p) = stretch(&solid(model, nu), UNIAXIAL, s);
                check_exact("stretch", b, free);
                check_exact("stress", p, stress);
            }
        }
    }
}

#[test]
fn uniaxial_st_venant_kirchhoff_for_any_poisson_ratio() {
    for nu in [0.0, 0.3, 0.34, 0.45, 0.49] {
        for (s, stress, shrink) in [(0.7, -6069.0, -0.51), (1.2, 8976.0, 0.44), (1.5, 31875.0, 1.25)] {
            let (b, p) = stretch(&solid("st-venant-kirchhoff", nu), UNIAXIAL, s);
            check_exact("stretch", b, (1.0f64 - shrink * nu).sqrt());
            check_exact("stress", p, stress);
        }
    }
}

/// Free sides: `mu (b - 1/b) + lambda (J - 1) dJ/db = 0`.
#[test]
fn stretches_of_the_neo_hookean_law() {
    let free = |lame: Lame, b: f64, dj: f64| lame.mu() * (b - 1.0 / b) + lame.lambda() * dj;
    let axial = |mu: f64, s: f64, b: f64| mu * (s - 1.0 / s) - mu * (b * b - 1.0) / s;
    let uniaxial = [
        [0.34, 0.7, -13622.8, 1.11430],
        [0.34, 1.2, 5936.03, 0.937295],
        [0.34, 1.5, 12770.2, 0.860296],
        [0.45, 0.7, -14699.0, 1.16945],
        [0.45, 1.2, 5791.28, 0.920459],
        [0.45, 1.5, 12201.2, 0.830037],
        [0.49, 0.7, -15098.4, 1.19010],
        [0.49, 1.2, 5741.67, 0.914391],
        [0.49, 1.5, 12009.4, 0.819214],
    ];
    let equibiaxial = [
        [0.34, 0.7, -18470.9, 1.22848],
        [0.34, 1.2, 8494.34, 0.797832],
        [0.34, 1.5, 16388.5, 0.558836],
        [0.45, 0.7, -34332.1, 1.59368],
        [0.45, 1.2, 8878.15, 0.728900],
        [0.45, 1.5, 15787.8, 0.479673],
        [0.49, 0.7, -52205.3, 1.92170],
        [0.49, 1.2, 9011.54, 0.701568],
        [0.49, 1.5, 15563.2, 0.451552],
    ];
    // The continued law is the law itself at these stretches.
    for model in ["neo-hookean", "invertible-neo-hookean"] {
        check_rows(model, UNIAXIAL, &uniaxial, free, axial);
        check_rows(model, EQUIBIAXIAL, &equibiaxial, free, axial);
    }
}

/// Free sides: `2 mu (b - 1) + lambda (J - 1) dJ/db = 0`.
#[test]
fn stretches_of_the_fixed_corotated_law() {
    let free = |lame: Lame, b: f64, dj: f64| 2.0 * lame.mu() * (b - 1.0) + lame.lambda() * dj;
    let axial = |mu: f64, s: f64, b: f64| 2.0 * mu * (s - 1.0) - 2.0 * mu * (b - 1.0) * b / s;
    let uniaxial = [
        [0.34, 0.7, -12109.5, 1.11162],
        [0.34, 1.2, 6327.67, 0.936736],
        [0.34, 1.5, 14748.9, 0.857883],
        [0.45, 0.7, -13592.7, 1.16767],
        [0.45, 1.2, 6124.95, 0.920174],
        [0.45, 1.5, 13941.3, 0.828888],
        [0.49, 0.7, -14200.8, 1.18966],
        [0.49, 1.2, 6053.35, 0.914325],
        [0.49, 1.5, 13665.0, 0.818949],
    ];
    let equibiaxial = [[0.45, 0.7, -34928.1, 1.54053], [0.45, 1.2, 8594.08, 0.724020], [0.45, 1.5, 15616.0, 0.467806]];
    check_rows("fixed-corotated", UNIAXIAL, &uniaxial, free, axial);
    check_rows("fixed-corotated", EQUIBIAXIAL, &equibiaxial, free, axial);
}

/// A law without a table: its own equations, `a = m (1 - 1/(I + 1))` and `u = l (J - 1) - 3 m/4`.
#[test]
fn stretches_of_the_stable_neo_hookean_law() {
    for nu in [0.0, 0.34, 0.45, 0.49] {
        for (stretched, sides) in [(UNIAXIAL, 2.0), (EQUIBIAXIAL, 1.0)] {
            for s in [0.7, 1.2, 1.5] {
                let law = solid("stable-neo-hookean", nu);
                let (m, l) = (4.0 / 3.0 * law.lame().mu(), law.lame().lambda() + 5.0 / 6.0 * law.lame().mu());
                let (b, p) = stretch(&law, stretched, s);
                let (j, i) = (stretched(s, b).determinant(), (3.0 - sides) * s * s + sides * b * b);
                let (a, u) = (m * (1.0 - 1.0 / (i + 1.0)), l * (j - 1.0) - 0.75 * m);
                assert!((a * b + u * j / b).abs() < 1e-10 * YOUNG, "the free side at {s}");
                assert!((p - a * s * (1.0 - b * b / (s * s))).abs() < 1e-10 * YOUNG, "{p} Pa at {s}");
            }
        }
    }
}

#[test]
fn equibiaxial_linear_corotated_and_st_venant_kirchhoff() {
    for model in ["linear", "corotated"] {
        for (s, stress, free) in [(0.7, -18545.5, 1.49091), (1.2, 12363.6, 0.672727), (1.5, 30909.1, 0.181818)] {
            let (b, p) = stretch(&solid(model, 0.45), EQUIBIAXIAL, s);
            check_exact("stress", p, YOUNG * (s - 1.0) / 0.55);
            check_exact("stretch", b, 1.0 - 2.0 * 0.45 / 0.55 * (s - 1.0));
            check_table("stress", p, stress, 6);
            check_table("stretch", b, free, 6);
        }
    }
    for (s, stress, free) in [(0.7, -11034.5, 1.35445), (1.2, 16320.0, 0.529150)] {
        let (b, p) = stretch(&solid("st-venant-kirchhoff", 0.45), EQUIBIAXIAL, s);
        let green = 0.5 * (s * s - 1.0);
        check_exact("stress", p, s * YOUNG * green / 0.55);
        check_exact("stretch", b, (1.0 - 2.0 * 2.0 * 0.45 / 0.55 * green).sqrt());
        check_table("stress", p, stress, 6);
        check_table("stretch", b, free, 6);
    }
}

/// The stretch at which an equibiaxial St. Venant-Kirchhoff sheet would lose its thickness has no solution beyond it.
#[test]
fn equibiaxial_st_venant_kirchhoff_runs_out_of_thickness() {
    let law = solid("st-venant-kirchhoff", 0.45);
    // P33 stays positive however thin the sheet becomes.
    for b in [1.0, 0.5, 0.1, 1e-3, 1e-6] {
        assert!(law.first_piola_kirchhoff(&EQUIBIAXIAL(1.5, b))[(2, 2)] > 0.0);
    }
    let (sheet, drawn) = (PlaneStress::new(law), EQUIBIAXIAL(1.5, 1.0).fixed_view::<2, 2>(0, 0).into_owned());
    assert!(sheet.thickness_stretch(&drawn).is_nan() && sheet.energy_density(&drawn) == f64::INFINITY);
    let continued = PlaneStress::new(solid("invertible-st-venant-kirchhoff", 0.45));
    assert!(continued.thickness_stretch(&drawn) == 0.0 && continued.energy_density(&drawn).is_finite());
}

#[test]
fn simple_shear() {
    let f = Matrix3::identity() + Matrix3::new(0.0, 0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for nu in [0.0, 0.34, 0.45, 0.49] {
        let law = solid("neo-hookean", nu);
        let (mu, p) = (law.lame().mu(), law.first_piola_kirchhoff(&f));
        check_exact("P12", p[(0, 1)], 0.6 * mu);
        check_exact("P21", p[(1, 0)], 0.6 * mu);
        assert!(p[(0, 0)].abs() < 1e-10 * mu && p[(1, 1)].abs() < 1e-10 * mu);
        // Cauchy stress, J = 1.
        check_exact("s11", (p * f.transpose())[(0, 0)], mu * 0.36);
    }
    for (model, table) in [
        ("st-venant-kirchhoff", [20962.8, 7034.48, 23213.8]),
        ("corotated", [10001.2, 4067.78, 9889.01]),
        ("fixed-corotated", [7331.15, 6737.81, 988.901]),
    ] {
        let p = solid(model, 0.45).first_piola_kirchhoff(&f);
        for (name, computed, table) in
            [("P12", p[(0, 1)], table[0]), ("P21", p[(1, 0)], table[1]), ("P11", p[(0, 0)], table[2])]
        {
            check_table(name, computed, table, 6);
        }
    }
    // A shear of the wrong sign: a property of the law near incompressibility.
    let p = solid("corotated", 0.49).first_piola_kirchhoff(&f);
    check_table("P21", p[(1, 0)], -7589.66, 6);
}
