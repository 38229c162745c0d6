//! How cells are joined: facets of more than two cells, cells on one side of a facet, and faces around which no larger
//! faces join the cells.

use super::{Finding, Raw, groups::Groups};
use crate::{geometry, node::NONE};

pub(super) fn find<const D: usize, const N: usize>(raw: &Raw<'_, D, N>, findings: &mut Vec<Finding>) {
    for group in raw.facet_groups().filter(|group| group.len() > 2) {
        let cells = group.iter().map(|f| f.cell).collect();
        findings.push(Finding::SharedFacet { facet: group[0].vertices[..N - 1].to_vec(), cells });
    }
    if N == D + 1 {
        find_overlaps(raw, findings);
    }
    find_pinched(raw, findings);
}

fn find_overlaps<const D: usize, const N: usize>(raw: &Raw<'_, D, N>, findings: &mut Vec<Finding>) {
    for group in raw.facet_groups() {
        let [f, g] = group else { continue };
        if !(raw.solid[f.cell as usize] && raw.solid[g.cell as usize]) {
            continue;
        }
        // Put the vertex that the second cell has beyond the facet into the order of the first: the sign must turn over.
        let corners = raw.corners(f.cell);
        let mut reflected = corners;
        reflected[f.local as usize] = raw.points[raw.cells[g.cell as usize][g.local as usize] as usize];
        let sign = |corners: &[[f64; D]; N]| geometry::relative_measure(corners) < 0.0;
        if sign(&corners) == sign(&reflected) {
            let facet = f.vertices[..N - 1].to_vec();
            findings.push(Finding::Overlap { facet, cells: [f.cell, g.cell] });
        }
    }
}

/// Faces smaller than facets in which parts meet. Around such a face two cells are joined if they share a larger face: so
/// of two tetrahedra with an edge in common the edge is named, and not its ends as well.
fn find_pinched<const D: usize, const N: usize>(raw: &Raw<'_, D, N>, findings: &mut Vec<Finding>) {
    for size in (1..N.saturating_sub(1)).rev() {
        let mut faces: Vec<([u32; N], u32)> = Vec::new();
        for (cell, v) in raw.cells.iter().enumerate().filter(|&(cell, _)| raw.whole[cell]) {
            let subsets = (0_u32..1 << N).filter(|subset| subset.count_ones() as usize == size);
            faces.extend(subsets.map(|subset| (face(v, subset), cell as u32)));
        }
        faces.sort_unstable();
        for star in faces.chunk_by(|f, g| f.0 == g.0).filter(|star| star.len() > 1) {
            let face = &star[0].0[..size];
            let parts = parts(raw, face, star);
            if parts.len() > 1 {
                findings.push(Finding::Pinched { face: face.to_vec(), parts });
            }
        }
    }
}

/// The vertices of `v` in a bit set, ascending, padded with `NONE`.
fn face<const N: usize>(v: &[u32; N], subset: u32) -> [u32; N] {
    let mut face: [u32; N] = std::array::from_fn(|i| if subset >> i & 1 == 1 { v[i] } else { NONE });
    face.sort_unstable();
    face
}

/// The cells around a face, by parts whose cells share another vertex, and so a larger face.
fn parts<const D: usize, const N: usize>(raw: &Raw<'_, D, N>, face: &[u32], star: &[([u32; N], u32)]) -> Vec<Vec<u32>> {
    let others = |at: usize| raw.cells[star[at].1 as usize].into_iter().filter(|v| !face.contains(v));
    let mut beside: Vec<(u32, u32)> = (0..star.len()).flat_map(|at| others(at).map(move |v| (v, at as u32))).collect();
    beside.sort_unstable();
    let mut groups = Groups::new(star.len());
    for pair in beside.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        groups.join(pair[0].1, pair[1].1);
    }
    let mut parts = groups.among(0..star.len() as u32);
    parts.iter_mut().flatten().for_each(|at| *at = star[*at as usize].1);
    parts
}
