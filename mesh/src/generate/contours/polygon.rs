//! Closed polygons in the plane, given by their points in order.

use crate::geometry::{distance2, subtract};

/// Crossings no deeper than this, relative to the longer of the two edges, are touches: what rounding leaves of them.
const TOUCH: f64 = 1e-9;

/// `a x b`.
#[inline]
pub(super) fn cross(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The edges, from each point to the next and from the last to the first.
pub(super) fn edges(polygon: &[[f64; 2]]) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
    (0..polygon.len()).map(|i| (polygon[i], polygon[(i + 1) % polygon.len()]))
}

/// The length all around.
pub(super) fn perimeter(polygon: &[[f64; 2]]) -> f64 {
    edges(polygon).map(|(a, b)| distance2(&a, &b).sqrt()).sum()
}

/// The area, positive where the points run counterclockwise.
pub(super) fn signed_area(polygon: &[[f64; 2]]) -> f64 {
    let Some(origin) = polygon.first() else { return 0.0 };
    // Relative to a point of its own, so that a small polygon far from the origin keeps its digits.
    edges(polygon).map(|(a, b)| cross(&subtract(&a, origin), &subtract(&b, origin))).sum::<f64>() / 2.0
}

/// The integral of position over the polygon, with the sign of its area.
pub(super) fn first_moment(polygon: &[[f64; 2]]) -> [f64; 2] {
    let Some(origin) = polygon.first() else { return [0.0; 2] };
    let area = signed_area(polygon);
    let mut moment = origin.map(|x| x * area);
    for (a, b) in edges(polygon) {
        let (a, b) = (subtract(&a, origin), subtract(&b, origin));
        for k in 0..2 {
            moment[k] += (a[k] + b[k]) * cross(&a, &b) / 6.0;
        }
    }
    moment
}

/// Whether `p` is inside: a ray from it crosses the edges an odd number of times.
pub(super) fn contains(polygon: &[[f64; 2]], p: &[f64; 2]) -> bool {
    let crossed = |(a, b): &([f64; 2], [f64; 2])| {
        (a[1] > p[1]) != (b[1] > p[1]) && (cross(&subtract(b, a), &subtract(p, a)) > 0.0) == (b[1] > a[1])
    };
    edges(polygon).filter(crossed).count() % 2 == 1
}

/// Lowest and highest coordinates.
pub(super) fn bounding_box<'a>(points: impl IntoIterator<Item = &'a [f64; 2]>) -> [[f64; 2]; 2] {
    let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for p in points {
        for k in 0..2 {
            bounds[0][k] = bounds[0][k].min(p[k]);
            bounds[1][k] = bounds[1][k].max(p[k]);
        }
    }
    bounds
}

/// The squared distance from `p` to the segment from `a` to `b`.
pub(super) fn distance2_to_segment(a: &[f64; 2], b: &[f64; 2], p: &[f64; 2]) -> f64 {
    let (along, w) = (subtract(b, a), subtract(p, a));
    let length2 = distance2(a, b);
    let t = if length2 > 0.0 { ((along[0] * w[0] + along[1] * w[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    distance2(&w, &along.map(|x| t * x))
}

/// Whether two segments cross, or run along each other; a touch is neither.
fn conflict((a, b): ([f64; 2], [f64; 2]), (c, d): ([f64; 2], [f64; 2])) -> bool {
    let (ab, cd) = (subtract(&b, &a), subtract(&d, &c));
    let longest2 = distance2(&a, &b).max(distance2(&c, &d));
    let tolerance = TOUCH * longest2;
    let sides = [
        cross(&ab, &subtract(&c, &a)),
        cross(&ab, &subtract(&d, &a)),
        cross(&cd, &subtract(&a, &c)),
        cross(&cd, &subtract(&b, &c)),
    ];
    if sides.iter().all(|s| s.abs() <= tolerance) {
        // On one line: the overlap of their projections on it.
        let along = |p: &[f64; 2]| {
            let w = subtract(p, &a);
            w[0] * ab[0] + w[1] * ab[1]
        };
        let (c, d) = (along(&c), along(&d));
        return c.max(d).min(along(&b)) - c.min(d).max(0.0) > tolerance;
    }
    let apart = |s: f64, t: f64| (s > tolerance && t < -tolerance) || (s < -tolerance && t > tolerance);
    apart(sides[0], sides[1]) && apart(sides[2], sides[3])
}

/// The first conflict between two edges, in order of the edges' numbers: of one polygon with itself (edges that share a
/// point may fold back on each other, which is one), or of two.
pub(super) fn first_conflict(one: &[[f64; 2]], other: Option<&[[f64; 2]]>) -> Option<(usize, usize)> {
    let second = other.unwrap_or(one);
    // Sweep along x: only edges whose ranges overlap can meet.
    let ranges = |polygon: &[[f64; 2]]| {
        let range = |(i, (a, b)): (usize, ([f64; 2], [f64; 2]))| (a[0].min(b[0]), a[0].max(b[0]), i);
        let mut ranges: Vec<(f64, f64, usize)> = edges(polygon).enumerate().map(range).collect();
        ranges.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.2.cmp(&q.2)));
        ranges
    };
    let (left, right) = (ranges(one), ranges(second));
    let edge = |polygon: &[[f64; 2]], i: usize| (polygon[i], polygon[(i + 1) % polygon.len()]);
    let mut first: Option<(usize, usize)> = None;
    let mut start = 0;
    let widest = right.iter().map(|r| r.1 - r.0).fold(0.0, f64::max);
    for (low, high, i) in left {
        while start < right.len() && right[start].0 < low - widest {
            start += 1;
        }
        for &(from, to, j) in right[start..].iter().take_while(|r| r.0 <= high) {
            if to < from.max(low) || (other.is_none() && i >= j) {
                continue;
            }
            if first.is_none_or(|f| (i, j) < f) && conflict(edge(one, i), edge(second, j)) {
                first = Some((i, j));
            }
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 2]; 4] = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];

    #[test]
    fn areas_and_moments_of_a_square() {
        assert_eq!(signed_area(&SQUARE), 4.0);
        let near = |found: [f64; 2], exact: f64| found.iter().all(|m| (m - exact).abs() < 1e-14);
        assert!(near(first_moment(&SQUARE), 8.0));
        let mut reversed = SQUARE;
        reversed.reverse();
        assert_eq!(signed_area(&reversed), -4.0);
        assert!(near(first_moment(&reversed), -8.0));
    }

    #[test]
    fn points_in_a_square() {
        assert!(contains(&SQUARE, &[2.0, 1.5]));
        assert!(!contains(&SQUARE, &[0.5, 2.0]) && !contains(&SQUARE, &[3.5, 2.0]) && !contains(&SQUARE, &[2.0, 3.5]));
    }

    #[test]
    fn crossing_and_running_along_are_conflicts_and_touching_is_not() {
        assert_eq!(first_conflict(&SQUARE, None), None);
        let bow_tie = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(first_conflict(&bow_tie, None), Some((0, 2)));
        let spike = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [2.0, 1.0], [0.0, 1.0]];
        assert_eq!(first_conflict(&spike, None), Some((1, 2)));
        let beside = SQUARE.map(|p| [p[0] + 2.0, p[1]]);
        assert_eq!(first_conflict(&SQUARE, Some(&beside)), Some((1, 3)), "a common edge");
        let corner = SQUARE.map(|p| [p[0] + 2.0, p[1] + 2.0]);
        assert_eq!(first_conflict(&SQUARE, Some(&corner)), None, "a common corner");
        let crossing = SQUARE.map(|p| [p[0] + 1.0, p[1] + 1.0]);
        assert_eq!(first_conflict(&SQUARE, Some(&crossing)), Some((1, 0)));
    }
}
