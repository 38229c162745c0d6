//! Which start meshes are refused, and why; surfaces and rods.

use stylet_mesh::generate::{kuhn_box, mirrored_kuhn_box};
use stylet_mesh::{CellId, MeshChange, MeshError as Error, SimplexMesh};

type Triangles = SimplexMesh<2, 3>;

fn square() -> Vec<[f64; 2]> {
    vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
}

#[test]
fn malformed_meshes_are_refused_by_name() {
    let refused = |points, cells: &[[u32; 3]]| Triangles::new(points, cells.to_vec()).unwrap_err();
    assert_eq!(refused(square(), &[]), Error::NoCells);
    assert_eq!(refused(square(), &[[0, 1, 4]]), Error::Index { cell: 0, vertex: 4, n_vertices: 4 });
    assert_eq!(refused(square(), &[[0, 1, 1]]), Error::RepeatedVertex { cell: 0, vertex: 1 });
    assert_eq!(refused(square(), &[[0, 1, 2]]), Error::Unreferenced { vertex: 3 });
    let twice = [[0, 1, 2], [1, 2, 3], [2, 1, 0]];
    assert_eq!(refused(square(), &twice), Error::DuplicateCell { first: 0, second: 2 });

    for bad in [f64::NAN, f64::INFINITY, -1e151] {
        let mut points = square();
        points[3][1] = bad;
        assert!(matches!(refused(points, &[[0, 1, 2], [1, 2, 3]]), Error::Coordinate { vertex: 3, axis: 1, .. }));
    }
    let mut points = square();
    points[3] = [0.5, 0.5];
    assert!(matches!(refused(points.clone(), &[[0, 1, 2], [1, 2, 3]]), Error::Flat { cell: 1, .. }));
    // Folded over the common edge.
    points[3] = [0.1, 0.1];
    assert_eq!(refused(points, &[[0, 1, 2], [1, 2, 3]]), Error::Overlap { cells: [0, 1] });
    let regions = Triangles::with_regions(square(), vec![[0, 1, 2], [1, 2, 3]], vec![0; 3]);
    assert_eq!(regions.unwrap_err(), Error::Regions { expected: 2, found: 3 });
}

#[test]
fn meshes_that_are_not_manifold_are_refused() {
    let mut points = square();
    points.push([0.5, 2.0]);
    // Three triangles at the edge 2-3: as a surface in space, so that none is on the wrong side.
    let lifted: Vec<[f64; 3]> = points.iter().enumerate().map(|(i, p)| [p[0], p[1], f64::from(i as u8 == 4)]).collect();
    let fins = SimplexMesh::<3, 3>::new(lifted, vec![[2, 3, 0], [2, 3, 1], [2, 3, 4]]);
    assert_eq!(fins.unwrap_err(), Error::SharedFacet { cells: [0, 1, 2] });

    // Two triangles with one vertex in common.
    let bow = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0]];
    let pinched = Triangles::new(bow, vec![[0, 1, 2], [0, 3, 4]]);
    assert_eq!(pinched.unwrap_err(), Error::Pinched { face: vec![0], cells: [0, 1] });

    // Two tetrahedra with one edge in common.
    let points =
        vec![[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -1.0, 0.0]];
    let pinched = SimplexMesh::<3, 4>::new(points, vec![[0, 1, 2, 3], [0, 1, 4, 5]]);
    assert!(matches!(pinched.unwrap_err(), Error::Pinched { cells: [0, 1], .. }));
}

#[test]
fn boxes_without_extent_are_refused() {
    assert!(matches!(kuhn_box::<2, 3>([0.0; 2], [1.0, 0.0], [1; 2]), Err(Error::Box { axis: 1, .. })));
    assert!(matches!(kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [0, 1]), Err(Error::Box { axis: 0, .. })));
    assert!(matches!(kuhn_box::<2, 3>([f64::NAN; 2], [1.0; 2], [1; 2]), Err(Error::Box { axis: 0, .. })));
    assert!(matches!(kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [usize::MAX; 3]), Err(Error::TooManyCells { .. })));
}

#[test]
fn boxes_are_filled_in_path_order() {
    let mesh = kuhn_box::<3, 4>([-1.0, 0.0, 2.0], [1.0, 0.3, 2.7], [3, 2, 4]).unwrap();
    assert_eq!((mesh.n_cells(), mesh.n_vertices()), (6 * 24, 4 * 3 * 5));
    mesh.check_invariants().unwrap();
    // A sum of 144 rounded terms.
    assert!((mesh.total_volume() - 2.0 * 0.3 * 0.7).abs() < 1e-14);
    assert_eq!(mesh.points()[59], [1.0, 0.3, 2.7]);
}

/// Mirrored in any of its axes it has the same cells, which Kuhn's own mesh has not.
#[test]
fn mirrored_boxes_are_their_own_images() {
    let cells = |mesh: &SimplexMesh<3, 4>, axis: Option<usize>| {
        let place = |v| {
            let mut x = mesh.point(v).map(|x| (4.0 * x).round() as i64);
            axis.into_iter().for_each(|axis| x[axis] = 4 - x[axis]);
            x
        };
        let mut cells: Vec<_> = mesh.cells().map(|c| mesh.cell(c).map(place)).collect();
        cells.iter_mut().for_each(|cell| cell.sort_unstable());
        cells.sort_unstable();
        cells
    };
    let mut mesh = mirrored_kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [4, 2, 2]).unwrap();
    mesh.check_invariants().unwrap();
    assert_eq!((mesh.n_cells(), mesh.n_vertices()), (6 * 16, 5 * 3 * 3));
    assert!((mesh.total_volume() - 1.0).abs() < 1e-14);
    let kuhn = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [4, 2, 2]).unwrap();
    assert_eq!(mesh.points(), kuhn.points());
    for axis in 0..3 {
        assert_eq!(cells(&mesh, Some(axis)), cells(&mesh, None), "axis {axis}");
        assert_ne!(cells(&kuhn, Some(axis)), cells(&kuhn, None), "axis {axis}");
    }
    mesh.refine_around([1.0, 1.0, 0.0], 0.05, &mut MeshChange::default()).unwrap();
    mesh.check_invariants().unwrap();
    assert!(mirrored_kuhn_box::<2, 3>([0.0; 2], [1.0, f64::NAN], [1; 2]).is_err());
}

#[test]
fn a_surface_in_space() {
    // The boundary of a cube, oriented outwards.
    let solid = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [2; 3]).unwrap();
    let mut names = std::collections::BTreeMap::new();
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    for (c, facet) in solid.boundary_facets() {
        let opposite = solid.cell(c)[facet];
        let mut oriented = solid.oriented(c);
        // Rotating two pairs keeps the orientation: bring the opposite vertex to the front.
        let at = oriented.iter().position(|&v| v == opposite).unwrap();
        if at > 0 {
            let other = if at == 1 { 2 } else { 1 };
            oriented.swap(0, at);
            let last = 6 - at - other;
            oriented.swap(other, last);
        }
        cells.push([oriented[1], oriented[2], oriented[3]].map(|v| {
            *names.entry(v).or_insert_with(|| {
                points.push(solid.point(v));
                points.len() as u32 - 1
            })
        }));
    }
    let mut mesh = SimplexMesh::<3, 3>::new(points, cells).unwrap();
    let outward = |mesh: &SimplexMesh<3, 3>, c: CellId| {
        let [p, q, r] = mesh.oriented(c).map(|v| mesh.point(v));
        let (e, f): ([f64; 3], [f64; 3]) = (std::array::from_fn(|k| q[k] - p[k]), std::array::from_fn(|k| r[k] - p[k]));
        let normal = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
        (0..3).map(|k| normal[k] * ((p[k] + q[k] + r[k]) / 3.0 - 0.5)).sum::<f64>()
    };
    let sign = outward(&mesh, CellId(0)).signum();
    let corner = [1.0, 1.0, 0.0];
    let mut change = MeshChange::default();
    mesh.refine_around(corner, 0.05, &mut change).unwrap();
    mesh.refine_along([0.1, 0.2, -1.0], [0.1, 0.2, 2.0], 0.05, &mut change).unwrap();
    mesh.check_invariants().unwrap();
    assert!((mesh.total_volume() - 6.0).abs() < 1e-12);
    assert!(mesh.cells().all(|c| outward(&mesh, c) * sign > 0.0), "children inherit the orientation");
    assert_eq!(mesh.boundary_facets().count(), 0);
    // Where the segment pierces bottom and top, and at the corner, cells are small; in the middle of a side they are not.
    for p in [[0.1, 0.2, 0.0], [0.1, 0.2, 1.0], corner] {
        let found = mesh.locate(p).unwrap();
        assert!(mesh.longest_edge(found.cell) <= 0.05 * (1.0 + 1e-9));
    }
    assert!(mesh.longest_edge(mesh.locate([0.4, 1.0, 0.6]).unwrap().cell) > 0.2);
    assert!(mesh.locate([0.5; 3]).is_none(), "the inside of a closed surface is not on it");

    let text = serde_json::to_string(&mesh).unwrap();
    let back: SimplexMesh<3, 3> = serde_json::from_str(&text).unwrap();
    back.check_invariants().unwrap();
    assert!(back.cells().all(|c| back.oriented(c) == mesh.oriented(c)));
    assert!(serde_json::from_str::<SimplexMesh<3, 4>>(&text).is_err());
}

#[test]
fn a_rod_in_space() {
    let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0]];
    let mut mesh = SimplexMesh::<3, 2>::new(points, vec![[1, 0], [1, 2]]).unwrap();
    mesh.refine_around([1.0, 0.0, 0.0], 0.25, &mut MeshChange::default()).unwrap();
    mesh.check_invariants().unwrap();
    assert!((mesh.total_volume() - 3.0).abs() < 1e-15);
    let lengths: Vec<f64> = mesh.cells().map(|c| mesh.volume(c)).collect();
    assert_eq!(lengths.iter().filter(|&&l| l == 0.25).count(), 4);
    let found = mesh.locate([1.0, 1.7, 0.0]).unwrap();
    assert_eq!(mesh.volume(found.cell), 1.0);
    assert!(mesh.locate([1.0, 1.7, 0.1]).is_none());
}
