//! `stylet scenes`: the built-in scenes, and the keys of a scene file.

use crate::args::ScenesArgs;
use crate::exit::{Exit, Failure};
use crate::output;
use stylet_needle::builtin::{self, SCENES, built_in};
use stylet_needle::keys::TABLE;
use stylet_tissue::{RunError, Scenario, source};

/// Opens a built-in scene or a file, with `key=value` assignments on top.
///
/// # Errors
/// [`RunError`] in one line: the file, the key or line, what was found and what was expected.
pub fn open(name_or_path: &str, assignments: &[String]) -> Result<Box<dyn Scenario>, RunError> {
    let source = source::find(name_or_path, SCENES)?;
    Ok(Box::new(builtin::read(&source, assignments)?))
}

/// Prints what was asked for.
///
/// # Errors
/// A built-in scene that does not exist.
pub fn execute(args: &ScenesArgs) -> Result<Exit, Failure> {
    let text = match &args.show {
        Some(name) => built_in(name).ok_or_else(|| unknown(name))?.toml.to_owned(),
        None if args.schema => TABLE.schema(),
        None => list(),
    };
    output::print(&text)?;
    Ok(Exit::Done)
}

fn list() -> String {
    let width = SCENES.iter().map(|scene| scene.name.len()).max().unwrap_or(0);
    SCENES.iter().map(|scene| format!("{:<width$}  {}\n", scene.name, scene.about)).collect()
}

fn unknown(name: &str) -> Failure {
    let names: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
    let near = stylet_scene::nearest(name, names.iter().copied());
    Failure::bad_input(format!("--show: found {name}, expected one of {}; nearest is {near}", names.join(", ")))
}
