//! What cannot be run is refused in one line that names it.

use crate::support::{GEL, open, try_open};
use stylet_steering::SCENES;
use stylet_tissue::Scenario;
use stylet_tissue::source::find;

fn refusal(text: &str) -> String {
    let error = try_open(text, &[]).err().unwrap_or_else(|| panic!("accepted: {text}"));
    let line = error.to_string();
    assert!(error.is_bad_input() && !line.contains('\n') && line.starts_with("gel.toml"), "{line}");
    line
}

#[track_caller]
fn refused(from: &str, to: &str, parts: &[&str]) {
    let text = GEL.replace(from, to);
    assert_ne!(text, GEL);
    let line = refusal(&text);
    for part in parts {
        assert!(line.contains(part), "no `{part}` in: {line}");
    }
}

const BASE: &str = "base = [-0.021, 0.031, 0.029]";

#[test]
fn needles_that_start_inside_or_miss() {
    refused(
        BASE,
        "base = [0.021, 0.031, 0.029]",
        &["needle (row 1): base: found its base", "inside the tissue, in region tissue"],
    );
    refused(BASE, "base = [-0.011, 0.031, 0.029]", &["found a part of it at", "expected all of the needle outside"]);
    refused(
        BASE,
        "base = [-0.021, 0.091, 0.029]",
        &["direction: found an axis", "misses the body", "the body reaches from (0, 0, 0)"],
    );
    refused("direction = [1.0,", "direction = [-1.0,", &["misses the body"]);
    refused("insert = 0.05", "insert = 0.0001", &["motion: found a needle that comes 0.02", "to the body"]);
}

#[test]
fn fixed_regions_are_named() {
    let bone = GEL
        .replace(BASE, "base = [0.021, 0.031, 0.029]")
        .replace("[support]", "[[region]]\nname = \"tissue\"\nfixed = true\n[support]");
    assert!(refusal(&bone).contains("in region tissue, which is fixed"));
}

#[test]
fn needles_that_there_are_not() {
    refused(
        "bevel = 0.1",
        "bevel = 0.1\nbending = -1.0",
        &["needle.bending (row 1): found -1.0, expected a number > 0"],
    );
    // A string buckles in waves as short as its edges: pushed, it has no way that a mesh does not decide.
    refused("bevel = 0.1", "bevel = 0.1\nbending = 0.0", &["needle.bending (row 1): found 0.0, expected a number > 0"]);
    refused("bevel = 0.1", "bevel = 0.1\nbending = nan", &["needle.bending (row 1): found nan"]);
    refused("bevel = 0.1", "bevel = 0.1\nyoung = 0", &["needle.young (row 1): found 0, expected a number > 0"]);
    refused("bevel = 0.1", "bevel = 1.6", &["needle.bevel (row 1): found 1.6"]);
    refused("bevel = 0.1", "bevel = 1.2", &["needle.bevel (row 1): found 1.2, expected a number > -1.2 and < 1.2"]);
    refused(
        "bevel = 0.1",
        "bevel = 0.1\nedge = 1e-6",
        &["needle.edge (row 1): found 1e-6 m, expected at least 6.000e-5 m"],
    );
    refused("bevel = 0.1", "bevel = 0.1\nlength = 1e-5\nedge = 1e-5", &["needle.edge (row 1): found 1e-5 m"]);
    refused("bevel = 0.1", "bevel = 0.1\nfriction_ratio = 0.5", &["needle.friction_ratio (row 1): found 0.5"]);
    refused("bevel = 0.1", "bevl = 0.1", &["needle.bevl (row 1): unknown key; nearest known key is needle.bevel"]);
    refused("release = [0.02, 0.03]", "release = [0.02, -0.03]", &["release: found -0.03 m"]);
    let none = &GEL[..GEL.find("[[needle]]").unwrap()];
    assert!(refusal(none).contains("needle: found 0 needles, expected from 1 to 4"));
}

#[test]
fn motion_out_of_order() {
    refused(
        "{ t = 0.9, insert = 0.0 }",
        "{ t = 0.7, insert = 0.0 }",
        &["motion (row 4): t: found 0.7 s after 0.8 s", "ascending"],
    );
    // 40 mm out, and 70 mm back.
    refused(
        "{ t = 0.9, insert = -0.07 }, { t = 1.6, insert = -0.07 }",
        "{ t = 0.9, insert = -0.07 }, { t = 1.9, insert = -0.07 }",
        &["needle.motion (row 1): found a needle that is 0.0300 m further back at 1.9 s", "expected at most 0.0175 m"],
    );
    let still = format!("{}motion = [{{ t = 0, insert = 0.05 }}]", &GEL[..GEL.find("motion").unwrap()]);
    assert!(refusal(&still).contains("needle.motion: found a last row at 0 s, where the run ends, expected one at"));
    let end = still.replace("[support]", "[time]\nend = 0.01\n[support]");
    assert!(refusal(&end).contains("time.end: found an end at 0.01 s"));
    refused("{ t = 0.9, insert = 0.0 }", "{ insert = 0.0 }", &["needle.motion (row 1).t (row 4): missing"]);
}

#[test]
fn forces_and_regions() {
    refused("cutting = 0.2", "cutting = -0.2", &["friction.cutting: found -0.2, expected a number >= 0"]);
    refused("cutting = 0.2", "per_length = nan", &["friction.per_length: found nan"]);
    let row = |row: &str| format!("cutting = 0.2\n{row}");
    refused(
        "cutting = 0.2",
        &row("[[friction.region]]\nname = \"bone\""),
        &["friction.region (row 1): name: found region bone, expected one of tissue"],
    );
    refused(
        "cutting = 0.2",
        &row("[[friction.membrane]]\nof = \"liver\"\nthickness = 0.001\ncutting = 1.0"),
        &["friction.membrane (row 1): of: found region liver"],
    );
    refused(
        "[support]",
        "[[region]]\nname = \"tisue\"\n[support]",
        &["region (row 1): name: found region tisue", "nearest is tissue"],
    );
    refused("sides = \"bottom, right\"", "sides = \"botom\"", &["support.sides: found botom, expected some of left"]);
    refused("sides = \"bottom, right\"", "sides = \"\"", &["support.sides: found nothing that is held"]);
    refused("[mesh]", "[mesh]\nshape = \"prostat\"", &["mesh.shape: found prostat", "nearest is prostate"]);
    refused("name = \"b\"", "name = \"a\"", &["markers.point (row 2): name: found a once more"]);
    refused(
        "at = [0.05, 0.04, 0.02]",
        "at = [0.05, 0.04, 0.2]",
        &["markers.point (row 2): at: found [0.05, 0.04, 0.2]", "a point of the body"],
    );
}

#[test]
fn orders_and_parts() {
    refused(
        "[mesh]",
        "[mesh]\norder = \"rmc\"",
        &["mesh.order: found the string \"rmc\", expected one of \"made\", \"rcm\""],
    );
    refused(
        "[support]",
        "[time]\npartition = \"mets\"\n[support]",
        &["time.partition: found the string \"mets\", expected one of \"numbers\", \"metis\""],
    );
}

#[test]
fn marker_files() {
    let path = std::env::temp_dir().join(format!("stylet-measured-{}.csv", std::process::id()));
    let text = format!("[markers]\nfile = '{}'\n{GEL}", path.display());
    let refusal = |content: &str| {
        std::fs::write(&path, content).unwrap();
        try_open(&text, &[]).err().unwrap().to_string()
    };
    let line = refusal("time_s,a_x,a_y,a_z\n0.1,0,0\n");
    assert!(
        line.contains("measured") && line.ends_with("line 2: found 3 columns, expected 4 as in the head"),
        "{line}"
    );
    assert!(refusal("time_s,c_x,c_y,c_z\n").ends_with("line 1: found marker c, expected one of a, b"));
    assert!(refusal("time_s,a_x,a_y,a_z\n0.1,30,30,60\n").ends_with("expected metres"));
    assert!(refusal("time_s,a_x,a_y,a_z\n7,0,0,0\n").contains("from 0 to 1.6 s, the end of the run"));
    std::fs::write(&path, b"time_s,a_x,a_y,a_z\n0.1,0,0,0\n0.2,\xff,0,0\n").unwrap();
    let line = try_open(&text, &[]).err().unwrap().to_string();
    assert!(line.ends_with("line 3: found a byte that is not UTF-8, expected text"), "{line}");
    std::fs::remove_file(&path).unwrap();
    let line = try_open(&text, &[]).err().unwrap().to_string();
    assert!(line.contains("No such file"), "{line}");
}

/// What can be computed but is hardly meant is said in a line, and nothing is said of the scenes that come with the program.
#[test]
fn implausible_magnitudes_are_doubted() {
    for scene in SCENES {
        let opened = stylet_steering::open(&find(scene.name, SCENES).unwrap(), &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(opened.warnings(), [""; 0], "{}", scene.name);
    }
    assert_eq!(open(GEL).warnings(), [""; 0]);
    let doubts = |from: &str, to: &str| {
        let text = GEL.replace(from, to);
        assert_ne!(text, GEL);
        open(&text).warnings()
    };
    let check = "; check the units of the scene";
    for (from, to, line) in [
        ("bevel = 0.1", "bending = 1e-9", "needle.bending (row 1): found 1e-9 N m^2, expected from 1e-7 to 2000 N m^2"),
        ("bevel = 0.1", "diameter = 0.83", "needle.diameter (row 1): found 0.83 m, expected from 1e-5 to 0.02 m"),
        ("bevel = 0.1", "young = 60.0", "needle.young (row 1): found 60 Pa, expected from 1e6 to 1e13 Pa"),
        ("[0.02, 0.03]", "[20.0, 30.0]", "needle.release (row 1): found 20 m, expected from 1e-5 to 2 m"),
        (
            "[support]",
            "[time]\npace = 190.0\ndt = 0.001\n[support]",
            "needle.motion (row 1): found 13.3 m/s, expected from 0 to 10 m/s",
        ),
        (
            "[support]",
            "[material]\ndensity = 1.0\n[support]",
            "density of region tissue: found 1 kg/m^3, expected from 10 to 30000 kg/m^3",
        ),
        (
            "[[needle]]",
            "[[friction.membrane]]\nof = \"body\"\nthickness = 1.0\ncutting = 1.0\n[[needle]]",
            "friction.membrane.thickness (row 1): found 1 m, expected from 1e-6 to 0.1 m",
        ),
    ] {
        assert_eq!(doubts(from, to), [format!("{line}{check}")], "{to}");
    }
    let soft = doubts("[support]", "[material]\nyoung = 5.0\n[support]");
    assert!(soft.len() == 1 && soft[0].starts_with("young of region tissue: found "), "{soft:?}");
}

/// A scene in millimetres is one of a hundred metres.
#[test]
fn millimetres_are_doubted() {
    let text = "[mesh]\nsize = [80, 60, 60]\ncells = [6, 5, 5]\n[support]\nsides = \"bottom\"\n[[needle]]\n\
                base = [-21, 31, 29]\ndirection = [1, 0, 0]\nlength = 20\nedge = 5\n\
                motion = [{ t = 0.0, insert = 50 }, { t = 0.8, insert = 50 }]\n";
    assert_eq!(
        open(text).warnings(),
        [
            "mesh.size: found 80 m, expected from 0.001 to 2 m; check the units of the scene",
            "needle.length (row 1): found 20 m, expected from 0.0001 to 2 m; check the units of the scene",
            "needle.motion (row 1): found 50 m/s, expected from 0 to 10 m/s; check the units of the scene",
        ]
    );
}
