//! What is said when a step cannot be made, and where the needles are.

use super::Run;
use stylet_mesh::{CellId, VertexId};
use stylet_physics::insertion::{InsertionError, Needle};
use stylet_tissue::RunError;

/// How far behind the surface of a region a vertex on its border may lie, by mean edges.
const SURFACE_SLACK: f64 = 0.05;

impl Run {
    /// What went wrong, with where the needles are.
    pub(super) fn failure(&self, error: &InsertionError) -> RunError {
        let place = |(k, needle): (usize, &Needle)| format!("needle {} has {}", k + 1, tip_of(needle));
        let places: Vec<String> = self.insertion.needles().iter().enumerate().map(place).collect();
        let what = match error {
            // There is no tissue near a tip in the air.
            InsertionError::SleeveAtSkin { needle, length } if self.insertion.needles()[*needle].nodes().is_empty() => {
                let needle = needle + 1;
                format!(
                    "needle {needle} is pulled back until {length:.3e} m of it are out of its sleeve, too little to go on"
                )
            }
            _ => error.to_string(),
        };
        RunError::Step { step: self.steps + 1, reason: format!("{what}; {}", places.join("; ")) }
    }

    /// Refuses a tip that has come into a region that is fixed: bone is not cut, and the forces of a run that goes on in it
    /// mean nothing.
    pub(super) fn check_tips(&self) -> Result<(), RunError> {
        for (k, needle) in self.insertion.needles().iter().enumerate() {
            let Some(node) = needle.nodes().last() else { continue };
            if let Some(region) = self.fixed_region_at(VertexId(node.vertex)) {
                let reason = format!(
                    "needle {} has come into region {region}, which is fixed, with {}: expected a way through tissue that gives",
                    k + 1,
                    tip_of(needle)
                );
                return Err(RunError::Step { step: self.steps + 1, reason });
            }
        }
        Ok(())
    }

    /// The fixed region that a vertex is in. One on its border, where a needle may pass, is in it where it lies behind its
    /// surface by more than the mesh may be off.
    fn fixed_region_at(&self, vertex: VertexId) -> Option<&str> {
        let (mesh, regions) = (self.insertion.mesh(), &self.opened.geometry.regions);
        let mut star = Vec::new();
        mesh.star(vertex, &mut star);
        let region_of = |cell: &CellId| mesh.region(*cell) as usize;
        let region = star.iter().map(region_of).find(|&region| regions[region].fixed)?;
        // Surfaces of what is held are in the order of the regions.
        let surface = regions[..region].iter().filter(|region| region.fixed).count();
        let slack = SURFACE_SLACK * self.opened.geometry.mean_edge();
        let is_inside = star.iter().all(|cell| regions[region_of(cell)].fixed)
            || self.opened.fixed[surface].distance(&mesh.point(vertex)) < -slack;
        is_inside.then_some(regions[region].name.as_str())
    }
}

/// Where the tip of a needle is, in words.
fn tip_of(needle: &Needle) -> String {
    let ([x, y, z], node) = (needle.shaft.tip(), needle.shaft.n_nodes() - 1);
    format!("its tip, node {node}, at ({x:.4}, {y:.4}, {z:.4}) m, {:.4} m deep", needle.depth())
}
