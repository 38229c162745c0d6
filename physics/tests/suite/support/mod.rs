//! Meshes and checks that several tests share.
#![allow(dead_code)] // each test binary uses its own part

pub mod allocations;
pub mod halvings;
pub mod multigrid;
pub mod rods;

use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{MeshChange, SimplexMesh, VertexId};
use stylet_physics::body::Body;
use stylet_physics::material::Hyperelastic;
use stylet_physics::statics::{StaticMethod, StaticReport, StaticSettings, StaticWorkspace, solve_static};
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// Young's modulus of soft tissue, Pa.
pub const YOUNG: f64 = 34e3;

/// A reproducible number in `[-1, 1)`, by a linear congruential step.
pub fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A random vector of this length.
pub fn random_vector(len: usize, size: f64, seed: u64) -> Vec<f64> {
    let mut state = seed;
    (0..len).map(|_| size * random(&mut state)).collect()
}

/// The unit box in `n` parts along each axis, its points moved by `map`.
pub fn mapped_box<const D: usize, const N: usize>(
    cells: [usize; D],
    map: impl FnMut(&[f64; D]) -> [f64; D],
) -> SimplexMesh<D, N> {
    let mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], cells).unwrap();
    let points = mesh.points().iter().map(map).collect();
    let simplices = mesh.cells().map(|c| mesh.cell(c).map(|v| v.0)).collect();
    SimplexMesh::new(points, simplices).unwrap()
}

/// A box of side `side` whose interior vertices are moved at random by up to a fifth of a part.
pub fn distorted_box<const D: usize, const N: usize>(n: usize, side: f64, seed: u64) -> SimplexMesh<D, N> {
    let mut state = seed;
    mapped_box([n; D], |x| {
        let interior = x.iter().all(|&t| t > 1e-9 && t < 1.0 - 1e-9);
        x.map(|t| side * (t + if interior { 0.2 / n as f64 * random(&mut state) } else { 0.0 }))
    })
}

/// The slab of Nienhuys (2003), 0.1 m square, legs `0.1 2^-start`, along the needle `0.1 2^-reference`.
pub fn slab(start: i32, reference: i32) -> SimplexMesh<2, 3> {
    let leg = |k: i32| 0.1 * 0.5f64.powi(k) * 2f64.sqrt();
    let mut mesh = kuhn_box::<2, 3>([0.0; 2], [0.1; 2], [1, 1]).unwrap();
    let mut change = MeshChange::default();
    mesh.refine_everywhere(leg(start), &mut change).unwrap();
    if reference > start {
        mesh.refine_along([0.0, 0.05], [0.07, 0.05], leg(reference), &mut change).unwrap();
    }
    mesh
}

/// All vertices that satisfy a condition, constrained alike.
pub fn constrain<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    subspace: &mut Subspace<D>,
    constraint: Constraint<D>,
    on: impl Fn(&[f64; D]) -> bool,
) {
    for (v, x) in mesh.points().iter().enumerate() {
        if on(x) {
            subspace.set(v, constraint).unwrap();
        }
    }
}

/// A subspace in which the vertices that satisfy a condition are fixed.
pub fn clamped<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    on: impl Fn(&[f64; D]) -> bool,
) -> Subspace<D> {
    let mut subspace = Subspace::new(mesh.n_vertex_slots());
    constrain(mesh, &mut subspace, Constraint::Fixed, on);
    subspace
}

/// Residual `tolerance` relative to external and reaction forces.
pub fn stop(tolerance: f64) -> StopRule {
    StopRule { tolerance, criterion: Criterion::Reaction, round_floor: 0.0 }
}

/// Equilibrium by the method that suits the material.
pub fn solve<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &mut Body<D, N, M>,
    subspace: &Subspace<D>,
    load: &[f64],
    u: &mut [f64],
    tolerance: f64,
) -> StaticReport {
    let method = if M::IS_LINEAR { StaticMethod::Cg } else { StaticMethod::NewtonCg };
    let settings = StaticSettings::new(method, stop(tolerance));
    solve_static(body, subspace, load, u, &settings, &mut StaticWorkspace::default()).unwrap()
}

/// The displacement of vertex `v`.
pub fn at<const D: usize>(u: &[f64], v: VertexId) -> [f64; D] {
    std::array::from_fn(|k| u[v.index() * D + k])
}

/// P1 interpolation of a field at a point of the mesh.
pub fn probe<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, u: &[f64], p: [f64; D]) -> [f64; D] {
    let location = mesh.locate(p).expect("a point of the mesh");
    let mut value = [0.0; D];
    for (v, weight) in mesh.cell(location.cell).iter().zip(location.barycentric) {
        for k in 0..D {
            value[k] += weight * u[v.index() * D + k];
        }
    }
    value
}
