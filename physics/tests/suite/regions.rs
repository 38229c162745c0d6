//! Materials and densities by region, mass, parts of the assembly: what follows a mesh change has the bits of what is made
//! afresh.

use crate::support::{YOUNG, random_vector};
use proptest::prelude::*;
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{CellId, MeshChange, SimplexMesh};
use stylet_physics::body::{Body, BodyError, Density, LazyRule, MassKind};
use stylet_physics::material::{Hyperelastic, Linear, NeoHookean, StVenantKirchhoff};
use stylet_solver::energy::Energy;

/// A box of three layers along the first axis, regions 3, 7 and 9, and then some bisections.
fn layers<const D: usize, const N: usize>(n: usize) -> SimplexMesh<D, N> {
    let mesh = kuhn_box::<D, N>([0.0; D], [0.1; D], [n; D]).unwrap();
    let centre = |cell: CellId| mesh.corners(cell).iter().map(|x| x[0]).sum::<f64>() / N as f64;
    let region = |cell: CellId| [3, 7, 9][((centre(cell) * 30.0) as usize).min(2)];
    let cells: Vec<CellId> = mesh.cells().collect();
    let simplices = cells.iter().map(|&c| mesh.cell(c).map(|v| v.0)).collect();
    let regions = cells.iter().map(|&c| region(c)).collect();
    SimplexMesh::with_regions(mesh.points().to_vec(), simplices, regions).unwrap()
}

fn neo(young: f64) -> NeoHookean {
    NeoHookean::from_young_poisson(young, 0.4).unwrap()
}

fn densities() -> Density {
    Density::ByRegion(vec![(9, 900.0), (3, 1000.0), (7, 1900.0)])
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// Forces, energy, stiffness and mass of two bodies, bit for bit.
fn same<const D: usize, const N: usize, M: Hyperelastic<D>>(a: &mut Body<D, N, M>, b: &mut Body<D, N, M>, seed: u64) {
    let n = a.dim();
    let u = random_vector(n, 1e-4, seed);
    let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
    a.gradient(&u, &mut x);
    b.gradient(&u, &mut y);
    assert!(x.iter().any(|&f| f != 0.0) && bits(&x) == bits(&y), "forces differ");
    assert_eq!(a.value(&u).to_bits(), b.value(&u).to_bits());
    a.linearize(&u);
    b.linearize(&u);
    assert!(a.stiffness() == b.stiffness(), "stiffness matrices differ");
    a.apply_mass(&u, &mut x);
    b.apply_mass(&u, &mut y);
    assert_eq!(bits(&x), bits(&y));
    assert_eq!(bits(a.lumped_mass()), bits(b.lumped_mass()));
}

fn follow<const D: usize, const N: usize, M: Hyperelastic<D>>(
    n: usize,
    law: impl Fn(f64) -> M,
    kind: MassKind,
    steps: &[(usize, usize, bool)],
) {
    let mut mesh = layers::<D, N>(n);
    let materials = [(7, law(5.0 * YOUNG)), (3, law(YOUNG)), (9, law(0.2 * YOUNG))];
    let fresh = |mesh: &SimplexMesh<D, N>| {
        let mut body = Body::with_materials(mesh, &materials, 1.0).unwrap();
        body.set_mass(kind, &densities()).unwrap();
        body
    };
    let mut body = fresh(&mesh);
    body.linearize(&vec![0.0; body.dim()]);
    let mass = body.total_mass();
    let mut change = MeshChange::default();
    for (step, &(skip, stride, coarsens)) in steps.iter().enumerate() {
        change.clear();
        let marked: Vec<CellId> = mesh.cells().skip(skip).step_by(stride).collect();
        if coarsens {
            mesh.coarsen(&marked, &mut change).unwrap();
        } else {
            mesh.bisect(&marked, &mut change).unwrap();
        }
        body.apply_change(&mesh, &change).unwrap();
        same(&mut body, &mut fresh(&mesh), step as u64);
        assert!((body.total_mass() / mass - 1.0).abs() < 1e-12);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn bodies_of_regions_follow_changes(
        steps in prop::collection::vec((0..9usize, 3..20usize, any::<bool>()), 1..6),
        consistent in any::<bool>(),
    ) {
        let kind = if consistent { MassKind::Consistent } else { MassKind::Lumped };
        follow::<3, 4, _>(3, neo, kind, &steps);
        follow::<2, 3, _>(6, |young| StVenantKirchhoff::from_young_poisson(young, 0.3).unwrap(), kind, &steps);
        follow::<3, 4, _>(3, |young| Linear::from_young_poisson(young, 0.3).unwrap(), kind, &steps);
    }
}

/// Three springs in a row: the layers of a bar under tension stretch as their moduli say.
#[test]
fn each_region_has_its_material() {
    let mesh = layers::<3, 4>(3);
    let law = |young: f64| Linear::from_young_poisson(young, 0.0).unwrap();
    let materials = [(3, law(1e4)), (7, law(2e4)), (9, law(4e4))];
    let body = Body::with_materials(&mesh, &materials, 1.0).unwrap();
    let listed: Vec<_> = body.materials().map(|(region, _)| region.unwrap()).collect();
    assert_eq!(listed, [3, 7, 9]);
    // Stress 100 Pa: strains 0.01, 0.005, 0.0025.
    let strain = [0.01, 0.005, 0.0025];
    let third = 0.1 / 3.0;
    let stretch = |x: f64| {
        let inside = |k: usize| (x - k as f64 * third).clamp(0.0, third);
        (0..3).map(|k| strain[k] * inside(k)).sum::<f64>()
    };
    let u: Vec<f64> = mesh.points().iter().flat_map(|x| [stretch(x[0]), 0.0, 0.0]).collect();
    for cell in mesh.cells() {
        let stress = body.stress(cell, &u).unwrap();
        assert!((stress[(0, 0)] - 100.0).abs() < 1e-9, "region {}: {stress}", mesh.region(cell));
        assert_eq!(body.material_of(cell), Some(&materials.iter().find(|m| m.0 == mesh.region(cell)).unwrap().1));
    }
    let mut force = vec![0.0; u.len()];
    body.clone().internal_force(&u, &mut force);
    for (x, force) in mesh.points().iter().zip(force.chunks_exact(3)) {
        let inner = x[0] > 1e-9 && x[0] < 0.1 - 1e-9;
        assert!(!inner || force[0].abs() < 1e-12, "a force of {} N between layers", force[0]);
    }
}

#[test]
fn hostile_regions_are_errors() {
    let mesh = layers::<3, 4>(3);
    let of = |regions: &[u32]| {
        let materials: Vec<_> = regions.iter().map(|&region| (region, neo(YOUNG))).collect();
        Body::with_materials(&mesh, &materials, 1.0).map(drop)
    };
    let error = of(&[3, 9]).unwrap_err();
    assert!(matches!(error, BodyError::RegionWithoutMaterial { region: 7, .. }), "{error}");
    assert!(error.to_string().contains("region 7") && error.to_string().contains("3, 9"), "{error}");
    assert!(matches!(of(&[3, 7, 9, 7]), Err(BodyError::RegionListed { region: 7, times: 2, .. })));
    assert_eq!(of(&[]), Err(BodyError::NoMaterial));
    let mut body = Body::with_materials(&mesh, &[(3, neo(1.0)), (7, neo(1.0)), (9, neo(1.0))], 1.0).unwrap();
    for density in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = body.set_mass(MassKind::Lumped, &Density::Uniform(density)).unwrap_err();
        assert!(matches!(error, BodyError::Density { region: None, .. }), "{error}");
    }
    let missing = body.set_mass(MassKind::Lumped, &Density::ByRegion(vec![(3, 1.0), (9, 1.0)])).unwrap_err();
    assert!(matches!(missing, BodyError::RegionListed { region: 7, times: 0, .. }), "{missing}");
    assert!(body.mass_kind().is_none() && body.lumped_mass().is_empty(), "refused densities leave no mass");
    assert!(matches!(body.set_partition(&[0; 5]), Err(BodyError::Partition { found: 5, .. })));
}

/// Rows of either kind of mass sum to the same, and the weight is the mass times gravity.
#[test]
fn mass_is_density_times_volume() {
    let mesh = layers::<3, 4>(3);
    let materials = [(3, neo(YOUNG)), (7, neo(YOUNG)), (9, neo(YOUNG))];
    let expected = 1e-3 / 3.0 * (1000.0 + 1900.0 + 900.0);
    for kind in [MassKind::Lumped, MassKind::Consistent] {
        let mut body = Body::with_materials(&mesh, &materials, 1.0).unwrap();
        body.set_mass(kind, &densities()).unwrap();
        assert!((body.total_mass() / expected - 1.0).abs() < 1e-12);
        let v: Vec<f64> = mesh.points().iter().flat_map(|_| [2.0, 0.0, -1.0]).collect();
        let mut p = vec![0.0; v.len()];
        body.apply_mass(&v, &mut p);
        for (m, p) in body.lumped_mass().iter().zip(p.chunks_exact(3)) {
            assert!((p[0] - 2.0 * m).abs() < 1e-15 && p[1] == 0.0 && (p[2] + m).abs() < 1e-15);
        }
        assert!((body.kinetic_energy(&v) / (2.5 * expected) - 1.0).abs() < 1e-12);
        let mut weight = vec![0.0; v.len()];
        body.add_gravity(&[0.0, 0.0, -9.81], &mut weight);
        assert!((weight.iter().sum::<f64>() / (-9.81 * expected) - 1.0).abs() < 1e-12);
    }
    // The integral of rho x^2 over [0, 0.1]^3 by layers, exact for the consistent mass: a turn about the middle would do too.
    let mut body = Body::with_materials(&mesh, &materials, 1.0).unwrap();
    body.set_mass(MassKind::Consistent, &densities()).unwrap();
    let v: Vec<f64> = mesh.points().iter().flat_map(|x| [x[0], 0.0, 0.0]).collect();
    let cube = |k: usize| (k as f64 * 0.1 / 3.0).powi(3);
    let exact: f64 = (0..3).map(|k| [1000.0, 1900.0, 900.0][k] * (cube(k + 1) - cube(k)) / 3.0 * 0.01).sum();
    assert!((2.0 * body.kinetic_energy(&v) / exact - 1.0).abs() < 1e-12);
}

/// Neither parts nor threads change a bit of the matrix.
#[test]
fn parts_do_not_change_a_bit() {
    let mesh = layers::<3, 4>(9);
    let materials = [(3, neo(YOUNG)), (7, neo(2.0 * YOUNG)), (9, neo(5.0 * YOUNG))];
    let u = random_vector(3 * mesh.n_vertex_slots(), 1e-3, 2);
    let make = |threads: usize, parts: Option<Vec<u32>>, rule: LazyRule| {
        let mut body = Body::with_materials(&mesh, &materials, 1.0).unwrap();
        body.set_threads(threads);
        body.set_lazy_rule(rule);
        if let Some(parts) = parts {
            body.set_partition(&parts).unwrap();
        }
        body.linearize(&u);
        body.stiffness().clone()
    };
    for rule in [LazyRule::Always, LazyRule::Strain(0.05), LazyRule::Stiffness(5.0), LazyRule::Rotation(5.0)] {
        let one = make(1, None, rule);
        for threads in [2, 8] {
            assert!(one == make(threads, None, rule), "{threads} threads, {rule:?}");
            let scattered = (0..mesh.n_vertex_slots() as u32).map(|v| v * 7 % 5).collect();
            assert!(one == make(threads, Some(scattered), rule), "scattered parts, {rule:?}");
        }
    }
}

/// What lazy rules save and what they cost: a body bent step by step, the stiffness against the exact one.
#[test]
fn lazy_rules_are_close_and_cheap() {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [0.1; 3], [6; 3]).unwrap();
    let bend = |t: f64| -> Vec<f64> {
        mesh.points().iter().flat_map(|x| [t * 4.0 * x[2] * x[2], 0.0, -t * 4.0 * x[0] * x[2]]).collect()
    };
    let measure = |rule: LazyRule| {
        let (mut lazy, mut exact) =
            (Body::new(&mesh, neo(YOUNG), 1.0).unwrap(), Body::new(&mesh, neo(YOUNG), 1.0).unwrap());
        lazy.set_lazy_rule(rule);
        (1..=20).for_each(|step| lazy.linearize(&bend(0.05 * f64::from(step))));
        exact.linearize(&bend(1.0));
        let p = random_vector(lazy.dim(), 1.0, 6);
        let (mut a, mut b) = (vec![0.0; p.len()], vec![0.0; p.len()]);
        lazy.hessian_apply(&p, &mut a);
        exact.hessian_apply(&p, &mut b);
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let error = norm(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>()) / norm(&b);
        (lazy.elements_linearized() as f64 / (20 * lazy.n_elements()) as f64, error)
    };
    let mut stiffness = Vec::new();
    for threshold in [0.0, 10.0, 40.0, 160.0] {
        let rules =
            [LazyRule::Stiffness(threshold), LazyRule::Rotation(threshold), LazyRule::Strain(threshold / 400.0)];
        let found = rules.map(measure);
        println!("threshold {threshold}: (share, error) by stiffness, rotation, strain {found:?}");
        stiffness.push(found[0]);
    }
    assert!(stiffness[0] == (1.0, 0.0), "a threshold of zero keeps nothing: {stiffness:?}");
    assert!(stiffness.windows(2).all(|pair| pair[1].0 < pair[0].0 && pair[1].1 > pair[0].1), "{stiffness:?}");
    // An entry of the stiffness of a cell is about 300 N/m.
    assert!(stiffness[2].0 < 0.4 && stiffness[2].1 < 0.1, "{stiffness:?}");
}
