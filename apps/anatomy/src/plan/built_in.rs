//! Scenes of shapes that come with the program.

use crate::shapes::ShapeScene;
use std::path::Path;
use stylet_scene::SceneError;

/// Names, what they are, and their files.
pub const BUILT_IN: [(&str, &str, &str); 4] = [
    (
        "prostate",
        "pelvic tissue around a prostate, eleven regions (Chentanez et al. 2009)",
        include_str!("../../scenes/prostate.toml"),
    ),
    ("two-cylinders", "a block with two rigid cylinders and a target", include_str!("../../scenes/two-cylinders.toml")),
    ("gel-block", "a gelatine phantom with markers on its surface", include_str!("../../scenes/gel-block.toml")),
    (
        "ellipsoid",
        "an ellipsoid in a box: the case that mesh generators are compared by",
        include_str!("../../scenes/ellipsoid.toml"),
    ),
];

/// The scene of a name; `None` if there is none of this name.
pub fn built_in(name: &str) -> Option<Result<ShapeScene, SceneError>> {
    let (name, _, text) = BUILT_IN.iter().find(|(known, ..)| *known == name)?;
    Some(ShapeScene::parse(name, text, Path::new("")))
}
