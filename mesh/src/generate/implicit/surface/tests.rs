//! Surfaces of known solids, and surfaces that hold none.

use super::super::{Cuboid, Sphere};
use super::*;
use proptest::prelude::*;

type Surface = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// A box, its sides divided along one diagonal each, counter-clockwise seen from outside.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> Surface {
    let corner = |i: usize| std::array::from_fn(|k| if i >> k & 1 == 0 { low[k] } else { high[k] });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    ((0..8).map(corner).collect(), sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// An icosahedron in the unit sphere, each triangle divided into four `times` over.
fn icosphere(times: usize) -> Surface {
    let g = 0.5 * (1.0 + 5_f64.sqrt());
    let mut points = vec![];
    for (s, t) in [(-1.0, -g), (1.0, -g), (-1.0, g), (1.0, g)] {
        points.extend([[s, t, 0.0], [0.0, s, t], [t, 0.0, s]]);
    }
    points.iter_mut().for_each(|p| *p = p.map(|x| x / norm(&[1.0, g])));
    // The triples of points at the least distance, turned outwards.
    let near = |a: u32, b: u32| norm(&subtract(&points[a as usize], &points[b as usize])) < 1.1;
    let mut triangles = vec![];
    for c in 0..12 {
        for b in 0..c {
            triangles.extend((0..b).filter(|&a| near(a, b) && near(b, c) && near(a, c)).map(|a| [a, b, c]));
        }
    }
    for t in &mut triangles {
        let [a, b, c] = t.map(|v: u32| points[v as usize]);
        if dot(&a, &cross(&b, &c)) < 0.0 {
            t.swap(1, 2);
        }
    }
    for _ in 0..times {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let sum: [f64; 3] = std::array::from_fn(|k| points[a as usize][k] + points[b as usize][k]);
                points.push(sum.map(|x| x / norm(&sum)));
                points.len() as u32 - 1
            })
        };
        let divided = triangles.iter().flat_map(|&[a, b, c]| {
            let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, d, f], [b, e, d], [c, f, e], [d, e, f]]
        });
        triangles = divided.collect();
    }
    (points, triangles)
}

fn joined(parts: &[Surface]) -> Surface {
    let mut all: Surface = (vec![], vec![]);
    for (points, triangles) in parts {
        let shift = all.0.len() as u32;
        all.0.extend(points);
        all.1.extend(triangles.iter().map(|t| t.map(|v| v + shift)));
    }
    all
}

fn solid((points, triangles): &Surface) -> Result<ClosedSurface, SurfaceError> {
    ClosedSurface::new(points, triangles)
}

fn message(surface: &Surface) -> String {
    solid(surface).expect_err("a fault").to_string()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// Also where the nearest point is on an edge or a corner, which is so for most points outside.
    #[test]
    fn a_cube_has_the_distances_of_a_cuboid(p in [-1.0..3.0, -1.0..3.0, -1.0..4.0]) {
        let (low, high) = ([0.0; 3], [1.0, 2.0, 3.0]);
        let (exact, cube) = (Cuboid::new(low, high).unwrap(), solid(&cuboid(low, high)).unwrap());
        prop_assert!((exact.distance(&p) - cube.distance(&p)).abs() < 1e-14);
        prop_assert_eq!(cube.bounds(), exact.bounds());
    }
}

#[test]
fn a_fine_ball_has_the_distances_of_a_sphere() {
    let surface = icosphere(4);
    assert_eq!((surface.0.len(), surface.1.len()), (2_562, 5_120));
    let (ball, sphere) = (solid(&surface).unwrap(), Sphere::new([0.0; 3], 1.0).unwrap());
    // The greatest sag: of the triangle with the greatest circumradius.
    let sag = |t: &[u32; 3]| {
        1.0 - (1.0 - crate::geometry::circumradius(&t.map(|v| surface.0[v as usize])).unwrap().powi(2)).sqrt()
    };
    let most = surface.1.iter().map(sag).fold(0.0, f64::max);
    assert!(most < 2e-3);
    for i in 0..4000 {
        let p = [1.0, 2.0, 3.0].map(|k| 1.5 * (f64::from(i) * k * 0.777 + k).sin());
        let more = ball.distance(&p) - sphere.distance(&p);
        assert!((-1e-14..=most).contains(&more), "{more:e} at {p:?}");
    }
    // Corners themselves, and just beside them on both sides.
    for p in surface.0.iter().step_by(7) {
        assert!(ball.distance(p).abs() < 1e-15);
        assert!(ball.distance(&p.map(|x| 1.001 * x)) > 0.0 && ball.distance(&p.map(|x| 0.999 * x)) < 0.0);
    }
}

#[test]
fn a_hollow_is_outside() {
    let mut inner = cuboid([0.3; 3], [0.7; 3]);
    inner.1.iter_mut().for_each(|t| t.swap(0, 1));
    let walls = solid(&joined(&[cuboid([0.0; 3], [1.0; 3]), inner])).unwrap();
    assert_eq!(walls.turned(), 0);
    for (p, expected) in [([0.5; 3], 0.2), ([0.1, 0.5, 0.5], -0.1), ([0.25, 0.5, 0.5], -0.05), ([2.0, 0.5, 0.5], 1.0)] {
        assert!((walls.distance(&p) - expected).abs() < 1e-15, "{p:?}");
    }
}

#[test]
fn windings_are_put_right() {
    let cube = cuboid([0.0; 3], [1.0; 3]);
    let exact = solid(&cube).unwrap();
    let turned = |ids: &[usize]| {
        let mut surface = cube.clone();
        ids.iter().for_each(|&t| surface.1[t].swap(0, 1));
        solid(&surface).unwrap()
    };
    assert_eq!(exact.turned(), 0);
    for (ids, count) in
        [(&[3, 7][..], 2), (&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11], 12), (&[0, 1, 2, 3, 4, 5, 6, 8, 9, 11], 10)]
    {
        let surface = turned(ids);
        assert_eq!(surface.turned(), count);
        for p in [[0.5; 3], [0.9, 0.2, 0.1], [1.5, 1.5, 1.5], [-1.0, 0.5, 0.5]] {
            assert_eq!(surface.distance(&p), exact.distance(&p));
        }
    }
}

#[test]
fn a_point_that_is_no_number_has_no_distance() {
    assert!(solid(&cuboid([0.0; 3], [1.0; 3])).unwrap().distance(&[f64::NAN, 0.0, 0.0]).is_nan());
}

#[test]
fn surfaces_that_hold_nothing_are_refused() {
    let cube = || cuboid([0.0; 3], [1.0; 3]);
    let mut open = cube();
    open.1.remove(4);
    assert_eq!(
        message(&open),
        "the surface is open: 3 edges have one triangle, the first from point 0 to 1 of triangle 1"
    );
    let empty = (vec![], vec![]);
    assert_eq!(message(&empty), "the surface has 1 faults: 1 no cells; the first: there are no cells");
    let mut wild = cube();
    wild.0[3][1] = f64::NAN;
    assert!(message(&wild).contains("vertex 3: coordinate 1 is NaN"), "{}", message(&wild));
    let mut fin = cube();
    fin.0.push([2.0, 2.0, 2.0]);
    fin.1.push([0, 1, 8]);
    assert!(message(&fin).contains("1 shared facet"), "{}", message(&fin));
    // Two cubes that have a corner in common, and two with an edge.
    let mut corner = joined(&[cube(), cuboid([1.0; 3], [2.0; 3])]);
    corner.1.as_flattened_mut().iter_mut().filter(|v| **v == 8).for_each(|v| *v = 7);
    assert!(message(&corner).contains("1 pinched"), "{}", message(&corner));
    let mut flat = cube();
    flat.0[7] = [0.5, 0.5, 0.0];
    assert!(matches!(solid(&flat), Err(SurfaceError::Touching { .. })));
}

#[test]
fn surfaces_that_meet_themselves_are_refused() {
    let cube = |low: f64, high: f64| cuboid([low; 3], [high; 3]);
    let touching = |surface: &Surface| match solid(surface) {
        Err(SurfaceError::Touching { count, triangles }) => (count, triangles),
        other => panic!("{other:?}"),
    };
    // Corners in one place, an edge through a side, a side on a side.
    assert!(touching(&joined(&[cube(0.0, 1.0), cube(1.0, 2.0)])).0 > 0);
    let (count, [a, b]) = touching(&joined(&[cube(0.0, 1.0), cube(0.9, 2.0)]));
    assert!(count >= 6 && a < 12 && b >= 12);
    let beside = cuboid([1.0, 0.25, 0.25], [2.0, 0.75, 0.75]);
    assert!(touching(&joined(&[cube(0.0, 1.0), beside])).0 > 0);
    // Apart by a millionth, they are two solids.
    let apart = cuboid([1.000_001, 0.25, 0.25], [2.0, 0.75, 0.75]);
    assert!(solid(&joined(&[cube(0.0, 1.0), apart])).is_ok());
    // A corner pushed through the side across from it: triangles cross that have a corner in common, or none.
    let mut pushed = icosphere(1);
    pushed.0[0] = pushed.0[0].map(|x| -1.2 * x);
    assert!(touching(&pushed).0 > 0);
}
