//! Which cells share facets, and whether cells that meet are joined by facets.

use crate::{
    MeshError, SimplexMesh,
    colouring::Stars,
    node::{NONE, is_interior, unlink},
};

/// A facet of a cell: its vertices ascending (the last entry is padding), the cell, the local vertex opposite.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Facet<const N: usize> {
    pub vertices: [u32; N],
    pub cell: u32,
    pub local: u8,
}

/// The facets of some cells, sorted: the two sides of an interior facet come one after the other.
///
/// Sorted by the first vertex by counting, and among the few of one vertex by comparing.
pub(crate) fn facets<const N: usize>(cells: impl Iterator<Item = (u32, [u32; N])> + Clone) -> Vec<Facet<N>> {
    let facets_of = |(cell, v): (u32, [u32; N])| {
        (0..N).map(move |local| {
            let mut vertices = v;
            vertices[local] = NONE; // sorts behind every vertex
            vertices.sort_unstable();
            Facet { vertices, cell, local: local as u8 }
        })
    };
    let mut starts: Vec<usize> = Vec::new();
    for facet in cells.clone().flat_map(facets_of) {
        let first = facet.vertices[0] as usize;
        if first + 2 > starts.len() {
            starts.resize(first + 2, 0);
        }
        starts[first + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let n = starts.last().copied().unwrap_or(0);
    let mut facets = vec![Facet { vertices: [NONE; N], cell: NONE, local: 0 }; n];
    let mut next = starts.clone();
    for facet in cells.flat_map(facets_of) {
        let at = &mut next[facet.vertices[0] as usize];
        facets[*at] = facet;
        *at += 1;
    }
    for range in starts.windows(2) {
        facets[range[0]..range[1]].sort_unstable();
    }
    facets
}

/// Refuses a mesh with cells that meet in a vertex, edge, ... without a chain of facets around it from one to the other.
///
/// The search for the star of a vertex, and for the cells around an edge that is to be bisected, walks across facets.
/// Subdivision leaves the property intact: it belongs to the points of a face, not to how the face is cut up.
pub(crate) fn check_stars<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Result<(), MeshError> {
    // Faces with N - 1 vertices are facets, of which the links take care. Each face is looked at from its first vertex.
    let stars = Stars::new(mesh.points.len(), &mesh.nodes);
    let (mut faces, mut reached, mut queue) = (Vec::new(), Vec::new(), Vec::new());
    for first in 0..mesh.points.len() as u32 {
        faces.clear();
        for &cell in stars.of(first) {
            let v = &mesh.nodes[cell as usize].v;
            let later = (0..N).filter(|&i| v[i] > first).fold(0_u32, |set, i| set | 1 << i);
            let own = (0..N).filter(|&i| v[i] == first).fold(0_u32, |set, i| set | 1 << i);
            let small = |subset: &u32| subset & !later == 0 && (subset.count_ones() as usize) < N - 2;
            faces.extend((0..1 << N).filter(small).map(|subset| (face(v, subset | own), cell)));
        }
        faces.sort_unstable();
        for star in faces.chunk_by(|f, g| f.0 == g.0) {
            let size = star[0].0.iter().take_while(|&&v| v != NONE).count();
            check_star(mesh, &star[0].0[..size], star, &mut reached, &mut queue)?;
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
    reached: &mut Vec<bool>,
    queue: &mut Vec<usize>,
) -> Result<(), MeshError> {
    reached.clear();
    reached.resize(star.len(), false);
    queue.push(0);
    reached[0] = true;
    while let Some(at) = queue.pop() {
        let slot = star[at].1 as usize;
        for facet in 0..N {
            let link = mesh.nodes[slot].links[facet];
            if !is_interior(link) || face.contains(&mesh.nodes[slot].v[facet]) {
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
