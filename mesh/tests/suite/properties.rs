//! Properties of bisection, refinement and location, in two, three and four dimensions.

use crate::support::{Random, assert_net, depth, marks, star_by_scan, start_mesh};
use proptest::prelude::*;
use stylet_mesh::{BisectError, CellId, MeshChange, SimplexMesh, VertexId, generate::kuhn_box, geometry};

/// Random marks in three rounds: each leaves a valid mesh, a true change, true stars and the whole volume.
fn random_marks<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let (start, mut random) = (mesh.clone(), Random::new(!seed));
    let mut total = MeshChange::default();
    for _ in 0..3 {
        let (before, marked) = (mesh.clone(), marks(&mesh, 6, &mut random));
        let mut change = MeshChange::default();
        mesh.bisect(&marked, &mut change).unwrap();
        mesh.clone_from(&before);
        mesh.bisect(&marked, &mut total).unwrap();
        mesh.check_invariants().unwrap();
        assert_net(&before, &mesh, &change);
        assert!(marked.iter().all(|&c| !mesh.is_live(c)));
    }
    assert_net(&start, &mesh, &total);
    assert!((mesh.total_volume() - 1.0).abs() <= 1e-12);
    let mut star = Vec::new();
    for v in (0..mesh.n_vertices()).step_by(3).map(VertexId::new) {
        mesh.star(v, &mut star);
        assert_eq!(star, star_by_scan(&mesh, v));
    }
    for c in mesh.cells() {
        assert!(geometry::signed_measure(&mesh.oriented(c).map(|v| mesh.point(v))) > 0.0);
    }
}

/// Points at random, at vertices, on edges and facets, and outside: location finds a cell that contains them, the same
/// as a descent by coordinates would, and whatever else contains them does so by touching only.
fn location<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    for _ in 0..4 {
        let marked = marks(&mesh, 6, &mut random);
        mesh.bisect(&marked, &mut MeshChange::default()).unwrap();
    }
    let cells: Vec<CellId> = mesh.cells().collect();
    for round in 0..30 {
        let p = match round % 3 {
            0 => random.point::<D>(),
            // The middle of some face of some cell: of a vertex, an edge, ..., up to a facet.
            _ => {
                let corners = mesh.corners(cells[random.below(cells.len())]);
                let n = 1 + random.below(N - 1);
                std::array::from_fn(|k| corners[..n].iter().map(|x| x[k]).sum::<f64>() / n as f64)
            }
        };
        let found = mesh.locate(p).unwrap();
        assert!(mesh.is_live(found.cell));
        assert!(found.barycentric.iter().all(|l| (0.0..=1.0 + 1e-12).contains(l)));
        let q = geometry::combine(&mesh.corners(found.cell), &found.barycentric);
        assert!(geometry::distance2(&p, &q).sqrt() < 1e-12);
        let containing: Vec<CellId> = cells.iter().copied().filter(|&c| depth(&mesh, c, &p) > -1e-10).collect();
        assert!(containing.contains(&found.cell));
        if containing.iter().any(|&c| depth(&mesh, c, &p) > 1e-10) {
            assert_eq!(containing, [found.cell], "an inner point has one cell");
        }
    }
    let outside = std::array::from_fn(|k| if k == 0 { 1.0 + 1e-6 } else { 0.5 });
    assert!(mesh.locate(outside).is_none());
}

/// Refinement around a point and along a segment: what touches is small, what is small enough stays as it is.
fn refinement<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let vertex = mesh.point(VertexId::new(random.below(mesh.n_vertices())));
    let size = [0.1, 0.15, 0.4][D - 2];
    let (a, b) = (random.point::<D>(), random.point::<D>());
    for (a, b) in [(a, a), (vertex, vertex), (a, b), (vertex, b)] {
        let mut change = MeshChange::default();
        let before = mesh.clone();
        let refine = |mesh: &mut SimplexMesh<D, N>, change: &mut MeshChange| {
            if a == b { mesh.refine_around(a, size, change) } else { mesh.refine_along(a, b, size, change) }
        };
        refine(&mut mesh, &mut change).unwrap();
        assert_net(&before, &mesh, &change);
        change.clear();
        refine(&mut mesh, &mut change).unwrap();
        assert!(change.is_empty(), "refinement is idempotent");
        for t in 0..=64 {
            let t = f64::from(t) / 64.0;
            let p = std::array::from_fn(|k| (1.0 - t) * a[k] + t * b[k]);
            for c in mesh.cells().filter(|&c| mesh.longest_edge(c) > size * (1.0 + 1e-9)) {
                assert!(depth(&mesh, c, &p) < 0.0, "a large cell touches the feature");
            }
        }
    }
    mesh.check_invariants().unwrap();
    let mut change = MeshChange::default();
    mesh.refine_everywhere(2.0 * size, &mut change).unwrap();
    assert!(mesh.cells().all(|c| mesh.longest_edge(c) <= 2.0 * size * (1.0 + 1e-9)));
    mesh.check_invariants().unwrap();
}

/// A mesh read back has the same cells and goes on with the same bits.
fn state<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let mut first = MeshChange::default();
    mesh.bisect(&marks(&mesh, 9, &mut random), &mut first).unwrap();
    // Not JSON, whose readers may be an ulp off.
    let bytes = postcard::to_allocvec(&mesh).unwrap();
    let mut back: SimplexMesh<D, N> = postcard::from_bytes(&bytes).unwrap();
    back.check_invariants().unwrap();
    let (mut ours, mut theirs) = (MeshChange::default(), MeshChange::default());
    let marked = marks(&mesh, 9, &mut random);
    mesh.bisect(&marked, &mut ours).unwrap();
    back.bisect(&marked, &mut theirs).unwrap();
    assert_eq!(ours, theirs);
    assert_eq!(mesh.points(), back.points());
    for c in (0..mesh.n_slots()).map(CellId::new) {
        assert_eq!((mesh.cell(c), mesh.region(c), mesh.level(c)), (back.cell(c), back.region(c), back.level(c)));
        assert_eq!((mesh.orientation(c), mesh.is_live(c)), (back.orientation(c), back.is_live(c)));
        assert!((0..N).all(|facet| mesh.neighbor(c, facet) == back.neighbor(c, facet)));
    }
    assert!((0..mesh.n_vertices()).map(VertexId::new).all(|v| mesh.generation(v) == back.generation(v)));
}

/// Moved vertices: the mesh stays valid, and location, refinement and the state follow.
fn moves<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let mut change = MeshChange::default();
    for _ in 0..3 {
        mesh.bisect(&marks(&mesh, 4, &mut random), &mut change).unwrap();
        for _ in 0..6 {
            let v = VertexId::new(random.below(mesh.n_vertices()));
            let aim: [f64; D] = random.point();
            let (p, before) = (mesh.point(v), mesh.points().to_vec());
            let point = std::array::from_fn(|k| p[k] + 0.1 * (aim[k] - 0.5));
            if mesh.move_vertex(v, point, 0.3).is_err() {
                assert_eq!(mesh.points(), before, "a move that is refused changes nothing");
            }
        }
    }
    mesh.check_invariants().unwrap();
    let cells: Vec<CellId> = mesh.cells().collect();
    for _ in 0..20 {
        let cell = cells[random.below(cells.len())];
        let weights: [f64; N] = std::array::from_fn(|_| 0.1 + random.unit());
        let p = geometry::combine(&mesh.corners(cell), &weights.map(|w| w / weights.iter().sum::<f64>()));
        assert_eq!(mesh.locate(p).map(|found| found.cell), cells.iter().copied().find(|&c| depth(&mesh, c, &p) >= 0.0));
    }

    let bytes = postcard::to_allocvec(&mesh).unwrap();
    let mut back: SimplexMesh<D, N> = postcard::from_bytes(&bytes).unwrap();
    let (a, b, size) = (random.point::<D>(), random.point::<D>(), [0.1, 0.2, 0.5][D - 2]);
    change.clear();
    mesh.refine_along(a, b, size, &mut change).unwrap();
    let mut theirs = MeshChange::default();
    back.refine_along(a, b, size, &mut theirs).unwrap();
    assert_eq!((&change, mesh.points()), (&theirs, back.points()));
    mesh.check_invariants().unwrap();
    change.clear();
    mesh.refine_along(a, b, size, &mut change).unwrap();
    assert!(change.is_empty(), "refinement is idempotent");
    for t in 0..=64 {
        let t = f64::from(t) / 64.0;
        let p = std::array::from_fn(|k| (1.0 - t) * a[k] + t * b[k]);
        for c in mesh.cells().filter(|&c| mesh.longest_edge(c) > size * (1.0 + 1e-9)) {
            assert!(depth(&mesh, c, &p) < 0.0, "a large cell touches the feature");
        }
    }
}

in_each_dimension! {
    kinds 0..3_u8, 0..3_u8;
    random_marks, 100, 60, 12;
    location, 60, 40, 12;
    refinement, 40, 20, 6;
    state, 40, 30, 8;
    moves, 60, 40, 10;
}

proptest! {
    /// Whatever is given as a mesh comes back as a valid mesh or as an error.
    #[test]
    fn no_input_panics(
        points in prop::collection::vec(prop::array::uniform2(prop_oneof![
            4 => (0..4_i32).prop_map(f64::from),
            1 => Just(f64::NAN), 1 => Just(1e200), 1 => Just(-1e-200),
        ]), 0..8),
        cells in prop::collection::vec(prop::array::uniform3(0..8_u32), 0..6),
    ) {
        if let Ok(mut mesh) = SimplexMesh::<2, 3>::new(points, cells) {
            mesh.check_invariants().unwrap();
            let marked: Vec<CellId> = mesh.cells().collect();
            mesh.bisect(&marked, &mut MeshChange::default()).unwrap();
            mesh.check_invariants().unwrap();
        }
    }

    /// Damaged state files are refused or yield a valid mesh.
    #[test]
    fn no_state_panics(seed: u64, position in 0.0..1.0, digit in b'0'..b':') {
        let mut mesh = start_mesh::<2, 3>(1, seed);
        mesh.refine_around([0.3, 0.4], 0.2, &mut MeshChange::default()).unwrap();
        let mut text = serde_json::to_string(&mesh).unwrap().into_bytes();
        let digits: Vec<usize> = (0..text.len()).filter(|&i| text[i].is_ascii_digit()).collect();
        text[digits[(position * digits.len() as f64) as usize]] = digit;
        if let Ok(mesh) = serde_json::from_slice::<SimplexMesh<2, 3>>(&text) {
            mesh.check_invariants().unwrap();
        }
    }
}

#[test]
fn marks_on_dead_cells_do_nothing_and_unknown_ones_are_errors() {
    let mut mesh = start_mesh::<2, 3>(0, 0);
    let mut change = MeshChange::default();
    mesh.bisect(&[CellId(0), CellId(0)], &mut change).unwrap();
    let n_cells = mesh.n_cells();
    change.clear();
    mesh.bisect(&[CellId(0)], &mut change).unwrap();
    assert!(change.is_empty() && mesh.n_cells() == n_cells);
    let outcome = mesh.bisect(&[CellId(1), CellId(1_000)], &mut change);
    assert_eq!(outcome, Err(BisectError::UnknownCell { cell: 1_000, n_slots: mesh.n_slots() }));
    assert!(change.is_empty());
}

#[test]
fn a_limit_stops_refinement_with_a_valid_mesh_and_a_true_change() {
    let mut mesh = start_mesh::<3, 4>(2, 7);
    mesh.set_slot_limit(mesh.n_slots() + 500);
    let (before, mut change) = (mesh.clone(), MeshChange::default());
    let outcome = mesh.refine_around([0.3, 0.4, 0.5], 1e-3, &mut change);
    assert!(matches!(outcome, Err(BisectError::SlotLimit { .. })), "{outcome:?}");
    assert!(!change.is_empty() && mesh.n_slots() <= mesh.slot_limit());
    mesh.check_invariants().unwrap();
    assert_net(&before, &mesh, &change);
}

#[test]
fn a_point_between_two_halves_belongs_to_the_end_with_the_smaller_id() {
    let mut mesh = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [1; 2]).unwrap();
    mesh.bisect(&[CellId(0)], &mut MeshChange::default()).unwrap();
    // The diagonal from vertex 0 to vertex 3 was halved. Dyadic points, for which the tie is exact.
    for p in [[0.75, 0.25], [0.875, 0.125], [0.25, 0.75]] {
        let owner = mesh.locate(p).unwrap().cell;
        assert!(mesh.cell(owner).contains(&VertexId(0)), "{p:?} is in {owner:?}");
    }
}
