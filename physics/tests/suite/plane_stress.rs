//! Plane stress of every law: derivatives, the solid at the thickness that is found, inverted and drawn out sheets, a body.

use crate::material_derivatives::{
    Stretch, analytic_projection, closed_stiffness, direction, gradient, groups, objective, plane_laws,
    shape_gradients, taylor,
};
use crate::material_inversion::{SURVIVORS, derivatives, matrix};
use crate::support::{clamped, mapped_box, probe, solve};
use nalgebra::{Matrix2, Rotation2};
use proptest::prelude::*;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{Body, boundary_traction};
use stylet_physics::material::{Hyperelastic, NeoHookean, Plane, PlaneStress, Solid};

const YOUNG: f64 = 34e3;

/// A sheet thinner than this may lose its thickness within the reach of a difference quotient: there the stress has a kink.
const THIN: f64 = 0.02;

fn sheet(model: &str, nu: f64) -> PlaneStress<Solid> {
    PlaneStress::new(Solid::from_young_poisson(model, YOUNG, nu).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn derivatives_of_sheets(which in 0..Solid::MODELS.len(), nu in 0.0..0.49, f in gradient::<2>(0.35),
                             df in direction::<2>(), g in gradient::<2>(2.0), angle in -3.2..3.2f64) {
        let (model, law) = (Solid::MODELS[which], sheet(Solid::MODELS[which], nu));
        prop_assume!(law.thickness_stretch(&f) > THIN);
        taylor(&law, model, &f, &df)?;
        closed_stiffness(&law, model, &f, &shape_gradients::<2, 3>(&g))?;
        analytic_projection(&law, model, &f, &df)?;
        if model != "linear" {
            objective(&law, model, &f, &Rotation2::new(angle).into_inner())?;
        }
    }

    /// Inverted triangles too, with whatever thickness is left.
    #[test]
    fn derivatives_of_inverted_sheets(which in 0..SURVIVORS.len(),
                                      nu in prop::sample::select(vec![0.0, 0.3, 0.45, 0.495]),
                                      f in matrix::<2>(1.5), df in matrix::<2>(1.0)) {
        let (model, law) = (SURVIVORS[which], sheet(SURVIVORS[which], nu));
        let q = law.thickness_stretch(&f);
        prop_assume!(q.abs() > THIN || (q == 0.0 && law.thickness_stretch(&(f * 1.02)) == 0.0
                                        && law.thickness_stretch(&(f * 0.98)) == 0.0));
        prop_assume!((q - 0.25).abs() > THIN && (q - 0.65).abs() > THIN);
        // Nearly incompressible sheets close from most of their thickness to none within a thousandth of stretch: there a
        // difference quotient of that reach says nothing.
        let way = df / df.norm() * 4e-3;
        prop_assume!((law.thickness_stretch(&(f + way)) - law.thickness_stretch(&(f - way))).abs() < 0.08);
        derivatives(&law, model, nu, &f, &df)?;
    }

    #[test]
    fn groups_of_sheets(nu in 0.0..0.49, f in prop::array::uniform4(gradient::<2>(0.8)), g in gradient::<2>(2.0)) {
        for model in Solid::MODELS {
            groups(&sheet(model, nu), model, &f, &shape_gradients::<2, 3>(&g))?;
        }
    }

    /// The solid at the thickness that is found is free of stress across the plane, and has the energy of the sheet.
    #[test]
    fn sheets_are_the_solid(nu in 0.0..0.4999, f in gradient::<2>(0.35)) {
        for model in Solid::MODELS {
            let solid = Solid::from_young_poisson(model, YOUNG, nu).unwrap();
            let stretch: Stretch<PlaneStress<Solid>> = |sheet, f| sheet.thickness_stretch(f);
            if sheet(model, nu).thickness_stretch(&f) > THIN {
                plane_laws(&solid, &f, |m| (PlaneStress::new(*m), stretch))?;
            }
        }
    }

    /// The thickness is the best one: no other has less energy, in inverted triangles neither.
    #[test]
    fn a_sheet_takes_the_thickness_of_least_energy(which in 0..SURVIVORS.len(), nu in 0.0..0.49,
                                                   a in 0.1..2.0f64, b in 0.1..2.0f64, other in 0.0..3.0f64) {
        let (model, solid) = (SURVIVORS[which], Solid::from_young_poisson(SURVIVORS[which], YOUNG, nu).unwrap());
        let f = Matrix2::new(a, 0.0, 0.0, b);
        let (law, full) = (PlaneStress::new(solid), nalgebra::Matrix3::new(a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, other));
        prop_assert!(law.energy_density(&f) <= solid.energy_density(&full) * (1.0 + 1e-12) + 1e-12 * YOUNG, "{model}");
    }
}

/// A triangle pushed through itself is pushed back, without a jump on the way. (Where it is as deep on the other side as it
/// is wide, either axis may be the inverted one, and the stress jumps as that of the solids does.)
#[test]
fn inverted_sheets_are_pushed_back() {
    for model in SURVIVORS {
        for nu in [0.0, 0.3, 0.45, 0.495] {
            let law = sheet(model, nu);
            let across = |s: f64| law.first_piola_kirchhoff(&Matrix2::new(1.0, 0.0, 0.0, s))[(1, 1)];
            let energy = |s: f64| law.energy_density(&Matrix2::new(1.0, 0.0, 0.0, s));
            for k in 1..=120 {
                let s = 0.3 - 0.01 * f64::from(k);
                assert!(across(s) <= 0.0 && across(s).is_finite(), "{model}, nu {nu}: {} Pa at {s}", across(s));
                assert!(energy(s) >= energy(s + 0.01), "{model}, nu {nu}: downhill into the inversion at {s}");
                let jump = (across(s + 1e-9) - across(s - 1e-9)).abs();
                assert!(jump < 1e-4 * YOUNG / (1.0 - 2.0 * nu), "{model}, nu {nu}: a jump of {jump} Pa at {s}");
            }
        }
    }
}

/// Through the general solution and through the closed form a membrane ends in one place.
#[test]
fn a_membrane_by_the_general_solution() {
    let neo = NeoHookean::from_young_poisson(34.0, 0.45).unwrap();
    let (closed, general) = (membrane(PlaneStress::new(neo)), membrane(sheet_of_rubber("invertible-neo-hookean")));
    for k in 0..2 {
        assert!((closed[k] - general[k]).abs() < 1e-8 * 48.0, "{closed:?} against {general:?}");
    }
    // Cook's panel has no more than half of these strains in the other laws: they differ, by less than their strains.
    for model in ["corotated", "fixed-corotated", "stable-neo-hookean", "invertible-st-venant-kirchhoff"] {
        let found = membrane(sheet_of_rubber(model));
        assert!((found[1] / closed[1] - 1.0).abs() < 0.25, "{model}: {found:?} against {closed:?}");
    }
}

fn sheet_of_rubber(model: &str) -> PlaneStress<Solid> {
    PlaneStress::new(Solid::from_young_poisson(model, 34.0, 0.45).unwrap())
}

/// Displacement of the middle of the loaded edge of Cook's membrane.
fn membrane<M: Hyperelastic<2>>(law: M) -> [f64; 2] {
    let mesh: SimplexMesh<2, 3> = mapped_box([12, 12], |[s, t]| [48.0 * s, 44.0 * s + t * (44.0 - 28.0 * s)]);
    let mut body = Body::new(&mesh, law, 1.0).unwrap();
    let mut load = vec![0.0; 2 * mesh.n_vertex_slots()];
    boundary_traction(&mesh, 1.0, |x| x[0] > 48.0 - 1e-9, &[0.0, 10.0 / 16.0], &mut load).unwrap();
    let mut u = vec![0.0; load.len()];
    solve(&mut body, &clamped(&mesh, |x| x[0] < 1e-9), &load, &mut u, 1e-11);
    probe(&mesh, &u, [48.0, 52.0])
}

/// A law whose state across the plane is data gives the bits of the one that it is.
#[test]
fn a_choice_across_the_plane_changes_no_bit() {
    let f = Matrix2::new(1.1, 0.3, -0.2, 0.8);
    for model in Solid::MODELS {
        let solid = Solid::from_young_poisson(model, YOUNG, 0.4).unwrap();
        let (strain, stress) = (Plane::Strain(solid), Plane::Stress(PlaneStress::new(solid)));
        let in_strain: Matrix2<f64> = solid.first_piola_kirchhoff(&f);
        assert_eq!(strain.first_piola_kirchhoff(&f), in_strain, "{model}");
        assert_eq!(stress.first_piola_kirchhoff(&f), PlaneStress::new(solid).first_piola_kirchhoff(&f), "{model}");
        assert_ne!(stress.first_piola_kirchhoff(&f), in_strain, "{model}");
        let refuses = Hyperelastic::<2>::requires_positive_j(&solid);
        assert_eq!([strain.requires_positive_j(), stress.requires_positive_j()], [refuses; 2], "{model}");
    }
}
