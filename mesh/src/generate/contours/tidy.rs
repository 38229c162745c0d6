//! Repair of one contour: duplicate clicks, points out of order.

use super::polygon::{first_conflict, perimeter};
use crate::geometry::distance2;

/// The longest run of points that is turned round: a few clicks out of order, not a figure of eight.
const LONGEST_RUN: usize = 3;
/// No more slips than this are mended in one contour.
const MOST_RUNS: usize = 16;

/// Removes each point within `tolerance` of the one before, or of the one before that (out and straight back, where both
/// points of the detour go), and returns how many went. The first point repeated as the last goes uncounted.
pub(super) fn remove_duplicates(polygon: &mut Vec<[f64; 2]>, tolerance: f64) -> usize {
    let same = |p: &[f64; 2], q: &[f64; 2]| distance2(p, q) <= tolerance * tolerance;
    if polygon.len() > 1 && same(&polygon[0], &polygon[polygon.len() - 1]) {
        polygon.pop();
    }
    let before = polygon.len();
    let mut kept: Vec<[f64; 2]> = Vec::with_capacity(before);
    for p in polygon.iter() {
        match kept.as_slice() {
            [.., last] if same(last, p) => {}
            [.., back, _] if same(back, p) => drop(kept.pop()),
            _ => kept.push(*p),
        }
    }
    while kept.len() > 1 && same(&kept[0], &kept[kept.len() - 1]) {
        kept.pop();
    }
    *polygon = kept;
    before - polygon.len()
}

/// Turns short runs of points round until no edges cross, and returns how many it turned; or the first two edges that cross
/// where that does not help or there is no end of it. Each turn shortens the contour.
pub(super) fn put_in_order(polygon: &mut [[f64; 2]]) -> Result<usize, [usize; 2]> {
    let mut turned = 0;
    while let Some((i, j)) = first_conflict(polygon, None) {
        let before = perimeter(polygon);
        if turned == MOST_RUNS || !turn_run(polygon, i, j) || perimeter(polygon) >= before {
            return Err([i, j]);
        }
        turned += 1;
    }
    Ok(turned)
}

/// Reverses the shorter run of points between edges `i < j`, if it is short.
fn turn_run(polygon: &mut [[f64; 2]], i: usize, j: usize) -> bool {
    let n = polygon.len();
    let (start, len) = if 2 * (j - i) <= n { (i + 1, j - i) } else { (j + 1, n - (j - i)) };
    // Edges that follow each other cross only by running back: the point between them and the next have changed places.
    let len = len.max(2);
    if len > LONGEST_RUN || len >= n {
        return false;
    }
    for k in 0..len / 2 {
        polygon.swap((start + k) % n, (start + len - 1 - k) % n);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(n: u32) -> Vec<[f64; 2]> {
        let angle = |i: u32| f64::from(i) / f64::from(n) * std::f64::consts::TAU;
        (0..n).map(|i| [angle(i).cos(), angle(i).sin()]).collect()
    }

    #[test]
    fn repeated_points_and_detours_go() {
        let mut polygon = circle(12);
        polygon.insert(4, polygon[3]);
        polygon.insert(4, polygon[3]);
        polygon.insert(9, [5.0, 5.0]);
        polygon.insert(10, polygon[8]);
        polygon.push(polygon[0]);
        assert_eq!(remove_duplicates(&mut polygon, 1e-9), 4);
        assert_eq!(polygon, circle(12));
    }

    #[test]
    fn neighbours_that_changed_places_change_back() {
        for (i, j) in [(4, 5), (0, 11), (2, 4), (10, 0)] {
            let mut polygon = circle(12);
            polygon.swap(i, j);
            assert!(put_in_order(&mut polygon).unwrap() >= 1, "{i} and {j}");
            assert!((perimeter(&polygon) - perimeter(&circle(12))).abs() < 1e-12, "{i} and {j}");
        }
        // On a straight stretch the edges run back instead of crossing.
        let mut straight = vec![[0.0, 0.0], [1.0, 0.0], [3.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]];
        assert_eq!(put_in_order(&mut straight), Ok(1));
        assert_eq!(straight[2..4], [[2.0, 0.0], [3.0, 0.0]]);
    }

    #[test]
    fn a_figure_of_eight_stays() {
        let eight: Vec<[f64; 2]> = (0..40)
            .map(|i| (f64::from(i) + 0.5) / 40.0 * std::f64::consts::TAU)
            .map(|t| [t.sin(), (2.0 * t).sin()])
            .collect();
        let mut polygon = eight.clone();
        assert!(put_in_order(&mut polygon).is_err());
        assert_eq!(put_in_order(&mut circle(12)), Ok(0));
    }
}
