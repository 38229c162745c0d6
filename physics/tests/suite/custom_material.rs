//! The example of a law of one's own.

#[path = "../../examples/custom_material.rs"]
mod example;

/// A bar under tension and compression carries the stress of a point whose sides are free, and stiffens towards its limit.
#[test]
fn a_bar_of_gent_rubber() {
    for s in [0.8, 1.2, 1.5] {
        let (bar, point) = example::stresses(s).unwrap();
        assert!((bar - point).abs() <= 1e-7 * point.abs(), "stretch {s}: bar {bar} Pa, point {point} Pa");
        assert!((point > 0.0) == (s > 1.0));
    }
}
