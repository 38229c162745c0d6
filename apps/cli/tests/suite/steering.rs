//! Flexible needles by the command line.

use crate::support::{Folder, json, refuses, stderr, table, without_seconds};

/// In for 20 mm and out again in 0.8 s.
const GEL: &str = r#"
[mesh]
size = [0.06, 0.05, 0.05]
cells = [5, 4, 4]
[support]
sides = "bottom, right"
[friction]
cutting = 0.2
[[needle]]
base = [-0.021, 0.026, 0.024]
direction = [1.0, 0.0, 0.0]
bevel = 0.1
motion = [
    { t = 0.0, insert = 0.05 }, { t = 0.4, insert = 0.05 },
    { t = 0.4, insert = -0.06 }, { t = 0.8, insert = -0.06 },
]
[[markers.point]]
name = "a"
at = [0.03, 0.03, 0.05]
"#;

#[test]
fn a_run_writes_its_files_and_goes_on_from_a_state() {
    let folder = Folder::new();
    let scene = folder.file("gel.toml", GEL);
    let summary = json(
        &folder.succeed(&format!("run {scene} --out whole --json --quiet --set output.frames=20 --save-state 25")),
    );
    assert_eq!((summary["converged"].as_bool(), summary["steps"].as_u64()), (Some(true), Some(40)));
    assert!(summary["needle"]["base_force"].as_array().unwrap().len() == 3);
    assert_eq!(summary["steering"]["consistent_share"], 1.0);
    for stage in ["tissue", "search", "needle", "remesh", "reparameterise"] {
        assert!(summary["stages"][stage]["calls"].as_u64().unwrap() >= 40, "{stage}: {summary}");
    }
    for name in [
        "mesh.svg",
        "path.svg",
        "force.svg",
        "states.svg",
        "stages.svg",
        "markers.csv",
        "body.pvd",
        "needle.pvd",
        "frames/step_000020.vtu",
        "frames/needle_000020.vtu",
        "frames/needle_000040.vtu",
        "state/step_000025.state",
    ] {
        assert!(folder.has(&format!("whole/{name}")), "{name}");
    }
    let (head, rows) = table(&folder.read("whole/history.csv"));
    assert_eq!(head[..3], ["step", "time_s", "depth_m"]);
    assert!(head.contains(&"base_torque_z".to_owned()) && head.contains(&"search_s".to_owned()));
    assert_eq!(rows.len(), 40);
    folder.succeed(&format!("run {scene} --out rest --quiet --resume whole/state/step_000025.state"));
    let [whole, rest] = ["whole", "rest"].map(|run| without_seconds(&folder.read(&format!("{run}/history.csv"))));
    assert_eq!(whole, rest);
    assert_eq!(folder.read("whole/markers.csv"), folder.read("rest/markers.csv"));
}

#[test]
fn a_step_that_cannot_be_made_keeps_what_is_there() {
    let folder = Folder::new();
    // Through the block and out at its back.
    let scene = folder.file(
        "through.toml",
        GEL.replace(
            "{ t = 0.4, insert = 0.05 }",
            "{ t = 0.4, insert = 0.05 }, { t = 0.4, insert = 0.06 }, { t = 2.0, insert = 0.06 }",
        )
        .replace("{ t = 0.4, insert = -0.06 }, { t = 0.8, insert = -0.06 },", ""),
    );
    let output = folder.run(&format!("run {scene} --out out --quiet"));
    let line = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{line}");
    assert!(
        line.lines().count() == 1 && line.contains("needle 1") && line.contains("node") && line.contains("files kept"),
        "{line}"
    );
    assert!(line.contains("has left the tissue at (") && line.contains("comes out again is not followed"), "{line}");
    let summary = json(&folder.read("out/summary.json"));
    let needle = &summary["steering"]["needles"][0];
    assert!(summary["failure"].is_string() && needle["depth_m"].as_f64().unwrap() > 0.03);
    assert!(folder.has("out/mesh.svg") && folder.has("out/history.csv"));
    // What is left is the end of the last whole step, not the middle of the one that failed.
    let history = folder.read("out/history.csv");
    let mut lines = history.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let last: Vec<&str> = lines.last().unwrap().split(',').collect();
    let of = |name: &str| last[names.iter().position(|n| *n == name).unwrap()].parse::<f64>().unwrap();
    assert_eq!(needle["depth_m"].as_f64().unwrap(), of("depth_m"));
    let tip: Vec<f64> = needle["tip"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert_eq!(tip, [of("tip_x"), of("tip_y"), of("tip_z")]);
}

#[test]
fn a_tip_that_comes_into_what_is_fixed_stops_the_run() {
    let folder = Folder::new();
    // Straight at the upper of two rigid cylinders, 33 mm behind the skin, which forces would let it cut.
    let scene = folder.file(
        "bone.toml",
        "[mesh]\nshape = \"two-cylinders\"\n[support]\nsides = \"right\"\n[friction]\ncutting = 0.2\n\
         [[needle]]\nbase = [-0.021, 0.016, 0.0]\ndirection = [1.0, 0.0, 0.0]\n\
         motion = [{ t = 0.0, insert = 0.05 }, { t = 1.2, insert = 0.05 }]\n",
    );
    let output = folder.run(&format!("run {scene} --out out --quiet"));
    let line = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{line}");
    let known = "needle 1 has come into region upper cylinder, which is fixed, with its tip, node 9, at (0.03";
    assert!(line.lines().count() == 1 && line.contains(known), "{line}");
    assert!(line.contains("m deep") && line.contains("files kept"), "{line}");
    let summary = json(&folder.read("out/summary.json"));
    assert!(summary["failure"].as_str().unwrap().contains("upper cylinder"));
    assert!((0.03..0.042).contains(&summary["steering"]["needles"][0]["depth_m"].as_f64().unwrap()), "{summary}");
    assert!(folder.has("out/mesh.svg") && folder.has("out/history.csv"));
}

#[test]
fn bone_stops_a_built_in_scene() {
    let folder = Folder::new();
    let base = "needle.base=[-0.021,0.020,-0.035]";
    let output = folder.run(&format!("run prostate-flexible --set {base} --out out --quiet"));
    let line = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{line}");
    let known = "needle 1 has come into region pelvic bone, which is fixed, with its tip, node ";
    assert!(line.lines().count() == 1 && line.contains("step 83") && line.contains(known), "{line}");
    // What is kept is the end of the step before, with the tip in front of the bone.
    let summary = json(&folder.read("out/summary.json"));
    assert_eq!((summary["steps"].as_u64(), summary["converged"].as_bool()), (Some(82), Some(false)));
    assert!(summary["failure"].as_str().unwrap().contains("pelvic bone"));
    assert!((0.025..0.033).contains(&summary["steering"]["needles"][0]["depth_m"].as_f64().unwrap()), "{summary}");
    assert!(folder.has("out/history.csv"));
}

#[test]
fn what_did_not_come_about_is_noted() {
    let folder = Folder::new();
    let scene = folder.file(
        "gel.toml",
        format!("[markers]\nfile = \"m.csv\"\n{GEL}")
            .replace("bevel = 0.1", "friction_ratio = 100.0\nrelease = [0.01]")
            .replace("cutting = 0.2", "cutting = 100.0"),
    );
    folder.file("m.csv", "time_s,a_x,a_y,a_z\n0.8,0.03,0.03,0.05\n");
    let notes = |options: &str| -> Vec<String> {
        let summary = json(&folder.succeed(&format!("run {scene} --no-files --json --quiet {options}")));
        let notes = summary["steering"]["notes"].as_array().unwrap().iter();
        notes.map(|note| note.as_str().unwrap().to_owned()).collect()
    };
    let dented = notes("--steps 10");
    assert_eq!(dented.len(), 3, "{dented:?}");
    assert!(dented[0].starts_with("needle 1 dented the tissue but never cut it: pushed with "), "{dented:?}");
    assert!(dented[1].starts_with("needle 1 left no seed at 10.00 mm of depth: it came to 0.0"), "{dented:?}");
    assert_eq!(dented[2], "markers.file has no position within the run, which ended at 0.2000 s");
    assert!(notes("--set friction.cutting=0.2 --set needle.friction_ratio=1").is_empty());
}

/// What was done before the steps, the mesh above all, has no share of their time.
#[test]
fn shares_of_stages_add_up() {
    let folder = Folder::new();
    let scene = folder.file("gel.toml", GEL);
    for name in [scene.as_str(), "beam-bend --set mesh.cells=[8,3,3]", "slab2d-insertion --steps 20"] {
        let text = folder.succeed(&format!("run {name} --no-files --quiet"));
        let table = text.lines().skip_while(|line| !line.starts_with("  stage ")).skip(1);
        // Stages within another one are set in further.
        let rows: Vec<&str> = table.filter(|line| !line.starts_with("   ")).collect();
        let shares =
            rows.iter().filter_map(|row| row.split(" %").next()?.split_whitespace().last()?.parse::<f64>().ok());
        let rounding = 0.05 * rows.len() as f64;
        let sum: f64 = shares.sum();
        assert!((sum - 100.0).abs() <= rounding, "{name}: {sum} %\n{text}");
        let mesh = rows.iter().find(|row| row.starts_with("  mesh ")).unwrap_or_else(|| panic!("{text}"));
        assert_eq!(mesh.contains("before"), !name.starts_with("slab2d"), "{text}");
    }
}

/// A scene that was written in millimetres runs, and says what is odd before it does.
#[test]
fn implausible_magnitudes_are_warned_of() {
    let folder = Folder::new();
    let scene = folder.file("gel.toml", GEL.replace("bevel = 0.1", "diameter = 0.83"));
    let output = folder.run(&format!("run {scene} --no-files --json --quiet --steps 2"));
    let line = "needle.diameter (row 1): found 0.83 m, expected from 1e-5 to 0.02 m; check the units of the scene";
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), format!("stylet: gel: warning: {line}\n")));
    let summary = json(std::str::from_utf8(&output.stdout).unwrap());
    assert_eq!(summary["steering"]["notes"][0], line);
    refuses(&folder, "run gel-single-bend --set needle.bending=0 --no-files", &["needle.bending", "a number > 0"]);
}

#[test]
fn bad_input_is_one_line() {
    let folder = Folder::new();
    let base = "base = [-0.021, 0.026, 0.024]";
    for (from, to, parts) in [
        (base, "base = [0.02, 0.026, 0.024]", &["needle (row 1): base", "inside the tissue"][..]),
        (base, "base = [-0.021, 0.126, 0.024]", &["misses the body"]),
        ("bevel = 0.1", "bending = -0.1", &["gel.toml:12: needle.bending (row 1): found -0.1"]),
        ("cutting = 0.2", "per_length = -1", &["friction.per_length: found -1"]),
        (
            "bevel = 0.1",
            "bevel = 0.1\ncurvature = 1e4",
            &["needle (row 1): curvature is 10000.0, expected at most a radian"],
        ),
        ("[[needle]]", "[needle]", &["gel.toml:", "needle", "[[needle]]"]),
        ("{ t = 0.4, insert = 0.05 }", "{ t = 0.9, insert = 0.05 }", &["motion (row 3): t: found 0.4 s after 0.9 s"]),
        ("[support]", "[[region]]\nname = \"bone\"\n[support]", &["region (row 1): name: found region bone"]),
        (
            "[[markers.point]]",
            "[markers]\nfile = \"m.csv\"\n[[markers.point]]",
            &["m.csv", "line 3: found 3 columns, expected 4"],
        ),
    ] {
        folder.file("m.csv", "time_s,a_x,a_y,a_z\n0.1,0,0,0\n0.2,0,0\n");
        let scene = folder.file("gel.toml", GEL.replace(from, to));
        refuses(&folder, &format!("run {scene} --out none"), parts);
    }
    for (set, line) in [
        (
            "needle.motion.insert=1",
            "needle.motion.insert: found one column, expected all rows together: needle.motion=[{",
        ),
        ("needle.insert=1", "needle.insert: unknown key; nearest known key is needle.base"),
    ] {
        refuses(&folder, &format!("run gel-single-bend --set {set} --no-files"), &[line]);
        assert!(!folder.has("none"));
    }
    let shaped = "run prostate-flexible --set material.poisson=0.49 --out none";
    refuses(&folder, shaped, &["material.poisson: found 0.49, but shape prostate comes first", "region = [{ name = "]);
    assert!(!folder.has("none"));
}
