use super::*;
use crate::shapes::ShapeScene;
use std::ops::ControlFlow;
use std::path::Path;
use stylet_mesh::generate::contours::{ContourSettings, Drawing, PlanarContour};
use stylet_mesh::generate::stuff::GenerateError;

fn go_on(_: Stage) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Numbers from 0 to 1: a linear congruential generator by Knuth.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A wavy closed curve around a point, m.
fn star(random: &mut Random, centre: [f64; 2], radius: f64, waves: [f64; 3], z: f64) -> PlanarContour {
    let n = 24 + (random.next() * 12.0) as usize;
    let point = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / n as f64;
        let wave = waves.iter().enumerate().map(|(m, a)| a * ((m + 2) as f64 * angle + a * 9.0).sin()).sum::<f64>();
        let r = radius * (1.0 + wave);
        [centre[0] + r * angle.cos(), centre[1] + r * angle.sin(), z]
    };
    PlanarContour::closed((0..n).map(point).collect())
}

/// An organ of 5 to 9 slices that wanders, widens and narrows; sometimes with a hole, sometimes forked at its end.
fn organ(random: &mut Random, name: &str, at: [f64; 2]) -> Drawing {
    let slices = 5 + (random.next() * 5.0) as usize;
    let (hole, fork) = (random.next() < 0.25, random.next() < 0.25);
    let waves: [f64; 3] = std::array::from_fn(|_| random.between(0.0, 0.08));
    let (mut centre, mut radius) = (at, random.between(0.011, 0.015));
    let mut contours = Vec::new();
    for k in 0..slices {
        let z = 0.005 * k as f64;
        if fork && k + 2 >= slices {
            for side in [-1.0, 1.0] {
                contours.push(star(random, [centre[0] + side * 0.011, centre[1]], 0.008, waves, z));
            }
        } else {
            contours.push(star(random, centre, radius, waves, z));
            if hole && !fork {
                contours.push(star(random, centre, 0.45 * radius, [0.0; 3], z));
            }
        }
        centre = centre.map(|x| x + random.between(-0.001, 0.001));
        radius *= random.between(0.93, 1.07);
    }
    Drawing { name: name.into(), contours }
}

/// Two hundred stacks of one or two organs: conforming, no inverted cell, volumes right, or a clear error, counted.
#[test]
fn random_stacks_become_meshes() {
    let (mut refused, mut coarse) = (0, 0);
    let straight = Effort { improve: None };
    for seed in 0..200 {
        let random = &mut Random(seed);
        let mut drawings = vec![organ(random, "first", [0.0, 0.0])];
        if seed % 2 == 1 {
            let place = [random.between(0.018, 0.034), random.between(-0.004, 0.004)];
            drawings.push(organ(random, "second", place));
        }
        let Ok((set, _)) = ContourSet::new(&drawings, &ContourSettings::default()) else {
            refused += 1;
            continue;
        };
        let how = ContourPlan { size: 0.006, coarsest: 0.024, margin: 0.006, background: true };
        let plan = Plan::of_contours(&set, &how).unwrap();
        let effort = if seed % 50 == 0 { Effort::default() } else { straight.clone() };
        let made = plan.mesh(&effort, &mut go_on).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        // What is not conforming, or has a cell without volume, makes no mesh.
        let box_volume: f64 = (0..3).map(|k| plan.domain[1][k] - plan.domain[0][k]).product();
        let mesh = made.tets.clone().into_mesh().unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        let apart = mesh.total_volume() / box_volume - 1.0;
        // The sum has some ten thousand terms.
        assert!(apart.abs() < 1e-11, "seed {seed}: the volume of the box is off by {apart:e}");
        for cell in &made.tets.cells {
            let corners = cell.map(|v| made.tets.points[v as usize]);
            assert!(stylet_mesh::geometry::signed_measure(&corners) > 0.0, "seed {seed}: an inverted cell");
        }
        for region in &made.regions {
            let apart = (region.volume / region.source_volume - 1.0).abs();
            coarse += usize::from(apart > 0.03);
            // Cubes are a third of the organs' radius; a second organ may be a sliver beside the first.
            assert!(apart < 0.1 || region.source_volume < 2e-6, "seed {seed}: {region:?}");
        }
    }
    println!("{refused} of 200 stacks refused, {coarse} regions more than 3 % from their contours");
    assert_eq!(refused, 0);
}

#[test]
fn meshes_are_reproducible_and_scale() {
    for (name, ..) in BUILT_IN {
        let plan = || Plan::of_shapes(&built_in(name).unwrap().unwrap());
        let (first, second) = (
            plan().mesh(&Effort::default(), &mut go_on).unwrap(),
            plan().mesh(&Effort::default(), &mut go_on).unwrap(),
        );
        assert!(first.tets == second.tets, "{name}");
        assert!(first.border_error() < 1e-6, "{name}: {}", first.border_error());
    }
    let cells = |size: f64| {
        let plan = Plan::of_shapes(&built_in("prostate").unwrap().unwrap()).with_size(size);
        plan.mesh(&Effort { improve: None }, &mut go_on).unwrap().tets.cells.len()
    };
    assert!(cells(0.0039) > 4 * cells(0.0078));
}

#[test]
fn scenes_to_run_name_what_is_fixed() {
    let plan = Plan::of_shapes(&built_in("two-cylinders").unwrap().unwrap());
    let text = plan.run_scene("m.msh", true);
    assert_eq!(text.matches("[[constraint]]").count(), 2);
    assert!(text.contains("file = \"m.msh\"") && text.contains("[statics]") && !text.contains("side ="));
    let gel = Plan::of_shapes(&built_in("gel-block").unwrap().unwrap()).run_scene("g.vtu", false);
    assert!(gel.contains("side = \"bottom\"") && gel.contains("tag = 0") && !text.contains("tag"));
}

#[test]
fn what_cannot_be_meshed_is_named() {
    let (.., text) = BUILT_IN[3];
    let scene = |text: &str| ShapeScene::parse("e.toml", text, Path::new("")).unwrap();
    let away = scene(&text.replace("centre = [0.0, 0.0, 0.0]", "centre = [0.5, 0.0, 0.0]"));
    let error = Plan::of_shapes(&away).mesh(&Effort::default(), &mut go_on).unwrap_err();
    assert!(matches!(&error, PlanError::NoCells { name, .. } if name == "ellipsoid"), "{error}");
    let error = Plan::of_shapes(&scene(text)).with_size(1e-6).mesh(&Effort::default(), &mut go_on).unwrap_err();
    assert!(matches!(error, PlanError::Stuffing(GenerateError::TooManyTets { .. })), "{error}");
    let stopped = Plan::of_shapes(&scene(text)).mesh(&Effort::default(), &mut |_| ControlFlow::Break(()));
    assert_eq!(stopped.unwrap_err(), PlanError::Stopped);
}
