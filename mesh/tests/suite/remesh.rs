//! Needles in meshes: whatever the path, the mesh stays valid and comes back as it was.

use crate::support::{Random, start_mesh};
use proptest::prelude::*;
use stylet_mesh::{
    BisectError, MeshChange, SimplexMesh, VertexId,
    generate::kuhn_box,
    geometry,
    remesh::{
        CycleSettings, Motion, NeedleId, Outcome, RemeshError, Remesher, drive,
        paths::{PathKind, path},
    },
};

/// What must hold while needles are in a mesh of the unit cube; `start` is the mesh without them.
fn check<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    start: &SimplexMesh<D, N>,
    remesher: &Remesher<D, N>,
    needles: &[NeedleId],
) {
    // All cells positive, and together as large as before.
    let mut volume = 0.0;
    let mut facets = std::collections::BTreeMap::new();
    let mut edges = std::collections::BTreeSet::new();
    for c in mesh.cells() {
        let corners = mesh.oriented(c).map(|v| mesh.point(v));
        let measure = geometry::signed_measure(&corners);
        assert!(measure > 0.0, "{c:?} has volume {measure:e}");
        volume += measure;
        let v = mesh.cell(c);
        for i in 0..N {
            let mut facet: Vec<VertexId> = (0..N).filter(|&j| j != i).map(|j| v[j]).collect();
            facet.sort_unstable();
            facets.entry(facet).or_insert_with(Vec::new).push((c, mesh.neighbor(c, i)));
            (0..i).for_each(|j| {
                edges.insert((v[i].min(v[j]), v[i].max(v[j])));
            });
        }
    }
    assert!((volume - start.total_volume()).abs() <= 1e-12, "volume {volume}");
    // Neighbours are those that share a facet.
    let mut skin = 0.0;
    for (facet, sides) in &facets {
        match sides[..] {
            [(c, None)] => {
                let v = mesh.cell(c);
                let local = (0..N).find(|&i| !facet.contains(&v[i])).unwrap();
                skin += geometry::facet_measure(&mesh.corners(c), local);
            }
            [(a, Some(b)), (c, Some(d))] => assert!(a == d && b == c, "{a:?} and {c:?} disagree"),
            _ => panic!("facet {facet:?} has sides {sides:?}"),
        }
    }
    assert!((skin - 2.0 * D as f64).abs() <= 1e-10, "the boundary measures {skin}");
    for v in (0..mesh.n_vertices()).map(VertexId::new) {
        let mut star = Vec::new();
        if edges.iter().any(|e| e.0 == v) {
            mesh.star(v, &mut star);
            assert!(star.iter().all(|&c| mesh.is_live(c) && mesh.cell(c).contains(&v)));
        }
    }
    // Needles run along edges and end at their tips.
    for &needle in needles {
        let nodes: Vec<VertexId> = remesher.nodes(needle).collect();
        for e in nodes.windows(2) {
            assert!(edges.contains(&(e[0].min(e[1]), e[0].max(e[1]))), "{e:?} is no edge");
        }
    }
}

fn at_tip<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    remesher: &Remesher<D, N>,
    needle: NeedleId,
) -> bool {
    let (last, tip) = (remesher.nodes(needle).last(), remesher.tip(needle).unwrap());
    last.is_some_and(|v| geometry::distance2(&mesh.point(v), &tip).sqrt() <= 1e-6)
}

/// The same cells by identifier and vertices, the same positions bit for bit.
fn is_same<const D: usize, const N: usize>(a: &SimplexMesh<D, N>, b: &SimplexMesh<D, N>) -> bool {
    a.cells().map(|c| (c, a.cell(c))).eq(b.cells().map(|c| (c, b.cell(c)))) && a.points() == b.points()
}

/// A field linear in the position, carried by the change, stays what it is; the live cells are those the change tells.
fn carry<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    field: &mut Vec<f64>,
    live: &mut std::collections::BTreeMap<stylet_mesh::CellId, ([VertexId; N], [[f64; D]; N])>,
    change: &MeshChange,
) {
    change.carry_field::<D>(field);
    for c in mesh.cells() {
        for v in mesh.cell(c) {
            let (p, q) = (mesh.point(v), &field[v.index() * D..][..D]);
            assert!((0..D).all(|k| (p[k] - q[k]).abs() < 1e-11), "vertex {v:?}: {p:?} was carried to {q:?}");
        }
    }
    for c in &change.died {
        assert!(live.remove(c).is_some(), "{c:?} died twice or was not alive");
    }
    for &c in &change.born {
        assert!(live.insert(c, (mesh.cell(c), mesh.corners(c))).is_none(), "{c:?} was born twice or was alive");
    }
    assert!(live.iter().map(|(&c, &x)| (c, x)).eq(mesh.cells().map(|c| (c, (mesh.cell(c), mesh.corners(c))))));
    assert!(change.died.is_sorted() && change.born.is_sorted() && change.removed.is_sorted());
}

fn live_cells<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
) -> std::collections::BTreeMap<stylet_mesh::CellId, ([VertexId; N], [[f64; D]; N])> {
    mesh.cells().map(|c| (c, (mesh.cell(c), mesh.corners(c)))).collect()
}

/// A random walk of the tip in a random mesh, in and out, with steps of any size; errors are allowed where the path is
/// impossible, an invalid mesh never.
fn wandering<const D: usize, const N: usize>(kind: u8, seed: u64, bisected: bool) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let mut tip = random.point::<D>();
    if bisected {
        let size = if D == 2 { 0.1 } else { 0.3 };
        mesh.refine_along(tip, random.point(), size, &mut MeshChange::default()).unwrap();
    }
    let start = mesh.clone();
    tip[D - 1] = 1.2;
    let mut remesher = Remesher::new();
    let needle = remesher.add_needle(&mesh, tip).unwrap();
    let mut field = mesh.points().as_flattened().to_vec();
    let mut live = live_cells(&mesh);
    let mut tips = vec![tip];
    let mut direction: [f64; D] = std::array::from_fn(|k| if k == D - 1 { -1.0 } else { 0.0 });
    let mut change = MeshChange::default();
    let motions = [Motion::Penetrating; 14].into_iter().chain([Motion::Retracting; 40]);
    for motion in motions {
        change.clear();
        let target = match motion {
            Motion::Penetrating => {
                let step = 0.15 * random.unit();
                direction = std::array::from_fn(|k| direction[k] + 0.5 * (random.unit() - 0.5));
                std::array::from_fn(|k| tip[k] + step * direction[k])
            }
            Motion::Retracting => match tips.pop() {
                Some(target) => target,
                None => break,
            },
        };
        let done = remesher.advance(&mut mesh, needle, target, motion, &mut change);
        check(&mesh, &start, &remesher, &[needle]);
        carry(&mesh, &mut field, &mut live, &change);
        match done {
            Ok(report) => {
                assert!(report.outcome != Outcome::Inside || at_tip(&mesh, &remesher, needle));
                if motion == Motion::Penetrating {
                    tips.push(tip);
                    tip = target;
                }
            }
            Err(error) => {
                assert!(matches!(error, RemeshError::NoCandidate { .. } | RemeshError::SecondEntry { .. }), "{error}");
                break;
            }
        }
    }
    change.clear();
    remesher.withdraw(&mut mesh, needle, &mut change).unwrap();
    carry(&mesh, &mut field, &mut live, &change);
    assert!(is_same(&mesh, &start));
    mesh.check_invariants().unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn wandering_in_2d(kind in 0..3_u8, seed: u64, bisected: bool) { wandering::<2, 3>(kind, seed, bisected); }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn wandering_in_3d(kind in 0..3_u8, seed: u64, bisected: bool) { wandering::<3, 4>(kind, seed, bisected); }
}

/// In and out, step after step valid, and the same mesh afterwards without a slot more.
fn cycles<const D: usize, const N: usize>(parts: usize, n: u64) {
    let mut mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], [parts; D]).unwrap();
    let start = mesh.clone();
    let edge = 1.28 / parts as f64;
    let settings = CycleSettings { step: 0.2 * edge, measure_angles: true, shallow_steps: 21 };
    let mut remesher = Remesher::new();
    for kind in [PathKind::Straight, PathKind::Curved, PathKind::Random] {
        for seed in 0..n {
            let path = path(kind, [0.0; D], [1.0; D], edge, seed);
            let mut sampled = false;
            let report = drive(&mut mesh, &mut remesher, &path, &settings, |step, mesh, remesher, needle, _| {
                let inside = step.report.outcome == Outcome::Inside;
                assert!(!inside || at_tip(mesh, remesher, needle));
                if step.step % 32 == 0 {
                    check(mesh, &start, remesher, &[needle]);
                    sampled = true;
                }
            });
            let report = report.unwrap_or_else(|error| panic!("{kind:?} {seed}: {error}"));
            assert!(sampled && report.most_nodes > 3);
            assert!(report.topology_restored && report.max_position_error <= 1e-12);
            assert!(
                is_same(&mesh, &start) && mesh.n_slots() == start.n_slots() && mesh.n_vertices() == start.n_vertices()
            );
            if kind != PathKind::Random && parts == 13 {
                let (min, max) = (report.min_angle_deg, report.max_angle_deg);
                assert!(min >= 10.3 && max <= 160.0, "{kind:?} {seed}: angles {min:.2} to {max:.2}");
            }
        }
    }
    mesh.check_invariants().unwrap();
}

#[test]
fn a_hundred_cycles_leave_no_trace() {
    cycles::<3, 4>(7, 17);
    cycles::<3, 4>(13, 7);
    cycles::<2, 3>(13, 10);
}

#[test]
fn special_paths_have_defined_outcomes() {
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [4; 3]).unwrap();
    let cases: [(&str, [f64; 3], [f64; 3]); 7] = [
        ("through vertices", [0.5, 0.5, 1.5], [0.5, 0.5, 0.25]),
        ("along a face", [0.5, 0.3, 1.5], [0.5, 0.3, 0.2]),
        ("along a diagonal", [0.9, 0.9, 1.1], [0.2, 0.2, 0.4]),
        ("along a space diagonal", [1.25, 1.25, 1.25], [0.1, 0.1, 0.1]),
        ("inside cells", [0.37, 0.61, 1.2], [0.41, 0.55, 0.15]),
        ("through an edge of the box", [1.2, 0.4, 1.2], [0.3, 0.45, 0.31]),
        ("through vertices of the skin only", [0.25, 0.25, 1.2], [0.31, 0.27, 0.4]),
    ];
    for (what, from, to) in cases {
        for step in [0.02, 0.06, 0.21] {
            let mut mesh = start.clone();
            let settings = CycleSettings { step, measure_angles: false, shallow_steps: 0 };
            let outcome =
                drive(&mut mesh, &mut Remesher::new(), &[from, to], &settings, |_, mesh, remesher, needle, _| {
                    check(mesh, &start, remesher, &[needle]);
                });
            let report = outcome.unwrap_or_else(|error| panic!("{what}, step {step}: {error}"));
            assert!(report.topology_restored && report.most_nodes > 1, "{what}");
            assert!(is_same(&mesh, &start), "{what}");
        }
    }
}

#[test]
fn a_path_outside_or_along_the_skin_does_nothing() {
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [3; 3]).unwrap();
    for (a, b) in
        [([0.1, 0.2, 1.5], [0.9, 0.8, 1.1]), ([0.1, 0.4, 1.0], [1.5, 0.6, 1.0]), ([0.3, 1.2, 0.8], [0.3, 0.8, 1.2])]
    {
        let (mut mesh, mut remesher, mut change) = (start.clone(), Remesher::new(), MeshChange::default());
        let needle = remesher.add_needle(&mesh, a).unwrap();
        for t in 1..=20 {
            let t = f64::from(t) / 20.0;
            let tip = geometry::combine(&[a, b], &[1.0 - t, t]);
            let report = remesher.advance(&mut mesh, needle, tip, Motion::Penetrating, &mut change).unwrap();
            assert_eq!(report.outcome, Outcome::Outside);
        }
        assert!(change.is_empty() && is_same(&mesh, &start));
    }
}

#[test]
fn out_through_the_back_and_back_again() {
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [3; 3]).unwrap();
    let (mut mesh, mut remesher, mut change) = (start.clone(), Remesher::new(), MeshChange::default());
    let needle = remesher.add_needle(&mesh, [0.4, 0.45, 1.3]).unwrap();
    let mut go = |mesh: &mut SimplexMesh<3, 4>, tip, motion| {
        let report = remesher.advance(mesh, needle, tip, motion, &mut change);
        check(mesh, &start, &remesher, &[needle]);
        report.map(|report| report.outcome)
    };
    assert_eq!(go(&mut mesh, [0.4, 0.5, -0.2], Motion::Penetrating), Ok(Outcome::Beyond));
    assert_eq!(go(&mut mesh, [0.4, 0.5, -0.4], Motion::Penetrating), Ok(Outcome::Beyond));
    let again = go(&mut mesh, [0.6, 0.5, 0.2], Motion::Penetrating);
    assert_eq!(again, Err(RemeshError::SecondEntry { needle: 0 }));
    assert_eq!(go(&mut mesh, [0.4, 0.5, -0.1], Motion::Retracting), Ok(Outcome::Beyond));
    assert_eq!(go(&mut mesh, [0.4, 0.49, 0.3], Motion::Retracting), Ok(Outcome::Inside));
    assert_eq!(go(&mut mesh, [0.4, 0.47, 0.1], Motion::Penetrating), Ok(Outcome::Inside));
    assert_eq!(go(&mut mesh, [0.4, 0.45, 1.3], Motion::Retracting), Ok(Outcome::Outside));
    assert!(is_same(&mesh, &start));
}

#[test]
fn bad_input_is_an_error() {
    let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [2; 3]).unwrap();
    let (mut remesher, mut change) = (Remesher::new(), MeshChange::default());
    for bad in [f64::NAN, f64::INFINITY, 1e308] {
        assert!(matches!(remesher.add_needle(&mesh, [0.5, bad, 2.0]), Err(RemeshError::Tip { axis: 1, .. })));
    }
    assert!(matches!(remesher.add_needle(&mesh, [0.4; 3]), Err(RemeshError::StartsInside { .. })));
    let needle = remesher.add_needle(&mesh, [0.5, 0.5, 2.0]).unwrap();
    let outcome = remesher.advance(&mut mesh, needle, [0.5, f64::NAN, 0.0], Motion::Penetrating, &mut change);
    assert!(matches!(outcome, Err(RemeshError::Tip { axis: 1, .. })));
    let outcome = remesher.advance(&mut mesh, NeedleId(7), [0.5; 3], Motion::Penetrating, &mut change);
    assert_eq!(outcome, Err(RemeshError::UnknownNeedle { needle: 7, n_needles: 1 }));
    let outcome = remesher.advance(&mut mesh, needle, [0.5; 3], Motion::Retracting, &mut change);
    assert_eq!(outcome, Err(RemeshError::NotInserted { needle: 0 }));
    mesh.set_slot_limit(mesh.n_slots() + 3);
    let outcome = push(&mut mesh, &mut remesher, needle, ([0.5, 0.5, 2.0], [0.3, 0.37, 0.1]), Motion::Penetrating);
    assert!(matches!(outcome, Err(RemeshError::SlotLimit { .. })), "{outcome:?}");
    remesher.withdraw(&mut mesh, needle, &mut change).unwrap();
    mesh.check_invariants().unwrap();
    for step in [0.0, -1.0, f64::NAN, 1e-300] {
        let settings = CycleSettings { step, measure_angles: false, shallow_steps: 0 };
        assert!(
            drive(&mut mesh, &mut Remesher::new(), &[[0.5, 0.5, 2.0], [0.5; 3]], &settings, |_, _, _, _, _| {})
                .is_err()
        );
    }
}

/// Drives a needle along a segment in one direction.
fn push<const D: usize, const N: usize>(
    mesh: &mut SimplexMesh<D, N>,
    remesher: &mut Remesher<D, N>,
    needle: NeedleId,
    (a, b): ([f64; D], [f64; D]),
    motion: Motion,
) -> Result<(), RemeshError> {
    for t in 1..=40 {
        let t = f64::from(t) / 40.0;
        let t = if motion == Motion::Penetrating { t } else { 1.0 - t };
        let tip = geometry::combine(&[a, b], &[1.0 - t, t]);
        remesher.advance(mesh, needle, tip, motion, &mut MeshChange::default())?;
    }
    Ok(())
}

#[test]
fn two_needles_apart_come_out_in_any_order() {
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [7; 3]).unwrap();
    let ways = [([0.23, 0.25, 1.1], [0.2, 0.27, 0.3]), ([0.77, 0.71, 1.1], [0.8, 0.73, 0.3])];
    for order in [[0, 1], [1, 0]] {
        let (mut mesh, mut remesher) = (start.clone(), Remesher::new());
        let needles = ways.map(|way| remesher.add_needle(&mesh, way.0).unwrap());
        for k in 0..2 {
            push(&mut mesh, &mut remesher, needles[k], ways[k], Motion::Penetrating).unwrap();
            check(&mesh, &start, &remesher, &needles);
        }
        for k in order {
            push(&mut mesh, &mut remesher, needles[k], ways[k], Motion::Retracting).unwrap();
            check(&mesh, &start, &remesher, &needles);
        }
        assert!(is_same(&mesh, &start));
        mesh.check_invariants().unwrap();
    }
}

#[test]
fn needles_side_by_side_come_out_in_reverse_order() {
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [4; 3]).unwrap();
    let mut random = Random::new(3);
    let mut n_shared = 0;
    for case in 0..8 {
        let mut near = |z: f64| [0.5 + 0.1 * random.unit(), 0.5 + 0.1 * random.unit(), z];
        let ways = [(near(1.1), near(0.3)), (near(1.1), near(0.3))];
        let (mut mesh, mut remesher) = (start.clone(), Remesher::new());
        let needles = ways.map(|way| remesher.add_needle(&mesh, way.0).unwrap());
        push(&mut mesh, &mut remesher, needles[0], ways[0], Motion::Penetrating).unwrap();
        let with_one = mesh.clone();
        if push(&mut mesh, &mut remesher, needles[1], ways[1], Motion::Penetrating).is_err() {
            continue; // one crosses the other
        }
        check(&mesh, &start, &remesher, &needles);

        // If the first is held by the second, it cannot come out, and nothing happens.
        let (both, mut trial) = (mesh.clone(), remesher.clone());
        match trial.withdraw(&mut mesh, needles[0], &mut MeshChange::default()) {
            Ok(_) => check(&mesh, &start, &trial, &needles),
            Err(error) => {
                assert!(matches!(error, RemeshError::SharedElement { needle: 0, other: 1, .. }), "{error}");
                assert!(is_same(&mesh, &both), "case {case}");
                n_shared += 1;
            }
        }
        mesh = both;
        if push(&mut mesh, &mut remesher, needles[1], ways[1], Motion::Retracting).is_err() {
            remesher.withdraw(&mut mesh, needles[1], &mut MeshChange::default()).unwrap();
        }
        assert!(mesh.cells().map(|c| mesh.cell(c)).eq(with_one.cells().map(|c| with_one.cell(c))));
        push(&mut mesh, &mut remesher, needles[0], ways[0], Motion::Retracting).unwrap();
        assert!(is_same(&mesh, &start), "case {case}");
        mesh.check_invariants().unwrap();
    }
    assert!(n_shared > 0);
}

#[test]
fn bisection_goes_on_beside_a_needle() {
    let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [8; 3]).unwrap();
    mesh.refine_around([0.5, 0.5, 0.9], 0.1, &mut MeshChange::default()).unwrap();
    let mut remesher = Remesher::new();
    let way = ([0.53, 0.55, 1.1], [0.5, 0.47, 0.5]);
    let needle = remesher.add_needle(&mesh, way.0).unwrap();
    let mut reference = mesh.clone();
    push(&mut mesh, &mut remesher, needle, way, Motion::Penetrating).unwrap();

    let outcome = mesh.refine_around([0.51, 0.5, 0.7], 0.01, &mut MeshChange::default());
    assert!(matches!(outcome, Err(BisectError::Remeshed { .. })), "{outcome:?}");
    let (n_cells, corner) = (mesh.n_cells(), [0.05, 0.06, 0.07]);
    mesh.refine_around(corner, 0.1, &mut MeshChange::default()).unwrap();
    assert!(mesh.n_cells() > n_cells);
    // Every point is found, whoever has its cell.
    let mut random = Random::new(1);
    for _ in 0..200 {
        let found = mesh.locate(random.point()).unwrap();
        assert!(mesh.is_live(found.cell));
    }

    push(&mut mesh, &mut remesher, needle, way, Motion::Retracting).unwrap();
    assert!((mesh.total_volume() - 1.0).abs() < 1e-12);
    // With the needle gone, all can be bisected.
    for mesh in [&mut mesh, &mut reference] {
        mesh.refine_around(corner, 0.1, &mut MeshChange::default()).unwrap();
        mesh.refine_around([0.51, 0.5, 0.7], 0.05, &mut MeshChange::default()).unwrap();
    }
    let shapes = |mesh: &SimplexMesh<3, 4>| {
        let bits = |c| mesh.corners(c).map(|p| p.map(f64::to_bits));
        mesh.cells().map(bits).collect::<std::collections::BTreeSet<_>>()
    };
    assert_eq!(shapes(&mesh).len(), mesh.n_cells());
}

#[test]
fn a_path_in_the_plane_of_the_skin_runs_along_the_skin() {
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [3; 3]).unwrap();
    let (mut mesh, mut remesher) = (start.clone(), Remesher::new());
    let way = ([-0.1, 0.4, 1.0], [0.8, 0.55, 1.0]);
    let needle = remesher.add_needle(&mesh, way.0).unwrap();
    push(&mut mesh, &mut remesher, needle, way, Motion::Penetrating).unwrap();
    check(&mesh, &start, &remesher, &[needle]);
    assert!(remesher.nodes(needle).all(|v| (mesh.point(v)[2] - 1.0).abs() < 1e-14));
    push(&mut mesh, &mut remesher, needle, way, Motion::Retracting).unwrap();
    assert!(is_same(&mesh, &start));
}

#[test]
fn needles_are_read_back() {
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [5; 3]).unwrap();
    let way = ([0.5, 0.4, 1.1], [0.55, 0.5, 0.3]);
    let (mut mesh, mut remesher) = (start.clone(), Remesher::new());
    let needle = remesher.add_needle(&mesh, way.0).unwrap();
    push(&mut mesh, &mut remesher, needle, way, Motion::Penetrating).unwrap();
    let bytes = postcard::to_allocvec(&remesher).unwrap();
    let mut back: Remesher<3, 4> = postcard::from_bytes(&bytes).unwrap();
    assert_eq!(postcard::to_allocvec(&back).unwrap(), bytes);

    // Both go on alike, and out.
    let mut copy = mesh.clone();
    push(&mut mesh, &mut remesher, needle, way, Motion::Retracting).unwrap();
    push(&mut copy, &mut back, needle, way, Motion::Retracting).unwrap();
    assert!(is_same(&mesh, &start) && is_same(&copy, &start));

    // Another mesh is not theirs; damaged data are refused or are needles.
    let mut back: Remesher<3, 4> = postcard::from_bytes(&bytes).unwrap();
    let outcome = back.advance(&mut mesh, needle, [0.5; 3], Motion::Retracting, &mut MeshChange::default());
    assert!(matches!(outcome, Err(RemeshError::OtherMesh { needle: 0, .. })), "{outcome:?}");
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x55;
        if let Ok(mut remesher) = postcard::from_bytes::<Remesher<3, 4>>(&damaged) {
            let _ =
                remesher.advance(&mut start.clone(), needle, [0.5; 3], Motion::Retracting, &mut MeshChange::default());
        }
    }
    assert!(postcard::from_bytes::<Remesher<2, 3>>(&bytes).is_err());
}

#[test]
fn the_same_path_gives_the_same_bits() {
    let run = || {
        let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [5; 3]).unwrap();
        let mut remesher = Remesher::new();
        let needle = remesher.add_needle(&mesh, [0.5, 0.4, 1.1]).unwrap();
        push(&mut mesh, &mut remesher, needle, ([0.5, 0.4, 1.1], [0.55, 0.5, 0.3]), Motion::Penetrating).unwrap();
        mesh
    };
    assert!(is_same(&run(), &run()));
}
