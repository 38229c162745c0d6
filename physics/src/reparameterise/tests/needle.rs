//! What needles carry, and their edges outside the tissue.

use crate::coupling::SlipState::{Backward, Forward, Static};
use crate::reparameterise::{EdgeLimits, Profile, ReparameteriseError, adapt, merge_and_split, reparameterise};
use proptest::prelude::*;

/// A straight needle along x with its nodes at these distances, and fields that vary along it.
fn straight(arc: &[f64], coupled: usize) -> Profile {
    let n = arc.len();
    let field = |x: f64| [1.0 + x, 2.0 - 3.0 * x, x];
    Profile {
        positions: on_axis(arc),
        rest_lengths: arc.windows(2).map(|e| 1.01 * (e[1] - e[0])).collect(),
        angles: arc.windows(2).map(|e| 0.1 + e[0] + e[1]).collect(),
        rest_curvature: arc[1..n - 1].iter().flat_map(|x| [5.0 * x, 1.0 - x]).collect(),
        velocity: arc.iter().flat_map(|&x| field(x)).collect(),
        acceleration: arc.iter().flat_map(|&x| field(-x)).collect(),
        states: (0..coupled).map(|i| [Static, Forward, Backward][i % 3]).collect(),
    }
}

fn on_axis(arc: &[f64]) -> Vec<f64> {
    arc.iter().flat_map(|&x| [x, 0.0, 0.0]).collect()
}

fn near(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn linear_fields_are_read_exactly_at_other_nodes() {
    let before = straight(&[0.0, 0.1, 0.15, 0.3, 0.5, 0.6, 0.8], 3);
    let arc = [0.0, 0.1, 0.2, 0.4, 0.54, 0.58, 0.71, 0.8];
    let after = reparameterise(&before, &on_axis(&arc), 4).unwrap();
    let expected = straight(&arc, 0);
    assert!(near(&after.rest_lengths, &expected.rest_lengths, 1e-15));
    // Beyond the middles of the first and the last edge, angles are constant.
    assert!(near(&after.angles[..6], &expected.angles[..6], 1e-14) && (after.angles[6] - 1.5).abs() < 1e-15);
    assert!(near(&after.rest_curvature[..10], &expected.rest_curvature[..10], 1e-14));
    assert_eq!(after.rest_curvature[10..], before.rest_curvature[8..]);
    assert!(near(&after.velocity, &expected.velocity, 1e-14));
    assert!(near(&after.acceleration, &expected.acceleration, 1e-14));
    // The nodes in the tissue were at 0.5, 0.6 and 0.8: static, forward, backward.
    assert_eq!(after.states, [Static, Forward, Backward, Backward]);
}

#[test]
fn tips_agree_after_a_stretch() {
    let before = straight(&[0.0, 0.1, 0.25, 0.3, 0.5, 0.6], 2);
    let stretched: Vec<f64> = before.positions.iter().map(|x| 1.25 * x).collect();
    let after = reparameterise(&before, &stretched, 2).unwrap();
    assert!(near(&after.rest_lengths, &before.rest_lengths, 1e-15));
    assert!(near(&after.angles, &before.angles, 1e-15) && near(&after.velocity, &before.velocity, 1e-14));
    assert_eq!(after.states, before.states);
}

#[test]
fn rest_lengths_stay_positive_where_the_cubic_would_turn_back() {
    let mut before = straight(&[0.0, 1.0, 2.0, 3.0, 4.0], 0);
    before.rest_lengths = vec![1.0, 1e-6, 3.0, 1e-6];
    let arc: Vec<f64> = (0..=40).map(|i| 0.1 * f64::from(i)).collect();
    let after = reparameterise(&before, &on_axis(&arc), 0).unwrap();
    assert!(after.rest_lengths.iter().all(|&l| l > 0.0), "{:?}", after.rest_lengths);
    assert!((after.rest_lengths.iter().sum::<f64>() - 4.000002).abs() < 1e-14);
}

#[test]
fn short_edges_lose_a_free_node() {
    let limits = EdgeLimits::from_initial(0.1, 0.1).unwrap();
    let merged = |arc: &[f64], coupled| {
        let (positions, report) = merge_and_split(&on_axis(arc), coupled, &limits).unwrap();
        (positions.chunks(3).map(|x| x[0]).collect::<Vec<_>>(), report)
    };
    // At the end of the sleeve, and at the entry, which are at 0.1 and 0.5.
    let (arc, report) = merged(&[0.0, 0.1, 0.14, 0.3, 0.46, 0.5, 0.52, 0.6], 3);
    assert_eq!(arc, [0.0, 0.1, 0.3, 0.5, 0.52, 0.6]);
    assert_eq!((report.merged, report.split, report.free, report.too_short), (2, 0, 1, None));
    // Between free nodes: the one that leaves the shorter edges.
    let (arc, _) = merged(&[0.0, 0.1, 0.3, 0.32, 0.4, 0.5], 1);
    assert_eq!(arc, [0.0, 0.1, 0.3, 0.4, 0.5]);
    // Of nodes that coincide one is left; the only free node goes too; then nothing can be done.
    let (arc, report) = merged(&[0.0, 0.1, 0.1, 0.1, 0.3, 0.5], 2);
    assert_eq!((arc, report.free), (vec![0.0, 0.1, 0.3, 0.5], 0));
    let (arc, report) = merged(&[0.0, 0.1, 0.11, 0.12, 0.5], 2);
    assert_eq!((arc, report.free), (vec![0.0, 0.1, 0.12, 0.5], 0));
    assert!((report.too_short.unwrap() - 0.02).abs() < 1e-15);
    // Not in the tissue: the tip stays.
    let (arc, report) = merged(&[0.0, 0.1, 0.2, 0.22], 0);
    assert_eq!((arc, report.free), (vec![0.0, 0.1, 0.22], 0));
}

#[test]
fn long_edges_are_split_as_often_as_it_takes() {
    let limits = EdgeLimits::from_initial(0.1, 0.1).unwrap();
    let (positions, report) = merge_and_split(&on_axis(&[0.0, 0.1, 3.1, 3.2]), 2, &limits).unwrap();
    assert_eq!((report.split, report.free), (7, 7));
    let expected = [0.0, 0.1, 0.475, 0.85, 1.225, 1.6, 1.975, 2.35, 2.725, 3.1, 3.2];
    assert!(near(&positions, &on_axis(&expected), 1e-14), "{positions:?}");
}

/// Equal chords of a circle: the cubic misses it by the fourth power of their length.
#[test]
fn a_split_arc_stays_round() {
    let error = |h: f64| {
        let angles = [0.0, 1.0, 2.0, 3.0].map(|i| i * h);
        let positions: Vec<f64> = angles.iter().flat_map(|a| [a.cos(), a.sin(), 0.0]).collect();
        let limits = EdgeLimits::from_initial(0.1 * h, 0.2 * h).unwrap();
        let (split, report) = merge_and_split(&positions, 2, &limits).unwrap();
        assert_eq!(report.split, 1);
        (split[6].hypot(split[7]) - 1.0).abs()
    };
    let order = (error(0.2) / error(0.1)).log2();
    assert!(order > 3.9 && error(0.1) < 1e-4, "{order}, {}", error(0.1));
}

#[test]
fn bad_needles_are_refused() {
    use ReparameteriseError::{Coupled, Length, Limits, NotFinite, Order, Shape, TooFew, TooLong};
    let arc = [0.0, 0.1, 0.2, 0.3];
    let good = straight(&arc, 1);
    let x = on_axis(&arc);
    let changed = |change: fn(&mut Profile)| {
        let mut profile = good.clone();
        change(&mut profile);
        reparameterise(&profile, &x, 1).unwrap_err()
    };
    assert!(matches!(changed(|p| p.angles.truncate(2)), Shape { what: "angles", len: 2, expected: 3 }));
    assert!(matches!(changed(|p| p.rest_lengths[1] = -1.0), Length { index: 1, .. }));
    assert!(matches!(changed(|p| p.velocity[4] = f64::NAN), NotFinite { what: "velocity", index: 4 }));
    assert!(matches!(changed(|p| p.positions[3] = 0.0), Order { index: 1, .. }));
    assert!(matches!(changed(|p| p.states.resize(5, Static)), Coupled { coupled: 5, nodes: 4, most: 4 }));
    assert!(matches!(reparameterise(&good, &x[..6], 0), Err(TooFew { count: 2, .. })));
    assert!(matches!(reparameterise(&good, &x[..10], 0), Err(Shape { len: 10, .. })));
    assert!(matches!(reparameterise(&good, &x, 5), Err(Coupled { .. })));
    let limits = EdgeLimits::from_initial(0.1, 0.2).unwrap();
    assert!(matches!(merge_and_split(&x, 3, &limits), Err(Coupled { coupled: 3, nodes: 4, most: 2 })));
    assert!(matches!(merge_and_split(&x[..6], 0, &limits), Err(TooFew { .. })));
    assert!(matches!(merge_and_split(&[f64::NAN; 9], 0, &limits), Err(NotFinite { .. })));
    for far in [1e6, 1e300, f64::MAX] {
        assert!(matches!(merge_and_split(&on_axis(&[0.0, 0.1, far]), 0, &limits), Err(TooLong { .. })));
    }
    let folded = on_axis(&[0.0, 0.1, -f64::MAX, f64::MAX]);
    assert!(matches!(merge_and_split(&folded, 0, &limits), Err(NotFinite { what: "lengths of the edges", index: 2 })));
    for (shortest, longest) in [(0.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY), (1.0, f64::NAN)] {
        assert!(matches!(EdgeLimits::from_initial(shortest, longest), Err(Limits { .. })));
    }
}

/// A bent needle: a walk of steps with lengths in this range that mostly go forward.
fn walk(lengths: std::ops::Range<f64>) -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec((lengths, -0.7..0.7f64, -0.7..0.7f64), 3..14).prop_map(|steps| {
        let mut positions = vec![0.0; 3];
        for (length, y, z) in steps {
            let norm = (1.0 + y * y + z * z).sqrt();
            for along in [1.0, y, z] {
                positions.push(positions[positions.len() - 3] + length * along / norm);
            }
        }
        positions
    })
}

/// A needle at these positions that carries numbers without any order.
fn scrambled(positions: Vec<f64>, coupled: usize) -> Profile {
    let n = positions.len() / 3;
    let numbers = |count: usize, seed: f64| (0..count).map(|i| (seed + 7.3 * i as f64).sin()).collect::<Vec<_>>();
    Profile {
        rest_lengths: numbers(n - 1, 0.2).iter().map(|x| 0.1 + 0.05 * x).collect(),
        angles: numbers(n - 1, 1.0),
        rest_curvature: numbers(2 * (n - 2), 2.0),
        velocity: numbers(3 * n, 3.0),
        acceleration: numbers(3 * n, 4.0),
        states: (0..coupled).map(|i| [Forward, Static, Backward][i % 3]).collect(),
        positions,
    }
}

proptest! {
    #[test]
    fn a_needle_that_has_not_moved_keeps_everything(x in walk(0.01..1.0), coupled in 0usize..3) {
        let profile = scrambled(x, coupled);
        prop_assert_eq!(&reparameterise(&profile, &profile.positions, coupled).unwrap(), &profile);
    }

    #[test]
    fn rest_length_is_conserved_and_positive(x in walk(0.01..1.0), y in walk(0.01..1.0), coupled in 0usize..3) {
        let before = scrambled(x, coupled);
        let after = reparameterise(&before, &y, 2).unwrap();
        after.check().unwrap();
        let (old, new): (f64, f64) = (before.rest_lengths.iter().sum(), after.rest_lengths.iter().sum());
        prop_assert!((old - new).abs() <= 1e-14 * old, "{old} {new}");
        prop_assert_eq!(after.states.len(), 2);
        let largest = |v: &[f64]| v.iter().fold(0.0, |max: f64, v| max.max(v.abs()));
        prop_assert!(largest(&after.velocity) <= largest(&before.velocity));
        prop_assert_eq!(&after.velocity[..3], &before.velocity[..3]);
        prop_assert_eq!(&after.velocity[after.velocity.len() - 3..], &before.velocity[before.velocity.len() - 3..]);
    }

    #[test]
    fn edges_outside_end_up_within_their_limits(x in walk(0.001..2.0), coupled in 0usize..3) {
        let limits = EdgeLimits::from_initial(0.1, 0.12).unwrap();
        let before = scrambled(x, coupled);
        let (after, report) = adapt(&before, &before.positions, coupled, &limits).unwrap();
        prop_assert_eq!(after.n_nodes() + report.merged, before.n_nodes() + report.split);
        prop_assert_eq!(&after.positions[..6], &before.positions[..6]);
        let (kept, old, new) = (3 * coupled.max(1), &before.positions, &after.positions);
        prop_assert_eq!(&new[new.len() - kept..], &old[old.len() - kept..]);
        let entry = after.n_nodes() - coupled.max(1);
        prop_assert_eq!(report.free, entry - 2);
        let arc = after.arc_lengths();
        for edge in 1..entry {
            let length = arc[edge + 1] - arc[edge];
            prop_assert!(length <= limits.longest() * (1.0 + 1e-12));
            prop_assert!(length >= limits.shortest() * (1.0 - 1e-12) || report.too_short.is_some());
        }
        let (again, idle) = merge_and_split(new, coupled, &limits).unwrap();
        prop_assert_eq!((&again, idle.merged, idle.split), (new, 0, 0));
        let (old, new): (f64, f64) = (before.rest_lengths.iter().sum(), after.rest_lengths.iter().sum());
        prop_assert!((old - new).abs() <= 1e-14 * old);
    }
}

/// Anything at all, in sizes from nothing to the largest.
fn anything() -> impl Strategy<Value = Vec<f64>> {
    let number = prop_oneof![-1.0..1.0f64, -1e4..1e4f64, Just(0.0), any::<f64>()];
    proptest::collection::vec(number, 0..40)
}

proptest! {
    #[test]
    fn any_positions_are_adapted_or_refused(x in anything(), y in anything(), coupled in 0usize..15) {
        let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
        let limits = EdgeLimits::from_initial(0.01, 1.0).unwrap();
        if let Ok((positions, _)) = merge_and_split(&y, coupled, &limits) {
            prop_assert!(finite(&positions));
        }
        let before = scrambled(if x.len() < 9 { vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0] } else { x }, 1);
        if let Ok(after) = reparameterise(&before, &y, coupled) {
            prop_assert!(finite(&after.angles) && finite(&after.rest_curvature) && finite(&after.rest_lengths));
            prop_assert!(finite(&after.velocity) && finite(&after.acceleration));
            prop_assert!(after.rest_lengths.iter().all(|&l| l > 0.0), "{:?}", after.rest_lengths);
        }
    }
}
