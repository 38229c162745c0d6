//! Forces between needle and tissue as fields: by region, and in the layers of skins and capsules.

use crate::geometry::{Geometry, Surface};
use crate::keys::name_of;
use crate::scene::{FrictionStage, Scene};
use stylet_physics::insertion::Interaction;

/// How far outside a surface a tip still counts as in the layer below it, m: tips enter at facets of the mesh.
const OUTSIDE: f64 = 1e-5;

/// Forces of a scene.
#[derive(Clone)]
pub struct Fields {
    by_region: Vec<FrictionStage>,
    membranes: Vec<Membrane>,
}

#[derive(Clone)]
struct Membrane {
    surface: Surface,
    thickness: f64,
    cutting: f64,
}

impl Fields {
    /// The forces of a scene.
    ///
    /// # Errors
    /// A region that there is not: the key, what was found and what was expected.
    pub fn of(scene: &Scene, geometry: &Geometry) -> Result<Self, String> {
        let mut by_region = vec![scene.friction; geometry.regions.len()];
        for (index, row) in scene.friction_regions.iter().enumerate() {
            let named = |reason| format!("friction.region (row {}): name: {reason}", index + 1);
            let own = &mut by_region[geometry.region(name_of(row)).map_err(named)?];
            own.per_length = row.get("per_length").unwrap_or(own.per_length);
            own.viscosity = row.get("viscosity").unwrap_or(own.viscosity);
            own.cutting = row.get("cutting").unwrap_or(own.cutting);
        }
        let membrane = |(index, row): (usize, &stylet_scene::Row)| {
            let of = row.value("of").map_or(Ok(""), |value| value.text())?;
            let named = |reason| format!("friction.membrane (row {}): of: {reason}", index + 1);
            let number = |name: &str| row.get(name).unwrap_or(0.0);
            let surface = geometry.surface(of).map_err(named)?;
            Ok(Membrane { surface, thickness: number("thickness"), cutting: number("cutting") })
        };
        let membranes: Result<_, String> = scene.membranes.iter().enumerate().map(membrane).collect();
        Ok(Self { by_region, membranes: membranes? })
    }

    fn of_region(&self, region: u32) -> FrictionStage {
        self.by_region.get(region as usize).copied().unwrap_or_default()
    }
}

impl Interaction for Fields {
    fn friction(&self, region: u32, _: &[f64; 3]) -> f64 {
        self.of_region(region).per_length
    }

    fn viscosity(&self, region: u32, _: &[f64; 3]) -> f64 {
        self.of_region(region).viscosity
    }

    fn cutting(&self, region: u32, at: &[f64; 3]) -> f64 {
        let within = |membrane: &&Membrane| {
            let distance = membrane.surface.distance(at);
            (-membrane.thickness..=OUTSIDE).contains(&distance)
        };
        let forces = self.membranes.iter().filter(within).map(|membrane| membrane.cutting);
        forces.fold(self.of_region(region).cutting, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_scene::{Row, Value};

    #[test]
    fn a_skin_is_a_layer_below_the_surface() {
        let mut scene = Scene::default();
        let mut skin: Row = [("thickness", 1e-3), ("cutting", 5.0)].into_iter().collect();
        skin.set("of", Value::Text("body".into()));
        scene.membranes.push(skin);
        let geometry = Geometry::of(&scene).unwrap();
        let fields = Fields::of(&scene, &geometry).unwrap();
        let forces = [-1e-9, 0.0, 0.5e-3, 0.99e-3, 1.01e-3, 0.05].map(|x| fields.cutting(0, &[x, 0.05, 0.05]));
        assert_eq!(forces, [5.0, 5.0, 5.0, 5.0, 1.0, 1.0]);
        assert_eq!((fields.friction(0, &[0.0; 3]), fields.viscosity(0, &[0.0; 3])), (12.0, 200.0));
        scene.membranes[0].set("of", Value::Text("bone".into()));
        let reason = Fields::of(&scene, &geometry).err().unwrap();
        assert!(
            reason.starts_with("friction.membrane (row 1): of: found region bone, expected one of tissue"),
            "{reason}"
        );
    }
}
