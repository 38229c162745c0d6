//! Volumes of regions as their functions have them.

use stylet_mesh::generate::implicit::Strata;

/// Points along each axis of a solid's bounds.
const PER_AXIS: u32 = 64;

/// The volume, m³, of what belongs to a solid within a box, from midpoints of a grid in the solid's bounds: within some parts
/// in a thousand for bodies that fill their bounds.
pub(super) fn sampled(strata: &Strata, solid: usize, domain: [[f64; 3]; 2]) -> f64 {
    let [mut low, mut high] = domain;
    if let Some([from, to]) = strata.solids()[solid].bounds() {
        low = std::array::from_fn(|k| low[k].max(from[k]));
        high = std::array::from_fn(|k| high[k].min(to[k]));
    }
    if (0..3).any(|k| low[k] >= high[k]) {
        return 0.0;
    }
    let at = |k: usize, i: u32| low[k] + (high[k] - low[k]) * (f64::from(i) + 0.5) / f64::from(PER_AXIS);
    let mut inside = 0u32;
    for i in 0..PER_AXIS {
        for j in 0..PER_AXIS {
            for l in 0..PER_AXIS {
                inside += u32::from(strata.region(&[at(0, i), at(1, j), at(2, l)]) == solid);
            }
        }
    }
    let whole: f64 = (0..3).map(|k| high[k] - low[k]).product();
    whole * f64::from(inside) / f64::from(PER_AXIS.pow(3))
}
