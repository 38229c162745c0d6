//! Boxes divided by Kuhn's triangulation.

use crate::{MeshError, Rule, SimplexMesh, node::MAX_SLOTS};

/// The box from `lower` to `upper`, divided into `cells[k]` equal parts along axis `k`, each part into `D!` simplices:
/// 2 triangles, 6 tetrahedra, 24 four-dimensional simplices. `N` must be `D + 1`, which the build checks.
///
/// Every simplex is a path along the edges of its part from the lowest corner to the highest, one axis after the other,
/// in each of the `D!` orders of the axes. All diagonals run the same way, so that parts match, and the refinement edge is
/// the diagonal: bisection of a cube produces 1, 3 and 4 shapes of cells in 2, 3 and 4 dimensions.
///
/// Vertices are numbered along axis 0 first; parts likewise, with the orders of the axes in lexicographic order.
///
/// # Errors
/// [`MeshError::Box`] unless `lower < upper` and `cells > 0` on every axis, [`MeshError::TooManyCells`], or the
/// coordinate errors of [`SimplexMesh::new`].
///
/// Source: Kuhn, *Some combinatorial lemmas in topology*, IBM J. Res. Dev. 4 (1960).
pub fn kuhn_box<const D: usize, const N: usize>(
    lower: [f64; D],
    upper: [f64; D],
    cells: [usize; D],
) -> Result<SimplexMesh<D, N>, MeshError> {
    kuhn_box_with_rule(lower, upper, cells, Rule::default())
}

/// As [`kuhn_box`], but each part is the mirror image of its neighbours (the "Union Jack"): with an even number of parts the
/// mesh is its own mirror image, and in no case has it a direction in which its diagonals run.
///
/// The vertices are those of [`kuhn_box`], and so are the numbers of the parts.
///
/// # Errors
/// As [`kuhn_box`].
pub fn mirrored_kuhn_box<const D: usize, const N: usize>(
    lower: [f64; D],
    upper: [f64; D],
    cells: [usize; D],
) -> Result<SimplexMesh<D, N>, MeshError> {
    divide(lower, upper, cells, Rule::default(), true)
}

/// As [`kuhn_box`], with a choice of the rule by which cells come to their refinement edges: by colour these are not the
/// diagonals.
///
/// # Errors
/// As [`kuhn_box`].
pub fn kuhn_box_with_rule<const D: usize, const N: usize>(
    lower: [f64; D],
    upper: [f64; D],
    cells: [usize; D],
    rule: Rule,
) -> Result<SimplexMesh<D, N>, MeshError> {
    divide(lower, upper, cells, rule, false)
}

fn divide<const D: usize, const N: usize>(
    lower: [f64; D],
    upper: [f64; D],
    cells: [usize; D],
    rule: Rule,
    mirrored: bool,
) -> Result<SimplexMesh<D, N>, MeshError> {
    const { assert!(N == D + 1, "a box is filled by simplices with D + 1 vertices") };
    check_box(&lower, &upper, &cells)?;
    let paths = paths::<D>();
    check_count(&cells, paths.len())?;
    let strides: [usize; D] = std::array::from_fn(|k| cells[..k].iter().map(|n| n + 1).product());
    let points = grid(&cells.map(|n| n + 1))
        .map(|at| std::array::from_fn(|k| coordinate(lower[k], upper[k], at[k], cells[k])))
        .collect();
    let mut simplices = Vec::with_capacity(cells.iter().product::<usize>() * paths.len());
    for at in grid(&cells) {
        let is_mirrored = |axis: usize| mirrored && at[axis] % 2 == 1;
        for path in &paths {
            let mut vertex: usize = (0..D).map(|k| (at[k] + usize::from(is_mirrored(k))) * strides[k]).sum();
            let mut simplex = [vertex as u32; N];
            for (step, &axis) in path.iter().enumerate() {
                vertex = if is_mirrored(axis) { vertex - strides[axis] } else { vertex + strides[axis] };
                simplex[step + 1] = vertex as u32;
            }
            simplices.push(simplex);
        }
    }
    let regions = vec![0; simplices.len()];
    SimplexMesh::assemble(points, simplices, regions, rule)
}

fn check_box<const D: usize>(lower: &[f64; D], upper: &[f64; D], cells: &[usize; D]) -> Result<(), MeshError> {
    for axis in 0..D {
        let (lower, upper, cells) = (lower[axis], upper[axis], cells[axis]);
        let is_ascending = lower < upper; // false with a NaN
        if !is_ascending || cells == 0 {
            return Err(MeshError::Box { axis, lower, upper, cells });
        }
    }
    Ok(())
}

fn check_count<const D: usize>(cells: &[usize; D], per_part: usize) -> Result<(), MeshError> {
    let count = cells.iter().fold(per_part, |count, &n| count.saturating_mul(n.saturating_add(1)));
    if count > MAX_SLOTS { Err(MeshError::TooManyCells { count, limit: MAX_SLOTS }) } else { Ok(()) }
}

/// The `i`-th of `n` equal steps from `lower` to `upper`, which are both met exactly.
fn coordinate(lower: f64, upper: f64, i: usize, n: usize) -> f64 {
    let t = i as f64 / n as f64;
    if i == n { upper } else { lower + t * (upper - lower) }
}

/// The positions in a grid, axis 0 first.
fn grid<const D: usize>(size: &[usize; D]) -> impl Iterator<Item = [usize; D]> + use<D> {
    let size = *size;
    (0..size.iter().product()).map(move |mut index: usize| {
        std::array::from_fn(|k| {
            let at = index % size[k];
            index /= size[k];
            at
        })
    })
}

/// The orders of the axes, lexicographically.
fn paths<const D: usize>() -> Vec<[usize; D]> {
    fn extend<const D: usize>(path: [usize; D], length: usize, paths: &mut Vec<[usize; D]>) {
        if length == D {
            paths.push(path);
        }
        for axis in (0..D).filter(|axis| length < D && !path[..length].contains(axis)) {
            let mut longer = path;
            longer[length] = axis;
            extend(longer, length + 1, paths);
        }
    }
    let mut paths = Vec::new();
    extend([0; D], 0, &mut paths);
    paths
}
