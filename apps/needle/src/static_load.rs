//! A static load along a line: the needle's force density applied at once (section 6.8 of Nienhuys, 2003).

use crate::error::NeedleError;
use crate::motion::Pose;
use crate::needle::Needle;
use crate::relocate;
use crate::scene::{Distribution, LoadStage, NeedleStage, Scene};
use crate::slab::{Slab, mesh_error, solve_error};
use crate::stages::{Stage, Stages};
use crate::tip::{Tip, find_in_reference, follow};
use std::time::Instant;
use stylet_mesh::VertexId;
use stylet_physics::body::segment_load;
use stylet_physics::friction::LineDensity;
use stylet_physics::material::Hyperelastic;

/// A slab or a cube under the load of a needle that is in place.
#[derive(Clone)]
pub struct StaticLoad<const D: usize, const N: usize, M: Hyperelastic<D>> {
    /// The tissue.
    pub slab: Slab<D, N, M>,
    /// The needle.
    pub needle: Needle<D>,
    /// Nodes on the needle, from the entry to the tip.
    pub nodes: Vec<VertexId>,
    /// Whether the equilibrium has been found.
    pub solved: bool,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> StaticLoad<D, N, M> {
    /// Refines a slab along the needle, finds the needle nodes, relocates them if asked, and puts the load on.
    ///
    /// # Errors
    /// [`NeedleError`] if a layer below refuses.
    pub fn new(
        scene: &Scene,
        stage: &NeedleStage,
        load: &LoadStage,
        mut slab: Slab<D, N, M>,
        stages: &mut Stages,
    ) -> Result<Self, NeedleError> {
        let mut needle = stage.needle();
        let entry = needle.tip();
        needle.set_pose(Pose { insert: stage.depth, sleeve: 0.0 });
        let since = Instant::now();
        slab.refine_along(entry, needle.tip(), scene.mesh.longest_edge_around_needle())?;
        let since = stages.lap(Stage::Refine, since);
        let nodes = nodes_along(&slab, entry, &needle);
        let mut since = stages.lap(Stage::Capture, since);
        if stage.relocate {
            for &vertex in &nodes {
                let mut place = needle.frame_of(slab.mesh.point(vertex));
                place.perpendicular = 0.0;
                relocate::onto_needle(&mut slab, vertex, needle.point_at(place))?;
            }
            since = stages.lap(Stage::Relocate, since);
        }
        let density = stage.line_density().map_err(|e| solve_error(0, e.to_string()))?;
        match load.distribution {
            Distribution::Lumped => lumped(&mut slab, &needle, &nodes, &density),
            Distribution::Consistent => {
                let (start, end) = (needle.base(), needle.tip());
                let profile = from_entry(&density, stage.depth);
                segment_load(&slab.mesh, &start, &end, &profile, &needle.tangent(), &mut slab.load)
                    .map_err(|e| mesh_error(0, e))?;
            }
        }
        stages.lap(Stage::Load, since);
        Ok(Self { slab, needle, nodes, solved: false })
    }

    /// Finds the equilibrium. Returns the iterations.
    ///
    /// # Errors
    /// [`NeedleError`] if the method fails.
    pub fn solve(&mut self, stages: &mut Stages) -> Result<u64, NeedleError> {
        let since = Instant::now();
        let outcome = self.slab.solve(1, stages)?;
        stages.lap(Stage::Solve, since);
        self.solved = true;
        Ok(outcome.iterations)
    }
}

/// The density by distance from the entry, for a needle of this depth: its points from the entry to the tip.
fn from_entry(density: &LineDensity, depth: f64) -> Vec<(f64, f64)> {
    let corners = density.rows().iter().map(|row| row.0).filter(|&behind| behind > 0.0 && behind < depth);
    let mut behind: Vec<f64> = corners.collect();
    behind.insert(0, 0.0);
    behind.push(depth);
    behind.iter().rev().map(|&s| (depth - s, density.at(s))).collect()
}

/// The closest node of each facet that the needle crosses, and of the facet that the tip lies on, from the entry to the tip.
fn nodes_along<const D: usize, const N: usize, M: Hyperelastic<D>>(
    slab: &Slab<D, N, M>,
    entry: [f64; D],
    needle: &Needle<D>,
) -> Vec<VertexId> {
    let rest = vec![0.0; slab.u.len()];
    let mut crossed = Vec::new();
    let mut tip = follow(&slab.mesh, &rest, Tip::Outside(entry), needle.tip(), &mut crossed);
    // A needle that lies on a side of the slab crosses no facet on its way in, yet follows facets from there on.
    if matches!(tip, Tip::Outside(_))
        && crossed.is_empty()
        && let Some(inside) = find_in_reference(&slab.mesh, slab.mesh.cells(), entry)
    {
        let nearest = (0..N).max_by(|&i, &j| inside.barycentric[i].total_cmp(&inside.barycentric[j])).unwrap_or(0);
        crossed.push(slab.mesh.cell(inside.cell)[nearest]);
        tip = follow(&slab.mesh, &rest, Tip::Inside(inside), needle.tip(), &mut crossed);
    }
    if let Tip::Inside(inside) = tip {
        let vertices = slab.mesh.cell(inside.cell);
        let on_facet = (0..N).find(|&k| inside.barycentric[k].abs() <= 1e-9);
        if let Some(facet) = on_facet {
            // The first of several.
            let others = (1..N).rev().map(|step| (facet + step) % N);
            let weight = |corner: usize| inside.barycentric[corner];
            let nearest = vertices[others.max_by(|&i, &j| weight(i).total_cmp(&weight(j))).unwrap_or(facet)];
            if !crossed.contains(&nearest) {
                crossed.push(nearest);
            }
        }
    }
    crossed.sort_by(|&a, &b| {
        let behind = |v| needle.frame_of(slab.mesh.point(v)).behind;
        behind(b).total_cmp(&behind(a))
    });
    crossed
}

/// Density at each node times half the distance to each neighbour along the needle.
fn lumped<const D: usize, const N: usize, M: Hyperelastic<D>>(
    slab: &mut Slab<D, N, M>,
    needle: &Needle<D>,
    nodes: &[VertexId],
    density: &LineDensity,
) {
    let behind: Vec<f64> = nodes.iter().map(|&v| needle.frame_of(slab.mesh.point(v)).behind).collect();
    for (index, &vertex) in nodes.iter().enumerate() {
        let before = if index > 0 { behind[index - 1] - behind[index] } else { 0.0 };
        let after = if index + 1 < nodes.len() { behind[index] - behind[index + 1] } else { 0.0 };
        let force = density.at(behind[index]) * 0.5 * (before + after);
        for k in 0..D {
            slab.load[D * vertex.index() + k] += force * needle.tangent()[k];
        }
    }
}
