//! `stylet scenes`: the built-in scenes, and the keys of a scene file.

use crate::args::ScenesArgs;
use crate::exit::{Exit, Failure};
use crate::output;
use stylet_needle::builtin as needle;
use stylet_needle::keys::TABLE as NEEDLE_TABLE;
use stylet_steering as steering;
use stylet_steering::keys::TABLE as STEERING_TABLE;
use stylet_tissue::body::keys::TABLE as BODY_TABLE;
use stylet_tissue::source::{self, BuiltIn};
use stylet_tissue::{RunError, Scenario, body};

/// Opens a built-in scene or a file, with `key=value` assignments on top.
///
/// # Errors
/// [`RunError`] in one line: the file, the key or line, what was found and what was expected.
pub fn open(name_or_path: &str, assignments: &[String]) -> Result<Box<dyn Scenario>, RunError> {
    let source = source::find(name_or_path, &all())?;
    // A scene belongs to the application that knows most of what it says; one that both know, to that of its stage.
    let unknown = (NEEDLE_TABLE.count_unknown(&source.text), BODY_TABLE.count_unknown(&source.text));
    let of_steering = STEERING_TABLE.count_unknown(&source.text);
    // Needles in the plural are flexible ones; so is a lone one among their keys, which is told how it is written.
    if stylet_scene::has_rows(&source.text, "needle") || of_steering < unknown.0.min(unknown.1) {
        return Ok(Box::new(steering::open(&source, assignments)?));
    }
    if unknown.0 < unknown.1 || unknown.0 == unknown.1 && stylet_scene::has_table(&source.text, "needle") {
        return Ok(Box::new(needle::read(&source, assignments)?));
    }
    Ok(Box::new(body::open(&source, assignments)?))
}

/// The built-in scenes of all applications.
fn all() -> Vec<BuiltIn> {
    needle::SCENES.iter().chain(steering::SCENES).chain(body::SCENES).copied().collect()
}

/// Prints what was asked for.
///
/// # Errors
/// A built-in scene that does not exist.
pub fn execute(args: &ScenesArgs) -> Result<Exit, Failure> {
    let text = match &args.show {
        Some(name) => all().into_iter().find(|scene| scene.name == name).ok_or_else(|| unknown(name))?.toml.to_owned(),
        None if args.schema => format!(
            "## Scenes with a needle\n\n{}\n## Scenes of flexible needles\n\n{}\n## Scenes of bodies\n\n{}",
            NEEDLE_TABLE.schema(),
            STEERING_TABLE.schema(),
            BODY_TABLE.schema()
        ),
        None => list(),
    };
    output::print(&text)?;
    Ok(Exit::Done)
}

fn list() -> String {
    let width = all().iter().map(|scene| scene.name.len()).max().unwrap_or(0);
    all().iter().map(|scene| format!("{:<width$}  {}\n", scene.name, scene.about)).collect()
}

fn unknown(name: &str) -> Failure {
    let names: Vec<&str> = all().iter().map(|scene| scene.name).collect();
    let near = stylet_scene::nearest(name, names.iter().copied());
    Failure::bad_input(format!("--show: found {name}, expected one of {}; nearest is {near}", names.join(", ")))
}
