//! The choice of the first refinement edges: longest edge or colouring, against an independent statement of the latter.

use crate::support::{Random, assert_net, leaf_set, marks, start_mesh};
use proptest::prelude::*;
use std::collections::BTreeMap;
use stylet_mesh::{
    CellId, Hierarchy, MeshChange, Rule, SimplexMesh, VertexId,
    generate::{kuhn_box, kuhn_box_with_rule, random_delaunay},
    quality,
};

/// The same start cells under another rule.
fn with_rule<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, rule: Rule) -> SimplexMesh<D, N> {
    let cells: Vec<[u32; N]> = mesh.cells().map(|c| mesh.cell(c).map(|v| v.0)).collect();
    let regions = mesh.cells().map(|c| mesh.region(c)).collect();
    SimplexMesh::with_rule(mesh.points().to_vec(), cells, regions, rule).unwrap()
}

/// Generations of vertices by the rule of Diening, Gehring & Storn, which needs no order of vertices and no tags: that of
/// a start vertex is minus its colour, and each cell bisects an edge between its oldest vertex and another.
struct Generations {
    n: i64,
    of: BTreeMap<VertexId, i64>,
}

impl Generations {
    fn new<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Self {
        let mut colours: BTreeMap<VertexId, i64> = BTreeMap::new();
        for v in mesh.vertices() {
            let around = mesh.cells().filter(|&c| mesh.cell(c).contains(&v)).flat_map(|c| mesh.cell(c));
            let taken: Vec<i64> = around.filter_map(|w| colours.get(&w).copied()).collect();
            colours.insert(v, (0..).find(|colour| !taken.contains(colour)).unwrap());
        }
        let n = colours.values().copied().max().unwrap();
        Self { n, of: colours.into_iter().map(|(v, colour)| (v, -colour)).collect() }
    }

    /// Level and type: the generation is `n (level - 1) + type`, the type from 1 to n.
    fn level_and_type(&self, v: VertexId) -> (i64, i64) {
        let g = self.of[&v];
        ((g - 1).div_euclid(self.n) + 1, (g - 1).rem_euclid(self.n) + 1)
    }

    /// The edge that a cell bisects, and the generation of its midpoint.
    fn bisect<const N: usize>(&self, mut cell: [VertexId; N]) -> ([VertexId; 2], i64) {
        cell.sort_by_key(|v| -self.of[v]);
        let (oldest, next) = (cell[N - 1], cell[N - 2]);
        let level = |v| self.level_and_type(v).0;
        if level(oldest) != level(next) {
            return ([next, oldest], self.of[&next] + self.n);
        }
        let youngest = cell.into_iter().find(|&v| level(v) == level(oldest)).unwrap();
        ([youngest, oldest], self.of[&oldest] + 2 * self.n + 1 - self.level_and_type(youngest).1)
    }
}

/// Every bisection that was done, and every one that is due next, is that of the oracle.
fn agrees_with_the_oracle<const D: usize, const N: usize>(start: &SimplexMesh<D, N>, mesh: &SimplexMesh<D, N>) {
    let mut generations = Generations::new(start);
    // By level, so that parents come before children though slots are reused.
    let mut cells: Vec<CellId> = start.cells().collect();
    while !cells.is_empty() {
        let mut next = Vec::new();
        for &c in &cells {
            let (mut edge, generation) = generations.bisect(mesh.cell(c));
            let mut ours = mesh.refinement_edge(c);
            edge.sort_unstable();
            ours.sort_unstable();
            assert_eq!(ours, edge, "cell {c:?}");
            if let Some(children) = mesh.children(c) {
                let midpoint = mesh.cell(children[0]).into_iter().find(|v| !mesh.cell(c).contains(v)).unwrap();
                let known = *generations.of.entry(midpoint).or_insert(generation);
                assert_eq!(known, generation, "all cells around an edge give its midpoint one generation");
                next.extend(children);
            }
        }
        cells = next;
    }
}

fn colouring<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let start = with_rule(&start_mesh::<D, N>(kind, seed), Rule::Colouring);
    start.check_invariants().unwrap();
    let (mut mesh, mut random) = (start.clone(), Random::new(!seed));
    let mut change = MeshChange::default();
    for _ in 0..4 {
        mesh.bisect(&marks(&mesh, 5, &mut random), &mut change).unwrap();
        mesh.coarsen(&marks(&mesh, 40, &mut random), &mut change).unwrap();
    }
    mesh.check_invariants().unwrap();
    assert_net(&start, &mesh, &change);
    agrees_with_the_oracle(&start, &mesh);
    let bytes = postcard::to_allocvec(&mesh).unwrap();
    let mut back: SimplexMesh<D, N> = postcard::from_bytes(&bytes).unwrap();
    let p = random.point();
    mesh.refine_around(p, 0.3, &mut change).unwrap();
    back.refine_around(p, 0.3, &mut MeshChange::default()).unwrap();
    assert_eq!(leaf_set(&mesh), leaf_set(&back));
    mesh.coarsen_everywhere(&mut change);
    assert_eq!(leaf_set(&mesh), leaf_set(&start));
}

/// Random marks on random Delaunay meshes: conforming, with the whole volume, under both rules.
fn delaunay<const D: usize, const N: usize>(n_points: usize, seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let start = random_delaunay::<D, N>(n_points, seed).unwrap();
        for rule in [Rule::LongestEdge, Rule::Colouring] {
            let (mut mesh, mut random) = (with_rule(&start, rule), Random::new(seed));
            for _ in 0..4 {
                mesh.bisect(&marks(&mesh, 10, &mut random), &mut MeshChange::default()).unwrap();
            }
            mesh.check_invariants().unwrap();
            assert!((mesh.total_volume() - 1.0).abs() <= 1e-12);
        }
    }
}

#[test]
fn delaunay_meshes_under_random_marks() {
    delaunay::<2, 3>(100, 0..10);
    delaunay::<3, 4>(60, 0..10);
    delaunay::<4, 5>(20, 0..10);
}

/// A hierarchy that follows changes equals one made afresh; groups are independent sets, parents come earlier.
fn hierarchy<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let mut hierarchy = Hierarchy::new(&mesh);
    let mut change = MeshChange::default();
    for round in 0..8 {
        change.clear();
        mesh.bisect(&marks(&mesh, 4, &mut random), &mut change).unwrap();
        if round % 2 == 1 {
            mesh.coarsen(&marks(&mesh, 60, &mut random), &mut change).unwrap();
        }
        hierarchy.apply(&mesh, &change);
        assert_eq!(hierarchy.groups().collect::<Vec<_>>(), Hierarchy::new(&mesh).groups().collect::<Vec<_>>());
    }
    assert_eq!(hierarchy.groups().map(<[VertexId]>::len).sum::<usize>(), mesh.n_vertices());
    assert!(mesh.vertices().all(|v| mesh.generations_slice()[v.index()] == mesh.generation(v)));
    for (generation, group) in hierarchy.groups().enumerate() {
        for &v in group {
            assert_eq!(usize::from(mesh.generation(v)), generation);
            let parents = mesh.parents_slice()[v.index()].map(VertexId);
            assert_eq!(mesh.parents(v), (generation > 0).then_some(parents));
            assert!(generation == 0 || parents.iter().all(|&p| mesh.generation(p) < mesh.generation(v)));
        }
    }
    for c in mesh.cells() {
        let mut generations = mesh.cell(c).map(|v| mesh.generation(v));
        generations.sort_unstable();
        assert!(generations.windows(2).all(|pair| pair[0] < pair[1] || pair[0] == 0), "{generations:?}");
    }
}

in_each_dimension! {
    kinds 0..3_u8, 0..3_u8;
    colouring, 60, 40, 8;
    hierarchy, 60, 40, 8;
}

/// Greedy colours on a Kuhn cube are the sums of coordinates: a short edge goes first, and more shapes come of it than of
/// the diagonals that the longest edge finds (1, 3 and 4): 4, 19 and 67, as an enumeration of the tagged simplices that
/// descend from one such start simplex, in exact arithmetic, says as well.
#[test]
fn shapes_of_a_kuhn_cube() {
    fn count<const D: usize, const N: usize>(rule: Rule, size: f64) -> usize {
        let mut mesh = kuhn_box_with_rule::<D, N>([0.0; D], [1.0; D], [1; D], rule).unwrap();
        // Around the path of a needle there are cells of all levels, near it and far from it.
        let (a, b) = ([-0.01, 0.431, 0.527, 0.683], [0.713, 0.489, 0.561, 0.71]);
        let [a, b] = [a, b].map(|p: [f64; 4]| std::array::from_fn(|k| p[k]));
        mesh.refine_along(a, b, size, &mut MeshChange::default()).unwrap();
        mesh.check_invariants().unwrap();
        let shapes = quality::shapes(&mesh);
        println!("{D}D, {rule:?}: {shapes} shapes among {} cells", mesh.n_cells());
        shapes
    }
    assert_eq!(count::<2, 3>(Rule::LongestEdge, 2_f64.powi(-6)), 1);
    assert_eq!(count::<3, 4>(Rule::LongestEdge, 2_f64.powi(-6)), 3);
    assert_eq!(count::<4, 5>(Rule::LongestEdge, 2_f64.powi(-3)), 4);
    assert_eq!(count::<2, 3>(Rule::Colouring, 2_f64.powi(-6)), 4);
    assert_eq!(count::<3, 4>(Rule::Colouring, 2_f64.powi(-6)), 19);
    assert_eq!(count::<4, 5>(Rule::Colouring, 2_f64.powi(-3)), 67);
}

#[test]
fn colouring_of_surfaces_and_rods() {
    let solid = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [2; 3]).unwrap();
    let mut names = BTreeMap::new();
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    for (c, facet) in solid.boundary_facets() {
        let mut v = solid.cell(c).to_vec();
        v.remove(facet);
        cells.push(std::array::from_fn::<u32, 3, _>(|i| {
            *names.entry(v[i]).or_insert_with(|| {
                points.push(solid.point(v[i]));
                points.len() as u32 - 1
            })
        }));
    }
    let regions = vec![0; cells.len()];
    let start = SimplexMesh::<3, 3>::with_rule(points, cells, regions, Rule::Colouring).unwrap();
    let mut surface = start.clone();
    surface.refine_around([1.0, 1.0, 0.0], 0.1, &mut MeshChange::default()).unwrap();
    surface.check_invariants().unwrap();
    agrees_with_the_oracle(&start, &surface);
    surface.coarsen_everywhere(&mut MeshChange::default());
    assert_eq!(leaf_set(&surface), leaf_set(&start));

    let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]];
    let start = SimplexMesh::<2, 2>::with_rule(points, vec![[1, 0], [1, 2]], vec![0; 2], Rule::Colouring).unwrap();
    let mut rod = start.clone();
    rod.refine_everywhere(0.1, &mut MeshChange::default()).unwrap();
    rod.check_invariants().unwrap();
    agrees_with_the_oracle(&start, &rod);
}

#[test]
fn too_many_regions_are_refused() {
    let square = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [32; 2]).unwrap();
    let cells: Vec<[u32; 3]> = square.cells().map(|c| square.cell(c).map(|v| v.0)).collect();
    let regions = |n: u32| (0..cells.len() as u32).map(|c| u32::MAX - c % n).collect::<Vec<u32>>();
    let mesh = SimplexMesh::with_regions(square.points().to_vec(), cells.clone(), regions(1024)).unwrap();
    assert!(mesh.cells().all(|c| mesh.region(c) == u32::MAX - c.0 % 1024));
    assert!(SimplexMesh::with_regions(square.points().to_vec(), cells.clone(), regions(1025)).is_err());
}
