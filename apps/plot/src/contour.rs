//! Where a piecewise linear field is at least a level: the outlines of these regions over a triangle mesh.
//!
//! Painting the regions of growing levels over one another fills a mesh with colour bands. No edge between triangles is
//! ever drawn, so no hairlines show between them, and the size of the picture grows with the length of the isolines, not
//! with the number of triangles.
//!
//! ```text
//!       2        v(2) >= L > v(0), v(1)
//!      / \
//!     b---a      The region above the segment a-b belongs to level L. Its outline is the isoline from b to a (region
//!    /     \     on its left), continued through the neighbours, and the parts of mesh edges without a neighbour on
//!   0-------1    the other side where the field is at least L.
//! ```

use crate::edges::net_edges;

/// A corner of an outline: the vertex `i` as `(i, i)`, or the crossing of the isoline with the edge `(i, j)`, `i < j`.
/// Neighbouring triangles name a crossing alike, so that outlines close exactly.
type Corner = (u32, u32);

/// For each level, the closed outlines of the part of the mesh where `values >= level`, counter-clockwise.
///
/// `triangles` index `points` and `values`, and are counter-clockwise; all numbers are finite. `levels` ascend.
pub(crate) fn regions(
    points: &[[f64; 2]],
    triangles: &[[u32; 3]],
    values: &[f64],
    levels: &[f64],
) -> Vec<Vec<Vec<[f64; 2]>>> {
    let mut segments: Vec<Vec<(Corner, Corner)>> = vec![Vec::new(); levels.len()];
    for triangle in triangles {
        let v = triangle.map(|i| values[i as usize]);
        let (low, high) = (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]));
        // The isoline of a level L crosses if low < L <= high.
        let first = levels.partition_point(|&level| level <= low);
        let last = levels.partition_point(|&level| level <= high);
        for k in first..last {
            segments[k].push(isoline(*triangle, v, levels[k]));
        }
    }
    for (i, j, count) in net_edges(triangles) {
        let (a, b) = (values[i as usize], values[j as usize]);
        let reached = levels.partition_point(|&level| level <= a.max(b));
        for k in 0..reached {
            let level = levels[k];
            let crossing = (i.min(j), i.max(j));
            let start = if a >= level { (i, i) } else { crossing };
            let end = if b >= level { (j, j) } else { crossing };
            segments[k].extend(std::iter::repeat_n((start, end), count));
        }
    }
    let position = |corner: Corner, level: f64| position(points, values, corner, level);
    let outlines = segments.into_iter().zip(levels);
    outlines
        .map(|(segments, &level)| {
            chain(segments).into_iter().map(|ring| ring.into_iter().map(|c| position(c, level)).collect()).collect()
        })
        .collect()
}

/// The isoline through a counter-clockwise triangle, with the region `>= level` on its left.
fn isoline(triangle: [u32; 3], v: [f64; 3], level: f64) -> (Corner, Corner) {
    let crossing = |a: usize, b: usize| {
        let (i, j) = (triangle[a], triangle[b]);
        (i.min(j), i.max(j))
    };
    let inside = v.map(|x| x >= level);
    // The corner that is alone on its side.
    let alone = (0..3).find(|&k| inside[k] != inside[(k + 1) % 3] && inside[k] != inside[(k + 2) % 3]).unwrap_or(0);
    let (to_next, to_previous) = (crossing(alone, (alone + 1) % 3), crossing(alone, (alone + 2) % 3));
    if inside[alone] { (to_next, to_previous) } else { (to_previous, to_next) }
}

fn position(points: &[[f64; 2]], values: &[f64], (i, j): Corner, level: f64) -> [f64; 2] {
    let (p, q) = (points[i as usize], points[j as usize]);
    let (a, b) = (values[i as usize], values[j as usize]);
    let t = if i == j || a == b { 0.0 } else { ((level - a) / (b - a)).clamp(0.0, 1.0) };
    [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]
}

/// Joins directed segments end to start into rings. As many segments leave a corner as arrive there, so that every walk
/// ends where it began.
fn chain(mut segments: Vec<(Corner, Corner)>) -> Vec<Vec<Corner>> {
    segments.sort_unstable();
    // walked[s]: how many segments have been walked of the corner whose first segment is s.
    let mut walked = vec![0; segments.len()];
    let first_of = |corner: Corner| segments.partition_point(|segment| segment.0 < corner);
    let mut rings = Vec::new();
    let mut s = 0;
    while s < segments.len() {
        let start = segments[s].0;
        let mut ring = Vec::new();
        let mut corner = start;
        loop {
            let first = first_of(corner);
            let Some(next) = first.checked_add(*walked.get(first).unwrap_or(&0)) else {
                break;
            };
            if next >= segments.len() || segments[next].0 != corner {
                break;
            }
            walked[first] += 1;
            ring.push(corner);
            corner = segments[next].1;
            if corner == start {
                break;
            }
        }
        if ring.len() > 2 {
            rings.push(ring);
        }
        let first = first_of(start);
        let all = segments[first..].partition_point(|segment| segment.0 == start);
        s = if walked[first] >= all { first + all } else { first };
    }
    rings
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Signed area of closed rings.
    fn area(rings: &[Vec<[f64; 2]>]) -> f64 {
        let cross = |p: [f64; 2], q: [f64; 2]| 0.5 * (p[0] * q[1] - q[0] * p[1]);
        rings.iter().map(|ring| (0..ring.len()).map(|i| cross(ring[i], ring[(i + 1) % ring.len()])).sum::<f64>()).sum()
    }

    /// An n by n grid over the unit square, each cell cut in two.
    fn grid(n: u32) -> (Vec<[f64; 2]>, Vec<[u32; 3]>) {
        let h = 1.0 / f64::from(n);
        let points = (0..=n).flat_map(|j| (0..=n).map(move |i| [f64::from(i) * h, f64::from(j) * h])).collect();
        let triangles = (0..n)
            .flat_map(|j| (0..n).map(move |i| j * (n + 1) + i))
            .flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]])
            .collect();
        (points, triangles)
    }

    #[test]
    fn a_plane_field_is_cut_exactly() {
        let (points, triangles) = grid(7);
        let values: Vec<f64> = points.iter().map(|p| p[0]).collect();
        let found = regions(&points, &triangles, &values, &[-1.0, 0.0, 0.25, 0.5, 1.0, 2.0]);
        let areas: Vec<f64> = found.iter().map(|rings| area(rings)).collect();
        for (area, exact) in areas.iter().zip([1.0, 1.0, 0.75, 0.5, 0.0, 0.0]) {
            assert!((area - exact).abs() < 1e-14, "{areas:?}");
        }
        assert_eq!(found[3].len(), 1);
    }

    #[test]
    fn a_ring_has_a_hole() {
        let (points, triangles) = grid(40);
        let values: Vec<f64> = points.iter().map(|p| -(p[0] - 0.5).hypot(p[1] - 0.5)).collect();
        // A disc of radius 0.3; P1 interpolation is second order.
        let disc = area(&regions(&points, &triangles, &values, &[-0.3])[0]);
        assert!((disc - std::f64::consts::PI * 0.09).abs() < 1e-3, "{disc}");
        let outside: Vec<f64> = values.iter().map(|v| -v).collect();
        let rings = &regions(&points, &triangles, &outside, &[0.3])[0];
        assert_eq!(rings.len(), 2);
        assert!((area(rings) - (1.0 - disc)).abs() < 1e-12);
    }

    proptest! {
        /// Clipping every triangle on its own gives the same area, whatever the values (ties with levels included).
        #[test]
        fn outlines_enclose_the_sum_of_clipped_triangles(values in prop::collection::vec(0i8..6, 36)) {
            let (points, triangles) = grid(5);
            let values: Vec<f64> = values.into_iter().map(f64::from).collect();
            let levels = [0.0, 1.0, 2.5, 3.0, 5.0];
            let whole = regions(&points, &triangles, &values, &levels);
            for (k, rings) in whole.iter().enumerate() {
                let single: f64 = triangles.iter().map(|t| area(&regions(&points, &[*t], &values, &levels)[k])).sum();
                prop_assert!((area(rings) - single).abs() < 1e-13);
                let exact: f64 = triangles.iter().map(|t| part_above(t.map(|i| values[i as usize]), levels[k])).sum();
                prop_assert!((area(rings) - exact * 0.02).abs() < 1e-13, "{} {}", area(rings), exact * 0.02);
            }
        }
    }

    /// Share of a triangle where the linear field through three corner values is at least `level`.
    fn part_above(mut v: [f64; 3], level: f64) -> f64 {
        v.sort_by(f64::total_cmp);
        if level <= v[0] {
            1.0
        } else if level > v[2] {
            0.0
        } else if level > v[1] {
            (v[2] - level).powi(2) / ((v[2] - v[0]) * (v[2] - v[1]))
        } else {
            1.0 - (level - v[0]).powi(2) / ((v[2] - v[0]) * (v[1] - v[0]))
        }
    }
}
