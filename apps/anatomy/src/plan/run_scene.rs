//! The scene by which `stylet run` takes a mesh.

use super::Plan;
use crate::shapes::Material;
use std::fmt::Write as _;

/// Standard gravity as the built-in scenes have it, m/s².
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

impl Plan {
    /// A scene for `stylet run`: the mesh file, each region with its material, what is fixed, and gravity along `-z`. Regions
    /// are found in the file by name, or by number in one that has no names.
    pub fn run_scene(&self, mesh_file: &str, has_names: bool) -> String {
        let mut text = format!(
            "# Made with the mesh: materials by region, held where it is fixed, under its weight.\n[mesh]\nfile = {mesh_file:?}\n"
        );
        text.push_str("\n[statics]\n\n[material]\n");
        if let Some(background) = &self.background {
            write_material(&mut text, background);
        }
        for (number, organ) in self.organs.iter().enumerate() {
            let _ = write!(text, "\n[[region]]\nname = {:?}\n", organ.name);
            if !has_names {
                let _ = writeln!(text, "tag = {number}");
            }
            write_material(&mut text, &organ.material);
        }
        for organ in self.organs.iter().filter(|organ| organ.fixed) {
            let _ = write!(text, "\n[[constraint]]\nregion = {:?}\n", organ.name);
        }
        if !self.organs.iter().any(|organ| organ.fixed) {
            text.push_str(
                "\n# Nothing in the mesh is fixed: the lowest side is held.\n[[constraint]]\nside = \"bottom\"\n",
            );
        }
        let _ = write!(text, "\n[[load]]\ngravity = {GRAVITY:?}\n");
        text
    }
}

fn write_material(text: &mut String, material: &Material) {
    if let Some(model) = &material.model {
        let _ = writeln!(text, "model = {model:?}");
    }
    for (name, value) in [("young", material.young), ("poisson", material.poisson), ("density", material.density)] {
        if let Some(value) = value {
            let _ = writeln!(text, "{name} = {value:?}");
        }
    }
}
