//! The deformation that the tip of a needle is carried by: that of the tissue around it, without the needle's own dent.

use super::Insertion;
use crate::body::Body;
use crate::material::Hyperelastic;
use nalgebra::Matrix3;
use stylet_mesh::{CellId, SimplexMesh, VertexId};

/// The least radius, in edges of the mesh at the tip: within less there is but the dent.
const LEAST: f64 = 1.0;

impl<M: Hyperelastic<3>> Insertion<M> {
    /// The deformation gradient around the tip of needle `k`, which is at `vertex` with `cell` before it: the mean over the
    /// undeformed body with weights `(1 - r² / R²)²` at the distance `r` from the tip; `None` if there is no volume.
    ///
    /// The theory of a beam in an elastic bed has the path of a tip go along the needle in a body at rest, whose springs are
    /// strained by the needle alone. Here the springs are the tissue around the needle, and what is at rest, or is moved by
    /// others, is the tissue at a distance: `R = (4 EI / E)^(1/4)`, the length over which the bed bends the needle. The cells
    /// at the tip would not do: force and bevel strain them by what depends on their size and shape.
    pub(super) fn ambient_gradient(&mut self, k: usize, vertex: VertexId, cell: CellId) -> Option<Matrix3<f64>> {
        let young = self.body.material_of(cell).map_or(f64::NAN, young_at_rest);
        let bends = (4.0 * self.needles[k].settings.stiffness.bending / young).powf(0.25);
        let (mesh, cells, seen) = (&self.mesh, &mut self.star, &mut self.seen);
        mesh.star(vertex, cells);
        let edge = cells.iter().map(|&cell| mesh.longest_edge(cell)).fold(0.0, f64::max);
        // Without stiffness there is no length but the edge.
        let radius = if bends.is_finite() { bends.max(LEAST * edge) } else { LEAST * edge };
        if seen.len() < mesh.n_slots() {
            seen.resize(mesh.n_slots(), false);
        }
        let mean = mean_within(&self.body, mesh, &self.state.u, (&mesh.point(vertex), radius), cells, seen);
        // Only what has been seen is forgotten: the cost follows the radius, not the mesh.
        cells.iter().for_each(|cell| seen[cell.index()] = false);
        mean
    }
}

/// The weighted mean of the deformation gradient in a ball around a place. The search goes from neighbour to neighbour:
/// `cells` are those to begin with, and all that were looked at in the end, which are the ones marked in `seen`.
fn mean_within<M: Hyperelastic<3>>(
    body: &Body<3, 4, M>,
    mesh: &SimplexMesh<3, 4>,
    u: &[f64],
    (centre, radius): (&[f64; 3], f64),
    cells: &mut Vec<CellId>,
    seen: &mut [bool],
) -> Option<Matrix3<f64>> {
    cells.iter().for_each(|cell| seen[cell.index()] = true);
    let (mut sum, mut volume, mut next) = (Matrix3::zeros(), 0.0, 0);
    while let Some(&cell) = cells.get(next) {
        next += 1;
        let weight = 1.0 - distance_squared(mesh, cell, centre) / (radius * radius);
        if weight <= 0.0 {
            continue;
        }
        let part = weight * weight * mesh.volume(cell);
        sum += part * body.deformation_gradient(cell, u)?;
        volume += part;
        let neighbours = (0..4).filter_map(|facet| mesh.neighbor(cell, facet));
        cells.extend(neighbours.filter(|cell| !std::mem::replace(&mut seen[cell.index()], true)));
    }
    (volume > 0.0).then(|| sum / volume)
}

/// Square of the distance of the middle of a cell.
fn distance_squared(mesh: &SimplexMesh<3, 4>, cell: CellId, from: &[f64; 3]) -> f64 {
    let corners = mesh.corners(cell);
    (0..3).map(|i| (corners.iter().map(|x| 0.25 * x[i]).sum::<f64>() - from[i]).powi(2)).sum()
}

/// Young's modulus at rest, Pa.
fn young_at_rest(material: &impl Hyperelastic<3>) -> f64 {
    let mut df = Matrix3::zeros();
    df[(0, 0)] = 1.0;
    let dp = material.stress_differential(&Matrix3::identity(), &df);
    let (lambda, mu) = (dp[(1, 1)], 0.5 * (dp[(0, 0)] - dp[(1, 1)]));
    mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{FixedCorotated, Linear, StableNeoHookean};

    #[test]
    fn laws_have_the_modulus_that_they_are_made_of() {
        let of = |found: f64| assert!((found / 15e3 - 1.0).abs() < 1e-12, "{found}");
        of(young_at_rest(&FixedCorotated::from_young_poisson(15e3, 0.45).unwrap()));
        of(young_at_rest(&Linear::from_young_poisson(15e3, 0.3).unwrap()));
        of(young_at_rest(&StableNeoHookean::from_young_poisson(15e3, 0.49).unwrap()));
    }
}
