//! Divides cells at cut points, one edge after another.
//!
//! An edge is divided together with every cell around it, so that each step leaves a conforming mesh. Two cuts on a facet
//! leave a quadrilateral, whose diagonal runs from the cut that was made first: the order of the edges is the rule for
//! diagonals, and one order for the whole mesh is the same rule on both sides of a facet and on both sides of the surface.
//!
//! The order: long edges of the lattice first; then short ones whose ends agree in parity, the number of steps along the
//! axes from the first corner or centre; then the other short ones. Of the two short edges of a facet that meet in a centre
//! the corners differ in parity, and the other way round: that is the parity rule of Labelle and Shewchuk (2007), section 4.

use super::GenerateError;
use super::complex::{Complex, OPEN, Vertex};
use super::cut::{EDGES, Stage};

/// Which edges are divided first.
pub(super) fn rank(a: &Vertex, b: &Vertex) -> u8 {
    let (Some(p), Some(q)) = (a.site, b.site) else { return 3 };
    if (0..3).filter(|&k| p[k] != q[k]).count() == 1 {
        return 0;
    }
    let parity = |site: [i32; 3]| site.iter().sum::<i32>() >> 1 & 1;
    if parity(p) == parity(q) { 1 } else { 2 }
}

/// Divides all cells around cut edges.
pub(super) fn divide(complex: &mut Complex, stage: &mut Stage) -> Result<(), GenerateError> {
    let work = work(complex, stage);
    let borders = borders(complex, stage, &work);
    let (mut made, mut moved) = (vec![u32::MAX; stage.cuts.len()], Vec::new());
    let mut touched = Vec::with_capacity(4 * work.len());
    for (cell, cuts) in &work {
        let mut ordered = cuts.clone();
        ordered.sort_by_key(|&c| {
            let [a, b] = stage.cuts[c].ends;
            (rank(&complex.vertices[a as usize], &complex.vertices[b as usize]), a, b)
        });
        let first = complex.cells.len();
        for c in ordered {
            if made[c] == u32::MAX {
                let (vertex, straight) = stage.make_vertex(complex, stage.cuts[c], borders[c])?;
                made[c] = vertex;
                moved.extend(straight.map(|point| (vertex, point)));
            }
            divide_at(complex, *cell, first, stage.cuts[c].ends, made[c]);
        }
        touched.push(*cell as u32);
        touched.extend(first as u32..complex.cells.len() as u32);
    }
    stage.put_back(complex, moved, &touched);
    Ok(())
}

/// The cells with cut edges, and their cuts.
fn work(complex: &Complex, stage: &Stage) -> Vec<(usize, Vec<usize>)> {
    let mut work = Vec::new();
    for (i, cell) in complex.cells.iter().enumerate() {
        let signs = cell.map(|v| stage.signs[v as usize]);
        if !(signs.contains(&-1) && signs.contains(&1)) {
            continue;
        }
        let cuts: Vec<usize> = EDGES.iter().filter_map(|&[j, k]| stage.cut_of(cell[j], cell[k])).collect();
        if !cuts.is_empty() {
            work.push((i, cuts));
        }
    }
    work
}

/// For each cut the earlier surfaces that its edge lies in: it has cells of the solid and others around it.
fn borders(complex: &Complex, stage: &Stage, work: &[(usize, Vec<usize>)]) -> Vec<u64> {
    let (mut inside, mut outside) = (vec![0_u64; stage.cuts.len()], vec![0_u64; stage.cuts.len()]);
    for (cell, cuts) in work {
        let label = complex.labels[*cell];
        let own = if label == OPEN { 0 } else { 1 << label };
        for &c in cuts {
            inside[c] |= own;
            outside[c] |= !own;
        }
    }
    let on = |v: u32| complex.vertices[v as usize].on;
    (0..stage.cuts.len())
        .map(|c| inside[c] & outside[c] & on(stage.cuts[c].ends[0]) & on(stage.cuts[c].ends[1]))
        .collect()
}

/// Divides an edge of a cell and of its parts, which begin at `first`: the part with the second end is new.
fn divide_at(complex: &mut Complex, cell: usize, first: usize, [a, b]: [u32; 2], middle: u32) {
    let last = complex.cells.len();
    for part in std::iter::once(cell).chain(first..last) {
        let corners = complex.cells[part];
        if corners.contains(&a) && corners.contains(&b) {
            complex.cells[part] = corners.map(|v| if v == b { middle } else { v });
            complex.cells.push(corners.map(|v| if v == a { middle } else { v }));
            complex.labels.push(complex.labels[part]);
        }
    }
}
