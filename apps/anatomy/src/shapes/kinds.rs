//! Which parameters each kind of shape has.

use stylet_scene::{Row, nearest};

/// A kind of shape: its word, the columns that a row must have, and those that it may have.
pub(super) struct ShapeKind {
    pub word: &'static str,
    pub needs: &'static [&'static str],
    pub takes: &'static [&'static str],
}

const fn kind(word: &'static str, needs: &'static [&'static str], takes: &'static [&'static str]) -> ShapeKind {
    ShapeKind { word, needs, takes }
}

/// All kinds, in the order of [`WORDS`].
const KINDS: &[ShapeKind] = &[
    kind("sphere", &["centre", "radius"], &[]),
    kind("ellipsoid", &["centre", "semi_axes"], &[]),
    kind("capsule", &["from", "to", "radius"], &[]),
    kind("cylinder", &["from", "to", "radius"], &[]),
    kind("torus-arc", &["centre", "axis", "start", "angle", "ring", "tube"], &[]),
    kind("box", &["low", "high"], &[]),
    kind("half-space", &["point", "normal"], &[]),
    kind("surface", &["file"], &["unit"]),
    kind("shell", &["of"], &["inside", "outside"]),
    kind("union", &["of"], &[]),
    kind("intersection", &["of"], &[]),
    kind("difference", &["of"], &[]),
    kind("smooth-union", &["of", "reach"], &[]),
    kind("placed", &["of"], &[]),
];

/// The words of the kinds.
pub(super) const WORDS: &[&str] = &{
    let mut words = [""; KINDS.len()];
    let mut i = 0;
    while i < KINDS.len() {
        words[i] = KINDS[i].word;
        i += 1;
    }
    words
};

/// Columns of every kind.
const COMMON: [&str; 5] = ["name", "kind", "turn", "turn_axis", "shift"];

/// Refuses a row without a parameter of its kind, or with one that its kind does not have.
pub(super) fn check_row(row: &Row) -> Result<(), String> {
    let word = row.value("kind").map_or(Ok(""), |value| value.text())?;
    let Some(kind) = KINDS.iter().find(|kind| kind.word == word) else { return Ok(()) };
    let own = || kind.needs.iter().chain(kind.takes).copied();
    let strange = |name: &&str| !COMMON.contains(name) && !own().any(|known| known == *name);
    if let Some(name) = row.cells().iter().map(|(name, _)| *name).find(strange) {
        let (list, near) = (own().collect::<Vec<_>>().join(", "), nearest(name, own()));
        return Err(format!("found {name}, expected for {word} {list}; nearest is {near}"));
    }
    if let Some(name) = kind.needs.iter().find(|name| row.value(name).is_none()) {
        return Err(format!("{name}: missing, expected for {word} {}", kind.needs.join(", ")));
    }
    match (row.value("turn").is_some(), row.value("turn_axis").is_some()) {
        (true, false) => Err("turn_axis: missing, expected beside turn".into()),
        (false, true) => Err("turn: missing, expected beside turn_axis".into()),
        _ => Ok(()),
    }
}
