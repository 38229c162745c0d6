//! `stylet mesh`: counts that are known exactly, reports as JSON, pictures, repair, hostile arguments.
#![cfg(unix)]

use crate::support::{Folder, json, refuses, stderr};
use serde_json::Value;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const NEEDLE: &str = "--segment=-0.01,0.431,0.527,0.713,0.489,0.561 --size 0.0078125";

fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key} in {report}"))
}

#[test]
fn refinement_gives_the_known_counts() {
    let folder = Folder::new();
    let size = 2_f64.powi(-20);
    for (arguments, leaves, vertices, shapes, angles) in [
        (format!("kuhn2 --point 0.3141,0.2718 --size {size}"), 501_u64, 257, 1, [45.0, 90.0]),
        ("kuhn3 --point 0.3141,0.2718,0.5772 --size 0.0078125".to_owned(), 2_104, 417, 3, [45.0, 120.0]),
        (format!("kuhn3 {NEEDLE}"), 16_758, 3_135, 3, [45.0, 120.0]),
    ] {
        let report = json(&folder.succeed(&format!("mesh refine --start {arguments} --json --quiet")));
        assert_eq!(report["leaves"], leaves, "{arguments}");
        assert_eq!(report["vertices"], vertices, "{arguments}");
        assert_eq!(report["shapes"], shapes, "{arguments}");
        // A bisection of a cell makes one cell more.
        let start = if arguments.starts_with("kuhn2") { 2 } else { 6 };
        assert_eq!(report["bisections"], leaves - start, "{arguments}");
        let marks = report["marks"].as_u64().unwrap();
        assert!(marks > 0 && marks <= leaves - start, "{arguments}: {marks}");
        // A node takes 32 or 40 bytes, and there are two for each leaf.
        let node = if start == 2 { 32 } else { 40 };
        assert!(report["bytes"].as_u64().unwrap() >= node * (2 * leaves - start), "{arguments}");
        assert!((number(&report, "min_angle_deg") - angles[0]).abs() < 1e-6, "{arguments}");
        assert!((number(&report, "max_angle_deg") - angles[1]).abs() < 1e-6, "{arguments}");
        assert!(number(&report, "seconds") > 0.0);
        assert_eq!(report["rule"], "longest-edge");
    }
    let point = "mesh refine --start kuhn4 --point 0.3141,0.2718,0.5772,0.6931 --size 0.25 --json";
    let report = json(&folder.succeed(point));
    assert_eq!((&report["shapes"], &report["dimension"]), (&Value::from(4), &Value::from(4)));
}

#[test]
fn uniform_rounds_double_the_leaves() {
    let folder = Folder::new();
    for (start, cells) in [("kuhn2", 2), ("kuhn3", 6), ("kuhn4", 24), ("kuhn3:2x1x1", 12)] {
        let report = json(&folder.succeed(&format!("mesh refine --start {start} --uniform 4 --json")));
        assert_eq!(report["leaves"], cells * 16, "{start}");
        assert_eq!(report["bisections"], cells * 15, "{start}");
        // Those that the closure of another mark bisected need not be asked for.
        assert!((1..=cells * 15).contains(&report["marks"].as_u64().unwrap()), "{report}");
        assert_eq!((&report["uniform"], &report["max_level"]), (&Value::from(4), &Value::from(4)));
    }
    // Everywhere, and one long enough to be done in pieces.
    let report = json(&folder.succeed("mesh refine --start kuhn2 --size 0.0015 --json --quiet"));
    assert!(report["leaves"].as_u64().unwrap() > 1 << 20);
    assert_eq!(report["leaves"].as_u64().unwrap().count_ones(), 1);
    assert_eq!(report["feature"]["kind"], "everywhere");
}

#[test]
fn rules_differ_in_shapes() {
    let folder = Folder::new();
    let counts = [("longest-edge", [1, 3, 4]), ("colouring", [4, 19, 67])];
    for (rule, shapes) in counts {
        for (d, size) in [(2, 0.015625), (3, 0.015625), (4, 0.125)] {
            let ends = [[-0.01, 0.431, 0.527, 0.69], [0.713, 0.489, 0.561, 0.71]];
            let segment: Vec<String> = ends.iter().flat_map(|p| &p[..d]).map(f64::to_string).collect();
            let arguments = format!("--start kuhn{d} --segment={} --size {size} --rule {rule}", segment.join(","));
            let report = json(&folder.succeed(&format!("mesh refine {arguments} --json")));
            assert_eq!((&report["shapes"], &report["rule"]), (&shapes[d - 2].into(), &rule.into()), "{arguments}");
        }
    }
}

#[test]
fn reports_for_people_and_files() {
    let folder = Folder::new();
    let text = folder.succeed(&format!("mesh refine --start kuhn3 {NEEDLE} --plot needle.svg --out needle.vtu"));
    for part in ["16758", "3135", "45.0000 to 120.0000 degrees", "picture to needle.svg", "mesh to needle.vtu"] {
        assert!(text.contains(part), "no {part} in {text}");
    }
    let picture = folder.read("needle.svg");
    assert!(picture.starts_with("<svg") && picture.len() < 1_500_000 && picture.matches("<path d=").count() > 1000);
    assert!(folder.read("needle.vtu").contains("NumberOfCells=\"16758\""));
    // The same bytes again.
    folder.succeed(&format!("mesh refine --start kuhn3 {NEEDLE} --plot again.svg --quiet"));
    assert_eq!(folder.read("again.svg"), picture);

    let text = folder.succeed("mesh box --lower=-1,0,0 --upper 1,0.5,2 --cells 4,1,4 --plot box.svg --out box.vtu");
    assert!(text.contains("96 tetrahedra") && text.contains("volume        2"), "{text}");
    let report = json(&folder.succeed("mesh box --lower 0,0 --upper 0.1,0.1 --cells 8,8 --json --plot slab.svg"));
    assert_eq!((&report["cells"], &report["vertices"]), (&Value::from(128), &Value::from(81)));
    assert!(folder.has("slab.svg") && folder.has("box.svg") && folder.has("box.vtu"));
}

#[test]
fn quality_is_told_in_tables_bars_and_pictures() {
    let folder = Folder::new();
    let text = folder.succeed("mesh quality kuhn3:4x4x4 --plot q.svg");
    for part in ["384 tetrahedra in 3 dimensions, 1 part", "dihedral angle (deg)         45", "####", "No faults."] {
        assert!(text.contains(part), "no {part} in {text}");
    }
    assert!(folder.read("q.svg").contains(">quality q</text>"));
    let report = json(&folder.succeed("mesh quality kuhn2 --json --plot q2.svg"));
    assert_eq!((&report["is_mesh"], &report["findings"]), (&Value::Bool(true), &Value::Array(vec![])));
    let angles = &report["quality"]["measures"][0];
    assert_eq!(
        (&angles["measure"], &angles["count"], &angles["beyond"][0]["count"]),
        (&Value::from("angle"), &Value::from(6), &Value::from(0))
    );
    let report = json(&folder.succeed("mesh quality kuhn4 --json"));
    assert_eq!((&report["cells"], &report["dimension"]), (&Value::from(24), &Value::from(4)));
}

#[test]
fn help_is_there_for_every_command() {
    let folder = Folder::new();
    let all = folder.succeed("mesh");
    for command in ["box", "refine", "coarsen", "quality", "convert", "remesh"] {
        assert!(all.contains(command), "{all}");
        assert!(folder.succeed(&format!("mesh {command} --help")).contains("Examples:"));
    }
}

#[test]
fn hostile_arguments_are_refused_in_one_line() {
    let folder = Folder::new();
    for (arguments, parts) in [
        (
            "mesh refin",
            &["refin", "expected box, refine, coarsen, quality, convert or remesh", "nearest is refine"][..],
        ),
        ("mesh refine", &["--start"]),
        ("mesh refine --start kuhn2", &["--size"]),
        ("mesh refine --start kuhn5 --size 1", &["--start: found kuhn5", "expected kuhn2, kuhn3, kuhn4"]),
        ("mesh refine --start= --size 1", &["--start: found nothing"]),
        ("mesh refine --start kuhn3:2x2 --size 1", &["--start: found kuhn3:2x2", "3 whole numbers", "kuhn3:7x7x7"]),
        ("mesh refine --start kuhn3:0x1x1 --size 1", &["--start: found kuhn3:0x1x1"]),
        ("mesh refine --start kuhn2:99999999x99999999 --size 1", &["--start", "cells are too many"]),
        ("mesh refine --start kuhn2 --size 0", &["--size: found 0, expected a length greater than 0"]),
        ("mesh refine --start kuhn2 --size -1", &["--size: found -1"]),
        ("mesh refine --start kuhn2 --size nan", &["--size: found nan"]),
        ("mesh refine --start kuhn2 --size inf", &["--size: found inf"]),
        ("mesh refine --start kuhn2 --size 1e-300", &["--size: found 1e-300", "slots are needed"]),
        ("mesh refine --start kuhn2 --point 0.3,0.3 --size 1e-300", &["--size"]),
        ("mesh refine --start kuhn2 --point 0.3 --size 1", &["--point: found 1 number in 0.3, expected 2 numbers"]),
        ("mesh refine --start kuhn2 --point 1,2,3 --size 1", &["--point: found 3 numbers", "kuhn2 has 2 dimensions"]),
        ("mesh refine --start kuhn2 --point nan,0 --size 1", &["--point: found `nan` in nan,0"]),
        ("mesh refine --start kuhn2 --point= --size 1", &["--point: found nothing"]),
        ("mesh refine --start kuhn2 --point 1e200,0 --size 1", &["--point", "1e200"]),
        (
            "mesh refine --start kuhn3 --segment=0,0,0,1,1 --size 1",
            &["--segment: found 5 numbers", "expected 6 numbers, two points"],
        ),
        ("mesh refine --start kuhn2 --segment=0,0,1,1 --point 0,0 --size 1", &["--segment", "--point"]),
        ("mesh refine --start kuhn2 --uniform 3 --size 1", &["--uniform", "--size"]),
        ("mesh refine --start kuhn2 --uniform 3 --point 0,0", &["--uniform", "--point"]),
        ("mesh refine --start kuhn2 --uniform 0", &["--uniform: found 0"]),
        ("mesh refine --start kuhn2 --uniform 60", &["--uniform: found 60", "slots are needed"]),
        ("mesh refine --start kuhn2 --uniform 999999", &["--uniform: found 999999"]),
        ("mesh refine --start kuhn2 --size 1 --rule shortest", &["--rule: found shortest"]),
        ("mesh refine --start kuhn2 --size 1 --out a.xyz", &["--out: found a.xyz"]),
        ("mesh refine --start kuhn2 --size 1 --plot a.png", &["--plot: found a.png", ".svg"]),
        ("mesh refine --start kuhn4 --size 1 --plot a.svg", &["--plot", "4 dimensions"]),
        ("mesh refine --start kuhn4 --size 1 --out a.vtu", &["--out", "4 dimensions"]),
        ("mesh refine --start kuhn2 --size 1 --out no/such/folder/a.vtu", &["no/such/folder/a.vtu"]),
        ("mesh refine --start kuhn2 --size 1 --plot no/such/folder/a.svg", &["no/such/folder/a.svg"]),
        ("mesh box --lower 0 --upper 1 --cells 1", &["--lower", "2 or 3 numbers"]),
        ("mesh box --lower 0,0 --upper 1,x --cells 1,1", &["--upper: found `x` in 1,x"]),
        ("mesh box --lower 0,0 --upper 1,1,1 --cells 1,1", &["--upper: found 1,1,1, expected 2 numbers"]),
        ("mesh box --lower 0,0 --upper 0,1 --cells 1,1", &["--upper", "axis 0"]),
        ("mesh box --lower 0,0 --upper 1,1 --cells 0,1", &["--cells: found 0,1"]),
        ("mesh box --lower 0,0 --upper 1,1 --cells 1,1.5", &["--cells: found 1,1.5"]),
        ("mesh box --lower 0,0,0 --upper 1,1,1 --cells 100000,100000,100000", &["--cells", "too many"]),
        ("mesh quality", &["MESH"]),
        ("mesh quality missing.msh", &["missing.msh"]),
        ("mesh quality kuhn2 --merge 1", &["--repair"]),
        ("mesh quality kuhn2 --merge -1 --repair a.vtu", &["--merge: found -1"]),
        ("mesh quality kuhn2 --plot a.pdf", &["--plot: found a.pdf"]),
    ] {
        refuses(&folder, arguments, parts);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "bad input leaves no files");
}

#[test]
fn ctrl_c_ends_a_long_refinement_with_its_report() {
    let folder = Folder::new();
    let mut command = folder.command("mesh refine --start kuhn2 --uniform 24 --json --quiet --out big.vtu");
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Ended at once if it comes before the program listens, which is as well.
    std::thread::sleep(Duration::from_millis(250));
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(status.success());
    let began = Instant::now();
    let output = child.wait_with_output().unwrap();
    assert!(began.elapsed() < Duration::from_secs(60));
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(stderr(&output).contains("stopped by Ctrl-C"), "{}", stderr(&output));
    let report = json(std::str::from_utf8(&output.stdout).unwrap());
    assert_eq!(report["interrupted"], Value::Bool(true));
    assert!(report["leaves"].as_u64().unwrap() < 1 << 25);
    assert!(!folder.has("big.vtu"));
}
