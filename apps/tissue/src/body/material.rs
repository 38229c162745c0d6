//! Materials by region: `[material]` and the rows of `[[region]]`.

use super::keys::TABLE;
use super::scene::{MaterialStage, Scene};
use stylet_physics::material::{Linear, Solid, Viscosity};
use stylet_scene::{Key, Row};

/// A law with the density that belongs to it.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Tissue {
    pub law: Solid,
    pub model: String,
    pub young: f64,
    pub poisson: f64,
    pub density: f64,
    pub viscosity: Option<Viscosity>,
}

/// Checks a row of `[[region]]`, as far as it can be checked alone.
pub(super) fn check_row(row: &Row) -> Result<(), String> {
    let places = ["tag", "group", "box"].iter().filter(|name| row.value(name).is_some()).count();
    if places > 1 {
        return Err("found more than one of tag, group and box, expected at most one".into());
    }
    Ok(())
}

/// The tissues of a scene: that of `[material]`, then one for each `[[region]]`.
///
/// # Errors
/// Keys, what was found and what was expected.
pub(super) fn tissues(scene: &Scene) -> Result<Vec<Tissue>, String> {
    let base = &scene.material;
    let mut tissues = vec![tissue(base).map_err(|reason| format!("material: {reason}"))?];
    for (index, row) in scene.regions.iter().enumerate() {
        let number = |name: &str, otherwise: Option<f64>| row.get(name).or(otherwise);
        let model = row.value("model").and_then(|value| value.text().ok()).map(str::to_owned);
        let own = MaterialStage {
            model: model.or_else(|| base.model.clone()),
            young: number("young", base.young),
            poisson: number("poisson", base.poisson),
            density: number("density", base.density),
            damping_time: number("damping_time", base.damping_time),
            plane: base.plane,
        };
        tissues.push(tissue(&own).map_err(|reason| format!("region (row {}): {reason}", index + 1))?);
    }
    Ok(tissues)
}

/// A line for each key of `[material]` that no cell takes, because the `[[region]]` of each has its own. `in_use` says of
/// what is in no region, and of each region, whether it has cells.
pub(super) fn idle_keys(scene: &Scene, in_use: &[bool]) -> Vec<String> {
    let idle = |key: &Key<Scene>| {
        let name = key.path.strip_prefix("material.").filter(|name| *name != "plane")?;
        let value = (key.get)(scene)?;
        let own = |region: usize| region > 0 && scene.regions[region - 1].value(name).is_some();
        let taken = (0..in_use.len()).any(|region| in_use[region] && !own(region));
        (!taken).then(|| {
            format!("{}: {value} is without effect: every cell is in a [[region]] with {name} of its own", key.path)
        })
    };
    TABLE.keys.iter().filter_map(idle).collect()
}

fn tissue(stage: &MaterialStage) -> Result<Tissue, String> {
    let model = stage.model.clone().unwrap_or_else(|| MaterialStage::MODEL.to_owned());
    let young = stage.young.unwrap_or(MaterialStage::YOUNG);
    let poisson = stage.poisson.unwrap_or(MaterialStage::POISSON);
    let density = stage.density.unwrap_or(MaterialStage::DENSITY);
    let law = Solid::from_young_poisson(&model, young, poisson).map_err(|e| e.to_string())?;
    let viscosity = match stage.damping_time.unwrap_or(0.0) {
        0.0 => None,
        time => Some(Viscosity::kelvin_voigt(law.lame(), time).map_err(|e| e.to_string())?),
    };
    Ok(Tissue { law, model, young, poisson, density, viscosity })
}

/// The laws by region, if all of them are linear: a body of constant stiffness, which is assembled once.
pub(super) fn all_linear(tissues: &[Tissue]) -> Option<Vec<(u32, Linear)>> {
    let linear = |(index, tissue): (usize, &Tissue)| match tissue.law {
        Solid::Linear(law) => Some((index as u32, law)),
        _ => None,
    };
    tissues.iter().enumerate().map(linear).collect()
}
