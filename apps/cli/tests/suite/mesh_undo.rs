//! `stylet mesh coarsen` and `stylet mesh remesh`: what is done is undone.
#![cfg(unix)]

use crate::support::{Folder, json, refuses, table};
use serde_json::{Value, json as value};

const NEEDLE: &str = "--segment=-0.01,0.431,0.527,0.713,0.489,0.561 --size 0.0078125";

fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key} in {report}"))
}

#[test]
fn coarsening_gives_the_start_mesh_back() {
    let folder = Folder::new();
    let restored = value!({ "ids": true, "vertex_sets": true, "positions": true });
    for rule in ["longest-edge", "colouring"] {
        for arguments in [
            format!("kuhn3 {NEEDLE}"),
            "kuhn2:3x2 --point 0.3141,0.2718 --size 1e-5".to_owned(),
            "kuhn4 --uniform 9".to_owned(),
        ] {
            let report = json(&folder.succeed(&format!("mesh coarsen --start {arguments} --rule {rule} --json")));
            assert_eq!(report["restored"], restored, "{arguments}");
            assert_eq!((&report["leaves"], &report["vertices"]), (&report["leaves_start"], &report["vertices_start"]));
            let gone = report["vertices_refined"].as_u64().unwrap() - report["vertices"].as_u64().unwrap();
            assert!(gone > 100 && report["vertices_removed"] == gone, "{report}");
            assert!(number(&report, "seconds_refine") > 0.0 && number(&report, "seconds_coarsen") > 0.0);
        }
    }
    let text = folder.succeed(&format!("mesh coarsen --start kuhn3 {NEEDLE} --plot c.svg --out c.vtu"));
    for part in ["16758 leaves", "6 leaves, 8 vertices, 3127 removed", "back: same ids, vertex sets, positions"] {
        assert!(text.contains(part), "no {part} in {text}");
    }
    assert!(folder.has("c.svg") && folder.read("c.vtu").contains("NumberOfCells=\"6\""));
}

#[test]
fn what_is_kept_is_what_refinement_there_alone_makes() {
    let folder = Folder::new();
    for (start, fine, kept) in [
        ("kuhn3", "--uniform 15", "segment=-0.01,0.431,0.527,0.713,0.489,0.561 --SIZE 0.1"),
        ("kuhn2", "--size 0.01", "point=0.5,0.5 --SIZE 0.02"),
        ("kuhn2:2x3", "--uniform 9", "SIZE 0.2"),
        ("kuhn4", "--uniform 10", "point=0.3,0.6,0.2,0.7 --SIZE 0.6"),
    ] {
        let keep = format!("--keep-{}", kept.replace("SIZE", "keep-size")).replace("--keep-keep", "--keep");
        let report = json(&folder.succeed(&format!("mesh coarsen --start {start} {fine} {keep} --json")));
        let alone = format!("--{}", kept.replace("SIZE", "size"));
        let direct = json(&folder.succeed(&format!("mesh refine --start {start} {alone} --json")));
        assert_eq!(
            (&report["leaves"], &report["vertices"]),
            (&direct["leaves"], &direct["vertices"]),
            "{start} {keep}"
        );
        assert!(report["leaves"].as_u64() < report["leaves_refined"].as_u64(), "{report}");
        assert_eq!(report["restored"]["ids"], false);
    }
    let text = folder.succeed("mesh coarsen --start kuhn2 --size 0.01 --keep-point 0.5,0.5");
    assert!(text.contains("not back, as some of the refinement was kept"), "{text}");
}

#[test]
fn needles_leave_no_trace() {
    let folder = Folder::new();
    folder.file("path.txt", "# tip\n0.43, 0.52, 1.02 # outside\n\n0.46 0.5 0.6\n0.55,0.45,0.3\n");
    for arguments in [
        "--mesh kuhn3:6x6x6 --path path.txt --cycles 2 --step 0.02",
        "--mesh kuhn3:5x5x5 --path random --seed 7",
        "--mesh kuhn3:5x5x5 --path curved --cycles 2 --step 0.02",
        "--mesh kuhn2:12x12",
    ] {
        let report =
            json(&folder.succeed(&format!("mesh remesh {arguments} --json --quiet --out steps.csv --plot deep.svg")));
        assert_eq!(report["topology_restored"], true, "{arguments}");
        assert_eq!(report["max_position_error"], 0.0, "{arguments}");
        assert_eq!(report["cycles_restored"], report["cycles"]);
        let done = &report["operations"];
        let splits: u64 =
            ["edge_splits", "face_splits", "cell_splits"].iter().map(|key| done[key].as_u64().unwrap()).sum();
        assert!(splits > 0 && done["undone"] == splits, "{arguments}: {done}");
        assert!(report["most_nodes"].as_u64().unwrap() >= 2);
        let angles = [number(&report, "min_angle_deg"), number(&report, "max_angle_deg")];
        assert!(angles[0] > 0.0 && angles[1] < 180.0 && number(&report, "microseconds_per_step") > 0.0);

        let (head, rows) = table(&folder.read("steps.csv"));
        assert_eq!(head.join(" "), "cycle step motion depth min_angle_deg max_angle_deg operations microseconds");
        assert_eq!(report["steps"], rows.len(), "{arguments}");
        let of = |row: &Vec<String>, column: usize| row[column].parse::<f64>().unwrap();
        let deep = |row: &&Vec<String>| of(row, 3) > 20.0;
        let least = rows.iter().filter(deep).map(|row| of(row, 4)).fold(180.0, f64::min);
        assert!((least - angles[0]).abs() < 1e-5, "{arguments}: {least}, {angles:?}");
        let operations: f64 = rows.iter().map(|row| of(row, 6)).sum();
        assert_eq!(operations, (2 * splits + done["snaps"].as_u64().unwrap()) as f64);
        assert_eq!((rows[0][2].as_str(), rows[rows.len() - 1][2].as_str()), ("in", "out"));
        assert_eq!(rows[rows.len() - 1][3], "0");
        assert!(folder.read("deep.svg").contains("needle of "));
    }
    let text = folder.succeed("mesh remesh --mesh kuhn3:4x4x4 --path path.txt --out table");
    for part in ["384 tetrahedra", "1 cycle in and out", "topology back in 1 of 1 cycle", "table/steps.csv"] {
        assert!(text.contains(part), "no {part} in {text}");
    }
    assert!(folder.has("table/steps.csv"));
    // A path that stays outside is followed, and said not to be in the mesh.
    folder.file("outside.txt", "2 2\n3 2\n");
    let text = folder.succeed("mesh remesh --mesh kuhn2:4x4 --path outside.txt");
    assert!(text.contains("never in the mesh"), "{text}");
}

#[test]
fn hostile_arguments_are_refused_in_one_line() {
    let folder = Folder::new();
    folder.file("ok.txt", "0.4 0.5 1.1\n0.5 0.5 0.5\n");
    folder.file("two.txt", "0.4 0.5 1.1\n0.5 0.5\n");
    folder.file("word.txt", "0.4 0.5 1.1\n# fine\n0.5 up 0.5\n");
    folder.file("one.txt", "0.4 0.5 1.1\n");
    folder.file("inside.txt", "0.41 0.52 0.53\n0.5 0.5 0.2\n");
    folder.file("huge.txt", "0.4 0.5 1e300\n0.5 0.5 0.2\n");
    folder.file("none.txt", "");
    folder.file("bytes.txt", [0xff, 0xfe, 0x00]);
    let before = std::fs::read_dir(folder.path()).unwrap().count();
    for (arguments, parts) in [
        ("mesh coarsen --start kuhn2", &["--size"][..]),
        ("mesh coarsen --start kuhn2 --uniform 3 --keep-point 0.5,0.5", &["--keep-size: found none"]),
        ("mesh coarsen --start kuhn2 --size 0.1 --keep-point 0.5", &["--keep-point: found 1 number"]),
        ("mesh coarsen --start kuhn2 --size 0.1 --keep-segment=0,0,1", &["--keep-segment: found 3 numbers"]),
        ("mesh coarsen --start kuhn2 --size 0.1 --keep-size nan", &["--keep-size: found nan"]),
        ("mesh coarsen --start kuhn2 --size 0.1 --keep-size 0", &["--keep-size: found 0"]),
        ("mesh coarsen --start kuhn2 --size 0.1 --keep-point 0,0 --keep-segment=0,0,1,1", &["--keep-"]),
        ("mesh coarsen --start kuhn2 --uniform 70", &["--uniform: found 70", "slots are needed"]),
        ("mesh coarsen --start kuhn2 --size 0.1 --out a.xyz", &["--out: found a.xyz"]),
        ("mesh coarsen --start kuhn4 --uniform 2 --plot a.svg", &["--plot", "4 dimensions"]),
        ("mesh remesh", &["--mesh"]),
        ("mesh remesh --mesh kuhn4", &["--mesh: found kuhn4, expected triangles"]),
        ("mesh remesh --mesh kuhn3 --path missing.txt", &["missing.txt"]),
        (
            "mesh remesh --mesh kuhn3 --path two.txt",
            &["two.txt: line 2: found 2 numbers in 0.5 0.5, expected 3 numbers"],
        ),
        ("mesh remesh --mesh kuhn3 --path word.txt", &["word.txt: line 3: found `up` in 0.5 up 0.5"]),
        ("mesh remesh --mesh kuhn3 --path one.txt", &["one.txt: found 1 position of", "at least 2"]),
        ("mesh remesh --mesh kuhn3 --path none.txt", &["none.txt: found 0 positions of the tip"]),
        ("mesh remesh --mesh kuhn3 --path bytes.txt", &["bytes.txt"]),
        ("mesh remesh --mesh kuhn2 --path ok.txt", &["ok.txt: line 1: found 3 numbers", "expected 2 numbers"]),
        ("mesh remesh --mesh kuhn3 --path inside.txt", &["inside.txt", "cycle 1", "starts inside the mesh"]),
        ("mesh remesh --mesh kuhn3 --path huge.txt", &["huge.txt", "the tip is 1e300"]),
        ("mesh remesh --mesh kuhn3 --path huge.txt --step 1e300", &["huge.txt", "1e300"]),
        ("mesh remesh --mesh kuhn3 --path=", &["--path: found nothing"]),
        ("mesh remesh --mesh kuhn3 --step 0", &["--step: found 0"]),
        ("mesh remesh --mesh kuhn3 --step 1e-300", &["--step: found 1e-300, expected at least"]),
        ("mesh remesh --mesh kuhn3 --cycles 0", &["--cycles: found 0"]),
        ("mesh remesh --mesh kuhn3 --seed -1", &["--seed: found -1"]),
        ("mesh remesh --mesh kuhn3 --out a.txt", &["--out: found a.txt", ".csv"]),
        ("mesh remesh --mesh kuhn3 --out=", &["--out: found "]),
        ("mesh remesh --mesh kuhn3:4x4x4 --path ok.txt --out no/folder/a.csv", &["no/folder/a.csv"]),
        ("mesh remesh --mesh kuhn3 --plot a.png", &["--plot: found a.png"]),
    ] {
        refuses(&folder, arguments, parts);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), before, "bad input leaves no files");
}
