//! Cells that wind against the others.
//!
//! Cells that fill space have a sign each. Those of a surface or a rod are compared across facets: two neighbours wind
//! alike if they run through their common facet in opposite ways.

use super::{Finding, Raw};
use crate::{geometry, node::NONE};
use std::collections::VecDeque;

/// Finds inverted cells, meshes that are inverted as a whole, and surfaces that cannot be oriented.
pub(super) fn find<const D: usize, const N: usize>(raw: &Raw<'_, D, N>, findings: &mut Vec<Finding>) {
    if N == D + 1 {
        let negative = negative(raw);
        let n_solid = raw.solid.iter().filter(|&&solid| solid).count();
        let mirrored = 2 * negative.len() > n_solid;
        let is_inverted = |cell: &u32| raw.solid[*cell as usize] && negative.binary_search(cell).is_ok() != mirrored;
        findings.extend((0..raw.cells.len() as u32).filter(is_inverted).map(|cell| Finding::Inverted { cell }));
        if mirrored {
            findings.push(Finding::Mirrored { cells: negative.len() });
        }
    } else {
        let (inverted, one_sided) = against_neighbours(raw);
        findings.extend(inverted.into_iter().map(|cell| Finding::Inverted { cell }));
        findings.extend(one_sided.into_iter().map(|cells| Finding::NotOrientable { cells }));
    }
}

/// The cells that have to be turned over so that all wind alike and, if they fill space, have positive volumes.
pub(super) fn to_turn<const D: usize, const N: usize>(raw: &Raw<'_, D, N>) -> Vec<u32> {
    if N == D + 1 { negative(raw) } else { against_neighbours(raw).0 }
}

/// Solid cells of negative volume, ascending.
fn negative<const D: usize, const N: usize>(raw: &Raw<'_, D, N>) -> Vec<u32> {
    let solid = (0..raw.cells.len() as u32).filter(|&cell| raw.solid[cell as usize]);
    solid.filter(|&cell| geometry::relative_measure(&raw.corners(cell)) < 0.0).collect()
}

/// The minority in each part that facets join, ascending; and for parts that cannot be oriented two cells that show it.
fn against_neighbours<const D: usize, const N: usize>(raw: &Raw<'_, D, N>) -> (Vec<u32>, Vec<[u32; 2]>) {
    let links = links(raw);
    let mut turned: Vec<Option<bool>> = vec![None; raw.cells.len()];
    let (mut inverted, mut one_sided) = (Vec::new(), Vec::new());
    let mut queue = VecDeque::new();
    for first in (0..raw.cells.len()).filter(|&cell| raw.whole[cell]) {
        if turned[first].is_some() {
            continue;
        }
        turned[first] = Some(false);
        queue.push_back(first);
        let (mut part, mut clash) = (Vec::new(), None);
        while let Some(cell) = queue.pop_front() {
            part.push(cell as u32);
            let here = turned[cell] == Some(true);
            for &(neighbour, against) in links[cell].iter().filter(|link| link.0 != NONE) {
                let there = &mut turned[neighbour as usize];
                match *there {
                    None => {
                        *there = Some(here != against);
                        queue.push_back(neighbour as usize);
                    }
                    Some(there) if there != (here != against) => {
                        clash = clash.or(Some([(cell as u32).min(neighbour), (cell as u32).max(neighbour)]));
                    }
                    Some(_) => {}
                }
            }
        }
        if let Some(cells) = clash {
            one_sided.push(cells);
            continue;
        }
        let count = part.iter().filter(|&&cell| turned[cell as usize] == Some(true)).count();
        let minority = 2 * count <= part.len();
        inverted.extend(part.into_iter().filter(|&cell| turned[cell as usize] == Some(minority)));
    }
    inverted.sort_unstable();
    (inverted, one_sided)
}

/// Per facet of each cell, the neighbour across it and whether the two wind against each other.
fn links<const D: usize, const N: usize>(raw: &Raw<'_, D, N>) -> Vec<[(u32, bool); N]> {
    let mut links = vec![[(NONE, false); N]; raw.cells.len()];
    for group in raw.facet_groups() {
        if let [f, g] = group {
            let against =
                runs(&raw.cells[f.cell as usize], f.local.into()) == runs(&raw.cells[g.cell as usize], g.local.into());
            links[f.cell as usize][f.local as usize] = (g.cell, against);
            links[g.cell as usize][g.local as usize] = (f.cell, against);
        }
    }
    links
}

/// The orientation, relative to ascending vertices, that a cell induces on the facet opposite local vertex `local`.
fn runs<const N: usize>(cell: &[u32; N], local: usize) -> bool {
    let facet = || cell.iter().enumerate().filter(move |&(i, _)| i != local);
    let inversions: usize = facet().map(|(i, v)| facet().filter(|&(j, w)| j > i && w < v).count()).sum();
    (inversions + local).is_multiple_of(2)
}
