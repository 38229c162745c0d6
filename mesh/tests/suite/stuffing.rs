//! Isosurface stuffing from outside: conformity, volumes, borders, angles, and what is refused.

use proptest::prelude::*;
use std::collections::HashMap;
use std::ops::ControlFlow;
use stylet_mesh::generate::Tets;
use stylet_mesh::generate::implicit::{Implicit, Strata};
use stylet_mesh::generate::stuff::{
    GenerateError, Refinement, Settings, Stuffed, stuff,
};
use stylet_mesh::geometry::signed_measure;
use stylet_mesh::quality;

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
        let in_face = (0..3).any(|k| points.iter().all(|p| p[k] == lower[k]) || points.iter().all(|p| p[k] == upper[k]));
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
            let even = facet[0] < facet[1] && facet[1] < facet[2]
                || facet[1] < facet[2] && facet[2] < facet[0]
                || facet[2] < facet[0] && facet[0] < facet[1];
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
    let each = (0..tets.cells.len()).map(|i| quality::angles_deg(&corners(tets, i)));
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
        println!("{size} {:e} {:e} {:?}", border_error(&tets, &ellipsoid, 0), report.border_error, angles(&tets));
        assert!(border_error(&tets, &ellipsoid, 0) < 1e-9 && report.border_error < 1e-9);
        let (min, max) = angles(&tets);
        println!("{} tets, {} points, {min} {max}", tets.cells.len(), tets.points.len());
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
    println!("{} {min} {max}", tets.cells.len());
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
        println!("{z} {:?} {:e} {:?}", report.volumes, report.border_error, angles(&tets));
        assert!((report.volumes[0] - 0.2).abs() < 1e-9 && (report.volumes[1] - 0.234).abs() < 1e-9);
        assert!(report.border_error < 1e-9);
    }
}

#[test]
fn nested_touching_and_crossing_solids_conform() {
    let cases = [
        vec![ball([0.5; 3], 0.2), ball([0.5; 3], 0.35)],
        vec![ball([0.3, 0.5, 0.5], 0.2), ball([0.7, 0.5, 0.5], 0.2)],
        vec![ball([0.42, 0.5, 0.5], 0.25), ball([0.6, 0.5, 0.5], 0.25), Shape::Block { centre: [0.5; 3], half: [0.4, 0.2, 0.15] }],
        vec![ball([0.42, 0.5, 0.5], 0.25), Shape::Block { centre: [0.5, 0.5, 0.2], half: [0.6, 0.6, 0.27] }],
    ];
    for shapes in cases {
        let settings = Settings::new(1.0 / 16.0);
        let strata = strata(&shapes);
        let Stuffed { tets, report } = run(&strata, UNIT, &settings).unwrap();
        check_filling(&tets, UNIT);
        println!("{:?} {:?} error {:e} {:?} {:?}", report.volumes, report.sampled_volumes, report.border_error, angles(&tets), report.warnings);
        assert!(border_error(&tets, &shapes[0], 0) < 1e-9);
        assert!(report.border_error < 1e-3);
        tets.into_mesh().unwrap();
    }
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn random_unions_conform(shapes in prop::collection::vec(shape(), 1..4)) {
        let strata = Strata::new(vec![Box::new(Union(shapes.clone()))]);
        let Stuffed { tets, report } = run(&strata, UNIT, &Settings { coarsest: 0.2, ..Settings::new(0.1) }).unwrap();
        check_filling(&tets, UNIT);
        prop_assert!(report.warnings.is_empty(), "{:?}", report.warnings);
        let (min, max) = angles(&tets);
        let touches = shapes.iter().any(|s| { let [l, h] = s.bounds().unwrap(); (0..3).any(|k| l[k] < 0.0 || h[k] > 1.0) });
        println!("union {touches} {min} {max}");
        prop_assert!(report.border_error < 1e-3);
    }

    #[test]
    fn random_solids_in_order_conform(shapes in prop::collection::vec(shape(), 2..4)) {
        match run(&strata(&shapes), UNIT, &Settings { coarsest: 0.2, ..Settings::new(0.1) }) {
            Ok(Stuffed { tets, report }) => {
                check_filling(&tets, UNIT);
                let (min, max) = angles(&tets);
                println!("order {min} {max} {:e} {:e} {:?}", border_error(&tets, &shapes[0], 0), report.border_error, report.warnings);
                let missed = border_error(&tets, &shapes[0], 0);
                prop_assert!(missed <= report.border_error.max(1e-9) && missed < 0.05, "{missed:e} {:e}", report.border_error);
                tets.into_mesh().unwrap();
            }
            // A solid that is all but hidden has no cell.
            Err(GenerateError::NoCells { solid, .. }) => { println!("none"); prop_assert!(solid > 0) },
            Err(other) => prop_assert!(false, "{other}"),
        }
    }
}
