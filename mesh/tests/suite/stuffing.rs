//! Isosurface stuffing from outside: conformity, volumes, borders, angles, and what is refused.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::collections::HashMap;
use std::ops::ControlFlow;
use stylet_mesh::generate::Tets;
use stylet_mesh::generate::implicit::{Implicit, Strata};
use stylet_mesh::generate::stuff::{
    Border, GenerateError, Refinement, Settings, SolidSettings, Step, Stuffed, Warning, stuff,
};
use stylet_mesh::geometry::signed_measure;
use stylet_mesh::{MeshChange, quality};

const UNIT: [[f64; 3]; 2] = [[0.0; 3], [1.0; 3]];

/// A shape for tests; its distance is exact for a ball, else of slope about one near the surface.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Ellipsoid { centre: [f64; 3], radii: [f64; 3] },
    Block { centre: [f64; 3], half: [f64; 3] },
}

impl Implicit for Shape {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        match *self {
            Self::Ellipsoid { centre, radii } => {
                let norm = |power: i32| {
                    (0..3).map(|k| ((p[k] - centre[k]) / radii[k].powi(power)).powi(2)).sum::<f64>().sqrt()
                };
                let (scaled, slope) = (norm(1), norm(2));
                if slope == 0.0 { -radii[0].min(radii[1]).min(radii[2]) } else { scaled * (scaled - 1.0) / slope }
            }
            Self::Block { centre, half } => {
                let q: [f64; 3] = std::array::from_fn(|k| (p[k] - centre[k]).abs() - half[k]);
                let outside = q.iter().map(|x| x.max(0.0).powi(2)).sum::<f64>().sqrt();
                outside + q[0].max(q[1]).max(q[2]).min(0.0)
            }
        }
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let (Self::Ellipsoid { centre, radii: half } | Self::Block { centre, half }) = *self;
        Some([std::array::from_fn(|k| centre[k] - half[k]), std::array::from_fn(|k| centre[k] + half[k])])
    }
}

/// The union of some shapes.
struct Union(Vec<Shape>);

impl Implicit for Union {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        self.0.iter().map(|s| s.distance(p)).fold(f64::INFINITY, f64::min)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        None
    }
}

fn ball(centre: [f64; 3], radius: f64) -> Shape {
    Shape::Ellipsoid { centre, radii: [radius; 3] }
}

fn strata(shapes: &[Shape]) -> Strata {
    Strata::new(shapes.iter().map(|s| Box::new(*s) as Box<dyn Implicit>).collect())
}

fn run(strata: &Strata, domain: [[f64; 3]; 2], settings: &Settings) -> Result<Stuffed, GenerateError> {
    stuff(strata, domain, settings, &mut |_| ControlFlow::Continue(()))
}

fn corners(tets: &Tets, cell: usize) -> [[f64; 3]; 4] {
    tets.cells[cell].map(|v| tets.points[v as usize])
}

/// The sum with the errors of its additions carried along.
fn sum(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut carry) = (0.0, 0.0);
    for value in values {
        let y = value - carry;
        let t = sum + y;
        carry = (t - sum) - y;
        sum = t;
    }
    sum
}

/// Positive volumes that fill the box, facets that two cells see from opposite sides or that lie in a face of the box.
fn check_filling(tets: &Tets, [lower, upper]: [[f64; 3]; 2]) {
    let volumes = (0..tets.cells.len()).map(|i| signed_measure(&corners(tets, i)));
    assert!(volumes.clone().all(|v| v > 0.0), "inverted or flat: {:e}", volumes.fold(f64::INFINITY, f64::min));
    let expected: f64 = (0..3).map(|k| upper[k] - lower[k]).product();
    let total = sum(volumes);
    assert!((total - expected).abs() <= 1e-12 * expected, "{total:e} of {expected:e}");
    for facet in open_facets(tets) {
        let points = facet.map(|v| tets.points[v as usize]);
        let in_face =
            (0..3).any(|k| points.iter().all(|p| p[k] == lower[k]) || points.iter().all(|p| p[k] == upper[k]));
        assert!(in_face, "{points:?}");
    }
}

/// Facets of one cell only; the others are seen twice, from opposite sides.
fn open_facets(tets: &Tets) -> Vec<[u32; 3]> {
    let mut seen: HashMap<[u32; 3], Vec<bool>> = HashMap::new();
    for cell in &tets.cells {
        for (i, facet) in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].iter().enumerate() {
            let mut facet = facet.map(|j| cell[j]);
            assert!(!facet.contains(&cell[i]));
            // Whether sorting is an even permutation.
            let smaller = |a: usize, b: usize| facet[a] < facet[b];
            let even = smaller(0, 1) ^ smaller(1, 2) ^ smaller(0, 2);
            facet.sort_unstable();
            seen.entry(facet).or_default().push(even);
        }
    }
    assert!(seen.values().all(|s| s.len() == 1 || s.len() == 2 && s[0] != s[1]));
    seen.into_iter().filter(|(_, s)| s.len() == 1).map(|(facet, _)| facet).collect()
}

/// The largest distance from the surface of a vertex between a region and others.
fn border_error(tets: &Tets, shape: &dyn Implicit, region: u32) -> f64 {
    let mut sides = vec![[false; 2]; tets.points.len()];
    for (cell, r) in tets.cells.iter().zip(&tets.regions) {
        cell.iter().for_each(|v| sides[*v as usize][usize::from(*r == region)] = true);
    }
    let between = sides.iter().zip(&tets.points).filter(|(s, _)| s[0] && s[1]);
    between.map(|(_, p)| shape.distance(p).abs()).fold(0.0, f64::max)
}

/// Least and greatest dihedral angle, degrees.
fn angles(tets: &Tets) -> (f64, f64) {
    extremes(tets, 0..tets.cells.len())
}

/// The same for some cells.
fn extremes(tets: &Tets, cells: impl Iterator<Item = usize>) -> (f64, f64) {
    let each = cells.map(|i| quality::angles_deg(&corners(tets, i)));
    each.fold((180.0, 0.0), |(min, max), (a, b)| (min.min(a), max.max(b)))
}

#[test]
fn an_ellipsoid_in_a_box_keeps_its_volume_its_surface_and_the_bounds_of_angles() {
    let ellipsoid = Shape::Ellipsoid { centre: [0.05; 3], radii: [0.025, 0.020, 0.0175] };
    let domain = [[0.0; 3], [0.1; 3]];
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.025 * 0.020 * 0.0175;
    for (size, tolerance) in [(0.005, 0.017), (0.0025, 0.005)] {
        let Stuffed { tets, report } = run(&strata(&[ellipsoid]), domain, &Settings::new(size)).unwrap();
        check_filling(&tets, domain);
        assert!((report.volumes[0] / exact - 1.0).abs() < tolerance, "{}", report.volumes[0] / exact);
        assert!((report.sampled_volumes[0] / exact - 1.0).abs() < 0.01);
        assert!(report.warnings.is_empty());
        assert!(border_error(&tets, &ellipsoid, 0) < 1e-9 && report.border_error < 1e-9);
        let (min, max) = angles(&tets);
        assert!(min >= 8.9 && max <= 160.0, "{min} {max}");
        tets.into_mesh().unwrap().check_invariants().unwrap();
    }
}

#[test]
fn a_lattice_without_solids_has_the_angles_of_its_six_kinds_of_cells() {
    let refinements = vec![Refinement { shape: Box::new(ball([0.3; 3], 0.1)), size: 1.0 / 64.0 }];
    let settings = Settings { refinements, ..Settings::new(1.0 / 8.0) };
    let Stuffed { tets, report } = run(&strata(&[]), UNIT, &settings).unwrap();
    check_filling(&tets, UNIT);
    assert_eq!((report.coarser_levels, report.finer_levels), (2, 3));
    let (min, max) = angles(&tets);
    // The angles of Labelle & Shewchuk's graded lattice.
    assert!(min > 45.0 - 1e-9 && max < 120.0 + 1e-9, "{min} {max}");
}

#[test]
fn a_uniform_lattice_has_twelve_cells_per_cube_and_half_cells_at_the_faces() {
    let settings = Settings { coarsest: 0.25, ..Settings::new(0.25) };
    let Stuffed { tets, report } = run(&strata(&[]), UNIT, &settings).unwrap();
    check_filling(&tets, UNIT);
    // 4 cells per inner face of two cubes and per outer face: 4 (3 4 4 3 + 6 4 4).
    assert_eq!((report.n_cubes, tets.cells.len()), (64, 4 * (144 + 96)));
    assert_eq!(tets.points.len(), 125 + 64 + 96);
    let (min, max) = angles(&tets);
    assert!((min - 45.0).abs() < 1e-9 && (max - 90.0).abs() < 1e-9);
}

#[test]
fn planes_that_cross_the_box_leave_its_faces_sharp() {
    // Slabs through the whole box, and one in a lattice plane.
    let slab = |z: f64, half: f64| Shape::Block { centre: [0.5, 0.5, z], half: [2.0, 2.0, half] };
    for z in [0.31, 0.37, 0.4375, 0.5] {
        let shapes = [slab(z, 0.1), slab(z, 0.217)];
        let Stuffed { tets, report } = run(&strata(&shapes), UNIT, &Settings::new(1.0 / 16.0)).unwrap();
        check_filling(&tets, UNIT);
        assert!((report.volumes[0] - 0.2).abs() < 1e-9 && (report.volumes[1] - 0.234).abs() < 1e-9);
        assert!(report.border_error < 1e-9);
    }
}

#[test]
fn nested_touching_and_crossing_solids_conform() {
    let cases = [
        vec![ball([0.5; 3], 0.2), ball([0.5; 3], 0.35)],
        vec![ball([0.3, 0.5, 0.5], 0.2), ball([0.7, 0.5, 0.5], 0.2)],
        vec![
            ball([0.42, 0.5, 0.5], 0.25),
            ball([0.6, 0.5, 0.5], 0.25),
            Shape::Block { centre: [0.5; 3], half: [0.4, 0.2, 0.15] },
        ],
        vec![ball([0.42, 0.5, 0.5], 0.25), Shape::Block { centre: [0.5, 0.5, 0.2], half: [0.6, 0.6, 0.27] }],
    ];
    for shapes in cases {
        let settings = Settings::new(1.0 / 16.0);
        let strata = strata(&shapes);
        let Stuffed { tets, report } = run(&strata, UNIT, &settings).unwrap();
        check_filling(&tets, UNIT);
        assert!(border_error(&tets, &shapes[0], 0) < 1e-9);
        assert!(report.border_error < 1e-3);
        tets.into_mesh().unwrap();
    }
}

#[test]
fn a_block_of_cubes_is_bisected_into_few_shapes() {
    let settings = Settings { coarsest: 0.125, ..Settings::new(0.125) };
    let mut mesh = run(&strata(&[]), UNIT, &settings).unwrap().tets.into_mesh().unwrap();
    // Cells between two cubes, and their halves at the faces of the box.
    assert_eq!(quality::shapes(&mesh), 2);
    let mut change = MeshChange::default();
    mesh.refine_around([0.51, 0.47, 0.53], 1.0 / 64.0, &mut change).unwrap();
    mesh.check_invariants().unwrap();
    assert_eq!(quality::shapes(&mesh), 18);
    // The half cells at the faces of the box add theirs.
    mesh.refine_around([0.01, 0.47, 0.53], 1.0 / 64.0, &mut change).unwrap();
    mesh.check_invariants().unwrap();
    assert_eq!(quality::shapes(&mesh), 30);
}

#[test]
fn a_solid_by_element_takes_its_cells_by_their_centroids() {
    let shapes = [ball([0.5; 3], 0.2), ball([0.5; 3], 0.35)];
    let solids = vec![SolidSettings { border: Border::ByElement, size: Some(0.05) }, SolidSettings::default()];
    let settings = Settings { solids, ..Settings::new(0.1) };
    let Stuffed { tets, .. } = run(&strata(&shapes), UNIT, &settings).unwrap();
    check_filling(&tets, UNIT);
    for (i, region) in tets.regions.iter().enumerate() {
        let corners = corners(&tets, i);
        let centroid = std::array::from_fn(|k| 0.25 * corners.iter().map(|p| p[k]).sum::<f64>());
        assert_eq!(shapes[0].distance(&centroid) < 0.0, *region == 0);
    }
    assert!(border_error(&tets, &shapes[1], 2) < 1e-9);
}

#[test]
fn without_a_background_only_the_solids_are_kept() {
    let shape = ball([0.5; 3], 0.3);
    let settings = Settings { background: false, ..Settings::new(0.1) };
    let Stuffed { tets, report } = run(&strata(&[shape]), UNIT, &settings).unwrap();
    assert!(tets.regions.iter().all(|r| *r == 0) && report.volumes[1] == 0.0);
    for facet in open_facets(&tets) {
        assert!(facet.iter().all(|v| shape.distance(&tets.points[*v as usize]).abs() < 1e-9));
    }
    tets.into_mesh().unwrap();
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let shapes = [ball([0.4; 3], 0.2), ball([0.6; 3], 0.25)];
    let once = || run(&strata(&shapes), UNIT, &Settings::new(0.1)).unwrap();
    assert_eq!(once(), once());
}

/// A solid whose distance is not a number beyond a plane.
struct Broken;

impl Implicit for Broken {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        if p[0] > 0.8 { f64::NAN } else { p[0] - 0.4 }
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        None
    }
}

#[test]
fn bad_input_is_refused_by_name() {
    let solid = [ball([0.5; 3], 0.2)];
    let refused = |domain, settings: &Settings| run(&strata(&solid), domain, settings).unwrap_err();
    let flat = [[0.0; 3], [1.0, 0.0, 1.0]];
    assert!(matches!(refused(flat, &Settings::new(0.1)), GenerateError::Box { axis: 1, .. }));
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(UNIT, &Settings::new(size)), GenerateError::Size { .. }));
    }
    let solids = vec![SolidSettings::default(); 2];
    let error = refused(UNIT, &Settings { solids, ..Settings::new(0.1) });
    assert_eq!(error, GenerateError::SolidSettings { expected: 1, found: 2 });
    let error = run(&Strata::new(vec![Box::new(Broken)]), UNIT, &Settings::new(0.1)).unwrap_err();
    assert!(matches!(error, GenerateError::NotANumber { solid: 0, point } if point[0] > 0.8));
    let nothing = Settings { background: false, ..Settings::new(0.1) };
    assert_eq!(run(&strata(&[]), UNIT, &nothing).unwrap_err(), GenerateError::Nothing);
}

#[test]
fn a_billion_tetrahedra_are_refused_before_they_are_made() {
    let solid = [ball([0.5; 3], 0.3)];
    // As many small cubes as that, or as many along the border of large ones.
    for settings in
        [Settings { coarsest: 0.002, ..Settings::new(0.002) }, Settings { coarsest: 0.1, ..Settings::new(1e-4) }]
    {
        let Err(GenerateError::TooManyTets { estimate, limit }) = run(&strata(&solid), UNIT, &settings) else {
            panic!("not refused");
        };
        assert!(estimate > 1e9 && limit == settings.max_tets, "{estimate}");
    }
}

#[test]
fn solids_that_the_lattice_does_not_show_are_named() {
    let outside = ball([2.0; 3], 0.1);
    let tiny = ball([0.512, 0.489, 0.517], 0.001);
    for solid in [outside, tiny] {
        let shapes = [ball([0.25; 3], 0.2), solid];
        let error = run(&strata(&shapes), UNIT, &Settings::new(0.1)).unwrap_err();
        assert_eq!(error, GenerateError::NoCells { solid: 1, size: 0.1 });
    }
    // A plate of a tenth of a cube's thickness in a lattice plane.
    let plate = Shape::Block { centre: [0.5; 3], half: [0.3, 0.3, 0.011] };
    match run(&strata(&[plate]), UNIT, &Settings::new(0.1)) {
        Err(GenerateError::NoCells { solid: 0, .. }) => {}
        Ok(Stuffed { report, .. }) => {
            assert!(matches!(report.warnings[..], [Warning::Volume { solid: 0, .. }]), "{:?}", report.volumes);
        }
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn the_hook_sees_each_step_and_may_stop() {
    let solid = [ball([0.5; 3], 0.2)];
    let mut steps = Vec::new();
    let result = stuff(&strata(&solid), UNIT, &Settings::new(0.1), &mut |step| {
        steps.push(step);
        if step == (Step::Border { solid: 0 }) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(result.unwrap_err(), GenerateError::Cancelled);
    assert!(matches!(steps[..], [Step::Cubes { level: 0 }, .., Step::Lattice { .. }, Step::Border { solid: 0 }]));
}

fn shape() -> impl Strategy<Value = Shape> {
    let at = || prop::array::uniform3(0.25..0.75);
    let half = || prop::array::uniform3(0.15..0.3);
    prop_oneof![
        (at(), 0.15..0.3).prop_map(|(centre, radius)| ball(centre, radius)),
        (at(), half()).prop_map(|(centre, radii)| Shape::Ellipsoid { centre, radii }),
        (at(), half()).prop_map(|(centre, half)| Shape::Block { centre, half }),
    ]
}

/// 200 cases, the same in each run.
fn cases() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(2007), ..ProptestConfig::with_cases(200) }
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn random_unions_conform(shapes in prop::collection::vec(shape(), 1..4)) {
        let strata = Strata::new(vec![Box::new(Union(shapes.clone()))]);
        let Stuffed { tets, report } = run(&strata, UNIT, &Settings { coarsest: 0.2, ..Settings::new(0.1) }).unwrap();
        check_filling(&tets, UNIT);
        prop_assert!(report.warnings.is_empty(), "{:?}", report.warnings);
        // Cells of the cubes at the faces of the box have no proven bounds.
        let inner = |i: &usize| corners(&tets, *i).iter().flatten().all(|x| (0.1 - 1e-9..0.9 + 1e-9).contains(x));
        let (min, max) = extremes(&tets, (0..tets.cells.len()).filter(inner));
        prop_assert!(min >= 8.9 && max <= 160.0, "{min} {max}");
        prop_assert!(report.border_error < 1e-3);
    }

    #[test]
    fn random_solids_in_order_conform(shapes in prop::collection::vec(shape(), 2..4)) {
        match run(&strata(&shapes), UNIT, &Settings { coarsest: 0.2, ..Settings::new(0.1) }) {
            Ok(Stuffed { tets, report }) => {
                check_filling(&tets, UNIT);
                let missed = border_error(&tets, &shapes[0], 0);
                prop_assert!(missed <= report.border_error.max(1e-9) && missed < 0.05, "{missed:e} {:e}", report.border_error);
                tets.into_mesh().unwrap();
            }
            // A solid that is all but hidden has no cell.
            Err(GenerateError::NoCells { solid, .. }) => prop_assert!(solid > 0),
            Err(other) => prop_assert!(false, "{other}"),
        }
    }
}
