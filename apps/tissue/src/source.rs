//! Where the text of a scene comes from: a built-in name or a file.

use crate::error::RunError;
use std::path::{Path, PathBuf};

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

/// The text of a scene, not yet read.
#[derive(Clone, PartialEq, Debug)]
pub struct Source {
    /// Name of the scene: the built-in name, or the stem of the file.
    pub name: String,
    /// What errors call the text.
    pub label: String,
    /// The TOML.
    pub text: String,
    /// The folder of the file, which paths in it are relative to; the present one for a built-in scene.
    pub folder: PathBuf,
}

/// Finds a built-in scene of this name, or reads the file.
///
/// # Errors
/// [`RunError`] in one line, with the nearest name for what was meant as a name.
pub fn find(name_or_path: &str, built_in: &[BuiltIn]) -> Result<Source, RunError> {
    if let Some(scene) = built_in.iter().find(|scene| scene.name == name_or_path) {
        let label = format!("built-in scene {}", scene.name);
        return Ok(Source { name: scene.name.to_owned(), label, text: scene.toml.to_owned(), folder: PathBuf::new() });
    }
    let path = Path::new(name_or_path);
    // Whatever has neither a slash nor an ending was meant as a name.
    if !path.exists() && !name_or_path.contains('/') && path.extension().is_none() {
        let names: Vec<&str> = built_in.iter().map(|scene| scene.name).collect();
        let nearest = stylet_scene::nearest(name_or_path, names.iter().copied());
        let known = names.join(", ");
        let reason = format!(
            "found no such scene or file, expected a TOML file or one of {known}; nearest built-in scene is {nearest}"
        );
        return Err(RunError::Inconsistent { source_name: name_or_path.to_owned(), reason });
    }
    let text = stylet_scene::load(path)?;
    let name = path.file_stem().map_or_else(|| "scene".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
    Ok(Source { name, label: name_or_path.to_owned(), text, folder })
}
