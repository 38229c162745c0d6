//! Vertices that no cell uses, and parts of a mesh that have nothing in common.

use super::{Finding, Raw, groups::Groups};

/// Finds the vertices that no cell names, whether or not that cell is sound.
pub(super) fn find_unused<const D: usize, const N: usize>(raw: &Raw<'_, D, N>, findings: &mut Vec<Finding>) {
    let mut used = vec![false; raw.points.len()];
    for &v in raw.cells.iter().flatten() {
        if let Some(used) = used.get_mut(v as usize) {
            *used = true;
        }
    }
    let unused = used.iter().enumerate().filter(|(_, used)| !**used);
    findings.extend(unused.map(|(vertex, _)| Finding::Unused { vertex: vertex as u32 }));
}

/// Finds all parts but the largest (the first of several as large), and returns how many parts there are.
pub(super) fn find_disconnected<const D: usize, const N: usize>(
    raw: &Raw<'_, D, N>,
    findings: &mut Vec<Finding>,
) -> usize {
    let mut groups = Groups::new(raw.points.len());
    let whole = || raw.cells.iter().enumerate().filter(|&(cell, _)| raw.whole[cell]);
    for (_, v) in whole() {
        v[1..].iter().for_each(|&w| groups.join(v[0], w));
    }
    let mut named: Vec<(u32, u32)> = whole().map(|(cell, v)| (groups.root(v[0]), cell as u32)).collect();
    named.sort_unstable();
    let mut parts: Vec<Vec<u32>> =
        named.chunk_by(|a, b| a.0 == b.0).map(|part| part.iter().map(|&(_, cell)| cell).collect()).collect();
    parts.sort_unstable_by_key(|part| part[0]);
    let n_parts = parts.len();
    let most = parts.iter().map(Vec::len).max();
    if let Some(largest) = parts.iter().position(|part| Some(part.len()) == most) {
        parts.remove(largest);
    }
    findings.extend(parts.into_iter().map(|cells| Finding::Disconnected { cells }));
    n_parts
}
