//! Where free nodes are at the start.

use super::geometry::Geometry;
use super::scene::{Shape, StartStage};
use stylet_mesh::VertexId;
use stylet_mesh::random::SplitMix64;
use stylet_solver::subspace::{Constraint, Subspace};

/// Displacements (m, flat) that put the free nodes of a body where the scene wants them.
pub(super) fn displacement<const D: usize, const N: usize>(
    stage: Option<&StartStage>,
    geometry: &Geometry<D, N>,
    subspace: &Subspace<D>,
) -> Vec<f64> {
    let mut u = vec![0.0; D * geometry.mesh.n_vertex_slots()];
    let Some(stage) = stage.filter(|stage| stage.shape != Shape::Rest) else { return u };
    let (centre, [low, high]) = (geometry.centre(), geometry.bounds);
    let mut random = SplitMix64::new(stage.seed.cast_unsigned());
    for vertex in 0..geometry.mesh.n_vertex_slots() {
        if subspace.get(vertex) != Constraint::Free {
            continue;
        }
        let x = geometry.mesh.point(VertexId::new(vertex));
        for k in 0..D {
            let last = k + 1 == D;
            let target = match stage.shape {
                Shape::Rest => x[k],
                Shape::Point => centre[k],
                Shape::Plane if last => centre[k],
                Shape::Line if !last => centre[k],
                Shape::Plane | Shape::Line => x[k],
                Shape::Scramble => low[k] + (high[k] - low[k]) * random.unit(),
            };
            u[D * vertex + k] = target - x[k];
        }
    }
    u
}
