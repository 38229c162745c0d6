//! What is said when a step cannot be made: needles counted from 1, as in scene files, and where they are.

use super::Run;
use stylet_mesh::{CellId, VertexId};
use stylet_physics::coupling::CouplingError;
use stylet_physics::insertion::{InsertionError, Needle};
use stylet_tissue::RunError;

/// How far behind the surface of a region a vertex on its border may lie, by mean edges.
const SURFACE_SLACK: f64 = 0.05;

impl Run {
    /// What went wrong, with where the needles are.
    pub(super) fn failure(&self, error: &InsertionError) -> RunError {
        let place = |(k, needle): (usize, &Needle)| {
            let (tip, node) = (needle.shaft.tip(), needle.shaft.n_nodes() - 1);
            format!(
                "needle {} has its tip, node {node}, at ({:.5}, {:.5}, {:.5}) m, {:.5} m deep",
                k + 1,
                tip[0],
                tip[1],
                tip[2],
                needle.depth()
            )
        };
        let places: Vec<String> = self.insertion.needles().iter().enumerate().map(place).collect();
        let what = match error {
            // There is no tissue near a tip in the air.
            InsertionError::SleeveAtSkin { needle, length } if self.insertion.needles()[*needle].nodes().is_empty() => {
                let needle = needle + 1;
                format!(
                    "needle {needle} is pulled back until {length:e} m of it are out of its sleeve, too little to go on"
                )
            }
            _ => named(error),
        };
        RunError::Step { step: self.steps + 1, reason: format!("{what}; {}", places.join("; ")) }
    }

    /// Refuses a tip that has come into a region that is fixed: bone is not cut, and the forces of a run that goes on in it
    /// mean nothing.
    pub(super) fn check_tips(&self) -> Result<(), RunError> {
        for (k, needle) in self.insertion.needles().iter().enumerate() {
            let Some(node) = needle.nodes().last() else { continue };
            if let Some(region) = self.fixed_region_at(VertexId(node.vertex)) {
                let (tip, node) = (needle.shaft.tip(), needle.shaft.n_nodes() - 1);
                let reason = format!(
                    "needle {} has come into region {region}, which is fixed, with its tip, node {node}, at \
                     ({:.4}, {:.4}, {:.4}) m, {:.4} m deep: expected a way through tissue that gives",
                    k + 1,
                    tip[0],
                    tip[1],
                    tip[2],
                    needle.depth()
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

/// An error with needles counted from 1, as in scene files.
pub(super) fn named(error: &InsertionError) -> String {
    let mut named = error.clone();
    match &mut named {
        InsertionError::LeftTissue { needle, at: [x, y, z] } => {
            return format!(
                "needle {} has left the tissue at ({x:.4}, {y:.4}, {z:.4}) m: a needle that comes out again is not followed",
                *needle + 1
            );
        }
        InsertionError::SharedElement { needle, other, .. } => {
            *needle += 1;
            *other += 1;
        }
        InsertionError::Rod { needle, .. }
        | InsertionError::Limits { needle, .. }
        | InsertionError::Remesh { needle, .. }
        | InsertionError::Reparameterise { needle, .. }
        | InsertionError::StartsInside { needle, .. }
        | InsertionError::SleeveAtSkin { needle, .. }
        | InsertionError::InSleeve { needle } => *needle += 1,
        InsertionError::Failed {
            reason:
                CouplingError::Rod { needle, .. }
                | CouplingError::Overrun { needle, .. }
                | CouplingError::Thrown { needle, .. }
                | CouplingError::Shape { needle, .. },
            ..
        } => *needle += 1,
        _ => {}
    }
    named.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_physics::reparameterise::ReparameteriseError;

    #[test]
    fn needles_are_counted_from_one() {
        let overrun = CouplingError::Overrun { needle: 1, node: 4, slip: 1e-3, reach: 1e-4 };
        let error = ReparameteriseError::NotFinite { what: "positions", index: 3 };
        for (error, start) in [
            (InsertionError::InSleeve { needle: 0 }, "needle 1 is pulled back further"),
            (InsertionError::Reparameterise { needle: 0, error }, "needle 1: positions"),
            (
                InsertionError::LeftTissue { needle: 2, at: [0.1, 0.2, 0.3] },
                "needle 3 has left the tissue at (0.1000, 0.2000, 0.3000) m",
            ),
            (InsertionError::SleeveAtSkin { needle: 1, length: 1e-3 }, "needle 2: its sleeve is"),
            (InsertionError::SharedElement { needle: 0, other: 1, cell: 7 }, "needles 1 and 2 share cell 7"),
            (
                InsertionError::Failed { t: 1.0, smallest: 1e-3, reason: overrun },
                "no step from t = 1 s, not even of 1e-3 s: needle 2 slides",
            ),
        ] {
            let line = named(&error);
            assert!(line.starts_with(start), "{line}");
        }
    }
}
