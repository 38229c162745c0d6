//! A scene runs no stage that it does not need, and a refinement writes no matrix row that it does not change.

use stylet_mesh::{MeshChange, SimplexMesh, generate};
use stylet_physics::body::Body;
use stylet_physics::material::{Linear, PlaneStress};
use stylet_tests::{finish, start};

fn stages(scene: &str, keys: &[&str]) -> Vec<&'static str> {
    let mut run = start(scene, keys, 1).unwrap();
    finish(&mut *run).unwrap();
    run.stages().iter().map(|(name, _, _)| name).collect()
}

#[test]
fn only_needed_stages_run() {
    assert_eq!(stages("slab2d-static", &[]), ["mesh", "assemble", "load", "refine", "capture", "solve"]);
    let short = "needle.depth=0.01";
    let loop_stages = ["mesh", "assemble", "move", "locate", "refine", "capture", "solve", "rearrange", "release"];
    assert_eq!(stages("slab2d-insertion", &[short]), loop_stages);
    let nonlinear = stages("slab2d-sideways", &[short, "needle.speed=0.1"]);
    assert!(nonlinear.contains(&"force") && nonlinear.contains(&"linearize") && !nonlinear.contains(&"relocate"));
    // A linear material evaluates no element in a solve, whatever the method.
    for method in ["cg", "nonlinear-cg", "newton-cg"] {
        let names = stages("slab2d-insertion", &[short, &format!("solver.method={method}")]);
        assert!(!names.contains(&"force") && !names.contains(&"linearize"), "{method}: {names:?}");
    }
}

#[test]
fn a_refinement_writes_the_rows_of_changed_nodes_only() {
    let mut mesh: SimplexMesh<2, 3> = generate::kuhn_box([0.0; 2], [0.1; 2], [16, 16]).unwrap();
    let material = PlaneStress::new(Linear::from_young_poisson(34e3, 0.34).unwrap());
    let mut body = Body::new(&mesh, material, 0.01).unwrap();
    for step in 0..20 {
        let point = [0.004 * step as f64 + 1e-3, 0.0501];
        let mut change = MeshChange::default();
        mesh.refine_around(point, 1.5e-3, &mut change).unwrap();
        let before = body.stiffness().rows_written();
        body.apply_change(&mesh, &change).unwrap();
        let written = body.stiffness().rows_written() - before;
        let mut changed: Vec<u32> =
            change.died.iter().chain(&change.born).flat_map(|&c| mesh.cell(c)).map(|v| v.0).collect();
        changed.sort_unstable();
        changed.dedup();
        assert_eq!(written as usize, changed.len(), "step {step}");
        assert!(changed.len() < mesh.n_vertices() / 3, "step {step}: {} of {}", changed.len(), mesh.n_vertices());
    }
}
