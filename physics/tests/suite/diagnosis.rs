//! What the diagnosis of a static problem finds, on bodies whose faults are known.

use stylet_mesh::{SimplexMesh, VertexId, generate};
use stylet_physics::body::Body;
use stylet_physics::material::NeoHookean;
use stylet_physics::statics::{Finding, Motion, examine_constraints, examine_load, examine_material, inverted_cells};
use stylet_solver::subspace::{Constraint, Subspace};

fn cube() -> SimplexMesh<3, 4> {
    generate::kuhn_box([0.0; 3], [0.1; 3], [2, 2, 2]).unwrap()
}

/// Constrains the nodes that a test picks.
fn held(mesh: &SimplexMesh<3, 4>, constraint: Constraint<3>, picks: impl Fn([f64; 3]) -> bool) -> Subspace<3> {
    let mut subspace = Subspace::new(mesh.n_vertex_slots());
    for v in mesh.vertices().filter(|&v| picks(mesh.point(v))) {
        subspace.set(v.index(), constraint).unwrap();
    }
    subspace
}

fn motions(findings: &[Finding]) -> Vec<Motion> {
    match findings {
        [] => Vec::new(),
        [Finding::FreePart { motions, .. }] => motions.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn rigid_motions_that_nothing_holds_are_named() {
    let mesh = cube();
    let of =
        |constraint, picks: fn([f64; 3]) -> bool| motions(&examine_constraints(&mesh, &held(&mesh, constraint, picks)));
    assert_eq!(of(Constraint::Free, |_| true).len(), 6);
    assert!(of(Constraint::Fixed, |x| x[2] == 0.0).is_empty());
    // One fixed node: the three rotations, about axes through it.
    let about = of(Constraint::Fixed, |x| x == [0.0; 3]);
    assert_eq!(about.len(), 3);
    for motion in &about {
        let Motion::Rotation { axis, through } = motion else { panic!("{motion}") };
        let cross = (0..3).map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            (through[i] * axis[j] - through[j] * axis[i]).powi(2)
        });
        assert!(cross.sum::<f64>().sqrt() < 1e-9, "an axis that misses the fixed node: {motion}");
    }
    // A fixed edge: one rotation, about the edge.
    let [Motion::Rotation { axis, .. }] = of(Constraint::Fixed, |x| x[0] == 0.0 && x[1] == 0.0)[..] else { panic!() };
    assert!(axis[2].abs() > 1.0 - 1e-9);
    // A bottom that slides in its plane: two translations and a rotation.
    let sliding = of(Constraint::Plane([0.0, 0.0, 1.0]), |x| x[2] == 0.0);
    assert_eq!(sliding.iter().filter(|m| matches!(m, Motion::Translation(_))).count(), 2, "{sliding:?}");
    assert_eq!(sliding.len(), 3);
}

#[test]
fn a_part_that_nothing_holds_is_named() {
    let one = cube();
    let n = one.n_vertex_slots() as u32;
    let far = one.points().iter().map(|x| [x[0] + 1.0, x[1], x[2]]);
    let points: Vec<[f64; 3]> = one.points().iter().copied().chain(far).collect();
    let cells = one.cells().map(|c| one.cell(c).map(|v| v.0));
    let both = cells.clone().chain(cells.map(|c| c.map(|v| v + n))).collect();
    let mesh = SimplexMesh::<3, 4>::new(points, both).unwrap();
    let subspace = held(&mesh, Constraint::Fixed, |x| x[0] < 0.5 && x[2] == 0.0);
    let findings = examine_constraints(&mesh, &subspace);
    let [Finding::FreePart { part: 1, n_parts: 2, vertex, n_vertices, motions }] = &findings[..] else {
        panic!("{findings:?}")
    };
    assert_eq!((*vertex, *n_vertices, motions.len()), (VertexId(n), n as usize, 6));
}

#[test]
fn loads_materials_and_turned_cells() {
    // A body of 50 m with Young's modulus of 34 Pa under its weight, and one in the right units.
    let large: SimplexMesh<3, 4> = generate::kuhn_box([0.0; 3], [50.0; 3], [2, 2, 2]).unwrap();
    let weight = |mesh: &SimplexMesh<3, 4>| {
        let each = 1000.0 * 9.81 * mesh.total_volume() / mesh.n_vertices() as f64;
        (0..3 * mesh.n_vertex_slots()).map(|k| if k % 3 == 2 { -each } else { 0.0 }).collect::<Vec<f64>>()
    };
    let Some(Finding::AbsurdStrain { strain, size, .. }) = examine_load(&large, 1.0, 34.0, &weight(&large)) else {
        panic!("the units of a large and soft body go unnoticed")
    };
    // rho g L / E.
    assert!((strain / (1000.0 * 9.81 * 50.0 / 34.0) - 1.0).abs() < 1e-9 && size == 50.0);
    assert_eq!(examine_load(&cube(), 1.0, 34e3, &weight(&cube())), None);
    assert_eq!(examine_material(0.45), None);
    assert_eq!(examine_material(0.49), Some(Finding::Locking { poisson: 0.49 }));

    let mesh = cube();
    let body = Body::new(&mesh, NeoHookean::from_young_poisson(34e3, 0.3).unwrap(), 1.0).unwrap();
    let mut u = vec![0.0; 3 * mesh.n_vertex_slots()];
    assert_eq!(inverted_cells(&body, &mesh, &u), None);
    // The middle node goes out through the top: cells above it turn over.
    let middle = mesh.vertices().find(|&v| mesh.point(v) == [0.05; 3]).unwrap();
    u[3 * middle.index() + 2] = 0.06;
    let Some(Finding::Inverted { count, worst }) = inverted_cells(&body, &mesh, &u) else { panic!() };
    assert!(count >= 4 && worst.len() <= 8 && worst.windows(2).all(|w| w[0].1 <= w[1].1));
    assert!(worst.iter().all(|&(cell, j)| j < 0.0 && body.jacobian(cell, &u) == Some(j)));
}
