//! Edges of a triangle mesh: all of them as few long lines, and those on the boundary as rings.

/// Directed edges `(i, j, count)` that occur `count` times more often in the triangles than `(j, i)`: the boundary of
/// the mesh, with the mesh on its left. Ascending.
pub(crate) fn net_edges(triangles: &[[u32; 3]]) -> Vec<(u32, u32, usize)> {
    let directed = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let mut edges: Vec<((u32, u32), i32)> =
        directed.map(|(i, j)| if i < j { ((i, j), 1) } else { ((j, i), -1) }).filter(|((i, j), _)| i != j).collect();
    edges.sort_unstable();
    let mut net: Vec<(u32, u32, usize)> = edges
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|group| {
            let (i, j) = group[0].0;
            match group.iter().map(|edge| edge.1).sum::<i32>() {
                0 => None,
                n if n > 0 => Some((i, j, n as usize)),
                n => Some((j, i, n.unsigned_abs() as usize)),
            }
        })
        .collect();
    net.sort_unstable();
    net
}

/// The boundary of a triangle mesh as rings of points, such as the outline of the undeformed body for
/// [`MeshPicture::outline`](crate::MeshPicture::outline). Triangles that name a point that does not exist are left out.
///
/// Neighbouring triangles have the same orientation.
pub fn outline_of(points: &[[f64; 2]], triangles: &[[u32; 3]]) -> Vec<Vec<[f64; 2]>> {
    let valid: Vec<[u32; 3]> =
        triangles.iter().copied().filter(|t| t.iter().all(|&i| (i as usize) < points.len())).collect();
    let edges = net_edges(&valid).into_iter().flat_map(|(i, j, count)| std::iter::repeat_n((i, j), count)).collect();
    trails(edges).into_iter().map(|ring| ring.into_iter().map(|i| points[i as usize]).collect()).collect()
}

/// Every edge of the triangles once, joined into trails (lists of vertices) that are as long as a simple walk finds.
pub(crate) fn edge_trails(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut edges: Vec<(u32, u32)> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .map(|(i, j)| (i.min(j), i.max(j)))
        .filter(|(i, j)| i != j)
        .collect();
    edges.sort_unstable();
    edges.dedup();
    trails(edges)
}

/// Joins directed edges end to start into trails. Each edge is used once.
fn trails(mut edges: Vec<(u32, u32)>) -> Vec<Vec<u32>> {
    edges.sort_unstable();
    let mut used = vec![false; edges.len()];
    // skip[s]: edges s..skip[s] of one start are used already.
    let mut skip: Vec<usize> = (0..edges.len()).collect();
    let mut trails = Vec::new();
    for s in 0..edges.len() {
        if used[s] {
            continue;
        }
        let mut trail = vec![edges[s].0];
        let mut at = s;
        loop {
            used[at] = true;
            let corner = edges[at].1;
            trail.push(corner);
            let first = edges.partition_point(|edge| edge.0 < corner);
            let mut next = skip.get(first).copied().unwrap_or(edges.len());
            while next < edges.len() && used[next] && edges[next].0 == corner {
                next += 1;
            }
            if let Some(slot) = skip.get_mut(first) {
                *slot = next;
            }
            if next >= edges.len() || edges[next].0 != corner {
                break;
            }
            at = next;
        }
        trails.push(trail);
    }
    trails
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_outline_of_two_triangles_is_their_square() {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let rings = outline_of(&points, &[[0, 1, 2], [0, 2, 3], [0, 1, 9]]);
        assert_eq!(rings, [vec![points[0], points[1], points[2], points[3], points[0]]]);
    }

    proptest! {
        #[test]
        fn trails_hold_every_edge_once(triangles in prop::collection::vec(prop::array::uniform3(0u32..12), 0..40)) {
            let trails = edge_trails(&triangles);
            let mut walked: Vec<(u32, u32)> =
                trails.iter().flat_map(|t| t.windows(2).map(|w| (w[0].min(w[1]), w[0].max(w[1])))).collect();
            walked.sort_unstable();
            let mut edges: Vec<(u32, u32)> = triangles
                .iter()
                .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
                .map(|(i, j)| (i.min(j), i.max(j)))
                .filter(|(i, j)| i != j)
                .collect();
            edges.sort_unstable();
            edges.dedup();
            prop_assert_eq!(walked, edges);
        }
    }
}
