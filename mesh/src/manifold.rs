//! Which cells share facets, and whether cells that meet are joined by facets.

use crate::{
    MeshError, SimplexMesh,
    complex::{NONE, unlink},
};

/// A facet of a cell: its vertices ascending (the last entry is padding), the cell, the local vertex opposite.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Facet<const N: usize> {
    pub vertices: [u32; N],
    pub cell: u32,
    pub local: u8,
}

/// The facets of some cells, sorted: the two sides of an interior facet come one after the other.
pub(crate) fn facets<const N: usize>(cells: impl Iterator<Item = (u32, [u32; N])>) -> Vec<Facet<N>> {
    let mut facets = Vec::with_capacity(cells.size_hint().0 * N);
    for (cell, v) in cells {
        for local in 0..N {
            let mut vertices = v;
            vertices[local] = NONE; // sorts behind every vertex
            vertices.sort_unstable();
            facets.push(Facet { vertices, cell, local: local as u8 });
        }
    }
    facets.sort_unstable();
    facets
}

/// Refuses a mesh with cells that meet in a vertex, edge, ... without a chain of facets around it from one to the other.
///
/// The search for the star of a vertex, and for the cells around an edge that is to be bisected, walks across facets.
/// Subdivision leaves the property intact: it belongs to the points of a face, not to how the face is cut up.
pub(crate) fn check_stars<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Result<(), MeshError> {
    // Faces with N - 1 vertices are facets, of which the links take care.
    for size in 1..N.saturating_sub(1) {
        let mut faces = Vec::new();
        for (slot, node) in mesh.nodes.iter().enumerate() {
            for subset in 0_u32..1 << N {
                if subset.count_ones() as usize == size {
                    faces.push((face(&node.v, subset), slot as u32));
                }
            }
        }
        faces.sort_unstable();
        for star in faces.chunk_by(|f, g| f.0 == g.0) {
            check_star(mesh, &star[0].0[..size], star)?;
        }
    }
    Ok(())
}

/// The vertices of `v` in a bit set, ascending, padded with `NONE`.
fn face<const N: usize>(v: &[u32; N], subset: u32) -> [u32; N] {
    let mut face: [u32; N] = std::array::from_fn(|i| if subset >> i & 1 == 1 { v[i] } else { NONE });
    face.sort_unstable();
    face
}

/// Refuses a star, given with its cells ascending, in which some cell cannot be reached from the first.
fn check_star<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    face: &[u32],
    star: &[([u32; N], u32)],
) -> Result<(), MeshError> {
    let mut reached = vec![false; star.len()];
    let mut queue = vec![0];
    reached[0] = true;
    while let Some(at) = queue.pop() {
        let slot = star[at].1 as usize;
        for facet in 0..N {
            let link = mesh.links[slot][facet];
            if link == NONE || face.contains(&mesh.nodes[slot].v[facet]) {
                continue;
            }
            let neighbor = unlink(link).0 as u32;
            if let Ok(at) = star.binary_search_by_key(&neighbor, |&(_, cell)| cell)
                && !reached[at]
            {
                reached[at] = true;
                queue.push(at);
            }
        }
    }
    match reached.iter().position(|&r| !r) {
        None => Ok(()),
        Some(at) => Err(MeshError::Pinched { face: face.to_vec(), cells: [star[0].1 as usize, star[at].1 as usize] }),
    }
}
