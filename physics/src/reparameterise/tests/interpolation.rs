//! Akima's and linear interpolation of known functions.

use crate::reparameterise::{Akima, Linear, ReparameteriseError};
use proptest::prelude::*;

fn at(akima: &Akima, x: f64) -> f64 {
    let mut out = [f64::NAN];
    akima.evaluate(x, &mut out);
    out[0]
}

/// The table in the tests of SciPy's `Akima1DInterpolator`, and one that is not equidistant, evaluated by SciPy 1.17.
#[test]
fn known_values_are_reproduced() {
    let x: Vec<f64> = (0..11).map(f64::from).collect();
    let y = [0.0, 2.0, 1.0, 3.0, 2.0, 6.0, 5.5, 5.5, 2.7, 5.1, 3.0];
    let akima = Akima::new(&x, &y).unwrap();
    for (x, expected) in [
        (0.0, 0.0),
        (0.5, 1.375),
        (1.0, 2.0),
        (1.5, 1.5),
        (2.5, 1.953125),
        (3.5, 2.484375),
        (4.5, 4.136_363_636_363_637),
        (5.1, 5.980_362_391_033_624),
        (6.5, 5.506_729_151_646_239),
        (7.2, 5.203_136_745_974_525),
        (8.6, 4.179_655_415_901_708),
        (9.9, 3.411_038_659_793_813),
        (10.0, 3.0),
    ] {
        assert!((at(&akima, x) - expected).abs() < 1e-14, "{x}: {} {expected}", at(&akima, x));
    }
    let akima = Akima::new(&[0.0, 0.7, 1.1, 2.4, 3.0, 4.6, 5.1], &[1.0, -0.5, 2.0, 2.5, 0.0, 3.0, 3.2]).unwrap();
    for (x, expected) in [
        (0.2, -0.058_423_493_261_879_35),
        (0.9, 0.767_525_339_708_685_6),
        (1.7, 2.923_843_213_340_311_4),
        (2.7, 1.080_982_282_174_670_8),
        (3.5, 0.715_381_172_467_564_3),
        (4.0, 1.944_914_187_386_464_5),
        (4.9, 3.186_993_126_385_809_6),
    ] {
        assert!((at(&akima, x) - expected).abs() < 1e-13, "{x}: {} {expected}", at(&akima, x));
    }
}

#[test]
fn a_parabola_over_equidistant_points_is_exact() {
    let parabola = |x: f64| 2.0 - 3.0 * x + 0.5 * x * x;
    for n in 3..9 {
        let x: Vec<f64> = (0..n).map(|i| -1.0 + 0.5 * f64::from(i)).collect();
        let y: Vec<f64> = x.iter().map(|&x| parabola(x)).collect();
        let akima = Akima::new(&x, &y).unwrap();
        for k in 0..=100 {
            let x = -1.0 + 0.005 * f64::from(k) * f64::from(n - 1);
            assert!((at(&akima, x) - parabola(x)).abs() < 1e-13, "{n} points at {x}");
        }
    }
}

#[test]
fn one_point_makes_a_constant_and_two_a_straight_line() {
    let one = Akima::new(&[3.0], &[5.0]).unwrap();
    assert_eq!([at(&one, -1.0), at(&one, 3.0), at(&one, 9.0)], [5.0; 3]);
    let two = Akima::new(&[1.0, 3.0], &[5.0, 9.0]).unwrap();
    assert_eq!([at(&two, 0.0), at(&two, 1.5), at(&two, 2.0), at(&two, 4.0)], [5.0, 6.0, 7.0, 9.0]);
}

/// Slopes of second order make values of third order.
#[test]
fn the_error_falls_with_the_third_power_of_the_distance() {
    let error = |n: usize| {
        let x: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
        let y: Vec<f64> = x.iter().map(|x| (4.0 * x).sin() + x.exp()).collect();
        let akima = Akima::new(&x, &y).unwrap();
        let samples = (0..1000).map(|k| (f64::from(k) + 0.37) / 1000.0);
        samples.map(|x| (at(&akima, x) - (4.0 * x).sin() - x.exp()).abs()).fold(0.0, f64::max)
    };
    let order = (error(64) / error(512)).log2() / 3.0;
    assert!((2.8..3.3).contains(&order), "{order}");
}

#[test]
fn components_are_interpolated_each_for_itself() {
    let x = [0.0, 0.4, 1.0, 1.3, 2.0];
    let (a, b) = ([1.0, 2.0, -1.0, 0.0, 3.0], [0.0, 5.0, 5.0, 1.0, 2.0]);
    let both: Vec<f64> = a.iter().zip(&b).flat_map(|(a, b)| [*a, *b]).collect();
    let (akima, linear) = (Akima::new(&x, &both).unwrap(), Linear::new(&x, &both).unwrap());
    for k in 0..50 {
        let (s, mut out) = (f64::from(k) * 0.05 - 0.2, [0.0; 2]);
        akima.evaluate(s, &mut out);
        assert_eq!(out, [at(&Akima::new(&x, &a).unwrap(), s), at(&Akima::new(&x, &b).unwrap(), s)]);
        linear.evaluate(s, &mut out);
        let mut single = [0.0];
        Linear::new(&x, &b).unwrap().evaluate(s, &mut single);
        assert_eq!(out[1], single[0]);
    }
}

#[test]
fn bad_tables_are_refused() {
    use ReparameteriseError::{NotFinite, Order, Shape, TooFew};
    assert!(matches!(Akima::new(&[], &[]), Err(TooFew { .. })));
    assert!(matches!(Akima::new(&[0.0, f64::NAN], &[0.0, 0.0]), Err(NotFinite { index: 1, .. })));
    assert!(matches!(Linear::new(&[0.0, 1.0], &[0.0, f64::INFINITY]), Err(NotFinite { index: 1, .. })));
    assert!(matches!(Akima::new(&[0.0, 0.0], &[0.0, 0.0]), Err(Order { index: 1, .. })));
    assert!(matches!(Linear::new(&[1.0, 0.5], &[0.0, 0.0]), Err(Order { index: 1, .. })));
    assert!(matches!(Akima::new(&[0.0, 1.0], &[0.0; 3]), Err(Shape { len: 3, expected: 2, .. })));
    assert!(matches!(Akima::new(&[0.0, 1.0], &[-1e308, 1e308]), Err(NotFinite { .. })));
}

/// Increasing abscissae from 0 to about 1, and ordinates.
fn table() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    (3usize..12).prop_flat_map(|n| {
        let steps = proptest::collection::vec(0.1..1.0f64, n - 1);
        (steps, proptest::collection::vec(-1.0..1.0f64, n)).prop_map(|(steps, y)| {
            let mut x = vec![0.0];
            for step in steps {
                x.push(x[x.len() - 1] + step);
            }
            (x, y)
        })
    })
}

proptest! {
    #[test]
    fn straight_lines_are_exact((x, y) in table(), u in 0.0..1.0f64) {
        let line = |x: f64| y[0] + y[1] * x;
        let values: Vec<f64> = x.iter().map(|&x| line(x)).collect();
        let s = u * x[x.len() - 1];
        prop_assert!((at(&Akima::new(&x, &values).unwrap(), s) - line(s)).abs() < 1e-12);
        let mut out = [0.0];
        Linear::new(&x, &values).unwrap().evaluate(s, &mut out);
        prop_assert!((out[0] - line(s)).abs() < 1e-12);
    }

    #[test]
    fn a_mirror_image_has_mirrored_values((x, y) in table(), u in 0.0..1.0f64) {
        let mirrored: Vec<f64> = x.iter().rev().map(|x| -x).collect();
        let values: Vec<f64> = y.iter().rev().copied().collect();
        let s = u * x[x.len() - 1];
        let (a, b) = (at(&Akima::new(&x, &y).unwrap(), s), at(&Akima::new(&mirrored, &values).unwrap(), -s));
        prop_assert!((a - b).abs() < 1e-11, "{a} {b}");
    }

    #[test]
    fn a_point_matters_to_three_neighbours_only((x, y) in table(), k in 0usize..12, u in 0.0..1.0f64) {
        let k = k % x.len();
        let mut changed = y.clone();
        changed[k] += 1.0;
        let s = u * x[x.len() - 1];
        let far = (k >= 3 && s <= x[k - 3]) || (k + 3 < x.len() && s >= x[k + 3]);
        if far {
            prop_assert_eq!(at(&Akima::new(&x, &y).unwrap(), s), at(&Akima::new(&x, &changed).unwrap(), s));
        }
    }

    #[test]
    fn points_are_met_and_slopes_are_continuous((x, y) in table()) {
        let akima = Akima::new(&x, &y).unwrap();
        for i in 0..x.len() {
            prop_assert_eq!(at(&akima, x[i]), y[i]);
        }
        let h = 1e-6;
        for i in 1..x.len() - 1 {
            let (before, after) = ((y[i] - at(&akima, x[i] - h)) / h, (at(&akima, x[i] + h) - y[i]) / h);
            // Second derivatives are some hundreds at most; a kink would make a difference of the order of one.
            prop_assert!((before - after).abs() < 1e-2, "{before} {after}");
        }
    }
}
