//! `stylet mesh generate`: meshes from shapes and contours, into files, and under their weight.

use crate::support::{Folder, json, refuses, stderr};
use serde_json::Value;

/// The study that comes with the project.
const STUDY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../anatomy/data/synthetic");

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn regions(report: &Value) -> &[Value] {
    report["regions"].as_array().unwrap()
}

/// The case: angles, border and speed of an ellipsoid.
#[test]
fn an_ellipsoid_in_a_box() {
    let folder = Folder::new();
    let report = json(&folder.succeed("mesh generate --shape ellipsoid --json --out e.vtu --plot e.svg"));
    let cells = number(&report["cells"]);
    assert!((11e3..18e3).contains(&cells), "{cells} cells");
    let (straight, after) = (&report["straight"], &report["improved"]["after"]);
    assert!(number(&straight["min_angle_deg"]) > 8.9 && number(&straight["max_angle_deg"]) < 160.0, "{straight}");
    assert!(number(&after["min_angle_deg"]) > 20.5 && number(&after["max_angle_deg"]) < 142.0, "{after}");
    assert!(number(&after["min_quality"]) > 0.40 && number(&after["mean_quality"]) > 0.78, "{after}");
    assert!(number(&report["border_error"]) < 2e-5);
    assert!(folder.read("e.svg").starts_with("<svg"));
    // What was written is a mesh with both regions by name.
    let again = json(&folder.succeed("mesh quality e.vtu --json"));
    assert_eq!((&again["cells"], &again["is_mesh"]), (&report["cells"], &Value::Bool(true)));
    // A size scales all others.
    let coarse = json(&folder.succeed("mesh generate --shape ellipsoid --size 0.02 --straight --json"));
    assert!(number(&coarse["cells"]) < 0.2 * cells && coarse["improved"].is_null());
}

#[test]
fn the_meshes_of_needle_scenes() {
    let folder = Folder::new();
    for (name, tets, nodes) in
        [("prostate", 13_400.0, 2_760.0), ("two-cylinders", 3_250.0, 813.0), ("gel-block", 2_280.0, 672.0)]
    {
        let report = json(&folder.succeed(&format!("mesh generate --shape {name} --json")));
        let (cells, vertices) = (number(&report["cells"]), number(&report["vertices"]));
        assert!((cells / tets - 1.0).abs() < 0.1, "{name}: {cells} tetrahedra");
        assert!((vertices / nodes - 1.0).abs() < 0.15, "{name}: {vertices} nodes");
        assert!(number(&report["improved"]["after"]["min_angle_deg"]) > 15.0, "{name}");
        assert!(report["warnings"].as_array().unwrap().is_empty(), "{name}: {}", report["warnings"]);
        for marker in report["markers"].as_array().unwrap() {
            assert!(marker["cell"].is_u64(), "{name}: {marker}");
        }
    }
    let report = json(&folder.succeed("mesh generate --shape prostate --json"));
    let names: Vec<&str> = regions(&report).iter().map(|region| region["name"].as_str().unwrap()).collect();
    assert_eq!(names.len(), 12, "{names:?}");
    let prostate = regions(&report).iter().find(|region| region["name"] == "prostate").unwrap();
    assert!(prostate["conforming"] == true && number(&prostate["relative_difference"]).abs() < 0.05, "{prostate}");
}

/// From shapes to displacements in two commands; the bone does not move.
#[test]
fn a_generated_mesh_runs_under_its_weight() {
    let folder = Folder::new();
    folder.succeed("mesh generate --shape prostate --out prostate.msh --scene prostate.toml --quiet");
    let run = "run prostate.toml --no-files --json --probe 0.072,0,0 --probe 0.06,0.038,0";
    let report = json(&folder.succeed(run));
    assert_eq!(report["converged"], true);
    let displacement = |probe: usize| {
        let values = report["probes"][probe]["displacement"].as_array().unwrap();
        values.iter().map(|x| number(x).powi(2)).sum::<f64>().sqrt()
    };
    assert!(displacement(0) > 1e-4 && displacement(1) < 1e-6, "{report}");
}

/// The study too, held at the bone.
#[test]
fn a_study_runs_under_its_weight() {
    let folder = Folder::new();
    let run = format!("mesh generate --contours {STUDY}.dcm --size 0.012 --out s.vtu --scene s.toml --quiet --fixed");
    let mut command = folder.command(&run);
    assert!(command.arg("pubic bone").status().unwrap().success());
    let report = json(&folder.succeed("run s.toml --no-files --json"));
    assert_eq!(report["converged"], true);
}

#[test]
fn contours_become_organs() {
    let folder = Folder::new();
    let both = ["dcm", "json"].map(|kind| {
        let run =
            format!("mesh generate --contours {STUDY}.{kind} --organs urethra,prostate --size 0.006 --bare --json");
        json(&folder.succeed(&run))
    });
    for report in &both {
        assert_eq!(regions(report).len(), 2);
        for region in regions(report) {
            assert!(number(&region["relative_difference"]).abs() < 0.03, "{region}");
        }
        for measure in report["quality"]["measures"].as_array().unwrap() {
            assert!(measure["measure"] != "aspect" || number(&measure["max"]) < 15.0, "{measure}");
        }
    }
    assert_eq!(both[0]["quality"], both[1]["quality"]);
}

#[test]
fn bad_input_is_one_line() {
    let folder = Folder::new();
    folder.file("syntax.toml", "[domain]\nsize = = 1\n");
    folder.file("empty.toml", "");
    folder.file("key.toml", "[domain]\nsise = 0.01\n");
    folder.file("no-contour.json", "{\"schema\": 1, \"organs\": []}");
    folder.file("garbage.dcm", [7u8; 300]);
    let text = folder.succeed("mesh generate --show ellipsoid");
    folder.file("outside.toml", text.replace("centre = [0.0, 0.0, 0.0]", "centre = [0.5, 0.0, 0.0]"));
    folder.file("nan.toml", text.replace("semi_axes = [0.025,", "semi_axes = [nan,"));
    for (arguments, parts) in [
        ("mesh generate", &["--shape"][..]),
        ("mesh generate --shape prostat", &["--shape: found prostat", "nearest is prostate"]),
        ("mesh generate --show prostat", &["--show: found prostat", "nearest is prostate"]),
        ("mesh generate --shape no-such.toml", &["no-such.toml"]),
        ("mesh generate --shape syntax.toml", &["syntax.toml:2"]),
        ("mesh generate --shape empty.toml", &["empty.toml"]),
        ("mesh generate --shape key.toml", &["key.toml:2", "sise", "size"]),
        ("mesh generate --shape nan.toml", &["nan.toml", "semi_axes"]),
        ("mesh generate --shape outside.toml", &["ellipsoid", "found no cell"]),
        ("mesh generate --shape ellipsoid --size 0", &["--size: found 0"]),
        ("mesh generate --shape ellipsoid --size 1e-6", &["ellipsoid", "tetrahedra would be made"]),
        ("mesh generate --shape ellipsoid --out mesh.doc", &["--out: found mesh.doc"]),
        ("mesh generate --shape ellipsoid --plot mesh.png", &["--plot: found mesh.png"]),
        ("mesh generate --contours no-such.dcm", &["no-such.dcm"]),
        ("mesh generate --contours garbage.dcm", &["garbage.dcm"]),
        ("mesh generate --contours no-contour.json", &["no-contour.json"]),
    ] {
        refuses(&folder, arguments, parts);
    }
    // A surface with a hole.
    folder.file("open.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n");
    let hole = text.replace(
        "kind = \"ellipsoid\"\ncentre = [0.0, 0.0, 0.0]\nsemi_axes = [0.025, 0.020, 0.0175]",
        "kind = \"surface\"\nfile = \"open.stl\"",
    );
    assert_ne!(hole, text);
    folder.file("hole.toml", hole);
    refuses(&folder, "mesh generate --shape hole.toml", &["hole.toml", "open"]);
    let fixed = "mesh generate --shape prostate --out p.msh --scene p.toml --fixed spleen";
    refuses(&folder, fixed, &["--fixed: found spleen", "pelvic bone"]);
    let organs = format!("mesh generate --contours {STUDY}.json --organs spleen");
    refuses(&folder, &organs, &["--organs", "spleen", "prostate"]);
    assert!(!folder.has("mesh.doc"));
    assert!(stderr(&folder.run("mesh generate --shape ellipsoid --quiet")).is_empty());
}
