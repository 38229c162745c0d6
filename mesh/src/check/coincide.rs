//! Vertices in one place.
//!
//! Points are put into the cells of `2^D` grids of the given distance, shifted against each other by half of it; those
//! that share a cell of some grid coincide. That takes `n log n` however crowded the points are: points within half the
//! distance along every axis always share a cell, points farther apart than it along some axis never do.

use super::{Finding, groups::Groups};

/// Finds the sets of more than one finite point that coincide.
pub(super) fn find<const D: usize>(points: &[[f64; D]], distance: f64, findings: &mut Vec<Finding>) {
    let several = groups(points, distance).into_iter().filter(|vertices| vertices.len() > 1);
    findings.extend(several.map(|vertices| Finding::Coincident { vertices }));
}

/// All finite points, by sets that coincide; by the first of each set.
pub(super) fn groups<const D: usize>(points: &[[f64; D]], distance: f64) -> Vec<Vec<u32>> {
    let finite = || (0..points.len() as u32).filter(|&v| points[v as usize].iter().all(|x| x.is_finite()));
    let mut groups = Groups::new(points.len());
    let mut merge = |key: &dyn Fn(f64, usize) -> f64| {
        // Minus zero is zero.
        let at = |v: u32| std::array::from_fn::<f64, D, _>(|k| key(points[v as usize][k], k) + 0.0);
        let mut keys: Vec<([f64; D], u32)> = finite().map(|v| (at(v), v)).collect();
        let order = |a: &[f64; D], b: &[f64; D]| {
            let axes = a.iter().zip(b).map(|(x, y)| x.total_cmp(y));
            axes.fold(std::cmp::Ordering::Equal, |order, axis| order.then(axis))
        };
        keys.sort_unstable_by(|a, b| order(&a.0, &b.0).then(a.1.cmp(&b.1)));
        for pair in keys.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            groups.join(pair[0].1, pair[1].1);
        }
    };
    merge(&|x, _| x);
    if distance > 0.0 && distance.is_finite() {
        for shift in 0_u32..1 << D {
            merge(&|x, axis| (x / distance + 0.5 * f64::from(shift >> axis & 1)).floor());
        }
    }
    groups.among(finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_decides() {
        let h = 1e-6;
        for origin in [0.0, 1.0, -7.3] {
            for offset in [0.0, 0.1, 0.25, 0.5, 0.77] {
                let p = [origin + offset * h, origin - offset * h];
                let near = [p[0] + 0.49 * h, p[1] - 0.49 * h];
                let far = [p[0] + 1.01 * h, p[1]];
                assert_eq!(groups(&[p, near], h), [[0, 1]], "{origin} {offset}");
                assert_eq!(groups(&[p, far], h), [[0], [1]], "{origin} {offset}");
                assert_eq!(groups(&[p, near], 0.0), [[0], [1]], "{origin} {offset}");
            }
        }
    }

    #[test]
    fn zeros_of_both_signs_are_one_place_and_nan_is_none() {
        assert_eq!(groups(&[[0.0, 1.0], [-0.0, 1.0], [f64::NAN, 1.0], [f64::NAN, 1.0]], 0.0), [[0, 1]]);
        assert_eq!(groups(&[[1e150], [1e150], [-1e150]], 1e-300), [vec![0, 1], vec![2]]);
    }
}
