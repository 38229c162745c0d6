//! From a scene and its mesh to what a solve needs.

use super::constraint::Held;
use super::geometry::Geometry;
use super::load::Force;
use super::material::{Tissue, idle_keys, tissues};
use super::scene::{PlaneKind, Scene};
use crate::error::RunError;
use crate::stages::{Stage, Stages};
use std::time::Instant;
use stylet_physics::statics::{Finding, examine_constraints, examine_load, examine_material};
use stylet_solver::subspace::Subspace;

/// Constraints, loads and materials, by node and region.
pub(super) struct Setup<const D: usize> {
    pub held: Vec<Held<D>>,
    pub forces: Vec<Force>,
    pub tissues: Vec<Tissue>,
    /// What looks wrong, a line each.
    pub warnings: Vec<String>,
}

impl<const D: usize> Setup<D> {
    /// Picks nodes and distributes loads.
    ///
    /// # Errors
    /// [`RunError::Inconsistent`] names the row, the column, what was found and what was expected; a static scene with a part
    /// that nothing holds is one.
    pub fn new<const N: usize>(
        scene: &Scene,
        geometry: &Geometry<D, N>,
        stages: &mut Stages,
    ) -> Result<Self, RunError> {
        let refuse = |reason: String| RunError::Inconsistent { source_name: scene.label.clone(), reason };
        let since = Instant::now();
        let tissues = tissues(scene).map_err(refuse)?;
        let mut held = Vec::new();
        for (index, row) in scene.constraints.iter().enumerate() {
            let one = Held::of(row, geometry, &scene.regions);
            held.push(one.map_err(|reason| refuse(format!("constraint (row {}): {reason}", index + 1)))?);
        }
        let since = stages.lap(Stage::Constrain, since);
        let mut forces = Vec::new();
        for (index, row) in scene.loads.iter().enumerate() {
            let one = Force::of(row, geometry, &scene.regions, &tissues, scene.mesh.thickness);
            forces.push(one.map_err(|reason| refuse(format!("load (row {}): {reason}", index + 1)))?);
        }
        stages.lap(Stage::Load, since);
        let mut setup = Self { held, forces, tissues, warnings: Vec::new() };
        if scene.statics.is_some()
            && let Some(finding) = examine_constraints(&geometry.mesh, &setup.subspace(geometry, 0.0)).first()
        {
            return Err(refuse(format!("constraint: {finding}; expected constraints that leave no rigid motion free")));
        }
        setup.warnings = setup.look(scene, geometry);
        Ok(setup)
    }

    /// What nodes may do at time `t`.
    pub fn subspace<const N: usize>(&self, geometry: &Geometry<D, N>, t: f64) -> Subspace<D> {
        let mut subspace = Subspace::new(geometry.mesh.n_vertex_slots());
        self.held.iter().filter(|held| held.is_there(t)).for_each(|held| held.restrict(&mut subspace));
        subspace
    }

    /// Writes the load (N, flat) at time `t`.
    pub fn load(&self, t: f64, load: &mut [f64]) {
        load.fill(0.0);
        for force in self.forces.iter().filter(|force| t < force.until) {
            load.iter_mut().zip(&force.nodal).for_each(|(load, force)| *load += force);
        }
    }

    /// Writes into `u` (m, flat) where prescribed nodes are at time `t` of `end`.
    pub fn prescribe(&self, points: &[[f64; D]], t: f64, end: f64, u: &mut [f64]) {
        self.held.iter().filter(|held| held.is_there(t)).for_each(|held| held.prescribe(points, t, end, u));
    }

    /// Whether any node is taken anywhere.
    pub fn moves(&self) -> bool {
        self.held.iter().any(Held::moves)
    }

    fn look<const N: usize>(&self, scene: &Scene, geometry: &Geometry<D, N>) -> Vec<String> {
        let mut load = vec![0.0; D * geometry.mesh.n_vertex_slots()];
        self.load(0.0, &mut load);
        let mut in_use = vec![false; self.tissues.len()];
        geometry.mesh.cells().for_each(|cell| in_use[geometry.mesh.region(cell) as usize] = true);
        // A tissue without cells neither gives way nor locks.
        let used = || self.tissues.iter().zip(&in_use).filter(|(_, in_use)| **in_use).map(|(tissue, _)| tissue);
        let softest = used().map(|tissue| tissue.young).fold(f64::INFINITY, f64::min);
        let poisson = used().map(|tissue| tissue.poisson).fold(-1.0, f64::max);
        let strain = examine_load(&geometry.mesh, scene.mesh.thickness, softest, &load);
        // A sheet has room for its volume in its thickness.
        let thin = D == 2 && scene.material.plane != Some(PlaneKind::Strain);
        let locking = if thin { None } else { examine_material(poisson) };
        let findings = strain.into_iter().chain(locking).map(|finding| name_keys(&finding, softest));
        findings.chain(idle_keys(scene, &in_use)).collect()
    }
}

/// A finding with the keys that may be wrong.
fn name_keys(finding: &Finding, young: f64) -> String {
    match finding {
        Finding::AbsurdStrain { .. } => format!(
            "{finding}; check the units of material.young = {young} Pa, material.density, mesh.size or mesh.file (m), and load"
        ),
        Finding::Locking { .. } => format!("material.poisson: {finding}"),
        _ => finding.to_string(),
    }
}
