//! The needle needs no regular mesh: an insertion into an unstructured one comes to the same forces.

use stylet_mesh::{SimplexMesh, generate};
use stylet_needle::builtin;
use stylet_needle::insertion::Insertion;
use stylet_needle::scene::{FrictionStage, NeedleStage, Scene};
use stylet_needle::slab::Slab;
use stylet_needle::stages::Stages;
use stylet_physics::material::{Linear, PlaneStress};

/// A square of `n * n` cells with jittered inner vertices, random diagonals and shuffled vertices: no two vertices have
/// the same surroundings.
fn unstructured(n: usize, side: f64, seed: u64) -> SimplexMesh<2, 3> {
    let mut state = seed;
    let mut random = move || {
        // Knuth's MMIX generator; its high bits are random enough to jitter a mesh.
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let h = side / n as f64;
    let mut points = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            let mut jitter = |inner: bool| if inner { 0.5 * (random() - 0.5) * h } else { 0.0 };
            let (inner_x, inner_y) = (i > 0 && i < n, j > 0 && j < n);
            points.push([i as f64 * h + jitter(inner_x), j as f64 * h + jitter(inner_y)]);
        }
    }
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
    let mut cells = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if random() < 0.5 {
                cells.extend([[a, b, c], [a, c, d]]);
            } else {
                cells.extend([[b, c, d], [a, b, d]]);
            }
        }
    }
    SimplexMesh::new(points, cells).unwrap()
}

fn insert(
    mesh: SimplexMesh<2, 3>,
    scene: &Scene,
    stage: &NeedleStage,
    friction: &FrictionStage,
) -> (f64, [f64; 2], usize) {
    let material = PlaneStress::new(Linear::from_young_poisson(34e3, 0.34).unwrap());
    let mut stages = Stages::default();
    let slab = Slab::from_mesh(scene, mesh, material, 1, &mut stages).unwrap();
    let mut insertion = Insertion::new(scene, stage, friction, slab).unwrap();
    while !insertion.finished() {
        insertion.cycle(&mut stages).unwrap();
        // Needle nodes stay ordered along the shaft, behind the tip, and near it.
        let nodes = &insertion.shaft.nodes;
        assert!(nodes.windows(2).all(|pair| pair[0].place.behind <= pair[1].place.behind));
        assert!(nodes.iter().all(|node| node.place.behind > 0.0 && node.place.perpendicular.abs() < 0.01));
    }
    insertion.slab.mesh.check_invariants().unwrap();
    (insertion.shaft.base_force(&insertion.needle).force[0], insertion.tip_reference(), insertion.shaft.nodes.len())
}

#[test]
fn an_unstructured_mesh_gives_the_same_insertion() {
    let scene = builtin::open("slab2d-insertion", &["needle.speed=0.1".to_owned(), "solver.tolerance=1e-4".to_owned()])
        .unwrap();
    let (stage, friction) = (scene.needle.clone().unwrap(), scene.friction.clone().unwrap());
    let regular = generate::kuhn_box([0.0; 2], [0.1; 2], [8, 8]).unwrap();
    let (force, tip, nodes) = insert(regular, &scene, &stage, &friction);
    for seed in [1, 2, 3] {
        let mesh = unstructured(8, 0.1, seed);
        let (irregular_force, irregular_tip, irregular_nodes) = insert(mesh, &scene, &stage, &friction);
        let case = format!(
            "seed {seed}: {irregular_force} N at {irregular_tip:?} with {irregular_nodes} nodes, regular {force} N at {tip:?} with {nodes}"
        );
        assert!((irregular_force / force - 1.0).abs() < 0.15, "{case}");
        assert!((irregular_tip[0] - tip[0]).hypot(irregular_tip[1] - tip[1]) < 1.5e-3, "{case}");
        assert!(2 * irregular_nodes > nodes, "{case}");
    }
}
