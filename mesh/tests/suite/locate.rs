//! Location against brute force: points, segments, walks and the spatial index, in two, three and four dimensions.

use crate::support::{Random, depth, marks, start_mesh};
use proptest::prelude::*;
use stylet_mesh::{
    CellId, Crossing, Displaced, LocateError, Location, MeshChange, SimplexMesh, SpatialIndex, VertexId, Walk,
    generate::kuhn_box, geometry,
};

/// The start meshes of `support`, and Kuhn grids from which a quadrant (3), the middle (4) and a middle layer (5) were
/// taken out: an L, a ring, two components.
fn any_mesh<const D: usize, const N: usize>(kind: u8, seed: u64) -> SimplexMesh<D, N> {
    if kind < 3 {
        return start_mesh(kind, seed);
    }
    let full = kuhn_box::<D, N>([0.0; D], [1.0; D], [if kind == 3 { 2 } else { 3 }; D]).unwrap();
    let keep = |c: &CellId| {
        let corners = full.corners(*c);
        let centre: [f64; D] = std::array::from_fn(|k| corners.iter().map(|x| x[k]).sum::<f64>() / N as f64);
        match kind {
            3 => centre[0] < 0.5 || centre[1] < 0.5,
            4 => !centre.iter().take(2).all(|x| (1.0 / 3.0..2.0 / 3.0).contains(x)),
            _ => !(1.0 / 3.0..2.0 / 3.0).contains(&centre[0]),
        }
    };
    let cells: Vec<[VertexId; N]> = full.cells().filter(keep).map(|c| full.cell(c)).collect();
    let mut names = vec![u32::MAX; full.n_vertices()];
    let mut points = Vec::new();
    let cells = cells.iter().map(|cell| {
        cell.map(|v| {
            if names[v.index()] == u32::MAX {
                names[v.index()] = points.len() as u32;
                points.push(full.point(v));
            }
            names[v.index()]
        })
    });
    let cells = cells.collect();
    SimplexMesh::new(points, cells).unwrap()
}

fn refine<const D: usize, const N: usize>(mesh: &mut SimplexMesh<D, N>, random: &mut Random, change: &mut MeshChange) {
    for _ in 0..4 {
        let marked = marks(mesh, 6, random);
        mesh.bisect(&marked, change).unwrap();
    }
}

fn move_some<const D: usize, const N: usize>(mesh: &mut SimplexMesh<D, N>, random: &mut Random) {
    for _ in 0..12 {
        let v = VertexId::new(random.below(mesh.n_vertices()));
        let (p, aim): ([f64; D], [f64; D]) = (mesh.point(v), random.point());
        // Refused moves are as good: some are not.
        let _ = mesh.move_vertex(v, std::array::from_fn(|k| p[k] + 0.1 * (aim[k] - 0.5)), 0.3);
    }
}

/// A point at random, or the middle of a vertex, an edge, ..., a facet of some cell; of a cell with the given corners.
fn some_point<const D: usize, const N: usize>(
    cells: &[CellId],
    corners: impl Fn(CellId) -> [[f64; D]; N],
    random: &mut Random,
) -> [f64; D] {
    if random.below(3) == 0 {
        return random.point::<D>().map(|x| 1.2 * x - 0.1);
    }
    let corners = corners(cells[random.below(cells.len())]);
    let n = 1 + random.below(N - 1);
    std::array::from_fn(|k| corners[..n].iter().map(|x| x[k]).sum::<f64>() / n as f64)
}

/// How far inside a simplex a point is: its smallest barycentric coordinate.
fn inside<const D: usize, const N: usize>(corners: &[[f64; D]; N], p: &[f64; D]) -> f64 {
    geometry::barycentric(corners, p).unwrap().into_iter().fold(f64::INFINITY, f64::min)
}

/// What the rounding of places of about 1 can make of a barycentric coordinate: much where a deformed cell is thin.
fn rounding<const D: usize, const N: usize>(corners: &[[f64; D]; N]) -> f64 {
    let slope2 = geometry::gradients(corners).unwrap().iter().map(|g| geometry::dot(g, g)).fold(0.0, f64::max);
    1e-14 * slope2.sqrt()
}

/// What was found is live and contains the point, and is something if a cell contains the point beyond doubt.
fn assert_found<const D: usize, const N: usize>(
    found: Option<Location<N>>,
    cells: &[CellId],
    corners: &impl Fn(CellId) -> [[f64; D]; N],
    p: &[f64; D],
) {
    match found {
        None => assert!(cells.iter().all(|&c| inside(&corners(c), p) < 1e-9), "{p:?} was missed"),
        Some(Location { cell, barycentric }) => {
            assert!(cells.binary_search(&cell).is_ok());
            assert!(inside(&corners(cell), p) > -2e-10);
            assert!(barycentric.iter().all(|l| (0.0..=1.0 + 1e-12).contains(l)));
            let q = geometry::combine(&corners(cell), &barycentric);
            assert!(geometry::distance2(p, &q).sqrt() < 1e-9);
            let inner: Vec<CellId> = cells.iter().copied().filter(|&c| inside(&corners(c), p) > 1e-9).collect();
            assert!(inner.is_empty() || inner == [cell], "an inner point has one cell");
        }
    }
}

/// All ways to locate a point in rest positions find the same, before and after vertices were moved.
fn points<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = any_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    refine(&mut mesh, &mut random, &mut MeshChange::default());
    for _ in 0..2 {
        let cells: Vec<CellId> = mesh.cells().collect();
        let corners = |c: CellId| mesh.corners(c);
        let rest = mesh.configuration(mesh.points()).unwrap();
        let index = SpatialIndex::new(&rest).unwrap();
        let locator = mesh.locator();
        let points: Vec<[f64; D]> = (0..60).map(|_| some_point(&cells, corners, &mut random)).collect();
        for &p in &points {
            let found = mesh.locate(p);
            assert_found(found, &cells, &corners, &p);
            assert_eq!(locator.locate(p), found);
            // From anywhere, a dead cell too.
            for near in [CellId::new(random.below(mesh.n_slots())), cells[random.below(cells.len())]] {
                assert_eq!(mesh.locate_near(near, p).map(|f| f.cell), found.map(|f| f.cell));
            }
            assert_eq!(mesh.locate_near(CellId(u32::MAX), p), found, "a cell that never was");

            // These give a common face to the cell of smallest id.
            let indexed = index.locate(&rest, p);
            assert_found(indexed, &cells, &corners, &p);
            assert_eq!(indexed.is_some(), found.is_some());
            let near = cells[random.below(cells.len())];
            assert_eq!(index.locate_near(&rest, near, p).map(|f| f.cell), indexed.map(|f| f.cell));
            if let (Some(found), Some(indexed)) = (found, indexed) {
                let tie = inside(&corners(found.cell), &p) < 1e-9;
                assert!(found.cell == indexed.cell || tie);
            }
            let first = cells.iter().copied().find(|&c| depth(&mesh, c, &p) >= 0.0);
            let doubtful = cells.iter().any(|&c| (-1e-9..1e-12).contains(&depth(&mesh, c, &p)));
            assert!(doubtful || indexed.map(|f| f.cell) == first);
        }
        assert_eq!(mesh.locate_many(&points), points.iter().map(|&p| mesh.locate(p)).collect::<Vec<_>>());
        move_some(&mut mesh, &mut random);
    }
    for bad in [f64::NAN, f64::INFINITY, -1e300, f64::MAX] {
        let p = [bad; D];
        let rest = mesh.configuration(mesh.points()).unwrap();
        assert!(mesh.locate(p).is_none() && mesh.locate_near(CellId(0), p).is_none());
        assert!(mesh.locator().locate(p).is_none());
        assert!(SpatialIndex::new(&rest).unwrap().locate(&rest, p).is_none());
        assert!(!matches!(rest.walk(CellId(0), p), Walk::Found(_)));
    }
}

/// The crossings of a segment: touched cells and no others, each once, in order, without gaps inside.
fn assert_crossings<const D: usize, const N: usize>(
    crossings: &[Crossing],
    cells: &[CellId],
    corners: &impl Fn(CellId) -> [[f64; D]; N],
    [a, b]: [[f64; D]; 2],
) {
    let at = |t: f64| -> [f64; D] { std::array::from_fn(|k| a[k] + t * (b[k] - a[k])) };
    assert!(crossings.is_sorted_by(|c, d| (c.from, c.to, c.cell) <= (d.from, d.to, d.cell)));
    let mut listed: Vec<CellId> = crossings.iter().map(|c| c.cell).collect();
    listed.sort_unstable();
    assert!(listed.windows(2).all(|w| w[0] < w[1]), "a cell is listed once");
    for c in crossings {
        assert!(0.0 <= c.from && c.from <= c.to && c.to <= 1.0);
        for t in [c.from, 0.5 * (c.from + c.to), c.to] {
            let (corners, p) = (corners(c.cell), at(t));
            assert!(inside(&corners, &p) > -1e-9 - rounding(&corners), "{c:?} is not touched at {t}");
        }
    }
    for t in (0..=100).map(|t| f64::from(t) / 100.0) {
        for &c in cells.iter().filter(|&&c| inside(&corners(c), &at(t)) >= 0.0) {
            let crossing = crossings.iter().find(|crossing| crossing.cell == c).expect("a touched cell is listed");
            assert!((crossing.from - 1e-9..=crossing.to + 1e-9).contains(&t));
        }
    }
    // Where one interval has ended and none has begun, there is no mesh.
    let mut reach = 0.0_f64;
    for c in crossings.iter().copied().chain([Crossing { cell: CellId(0), from: 1.0, to: 1.0 }]) {
        if c.from > reach {
            let gap = at(0.5 * (reach + c.from));
            assert!(cells.iter().all(|&c| inside(&corners(c), &gap) < 1e-9), "a gap from {reach} to {}", c.from);
        }
        reach = reach.max(c.to);
    }
}

/// Segments at random, between vertices, along edges and facets, through everything, of no length.
fn segments<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = any_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    refine(&mut mesh, &mut random, &mut MeshChange::default());
    let mut found = vec![Crossing { cell: CellId(7), from: 0.0, to: 0.0 }];
    for _ in 0..2 {
        let cells: Vec<CellId> = mesh.cells().collect();
        let corners = |c: CellId| mesh.corners(c);
        let rest = mesh.configuration(mesh.points()).unwrap();
        let index = SpatialIndex::new(&rest).unwrap();
        for round in 0..12 {
            let (p, q) = (some_point(&cells, corners, &mut random), some_point(&cells, corners, &mut random));
            let edge = mesh.refinement_edge(cells[random.below(cells.len())]).map(|v| mesh.point(v));
            let segment = match round % 4 {
                0 => edge,
                1 => [p, p],
                // Along an edge and beyond both ends.
                2 => [[2.0, -1.0], [-1.0, 2.0]].map(|[s, t]| std::array::from_fn(|k| s * edge[0][k] + t * edge[1][k])),
                _ => [p, q],
            };
            mesh.leaves_along(segment[0], segment[1], &mut found);
            assert_crossings(&found, &cells, &corners, segment);
            let mut indexed = Vec::new();
            index.cells_along(&rest, segment[0], segment[1], &mut indexed);
            assert_crossings(&indexed, &cells, &corners, segment);
        }
        move_some(&mut mesh, &mut random);
    }
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        mesh.leaves_along([bad; D], [0.5; D], &mut found);
        assert!(found.is_empty());
    }
}

/// A deformation that keeps cells from turning over: a strong shear, a stretch, and a smooth bump.
fn deform<const D: usize>(points: &[[f64; D]], shear: f64, bump: f64) -> Vec<[f64; D]> {
    let place = |x: &[f64; D]| {
        std::array::from_fn(|k| match k {
            0 => x[0] + shear * x[1] + bump * (3.0 * x[1]).sin(),
            1 => 2.0 * x[1] + bump * (4.0 * x[D - 1]).sin() * f64::from(u8::from(D > 2)),
            _ => x[k],
        })
    };
    points.iter().map(place).collect()
}

/// The index and the walk in deformed meshes, while these are refined, moved and deformed further.
fn deformed<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let mut mesh = any_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let mut index = SpatialIndex::new(&mesh.configuration(mesh.points()).unwrap()).unwrap();
    for (round, shear) in [0.3, 4.0, 1.0].into_iter().enumerate() {
        // A bump may turn a thin cell over, and then cells overlap; an affine map does not.
        let bumped = deform(mesh.points(), shear, 0.1 * random.unit());
        let volume = |c: CellId| geometry::signed_measure(&mesh.oriented(c).map(|v| bumped[v.index()]));
        let sound = mesh.cells().all(|c| volume(c) > 0.0);
        let positions = if sound { bumped } else { deform(mesh.points(), shear, 0.0) };
        index.refit(&mesh.configuration(&positions[..]).unwrap()).unwrap();
        let mut change = MeshChange::default();
        refine(&mut mesh, &mut random, &mut change);
        let mut flat = positions.as_flattened().to_vec();
        change.carry_field::<D>(&mut flat);
        let positions = flat.as_chunks::<D>().0;
        let body = mesh.configuration(positions).unwrap();
        index.update(&body, &change).unwrap();
        assert_eq!(index.n_cells(), mesh.n_cells());

        let displacement: Vec<f64> = flat.iter().zip(mesh.points().as_flattened()).map(|(x, p)| x - p).collect();
        let displaced = Displaced { points: mesh.points(), displacement: &displacement };
        let also = mesh.configuration(&displaced).unwrap();
        let anew = SpatialIndex::new(&also).unwrap();
        let cells: Vec<CellId> = mesh.cells().collect();
        let corners = |c: CellId| body.corners(c);
        for _ in 0..30 {
            let p = some_point(&cells, corners, &mut random);
            let found = index.locate(&body, p);
            assert_found(found, &cells, &corners, &p);
            assert_eq!(
                index.locate_near(&body, cells[random.below(cells.len())], p).map(|f| f.cell),
                found.map(|f| f.cell)
            );
            if let Walk::Found(walked) = body.walk(cells[random.below(cells.len())], p) {
                assert_eq!(Some(walked.cell), found.map(|f| f.cell));
            } else if kind < 3 && round == 0 && D == 2 {
                // A sheared square bulges but little: from a convex mesh a walk ends where there is nothing else.
                assert!(found.is_none_or(|f| inside(&corners(f.cell), &p) < 0.5));
            }
            // Displacements round once more.
            assert_eq!(anew.locate(&also, p).is_some(), found.is_some());
            let q = some_point(&cells, corners, &mut random);
            let mut along = Vec::new();
            index.cells_along(&body, p, q, &mut along);
            assert_crossings(&along, &cells, &corners, [p, q]);
            let (lower, upper) = (std::array::from_fn(|k| p[k].min(q[k])), std::array::from_fn(|k| p[k].max(q[k])));
            let mut near = Vec::new();
            index.cells_in_box(lower, upper, &mut near);
            assert!(near.is_sorted() && along.iter().all(|c| near.binary_search(&c.cell).is_ok()));
        }
    }
}

in_each_dimension! {
    kinds 0..6_u8, 0..4_u8;
    points, 60, 24, 8;
    segments, 60, 12, 3;
    deformed, 40, 8, 2;
}

#[test]
fn a_point_beside_the_mesh_counts_within_its_slack() {
    let mut mesh = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [4; 2]).unwrap();
    mesh.refine_everywhere(0.02, &mut MeshChange::default()).unwrap();
    let rest = mesh.configuration(mesh.points()).unwrap();
    let index = SpatialIndex::new(&rest).unwrap();
    let mut crossings = Vec::new();
    for (outside, found) in [(0.0, true), (1e-13, true), (1e-6, false)] {
        let p = [1.0 + outside, 0.3];
        assert_eq!(mesh.locate(p).is_some(), found);
        assert_eq!(mesh.locator().locate(p).is_some(), found);
        assert_eq!(mesh.locate_near(CellId(3), p).is_some(), found);
        assert_eq!(index.locate(&rest, p).is_some(), found);
        assert_eq!(matches!(rest.walk(CellId(3), p), Walk::Found(_)), found);
        mesh.leaves_along([1.0 + outside, -1.0], [1.0 + outside, 2.0], &mut crossings);
        let on_the_side = mesh.cells().filter(|&c| mesh.corners(c).iter().any(|x| x[0] == 1.0)).count();
        assert_eq!(crossings.len(), if found { on_the_side } else { 0 });
    }
}

#[test]
fn a_segment_lists_its_cells_in_order() {
    let mesh = kuhn_box::<2, 3>([0.0; 2], [4.0, 1.0], [4, 1]).unwrap();
    let mut found = Vec::new();
    mesh.leaves_along([-1.0, 0.25], [4.0, 0.25], &mut found);
    let rounded: Vec<[f64; 2]> = found.iter().map(|c| [c.from, c.to].map(|t| (5.0 * t - 1.0) * 4.0)).collect();
    let expected =
        [[0.0, 1.0], [1.0, 4.0], [4.0, 5.0], [5.0, 8.0], [8.0, 9.0], [9.0, 12.0], [12.0, 13.0], [13.0, 16.0]];
    assert_eq!(rounded.len(), expected.len());
    for (found, expected) in rounded.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((found - expected).abs() < 1e-9, "{rounded:?}");
    }
}

#[test]
fn positions_are_checked_at_the_door() {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [1; 3]).unwrap();
    let short = &mesh.points()[1..];
    assert_eq!(mesh.configuration(short).unwrap_err(), LocateError::Positions { found: 7, expected: 8 });
    let flat = Displaced { points: mesh.points(), displacement: &[0.0; 23] };
    assert_eq!(mesh.configuration(&flat).unwrap_err(), LocateError::Positions { found: 7, expected: 8 });
    let mut points = mesh.points().to_vec();
    points[6][1] = f64::INFINITY;
    let error = SpatialIndex::new(&mesh.configuration(&points[..]).unwrap()).unwrap_err();
    assert_eq!(error, LocateError::Coordinate { vertex: 6, axis: 1, value: f64::INFINITY });
}

/// Everything at one place: no walk hangs, nothing is found.
#[test]
fn collapsed_and_inverted_meshes_end_every_walk() {
    let mut mesh = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [8; 2]).unwrap();
    mesh.refine_everywhere(0.05, &mut MeshChange::default()).unwrap();
    let mut random = Random::new(5);
    for round in 0..4 {
        let scrambled: Vec<[f64; 2]> = match round {
            0 => vec![[0.5; 2]; mesh.n_vertices()],
            _ => mesh.points().iter().map(|p| p.map(|x| x + f64::from(round) * 0.1 * (random.unit() - 0.5))).collect(),
        };
        let body = mesh.configuration(&scrambled[..]).unwrap();
        let index = SpatialIndex::new(&body).unwrap();
        let cells: Vec<CellId> = mesh.cells().collect();
        for _ in 0..200 {
            let p = random.point::<2>();
            let found = index.locate_near(&body, cells[random.below(cells.len())], p);
            let contains =
                |c: CellId| geometry::barycentric(&body.corners(c), &p).is_some_and(|l| l.iter().all(|&l| l >= -1e-9));
            match found {
                Some(location) => assert!(contains(location.cell)),
                None => assert!(!cells.iter().any(|&c| contains(c) && inside(&body.corners(c), &p) > 1e-9)),
            }
        }
    }
}

/// An index that is updated while the mesh is refined along a path finds what one built anew finds.
#[test]
fn an_index_follows_many_refinements() {
    let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [2; 3]).unwrap();
    let mut index = SpatialIndex::new(&mesh.configuration(mesh.points()).unwrap()).unwrap();
    let mut random = Random::new(11);
    for step in 0..24 {
        let t = f64::from(step) / 24.0;
        let mut change = MeshChange::default();
        mesh.refine_around([0.1 + 0.8 * t, 0.4 + 0.1 * t, 0.3], 0.04, &mut change).unwrap();
        let rest = mesh.configuration(mesh.points()).unwrap();
        index.update(&rest, &change).unwrap();
        assert_eq!(index.n_cells(), mesh.n_cells());
        let anew = SpatialIndex::new(&rest).unwrap();
        for _ in 0..50 {
            let p = random.point::<3>();
            assert_eq!(index.locate(&rest, p), anew.locate(&rest, p));
            assert!(index.locate::<4>(&rest, p).is_some());
        }
    }
}

/// A surface and a rod: found on it, not beside it.
#[test]
fn surfaces_and_rods_in_space() {
    let flat = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [3; 2]).unwrap();
    let points = flat.points().iter().map(|&[x, y]| [x, y, 0.3 * x + 0.2 * y * y]).collect();
    let mut sheet =
        SimplexMesh::<3, 3>::new(points, flat.cells().map(|c| flat.cell(c).map(|v| v.0)).collect()).unwrap();
    let mut change = MeshChange::default();
    sheet.refine_around([0.0; 3], 0.05, &mut change).unwrap();
    let rest = sheet.configuration(sheet.points()).unwrap();
    let index = SpatialIndex::new(&rest).unwrap();
    for c in sheet.cells() {
        let p = geometry::combine(&sheet.corners(c), &[0.2, 0.3, 0.5]);
        let found =
            [sheet.locate(p), sheet.locator().locate(p), index.locate(&rest, p), sheet.locate_near(CellId(0), p)];
        assert!(found.iter().all(|f| f.is_some_and(|f| f.cell == c)));
        let above = [p[0], p[1], p[2] + 0.01];
        assert!(sheet.locate(above).is_none() && index.locate(&rest, above).is_none());
        let mut crossings = Vec::new();
        sheet.leaves_along(above, [p[0], p[1], p[2] - 0.01], &mut crossings);
        assert!(crossings.len() == 1 && crossings[0].cell == c && (crossings[0].from - 0.5).abs() < 1e-6);
    }
    let rod = SimplexMesh::<3, 2>::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0]], vec![[0, 1], [1, 2]]).unwrap();
    let rest = rod.configuration(rod.points()).unwrap();
    let index = SpatialIndex::new(&rest).unwrap();
    assert_eq!(index.locate_near::<2>(&rest, CellId(0), [1.0, 1.5, 0.0]).map(|f| f.cell), Some(CellId(1)));
    assert!(index.locate::<2>(&rest, [1.0, 1.5, 0.1]).is_none());
}
