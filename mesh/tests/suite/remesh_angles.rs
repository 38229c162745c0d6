//! The angles that needles leave in a body of two regions, whatever their path.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::ops::ControlFlow;
use std::sync::OnceLock;
use stylet_mesh::generate::implicit::{Ellipsoid, Implicit, Strata};
use stylet_mesh::generate::stuff::{Settings, stuff};
use stylet_mesh::remesh::paths::{PathKind, path};
use stylet_mesh::remesh::{CycleSettings, Motion, Outcome, Remesher, drive};
use stylet_mesh::{MeshChange, SimplexMesh, geometry};

/// Edge of the lattice's cubes.
const SIZE: f64 = 0.125;

/// An ellipsoid in the unit cube.
fn body() -> &'static SimplexMesh<3, 4> {
    static BODY: OnceLock<SimplexMesh<3, 4>> = OnceLock::new();
    BODY.get_or_init(|| {
        let solid: Box<dyn Implicit> = Box::new(Ellipsoid::new([0.5, 0.5, 0.45], [0.3, 0.25, 0.28]).unwrap());
        let strata = Strata::new(vec![solid]);
        let domain = [[0.0; 3], [1.0; 3]];
        let stuffed = stuff(&strata, domain, &Settings::new(SIZE), &mut |_| ControlFlow::Continue(())).unwrap();
        stuffed.tets.into_mesh().unwrap()
    })
}

fn is_same(a: &SimplexMesh<3, 4>, b: &SimplexMesh<3, 4>) -> bool {
    a.cells().map(|c| (c, a.cell(c), a.region(c))).eq(b.cells().map(|c| (c, b.cell(c), b.region(c))))
        && a.points() == b.points()
}

/// The area of each face of the cube that boundary facets lie in, in all.
fn faces(mesh: &SimplexMesh<3, 4>) -> [f64; 6] {
    let mut areas = [0.0; 6];
    for (c, facet) in mesh.boundary_facets() {
        let corners = mesh.corners(c);
        let within = |side: usize| {
            let wall = (side % 2) as f64;
            (0..4).filter(|&i| i != facet).all(|i| (corners[i][side / 2] - wall).abs() < 1e-12)
        };
        let side = (0..6).find(|&side| within(side)).expect("a facet in a face of the cube");
        areas[side] += geometry::facet_measure(&corners, facet);
    }
    areas
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(60) })]
    #[test]
    fn paths_through_two_regions_leave_good_angles_and_no_trace(kind in 0..3_usize, seed: u64, part in 0.05..0.4) {
        let start = body();
        let kind = [PathKind::Straight, PathKind::Curved, PathKind::Random][kind];
        let path = path(kind, [0.0; 3], [1.0; 3], SIZE, seed);
        // As many steps as the tip needs for an edge, and twenty at least, are shallow.
        let shallow_steps = 21.max((1.0 / part) as usize);
        let settings = CycleSettings { step: part * SIZE, measure_angles: true, shallow_steps };
        let (mut mesh, mut remesher) = (start.clone(), Remesher::new());
        let report = drive(&mut mesh, &mut remesher, &path, &settings, |step, mesh, _, _, _| {
            if step.step % 16 == 0 {
                for area in faces(mesh) {
                    assert!((area - 1.0).abs() < 1e-10, "a face has area {area}");
                }
            }
        }).unwrap();
        prop_assert!(report.most_nodes > 2);
        let (min, max) = (report.min_angle_deg, report.max_angle_deg);
        prop_assert!(min >= 10.3 && max <= 160.0, "{:?}: angles {} to {}", kind, min, max);
        prop_assert!(report.topology_restored && is_same(&mesh, start));
    }
}

/// A needle between the nodes of which others slide, and neighbours on the skin, keeps its entry and its tip.
#[test]
fn entry_and_tip_stay_where_they_are_put() {
    let (mut mesh, mut remesher) = (body().clone(), Remesher::new());
    let needle = remesher.add_needle(&mesh, [0.47, 0.52, 1.1]).unwrap();
    let mut entry = None;
    for i in 1..=40 {
        let tip = [0.47 + 1e-3 * f64::from(i), 0.52, 1.0 - 0.02 * f64::from(i) + 1e-4];
        let report = remesher.advance(&mut mesh, needle, tip, Motion::Penetrating, &mut MeshChange::default()).unwrap();
        if report.outcome != Outcome::Inside {
            continue;
        }
        let nodes: Vec<_> = remesher.nodes(needle).collect();
        let first = *entry.get_or_insert((nodes[0], mesh.point(nodes[0])));
        assert_eq!(first, (nodes[0], mesh.point(nodes[0])));
        assert!((mesh.point(nodes[0])[2] - 1.0).abs() < 1e-12);
        assert_eq!(mesh.point(nodes[nodes.len() - 1]), tip);
        // From the skin to the tip, one after the other.
        assert!(nodes.windows(2).all(|e| mesh.point(e[0])[2] > mesh.point(e[1])[2]));
    }
    assert!(entry.is_some() && remesher.nodes(needle).len() > 3);
}
