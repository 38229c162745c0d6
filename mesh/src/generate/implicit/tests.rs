//! What must hold of all shapes, and exact distances of each.

use super::*;
use crate::geometry::{distance2, norm, subtract};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A shape and what it was made of, for messages.
struct Named {
    of: String,
    solid: Box<dyn Implicit>,
}

impl std::fmt::Debug for Named {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.of)
    }
}

impl Implicit for Named {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        self.solid.distance(p)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.solid.bounds()
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        self.solid.bounds_within(level)
    }
}

/// A simple body.
fn simple(shape: Result<impl Implicit + std::fmt::Debug + 'static, ShapeError>) -> Named {
    let shape = shape.expect("good parameters");
    Named { of: format!("{shape:?}"), solid: Box::new(shape) }
}

/// A body made of others.
fn made(of: String, shape: Result<impl Implicit + 'static, ShapeError>) -> Named {
    Named { of, solid: Box::new(shape.expect("good parameters")) }
}

fn both(a: Named, b: Named) -> Vec<Box<dyn Implicit>> {
    vec![Box::new(a), Box::new(b)]
}

fn vector(reach: f64) -> impl Strategy<Value = [f64; 3]> {
    [-reach..reach, -reach..reach, -reach..reach]
}

fn length() -> impl Strategy<Value = f64> {
    0.1..1.0
}

/// Directions, never near zero.
fn direction() -> impl Strategy<Value = [f64; 3]> {
    vector(1.0).prop_filter("a direction", |v| norm(v) > 0.1)
}

fn plus(p: &[f64; 3], q: &[f64; 3], factor: f64) -> [f64; 3] {
    std::array::from_fn(|i| p[i] + factor * q[i])
}

/// A shape by its true distance, of random kind and size.
fn exact() -> impl Strategy<Value = Named> {
    // A start across the axis is any direction but one that nearly is the axis.
    (0..7, vector(0.5), direction(), direction(), [length(), length(), length()], 0.1..TAU - 1.0).prop_map(
        |(kind, at, u, v, [a, b, c], angle)| match kind {
            0 => simple(Sphere::new(at, a)),
            1 => simple(Ellipsoid::new(at, [a, b, c])),
            2 => simple(Capsule::new(at, plus(&at, &u, 1.0), a)),
            3 => simple(Cylinder::new(at, plus(&at, &u, 1.0), a)),
            4 => simple(Cuboid::new(at, plus(&at, &[a, b, c], 1.0))),
            5 => simple(HalfSpace::new(at, u)),
            // A gap of 1 rad leaves a chord of 0.96 rings between the ends: they do not overlap.
            _ => simple(TorusArc::new(at, u, v, angle, a, 0.4 * a)),
        },
    )
}

/// Any shape, turned about and combined.
fn any_shape() -> impl Strategy<Value = Named> {
    exact().prop_recursive(3, 8, 3, |inner| {
        let two = || (inner.clone(), inner.clone());
        prop_oneof![
            two().prop_map(|(a, b)| made(format!("union of {a:?} and {b:?}"), Union::new(both(a, b)))),
            two().prop_map(|(a, b)| made(format!("part of {a:?} in {b:?}"), Intersection::new(both(a, b)))),
            two().prop_map(|(a, b)| made(format!("{a:?} without {b:?}"), Ok(Difference::new(a, b)))),
            (two(), length()).prop_map(|((a, b), reach)| {
                made(format!("smooth union of {a:?} and {b:?} by {reach}"), SmoothUnion::new(a, b, reach))
            }),
            (inner.clone(), 0.0..0.2, 0.01..0.2)
                .prop_map(|(s, i, o)| made(format!("shell from -{i} to {o} of {s:?}"), Shell::new(s, i, o))),
            (inner.clone(), direction(), 0.0..TAU, vector(0.3)).prop_map(|(s, axis, angle, shift)| {
                made(format!("{s:?} about {axis:?} by {angle} moved {shift:?}"), Placed::new(s, axis, angle, shift))
            }),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_distance_is_steeper_than_one(shape in any_shape(), p in vector(2.5), step in vector(0.3)) {
        let q = plus(&p, &step, 1.0);
        let rise = (shape.distance(&p) - shape.distance(&q)).abs();
        prop_assert!(rise <= distance2(&p, &q).sqrt() + 1e-12, "{rise:e}");
    }

    /// With a slope of at most one, this says that the distance is the true one.
    #[test]
    fn as_far_along_the_gradient_as_said_lies_the_surface(shape in exact(), p in vector(2.0)) {
        let slope = gradient(&shape, &p, 1e-6);
        // Elsewhere several points of the surface are nearest.
        prop_assume!((norm(&slope) - 1.0).abs() < 1e-7);
        let foot = plus(&p, &slope, -shape.distance(&p));
        prop_assert!(shape.distance(&foot).abs() < 1e-6, "{:e}", shape.distance(&foot));
    }

    #[test]
    fn bounds_hold_what_is_near(shape in any_shape(), p in vector(2.5), level in 0.0..0.5) {
        for (level, bounds) in [(0.0, shape.bounds()), (level, shape.bounds_within(level))] {
            if let Some([low, high]) = bounds {
                let within = (0..3).all(|i| low[i] - 1e-12 <= p[i] && p[i] <= high[i] + 1e-12);
                prop_assert!(within || shape.distance(&p) > level, "{p:?} of distance {}", shape.distance(&p));
            }
        }
    }

    #[test]
    fn an_ellipsoid_is_as_far_as_along_its_normal(
        axes in [0.1..1.0, 0.1..1.0, 0.1..1.0],
        u in direction(),
        out in 0.0..3.0,
        depth in 0.0..1.0_f64,
    ) {
        let ellipsoid = Ellipsoid::new([0.0; 3], axes).unwrap();
        let unit = u.map(|x| x / norm(&u));
        let on: [f64; 3] = std::array::from_fn(|i| axes[i] * unit[i]);
        let slope: [f64; 3] = std::array::from_fn(|i| unit[i] / axes[i]);
        let normal = slope.map(|x| x / norm(&slope));
        prop_assert!(ellipsoid.distance(&on).abs() < 1e-14);
        prop_assert!((ellipsoid.distance(&plus(&on, &normal, out)) - out).abs() < 1e-13);
        // No ball in the ellipsoid of the least radius of curvature reaches past the point it touches.
        let (least, most) = axes.iter().fold((1.0_f64, 0.0_f64), |(l, m), &a| (l.min(a), m.max(a)));
        let depth = depth * least * least / most;
        prop_assert!((ellipsoid.distance(&plus(&on, &normal, -depth)) + depth).abs() < 1e-13);
    }

    #[test]
    fn a_bent_tube_agrees_with_points_along_its_arc(angle in 0.1..TAU, p in vector(2.0)) {
        let tube = TorusArc::new([0.1, 0.0, 0.0], [0.0, 0.0, 2.0], [3.0, 0.0, 1.0], angle, 0.8, 0.2).unwrap();
        let n = 4000;
        let along = (0..=n).map(|k| {
            let (sin, cos) = (angle * f64::from(k) / f64::from(n)).sin_cos();
            distance2(&p, &[0.1 + 0.8 * cos, 0.8 * sin, 0.0]).sqrt()
        });
        let sampled = along.fold(f64::INFINITY, f64::min) - 0.2;
        // A point of the arc is at most half a step from a sample.
        let d = tube.distance(&p);
        prop_assert!(d <= sampled + 1e-12 && sampled - d < 0.5 * 0.8 * angle / f64::from(n) + 1e-12, "{d} {sampled}");
    }
}

#[track_caller]
fn at(shape: &dyn Implicit, p: [f64; 3], expected: f64) {
    let found = shape.distance(&p);
    assert!((found - expected).abs() < 1e-12, "{found} at {p:?} is not {expected}");
}

#[test]
fn known_distances_of_simple_bodies() {
    at(&Sphere::new([1.0, 0.0, 0.0], 0.5).unwrap(), [1.0, 3.0, 4.0], 4.5);
    let capsule = Capsule::new([0.0; 3], [2.0, 0.0, 0.0], 0.5).unwrap();
    at(&capsule, [1.0, 0.0, 0.0], -0.5);
    at(&capsule, [5.0, 4.0, 0.0], 4.5);
    let cylinder = Cylinder::new([0.0; 3], [0.0, 0.0, 2.0], 0.5).unwrap();
    at(&cylinder, [0.0, 0.0, 1.0], -0.5);
    at(&cylinder, [0.1, 0.0, 1.9], -0.1);
    at(&cylinder, [3.5, 0.0, 6.0], 5.0);
    let cuboid = Cuboid::new([0.0; 3], [1.0, 2.0, 3.0]).unwrap();
    at(&cuboid, [0.5, 1.0, 1.5], -0.5);
    at(&cuboid, [3.0, 5.0, 9.0], 7.0);
    at(&HalfSpace::new([0.0, 0.0, 1.0], [0.0, 0.0, 1e-200]).unwrap(), [5.0, 6.0, 3.0], 2.0);
    let quarter = TorusArc::new([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], FRAC_PI_2, 1.0, 0.25).unwrap();
    at(&quarter, [0.0, 1.0, 0.0], -0.25);
    at(&quarter, [1.0, -2.0, 0.0], 1.75);
    at(&quarter, [0.0, 0.0, 1.0], 2_f64.sqrt() - 0.25);
}

#[test]
fn known_distances_of_an_ellipsoid() {
    let ellipsoid = Ellipsoid::new([0.0; 3], [5.0, 4.0, 3.5]).unwrap();
    at(&ellipsoid, [0.0; 3], -3.5);
    at(&ellipsoid, [9.0, 0.0, 0.0], 4.0);
    at(&ellipsoid, [0.0, 0.0, -4.0], 0.5);
    // On the longest axis, nearer to the centre than the focus, the nearest points lie off the axis: the foot is at
    // x = 2 * 25 / (25 - 12.25), z = 3.5 sqrt(1 - (x / 5)²).
    let (x, y) = (2.0 * 25.0 / 12.75, 2.0);
    let z2 = 12.25 * (1.0 - x * x / 25.0);
    at(&ellipsoid, [y, 0.0, 0.0], -((x - y) * (x - y) + z2).sqrt());
    // Continuous across that sheet, however near.
    for z in [1e-3, 1e-8, 1e-100, 1e-300] {
        let change = ellipsoid.distance(&[y, 0.0, z]) - ellipsoid.distance(&[y, 0.0, 0.0]);
        assert!((0.0..=z + 1e-12).contains(&change.abs()), "{change:e}");
    }
    // Thin to the extreme: a disc.
    let disc = Ellipsoid::new([0.0; 3], [1.0, 1.0, 1e-6]).unwrap();
    at(&disc, [0.3, 0.4, 0.2], 0.2 - 1e-6 * 0.75_f64.sqrt());
    at(&disc, [0.0, 2.0, 0.0], 1.0);
}

#[test]
fn combinations_have_the_right_parts() {
    let ball = |x: f64| Sphere::new([x, 0.0, 0.0], 1.0).unwrap();
    let shell = Shell::new(ball(0.0), 0.2, 0.1).unwrap();
    at(&shell, [1.05, 0.0, 0.0], -0.05);
    at(&shell, [0.5, 0.0, 0.0], 0.3);
    at(&shell, [2.0, 0.0, 0.0], 0.9);
    at(&Difference::new(ball(0.0), ball(1.0)), [-0.5, 0.0, 0.0], -0.5);
    at(&Difference::new(ball(0.0), ball(1.0)), [0.5, 0.0, 0.0], 0.5);
    let both: Vec<Box<dyn Implicit>> = vec![Box::new(ball(0.0)), Box::new(ball(1.5))];
    at(&Intersection::new(both).unwrap(), [0.75, 0.0, 0.0], -0.25);
    // Midway between two balls that touch: the dent is filled by a quarter of the reach.
    at(&SmoothUnion::new(ball(-1.0), ball(1.0), 0.4).unwrap(), [0.0; 3], -0.1);
    at(&SmoothUnion::new(ball(-1.0), ball(1.0), 0.4).unwrap(), [-3.0, 0.0, 0.0], 1.0);
    let turned =
        Placed::new(Cuboid::new([0.0; 3], [3.0, 1.0, 1.0]).unwrap(), [0.0, 0.0, 2.0], FRAC_PI_2, [10.0, 0.0, 0.0]);
    let turned = turned.unwrap();
    at(&turned, [9.5, 2.0, 0.5], -0.5);
    at(&turned, [9.5, 5.0, 0.5], 2.0);
    let [low, high] = turned.bounds().unwrap();
    let expected = [[9.0, 0.0, 0.0], [10.0, 3.0, 1.0]];
    assert!(norm(&subtract(&low, &expected[0])) < 1e-12 && norm(&subtract(&high, &expected[1])) < 1e-12);
}

#[test]
fn what_has_no_end_has_no_bounds() {
    let half = || Box::new(HalfSpace::new([0.0; 3], [0.0, 0.0, 1.0]).unwrap());
    let ball = || Box::new(Sphere::new([0.0; 3], 1.0).unwrap());
    assert_eq!(Union::new(vec![ball(), half()]).unwrap().bounds(), None);
    assert_eq!(Intersection::new(vec![half(), ball()]).unwrap().bounds(), ball().bounds());
    assert_eq!(Shell::new(half(), 0.0, 1.0).unwrap().bounds(), None);
}

#[test]
fn bad_parameters_are_named() {
    let say = |error: Option<ShapeError>| error.expect("an error").to_string();
    let ball = || Sphere::new([0.0; 3], 1.0).unwrap();
    assert_eq!(say(Sphere::new([0.0; 3], -1.0).err()), "the radius is -1e0 m: expected from 1e-12 to 1e12 m");
    assert_eq!(
        say(Ellipsoid::new([0.0; 3], [1.0, f64::NAN, 1.0]).err()),
        "the semi-axis along y is NaN m: expected from 1e-12 to 1e12 m"
    );
    assert_eq!(
        say(Sphere::new([0.0, f64::INFINITY, 0.0], 1.0).err()),
        "coordinate 1 of the centre is inf m: expected a number of magnitude at most 1e12 m"
    );
    assert_eq!(
        say(Capsule::new([1.0; 3], [1.0; 3], 1.0).err()),
        "the distance of the ends is 0e0 m: expected from 1e-12 to 1e12 m"
    );
    assert_eq!(say(Cylinder::new([0.0; 3], [1.0; 3], 0.0).err()), "the radius is 0e0 m: expected from 1e-12 to 1e12 m");
    assert_eq!(
        say(Cuboid::new([0.0; 3], [1.0, -1.0, 1.0]).err()),
        "the length along y is -1e0 m: expected from 1e-12 to 1e12 m"
    );
    assert_eq!(
        say(HalfSpace::new([0.0; 3], [0.0; 3]).err()),
        "the normal is [0.0, 0.0, 0.0]: expected a finite vector that is not zero"
    );
    let arc = |axis, angle, ring, tube| TorusArc::new([0.0; 3], axis, [0.0, 0.0, 1.0], angle, ring, tube).err();
    assert_eq!(
        say(arc([1.0, 0.0, 0.0], 1.0, 1.0, 2.0)),
        "the radius of the tube is 2e0 m: expected less than the radius of the ring, 1e0 m"
    );
    assert_eq!(say(arc([1.0, 0.0, 0.0], 7.0, 1.0, 0.5)), "the angle is 7e0 rad: expected more than 0, at most 2 pi");
    assert!(matches!(arc([0.0, 0.0, 1.0], PI, 1.0, 0.5), Some(ShapeError::Direction { .. })));
    assert_eq!(
        say(Shell::new(ball(), 0.0, -0.1).err()),
        "the thickness outside is -1e-1 m: expected from 1e-12 to 1e12 m"
    );
    assert_eq!(say(Shell::new(ball(), 0.0, 0.0).err()), "the thickness is 0e0 m: expected from 1e-12 to 1e12 m");
    assert_eq!(say(SmoothUnion::new(ball(), ball(), 0.0).err()), "the reach is 0e0 m: expected from 1e-12 to 1e12 m");
    assert_eq!(say(Union::new(vec![]).err()), "the union of no shapes: expected at least one");
    let turned = Placed::new(ball(), [1.0, 0.0, 0.0], f64::INFINITY, [0.0; 3]);
    assert_eq!(say(turned.err()), "the angle is inf rad: expected a finite number");
}
