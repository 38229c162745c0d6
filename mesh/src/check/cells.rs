//! What can be said of vertices and cells one by one, and cells that repeat others.

use super::Finding;
use crate::{
    geometry,
    start::{FLAT, coordinate_limit},
};

/// Which points have usable coordinates.
pub(super) fn check_coordinates<const D: usize>(points: &[[f64; D]], findings: &mut Vec<Finding>) -> Vec<bool> {
    let limit = coordinate_limit::<D>();
    let mut finite = vec![true; points.len()];
    for (vertex, point) in points.iter().enumerate() {
        for (axis, &value) in point.iter().enumerate() {
            if value.is_nan() || value.abs() > limit {
                findings.push(Finding::Coordinate { vertex: vertex as u32, axis, value });
                finite[vertex] = false;
            }
        }
    }
    finite
}

/// Which cells name vertices that exist, each once.
pub(super) fn check_indices<const N: usize>(
    n_vertices: usize,
    cells: &[[u32; N]],
    findings: &mut Vec<Finding>,
) -> Vec<bool> {
    let mut repeated = Vec::new();
    let mut whole = vec![true; cells.len()];
    for (cell, v) in cells.iter().enumerate() {
        for (i, &vertex) in v.iter().enumerate() {
            let id = cell as u32;
            let again = v[..i].contains(&vertex);
            let beyond = vertex as usize >= n_vertices;
            whole[cell] &= !again && !beyond;
            if beyond && !again {
                findings.push(Finding::Index { cell: id, vertex, n_vertices });
            } else if again && v[..i].iter().filter(|&&w| w == vertex).count() == 1 {
                repeated.push(Finding::RepeatedVertex { cell: id, vertex });
            }
        }
    }
    findings.append(&mut repeated);
    whole
}

/// Which of the whole cells with finite coordinates have a volume.
pub(super) fn check_flat<const D: usize, const N: usize>(
    points: &[[f64; D]],
    cells: &[[u32; N]],
    finite: &[bool],
    whole: &[bool],
    findings: &mut Vec<Finding>,
) -> Vec<bool> {
    let mut solid = vec![false; cells.len()];
    for (cell, v) in cells.iter().enumerate().filter(|&(cell, _)| whole[cell]) {
        if v.iter().all(|&v| finite[v as usize]) {
            let corners = v.map(|v| points[v as usize]);
            let relative_volume = geometry::relative_measure(&corners);
            solid[cell] = !is_flat(&corners, relative_volume);
            if !solid[cell] {
                findings.push(Finding::Flat { cell: cell as u32, relative_volume });
            }
        }
    }
    solid
}

/// As [`SimplexMesh::new`](crate::SimplexMesh::new) judges.
fn is_flat<const D: usize, const N: usize>(corners: &[[f64; D]; N], relative_volume: f64) -> bool {
    relative_volume.abs() < FLAT || geometry::longest_edge2(corners).sqrt() < 1.0 / coordinate_limit::<D>()
}

/// Takes from the whole cells those with the vertices of an earlier one.
pub(super) fn check_duplicates<const N: usize>(cells: &[[u32; N]], whole: &mut [bool]) -> Vec<Finding> {
    let named = cells.iter().enumerate().filter(|&(cell, _)| whole[cell]);
    let mut sorted: Vec<([u32; N], u32)> = named
        .map(|(cell, &(mut v))| {
            v.sort_unstable();
            (v, cell as u32)
        })
        .collect();
    sorted.sort_unstable();
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        pairs.extend(same[1..].iter().map(|&(_, cell)| (cell, same[0].1)));
    }
    pairs.sort_unstable();
    pairs.iter().for_each(|&(cell, _)| whole[cell as usize] = false);
    pairs.into_iter().map(|(cell, of)| Finding::Duplicate { cell, of }).collect()
}
