//! Which contours of a slice are holes in which others.

use super::{
    organ::Part,
    polygon::{bounding_box, contains, distance2_to_segment, edges, signed_area},
};

/// The parts of a slice, in the order of their outer contours. The contours are simple and do not cross.
pub(super) fn parts(contours: Vec<Vec<[f64; 2]>>) -> Vec<Part> {
    let n = contours.len();
    let boxes: Vec<_> = contours.iter().map(bounding_box).collect();
    let within = |i: usize, j: usize| {
        let held = (0..2).all(|k| boxes[j][0][k] <= boxes[i][0][k] && boxes[i][1][k] <= boxes[j][1][k]);
        i != j && held && is_within(&contours[i], &contours[j])
    };
    let around: Vec<Vec<usize>> = (0..n).map(|i| (0..n).filter(|&j| within(i, j)).collect()).collect();
    // A hole belongs to the outer contour right around it: the one with the most contours around itself.
    let is_hole = |i: usize| around[i].len() % 2 == 1;
    let owner = |i: usize| around[i].iter().copied().max_by_key(|&j| (around[j].len(), j));
    let mut parts = Vec::new();
    for i in (0..n).filter(|&i| !is_hole(i)) {
        let holes = (0..n).filter(|&h| is_hole(h) && owner(h) == Some(i));
        parts.push(Part { outer: wound(&contours[i], 1.0), holes: holes.map(|h| wound(&contours[h], -1.0)).collect() });
    }
    parts
}

/// The contour, turned round if its area has not this sign.
fn wound(contour: &[[f64; 2]], sign: f64) -> Vec<[f64; 2]> {
    let mut contour = contour.to_vec();
    if signed_area(&contour) * sign < 0.0 {
        // The first point stays the first.
        contour[1..].reverse();
    }
    contour
}

/// Whether a contour is inside another that it does not cross, by its point farthest from the other, since they may touch.
fn is_within(inner: &[[f64; 2]], outer: &[[f64; 2]]) -> bool {
    let clearance =
        |p: &[f64; 2]| edges(outer).map(|(a, b)| distance2_to_segment(&a, &b, p)).fold(f64::INFINITY, f64::min);
    let farthest = inner.iter().max_by(|p, q| clearance(p).total_cmp(&clearance(q)));
    farthest.is_some_and(|p| contains(outer, p))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(half: f64, x: f64) -> Vec<[f64; 2]> {
        vec![[x - half, -half], [x + half, -half], [x + half, half], [x - half, half]]
    }

    #[test]
    fn holes_islands_and_neighbours() {
        let mut hole = square(3.0, 0.0);
        hole.reverse();
        let found = parts(vec![square(2.0, 0.0), hole, square(4.0, 0.0), square(1.0, 9.0), square(1.0, 0.0)]);
        // From within: 1 is a hole in 2, that an island in the hole 3 of 4; 9 stands beside.
        let areas: Vec<f64> = found.iter().map(Part::area).collect();
        assert_eq!(areas, [16.0 - 4.0, 64.0 - 36.0, 4.0]);
        assert!(found.iter().all(|p| signed_area(&p.outer) > 0.0 && p.holes.iter().all(|h| signed_area(h) < 0.0)));
        assert_eq!(found[0].outer[0], [-2.0, -2.0]);
    }

    #[test]
    fn contours_that_touch_at_a_corner() {
        let diamond = vec![[0.0, -2.0], [1.0, 0.0], [0.0, 2.0], [-1.0, 0.0]];
        let found = parts(vec![square(2.0, 0.0), diamond]);
        assert_eq!((found.len(), found[0].holes.len()), (1, 1));
        assert_eq!(found[0].area(), 16.0 - 4.0);
    }
}
