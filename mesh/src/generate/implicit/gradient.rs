//! The slope of a signed distance.

use super::Implicit;

/// The gradient of a signed distance at `p` by central differences over `step` to either side, m: of unit length for a
/// true distance away from the points that have several nearest points on the surface.
pub fn gradient(solid: &(impl Implicit + ?Sized), p: &[f64; 3], step: f64) -> [f64; 3] {
    std::array::from_fn(|i| {
        let at = |x: f64| {
            let mut q = *p;
            q[i] = x;
            solid.distance(&q)
        };
        let (high, low) = (p[i] + step, p[i] - step);
        // Over the difference as rounded, not over twice the step.
        (at(high) - at(low)) / (high - low)
    })
}
