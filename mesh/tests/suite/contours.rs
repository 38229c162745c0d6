//! Contours on parallel slices: known solids against exact volumes and surfaces, random stacks, bad drawings.

use proptest::prelude::*;
use std::f64::consts::{PI, TAU};
use stylet_mesh::generate::{
    contours::{ContourError, ContourSet, ContourSettings, Drawing, Fault, Organ, PlanarContour, Repair},
    implicit::Implicit,
};

/// Slice distance, m.
const H: f64 = 0.005;

/// A closed curve of `n` points `centre + radius(angle)` at height `z`.
fn ring(centre: [f64; 2], z: f64, n: usize, radius: impl Fn(f64) -> f64) -> PlanarContour {
    let angle = |i: usize| i as f64 / n as f64 * TAU;
    let point = |a: f64| [centre[0] + radius(a) * a.cos(), centre[1] + radius(a) * a.sin(), z];
    PlanarContour::closed((0..n).map(|i| point(angle(i))).collect())
}

/// A circle whose polygon has the circle's area.
fn circle(centre: [f64; 2], z: f64, radius: f64) -> PlanarContour {
    const N: usize = 120;
    let step = TAU / N as f64;
    ring(centre, z, N, |_| radius * (step / step.sin()).sqrt())
}

fn drawing(contours: Vec<PlanarContour>) -> Drawing {
    Drawing { name: "organ".into(), contours }
}

fn checked(contours: Vec<PlanarContour>) -> (ContourSet, Vec<Repair>) {
    ContourSet::new(&[drawing(contours)], &ContourSettings::default()).unwrap()
}

fn refused(contours: Vec<PlanarContour>) -> Vec<Fault> {
    ContourSet::new(&[drawing(contours)], &ContourSettings::default()).unwrap_err().faults
}

/// The volume inside, by samples on a grid whose cells on the surface count by their distance to it.
fn sampled_volume(solid: &dyn Implicit) -> f64 {
    const N: usize = 64;
    let [low, high] = solid.bounds().unwrap();
    let step: [f64; 3] = std::array::from_fn(|k| (high[k] - low[k]) / N as f64);
    let (mut inside, width) = (0.0, step.iter().product::<f64>().cbrt());
    for i in 0..N * N * N {
        let at = [i % N, i / N % N, i / N / N];
        let d = solid.distance(&std::array::from_fn(|k| low[k] + (at[k] as f64 + 0.5) * step[k]));
        assert!(d.is_finite());
        inside += (0.5 - d / width).clamp(0.0, 1.0);
    }
    inside * step.iter().product::<f64>()
}

/// The largest absolute distance at points that should be on the surface.
fn farthest(solid: &dyn Implicit, points: impl IntoIterator<Item = [f64; 3]>) -> f64 {
    points.into_iter().map(|p| solid.distance(&p).abs()).fold(0.0, f64::max)
}

/// Heights between the first and the last of `n` slices, and angles.
fn places(n: usize) -> impl Iterator<Item = (f64, f64)> {
    let top = (n - 1) as f64 * H;
    (0..2_000_u32).map(move |i| (f64::from(i) / 1_999.0 * top, f64::from(i) * 2.4))
}

/// Where the sign changes on the way up from `from`, in slice distances.
fn closes_after(solid: &dyn Implicit, from: [f64; 3]) -> f64 {
    let at = |t: f64| solid.distance(&[from[0], from[1], from[2] + t * H]);
    assert!(at(0.0) < 0.0 && at(1.0) > 0.0);
    (0..1_000).map(|i| f64::from(i) / 1e3).find(|&t| at(t) >= 0.0).unwrap()
}

/// The steepest and the least steep that the distance is across the surface, by differences at points on it.
fn slopes(solid: &dyn Implicit, points: impl IntoIterator<Item = [f64; 3]>) -> (f64, f64) {
    let slope = |p: [f64; 3]| {
        let moved = |k: usize, by: f64| solid.distance(&std::array::from_fn(|m| p[m] + if m == k { by } else { 0.0 }));
        (0..3).map(|k| (moved(k, 1e-7) - moved(k, -1e-7)) / 2e-7).fold(0.0, f64::hypot)
    };
    points.into_iter().map(slope).fold((f64::INFINITY, 0.0), |(low, high), s| (low.min(s), high.max(s)))
}

#[test]
fn a_cylinder_is_exact_between_its_slices() {
    let (set, repairs) = checked((0..10).map(|i| circle([0.01, -0.02], f64::from(i) * H, 0.012)).collect());
    assert_eq!(repairs, []);
    let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
    assert!((organ.volume() / (PI * 0.012_f64.powi(2) * 10.0 * H) - 1.0).abs() < 1e-12);
    // The caps hold 0.43 of a slice each where the rule counts half a slice.
    let ratio = sampled_volume(solid) / organ.volume();
    assert!((ratio - 0.9857).abs() < 0.002, "{ratio}");
    // The polygon is beside the circle by 4 micrometres at most.
    let surface = places(10).map(|(z, a)| [0.01 + 0.012 * a.cos(), -0.02 + 0.012 * a.sin(), z]);
    assert!(farthest(solid, surface) < 4e-6);
    for z in [0.0, 0.0012, 0.0222, 0.045] {
        assert!((solid.distance(&[0.015, -0.02, z]) + 0.007).abs() < 4e-6);
    }
    let top = closes_after(solid, [0.01, -0.02, 0.045]);
    assert!((top - 0.87).abs() < 0.01, "{top}");
    // Far away it is still outside, and the box holds all of it.
    assert!(solid.distance(&[0.01, -0.02, 1.0]) > 0.9 && solid.distance(&[1.0, 1.0, 0.02]) > 1.4);
    let [low, high] = solid.bounds().unwrap();
    assert!(low[0] <= -0.002 && high[1] >= -0.008 && low[2] == -H && (high[2] - 10.0 * H).abs() < 1e-15);
}

#[test]
fn an_oblique_tube_keeps_its_width() {
    for lean in [0.5, 1.0] {
        let at = |z: f64| lean * z;
        let (set, _) = checked((0..10).map(|i| f64::from(i) * H).map(|z| circle([at(z), 0.0], z, 0.004)).collect());
        let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
        assert!((sampled_volume(solid) / organ.volume() - 1.0).abs() < 0.02);
        let surface = || places(10).map(|(z, a)| [at(z) + 0.004 * a.cos(), 0.004 * a.sin(), z]);
        assert!(farthest(solid, surface()) < 1.5e-6);
        let (low, high) = slopes(solid, surface().filter(|p| p[2] > 1e-4 && p[2] < 9.0 * H - 1e-4));
        let cosine = (1.0 + lean * lean / 2.0).sqrt();
        assert!(low > 0.99 / cosine && high < 1.01 * (1.0 + lean * lean).sqrt() / cosine, "{low} {high}");
    }
}

#[test]
fn a_cone_is_exact_but_where_its_caps_begin() {
    let radius = |z: f64| 0.03 - 0.5 * z;
    let (set, _) = checked((0..10).map(|i| f64::from(i) * H).map(|z| circle([0.0; 2], z, radius(z))).collect());
    let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
    assert!((sampled_volume(solid) / organ.volume() - 1.0).abs() < 0.02);
    let surface = || places(10).map(|(z, a)| [radius(z) * a.cos(), radius(z) * a.sin(), z]);
    let inner = || surface().filter(|p| p[2] > H && p[2] < 8.0 * H);
    assert!(farthest(solid, inner()) < 1e-5 && farthest(solid, surface()) < 4e-4);
    let (low, high) = slopes(solid, inner());
    assert!(low > 0.999 && high < 1.001, "{low} {high}");
}

/// At four places of the slices: the solid within 3 % of the ellipsoid's volume, and 0.45 mm of its surface.
#[test]
fn an_ellipsoid_the_size_of_a_prostate() {
    let axes = [0.025, 0.02, 0.0175];
    let scale = |z: f64| (1.0 - (z / axes[2]).powi(2)).max(0.0).sqrt();
    let point = |z: f64, a: f64| [scale(z) * axes[0] * a.cos(), scale(z) * axes[1] * a.sin(), z];
    let exact = 4.0 / 3.0 * PI * axes.iter().product::<f64>();
    let mut means = [0.0; 2];
    for shift in [0.0, 0.25, 0.5, 0.75] {
        let heights = (-4..5).map(|i| (f64::from(i) + shift) * H).filter(|&z| scale(z) > 0.01);
        let contour = |z: f64| PlanarContour::closed((0..120).map(|i| point(z, f64::from(i) / 120.0 * TAU)).collect());
        let (set, _) = checked(heights.map(contour).collect());
        let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
        let ratios = [sampled_volume(solid) / exact, organ.volume() / exact];
        assert!(ratios.iter().all(|r| (r - 1.0).abs() < 0.03), "{ratios:?}");
        assert!((ratios[0] / ratios[1] - 1.0).abs() < 0.015, "{ratios:?}");
        means = [means[0] + ratios[0] / 4.0, means[1] + ratios[1] / 4.0];
        let (low, high) = (organ.slices()[0].z, organ.slices().last().unwrap().z);
        let surface = places(10).map(|(t, a)| point(low + (high - low) * t / (9.0 * H), a));
        assert!(farthest(solid, surface) < 4.5e-4);
    }
    // Wherever the slices fall, on average neither is off by more than a percent.
    assert!(means.iter().all(|m| (m - 1.0).abs() < 0.01), "{means:?}");
}

/// The sections of a torus around the x axis with the plane at height z: `(sqrt(y2 + z2) - R)2 + x2 = r2`.
fn spiric(z: f64, major: f64, minor: f64) -> Vec<PlanarContour> {
    const N: usize = 400;
    let tube = |i: usize| {
        let s = i as f64 / N as f64 * TAU - PI / 2.0;
        [minor * s.cos(), major + minor * s.sin()]
    };
    let point = |[x, rho]: [f64; 2]| [x, (rho * rho - z * z).sqrt(), z];
    let upper: Vec<[f64; 3]> = (0..N).map(tube).filter(|p| p[1] > z.abs()).map(point).collect();
    let lower = upper.iter().rev().map(|p| [p[0], -p[1], z]);
    match upper.len() {
        // One closed curve on either side of the axis, or one around both.
        N => vec![PlanarContour::closed(lower.collect()), PlanarContour::closed(upper)],
        0..3 => Vec::new(),
        _ => vec![PlanarContour::closed(upper.iter().copied().chain(lower).collect())],
    }
}

#[test]
fn an_upright_torus_branches_and_joins() {
    let (major, minor) = (0.02, 0.0085);
    let contours = (-5..6).flat_map(|i| spiric((f64::from(i) + 0.3) * H, major, minor)).collect();
    let (set, _) = checked(contours);
    let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
    let parts: Vec<usize> = organ.slices().iter().map(|slice| slice.parts.len()).collect();
    assert_eq!(parts, [1, 1, 1, 2, 2, 2, 2, 1, 1, 1, 1]);
    let exact = 2.0 * PI * PI * major * minor * minor;
    let ratios = [sampled_volume(solid) / exact, organ.volume() / exact];
    assert!(ratios.iter().all(|r| (r - 1.0).abs() < 0.02), "{ratios:?}");
    assert!(solid.distance(&[0.0; 3]) > 0.0, "the hole is open");
}

#[test]
fn a_lying_torus_has_a_hole_on_every_slice() {
    let (major, minor) = (0.02, 0.0085);
    let exact = 2.0 * PI * PI * major * minor * minor;
    let mut mean = 0.0;
    for shift in [0.1, 0.3, 0.5, 0.7, 0.9] {
        let heights = (-3..3).map(|i| (f64::from(i) + shift) * H).filter(|z: &f64| z.abs() < 0.99 * minor);
        let contours = heights.flat_map(|z| {
            let half = (minor * minor - z * z).sqrt();
            [circle([0.0; 2], z, major - half), circle([0.0; 2], z, major + half)]
        });
        let (set, _) = checked(contours.collect());
        let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
        assert!(organ.slices().iter().all(|slice| slice.parts.len() == 1 && slice.parts[0].holes.len() == 1));
        assert!((sampled_volume(solid) / organ.volume() - 1.0).abs() < 0.03);
        assert!((-20..=20).all(|i| solid.distance(&[0.0, 0.0, f64::from(i) * 0.0005]) > 0.0), "the hole is open");
        mean += sampled_volume(solid) / exact / 5.0;
    }
    assert!((mean - 1.0).abs() < 0.02, "{mean}");
}

#[test]
fn a_tube_that_branches_where_one_branch_ends_early() {
    let mut contours: Vec<_> = (0..5).map(|i| circle([0.0; 2], f64::from(i) * H, 0.012)).collect();
    for i in 5..12 {
        contours.push(circle([0.008, 0.0], f64::from(i) * H, 0.005));
        contours.extend((i < 10).then(|| circle([-0.008, 0.0], f64::from(i) * H, 0.005)));
    }
    let (set, _) = checked(contours);
    let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
    assert!((sampled_volume(solid) / organ.volume() - 1.0).abs() < 0.03);
    // Both hang together with the trunk, and nothing is between them.
    for z in (16..36).map(|i| f64::from(i) * H / 4.0) {
        assert!(solid.distance(&[0.0075, 0.0, z]) < 0.0 && solid.distance(&[-0.0075, 0.0, z]) < 0.0);
    }
    assert!((20..44).all(|i| solid.distance(&[0.0, 0.0, f64::from(i) * H / 4.0]) > 0.0));
    // The one that ends does so half way to the next slice or later; the other goes on.
    let end = closes_after(solid, [-0.008, 0.0, 9.0 * H]);
    assert!((0.5..1.0).contains(&end), "{end}");
    assert!(solid.distance(&[0.008, 0.0, 10.5 * H]) < -0.004);
}

#[test]
fn a_hole_that_ends_closes_on_its_way() {
    let mut contours: Vec<_> = (0..8).map(|i| circle([0.0; 2], f64::from(i) * H, 0.015)).collect();
    contours.extend((0..4).map(|i| circle([0.002, 0.0], f64::from(i) * H, 0.005)));
    let (set, _) = checked(contours);
    let solid = &set.solids()[0];
    let hole = |t: f64| solid.distance(&[0.002, 0.0, (3.0 + t) * H]) > 0.0;
    assert!(hole(0.0) && hole(0.45) && !hole(0.99) && !hole(1.5));
    assert!((sampled_volume(solid) / set.organs()[0].volume() - 1.0).abs() < 0.03);
}

#[test]
fn organs_stand_in_order_of_precedence() {
    let tube = |name: &str, radius: f64| {
        let contours = (0..4).map(|i| circle([0.0; 2], f64::from(i) * H, radius)).collect();
        Drawing { name: name.into(), contours }
    };
    let organs = [tube("urethra", 0.003), tube("prostate", 0.02)];
    let (set, _) = ContourSet::new(&organs, &ContourSettings::default()).unwrap();
    assert_eq!(set.organ("prostate").unwrap().name(), "prostate");
    let strata = set.strata();
    let region = |x: f64| strata.region(&[x, 0.0, 1.5 * H]);
    assert_eq!([region(0.0), region(0.01), region(0.03)], [0, 1, strata.background()]);
    // What is left of the outer tube: the slices and half a slice beyond at either end, as for the whole.
    let [inner, outer] = [0.003_f64, 0.02].map(|r| PI * r * r * 4.0 * H);
    let volumes = set.region_volumes();
    assert!(
        (volumes[0] / inner - 1.0).abs() < 1e-9 && (volumes[1] / (outer - inner) - 1.0).abs() < 2e-3,
        "{volumes:?}"
    );
    let again: Vec<Drawing> = set.organs().iter().map(Organ::drawing).collect();
    assert_eq!(ContourSet::new(&again, &ContourSettings::default()).unwrap(), (set, vec![]));
}

/// Slips are mended, and said: every kind at least once.
#[test]
fn repairs_are_told() {
    let name = || "organ".to_owned();
    let slice = |i: u32| circle([0.0; 2], f64::from(i) * H, 0.01);
    let mut contours: Vec<_> = (0..4).map(slice).collect();
    let (first, sixth) = (contours[0].points[0], contours[1].points[6]);
    contours[0].points.push(first);
    contours[1].points.insert(7, sixth);
    contours[2].points.swap(30, 31);
    contours.push(slice(3));
    contours.push(PlanarContour::closed(vec![[0.0, 0.0, 0.02]]));
    contours.push(PlanarContour::closed((0..5).map(|i| [f64::from(i) * 0.001, 0.0, 0.02]).collect()));
    contours.push(slice(6));
    let (set, repairs) = checked(contours);
    let expected = [
        Repair::DuplicatePoints { organ: name(), contour: 1, removed: 1 },
        Repair::Reordered { organ: name(), contour: 2, runs: 1 },
        Repair::Degenerate { organ: name(), contour: 5, points: 1 },
        Repair::Degenerate { organ: name(), contour: 6, points: 5 },
        Repair::RepeatedContour { organ: name(), contour: 4, of: 3 },
    ];
    let (spacing, others) = repairs.split_last().unwrap();
    assert_eq!(others, expected);
    let Repair::UnequalSpacing { smallest, largest, .. } = spacing else { panic!("{spacing}") };
    assert!((smallest - H).abs() < 1e-12 && (largest - 3.0 * H).abs() < 1e-12, "{spacing}");
    let clean = checked((0..4).chain([6]).map(slice).collect()).0;
    assert_eq!(set.organs()[0].volume(), clean.organs()[0].volume());

    let culled = ContourSettings { cull: 0.004, thickness: Some(0.003), ..ContourSettings::default() };
    let (set, repairs) = ContourSet::new(&[drawing(vec![slice(2)])], &culled).unwrap();
    let n = set.organs()[0].slices()[0].parts[0].outer.len();
    assert!((8..16).contains(&n), "{n}");
    assert_eq!(repairs[0], Repair::Culled { organ: name(), contour: 0, removed: 120 - n });
    assert_eq!(repairs[1], Repair::SingleSlice { organ: name(), z: 2.0 * H, thickness: 0.003 });
    assert_eq!(set.organs()[0].volume(), set.organs()[0].slices()[0].area() * 0.003);
    let solid = &set.solids()[0];
    assert!(solid.distance(&[0.0, 0.0, 2.0 * H]) < 0.0 && solid.distance(&[0.0, 0.0, 2.0 * H + 0.003]) > 0.0);
}

/// What cannot be mended is refused, every fault by organ, contour and place.
#[test]
fn faults_are_refused() {
    let name = || "organ".to_owned();
    let slice = |i: u32| circle([0.0; 2], f64::from(i) * H, 0.01);
    let with = |change: &dyn Fn(&mut PlanarContour)| {
        let mut contours: Vec<_> = (0..3).map(slice).collect();
        change(&mut contours[1]);
        refused(contours)
    };
    assert!(matches!(
        with(&|c| c.points[5][1] = f64::NAN)[..],
        [Fault::Coordinate { contour: 1, point: 5, value, .. }] if value.is_nan()
    ));
    let far = with(&|c| c.points[5][0] = 1e7);
    assert_eq!(far, [Fault::Coordinate { organ: name(), contour: 1, point: 5, value: 1e7 }]);
    let tilted = with(&|c| c.points[5][2] += 0.001);
    assert_eq!(tilted, [Fault::NotPlanar { organ: name(), contour: 1, lowest: H, highest: H + 0.001 }]);
    let half = with(&|c| c.points.truncate(60));
    assert!(matches!(half[..], [Fault::Open { contour: 1, gap, longest, .. }] if gap > 0.019 && longest < 0.001));
    assert!(matches!(with(&|c| c.open = true)[..], [Fault::Open { contour: 1, .. }]));
    let eight = with(&|c| c.points[..60].reverse());
    assert!(matches!(&eight[..], [Fault::SelfIntersecting { contour: 1, .. }]), "{eight:?}");
    let many = with(&|c| c.points = vec![[0.0; 3]; 20_001]);
    assert_eq!(many, [Fault::TooManyPoints { organ: name(), contour: 1, found: 20_001, limit: 20_000 }]);

    let dots = (0..1_001).map(|i| circle([f64::from(i), 0.0], 0.0, 0.1)).collect();
    assert_eq!(refused(dots), [Fault::TooManyContours { organ: name(), z: 0.0, found: 1_001, limit: 1_000 }]);

    let crossing = refused(vec![slice(0), circle([0.005, 0.0], 0.0, 0.01), slice(1)]);
    assert!(matches!(crossing[..], [Fault::Overlapping { contours: [0, 1], z: 0.0, .. }]));
    assert_eq!(refused(vec![]), [Fault::NoContours { organ: name() }]);
    assert_eq!(refused(vec![slice(2)]), [Fault::SingleSlice { organ: name(), z: 2.0 * H }]);
    let none: Result<_, ContourError> = ContourSet::new(&[], &ContourSettings::default());
    assert_eq!(none.unwrap_err().faults, [Fault::NoOrgans]);
    let twice = [drawing(vec![slice(0), slice(1)]), drawing(vec![slice(0), slice(1)])];
    let twice = ContourSet::new(&twice, &ContourSettings::default()).unwrap_err();
    assert_eq!(twice.to_string(), "organ \"organ\" stands in the set twice");
    let bad = ContourSettings { cull: -1.0, ..ContourSettings::default() };
    let bad = ContourSet::new(&[drawing(vec![])], &bad).unwrap_err();
    assert_eq!(bad.to_string(), "cull is -1, expected a length, 0 or more (for plane 1e-9 m or more)");
}

#[test]
fn every_fault_is_listed() {
    let mut contours: Vec<_> = (0..12).map(|i| circle([0.0; 2], f64::from(i) * H, 0.01)).collect();
    contours[..10].iter_mut().for_each(|c| c.open = true);
    let error = ContourSet::new(&[drawing(contours)], &ContourSettings::default()).unwrap_err();
    assert_eq!(error.faults.len(), 10);
    assert!(error.to_string().ends_with("; and 2 more faults"), "{error}");
}

/// A star: radii at even angles.
fn star(centre: [f64; 2], z: f64, radii: &[f64]) -> PlanarContour {
    let n = radii.len();
    ring(centre, z, n, |a| radii[(a / TAU * n as f64).round() as usize % n])
}

/// Stacks of stars, one or two side by side on a slice, at uneven distances.
fn stacks() -> impl Strategy<Value = Vec<Vec<PlanarContour>>> {
    let radii = || proptest::collection::vec(0.002_f64..0.012, 3..40);
    let slice = (0.001_f64..0.009, radii(), proptest::option::of(radii()), -0.004_f64..0.004);
    proptest::collection::vec(slice, 2..9).prop_map(|slices| {
        let mut z = 0.0;
        let stack = slices.into_iter().map(|(step, left, right, x)| {
            z += step;
            let mut contours = vec![star([x, 0.0], z, &left)];
            contours.extend(right.map(|radii| star([0.03 + x, 0.0], z, &radii)));
            contours
        });
        stack.collect()
    })
}

/// Inside by the crossing number, over all contours of a slice.
fn inside(contours: &[PlanarContour], x: f64, y: f64) -> bool {
    let crossed = |(p, q): (&[f64; 3], &[f64; 3])| {
        (p[1] > y) != (q[1] > y) && x < p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0])
    };
    let crossings =
        |c: &PlanarContour| c.points.iter().zip(c.points.iter().cycle().skip(1)).filter(|e| crossed(*e)).count();
    contours.iter().map(crossings).sum::<usize>() % 2 == 1
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// On every slice the sign is that of the contours; across it the distance is continuous; everywhere it is a number,
    /// and a solid made again gives the same bits.
    #[test]
    fn random_stacks(stack in stacks(), probes in proptest::collection::vec((-0.02_f64..0.05, -0.02_f64..0.02, 0.0_f64..1.0), 40)) {
        let (set, _) = checked(stack.iter().flatten().cloned().collect());
        let (solid, again) = (&set.solids()[0], &set.solids()[0]);
        let [low, high] = solid.bounds().unwrap();
        for (x, y, t) in probes {
            for contours in &stack {
                let z = contours[0].points[0][2];
                let d = solid.distance(&[x, y, z]);
                prop_assert!(d.abs() < 1e-9 || (d < 0.0) == inside(contours, x, y), "{} at {}, {}, {}", d, x, y, z);
                // Slices may be a millimetre apart and differ by centimetres: steep far off the surface, but no jump.
                for step in [-1e-12, 1e-12] {
                    let beside = solid.distance(&[x, y, z + step]);
                    prop_assert!((beside - d).abs() < 1e-7, "{} beside {}", beside, d);
                }
            }
            let p = [x, y, low[2] + t * (high[2] - low[2])];
            prop_assert!(solid.distance(&p).is_finite());
            prop_assert_eq!(solid.distance(&p).to_bits(), again.distance(&p).to_bits());
            let held = (0..3).all(|k| low[k] <= p[k] && p[k] <= high[k]);
            prop_assert!(held || solid.distance(&p) > 0.0, "inside but outside the box");
        }
    }

    /// Points anywhere: a clear error, or solids that are numbers everywhere.
    #[test]
    fn scribbles_are_solids_or_errors(
        scribbles in proptest::collection::vec((0_u8..4, proptest::collection::vec((0_i8..6, 0_i8..6), 0..9), any::<bool>()), 1..12),
        cull in prop_oneof![Just(0.0), Just(0.002)],
    ) {
        // On a coarse grid, so that points repeat, and edges overlap and touch.
        let contour = |(slice, points, open): &(u8, Vec<(i8, i8)>, bool)| PlanarContour {
            points: points.iter().map(|(x, y)| [f64::from(*x) * 1e-3, f64::from(*y) * 1e-3, f64::from(*slice) * H]).collect(),
            open: *open && points.len() > 7,
        };
        let settings = ContourSettings { cull, thickness: Some(H), ..ContourSettings::default() };
        match ContourSet::new(&[drawing(scribbles.iter().map(contour).collect())], &settings) {
            Err(error) => prop_assert!(!error.to_string().is_empty()),
            Ok((set, _)) => {
                prop_assert!(set.organs()[0].volume() > 0.0);
                let solid = &set.solids()[0];
                for i in 0..1_000 {
                    let at = [i % 10, i / 10 % 10, i / 100].map(|n| f64::from(n) * 7.7e-4 - 1e-3);
                    prop_assert!(solid.distance(&[at[0], at[1], 3.0 * at[2]]).is_finite());
                }
            }
        }
    }
}
