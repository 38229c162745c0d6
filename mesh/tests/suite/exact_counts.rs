//! Counts, angles and shapes that are known exactly.

use stylet_mesh::{BisectError, MeshChange, SimplexMesh, generate::kuhn_box, quality};

#[allow(clippy::approx_constant, reason = "a coordinate, not a logarithm")]
const POINT: [f64; 4] = [0.3141, 0.2718, 0.5772, 0.6931];

fn cube<const D: usize, const N: usize>() -> SimplexMesh<D, N> {
    kuhn_box([0.0; D], [1.0; D], [1; D]).unwrap()
}

fn around<const D: usize, const N: usize>(halvings: i32) -> SimplexMesh<D, N> {
    let mut mesh = cube();
    let point = std::array::from_fn(|k| POINT[k]);
    mesh.refine_around(point, 2_f64.powi(-halvings), &mut MeshChange::default()).unwrap();
    mesh
}

fn everywhere<const D: usize, const N: usize>(size: f64) -> SimplexMesh<D, N> {
    let mut mesh = cube();
    mesh.refine_everywhere(size, &mut MeshChange::default()).unwrap();
    mesh
}

fn assert_counts<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, cells: usize, vertices: usize) {
    assert_eq!((mesh.n_cells(), mesh.n_vertices()), (cells, vertices));
}

fn assert_angles<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, min: f64, max: f64) {
    let quality = quality::summary(mesh);
    // Coordinates are rounded to 1e-16, edges are 1e-6 long at the least.
    assert!((quality.min_angle_deg - min).abs() < 1e-7, "{quality:?}");
    assert!((quality.max_angle_deg - max).abs() < 1e-7, "{quality:?}");
}

#[test]
fn a_point_in_the_square() {
    let mesh = around::<2, 3>(20);
    assert_counts(&mesh, 501, 257);
    assert_angles(&mesh, 45.0, 90.0);
    assert_eq!(quality::shapes(&mesh), 1);
}

#[test]
fn a_point_in_the_cube() {
    let mesh = around::<3, 4>(7);
    assert_counts(&mesh, 2_104, 417);
    assert_angles(&mesh, 45.0, 120.0);
    assert_eq!(quality::shapes(&mesh), 3);
}

#[test]
fn a_point_in_the_tesseract() {
    let mesh = around::<4, 5>(4);
    assert_eq!(quality::shapes(&mesh), 4);
}

#[test]
fn a_needle_in_the_cube() {
    let mut mesh = cube::<3, 4>();
    let (a, b) = ([-0.01, 0.431, 0.527], [0.713, 0.489, 0.561]);
    mesh.refine_along(a, b, 2_f64.powi(-7), &mut MeshChange::default()).unwrap();
    assert_counts(&mesh, 16_758, 3_135);
    assert_angles(&mesh, 45.0, 120.0);
    assert_eq!(quality::shapes(&mesh), 3);
}

#[test]
fn uniform_refinement() {
    let square = everywhere::<2, 3>(2_f64.powi(-7) * 2_f64.sqrt());
    assert_counts(&square, 32_768, 16_641);
    assert_eq!(quality::shapes(&square), 1);
    // All cells of one level are alike; the levels of a cycle have three shapes.
    for (size, shapes) in [(2_f64.powi(-3) * 3_f64.sqrt(), 1), (2_f64.powi(-3) * 2_f64.sqrt(), 1), (0.125, 1)] {
        assert_eq!(quality::shapes(&everywhere::<3, 4>(size)), shapes);
    }
    assert_counts(&everywhere::<3, 4>(2_f64.powi(-3) * 3_f64.sqrt()), 6 * 512, 729);
    // Three bisections do: the corners, and the centres of the 24 squares, of the 8 cubes and of the whole.
    assert_counts(&everywhere::<4, 5>(1.0), 24 * 8, 16 + 24 + 8 + 1);
}

/// Tree, neighbours and vertices, as number of entries times size of an entry.
#[test]
fn bytes_per_cell() {
    let square = everywhere::<2, 3>(2_f64.powi(-7));
    assert!(square.bytes() <= 80 * square.n_cells(), "{} bytes, {} cells", square.bytes(), square.n_cells());
    // At whole cubes; a bisection or two before there are more vertices per cell, and up to 88.3 bytes.
    let cube = everywhere::<3, 4>(2_f64.powi(-5) * 3_f64.sqrt());
    assert!(cube.bytes() <= 88 * cube.n_cells(), "{} bytes, {} cells", cube.bytes(), cube.n_cells());
}

#[test]
fn a_limit_on_bisections_holds_per_call() {
    let mut mesh = cube::<3, 4>();
    mesh.set_bisection_limit(100);
    let mut change = MeshChange::default();
    let mut cells = mesh.n_cells();
    loop {
        let outcome = mesh.refine_around([0.3141, 0.2718, 0.5772], 2_f64.powi(-7), &mut change);
        // A cell more for every bisection.
        assert!(mesh.n_cells() - cells <= 100);
        cells = mesh.n_cells();
        match outcome {
            Ok(()) => break,
            Err(error) => assert!(matches!(error, BisectError::BisectionLimit { limit: 100, .. }), "{error}"),
        }
    }
    mesh.check_invariants().unwrap();
    // The order of the bisections differs, the mesh does not.
    assert_counts(&mesh, 2_104, 417);
    assert_eq!((change.died.len(), change.born.len()), (6, 2_104));
}

#[test]
fn the_slab() {
    let leg = |k: i32| 0.1 * 2_f64.powi(-k) * 2_f64.sqrt();
    let mut mesh = kuhn_box::<2, 3>([0.0; 2], [0.1; 2], [1; 2]).unwrap();
    let mut change = MeshChange::default();
    mesh.refine_everywhere(leg(3), &mut change).unwrap();
    mesh.refine_along([0.0, 0.05], [0.07, 0.05], leg(6), &mut change).unwrap();
    assert_counts(&mesh, 540, 290);
    // Both calls went into one change, which is still net.
    assert_eq!((change.died.len(), change.born.len(), change.vertices.len()), (2, 540, 286));
}

#[test]
fn absurd_sizes_are_refused_at_once() {
    let mut mesh = cube::<3, 4>();
    let mut change = MeshChange::default();
    let refused = mesh.refine_everywhere(1e-9, &mut change);
    assert!(matches!(refused, Err(BisectError::SlotLimit { .. })), "{refused:?}");
    let refused = mesh.refine_along([0.0; 3], [1.0; 3], 1e-15, &mut change);
    assert!(matches!(refused, Err(BisectError::SlotLimit { .. })), "{refused:?}");
    assert!(change.is_empty());
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(mesh.refine_around([0.5; 3], size, &mut change), Err(BisectError::Size { .. })));
    }
    for x in [f64::NAN, f64::NEG_INFINITY, 1e308] {
        assert!(matches!(mesh.refine_around([x; 3], 0.1, &mut change), Err(BisectError::Point { .. })));
        assert!(matches!(mesh.refine_along([0.1; 3], [0.2, 0.3, x], 0.1, &mut change), Err(BisectError::Point { .. })));
        assert!(mesh.locate([x; 3]).is_none());
    }
    // Far away is outside, and a segment that comes from there is as good as a short one.
    mesh.refine_around([1e99; 3], 0.1, &mut change).unwrap();
    assert!(change.is_empty());
    mesh.refine_along([0.3, 0.4, -1e9], [0.3, 0.4, 1e9], 0.3, &mut change).unwrap();
    assert!(mesh.longest_edge(mesh.locate([0.3, 0.4, 0.5]).unwrap().cell) <= 0.3);
}

#[test]
fn a_size_below_the_resolution_ends_in_an_error() {
    let mut mesh = cube::<2, 3>();
    let mut change = MeshChange::default();
    let outcome = mesh.refine_around([0.3141, 0.2718], 1e-300, &mut change);
    assert!(matches!(outcome, Err(BisectError::Resolution { .. })), "{outcome:?}");
    assert_eq!(change.born.len(), mesh.n_cells());
}
