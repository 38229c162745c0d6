//! The scenes that come with the program, and reading scenes from files.

use crate::check;
use crate::error::NeedleError;
use crate::keys::TABLE;
use crate::scene::Scene;
use std::path::Path;

/// A scene that comes with the program.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    /// Its name.
    pub name: &'static str,
    /// What it shows, in a line.
    pub about: &'static str,
    /// Its TOML.
    pub toml: &'static str,
}

/// All scenes that come with the program.
pub const SCENES: &[BuiltIn] = &[
    BuiltIn {
        name: "slab2d-static",
        about: "a static load along the needle's line in an adaptive slab (Fig 6.9 of Nienhuys, 2003)",
        toml: include_str!("../scenes/slab2d-static.toml"),
    },
    BuiltIn {
        name: "slab2d-insertion",
        about: "a needle pushed 70 mm into a slab that refines itself around the tip (Table 6.5)",
        toml: include_str!("../scenes/slab2d-insertion.toml"),
    },
    BuiltIn {
        name: "slab2d-tilted",
        about: "a static load along a line that no mesh edge follows (Table 6.6)",
        toml: include_str!("../scenes/slab2d-tilted.toml"),
    },
    BuiltIn {
        name: "slab2d-sideways",
        about: "a needle pushed sideways into a standing slab: large deformations (Fig 6.12)",
        toml: include_str!("../scenes/slab2d-sideways.toml"),
    },
];

/// The built-in scene of this name.
pub fn built_in(name: &str) -> Option<&'static BuiltIn> {
    SCENES.iter().find(|scene| scene.name == name)
}

/// Reads a built-in scene or a TOML file, with `key=value` assignments on top, and checks that its keys go together.
///
/// # Errors
/// [`NeedleError`] in one line: the file, the key or line, what was found and what was expected.
pub fn open(name_or_path: &str, assignments: &[String]) -> Result<Scene, NeedleError> {
    let (name, source_name, text) = match built_in(name_or_path) {
        Some(scene) => (scene.name.to_owned(), format!("built-in scene {}", scene.name), scene.toml.to_owned()),
        None => {
            let path = Path::new(name_or_path);
            let names: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
            // Whatever has neither a slash nor an ending was meant as a name.
            if !path.exists() && !name_or_path.contains('/') && path.extension().is_none() {
                let nearest = stylet_scene::nearest(name_or_path, names.iter().copied());
                let known = names.join(", ");
                let reason = format!(
                    "found no such scene or file, expected a TOML file or one of {known}; nearest built-in scene is {nearest}"
                );
                return Err(NeedleError::Inconsistent { source_name: name_or_path.to_owned(), reason });
            }
            let text = stylet_scene::load(path)?;
            let stem = path.file_stem().map_or_else(|| "scene".to_owned(), |stem| stem.to_string_lossy().into_owned());
            (stem, name_or_path.to_owned(), text)
        }
    };
    let mut scene = Scene { name, ..Scene::default() };
    TABLE.read(&source_name, &text, &mut scene)?;
    for assignment in assignments {
        TABLE.set(&mut scene, assignment)?;
    }
    check::check(&scene, &source_name)?;
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_scenes_are_sound_and_survive_writing() {
        for built_in in SCENES {
            let scene = open(built_in.name, &[]).unwrap();
            let mut again = Scene { name: scene.name.clone(), ..Scene::default() };
            TABLE.read("written", &TABLE.write(&scene), &mut again).unwrap();
            assert_eq!(scene, again);
        }
    }
}
