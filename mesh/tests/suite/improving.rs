//! Improvement of meshes with borders: what it must reach, and what it must leave.

use proptest::prelude::*;
use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::PI,
    ops::ControlFlow,
};
use stylet_mesh::generate::implicit::{
    Capsule, Cuboid, Cylinder, Ellipsoid, HalfSpace, Implicit, Placed, ShapeError, Shell, SmoothUnion, Sphere, Strata,
    TorusArc, gradient,
};
use stylet_mesh::generate::improve::{ImproveReport, ImproveSettings, improve};
use stylet_mesh::generate::stuff::{Settings, stuff};
use stylet_mesh::generate::{Tets, kuhn_box};
use stylet_mesh::geometry::{circumradius, signed_measure};

const BOX: [[f64; 3]; 2] = [[0.0; 3], [1.0; 3]];

/// Cubes along an edge of the box.
const N: usize = 8;

fn improved(tets: &Tets, strata: &Strata, conforming: &[bool], settings: &ImproveSettings) -> (Tets, ImproveReport) {
    let mut tets = tets.clone();
    let report = improve(&mut tets, strata, conforming, BOX, settings, &mut |_| ControlFlow::Continue(()));
    (tets, report.expect("a good mesh"))
}

/// A mesh straight from stuffing.
fn stuffed(strata: &Strata, domain: [[f64; 3]; 2], size: f64) -> Tets {
    stuff(strata, domain, &Settings::new(size), &mut |_| ControlFlow::Continue(())).expect("a good scene").tets
}

/// A rough mesh of solids in the unit box that conforms all the same: a lattice with near vertices moved onto each surface,
/// and all cells around each edge that still crosses it divided at the cut point, one edge after another.
fn rough(strata: &Strata) -> Tets {
    let lattice = kuhn_box::<3, 4>(BOX[0], BOX[1], [N; 3]).unwrap();
    let mut points = lattice.points().to_vec();
    let mut cells: Vec<[u32; 4]> = lattice.cells().map(|c| lattice.oriented(c).map(|v| v.index() as u32)).collect();
    let h = 1.0 / N as f64;
    let mut taken = vec![false; points.len()];
    for solid in strata.solids() {
        for (p, taken) in points.iter_mut().zip(&mut taken) {
            let interior = p.iter().all(|x| *x > 0.01 && *x < 0.99);
            if interior && !*taken && solid.distance(p).abs() < 0.2 * h {
                *p = onto(&**solid, *p);
                *taken = true;
            }
        }
    }
    for solid in strata.solids() {
        let sign = |p: &[f64; 3]| {
            let d = solid.distance(p);
            i8::from(d > 1e-9 * h) - i8::from(d < -1e-9 * h)
        };
        let mut signs: Vec<i8> = points.iter().map(sign).collect();
        loop {
            let edges = cells.iter().flat_map(|c| (0..4).flat_map(move |j| (0..j).map(move |i| [c[i], c[j]])));
            let Some([a, b]) = { edges }.find(|e| signs[e[0] as usize] * signs[e[1] as usize] < 0) else { break };
            let middle = points.len() as u32;
            points.push(cut(&**solid, points[a as usize], points[b as usize]));
            signs.push(0);
            for c in 0..cells.len() {
                if cells[c].contains(&a) && cells[c].contains(&b) {
                    cells.push(cells[c].map(|v| if v == a { middle } else { v }));
                    cells[c] = cells[c].map(|v| if v == b { middle } else { v });
                }
            }
        }
    }
    // A cell is in a solid if no corner is outside; one with all corners on the surface, if its centroid is inside.
    let holds = |solid: &dyn Implicit, cell: &[[f64; 3]; 4]| {
        let values = cell.map(|p| solid.distance(&p));
        let centroid = std::array::from_fn(|k| 0.25 * cell.iter().map(|p| p[k]).sum::<f64>());
        let near = 1e-8 * h;
        values.iter().all(|d| *d < near) && (values.iter().any(|d| *d < -near) || solid.distance(&centroid) < 0.0)
    };
    let region = |cell: &[u32; 4]| {
        let corners = cell.map(|v| points[v as usize]);
        strata.solids().iter().position(|solid| holds(&**solid, &corners)).unwrap_or(strata.background()) as u32
    };
    let regions = cells.iter().map(region).collect();
    Tets { points, cells, regions }
}

fn onto(solid: &dyn Implicit, mut p: [f64; 3]) -> [f64; 3] {
    for _ in 0..20 {
        let (d, slope) = (solid.distance(&p), gradient(solid, &p, 1e-6));
        p = std::array::from_fn(|k| p[k] - d * slope[k]);
    }
    p
}

fn cut(solid: &dyn Implicit, mut a: [f64; 3], mut b: [f64; 3]) -> [f64; 3] {
    let inside = solid.distance(&a) < 0.0;
    for _ in 0..100 {
        let middle = std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
        *if (solid.distance(&middle) < 0.0) == inside { &mut a } else { &mut b } = middle;
    }
    a
}

fn corners<const M: usize>(tets: &Tets, ids: &[u32; M]) -> [[f64; 3]; M] {
    ids.map(|v| tets.points[v as usize])
}

fn volume(tets: &Tets, region: u32) -> f64 {
    let cells = tets.cells.iter().zip(&tets.regions).filter(|(_, r)| **r == region);
    cells.map(|(cell, _)| signed_measure(&corners(tets, cell))).sum()
}

/// The facets between each two regions.
type Borders = BTreeMap<[u32; 2], Vec<[u32; 3]>>;

/// The facets of the borders, and those of the boundary.
fn facets(tets: &Tets) -> (Borders, Vec<[u32; 3]>) {
    let mut seen: BTreeMap<[u32; 3], Vec<u32>> = BTreeMap::new();
    for (cell, &region) in tets.cells.iter().zip(&tets.regions) {
        for i in 0..4 {
            let mut key = [0, 1, 2].map(|k| cell[(i + 1 + k) % 4]);
            key.sort_unstable();
            seen.entry(key).or_default().push(region);
        }
    }
    let (mut borders, mut boundary) = (Borders::new(), vec![]);
    for (facet, regions) in seen {
        match regions[..] {
            [_] => boundary.push(facet),
            [a, b] if a != b => borders.entry([a.min(b), a.max(b)]).or_default().push(facet),
            [_, _] => {}
            _ => panic!("{} cells share a facet", regions.len()),
        }
    }
    (borders, boundary)
}

/// What must hold of any improved mesh of the unit box, against the mesh before.
fn check(before: &Tets, after: &Tets, strata: &Strata, report: &ImproveReport) {
    assert!(after.cells.iter().all(|cell| signed_measure(&corners(after, cell)) > 0.0));
    // The boundary is closed and flat: facets with their vertices on one face of the box, which fill all faces.
    let (borders, boundary) = facets(after);
    let on_face = |f: &[u32; 3]| {
        (0..3).any(|k| [0.0, 1.0].iter().any(|side| corners(after, f).iter().all(|p| (p[k] - side).abs() < 1e-12)))
    };
    assert!(boundary.iter().all(on_face));
    let area: f64 = boundary.iter().map(|f| signed_measure(&corners(after, f))).sum();
    assert!((area - 6.0).abs() < 1e-12, "{area}");
    let whole: f64 = (0..=strata.background() as u32).map(|region| volume(after, region)).sum();
    assert!((whole - 1.0).abs() < 1e-12, "{whole}");
    // Borders are in their surfaces, with as many facets as before, since none is ever replaced.
    let (old_borders, _) = facets(before);
    for (pair, facets) in &borders {
        assert_eq!(facets.len(), old_borders[pair].len());
        let solid = &strata.solids()[pair[0] as usize];
        for &v in facets.as_flattened() {
            let d = solid.distance(&after.points[v as usize]).abs();
            let stayed = before.points[v as usize] == after.points[v as usize];
            assert!(d < 1e-6 / N as f64 || stayed, "{d:e}");
        }
    }
    // Those that are not, as where three regions meet, have never been.
    let off = |([solid, _], facets): (&[u32; 2], &Vec<[u32; 3]>)| {
        let distance = |&v: &u32| strata.solids()[*solid as usize].distance(&before.points[v as usize]).abs();
        facets.as_flattened().iter().map(distance).fold(0.0, f64::max)
    };
    let off_before = old_borders.iter().map(off).fold(0.0, f64::max);
    assert!(report.border_error <= off_before.max(1e-6 / N as f64), "{:e} {off_before:e}", report.border_error);
    // The worst never gets worse.
    assert!(report.after.min_deg >= report.before.min_deg - 1e-9);
    assert!(report.after.max_deg <= report.before.max_deg + 1e-9);
    assert!(report.after.min_quality >= report.before.min_quality - 1e-12);
}

fn place() -> impl Strategy<Value = [f64; 3]> {
    [0.35..0.65, 0.35..0.65, 0.35..0.65]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn an_ellipsoid_keeps_its_surface(centre in place(), axes in [0.2..0.33, 0.2..0.33, 0.2..0.33]) {
        let strata = Strata::new(vec![Box::new(Ellipsoid::new(centre, axes).unwrap())]);
        let before = rough(&strata);
        let (after, report) = improved(&before, &strata, &[], &ImproveSettings::default());
        check(&before, &after, &strata, &report);
        prop_assert_eq!(report.astray, 0);
        prop_assert!(report.after.min_deg > 1.5 * report.before.min_deg);
        let again = improved(&before, &strata, &[], &ImproveSettings::default());
        prop_assert_eq!((after, report), again);
    }

    #[test]
    fn a_ball_keeps_its_volume(centre in place(), radius in 0.2..0.33) {
        let strata = Strata::new(vec![Box::new(Sphere::new(centre, radius).unwrap())]);
        let before = rough(&strata);
        let (after, report) = improved(&before, &strata, &[], &ImproveSettings::default());
        check(&before, &after, &strata, &report);
        // Below each facet of circumradius r the sphere rises by at most R - sqrt(R² - r²), on an area that is at most
        // R² / (R² - r²) times that of the facet.
        let (borders, _) = facets(&after);
        let missing: f64 = borders[&[0, 1]].iter().map(|f| {
            let (corners, r2) = (corners(&after, f), radius * radius);
            let inner2 = r2 - circumradius(&corners).unwrap().powi(2);
            signed_measure(&corners) * (radius - inner2.sqrt()) * r2 / inner2
        }).sum();
        let found = 4.0 / 3.0 * PI * radius.powi(3) - volume(&after, 0);
        prop_assert!(0.0 < found && found < missing, "{found} of {missing}");
    }

    /// Two balls that overlap: their surfaces meet in a circle, and three regions along it.
    #[test]
    fn a_line_where_three_regions_meet_stays_in_both_surfaces(shift in 0.1..0.25, r in 0.2..0.3, s in 0.2..0.3) {
        let ball = |x: f64, r: f64| Box::new(Sphere::new([x, 0.47, 0.51], r).unwrap()) as Box<dyn Implicit>;
        let strata = Strata::new(vec![ball(0.5 - 0.5 * shift, r), ball(0.5 + 0.5 * shift, s)]);
        let before = stuffed(&strata, BOX, 1.0 / N as f64);
        let (after, report) = improved(&before, &strata, &[], &ImproveSettings::default());
        check(&before, &after, &strata, &report);
        let (borders, _) = facets(&after);
        prop_assert!(borders.len() == 3 && report.astray * 20 < borders.values().map(Vec::len).sum(), "{report:?}");
    }
}

/// What makes a solid of random kind, place and size.
type Numbers = (i32, [f64; 3], [f64; 3], [f64; 3], f64);

fn numbers() -> impl Strategy<Value = Numbers> {
    let sizes = [0.12..0.3, 0.12..0.3, 0.12..0.3];
    (0..6, [0.2..0.8, 0.2..0.8, 0.2..0.8], [-1.0..1.0, -1.0..1.0, 0.2..1.0], sizes, 0.0..6.0)
}

/// A solid, with edges or without.
fn any_solid((kind, at, axis, [a, b, c], angle): Numbers) -> Result<Box<dyn Implicit>, ShapeError> {
    let end = [0, 1, 2].map(|k| at[k] + 0.3 * axis[k]);
    Ok(match kind {
        0 => Box::new(Placed::new(Ellipsoid::new([0.0; 3], [a, b, c])?, axis, angle, at)?),
        1 => Box::new(Placed::new(Cuboid::new([-a, -b, -c], [a, b, c])?, axis, angle, at)?),
        2 => Box::new(Cylinder::new(at, end, 0.7 * a)?),
        3 => Box::new(TorusArc::new(at, axis, [1.0, 0.3, 0.1], 1.0 + 0.8 * angle, a, 0.6 * a)?),
        4 => Box::new(SmoothUnion::new(Sphere::new(at, a)?, Capsule::new(at, end, 0.5 * b)?, 0.5 * c)?),
        _ => Box::new(Shell::new(Sphere::new(at, a + 0.05)?, 0.1, 0.05)?),
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the solids, and however they lie over each other and the faces of the box.
    #[test]
    fn any_solids_keep_their_borders(solids in prop::collection::vec(numbers(), 1..4)) {
        let strata = Strata::new(solids.into_iter().map(|numbers| any_solid(numbers).expect("good numbers")).collect());
        let made = stuff(&strata, BOX, &Settings::new(1.0 / N as f64), &mut |_| ControlFlow::Continue(()));
        // One solid may hide another.
        prop_assume!(made.is_ok());
        let before = made.unwrap().tets;
        let (after, report) = improved(&before, &strata, &[], &ImproveSettings::default());
        check(&before, &after, &strata, &report);
    }
}

#[test]
fn borders_reach_the_faces_of_the_box() {
    let strata = Strata::new(vec![Box::new(HalfSpace::new([0.0, 0.0, 0.43], [0.2, 0.1, 1.0]).unwrap())]);
    let before = rough(&strata);
    let (after, report) = improved(&before, &strata, &[], &ImproveSettings::default());
    check(&before, &after, &strata, &report);
    assert!(report.moved > 0);
    // A plane: the volumes do not change at all.
    assert!((volume(&after, 0) - volume(&before, 0)).abs() < 1e-6);
}

#[test]
fn borders_by_element_stay() {
    let strata = Strata::new(vec![Box::new(Sphere::new([0.5; 3], 0.3).unwrap())]);
    let mesh = kuhn_box::<3, 4>(BOX[0], BOX[1], [N; 3]).unwrap();
    let cells: Vec<[u32; 4]> = mesh.cells().map(|c| mesh.oriented(c).map(|v| v.index() as u32)).collect();
    let mut before = Tets { points: mesh.points().to_vec(), cells, regions: vec![] };
    for cell in &before.cells {
        let p = std::array::from_fn(|k| corners(&before, cell).iter().map(|p| p[k]).sum::<f64>() / 4.0);
        before.regions.push(strata.region(&p) as u32);
    }
    let (borders, _) = facets(&before);
    let in_border: BTreeSet<u32> = borders[&[0, 1]].as_flattened().iter().copied().collect();
    for (v, p) in before.points.iter_mut().enumerate() {
        let interior = p.iter().all(|x| *x > 0.01 && *x < 0.99);
        if interior && !in_border.contains(&(v as u32)) {
            *p = [0, 1, 2].map(|k| p[k] + 0.25 / N as f64 * ((3 * v + k) as f64).sin());
        }
    }
    let settings = ImproveSettings { least_angle_deg: 50.0, greatest_angle_deg: 90.0, ..Default::default() };
    let (after, report) = improved(&before, &strata, &[false], &settings);
    assert!(report.moved > 100 && report.after.min_deg > 1.2 * report.before.min_deg, "{report:?}");
    for &v in &in_border {
        assert_eq!(before.points[v as usize], after.points[v as usize]);
    }
    // If it is said to conform, its vertices are off the surface, and stay as well.
    let (after, report) = improved(&before, &strata, &[true], &settings);
    assert!(report.astray > 100);
    for &v in &in_border {
        assert_eq!(before.points[v as usize], after.points[v as usize]);
    }
}

#[test]
fn the_hook_sees_each_sweep_and_can_stop() {
    let strata = Strata::new(vec![Box::new(Sphere::new([0.5; 3], 0.3).unwrap())]);
    let mut tets = rough(&strata);
    let before = tets.clone();
    let mut seen = vec![];
    let report = improve(&mut tets, &strata, &[], BOX, &ImproveSettings::default(), &mut |sweep| {
        seen.push(*sweep);
        if seen.len() == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let report = report.unwrap();
    assert_eq!((seen.len(), report.sweeps, report.stopped), (2, 2, true));
    assert!(seen[1].worst <= seen[0].worst && seen[0].number == 1);
    check(&before, &tets, &strata, &report);
}

/// The ellipsoid of 50 x 40 x 35 mm in a box of 100 mm with about 13,000 cells, as the best generators of the day do it.
#[test]
fn a_stuffed_ellipsoid_reaches_its_targets() {
    let domain = [[-0.05; 3], [0.05; 3]];
    let axes = [0.025, 0.020, 0.0175];
    let strata = Strata::new(vec![Box::new(Ellipsoid::new([0.0; 3], axes).unwrap())]);
    let mut tets = stuffed(&strata, domain, 0.0065);
    let report =
        improve(&mut tets, &strata, &[], domain, &ImproveSettings::default(), &mut |_| ControlFlow::Continue(()))
            .unwrap();
    let angles = report.after;
    assert!(angles.min_deg >= 25.0 && angles.max_deg <= 138.0, "{angles:?}");
    assert!(angles.min_quality >= 0.45 && angles.mean_quality >= 0.82, "{angles:?}");
    assert!(report.astray == 0 && report.border_error < 1e-8, "{report:?}");
    let exact = 4.0 / 3.0 * PI * axes.iter().product::<f64>();
    let found = volume(&tets, 0);
    assert!((found / exact - 1.0).abs() < 0.04, "{found:e} of {exact:e}");
}
