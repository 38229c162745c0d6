//! Multilevel preconditioners on real meshes: iteration counts that do not grow with depth.

use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{MeshChange, SimplexMesh};
use stylet_physics::body::Body;
use stylet_physics::material::{Hyperelastic, Linear, PlaneStress};
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::precondition::multilevel::{BisectionHierarchy, Bpx, VCycle};
use stylet_solver::precondition::{BlockJacobi, Preconditioner};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// A bisected body, face x = 1 fixed.
struct Problem<const B: usize> {
    a: BlockCsr<B>,
    w: Subspace<B>,
    hierarchy: BisectionHierarchy,
    b: Vec<f64>,
}

fn elasticity<const D: usize, const N: usize, M: Hyperelastic<D>>(depth: i32, material: M) -> Problem<D> {
    let mut mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D]).unwrap();
    let point: [f64; D] = std::array::from_fn(|k| [0.3141, 0.2718, 0.5772][k]);
    mesh.refine_around(point, 2_f64.powi(-depth), &mut MeshChange::default()).unwrap();
    let body = Body::new(&mesh, material, 1.0).unwrap();
    problem(&mesh, body.stiffness().clone())
}

fn problem<const D: usize, const N: usize, const B: usize>(mesh: &SimplexMesh<D, N>, a: BlockCsr<B>) -> Problem<B> {
    let n = mesh.n_vertex_slots();
    let hierarchy =
        BisectionHierarchy::new(mesh.vertices().map(|v| v.0), mesh.parents_slice(), mesh.generations_slice()).unwrap();
    let mut w = Subspace::new(n);
    for (v, x) in mesh.points().iter().enumerate() {
        if x[0] == 1.0 {
            w.set(v, Constraint::Fixed).unwrap();
        }
    }
    let mut b: Vec<f64> = (0..n * B).map(|k| (k as f64 * 1.7).sin()).collect();
    w.project(&mut b);
    Problem { a, w, hierarchy, b }
}

fn iterations<const B: usize>(p: &Problem<B>, m: &impl Preconditioner) -> usize {
    let stop = StopRule { tolerance: 1e-8, criterion: Criterion::External, round_floor: 0.0 };
    let settings = CgSettings { stop, max_iterations: 2000 };
    let mut x = vec![0.0; p.b.len()];
    let report = projected_cg(&p.a, m, &p.w, &p.b, &mut x, &settings, &mut CgWorkspace::new()).unwrap();
    assert_eq!(report.stop, Stop::Converged, "{report:?}");
    report.iterations
}

fn counts<const B: usize>(p: &Problem<B>) -> [usize; 3] {
    let bpx = Bpx::new(&p.a, &p.w, &p.hierarchy).unwrap();
    let v = VCycle::new(&p.a, &p.w, &p.hierarchy).unwrap();
    [iterations(p, &BlockJacobi::new(&p.a, &p.w).unwrap()), iterations(p, &bpx), iterations(p, &v)]
}

fn linear() -> Linear {
    Linear::from_young_poisson(1.0, 0.34).unwrap()
}

#[test]
fn probe() {
    for depth in [3, 6, 10, 15, 20] {
        let p = elasticity::<2, 3, _>(depth, linear());
        println!("2D strain {depth}: {} nodes {:?}", p.w.n_nodes(), counts(&p));
    }
    for depth in [3, 6, 10, 15, 20] {
        let p = elasticity::<2, 3, _>(depth, PlaneStress::new(linear()));
        println!("2D stress {depth}: {} nodes {:?}", p.w.n_nodes(), counts(&p));
    }
    for depth in [4, 7, 10] {
        let p = elasticity::<3, 4, _>(depth, linear());
        println!("3D {depth}: {} nodes {:?}", p.w.n_nodes(), counts(&p));
    }
}
