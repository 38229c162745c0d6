//! Delaunay triangulations of random points in the unit cube.

use crate::{MeshError, SimplexMesh, generate::kuhn_box, geometry, random::SplitMix64};

/// Insertions that would make a cell flatter than this, in relative volume, are left out.
const FLAT: f64 = 1e-3;
/// Volumes before and after an insertion differ by rounding only.
const VOLUME: f64 = 1e-9;
/// A point this close to a sphere, in squared radii, is not inside it.
const SPHERE: f64 = 1e-9;

/// The unit cube, divided into simplices by inserting `n_points` random points one by one, each by retriangulating the
/// cells whose circumspheres contain it. Points that would make a nearly flat cell are left out, so that the mesh may have
/// fewer; the same seed gives the same mesh. Each insertion looks at every cell: meant for test meshes of up to a thousand
/// points. `N` must be `D + 1`, which the build checks.
///
/// # Errors
/// [`MeshError`], should the outcome not be a mesh.
///
/// Source: Bowyer, Comput. J. 24 (1981); Watson, Comput. J. 24 (1981).
pub fn random_delaunay<const D: usize, const N: usize>(
    n_points: usize,
    seed: u64,
) -> Result<SimplexMesh<D, N>, MeshError> {
    const { assert!(N == D + 1, "a cube is filled by simplices with D + 1 vertices") };
    let cube = kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D])?;
    let mut points = cube.points().to_vec();
    let mut cells: Vec<[u32; N]> = cube.cells().map(|c| cube.cell(c).map(|v| v.0)).collect();
    let mut random = SplitMix64::new(seed);
    for _ in 0..n_points {
        insert(&mut points, &mut cells, std::array::from_fn(|_| random.unit()));
    }
    SimplexMesh::new(points, cells)
}

/// Inserts a point unless a cell would come out flat, or the cells that it sees would not fill the cavity.
fn insert<const D: usize, const N: usize>(points: &mut Vec<[f64; D]>, cells: &mut Vec<[u32; N]>, p: [f64; D]) {
    let new = points.len() as u32;
    let sees = |cell: &[u32; N]| in_circumsphere(&cell.map(|v| points[v as usize]), &p);
    let cavity: Vec<bool> = cells.iter().map(sees).collect();
    let removed = cells.iter().zip(&cavity).filter(|(_, seen)| **seen).map(|(cell, _)| *cell);
    // The facets of the cavity, each as the cell that it makes with the point; those inside come in twos.
    let mut facets: Vec<([u32; N], [u32; N])> = Vec::new();
    for cell in removed.clone() {
        for local in 0..N {
            let mut made = cell;
            made[local] = new;
            let mut key = made;
            key.sort_unstable();
            facets.push((key, made));
        }
    }
    facets.sort_unstable();
    let made: Vec<[u32; N]> = facets.chunk_by(|f, g| f.0 == g.0).filter(|g| g.len() == 1).map(|g| g[0].1).collect();
    let corners = |cell: &[u32; N]| cell.map(|v| if v == new { p } else { points[v as usize] });
    let volume = |cell: &[u32; N]| geometry::signed_measure(&corners(cell)).abs();
    let before: f64 = removed.map(|cell| volume(&cell)).sum();
    let after: f64 = made.iter().map(volume).sum();
    let sound = made.iter().all(|cell| geometry::relative_measure(&corners(cell)).abs() > FLAT);
    if sound && (before - after).abs() < VOLUME {
        let mut seen = cavity.iter();
        cells.retain(|_| seen.next() != Some(&true));
        cells.extend(made);
        points.push(p);
    }
}

fn in_circumsphere<const D: usize, const N: usize>(corners: &[[f64; D]; N], p: &[f64; D]) -> bool {
    let Some(g) = geometry::gradients(corners) else { return false };
    let centre: [f64; D] = std::array::from_fn(|k| {
        corners[0][k] + (1..N).map(|i| 0.5 * geometry::distance2(&corners[i], &corners[0]) * g[i][k]).sum::<f64>()
    });
    geometry::distance2(&centre, p) < geometry::distance2(&centre, &corners[0]) * (1.0 - SPHERE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn no_sphere_holds_a_vertex<const D: usize, const N: usize>(n_points: usize) {
        let mesh = random_delaunay::<D, N>(n_points, 3).unwrap();
        assert!(mesh.n_vertices() > n_points / 2);
        mesh.check_invariants().unwrap();
        assert!((mesh.total_volume() - 1.0).abs() < 1e-12);
        for c in mesh.cells() {
            assert!(mesh.points().iter().all(|p| !in_circumsphere(&mesh.corners(c), p)));
        }
    }

    #[test]
    fn the_spheres_are_empty() {
        no_sphere_holds_a_vertex::<2, 3>(80);
        no_sphere_holds_a_vertex::<3, 4>(80);
        no_sphere_holds_a_vertex::<4, 5>(30);
    }
}
