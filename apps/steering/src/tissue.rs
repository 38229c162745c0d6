//! Materials by region, and what is held.

use crate::geometry::{Geometry, Region, sides};
use crate::keys::{TABLE, name_of};
use crate::scene::{MaterialStage, PartitionKind, Scene};
use stylet_anatomy::shapes::Material;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{Body, Density, LazyRule, MassKind};
use stylet_physics::material::{Solid, Viscosity};
use stylet_physics::numbering::metis_parts;
use stylet_scene::Row;
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
/// The row, region or key, what was found and what was expected. A key of `[material]` that no region takes is refused:
/// it would be without effect.
pub fn tissues(scene: &Scene, geometry: &Geometry) -> Result<Vec<Tissue>, String> {
    for (index, row) in scene.regions.iter().enumerate() {
        geometry.region(name_of(row)).map_err(|reason| format!("region (row {}): name: {reason}", index + 1))?;
    }
    every_key_acts(scene, &geometry.regions)?;
    let base = &scene.material;
    let tissue = |region: &Region| {
        let (row, own) = (row_of(scene, region), &region.material);
        let number = |name: &str, of_shape: Option<f64>, of_scene: Option<f64>, otherwise: f64| {
            row.and_then(|row| row.get(name)).or(of_shape).or(of_scene).unwrap_or(otherwise)
        };
        let word = row.and_then(|row| row.value("model")?.text().ok());
        let model = word.or(own.model.as_deref()).or(base.model.as_deref()).unwrap_or(MaterialStage::MODEL);
        let young = number("young", own.young, base.young, MaterialStage::YOUNG);
        let poisson = number("poisson", own.poisson, base.poisson, MaterialStage::POISSON);
        let law = Solid::from_young_poisson(model, young, poisson).map_err(|error| error.to_string())?;
        let damping_time = number("damping_time", None, base.damping_time, MaterialStage::DAMPING_TIME);
        let viscosity = match damping_time {
            0.0 => None,
            time => Some(Viscosity::kelvin_voigt(law.lame(), time).map_err(|error| error.to_string())?),
        };
        let fixed = row.and_then(|row| row.value("fixed")?.bool().ok()).unwrap_or(region.fixed);
        let density = number("density", own.density, base.density, MaterialStage::DENSITY);
        Ok(Tissue { law, density, damping_time, viscosity, fixed })
    };
    let named = |region: &Region| tissue(region).map_err(|reason: String| format!("region {}: {reason}", region.name));
    geometry.regions.iter().map(named).collect()
}

/// The row of `[[region]]` that a region follows: the last one of its name.
fn row_of<'a>(scene: &'a Scene, region: &Region) -> Option<&'a Row> {
    scene.regions.iter().rev().find(|row| name_of(row) == region.name)
}

/// Refuses a key of `[material]` that no region takes, because rows of `[[region]]` and the shape come first.
fn every_key_acts(scene: &Scene, regions: &[Region]) -> Result<(), String> {
    for key in TABLE.keys {
        let Some(name) = key.path.strip_prefix("material.") else { continue };
        let Some(value) = (key.get)(scene) else { continue };
        let by_row = |region: &Region| row_of(scene, region).is_some_and(|row| row.value(name).is_some());
        if regions.iter().any(|region| !by_row(region) && !says(&region.material, name)) {
            continue;
        }
        let source = match &scene.mesh.shape {
            Some(shape) if !regions.iter().all(by_row) => format!("shape {shape}"),
            _ => "[[region]]".to_owned(),
        };
        let free = regions.iter().find(|region| !region.fixed).map_or("", |region| &region.name);
        return Err(format!(
            "{}: found {value}, but {source} comes first and has {name} for every region; expected it by region, \
             such as region = [{{ name = {free:?}, {name} = {value} }}]",
            key.path
        ));
    }
    Ok(())
}

/// Whether a shape says this of a region's material.
fn says(material: &Material, name: &str) -> bool {
    match name {
        "model" => material.model.is_some(),
        "young" => material.young.is_some(),
        "poisson" => material.poisson.is_some(),
        "density" => material.density.is_some(),
        _ => false,
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball in a box; it leaves its density to the shape's `[material]`, and nothing says a model.
    const SHAPE: &str = "
        domain = { low = [0, 0, 0], high = [1, 1, 1], size = 0.25 }
        material = { young = 3e4, density = 970 }
        [[shape]]
        name = 'ball'
        kind = 'sphere'
        centre = [0.5, 0.5, 0.5]
        radius = 0.3
        [[region]]
        name = 'ball'
        shape = 'ball'
        young = 1e4
        poisson = 0.4
    ";

    /// The tissues of ball and background, with this below the mesh of the scene.
    fn of(text: &str) -> Result<Vec<Tissue>, String> {
        let name = format!("stylet-tissues-{}-{:?}", std::process::id(), std::thread::current().id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("ball.toml"), SHAPE).unwrap();
        let mut scene = Scene { folder, ..Scene::default() };
        TABLE.read("s.toml", &format!("[mesh]\nshape = 'ball.toml'\n{text}"), &mut scene).unwrap();
        let geometry = Geometry::of(&scene).unwrap();
        std::fs::remove_dir_all(&scene.folder).unwrap();
        tissues(&scene, &geometry)
    }

    /// Young's modulus and Poisson's ratio.
    fn law(tissue: &Tissue) -> (f64, f64) {
        let lame = tissue.law.lame();
        (lame.young(), 0.5 * lame.lambda() / (lame.lambda() + lame.mu()))
    }

    #[track_caller]
    fn close(found: (f64, f64), expected: (f64, f64)) {
        let off = (found.0 / expected.0 - 1.0).abs().max((found.1 - expected.1).abs());
        assert!(off < 1e-12, "found {found:?}, expected {expected:?}");
    }

    #[test]
    fn rows_come_before_the_shape_and_the_shape_before_the_scene() {
        let plain = of("").unwrap();
        close(law(&plain[0]), (1e4, 0.4));
        // The background, and what the shape does not say of it.
        close(law(&plain[1]), (3e4, MaterialStage::POISSON));
        // What a region of the shape leaves out is that of the shape's own [material].
        assert_eq!((plain[0].density, plain[1].density), (970.0, 970.0));
        assert_eq!(plain[0].law.model(), MaterialStage::MODEL);

        let scene = of("[material]\npoisson = 0.2\nmodel = 'linear'\ndamping_time = 0.5").unwrap();
        close(law(&scene[0]), (1e4, 0.4));
        close(law(&scene[1]), (3e4, 0.2));
        assert_eq!((scene[0].law.model(), scene[0].damping_time), ("linear", 0.5));

        let rows = of("[[region]]\nname = 'ball'\nyoung = 5e3\npoisson = 0.1\ndensity = 900").unwrap();
        close(law(&rows[0]), (5e3, 0.1));
        assert_eq!((rows[0].density, rows[1].density), (900.0, 970.0));
    }

    #[test]
    fn a_key_without_effect_is_refused() {
        let by_shape = of("[material]\nyoung = 2e4").unwrap_err();
        assert_eq!(
            by_shape,
            "material.young: found 20000.0, but shape ball.toml comes first and has young for every region; expected it \
             by region, such as region = [{ name = \"ball\", young = 20000.0 }]"
        );
        // The shape says the ball's, a row that of the background.
        let rows = "[[region]]\nname = 'background'\npoisson = 0.3\n";
        let by_both = of(&format!("{rows}[material]\npoisson = 0.49")).unwrap_err();
        assert!(by_both.starts_with("material.poisson: found 0.49, but shape ball.toml comes first"), "{by_both}");
        let rows = "[[region]]\nname = 'ball'\nmodel = 'linear'\n[[region]]\nname = 'background'\nmodel = 'linear'\n";
        let by_rows = of(&format!("{rows}[material]\nmodel = 'corotated'")).unwrap_err();
        assert!(by_rows.starts_with("material.model: found \"corotated\", but [[region]] comes first"), "{by_rows}");
    }
}
