//! Putting right what has one remedy, and saying so.

use super::{Finding, coincide, finding::ids, inspect, winding};
use crate::node::{MAX_SLOTS, NONE};
use serde::Serialize;
use std::fmt;

/// What to repair beyond what cannot be left.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct RepairSettings {
    /// Merge vertices nearer to each other than this, in units of the coordinates; at 0 those with equal coordinates. By
    /// default none: parts may touch on purpose without being joined.
    pub merge: Option<f64>,
}

/// A mesh after repair, and how it relates to what was given.
#[derive(Clone, PartialEq, Debug)]
pub struct Repaired<const D: usize, const N: usize> {
    /// The vertices that are left, in their order.
    pub points: Vec<[f64; D]>,
    /// The cells that are left, in their order.
    pub cells: Vec<[u32; N]>,
    /// For each vertex given, where it is now; `None` if it was dropped.
    pub new_vertex: Vec<Option<u32>>,
    /// For each cell given, where it is now; `None` if it was removed.
    pub new_cell: Vec<Option<u32>>,
    /// Everything that was done, named by the ids given.
    pub repairs: Vec<Repair>,
}

impl<const D: usize, const N: usize> Repaired<D, N> {
    /// What is left of data with one entry per cell given, such as regions.
    pub fn of_cells<T: Copy>(&self, data: &[T]) -> Vec<T> {
        kept(data, &self.new_cell)
    }

    /// What is left of data with one entry per vertex given; of merged vertices the first entry.
    pub fn of_vertices<T: Copy>(&self, data: &[T]) -> Vec<T> {
        kept(data, &self.new_vertex)
    }
}

/// The first entry for each new place, which ascend.
fn kept<T: Copy>(data: &[T], new: &[Option<u32>]) -> Vec<T> {
    let mut kept = Vec::new();
    for (&entry, new) in data.iter().zip(new) {
        if new.is_some_and(|new| new as usize == kept.len()) {
            kept.push(entry);
        }
    }
    kept
}

/// One repair, by the ids of the mesh that was given.
#[derive(Clone, PartialEq, Debug, Serialize)]
#[serde(tag = "repair", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Repair {
    /// Vertices in one place became one.
    Merged {
        /// The vertex that stays, where it was.
        kept: u32,
        /// The others, ascending.
        merged: Vec<u32>,
    },
    /// A cell that cannot be one was removed.
    Removed {
        /// The cell.
        cell: u32,
        /// Why, in a few words.
        why: &'static str,
    },
    /// The winding of cells was turned over.
    Turned {
        /// The cells, ascending.
        cells: Vec<u32>,
    },
    /// Vertices that no remaining cell names were dropped.
    Dropped {
        /// The vertices, ascending.
        vertices: Vec<u32>,
    },
}

/// One line. Of a long list of ids it names the first and counts the others.
impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Merged { kept, merged } => write!(f, "vertices {}: merged into vertex {kept}", ids(merged)),
            Self::Removed { cell, why } => write!(f, "cell {cell}: removed, {why}"),
            Self::Turned { cells } => write!(f, "cells {}: winding turned over", ids(cells)),
            Self::Dropped { vertices } => write!(f, "vertices {}: dropped, no cell names them", ids(vertices)),
        }
    }
}

/// Repairs what has one remedy: merges coincident vertices if asked to, removes cells that are flat, repeat a vertex or
/// another cell, or name a vertex that does not exist or is not finite, turns windings over until all cells agree (with
/// positive volumes if they fill space; otherwise with the majority of their part), and drops unused vertices.
///
/// Removing a flat cell leaves its facets open, and facets of more than two cells, overlaps and pinches are not touched:
/// [`check`](super::check) the result. To repair a repaired mesh does nothing.
pub fn repair<const D: usize, const N: usize>(
    points: &[[f64; D]],
    cells: &[[u32; N]],
    settings: &RepairSettings,
) -> Repaired<D, N> {
    let mut repairs = Vec::new();
    if points.len().max(cells.len()) > MAX_SLOTS {
        // Ids could not name them; `check` says so.
        let same = |n: usize| (0..n).map(|i| u32::try_from(i).ok()).collect();
        let (new_vertex, new_cell) = (same(points.len()), same(cells.len()));
        return Repaired { points: points.to_vec(), cells: cells.to_vec(), new_vertex, new_cell, repairs };
    }
    let stands_for = merge(points, settings.merge, &mut repairs);
    let rename = |v: u32| stands_for.get(v as usize).copied().unwrap_or(v);
    let merged: Vec<[u32; N]> = cells.iter().map(|v| v.map(rename)).collect();
    let removed = removals(points, &merged, &mut repairs);
    let old_cell: Vec<u32> = (0..cells.len() as u32).filter(|&cell| !removed[cell as usize]).collect();
    let mut kept: Vec<[u32; N]> = old_cell.iter().map(|&cell| merged[cell as usize]).collect();
    turn(points, &mut kept, &old_cell, &mut repairs);

    let mut used = vec![false; points.len()];
    kept.iter().flatten().for_each(|&v| used[v as usize] = true);
    let place = places(&used);
    kept.iter_mut().flatten().for_each(|v| *v = place[*v as usize].unwrap_or(NONE));
    let is_dropped = |v: &u32| stands_for[*v as usize] == *v && !used[*v as usize];
    let vertices: Vec<u32> = (0..points.len() as u32).filter(is_dropped).collect();
    if !vertices.is_empty() {
        repairs.push(Repair::Dropped { vertices });
    }
    Repaired {
        points: points.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| *p).collect(),
        cells: kept,
        new_vertex: stands_for.iter().map(|&v| place[v as usize]).collect(),
        new_cell: places(&removed.iter().map(|removed| !removed).collect::<Vec<bool>>()),
        repairs,
    }
}

/// The place of each entry that is kept among those that are.
fn places(keep: &[bool]) -> Vec<Option<u32>> {
    let mut next = 0;
    let mut place = |&keep: &bool| {
        next += u32::from(keep);
        keep.then(|| next - 1)
    };
    keep.iter().map(&mut place).collect()
}

/// Which cells cannot be cells.
fn removals<const D: usize, const N: usize>(
    points: &[[f64; D]],
    cells: &[[u32; N]],
    repairs: &mut Vec<Repair>,
) -> Vec<bool> {
    let mut findings = Vec::new();
    let raw = inspect(points, cells, &mut findings);
    let mut reasons = vec!["a vertex is not finite"; cells.len()];
    for finding in &findings {
        match *finding {
            Finding::Index { cell, .. } => reasons[cell as usize] = "it names a vertex that does not exist",
            Finding::RepeatedVertex { cell, .. } => reasons[cell as usize] = "it names a vertex twice",
            Finding::Flat { cell, .. } => reasons[cell as usize] = "it is flat",
            Finding::Duplicate { cell, .. } => reasons[cell as usize] = "it has the vertices of an earlier cell",
            _ => {}
        }
    }
    let removed: Vec<bool> = raw.solid.iter().map(|solid| !solid).collect();
    let cells = (0..cells.len() as u32).filter(|&cell| removed[cell as usize]);
    repairs.extend(cells.map(|cell| Repair::Removed { cell, why: reasons[cell as usize] }));
    removed
}

/// Makes all cells wind alike, by exchange of their last two vertices.
fn turn<const D: usize, const N: usize>(
    points: &[[f64; D]],
    cells: &mut [[u32; N]],
    old_cell: &[u32],
    repairs: &mut Vec<Repair>,
) {
    let turned = winding::to_turn(&inspect(points, cells, &mut Vec::new()));
    if turned.is_empty() {
        return;
    }
    for &cell in &turned {
        cells[cell as usize].swap(N - 2, N - 1);
    }
    repairs.push(Repair::Turned { cells: turned.iter().map(|&cell| old_cell[cell as usize]).collect() });
}

/// For each vertex the one that it is merged into, mostly itself.
fn merge<const D: usize>(points: &[[f64; D]], within: Option<f64>, repairs: &mut Vec<Repair>) -> Vec<u32> {
    let mut stands_for: Vec<u32> = (0..points.len() as u32).collect();
    let groups = within.map_or_else(Vec::new, |distance| coincide::groups(points, distance));
    for group in groups.iter().filter(|group| group.len() > 1) {
        group.iter().for_each(|&v| stands_for[v as usize] = group[0]);
        repairs.push(Repair::Merged { kept: group[0], merged: group[1..].to_vec() });
    }
    stands_for
}
