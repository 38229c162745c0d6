//! What the path of a bevelled tip depends on, and what it does not: a beam in an elastic bed whose tip cuts at an angle psi to
//! itself has the curvature `(k / 4 EI)^(1/4) tan psi`, where the stiffness `k` of the bed is in proportion to Young's modulus.

use stylet_mesh::SimplexMesh;
use stylet_mesh::generate::mirrored_kuhn_box;
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::coupling::CoupledSettings;
use stylet_physics::insertion::{BaseMotion, Insertion, NeedleSettings, UniformInteraction};
use stylet_physics::material::{FixedCorotated, Lame, Viscosity};
use stylet_physics::rod::RodStiffness;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// Box of gel, m; the needle bends along its second axis.
const BOX: [f64; 3] = [0.1, 0.1, 0.06];
/// m/s and m.
const SPEED: f64 = 0.02;
const DEPTH: f64 = 0.08;
/// Where the needle starts: its sleeve before the skin, and its axis off the edges of the mesh.
const START: [f64; 3] = [-0.045, 0.05031, 0.02977];

#[derive(Clone, Copy)]
struct Push {
    young: f64,
    bending: f64,
    /// Degrees.
    bevel: f64,
    dt: f64,
    /// Cells across the short side.
    cells: usize,
    /// Whether the needle goes along the axis of the box, which an even number of cells is symmetric about.
    centred: bool,
    friction: f64,
    cutting: f64,
}

const STANDARD: Push = Push {
    young: 15e3,
    bending: 1.4e-3,
    bevel: 5.0,
    dt: 0.04,
    cells: 9,
    centred: false,
    friction: 12.0,
    cutting: 0.05,
};

impl Push {
    fn start(&self) -> [f64; 3] {
        if self.centred { [START[0], 0.5 * BOX[1], 0.5 * BOX[2]] } else { START }
    }

    fn block(&self) -> Insertion<FixedCorotated> {
        let n = BOX.map(|side| (side / BOX[2] * self.cells as f64).round() as usize);
        let mesh: SimplexMesh<3, 4> = mirrored_kuhn_box([0.0; 3], BOX, n).unwrap();
        let gel = FixedCorotated::from_young_poisson(self.young, 0.45).unwrap();
        let mut body = Body::new(&mesh, gel, 1.0).unwrap();
        body.set_mass(MassKind::Lumped, &Density::Uniform(1030.0)).unwrap();
        let lame = Lame::from_young_poisson(self.young, 0.45).unwrap();
        body.set_viscosity(0, Viscosity::kelvin_voigt(lame, 0.01).unwrap()).unwrap();
        let mut held = Subspace::new(mesh.n_vertex_slots());
        for (node, x) in mesh.points().iter().enumerate() {
            if x[0] > BOX[0] - 1e-9 || (1..3).any(|k| x[k] < 1e-9 || x[k] > BOX[k] - 1e-9) {
                held.set(node, Constraint::Fixed).unwrap();
            }
        }
        let settings = CoupledSettings::new(self.dt, 0.3 * BOX[2] / self.cells as f64);
        let forces = UniformInteraction { friction: self.friction, viscosity: 0.0, cutting: self.cutting };
        let mut block = Insertion::new(mesh, body, held, settings, forces, [0.0; 3], &Team::serial()).unwrap();
        let wire = NeedleSettings::nitinol(self.start(), [1.0, 0.0, 0.0]).unwrap();
        let twisting = wire.stiffness.twisting * self.bending / wire.stiffness.bending;
        let needle = NeedleSettings {
            stiffness: RodStiffness { bending: self.bending, twisting, ..wire.stiffness },
            length: 0.043,
            bevel: self.bevel.to_radians(),
            bevel_direction: [0.0, 1.0, 0.0],
            ..wire
        };
        block.add_needle(needle).unwrap();
        block
    }

    /// Where the tip went in the undeformed body, from the axis of the sleeve.
    fn path(&self) -> Vec<[f64; 3]> {
        let mut block = self.block();
        let mut path = Vec::new();
        let start = self.start();
        for _ in 0..(DEPTH / SPEED / self.dt).round() as usize {
            block.step(&[BaseMotion { insert: SPEED, ..BaseMotion::default() }], self.dt).unwrap();
            if let Some(tip) = block.needles()[0].nodes().last() {
                let x = block.mesh().points()[tip.vertex as usize];
                path.push([x[0], x[1] - start[1], x[2] - start[2]]);
            }
        }
        path
    }

    /// Curvature of the second half of the path, 1/m: of the parabola through its points by least squares, at their middle.
    fn curvature(&self) -> f64 {
        let path = self.path();
        let end = path.last().unwrap()[0];
        assert!(end > 0.06, "the tip is at {end} m");
        let late: Vec<&[f64; 3]> = path.iter().filter(|p| p[0] > 0.5 * end).collect();
        let rows = nalgebra::DMatrix::from_fn(late.len(), 3, |i, k| (late[i][0] - 0.75 * end).powi(k as i32));
        let y = nalgebra::DVector::from_fn(late.len(), |i, _| late[i][1]);
        let fit = rows.svd(true, true).solve(&y, 1e-14).unwrap();
        2.0 * fit[2] / (1.0 + fit[1] * fit[1]).powf(1.5)
    }
}

/// The part of the curvature that the bevel makes: the mesh bends the path by the same, whichever way the bevel looks.
fn steered(push: Push) -> f64 {
    0.5 * (push.curvature() - Push { bevel: -push.bevel, ..push }.curvature())
}

fn exponent(low: Push, high: Push, ratio: f64) -> f64 {
    let (low, high) = (steered(low), steered(high));
    let exponent = (high / low).ln() / ratio.ln();
    println!("{low:.3} and {high:.3} 1/m: {exponent:.3}");
    exponent
}

#[test]
fn curvature_grows_as_the_slope_of_the_bevel() {
    let bevel = |degrees| Push { bevel: degrees, ..STANDARD };
    let ratio = 10.0_f64.to_radians().tan() / 2.5_f64.to_radians().tan();
    let found = exponent(bevel(2.5), bevel(10.0), ratio);
    assert!((found - 1.0).abs() < 0.05, "{found}");
}

#[test]
fn curvature_grows_as_the_fourth_root_of_the_modulus() {
    let young = |factor| Push { young: factor * STANDARD.young, ..STANDARD };
    let found = exponent(young(0.25), young(4.0), 16.0);
    assert!((found - 0.25).abs() < 0.05, "{found}");
}

#[test]
fn curvature_falls_as_the_fourth_root_of_the_bending_stiffness() {
    let bending = |factor| Push { bending: factor * STANDARD.bending, ..STANDARD };
    let found = exponent(bending(0.25), bending(4.0), 16.0);
    assert!((found + 0.25).abs() < 0.05, "{found}");
}

/// Nor on the force at the tip, which strains the cells there the more the smaller they are.
#[test]
fn curvature_does_not_depend_on_step_mesh_or_cutting_force() {
    let standard = steered(STANDARD);
    for other in [
        Push { dt: 0.016, ..STANDARD },
        Push { cells: 6, ..STANDARD },
        Push { cutting: 0.0, ..STANDARD },
        Push { cutting: 0.2, ..STANDARD },
    ] {
        let found = steered(other);
        println!("{found:.3} of {standard:.3} 1/m");
        assert!((found / standard - 1.0).abs() < 0.1, "{found} of {standard}");
    }
}

/// What pushes a symmetric tip aside is the force on a node among cells that are not symmetric, of which it is relieved: less than
/// a thousandth of the depth in gel, and nothing where there is no force, or where the cells are symmetric.
#[test]
fn a_symmetric_tip_goes_straight() {
    let none = Push { bevel: 0.0, friction: 0.0, cutting: 0.0, ..STANDARD };
    let symmetric = Push { bevel: 0.0, cutting: 0.2, cells: 6, centred: true, ..STANDARD };
    let off = Push { bevel: 0.0, dt: 0.02, ..STANDARD };
    let cutting = Push { cutting: 0.2, ..off };
    for (push, most) in [(none, 1e-4), (symmetric, 1e-4), (off, 1e-3), (cutting, 1e-3)] {
        let end = *push.path().last().unwrap();
        let drift = end[1].hypot(end[2]) / end[0];
        println!("{:.4} %", 100.0 * drift);
        assert!(drift < most, "{end:?}");
    }
}
