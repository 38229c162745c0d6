//! Each search keeps its promise on functions of known kinds.

use super::*;
use proptest::prelude::*;

/// A smooth function with a known derivative, falling at 0.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// `a (t − c)² + b (t − c)⁴`.
    Quartic { a: f64, b: f64, c: f64 },
    /// `cosh(k (t − c))`.
    Cosh { k: f64, c: f64 },
    /// `s t − ln(1 − t/c) …`: falls, then rises to infinity at `c`.
    Barrier { force: f64, c: f64 },
    /// Two wells, the nearer one shallow: `(t − c)² ((t − 3c)² + w)`.
    Wells { c: f64, w: f64 },
    /// A parabola of size `amplitude` on a large constant: energies differ by little more than rounding errors, or by less.
    Flat { amplitude: f64, c: f64 },
}

impl Kind {
    fn value(self, t: f64) -> f64 {
        match self {
            Self::Quartic { a, b, c } => a * (t - c).powi(2) + b * (t - c).powi(4),
            Self::Cosh { k, c } => (k * (t - c)).cosh(),
            Self::Barrier { c, .. } if t >= c => f64::INFINITY,
            Self::Barrier { force, c } => -force * t - (1.0 - t / c).ln(),
            Self::Wells { c, w } => (t - c).powi(2) * ((t - 3.0 * c).powi(2) + w),
            // Noise as a sum of many terms would show it.
            Self::Flat { amplitude, c } => 1.0 + amplitude * (t / c - 1.0).powi(2) + 1e-15 * (1e6 * t).sin(),
        }
    }

    fn slope(self, t: f64) -> f64 {
        match self {
            Self::Quartic { a, b, c } => 2.0 * a * (t - c) + 4.0 * b * (t - c).powi(3),
            Self::Cosh { k, c } => k * (k * (t - c)).sinh(),
            Self::Barrier { force, c } => -force + 1.0 / (c - t),
            Self::Wells { c, w } => 2.0 * (t - c) * ((t - 3.0 * c).powi(2) + w) + 2.0 * (t - c).powi(2) * (t - 3.0 * c),
            Self::Flat { amplitude, c } => 2.0 * amplitude * (t / c - 1.0) / c,
        }
    }
}

/// Counts evaluations, and refuses steps beyond the limit.
struct Counted {
    kind: Kind,
    limit: f64,
    evaluations: usize,
}

impl LineFunction for Counted {
    fn value(&mut self, t: f64) -> f64 {
        assert!(t > 0.0 && t <= self.limit, "a trial at {t}, beyond the limit {}", self.limit);
        self.evaluations += 1;
        self.kind.value(t)
    }

    fn slope(&mut self, t: f64) -> f64 {
        self.kind.slope(t)
    }
}

fn kind() -> impl Strategy<Value = Kind> {
    let place = (-3.0..3.0f64).prop_map(|e| 10f64.powf(e));
    prop_oneof![
        (0.0..10.0f64, 0.01..10.0f64, place.clone()).prop_map(|(a, b, c)| Kind::Quartic { a, b, c }),
        (0.1..20.0f64, place.clone()).prop_map(|(kc, c)| Kind::Cosh { k: kc / c, c }),
        (1.1..50.0f64, place.clone()).prop_map(|(force, c)| Kind::Barrier { force: force / c, c }),
        (0.0..2.0f64, place.clone()).prop_map(|(w, c)| Kind::Wells { c, w: w * c * c }),
        (-17.0..-6.0f64, place).prop_map(|(e, c)| Kind::Flat { amplitude: 10f64.powf(e), c }),
    ]
}

/// A function, its start, and a limit that may cut the minimum off.
fn problem() -> impl Strategy<Value = (Kind, LineStart)> {
    (kind(), -3.0..3.0f64, prop_oneof![Just(f64::INFINITY), (-3.0..3.0f64).prop_map(|e| 10f64.powf(e))]).prop_map(
        |(kind, first, limit)| {
            let (value, slope) = (kind.value(0.0), kind.slope(0.0));
            (kind, LineStart { value, slope, first: 10f64.powf(first), limit })
        },
    )
}

/// Armijo's condition, or what stands for it where energies differ by rounding errors alone.
fn sufficient(start: &LineStart, found: &Found, constant: f64) -> bool {
    found.value <= start.value + constant * found.t * start.slope
        || ((found.value - start.value).abs() <= ROUNDING * start.value.abs().max(found.value.abs())
            && found.slope <= -0.8 * start.slope)
}

fn run(kind: Kind, start: &LineStart, search: impl Fn(&mut Counted, &LineStart) -> Found) -> (Found, usize) {
    let mut f = Counted { kind, limit: start.limit, evaluations: 0 };
    let found = search(&mut f, start);
    if found.t > 0.0 {
        assert_eq!(found.value.to_bits(), kind.value(found.t).to_bits());
        assert_eq!(found.slope.to_bits(), kind.slope(found.t).to_bits());
    }
    (found, f.evaluations)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn armijo_keeps_its_promise((kind, start) in problem(), decrease in 1e-4..0.4f64) {
        let (found, evaluations) = run(kind, &start, |f, s| Armijo { decrease }.search(f, s));
        prop_assert_eq!(found.end, End::Satisfied);
        prop_assert!(found.t > 0.0 && sufficient(&start, &found, decrease), "{:?}", found);
        prop_assert!(evaluations <= 40, "{}", evaluations);
    }

    #[test]
    fn strong_wolfe_keeps_its_promise((kind, start) in problem(), curvature in 0.05..0.95f64) {
        let decrease = 1e-4;
        let (found, evaluations) = run(kind, &start, |f, s| StrongWolfe { decrease, curvature }.search(f, s));
        prop_assert!(found.t > 0.0 && sufficient(&start, &found, decrease), "{:?}", found);
        match found.end {
            End::Satisfied => prop_assert!(found.slope.abs() <= -curvature * start.slope, "{:?}", found),
            End::AtLimit => prop_assert!(found.t == start.limit && found.slope < curvature * start.slope, "{:?}", found),
            end => prop_assert!(false, "{end:?} {found:?}"),
        }
        prop_assert!(evaluations <= 50, "{}", evaluations);
    }

    #[test]
    fn approximate_wolfe_keeps_its_promise((kind, start) in problem()) {
        let s = ApproximateWolfe::default();
        let (found, evaluations) = run(kind, &start, |f, start| s.search(f, start));
        let decreases = found.value <= start.value + s.delta * found.t * start.slope;
        let gentle = found.slope <= (2.0 * s.delta - 1.0) * start.slope
            && found.value <= start.value + s.epsilon * start.value.abs();
        match found.end {
            End::Satisfied => {
                prop_assert!(found.slope >= s.sigma * start.slope && (decreases || gentle), "{:?}", found);
            }
            End::AtLimit => prop_assert!(found.t == start.limit && decreases && found.slope < 0.0, "{:?}", found),
            // Where noise hides every decrease up to the limit, and the function falls on there.
            End::Exhausted => {
                prop_assert!(matches!(kind, Kind::Flat { .. }) && start.limit < f64::INFINITY, "{:?}", found);
            }
            End::NoDescent => prop_assert!(false, "{:?}", found),
        }
        prop_assert!(found.t > 0.0 || found.end == End::Exhausted);
        prop_assert!(evaluations <= 60, "{}", evaluations);
    }

    #[test]
    fn an_exact_step_ends_at_the_minimum_of_a_parabola(slope in -1e3..-1e-3f64, curvature in 1e-3..1e3f64) {
        let t = exact_step(slope, curvature).unwrap();
        prop_assert!((slope + t * curvature).abs() <= 1e-12 * -slope);
    }
}

#[test]
fn a_good_first_step_costs_one_evaluation() {
    let kind = Kind::Quartic { a: 2.0, b: 0.0, c: 3.0 };
    let start = LineStart { value: kind.value(0.0), slope: kind.slope(0.0), first: 3.0, limit: f64::INFINITY };
    for search in searches() {
        let (found, evaluations) = run(kind, &start, search);
        assert_eq!((found.t, found.end, evaluations), (3.0, End::Satisfied, 1));
    }
}

#[test]
fn a_parabola_is_solved_by_one_interpolation() {
    let kind = Kind::Quartic { a: 2.0, b: 0.0, c: 3.0 };
    let start = LineStart { value: kind.value(0.0), slope: kind.slope(0.0), first: 7.0, limit: f64::INFINITY };
    let (found, evaluations) = run(kind, &start, |f, s| StrongWolfe { decrease: 1e-4, curvature: 1e-9 }.search(f, s));
    assert!((found.t - 3.0).abs() < 1e-9 && evaluations == 2, "{found:?} {evaluations}");
    let exact = ApproximateWolfe { sigma: 0.1 + 1e-9, ..ApproximateWolfe::default() };
    let (found, evaluations) = run(kind, &start, |f, s| exact.search(f, s));
    assert!((found.t - 3.0).abs() < 1e-9 && evaluations == 2, "{found:?} {evaluations}");
}

type Search = fn(&mut Counted, &LineStart) -> Found;

fn searches() -> [Search; 3] {
    [
        |f, s| Armijo::default().search(f, s),
        |f, s| StrongWolfe::tight().search(f, s),
        |f, s| ApproximateWolfe::default().search(f, s),
    ]
}

#[test]
fn nothing_to_descend_is_said() {
    let good = LineStart { value: 1.0, slope: -1.0, first: 1.0, limit: 2.0 };
    let bad = [
        LineStart { slope: 0.0, ..good },
        LineStart { slope: 1.0, ..good },
        LineStart { slope: f64::NAN, ..good },
        LineStart { value: f64::INFINITY, ..good },
        LineStart { value: f64::NAN, ..good },
        LineStart { first: 0.0, ..good },
        LineStart { first: f64::INFINITY, ..good },
        LineStart { limit: 0.0, ..good },
        LineStart { limit: f64::NAN, ..good },
    ];
    for start in bad {
        for search in searches() {
            let kind = Kind::Quartic { a: 1.0, b: 0.0, c: 1.0 };
            let mut f = Counted { kind, limit: 2.0, evaluations: 0 };
            let found = search(&mut f, &start);
            assert_eq!((found.t, found.end, f.evaluations), (0.0, End::NoDescent, 0), "{start:?}");
        }
    }
}

/// Says that it falls, and rises.
struct Liar;

impl LineFunction for Liar {
    fn value(&mut self, t: f64) -> f64 {
        1.0 + t
    }

    fn slope(&mut self, _: f64) -> f64 {
        1.0
    }
}

/// Falls for ever.
struct Endless;

impl LineFunction for Endless {
    fn value(&mut self, t: f64) -> f64 {
        -t
    }

    fn slope(&mut self, _: f64) -> f64 {
        -1.0
    }
}

/// Is nowhere but at 0.
struct Nowhere;

impl LineFunction for Nowhere {
    fn value(&mut self, _: f64) -> f64 {
        f64::NAN
    }

    fn slope(&mut self, _: f64) -> f64 {
        0.0
    }
}

#[test]
fn functions_without_a_minimum_end_the_search() {
    let start = LineStart { value: 1.0, slope: -1.0, first: 1.0, limit: f64::INFINITY };
    for hopeless in [
        Armijo::default().search(&mut Nowhere, &start),
        StrongWolfe::tight().search(&mut Nowhere, &start),
        ApproximateWolfe::default().search(&mut Nowhere, &start),
        Armijo::default().search(&mut Liar, &start),
    ] {
        assert_eq!((hopeless.t, hopeless.end), (0.0, End::Exhausted));
    }
    let endless = LineStart { value: 0.0, ..start };
    for found in [
        StrongWolfe::tight().search(&mut Endless, &endless),
        ApproximateWolfe::default().search(&mut Endless, &endless),
    ] {
        assert!(found.t > 1e30 && found.end == End::Exhausted, "{found:?}");
    }
    let bounded = LineStart { limit: 5.0, ..endless };
    for found in [
        StrongWolfe::tight().search(&mut Endless, &bounded),
        ApproximateWolfe::default().search(&mut Endless, &bounded),
    ] {
        assert_eq!((found.t, found.end), (5.0, End::AtLimit));
    }
}
