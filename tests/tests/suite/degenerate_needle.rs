//! Needles whose way in space is no general one: through vertices, along edges and faces, from corners, beside the skin,
//! to the far side (validation J10). Each has a defined outcome: a run that ends with a sound mesh, or a clear error.

use stylet_needle::builtin;
use stylet_tests::{finish, start_cube};

const SQUARE: f64 = std::f64::consts::FRAC_PI_4;

/// Runs to the end and checks what must hold of any needle. Returns the tip in the undeformed body, m.
fn insert(keys: &[&str]) -> Vec<f64> {
    let mut run = start_cube(keys, 1).unwrap();
    finish(&mut *run).unwrap_or_else(|e| panic!("{keys:?}: {e}"));
    run.mesh().check_invariants().unwrap();
    assert!((run.mesh().total_volume() / 1e-3 - 1.0).abs() < 1e-12, "{keys:?}");
    let summary = run.summary(&[]);
    let needle = summary.needle.unwrap();
    assert!(summary.converged && needle.nodes > 2, "{keys:?}: {needle:?}");
    assert!(run.displacement().iter().all(|u| u.is_finite() && u.abs() < 0.02), "{keys:?}");
    let line = *run.needle().unwrap();
    for (vertex, _) in run.needle_nodes() {
        let at = 3 * vertex.index();
        let place = std::array::from_fn(|k| run.mesh().point(vertex)[k] + run.displacement()[at + k]);
        let place = line.frame_of(place);
        // No farther than half a cell from the surface.
        assert!(place.behind > 0.0 && place.from_axis() < 6e-3, "{keys:?}: {place:?}");
    }
    needle.tip_reference
}

#[test]
fn ways_through_vertices_along_edges_and_along_faces() {
    let along_diagonal = format!("needle.angle={SQUARE}");
    let along_space_diagonal = format!("needle.elevation={}", 0.5f64.sqrt().atan());
    let ways: &[(&str, &[&str])] = &[
        ("along edges, from a vertex of the skin", &["needle.entry=[0, 0.05, 0.05]"]),
        ("within a face, beside its edges", &["needle.entry=[0, 0.05, 0.0437]"]),
        ("along the diagonals of faces, from an edge of the cube", &["needle.entry=[0, 0, 0.05]", &along_diagonal]),
        (
            "along the diagonals of cubes, from a corner",
            &["needle.entry=[0, 0, 0]", &along_diagonal, &along_space_diagonal],
        ),
        ("through vertices, across cells", &["needle.entry=[0, 0.025, 0.05]", "needle.angle=0.4636476090008061"]),
        ("from above, upright", &["needle.entry=[0.05, 0.05, 0.1]", "needle.elevation=-1.5707963267948966"]),
        ("from the far side", &["needle.entry=[0.1, 0.05, 0.05]", "needle.angle=3.141592653589793"]),
    ];
    for (name, keys) in ways {
        for radius in ["needle.radius=0.001", "needle.radius=0"] {
            for model in ["material.model=linear", "material.model=neo-hookean"] {
                let mut all = vec![radius, model, "mesh.fold=15", "needle.speed=0.5", "needle.depth=0.04"];
                all.extend(*keys);
                let tip = insert(&all);
                assert!(tip.iter().all(|x| (0.0..=0.1).contains(x)), "{name}: {tip:?}");
            }
        }
    }
}

/// Half of the cylinder is outside: only what is inside is refined around, and holds the needle.
#[test]
fn a_shaft_beside_the_skin_is_in_the_tissue_by_half() {
    for height in [0.0995, 0.099] {
        let tip = insert(&["mesh.fold=15", "needle.depth=0.04", &format!("needle.entry=[0, 0.05, {height}]")]);
        assert!((0.03..=0.04).contains(&tip[0]), "{tip:?}");
    }
}

/// The tissue that was dragged along springs back over the tip, which is then outside, and comes in again.
#[test]
fn a_tip_at_the_far_side_goes_out_and_comes_back_in() {
    let motion = "needle.motion=[{depth=0.1, insert=0.1}, {depth=0.11, insert=0.1, sleeve=0.002}, {depth=0.15, insert=0.06}, {depth=0.19, insert=0.1}, {depth=0.3, insert=-0.01}]";
    let mut run = start_cube(&["mesh.fold=12", "needle.speed=0.25", motion, "solver.tolerance=1e-6"], 1).unwrap();
    finish(&mut *run).unwrap();
    run.mesh().check_invariants().unwrap();
    let summary = run.summary(&[]);
    assert!(summary.converged && summary.needle.as_ref().unwrap().nodes == 0, "{summary:?}");
    assert!(summary.energy_j < 1e-9, "{} J", summary.energy_j);
}

#[test]
fn ways_that_make_no_sense_are_refused_by_name() {
    let refused = |keys: &[&str], expected: &str| {
        let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
        let found = builtin::open("cube3d-insertion", &keys).unwrap_err().to_string();
        assert!(found.contains(expected) && !found.contains('\n'), "{found}, expected {expected}");
    };
    refused(&["needle.entry=[0, 0.05, 0.1]"], "needle.angle: found 0, which takes the needle along a side of the cube");
    refused(&["needle.entry=[0, 0.05, 0]"], "needle.angle: found 0, which takes the needle along a side of the cube");
    refused(&["needle.depth=0.12"], "needle.depth: found 0.12, which puts the tip at (0.1200, 0.0500, 0.0500) m");
    refused(
        &["needle.entry=[0.02, 0.05, 0.05]"],
        "needle.entry: found [0.02, 0.05, 0.05], expected a point of the cube's boundary",
    );
    refused(&["needle.entry=[0, 0.05]"], "needle.entry: found 2 coordinates, expected 3 in a cube");
    refused(&["needle.radius=0.03"], "needle.radius: found 0.03, expected at most a quarter of mesh.side = 0.1");
    refused(&["needle.relocate=true"], "needle.relocate: found true for a needle with a radius");
    refused(&["mesh.fold=50"], "mesh.fold");
    refused(&["mesh.kind=slab", "needle.radius=0"], "needle.entry: found 3 coordinates, expected 2 in a slab");
}
