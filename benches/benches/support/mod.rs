//! Meshes, materials and fields that several targets measure on, and how long criterion measures.

// Each target uses its part of this.
#![allow(dead_code)]

use criterion::Criterion;
use std::time::Duration;
use stylet_mesh::SimplexMesh;
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::Body;
use stylet_physics::material::{Linear, NeoHookean, PlaneStress};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::{Constraint, Subspace};

/// Side of the box, m.
pub const SIDE: f64 = 0.1;
/// Young's modulus (Pa), Poisson's ratio and thickness (m) of the slab.
pub const TISSUE: (f64, f64, f64) = (34e3, 0.34, 0.01);

/// Short enough for a sweep over sizes, long enough for a few per cent; the command line has the last word.
pub fn criterion() -> Criterion {
    Criterion::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2))
}

/// A square in `n x n` parts, a cube in `n x n x n`.
pub fn cube<const D: usize, const N: usize>(n: usize) -> SimplexMesh<D, N> {
    kuhn_box([0.0; D], [SIDE; D], [n; D]).expect("a box")
}

/// A cube of linear tissue, one face held.
pub struct Clamped {
    /// Stiffness of all nodes, N/m.
    pub matrix: BlockCsr<3>,
    /// The nodes of the face x = [`SIDE`] are fixed.
    pub subspace: Subspace<3>,
    /// A newton along -x, shared by all other nodes.
    pub load: Vec<f64>,
}

/// `n x n x n` parts.
pub fn clamped_cube(n: usize) -> Clamped {
    let mesh = cube::<3, 4>(n);
    let body = Body::new(&mesh, linear(), 1.0).expect("a body");
    let mut subspace = Subspace::new(mesh.n_vertex_slots());
    let mut load = vec![0.0; 3 * mesh.n_vertex_slots()];
    for (v, x) in mesh.points().iter().enumerate() {
        if x[0] == SIDE {
            subspace.set(v, Constraint::Fixed).expect("a vertex of the mesh");
        } else {
            load[3 * v] = -1.0 / mesh.n_vertices() as f64;
        }
    }
    Clamped { matrix: body.stiffness().clone(), subspace, load }
}

/// A linear tissue.
pub fn linear() -> Linear {
    Linear::from_young_poisson(TISSUE.0, TISSUE.1).expect("a material")
}

/// A linear tissue in plane stress.
pub fn linear_slab() -> PlaneStress<Linear> {
    PlaneStress::new(linear())
}

/// A neo-Hookean tissue in plane stress.
pub fn neo_hookean_slab() -> PlaneStress<NeoHookean> {
    PlaneStress::new(NeoHookean::from_young_poisson(TISSUE.0, TISSUE.1).expect("a material"))
}

/// A smooth displacement that vanishes nowhere but at the origin, with strains of the order of `strain`.
pub fn smooth<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, strain: f64) -> Vec<f64> {
    let place = |x: &[f64; D], k: usize| strain * (x[k] + SIDE * (3.0 * x[(k + 1) % D] / SIDE).sin() / 3.0);
    mesh.points().iter().flat_map(|x| (0..D).map(move |k| place(x, k))).collect()
}

/// `count` points spread evenly over the box by an additive recurrence, the same ones on every run.
///
/// Source: Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018).
pub fn spread<const D: usize>(count: usize) -> Vec<[f64; D]> {
    // The positive root of x^(D + 1) = x + 1 makes the steps as irrational as can be.
    let root = (0..64).fold(2.0f64, |x, _| (1.0 + x).powf(1.0 / (D as f64 + 1.0)));
    let step: [f64; D] = std::array::from_fn(|k| root.powi(-(k as i32) - 1));
    (1..=count).map(|i| step.map(|s| SIDE * (0.5 + s * i as f64).fract())).collect()
}
