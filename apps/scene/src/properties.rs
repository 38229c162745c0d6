//! What holds for every text and every scene.

use proptest::prelude::*;

use crate::sample::{Mesh, Needle, Scene, TABLE};
use crate::{Row, SceneError, Value};

const SCENE: &str = r#"title = "slab"
[mesh]
h_start = 3
poisson = 0.3
corner = [0.0, 1e-3]
smooth = true
[needle]
method = "cg"
force = 0.1
[[needle.motion]]
t = 0.0
insert = 0.01
[needle.rod]
stiffness = 2.0
"#;

/// Fragments that mean something to TOML or to the sample scene.
#[rustfmt::skip]
const PIECES: &[&str] = &[
    "[", "]", "[[", "]]", "{", "}", "=", ".", ",", "\n", "\"", "'", "'''", "#", "mesh", "needle", "motion", "h_start",
    "t", "nan", "-inf", "1e999", "-0.0", "0x7f", "true", "1979-05-27", "\\u0000", "\0", "\u{feff}", "é", "\r\n", "\r",
    "99999999999999999999", "[mesh]", "[[needle.motion]]\n", "\"mesh.h_start\"",
];

fn check(error: &SceneError) -> Result<(), TestCaseError> {
    let message = error.to_string();
    prop_assert!(!message.contains(|c: char| c.is_control()), "{:?}", message);
    prop_assert!(message.chars().count() < 1200, "{}", message);
    prop_assert!(message.starts_with("x.toml:") || message.starts_with("--set: "), "{}", message);
    Ok(())
}

/// Reads or refuses; a refusal is one line, and a scene that was read can be written and read again.
fn read(text: &str) -> Result<(), TestCaseError> {
    let mut scene = Scene::default();
    match TABLE.read("x.toml", text, &mut scene) {
        Err(error) => check(&error),
        Ok(()) => reads_back(&scene),
    }
}

fn reads_back(scene: &Scene) -> Result<(), TestCaseError> {
    let text = TABLE.write(scene);
    let mut again = Scene::default();
    TABLE.read("x.toml", &text, &mut again).map_err(|error| TestCaseError::fail(format!("{error}\n{text}")))?;
    prop_assert_eq!(bits(&again), bits(scene), "{}", text);
    prop_assert_eq!(TABLE.write(&again), text);
    Ok(())
}

/// `Debug` shows every bit of a finite number, the sign of a zero included.
fn bits(scene: &Scene) -> String {
    format!("{scene:?}")
}

/// Finite numbers of every size.
fn finite() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite())
}

fn row() -> impl Strategy<Value = Row> {
    let way = prop::collection::vec(prop::collection::vec(finite(), 2..=3), 0..3);
    (finite(), prop::option::of(finite()), prop::option::of(any::<String>()), way).prop_map(|(t, insert, note, way)| {
        let mut row = Row::from_iter([("t", t.abs())]);
        insert.into_iter().for_each(|x| row.set("insert", x));
        note.into_iter().for_each(|note| row.set("note", Value::Text(note)));
        if !way.is_empty() {
            let points = way.into_iter().map(|to| Row::from_iter([("to", Value::Floats(to))]));
            row.set("way", Value::Rows(points.collect()));
        }
        row
    })
}

fn needle() -> impl Strategy<Value = Needle> {
    let force = prop::option::of(finite().prop_map(|x| x.abs().max(f64::from_bits(1))));
    let rod = prop::option::of(finite().prop_map(f64::abs));
    let method = prop::sample::select(vec!["cg", "newton", "direct"]);
    (method, force, prop::collection::vec(row(), 0..4), rod).prop_map(|(method, force, motion, rod)| Needle {
        method: method.into(),
        force,
        motion,
        rod,
    })
}

fn scene() -> impl Strategy<Value = Scene> {
    let corner = prop::collection::vec(finite().prop_filter("refused", |x| *x != -1.0), 0..4);
    let mesh = (0usize..13, 0.0..0.5, corner, any::<bool>()).prop_map(|(h_start, poisson, corner, smooth)| Mesh {
        h_start,
        poisson,
        corner,
        smooth,
    });
    (any::<String>(), mesh, prop::option::of(needle())).prop_map(|(title, mesh, needle)| Scene { title, mesh, needle })
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_in_one_line(text in any::<String>()) {
        read(&text)?;
    }

    #[test]
    fn pieces_of_toml_are_read_or_refused(pieces in prop::collection::vec(prop::sample::select(PIECES), 0..24)) {
        read(&pieces.concat())?;
        read(&format!("[mesh]\n{}", pieces.concat()))?;
    }

    #[test]
    fn a_damaged_scene_is_read_or_refused(
        at in any::<prop::sample::Index>(),
        length in 0usize..12,
        piece in prop::sample::select(PIECES),
        insert in any::<bool>(),
    ) {
        let start = at.index(SCENE.len());
        let end = (start + length).min(SCENE.len());
        let piece = if insert { piece } else { "" };
        read(&format!("{}{piece}{}", &SCENE[..start], &SCENE[end..]))?;
    }

    #[test]
    fn a_written_scene_reads_back_to_the_same_bits(scene in scene()) {
        reads_back(&scene)?;
    }

    #[test]
    fn any_assignment_is_taken_or_refused_in_one_line(
        key in prop::sample::select(vec!["title", "mesh.h_start", "mesh.corner", "needle.motion", "needle.method", "x", ""]),
        text in any::<String>(),
        pieces in prop::collection::vec(prop::sample::select(PIECES), 0..8),
    ) {
        for value in [text, pieces.concat()] {
            for assignment in [format!("{key}={value}"), value] {
                if let Err(error) = TABLE.set(&mut Scene::default(), &assignment) {
                    check(&error)?;
                }
            }
        }
    }
}

#[test]
fn the_undamaged_scene_is_read() {
    let mut scene = Scene::default();
    TABLE.read("x.toml", SCENE, &mut scene).unwrap();
    assert_eq!(scene.needle.as_ref().map(|needle| needle.motion.len()), Some(1));
    reads_back(&scene).unwrap();
}

/// Nesting that would overflow the stack of a parser without a limit.
#[test]
fn deep_nesting_is_refused() {
    for text in ["[".repeat(1 << 20), "{a=".repeat(1 << 18)] {
        let text = format!("title = {text}");
        check(&TABLE.read("x.toml", &text, &mut Scene::default()).unwrap_err()).unwrap();
        check(&TABLE.set(&mut Scene::default(), &text.replacen("title", "mesh.corner", 1)).unwrap_err()).unwrap();
    }
    for text in [format!("a{} = 1", ".a".repeat(1 << 18)), format!("[a{}]", ".a".repeat(1 << 18))] {
        check(&TABLE.read("x.toml", &text, &mut Scene::default()).unwrap_err()).unwrap();
    }
}
