//! Multilevel preconditioners on real meshes: iteration counts that do not grow with depth.

use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{MeshChange, SimplexMesh, VertexId};
use stylet_physics::body::Body;
use stylet_physics::material::{Hyperelastic, Linear, PlaneStress};
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::precondition::multilevel::{BisectionHierarchy, Bpx, VCycle};
use stylet_solver::precondition::{BlockJacobi, Preconditioner};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// What the meshes are bisected around.
const POINT: [f64; 3] = [0.3141, 0.2718, 0.5772];

fn bisected<const D: usize, const N: usize>(depth: i32) -> SimplexMesh<D, N> {
    let mut mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D]).unwrap();
    let point: [f64; D] = std::array::from_fn(|k| POINT[k]);
    mesh.refine_around(point, 2_f64.powi(-depth), &mut MeshChange::default()).unwrap();
    mesh
}

/// A bisected body, face x = 1 fixed.
struct Problem<const B: usize> {
    a: BlockCsr<B>,
    w: Subspace<B>,
    hierarchy: BisectionHierarchy,
    b: Vec<f64>,
}

fn elasticity<const D: usize, const N: usize, M: Hyperelastic<D>>(depth: i32, material: M) -> Problem<D> {
    let mesh = bisected::<D, N>(depth);
    let body = Body::new(&mesh, material, 1.0).unwrap();
    problem(&mesh, body.stiffness().clone())
}

fn problem<const D: usize, const N: usize, const B: usize>(mesh: &SimplexMesh<D, N>, a: BlockCsr<B>) -> Problem<B> {
    let n = mesh.n_vertex_slots();
    let hierarchy =
        BisectionHierarchy::new(mesh.vertices().map(|v| v.0), mesh.parents_slice(), mesh.generations_slice()).unwrap();
    let mut w = Subspace::new(n);
    for (v, x) in mesh.points().iter().enumerate() {
        if x[0] == 1.0 || !mesh.is_vertex(VertexId(v as u32)) {
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

/// The Laplacian of each P1 mesh: the trace of the blocks `V μ (g_b g_aᵀ + (g_a·g_b) I)` of elasticity with ν = 0, E = 1.
fn poisson<const D: usize, const N: usize>(depth: i32) -> Problem<1> {
    let mesh = bisected::<D, N>(depth);
    let body = Body::new(&mesh, Linear::from_young_poisson(1.0, 0.0).unwrap(), 1.0).unwrap();
    let k = body.stiffness();
    let mut a = BlockCsr::<1>::new(k.n_rows());
    for row in 0..k.n_rows() {
        let (cols, blocks) = k.row(row);
        let traces: Vec<[[f64; 1]; 1]> =
            blocks.iter().map(|b| [[2.0 / (D + 1) as f64 * (0..D).map(|i| b[i][i]).sum::<f64>()]]).collect();
        a.set_row(row, cols, &traces).unwrap();
    }
    problem(&mesh, a)
}

/// A mesh refined along a short segment, whose nodes next to it are held: two in three fixed, one sliding along it.
fn needle<const D: usize, const N: usize>(depth: i32, length: f64) -> Problem<D> {
    let mut mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D]).unwrap();
    let h = 2_f64.powi(-depth);
    let tip: [f64; D] = std::array::from_fn(|k| POINT[k]);
    let mut tail = tip;
    tail[0] -= length;
    mesh.refine_along(tail, tip, h, &mut MeshChange::default()).unwrap();
    let body = Body::new(&mesh, linear(), 1.0).unwrap();
    let mut p = problem(&mesh, body.stiffness().clone());
    let mut held = 0;
    for (v, x) in mesh.points().iter().enumerate() {
        let off: f64 = (1..D).map(|k| (x[k] - tip[k]).powi(2)).sum();
        if off.sqrt() < 0.6 * h && x[0] < tip[0] && x[0] > tail[0] {
            let along: [f64; D] = std::array::from_fn(|k| f64::from(k == 0));
            let constraint = if held % 3 == 2 { Constraint::Line(along) } else { Constraint::Fixed };
            p.w.set(v, constraint).unwrap();
            held += 1;
        }
    }
    assert!(held >= 6, "{held} nodes held");
    p.w.project(&mut p.b);
    p
}

/// Iterations at the depths given: block Jacobi, BPX, V-cycle.
fn table<const B: usize>(name: &str, depths: &[i32], problem: impl Fn(i32) -> Problem<B>) -> Vec<[usize; 3]> {
    let rows: Vec<_> = depths.iter().map(|&depth| counts(&problem(depth))).collect();
    println!("{name}: depth {depths:?}: block Jacobi, BPX, V-cycle {rows:?}");
    rows
}

/// BPX grows by at most 20 %, the V-cycle by at most one iteration, from the first depth to each other.
fn assert_flat(rows: &[[usize; 3]], v_limit: usize) {
    let [_, bpx, v] = rows[0];
    for row in rows {
        assert!(5 * row[1] <= 6 * bpx, "BPX grows: {rows:?}");
        assert!(row[2] <= v + 1 && row[2] <= v_limit, "V-cycle grows: {rows:?}");
    }
}

#[test]
fn iterations_of_plane_elasticity_do_not_grow() {
    assert_flat(&table("plane strain", &[6, 10, 15, 20], |depth| elasticity::<2, 3, _>(depth, linear())), 10);
    let stress = |depth| elasticity::<2, 3, _>(depth, PlaneStress::new(linear()));
    assert_flat(&table("plane stress", &[6, 10, 15, 20], stress), 10);
}

#[test]
fn iterations_of_solid_elasticity_do_not_grow() {
    assert_flat(&table("3D", &[4, 7, 10], |depth| elasticity::<3, 4, _>(depth, linear())), 10);
}

#[test]
fn iterations_of_poisson_do_not_grow() {
    let plane = table("2D Poisson", &[6, 10, 15, 20], poisson::<2, 3>);
    assert_flat(&plane, 5);
    assert_flat(&table("3D Poisson", &[4, 7, 10], poisson::<3, 4>), 6);
}

#[test]
fn a_needle_in_a_solid_does_not_spoil_them() {
    let tip = |depth| needle::<3, 4>(depth, 12.0 * 2_f64.powi(-depth));
    assert_flat(&table("3D tip", &[5, 7, 9], tip), 13);
    let long = table("3D needle", &[5, 7, 9], |depth| needle::<3, 4>(depth, 0.25));
    assert!(long.iter().all(|row| 5 * row[1] <= 6 * long[0][1] && row[2] <= 14), "{long:?}");
}

/// In the plane the energy of a hole of radius h in a field of length 1 falls as 1/ln(1/h): some growth remains, as long as
/// levels see a hole at one scale each.
#[test]
fn a_needle_in_a_plane_costs_a_few_more() {
    let tip = table("2D tip", &[8, 14, 20], |depth| needle::<2, 3>(depth, 12.0 * 2_f64.powi(-depth)));
    let long = table("2D needle", &[6, 7, 8], |depth| needle::<2, 3>(depth, 0.25));
    for rows in [tip, long] {
        assert!(rows.iter().all(|row| 5 * row[1] <= 7 * rows[0][1] && row[2] <= 2 * rows[0][2]), "{rows:?}");
    }
}

#[test]
fn uniform_meshes_are_solved_in_as_few() {
    let uniform = |depth: i32| {
        let mut mesh = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [1; 2]).unwrap();
        mesh.refine_everywhere(1.5 * 2_f64.powi(-depth), &mut MeshChange::default()).unwrap();
        let body = Body::new(&mesh, linear(), 1.0).unwrap();
        problem(&mesh, body.stiffness().clone())
    };
    let rows = table("uniform", &[4, 5, 6], uniform);
    assert_flat(&rows, 12);
    assert!(2 * rows[2][1] < rows[2][0], "{rows:?}");
}

#[test]
fn a_rebuild_follows_a_mesh_that_changes() {
    let mut mesh = bisected::<2, 3>(8);
    let linear = linear();
    let mut body = Body::new(&mesh, linear, 1.0).unwrap();
    let p = problem(&mesh, body.stiffness().clone());
    let mut followed = Bpx::new(&p.a, &p.w, &p.hierarchy).unwrap();
    let mut followed_v = VCycle::new(&p.a, &p.w, &p.hierarchy).unwrap();

    let mut change = MeshChange::default();
    let removed = mesh.coarsen_unless(|mesh, cell| mesh.longest_edge(cell) > 0.05, &mut change);
    assert!(removed > 20, "{removed}");
    mesh.refine_around([0.8, 0.7], 2_f64.powi(-9), &mut change).unwrap();
    assert!(!change.born.is_empty());
    body.apply_change(&mesh, &change).unwrap();
    let p = problem(&mesh, body.stiffness().clone());
    followed.rebuild(&p.a, &p.w, &p.hierarchy).unwrap();
    followed_v.rebuild(&p.a, &p.w, &p.hierarchy).unwrap();
    let fresh = Bpx::new(&p.a, &p.w, &p.hierarchy).unwrap();
    let fresh_v = VCycle::new(&p.a, &p.w, &p.hierarchy).unwrap();
    assert_eq!(applied(&followed, &p.b), applied(&fresh, &p.b));
    assert_eq!(applied(&followed_v, &p.b), applied(&fresh_v, &p.b));
    assert!(iterations(&p, &followed) <= 45 && iterations(&p, &followed_v) <= 10);
}

fn applied(m: &impl Preconditioner, r: &[f64]) -> Vec<u64> {
    let mut z = vec![0.0; r.len()];
    m.apply(r, &mut z);
    z.iter().map(|z| z.to_bits()).collect()
}
