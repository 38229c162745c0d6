//! Coarsening: what was refined comes back, and the change log stays true.

use crate::support::{Random, assert_net, leaf_set, marks, start_mesh};
use proptest::prelude::*;
use stylet_mesh::{CellId, MeshChange, SimplexMesh, VertexId, generate::kuhn_box};

/// Refined in rounds of random marks, then coarsened: the start mesh, with the same ids, vertices, neighbours and bits.
fn round_trip<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let (start, mut random) = (mesh.clone(), Random::new(!seed));
    let mut total = MeshChange::default();
    for _ in 0..4 {
        mesh.bisect(&marks(&mesh, 5, &mut random), &mut total).unwrap();
    }
    let (refined, mut change) = (mesh.clone(), MeshChange::default());
    let removed = mesh.coarsen_everywhere(&mut change);
    assert_eq!(removed, refined.n_vertices() - start.n_vertices());
    assert_net(&refined, &mesh, &change);
    mesh.check_invariants().unwrap();
    assert_eq!((mesh.n_cells(), mesh.n_vertices()), (start.n_cells(), start.n_vertices()));
    assert!(mesh.cells().eq(start.cells()) && mesh.vertices().eq(start.vertices()));
    for c in start.cells() {
        assert_eq!((mesh.cell(c), mesh.orientation(c)), (start.cell(c), start.orientation(c)));
        assert!((0..N).all(|facet| mesh.neighbor(c, facet) == start.neighbor(c, facet)));
    }
    assert_eq!(mesh.points()[..start.points().len()], *start.points());
    // The two together are no change of cells.
    mesh.clone_from(&refined);
    mesh.coarsen_everywhere(&mut total);
    assert!(total.died.is_empty() && total.born.is_empty());
    // Slots and ids are reused, so that the same refinement takes no more room.
    let (slots, vertices) = (mesh.n_slots(), mesh.n_vertex_slots());
    mesh.refine_around(random.point(), 0.3, &mut MeshChange::default()).unwrap();
    mesh.coarsen_everywhere(&mut MeshChange::default());
    mesh.set_slot_limit(mesh.n_slots().max(slots));
    let mut again = Random::new(!seed);
    for _ in 0..4 {
        let marked: Vec<CellId> = mesh.cells().filter(|_| again.below(4) == 0).take(5).collect();
        if mesh.bisect(&marked, &mut MeshChange::default()).is_err() {
            break;
        }
    }
    assert!(mesh.n_slots() <= mesh.slot_limit() && mesh.n_vertex_slots() >= vertices);
    mesh.check_invariants().unwrap();
}

/// Refinement and coarsening by random marks in turn: a valid mesh and a true change at every step and over all of them.
fn mixtures<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let (start, mut random) = (mesh.clone(), Random::new(!seed));
    let mut total = MeshChange::default();
    let mut one = MeshChange::default();
    for round in 0..12 {
        let before = mesh.clone();
        one.clear();
        match random.below(4) {
            0 => {
                let marked: Vec<CellId> = mesh.cells().filter(|_| random.below(8) > 0).collect();
                mesh.coarsen(&marked, &mut one).unwrap();
                mesh.clone_from(&before);
                mesh.coarsen(&marked, &mut total).unwrap();
            }
            1 => {
                let threshold = random.unit();
                let keep = |mesh: &SimplexMesh<D, N>, c: CellId| mesh.corners(c)[0][0] < threshold;
                mesh.coarsen_unless(keep, &mut one);
                mesh.clone_from(&before);
                mesh.coarsen_unless(keep, &mut total);
            }
            _ => {
                let marked = marks(&mesh, 6, &mut random);
                mesh.bisect(&marked, &mut one).unwrap();
                mesh.clone_from(&before);
                mesh.bisect(&marked, &mut total).unwrap();
            }
        }
        assert_net(&before, &mesh, &one);
        assert_net(&start, &mesh, &total);
        if round % 4 == 3 {
            mesh.check_invariants().unwrap();
        }
    }
    // Two operations in one change, the second undoing part of the first, and the first part of what was before.
    let before = mesh.clone();
    one.clear();
    mesh.coarsen_unless(|mesh, c| mesh.corners(c)[0][0] < 0.5, &mut one);
    mesh.bisect(&marks(&mesh, 6, &mut random), &mut one).unwrap();
    mesh.coarsen_unless(|mesh, c| mesh.corners(c)[0][1 % D] < 0.5, &mut one);
    assert_net(&before, &mesh, &one);
    let bytes = postcard::to_allocvec(&mesh).unwrap();
    let mut back: SimplexMesh<D, N> = postcard::from_bytes(&bytes).unwrap();
    let marked = marks(&mesh, 6, &mut random);
    let (mut ours, mut theirs) = (MeshChange::default(), MeshChange::default());
    mesh.bisect(&marked, &mut ours).unwrap();
    back.bisect(&marked, &mut theirs).unwrap();
    mesh.coarsen(&ours.born.clone(), &mut ours).unwrap();
    back.coarsen(&theirs.born.clone(), &mut theirs).unwrap();
    assert_eq!((ours, mesh.points()), (theirs, back.points()));
}

/// What a predicate keeps stays, what it does not is the least refinement that holds it: the same set of leaves as if
/// nothing else had ever been refined.
fn predicate<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let size = [0.1, 0.2, 0.5][D - 2];
    let (p, q) = (random.point::<D>(), random.point::<D>());
    let mut direct = mesh.clone();
    direct.refine_around(q, size, &mut MeshChange::default()).unwrap();
    mesh.refine_around(p, size, &mut MeshChange::default()).unwrap();
    mesh.refine_around(q, size, &mut MeshChange::default()).unwrap();
    let before = mesh.clone();
    let mut change = MeshChange::default();
    mesh.coarsen_unless(
        |mesh, c| mesh.longest_edge(c) > size && crate::support::depth(mesh, c, &q) >= 0.0,
        &mut change,
    );
    assert_net(&before, &mesh, &change);
    mesh.check_invariants().unwrap();
    assert_eq!(leaf_set(&mesh), leaf_set(&direct));
}

/// Moved vertices and coarsening: a valid mesh throughout.
fn moves<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let mut change = MeshChange::default();
    for _ in 0..3 {
        mesh.bisect(&marks(&mesh, 6, &mut random), &mut change).unwrap();
        for _ in 0..8 {
            let v = VertexId::new(random.below(mesh.n_vertex_slots()));
            if mesh.is_vertex(v) {
                let (aim, p): ([f64; D], _) = (random.point(), mesh.point(v));
                let point = std::array::from_fn(|k| p[k] + 0.2 * (aim[k] - 0.5));
                let _ = mesh.move_vertex(v, point, 0.2);
            }
        }
        let marked: Vec<CellId> = mesh.cells().filter(|_| random.below(8) > 0).collect();
        mesh.coarsen(&marked, &mut change).unwrap();
        mesh.check_invariants().unwrap();
    }
    mesh.coarsen_everywhere(&mut change);
    mesh.check_invariants().unwrap();
}

in_each_dimension! {
    kinds 0..3_u8, 0..3_u8;
    round_trip, 80, 50, 10;
    mixtures, 80, 50, 10;
    predicate, 60, 30, 6;
    moves, 60, 40, 10;
}

#[test]
fn the_needle_comes_back_to_six_cells() {
    let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [1; 3]).unwrap();
    let start = mesh.clone();
    let (a, b) = ([-0.01, 0.431, 0.527], [0.713, 0.489, 0.561]);
    mesh.refine_along(a, b, 2_f64.powi(-7), &mut MeshChange::default()).unwrap();
    assert_eq!(mesh.n_cells(), 16_758);
    mesh.coarsen_everywhere(&mut MeshChange::default());
    assert_eq!((mesh.n_cells(), mesh.n_vertices()), (6, 8));
    mesh.check_invariants().unwrap();
    assert_eq!(leaf_set(&mesh), leaf_set(&start));
}

#[test]
fn boundary_tags_are_inherited_and_come_back() {
    let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [2; 3]).unwrap();
    let on_top = |mesh: &SimplexMesh<3, 4>, c: CellId, facet: usize| {
        mesh.corners(c).iter().enumerate().all(|(i, p)| i == facet || p[2] == 1.0)
    };
    let facets: Vec<(CellId, usize)> = mesh.boundary_facets().collect();
    for &(c, facet) in &facets {
        let tag = if on_top(&mesh, c, facet) { 7 } else { 0 };
        mesh.set_boundary_tag(c, facet, tag).unwrap();
    }
    let check = |mesh: &SimplexMesh<3, 4>| {
        for (c, facet) in mesh.boundary_facets() {
            assert_eq!(mesh.boundary_tag(c, facet), Some(if on_top(mesh, c, facet) { 7 } else { 0 }));
        }
    };
    mesh.refine_around([0.3, 0.4, 0.99], 0.05, &mut MeshChange::default()).unwrap();
    check(&mesh);
    mesh.coarsen_everywhere(&mut MeshChange::default());
    check(&mesh);
    assert_eq!(mesh.n_cells(), 48);

    // A tag on one half only stays: its vertex is not removed.
    mesh.refine_around([0.3, 0.4, 0.99], 0.2, &mut MeshChange::default()).unwrap();
    let deepest = mesh.boundary_facets().max_by_key(|&(c, _)| mesh.level(c)).unwrap();
    mesh.set_boundary_tag(deepest.0, deepest.1, 9).unwrap();
    let facet_of = |mesh: &SimplexMesh<3, 4>, (c, facet): (CellId, usize)| {
        let mut corners = mesh.corners(c).map(|p| p.map(f64::to_bits));
        corners[facet] = [0; 3];
        corners.sort_unstable();
        corners
    };
    let tagged = facet_of(&mesh, deepest);
    mesh.coarsen_everywhere(&mut MeshChange::default());
    let nines: Vec<_> = mesh.boundary_facets().filter(|&(c, f)| mesh.boundary_tag(c, f) == Some(9)).collect();
    assert_eq!(nines.len(), 1);
    assert_eq!(facet_of(&mesh, nines[0]), tagged, "it may be a facet of a coarser cell now");
    assert!(mesh.n_cells() > 48);
    mesh.check_invariants().unwrap();

    let (inner, facet) =
        mesh.cells().find_map(|c| (0..4).find(|&f| mesh.neighbor(c, f).is_some()).map(|f| (c, f))).unwrap();
    assert_eq!(mesh.boundary_tag(inner, facet), None);
    for (c, facet, tag) in
        [(inner, facet, 1), (inner, 9, 1), (CellId(1_000_000), 0, 1), (deepest.0, deepest.1, 1 << 31)]
    {
        assert!(mesh.set_boundary_tag(c, facet, tag).is_err());
    }
}

#[test]
fn surfaces_and_rods_come_back() {
    let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [0.0, 1.0, -0.3], [1.0, 1.0, 0.5]];
    let mut surface = SimplexMesh::<3, 3>::new(points, vec![[0, 1, 2], [1, 3, 2]]).unwrap();
    let start = leaf_set(&surface);
    surface.refine_around([1.0, 0.0, 0.2], 0.05, &mut MeshChange::default()).unwrap();
    surface.coarsen_everywhere(&mut MeshChange::default());
    assert_eq!(leaf_set(&surface), start);
    surface.check_invariants().unwrap();

    let mut rod =
        SimplexMesh::<3, 2>::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0]], vec![[1, 0], [1, 2]]).unwrap();
    rod.refine_around([1.0, 0.0, 0.0], 0.01, &mut MeshChange::default()).unwrap();
    rod.coarsen_everywhere(&mut MeshChange::default());
    assert_eq!((rod.n_cells(), rod.n_vertices()), (2, 3));
    rod.check_invariants().unwrap();
}
