//! Removal of points that stand closer together than a threshold.

use crate::geometry::distance2;
use std::collections::BTreeSet;

/// Removes points until none is closer to the next than `threshold`, or three are left, and returns how many went.
///
/// The closest pair loses the point whose other neighbour is nearer, so that the smaller gap opens; of equal pairs the first.
///
/// Source: Goksel, *Ultrasound image and 3D finite element based tissue deformation simulator for prostate brachytherapy*,
/// MASc thesis, University of British Columbia (2004), section 3.1.3.
pub(super) fn cull(polygon: &mut Vec<[f64; 2]>, threshold: f64) -> usize {
    let n = polygon.len();
    if threshold <= 0.0 || n <= 3 {
        return 0;
    }
    let mut ring = Ring::new(polygon);
    let mut left = n;
    while left > 3 {
        let Some(&(gap, i)) = ring.gaps.first() else { break };
        // Bit patterns of non-negative numbers are in the numbers' order.
        if f64::from_bits(gap) >= threshold * threshold {
            break;
        }
        let next = ring.next[i];
        ring.remove(if ring.gap(ring.previous[i]) < ring.gap(next) { i } else { next });
        left -= 1;
    }
    let mut kept = ring.kept.iter();
    polygon.retain(|_| *kept.next().expect("one for each point"));
    n - left
}

/// The points still there, as a closed list, and their squared gaps in order.
struct Ring<'a> {
    points: &'a [[f64; 2]],
    kept: Vec<bool>,
    previous: Vec<usize>,
    next: Vec<usize>,
    gaps: BTreeSet<(u64, usize)>,
}

impl<'a> Ring<'a> {
    fn new(points: &'a [[f64; 2]]) -> Self {
        let n = points.len();
        let mut ring = Self {
            points,
            kept: vec![true; n],
            previous: (0..n).map(|i| (i + n - 1) % n).collect(),
            next: (0..n).map(|i| (i + 1) % n).collect(),
            gaps: BTreeSet::new(),
        };
        ring.gaps = (0..n).map(|i| ring.key(i)).collect();
        ring
    }

    /// The squared distance from point `i` to the next.
    fn gap(&self, i: usize) -> f64 {
        distance2(&self.points[i], &self.points[self.next[i]])
    }

    fn key(&self, i: usize) -> (u64, usize) {
        (self.gap(i).to_bits(), i)
    }

    fn remove(&mut self, i: usize) {
        let (previous, next) = (self.previous[i], self.next[i]);
        self.gaps.remove(&self.key(i));
        self.gaps.remove(&self.key(previous));
        self.next[previous] = next;
        self.previous[next] = previous;
        self.gaps.insert(self.key(previous));
        self.kept[i] = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::contours::polygon::edges;

    /// Figure 3.1 of the thesis: of the closest pair, the point with the nearer other neighbour goes.
    #[test]
    fn of_the_closest_pair_the_one_that_leaves_less_gap_goes() {
        let mut polygon = vec![[0.0, 0.0], [2.0, 0.0], [3.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]];
        assert_eq!(cull(&mut polygon, 1.5), 1);
        assert_eq!(polygon, [[0.0, 0.0], [3.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]]);
        let mut mirrored = vec![[0.0, 0.0], [3.0, 0.0], [4.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]];
        assert_eq!(cull(&mut mirrored, 1.5), 1);
        assert_eq!(mirrored, [[0.0, 0.0], [3.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]]);
    }

    #[test]
    fn no_gap_is_left_below_the_threshold_and_three_points_stay() {
        let circle = |n: u32| -> Vec<[f64; 2]> {
            (0..n)
                .map(|i| (f64::from(i) / f64::from(n) * std::f64::consts::TAU).sin_cos())
                .map(|(y, x)| [x, y])
                .collect()
        };
        let mut polygon = circle(100);
        let removed = cull(&mut polygon, 0.2);
        assert_eq!(removed + polygon.len(), 100);
        assert!(edges(&polygon).all(|(a, b)| distance2(&a, &b) >= 0.04) && polygon.len() > 12);
        let mut polygon = circle(100);
        assert_eq!(cull(&mut polygon, 100.0), 97);
        let mut polygon = circle(100);
        assert_eq!(cull(&mut polygon, 0.0), 0);
    }
}
