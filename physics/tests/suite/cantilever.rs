//! Cantilevers of tetrahedra under a shear at their free end: validation sheet D1 (small displacements, clamping effect) and
//! D5 (finite rotation, where linear elasticity fails).

use crate::support::halvings::Halvings;
use crate::support::multigrid::equilibrium;
use crate::support::{YOUNG, clamped, constrain, mapped_box, probe};
use stylet_mesh::SimplexMesh;
use stylet_physics::body::boundary_traction;
use stylet_physics::material::{Corotated, Hyperelastic, Linear, NeoHookean, StVenantKirchhoff};
use stylet_solver::subspace::{Constraint, Subspace};

const LENGTH: f64 = 0.1;

/// A bar clamped at `x = 0`, with a force of 1 N in direction z on its end face. Its nodes with `on_plane` do not leave the
/// plane of bending.
struct Bar {
    mesh: SimplexMesh<3, 4>,
    held: Subspace<3>,
    load: Vec<f64>,
    /// The middle of the end face, where `y = 0`.
    tip: [f64; 3],
}

impl Bar {
    fn new(sides: [f64; 2], cells: [usize; 3], on_plane: impl Fn(&[f64; 3]) -> bool) -> Self {
        let mesh: SimplexMesh<3, 4> = mapped_box(cells, |[x, y, z]| [LENGTH * x, sides[0] * y, sides[1] * z]);
        let mut load = vec![0.0; 3 * mesh.n_vertex_slots()];
        let (end, area) = (|x: &[f64; 3]| x[0] > LENGTH - 1e-9, sides[0] * sides[1]);
        let found = boundary_traction(&mesh, 1.0, end, &[0.0, 0.0, 1.0 / area], &mut load).unwrap();
        assert!((found - area).abs() < 1e-12 * area);
        let clamp = |x: &[f64; 3]| x[0] < 1e-9;
        let mut held = clamped(&mesh, clamp);
        constrain(&mesh, &mut held, Constraint::Plane([0.0, 1.0, 0.0]), |x| on_plane(x) && !clamp(x));
        Self { mesh, held, load, tip: [LENGTH, 0.0, 0.5 * sides[1]] }
    }

    /// The displacement under a force (N), from `start` on.
    fn bend<M: Hyperelastic<3>>(&self, material: M, force: f64, start: Vec<f64>) -> Vec<f64> {
        let load: Vec<f64> = self.load.iter().map(|f| force * f).collect();
        equilibrium(&self.mesh, material, &self.held, &load, start, 1)
    }

    fn rest(&self) -> Vec<f64> {
        vec![0.0; self.load.len()]
    }

    /// Displacement of the tip, x and z, m.
    fn at_tip(&self, u: &[f64]) -> [f64; 2] {
        let [x, _, z] = probe(&self.mesh, u, self.tip);
        [x, z]
    }
}

/// D1: section 10 x 10 mm, one half of it, 1 mN at the tip. The table is of three-dimensional elasticity with a fully clamped
/// end.
#[track_caller]
fn d1(nu: f64, cells: [usize; 3], table: f64) {
    let material = Linear::from_young_poisson(YOUNG, nu).unwrap();
    let found = Halvings::new(|n| {
        let bar = Bar::new([0.005, 0.01], cells.map(|cells| cells * n), |x| x[1] == 0.0);
        let u = bar.bend(material, 0.5e-3, bar.rest());
        vec![bar.at_tip(&u)[1]]
    });
    let name = format!("D1, nu {nu}, m");
    found.assert_falls(&name, &[table]);
    found.assert_limit::<1>(&name, &[table], 0.01);
}

#[test]
fn d1_without_lateral_contraction() {
    d1(0.0, [32, 2, 4], 11.835e-3);
}

#[test]
fn d1_soft_solid() {
    d1(0.3, [32, 2, 4], 11.77e-3);
}

#[test]
fn d1_nearly_incompressible() {
    d1(0.45, [32, 3, 6], 11.66e-3);
}

const THICKNESS: f64 = 0.005;

/// The bar of D5 and the force of `a = P L^2 / EI = 1` on it. At Poisson's ratio 0 a bar of any width stays plane: one
/// part of the mesh across it does, between two planes that keep so thin a bar from buckling sideways.
fn thin_bar(n: usize) -> (Bar, f64) {
    let width = THICKNESS / n as f64;
    let bending = YOUNG * width * THICKNESS.powi(3) / 12.0;
    (Bar::new([width, THICKNESS], [20 * n, 1, n], |_| true), bending / LENGTH.powi(2))
}

/// Displacements of the tip at `a` = 1 and 2, as shares of the length, on meshes of 2, 4 and 8 parts across the thickness.
/// The coarsest bar is loaded in small steps, each finer one starts where the one before ended.
fn d5_tips<M: Hyperelastic<3>>(material: &M) -> [Halvings; 2] {
    let mut coarser: Option<(Bar, [Vec<f64>; 2])> = None;
    let mut levels = Vec::new();
    for n in [2, 4, 8] {
        let (bar, unit) = thin_bar(n);
        let bent = match &coarser {
            None => {
                let mut u = bar.rest();
                [0.0, 1.0].map(|from| {
                    for part in 1..=8 {
                        u = bar.bend(material.clone(), (from + f64::from(part) / 8.0) * unit, u.clone());
                    }
                    u.clone()
                })
            }
            Some((coarse, bent)) => [0, 1].map(|k| {
                // The coarse bar is wider: what is the same across the width is read at its side.
                let carried = |x: &[f64; 3]| probe(&coarse.mesh, &bent[k], [x[0], 0.0, x[2]]);
                let start = bar.mesh.points().iter().flat_map(carried).collect();
                bar.bend(material.clone(), (k + 1) as f64 * unit, start)
            }),
        };
        levels.push([0, 1].map(|k| bar.at_tip(&bent[k]).map(|u| u / LENGTH).to_vec()));
        coarser = Some((bar, bent));
    }
    [0, 1].map(|k| Halvings::new(|n| levels[n.ilog2() as usize][k].clone()))
}

#[track_caller]
fn d5<M: Hyperelastic<3>>(name: &str, material: M, table: [[f64; 2]; 2]) {
    for (k, found) in d5_tips(&material).into_iter().enumerate() {
        let name = format!("D5, {name}, a = {}", k + 1);
        found.assert_falls(&name, &table[k]);
        found.assert_limit::<2>(&name, &table[k], 0.01);
    }
}

#[test]
fn d5_neo_hookean() {
    d5("NH", NeoHookean::from_young_poisson(YOUNG, 0.0).unwrap(), [[-0.0565, 0.3022], [-0.1609, 0.4944]]);
}

#[test]
fn d5_st_venant_kirchhoff() {
    d5("StVK", StVenantKirchhoff::from_young_poisson(YOUNG, 0.0).unwrap(), [[-0.0566, 0.3023], [-0.1613, 0.4946]]);
}

/// At strains of a few percent the corotated law bends like the others.
#[test]
fn d5_corotated() {
    d5("corotated", Corotated::from_young_poisson(YOUNG, 0.0).unwrap(), [[-0.0565, 0.3022], [-0.1609, 0.4944]]);
}

/// Linear elasticity knows no rotation: `w = a L / 3` and no shortening.
#[test]
fn d5_linear_elasticity_fails() {
    let material = Linear::from_young_poisson(YOUNG, 0.0).unwrap();
    for (found, (a, finite)) in d5_tips(&material).into_iter().zip([(1.0, 0.3022), (2.0, 0.4944)]) {
        let [x, w] = [found.limit[0], found.limit[1]];
        println!("D5, linear, a = {a}: ({x:e}, {w}), finite rotation {finite}");
        assert!((w / (a / 3.0) - 1.0).abs() < 0.01 && x.abs() < 1e-3, "({x}, {w})");
        assert!(w > 1.08 * finite);
    }
}
