//! In which order cells are painted: what is behind comes first.
//!
//! Of two cells with a common facet the one beyond the facet, as seen by the viewer, is behind. Cells are painted in an
//! order that respects all of these pairs, and where they leave a choice, the farthest first. That is exact for convex
//! meshes without cycles, whatever the sizes of the cells; sorting by depth alone is not. Where cells hide each other in
//! a circle the farthest of those left is painted, out of order.
//!
//! Source: Williams, *Visibility ordering meshed polyhedra*, ACM Trans. Graph. 11 (1992).

use std::cmp::Reverse;
use std::collections::BTreeSet;

/// The order of `depths.len()` cells by `pairs` (behind, in front) and by depths, which grow towards the viewer.
pub(super) fn back_to_front(depths: &[f64], pairs: &[(u32, u32)]) -> Vec<u32> {
    let n = depths.len();
    let mut sorted: Vec<(u32, u32)> = pairs.to_vec();
    sorted.sort_unstable();
    let mut start = vec![0_usize; n + 1];
    sorted.iter().for_each(|pair| start[pair.0 as usize + 1] += 1);
    (0..n).for_each(|i| start[i + 1] += start[i]);
    let mut waits = vec![0_u32; n];
    sorted.iter().for_each(|pair| waits[pair.1 as usize] += 1);

    // Ranks by depth, so that the sets below hold whole numbers.
    let mut by_depth: Vec<u32> = (0..n as u32).collect();
    by_depth.sort_by(|&i, &j| depths[i as usize].total_cmp(&depths[j as usize]));
    let mut rank = vec![0_u32; n];
    by_depth.iter().enumerate().for_each(|(r, &cell)| rank[cell as usize] = r as u32);

    let mut ready: std::collections::BinaryHeap<Reverse<u32>> =
        (0..n).filter(|&i| waits[i] == 0).map(|i| Reverse(rank[i])).collect();
    let mut left: BTreeSet<u32> = (0..n as u32).collect();
    let mut order = Vec::with_capacity(n);
    while let Some(r) = ready.pop().map(|Reverse(r)| r).or_else(|| left.first().copied()) {
        // In a circle a cell was painted before it was its turn, which then comes in vain.
        if !left.remove(&r) {
            continue;
        }
        let cell = by_depth[r as usize];
        order.push(cell);
        for &(_, front) in &sorted[start[cell as usize]..start[cell as usize + 1]] {
            waits[front as usize] = waits[front as usize].saturating_sub(1);
            if waits[front as usize] == 0 {
                ready.push(Reverse(rank[front as usize]));
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_come_before_depths() {
        assert_eq!(back_to_front(&[2.0, 1.0, 0.0], &[]), [2, 1, 0]);
        assert_eq!(back_to_front(&[0.0, 1.0, 2.0], &[(2, 0), (1, 0)]), [1, 2, 0]);
    }

    #[test]
    fn circles_are_broken_at_the_far_end() {
        assert_eq!(back_to_front(&[3.0, 1.0, 2.0], &[(0, 1), (1, 2), (2, 0)]), [1, 2, 0]);
    }
}
