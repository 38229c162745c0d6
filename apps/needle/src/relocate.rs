//! Orthogonal relocation: moving a node of the mesh onto the needle, so that the needle runs along nodes.
//!
//! Left out are nodes on the boundary, and moves that would flatten a cell: a triangle whose three nodes all go onto the
//! needle has no area left and makes the stiffness singular.

use crate::error::NeedleError;
use crate::facet::barycentric;
use crate::needle::minus;
use crate::slab::Slab;
use crate::tip::deformed_corners;
use stylet_mesh::VertexId;
use stylet_mesh::geometry::combine;
use stylet_physics::material::Hyperelastic;

/// Moves `vertex` within the body so that it comes to lie at the point `target` of space. The material does not move: the
/// node's new place in the undeformed body is that of the material at `target`, and its displacement follows.
///
/// Returns whether the node was moved.
///
/// # Errors
/// [`NeedleError::Mesh`] if a layer below refuses.
pub fn onto_needle<const D: usize, const N: usize, M: Hyperelastic<D>>(
    slab: &mut Slab<D, N, M>,
    vertex: VertexId,
    target: [f64; D],
) -> Result<bool, NeedleError> {
    let mut star = Vec::new();
    slab.mesh.star(vertex, &mut star);
    let on_boundary = star.iter().any(|&cell| {
        let vertices = slab.mesh.cell(cell);
        (0..N).any(|facet| vertices[facet] != vertex && slab.mesh.neighbor(cell, facet).is_none())
    });
    if on_boundary {
        return Ok(false);
    }
    for cell in star {
        let weights = barycentric(deformed_corners(&slab.mesh, &slab.u, cell), target);
        if weights.iter().all(|&w| w >= -1e-9) {
            let rest = combine(&slab.mesh.corners(cell), &weights);
            return slab.move_vertex(vertex, rest, minus(target, rest));
        }
    }
    // Beyond the cells around it the node would turn one of them over.
    Ok(false)
}
