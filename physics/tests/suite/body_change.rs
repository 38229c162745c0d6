//! A body that follows a mesh has the bits of one made afresh, whatever it went through and on any number of threads.

use crate::support::{YOUNG, distorted_box, random_vector, slab};
use stylet_mesh::{CellId, MeshChange, SimplexMesh, VertexId};
use stylet_physics::body::{Body, BodyError};
use stylet_physics::material::{Hyperelastic, Linear, NeoHookean, PlaneStress, StVenantKirchhoff};
use stylet_solver::energy::Energy;

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// Energy, forces, safe step and stiffness agree bit for bit at a random displacement.
fn same<const D: usize, const N: usize, M: Hyperelastic<D>>(a: &mut Body<D, N, M>, b: &mut Body<D, N, M>, size: f64) {
    let n = a.dim();
    assert_eq!(n, b.dim());
    let (u, p) = (random_vector(n, size, 3), random_vector(n, 10.0 * size, 4));
    let (mut ga, mut gb) = (vec![0.0; n], vec![0.0; n]);
    a.gradient(&u, &mut ga);
    b.gradient(&u, &mut gb);
    assert!(ga.iter().all(|g| g.is_finite()) && ga.iter().any(|&g| g != 0.0));
    assert_eq!(bits(&ga), bits(&gb));
    assert_eq!(a.value(&u).to_bits(), b.value(&u).to_bits());
    assert_eq!(a.strain_energy(&u).to_bits(), b.strain_energy(&u).to_bits());
    assert_eq!(a.max_step(&u, &p, f64::INFINITY).to_bits(), b.max_step(&u, &p, f64::INFINITY).to_bits());
    a.linearize(&u);
    b.linearize(&u);
    assert!(a.stiffness() == b.stiffness(), "stiffness matrices differ");
}

/// Refines here and there, in several steps, and compares after each.
fn follow<const D: usize, const N: usize, M: Hyperelastic<D>>(
    mut mesh: SimplexMesh<D, N>,
    material: M,
    linearized: bool,
) {
    let mut body = Body::new(&mesh, material.clone(), 0.01).unwrap();
    if linearized {
        body.linearize(&vec![0.0; body.dim()]);
    }
    let mut change = MeshChange::default();
    for step in 0..6 {
        let cells: Vec<CellId> = mesh.cells().collect();
        let marked: Vec<CellId> = cells.iter().copied().skip(step).step_by(17).collect();
        change.clear();
        mesh.bisect(&marked, &mut change).unwrap();
        assert!(!change.is_empty());
        body.apply_change(&mesh, &change).unwrap();
        assert_eq!(body.n_elements(), mesh.n_cells());
        same(&mut body, &mut Body::new(&mesh, material.clone(), 0.01).unwrap(), 1e-5);
    }
}

#[test]
fn patched_bodies_equal_fresh_ones() {
    let (linear, stvk, neo) = (
        Linear::from_young_poisson(YOUNG, 0.34).unwrap(),
        StVenantKirchhoff::from_young_poisson(YOUNG, 0.34).unwrap(),
        NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap(),
    );
    for linearized in [false, true] {
        follow(slab(3, 5), PlaneStress::new(linear), linearized);
        follow(slab(3, 5), PlaneStress::new(neo), linearized);
        follow(slab(3, 5), stvk, linearized);
        follow(distorted_box::<3, 4>(3, 0.1, 1), linear, linearized);
        follow(distorted_box::<3, 4>(3, 0.1, 2), neo, linearized);
    }
}

/// Refines and coarsens in turn, with ids of cells and vertices reused, and compares after each; vertices that were
/// removed have neither row nor force.
fn follow_both_ways<const D: usize, const N: usize, M: Hyperelastic<D>>(mut mesh: SimplexMesh<D, N>, material: M) {
    let mut body = Body::new(&mesh, material.clone(), 0.01).unwrap();
    // One that has parts sums in them what is born later, too.
    let mut in_parts = body.clone();
    in_parts.set_partition(&(0..mesh.n_vertex_slots() as u32).map(|v| v * 5 % 3).collect::<Vec<_>>()).unwrap();
    let mut change = MeshChange::default();
    let mut reused = false;
    for step in 0..9 {
        change.clear();
        // The second operation undoes part of the first, or takes over its slots, within one change.
        if step % 3 == 2 {
            let removed = mesh.coarsen_unless(|_, c| c.index() % 5 == step % 5, &mut change);
            assert!(removed > 0);
        }
        let marked: Vec<CellId> = mesh.cells().skip(step).step_by(13).collect();
        mesh.bisect(&marked, &mut change).unwrap();
        if step % 3 == 1 {
            let marked: Vec<CellId> = mesh.cells().filter(|c| c.index() % 11 > 1).collect();
            mesh.coarsen(&marked, &mut change).unwrap();
        }
        reused |= change.born.iter().any(|cell| change.died.binary_search(cell).is_ok());
        body.apply_change(&mesh, &change).unwrap();
        in_parts.apply_change(&mesh, &change).unwrap();
        assert_eq!(body.n_elements(), mesh.n_cells());
        same(&mut body, &mut Body::new(&mesh, material.clone(), 0.01).unwrap(), 1e-5);
        same(&mut in_parts, &mut body, 1e-5);
        let mut force = vec![0.0; body.dim()];
        body.gradient(&random_vector(body.dim(), 1e-5, 9), &mut force);
        for v in (0..mesh.n_vertex_slots()).map(VertexId::new).filter(|&v| !mesh.is_vertex(v)) {
            assert!(force[D * v.index()..][..D].iter().all(|&f| f == 0.0));
            assert!(body.stiffness().row(v.index()).0.is_empty(), "a row without a vertex");
        }
    }
    assert!(reused, "no slot was taken over");
    change.clear();
    mesh.coarsen_everywhere(&mut change);
    assert!(mesh.n_vertices() < mesh.n_vertex_slots());
    body.apply_change(&mesh, &change).unwrap();
    same(&mut body, &mut Body::new(&mesh, material.clone(), 0.01).unwrap(), 1e-5);
}

#[test]
fn bodies_follow_coarsening() {
    let linear = Linear::from_young_poisson(YOUNG, 0.34).unwrap();
    let neo = NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap();
    follow_both_ways(slab(3, 5), PlaneStress::new(linear));
    follow_both_ways(slab(3, 5), PlaneStress::new(neo));
    follow_both_ways(distorted_box::<3, 4>(3, 0.1, 1), linear);
    follow_both_ways(distorted_box::<3, 4>(3, 0.1, 2), neo);
}

/// A change rewrites the rows of the vertices of the cells that died or were born, each once, and no others.
#[test]
fn a_change_writes_the_rows_it_touches() {
    let mut mesh = slab(6, 6);
    let material = PlaneStress::new(Linear::from_young_poisson(YOUNG, 0.34).unwrap());
    let mut body = Body::new(&mesh, material, 0.01).unwrap();
    let mut change = MeshChange::default();
    mesh.refine_around([0.031, 0.052], 1e-3, &mut change).unwrap();
    let mut touched: Vec<_> = change.died.iter().chain(&change.born).flat_map(|&cell| mesh.cell(cell)).collect();
    touched.sort_unstable();
    touched.dedup();
    let before = body.stiffness().rows_written();
    body.apply_change(&mesh, &change).unwrap();
    assert_eq!(body.stiffness().rows_written() - before, touched.len() as u64);
    assert!(touched.len() < mesh.n_vertices() / 20, "{} of {} rows", touched.len(), mesh.n_vertices());
}

#[test]
fn threads_do_not_change_a_bit() {
    // Above the size at which threads are used.
    let mesh = distorted_box::<3, 4>(10, 0.1, 5);
    let neo = NeoHookean::from_young_poisson(YOUNG, 0.45).unwrap();
    for threads in [2, 3, 8] {
        let (mut one, mut many) = (Body::new(&mesh, neo, 1.0).unwrap(), Body::new(&mesh, neo, 1.0).unwrap());
        many.set_threads(threads);
        same(&mut one, &mut many, 1e-4);
    }
}

#[test]
fn changes_that_do_not_fit_are_refused() {
    let mut mesh = slab(2, 2);
    let stale = mesh.clone();
    let material = Linear::from_young_poisson(YOUNG, 0.34).unwrap();
    let mut change = MeshChange::default();
    let marked: Vec<_> = mesh.cells().take(1).collect();
    mesh.bisect(&marked, &mut change).unwrap();
    let mut late = Body::new(&mesh, material, 1.0).unwrap();
    assert!(matches!(late.apply_change(&mesh, &change), Err(BodyError::ChangeMismatch { died: true, .. })));
    let only_born = MeshChange { born: change.born.clone(), ..MeshChange::default() };
    assert!(matches!(late.apply_change(&mesh, &only_born), Err(BodyError::ChangeMismatch { died: false, .. })));
    let beyond = MeshChange { born: vec![CellId(1_000_000)], ..MeshChange::default() };
    assert!(matches!(late.apply_change(&mesh, &beyond), Err(BodyError::ChangeMismatch { died: false, .. })));
    let mut body = Body::new(&stale, material, 1.0).unwrap();
    let twice = MeshChange { died: [&change.died[..], &change.died[..]].concat(), ..change.clone() };
    assert!(matches!(body.apply_change(&mesh, &twice), Err(BodyError::ChangeMismatch { died: true, .. })));
    // A refused change leaves the body as it was.
    body.apply_change(&mesh, &change).unwrap();
    same(&mut body, &mut late, 1e-5);
}

#[test]
fn hostile_bodies_are_errors() {
    let mesh = slab(1, 1);
    let material = Linear::from_young_poisson(YOUNG, 0.34).unwrap();
    for thickness in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Body::new(&mesh, material, thickness), Err(BodyError::Thickness { .. })), "{thickness}");
    }
    let stiff = Linear::from_young_poisson(1e308, 0.3).unwrap();
    assert!(matches!(Body::new(&mesh, stiff, 1e3), Err(BodyError::StiffnessOverflow { .. })));
}

/// The state of a lazy body: kept and restored on a body of another history it gives the same stiffness.
#[test]
fn a_lazy_linearisation_resumes() {
    let mut mesh = slab(3, 6);
    let neo = PlaneStress::new(NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap());
    let mut body = Body::new(&mesh, neo, 0.01).unwrap();
    body.set_lazy(0.05);
    let mut change = MeshChange::default();
    for step in 0..4 {
        body.linearize(&random_vector(body.dim(), 1e-4 * f64::from(step), 20 + step as u64));
        let marked: Vec<CellId> = mesh.cells().skip(step as usize).step_by(29).collect();
        change.clear();
        mesh.bisect(&marked, &mut change).unwrap();
        body.apply_change(&mesh, &change).unwrap();
    }
    let u = random_vector(body.dim(), 1e-4, 30);
    body.linearize(&u);
    let mut resumed = Body::new(&mesh, neo, 0.01).unwrap();
    resumed.set_lazy(0.05);
    resumed.restore_linearization(&body.linearization()).unwrap();
    assert!(body.stiffness() == resumed.stiffness());
    let next: Vec<f64> = u.iter().map(|x| 1.01 * x).collect();
    body.linearize(&next);
    resumed.linearize(&next);
    assert!(body.stiffness() == resumed.stiffness());
    assert_eq!(body.linearization(), resumed.linearization());

    let mut other = Body::new(&slab(2, 2), neo, 0.01).unwrap();
    assert!(matches!(other.restore_linearization(&body.linearization()), Err(BodyError::LinearizationSize { .. })));
}

/// A lazy linearisation evaluates few elements where little has changed, and stays near the exact Hessian.
#[test]
fn a_lazy_linearisation_is_close_and_cheap() {
    let mesh = slab(4, 6);
    let neo = PlaneStress::new(NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap());
    let (mut lazy, mut exact) = (Body::new(&mesh, neo, 0.01).unwrap(), Body::new(&mesh, neo, 0.01).unwrap());
    let threshold = 0.02;
    lazy.set_lazy(threshold);
    // A displacement that strains the middle of the slab alone.
    let bump = |size: f64| -> Vec<f64> {
        let hill = |x: &[f64; 2]| size * (-((x[0] - 0.05) / 0.01).powi(2) - ((x[1] - 0.05) / 0.01).powi(2)).exp();
        mesh.points().iter().flat_map(|x| [hill(x), 0.0]).collect()
    };
    let u = bump(1.5e-3);
    lazy.linearize(&u);
    exact.linearize(&u);
    assert!(lazy.elements_linearized() < exact.elements_linearized() / 2, "{} elements", lazy.elements_linearized());
    assert!(lazy.elements_linearized() > 0);
    let p = random_vector(u.len(), 1.0, 6);
    let (mut a, mut b) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    lazy.hessian_apply(&p, &mut a);
    exact.hessian_apply(&p, &mut b);
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let error = norm(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>()) / norm(&b);
    println!("{} of {} elements, error {error:e}", lazy.elements_linearized(), exact.elements_linearized());
    assert!(error < 5.0 * threshold && error > 0.0, "relative error {error}");
    let evaluated = lazy.elements_linearized();
    lazy.linearize(&u);
    assert_eq!(lazy.elements_linearized(), evaluated, "nothing changed");
}
