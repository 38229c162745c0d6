//! Materials by region, and what is held.

use crate::geometry::{Geometry, sides};
use crate::keys::name_of;
use crate::scene::{PartitionKind, Scene};
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{Body, Density, LazyRule, MassKind};
use stylet_physics::material::{Solid, Viscosity};
use stylet_physics::numbering::metis_parts;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// What a region is made of.
#[derive(Clone, PartialEq, Debug)]
pub struct Tissue {
    /// The law.
    pub law: Solid,
    /// kg/m^3.
    pub density: f64,
    /// Viscosity over elasticity, s.
    pub damping_time: f64,
    /// None where it has no viscosity.
    pub viscosity: Option<Viscosity>,
    /// Whether its nodes are held.
    pub fixed: bool,
}

/// The tissues of a scene, in the order of the regions: by `[[region]]`, else by the shape, else by `[material]`.
///
/// # Errors
/// The row or region, what was found and what was expected.
pub fn tissues(scene: &Scene, geometry: &Geometry) -> Result<Vec<Tissue>, String> {
    for (index, row) in scene.regions.iter().enumerate() {
        geometry.region(name_of(row)).map_err(|reason| format!("region (row {}): name: {reason}", index + 1))?;
    }
    let base = &scene.material;
    let tissue = |region: &crate::geometry::Region| {
        let row = scene.regions.iter().rev().find(|row| name_of(row) == region.name);
        let number = |name: &str, of_shape: Option<f64>, otherwise: f64| {
            row.and_then(|row| row.get(name)).or(of_shape).unwrap_or(otherwise)
        };
        let own = &region.material;
        let word = row.and_then(|row| row.value("model")?.text().ok());
        let model = word.or(own.model.as_deref()).unwrap_or(&base.model);
        let (young, poisson) = (number("young", own.young, base.young), number("poisson", own.poisson, base.poisson));
        let law = Solid::from_young_poisson(model, young, poisson).map_err(|error| error.to_string())?;
        let damping_time = number("damping_time", None, base.damping_time);
        let viscosity = match damping_time {
            0.0 => None,
            time => Some(Viscosity::kelvin_voigt(law.lame(), time).map_err(|error| error.to_string())?),
        };
        let fixed = row.and_then(|row| row.value("fixed")?.bool().ok()).unwrap_or(region.fixed);
        let density = number("density", own.density, base.density);
        Ok(Tissue { law, density, damping_time, viscosity, fixed })
    };
    let named = |region: &crate::geometry::Region| {
        tissue(region).map_err(|reason: String| format!("region {}: {reason}", region.name))
    };
    geometry.regions.iter().map(named).collect()
}

/// The damping time of all tissue, s, if the stiffness times that is to stand for viscosity: it costs no evaluation.
#[must_use]
pub fn common_damping(tissues: &[Tissue], scene: &Scene) -> Option<f64> {
    let first = tissues.first()?.damping_time;
    let same = tissues.iter().all(|tissue| tissue.damping_time == first);
    (scene.time.damping == crate::scene::DampingKind::Tangent && same).then_some(first)
}

/// The body on a mesh, with mass and viscosity.
///
/// # Errors
/// A sentence of the layer that refuses.
pub fn body(
    mesh: &SimplexMesh<3, 4>,
    tissues: &[Tissue],
    scene: &Scene,
    team: &Team,
) -> Result<Body<3, 4, Solid>, String> {
    use crate::scene::LazyWord::{Rotation, Stiffness, Strain};
    let by_region = || tissues.iter().enumerate().map(|(region, tissue)| (region as u32, tissue));
    let laws: Vec<(u32, Solid)> = by_region().map(|(region, tissue)| (region, tissue.law)).collect();
    let densities = by_region().map(|(region, tissue)| (region, tissue.density)).collect();
    let mut body = Body::with_materials(mesh, &laws, 1.0).map_err(|error| format!("body: {error}"))?;
    body.set_team(team);
    body.set_mass(MassKind::Lumped, &Density::ByRegion(densities)).map_err(|error| format!("mass: {error}"))?;
    for (region, tissue) in by_region() {
        if let (Some(viscosity), None) = (tissue.viscosity, common_damping(tissues, scene)) {
            body.set_viscosity(region, viscosity).map_err(|error| format!("damping_time: {error}"))?;
        }
    }
    if scene.time.lazy > 0.0 {
        body.set_lazy_rule(match scene.time.lazy_measure {
            Strain => LazyRule::Strain(scene.time.lazy),
            Stiffness => LazyRule::Stiffness(scene.time.lazy),
            Rotation => LazyRule::Rotation(scene.time.lazy),
        });
    }
    if scene.time.partition == PartitionKind::Metis && team.size() > 1 {
        let parts = metis_parts(mesh, team.size()).map_err(|error| format!("time.partition: {error}"))?;
        body.set_partition(&parts).map_err(|error| format!("time.partition: {error}"))?;
    }
    Ok(body)
}

/// What nodes may do: those of fixed regions and of held sides nothing.
///
/// # Errors
/// A side that there is not; nothing that is held.
pub fn subspace(scene: &Scene, geometry: &Geometry, tissues: &[Tissue]) -> Result<Subspace<3>, String> {
    let mesh = &geometry.mesh;
    let mut held = vec![false; mesh.n_vertex_slots()];
    for cell in mesh.cells().filter(|&cell| tissues[mesh.region(cell) as usize].fixed) {
        mesh.cell(cell).iter().for_each(|v| held[v.index()] = true);
    }
    let sides = sides(&scene.support.sides)?;
    for v in mesh.vertices() {
        held[v.index()] |= sides.iter().any(|&side| geometry.on_side(&mesh.point(v), side));
    }
    if !held.contains(&true) {
        return Err("support.sides: found nothing that is held, expected sides here or regions that are fixed".into());
    }
    let mut subspace = Subspace::new(held.len());
    for node in (0..held.len()).filter(|&node| held[node]) {
        subspace.set(node, Constraint::Fixed).map_err(|error| error.to_string())?;
    }
    Ok(subspace)
}
