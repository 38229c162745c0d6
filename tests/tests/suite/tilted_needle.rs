//! A needle that no mesh line follows, in a material whose energy is infinite for an inverted triangle.

use stylet_tests::start;

const NEO_HOOKEAN: [&str; 3] = ["material.model=neo-hookean", "solver.method=newton-cg", "solver.tolerance=1e-6"];

/// Runs an insertion to its end and returns its needle nodes.
fn insert(keys: &[&str]) -> usize {
    let mut run = start("slab2d-insertion", &[&NEO_HOOKEAN[..], keys].concat(), 1).unwrap();
    while !run.finished() {
        run.step().unwrap_or_else(|e| panic!("{keys:?}: {e}"));
    }
    let summary = run.summary(&[]);
    assert!(summary.converged && summary.energy_j.is_finite() && summary.energy_j > 0.0, "{keys:?}: {summary:?}");
    summary.needle.unwrap().nodes
}

/// Slipping nodes were put back to where they had been before the tissue around them was carried along the shaft, which
/// turned triangles inside out: a tilted needle "moves them sideways" by a rounding error.
#[test]
fn slipping_nodes_that_the_tissue_carries_along_are_not_put_back() {
    let keys = ["mesh.h_start=1", "mesh.h_ref=5", "support.clamped=right", "needle.entry=[0.1, 0.05]"];
    for poisson in ["material.poisson=0.4999999", "material.poisson=0.45"] {
        let way = ["needle.angle=-2.9562447", "needle.depth=0.1", "needle.speed=0.5", poisson];
        assert!(insert(&[&keys[..], &way].concat()) > 20);
    }
}

/// The guard against flattened triangles looked at the undeformed slab only; where tissue is deformed, a node that went
/// onto the needle turned triangles inside out.
#[test]
fn relocation_turns_no_triangle_of_the_deformed_slab_inside_out() {
    for angle in ["needle.angle=0.1", "needle.angle=0.3", "needle.angle=-0.4"] {
        let keys = ["needle.relocate=true", "mesh.h_ref=5", "needle.speed=1", "needle.entry=[0, 0.03]", angle];
        assert!(insert(&[&keys[..], &["needle.depth=0.03", "friction.static_ratio=3"]].concat()) > 3);
    }
}

/// No edge is crossed on the way in, so there were no needle nodes and a lumped load was no load at all.
#[test]
fn a_static_needle_on_a_side_of_the_slab_has_nodes() {
    let energy = |distribution: &str| {
        let keys = ["needle.entry=[0.02, 0]", "support.clamped=right", distribution];
        let mut run = start("slab2d-static", &keys, 1).unwrap();
        run.step().unwrap();
        let summary = run.summary(&[]);
        assert!(summary.needle.unwrap().nodes > 40);
        summary.energy_j
    };
    let (lumped, consistent) = (energy("load.distribution=lumped"), energy("load.distribution=consistent"));
    assert!((lumped / consistent - 1.0).abs() < 0.05, "{lumped} J, {consistent} J");
}
