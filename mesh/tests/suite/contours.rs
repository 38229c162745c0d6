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
fn sampled_volume(organ: &Organ, solid: &dyn Implicit) -> f64 {
    const N: usize = 64;
    let [low, high] = solid.bounds().unwrap();
    let step: [f64; 3] = std::array::from_fn(|k| (high[k] - low[k]) / N as f64);
    let (mut inside, width) = (0.0, step.iter().product::<f64>().cbrt());
    for i in 0..N * N * N {
        let at = [i % N, i / N % N, i / N / N];
        let d = solid.distance(&std::array::from_fn(|k| low[k] + (at[k] as f64 + 0.5) * step[k]));
        assert!(d.is_finite(), "{}", organ.name());
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

#[test]
fn a_cylinder_between_its_slices_is_exact() {
    let (set, repairs) = checked((0..10).map(|i| circle([0.01, -0.02], f64::from(i) * H, 0.012)).collect());
    assert_eq!(repairs, []);
    let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
    let exact = PI * 0.012_f64.powi(2) * 10.0 * H;
    assert!((organ.volume() / exact - 1.0).abs() < 1e-12);
    println!("cylinder {}", sampled_volume(organ, solid) / exact);
    let surface = places(10).map(|(z, a)| [0.01 + 0.012 * a.cos(), -0.02 + 0.012 * a.sin(), z]);
    println!("cylinder surface {}", farthest(solid, surface));
    for z in [0.0, 0.0012, 0.0222, 0.045] {
        println!("{}", solid.distance(&[0.015, -0.02, z]) + 0.007);
    }
    println!(
        "top {:?}",
        (0..20).map(|i| solid.distance(&[0.01, -0.02, 0.045 + 0.00025 * i as f64])).collect::<Vec<_>>()
    );
}

#[test]
fn an_oblique_cylinder() {
    for lean in [0.5, 1.0] {
        let (set, _) =
            checked((0..10).map(|i| circle([lean * f64::from(i) * H, 0.0], f64::from(i) * H, 0.004)).collect());
        let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
        println!("oblique {}", sampled_volume(organ, solid) / organ.volume());
        let surface = places(10).map(|(z, a)| [lean * z + 0.004 * a.cos(), 0.004 * a.sin(), z]);
        println!("oblique surface {}", farthest(solid, surface));
    }
}

#[test]
fn a_cone() {
    let radius = |z: f64| 0.03 - 0.5 * z;
    let (set, _) = checked((0..10).map(|i| circle([0.0; 2], f64::from(i) * H, radius(f64::from(i) * H))).collect());
    let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
    println!("cone {} ", sampled_volume(organ, solid) / organ.volume());
    let surface = places(10).map(|(z, a)| [radius(z) * a.cos(), radius(z) * a.sin(), z]);
    println!("cone surface {}", farthest(solid, surface));
    println!("{}", solid.distance(&[radius(0.021) - 0.001, 0.0, 0.021]) / -0.001 * 1.25_f64.sqrt());
}

#[test]
fn an_ellipsoid() {
    for shift in [0.0, 0.25, 0.5, 0.75] {
        let axes = [0.025, 0.02, 0.0175];
        let scale = |z: f64| (1.0 - (z / axes[2]).powi(2)).max(0.0).sqrt();
        let heights = (-4..5).map(|i| (f64::from(i) + shift) * H).filter(|&z| scale(z) > 0.01);
        let contour = |z: f64| {
            PlanarContour::closed(
                (0..120)
                    .map(|i| {
                        let a = f64::from(i) / 120.0 * TAU;
                        [scale(z) * axes[0] * a.cos(), scale(z) * axes[1] * a.sin(), z]
                    })
                    .collect(),
            )
        };
        let (set, _) = checked(heights.clone().map(contour).collect());
        let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
        let exact = 4.0 / 3.0 * PI * axes.iter().product::<f64>();
        println!("ellipsoid {} {}", sampled_volume(organ, solid) / exact, organ.volume() / exact);
        let (low, high) = (organ.slices()[0].z, organ.slices().last().unwrap().z);
        let surface = places(10).map(|(t, a)| {
            let z = low + (high - low) * t / (9.0 * H);
            [scale(z) * axes[0] * a.cos(), scale(z) * axes[1] * a.sin(), z]
        });
        println!("ellipsoid surface {}", farthest(solid, surface));
    }
}

fn torus_slices(upright: bool) -> (ContourSet, f64) {
    let (major, minor) = (0.02, 0.0085);
    let exact = 2.0 * PI * PI * major * minor * minor;
    let contours = if upright {
        // Axis along x: from below one section, two, one again; by their boundaries.
        (-5..6)
            .flat_map(|i| {
                let z = (f64::from(i) + 0.3) * H;
                spiric(z, major, minor)
            })
            .collect()
    } else {
        (-2..2)
            .map(|i| (f64::from(i) + 0.3) * H)
            .filter(|z: &f64| z.abs() < minor)
            .flat_map(|z| {
                let half = (minor * minor - z * z).sqrt();
                [circle([0.0; 2], z, major + half), circle([0.0; 2], z, major - half)]
            })
            .collect()
    };
    (checked(contours).0, exact)
}

/// The sections of a torus around the x axis with the plane at height z: `(sqrt(y2 + z2) - R)2 + x2 = r2`.
fn spiric(z: f64, major: f64, minor: f64) -> Vec<PlanarContour> {
    const N: usize = 200;
    let tube = |s: f64| [minor * s.cos(), major + minor * s.sin()];
    // y2 = rho2 - z2 where that is not negative: one closed curve around both halves, or one on either side.
    let at = |i: usize| tube(i as f64 / N as f64 * TAU - PI / 2.0);
    if (0..N).all(|i| at(i)[1] > z.abs()) {
        let half = |sign: f64| {
            (0..N)
                .map(|i| {
                    let [x, rho] = at(i);
                    [x, sign * (rho * rho - z * z).sqrt(), z]
                })
                .collect()
        };
        return vec![PlanarContour::closed(half(1.0)), PlanarContour::closed(half(-1.0))];
    }
    let upper: Vec<[f64; 3]> =
        (0..N).map(at).filter(|p| p[1] > z.abs()).map(|[x, rho]| [x, (rho * rho - z * z).sqrt(), z]).collect();
    if upper.len() < 3 {
        return Vec::new();
    }
    let lower = upper.iter().rev().map(|p| [p[0], -p[1], z]);
    vec![PlanarContour::closed(upper.iter().copied().chain(lower).collect())]
}

#[test]
fn tori() {
    for upright in [false, true] {
        let (set, exact) = torus_slices(upright);
        let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
        println!("{:?}", organ.slices().iter().map(|s| (s.parts.len(), s.parts[0].holes.len())).collect::<Vec<_>>());
        println!("torus {upright} {} {}", sampled_volume(organ, solid) / exact, organ.volume() / exact);
    }
}

#[test]
fn a_branching_pair() {
    let mut contours: Vec<_> = (0..5).map(|i| circle([0.0; 2], f64::from(i) * H, 0.012)).collect();
    for i in 5..10 {
        contours.push(circle([-0.008, 0.0], f64::from(i) * H, 0.005));
        contours.push(circle([0.008, 0.0], f64::from(i) * H, 0.005));
    }
    contours.push(circle([0.008, 0.0], 10.0 * H, 0.005));
    contours.push(circle([0.008, 0.0], 11.0 * H, 0.005));
    let (set, _) = checked(contours);
    let (organ, solid) = (&set.organs()[0], &set.solids()[0]);
    println!("branches {}", sampled_volume(organ, solid) / organ.volume());
    println!("{:?}", (0..20).map(|i| solid.distance(&[-0.008, 0.0, 9.0 * H + 0.00025 * i as f64])).collect::<Vec<_>>());
}
