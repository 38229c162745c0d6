//! Runs from the outside: the summary, the files, and what a run does not do.

use crate::support::{Folder, json, stderr, table, without_seconds};
use serde_json::Value;

/// An insertion of a second or less.
const SHORT: &str = "slab2d-insertion --set needle.speed=0.5 --set needle.depth=0.03";

fn stage_names(summary: &Value) -> Vec<&str> {
    summary["stages"].as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn json_is_one_object_with_the_documented_keys() {
    let folder = Folder::new();
    let output = folder.run(&format!("run {SHORT} --json --no-files --probe 0.05,0.05 --threads 2"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let summary = json(std::str::from_utf8(&output.stdout).unwrap());
    for key in [
        "schema",
        "scene",
        "converged",
        "interrupted",
        "dofs",
        "nodes",
        "elements",
        "steps",
        "wall_s",
        "update_hz",
        "energy_j",
        "solver",
        "needle",
        "probes",
        "quality",
        "stages",
    ] {
        assert!(summary.get(key).is_some(), "no {key}");
    }
    for (table, keys) in [
        ("solver", &["iterations_total", "iterations_mean", "iterations_max", "relative_residual"][..]),
        ("needle", &["tip", "tip_reference", "base_force", "base_torque", "rearrangements"]),
        ("quality", &["min_angle_deg", "max_angle_deg", "min_quality"]),
    ] {
        for key in keys {
            assert!(summary[table].get(key).is_some(), "no {table}.{key}");
        }
    }
    assert_eq!((&summary["schema"], &summary["scene"]), (&json("1"), &json("\"slab2d-insertion\"")));
    assert_eq!((&summary["converged"], &summary["interrupted"]), (&Value::Bool(true), &Value::Bool(false)));
    assert_eq!(summary["dofs"].as_u64(), summary["nodes"].as_u64().map(|n| 2 * n));
    assert_eq!(summary["probes"][0]["at"], json("[0.05, 0.05]"));
    let pushed = summary["probes"][0]["displacement"][0].as_f64().unwrap();
    assert!((1e-6..0.05).contains(&pushed), "{pushed} m along the needle");
    assert!(summary["stages"]["solve"]["calls"].as_u64() >= summary["steps"].as_u64());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "--no-files writes nothing");
}

#[test]
fn a_run_pays_only_for_the_stages_it_needs() {
    let folder = Folder::new();
    let summary = |arguments: &str| json(&folder.succeed(&format!("run {arguments} --json --quiet --no-files")));
    let (linear, load) = (summary(SHORT), summary("slab2d-static"));
    let nonlinear = summary(&format!("{SHORT} --set material.model=neo-hookean --set material.poisson=0 --steps 3"));
    for absent in ["load", "relocate", "force", "linearize"] {
        assert!(!stage_names(&linear).contains(&absent), "a linear insertion runs {absent}");
    }
    for absent in ["move", "locate", "rearrange", "release", "force", "linearize", "relocate"] {
        assert!(!stage_names(&load).contains(&absent), "a static load runs {absent}");
    }
    for present in ["mesh", "assemble", "refine", "load", "solve"] {
        assert!(stage_names(&load).contains(&present), "a static load does not report {present}");
    }
    for present in ["move", "locate", "refine", "capture", "solve", "rearrange", "release"] {
        assert!(stage_names(&linear).contains(&present), "an insertion does not report {present}");
    }
    for present in ["force", "linearize"] {
        assert!(stage_names(&nonlinear).contains(&present), "a neo-Hookean insertion does not report {present}");
    }
}

#[test]
fn an_insertion_writes_all_its_files() {
    let folder = Folder::new();
    let text = folder.succeed(&format!("run {SHORT} --set output.frames=20 --save-state 25 --out o"));
    for part in ["converged", "needle tip", "base force", "solve", "share", "Files in o:", "mesh.svg"] {
        assert!(text.contains(part), "no `{part}` in\n{text}");
    }
    let summary = json(&folder.read("o/summary.json"));
    let steps = summary["steps"].as_u64().unwrap() as usize;

    let (head, rows) = table(&folder.read("o/history.csv"));
    let first = "step,time_s,depth_m,tip_x,tip_y,base_force_x,base_force_y,base_torque,iterations,cycles,needle_nodes,nodes,elements,move_s";
    assert!(head.join(",").starts_with(first), "{head:?}");
    assert!(head.iter().any(|name| name == "solve_s") && !head.iter().any(|name| name == "linearize_s"));
    assert_eq!(rows.len(), steps);
    let column = |name: &str| head.iter().position(|n| n == name).unwrap();
    for (index, row) in rows.iter().enumerate() {
        assert_eq!(row[column("step")], (index + 1).to_string());
    }
    let iterations: u64 = rows.iter().map(|row| row[column("iterations")].parse::<u64>().unwrap()).sum();
    assert_eq!(Some(iterations), summary["solver"]["iterations_total"].as_u64());
    let last: f64 = rows[steps - 1][column("base_force_x")].parse().unwrap();
    assert_eq!(Some(last), summary["needle"]["base_force"][0].as_f64());

    let due: Vec<usize> = (1..=steps).filter(|step| step % 20 == 0 || *step == steps).collect();
    let frames = std::fs::read_dir(folder.path().join("o/frames")).unwrap().count();
    assert_eq!(frames, 2 * due.len(), "a mesh and a needle for each of {due:?}");
    for (name, kind) in [("body.pvd", "step"), ("needle.pvd", "needle")] {
        let pvd = folder.read(&format!("o/{name}"));
        assert_eq!(pvd.matches("<DataSet").count(), due.len());
        for step in &due {
            assert!(pvd.contains(&format!("frames/{kind}_{step:06}.vtu")), "{step} in {pvd}");
        }
    }
    for step in (1..=steps).filter(|step| step % 25 == 0 || *step == steps) {
        assert!(folder.has(&format!("o/state/step_{step:06}.state")));
    }
    for name in ["mesh.svg", "force.svg", "iterations.svg"] {
        check_svg(name, &folder.read(&format!("o/{name}")));
    }
    let leftover = |entry: std::fs::DirEntry| entry.file_name().to_string_lossy().contains(".part");
    assert!(!std::fs::read_dir(folder.path().join("o")).unwrap().any(|entry| leftover(entry.unwrap())));
}

#[test]
fn frames_hold_mesh_fields_and_needle() {
    let folder = Folder::new();
    let summary = json(&folder.succeed("run slab2d-static --json --quiet --out o"));
    let vtu = std::fs::read(folder.path().join("o/frames/step_000001.vtu")).unwrap();
    let text = String::from_utf8_lossy(&vtu);
    let (nodes, cells) = (summary["nodes"].as_u64().unwrap(), summary["elements"].as_u64().unwrap());
    assert!(
        text.contains(&format!("NumberOfPoints=\"{nodes}\"")) && text.contains(&format!("NumberOfCells=\"{cells}\""))
    );
    for field in ["displacement", "stress_p", "region", "needle_node"] {
        assert!(text.contains(&format!("Name=\"{field}\"")), "no field {field}");
    }
    check_tags("step_000001.vtu", &text);
    let needle = std::fs::read(folder.path().join("o/frames/needle_000001.vtu")).unwrap();
    assert!(String::from_utf8_lossy(&needle).contains("NumberOfPoints=\"2\""));
    // One cycle makes no chart.
    assert!(folder.has("o/mesh.svg") && !folder.has("o/force.svg") && !folder.has("o/iterations.svg"));
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let folder = Folder::new();
    for scene in [SHORT, "slab2d-sideways --set needle.speed=0.2 --set needle.depth=0.01"] {
        let run = |threads: usize| {
            let arguments = format!("run {scene} --threads {threads} --probe 0.05,0.05 --probe 0.01,0.06");
            let summary = json(&folder.succeed(&format!("{arguments} --json --quiet --out t{threads}")));
            (summary, without_seconds(&folder.read(&format!("t{threads}/history.csv"))))
        };
        let ((one, rows_one), (two, rows_two)) = (run(1), run(2));
        assert_eq!(rows_one, rows_two);
        for key in ["probes", "needle", "energy_j", "solver", "quality", "nodes"] {
            assert_eq!(one[key], two[key], "{key} of {scene}");
        }
    }
}

#[test]
fn a_resumed_run_gives_the_same_bits() {
    let folder = Folder::new();
    for (scene, cut) in [
        (SHORT, 17),
        ("slab2d-insertion --set needle.speed=1 --set needle.depth=0.02 --set needle.rearrange=settle", 9),
        ("slab2d-sideways --set needle.speed=0.2 --set needle.depth=0.01", 11),
    ] {
        let common = format!("{scene} --set output.frames=5 --probe 0.03,0.05 --quiet --json");
        let whole = json(&folder.succeed(&format!("run {common} --out whole")));
        let first = json(&folder.succeed(&format!("run {common} --out cut --steps {cut} --save-state 1000")));
        assert_eq!((&first["interrupted"], &first["converged"]), (&Value::Bool(true), &Value::Bool(true)));
        assert_eq!(first["steps"].as_u64(), Some(cut));
        let state = format!("cut/state/step_{cut:06}.state");
        let second = json(&folder.succeed(&format!("run {common} --out cut --resume {state}")));
        for key in ["probes", "needle", "energy_j", "solver", "quality", "nodes", "steps", "converged"] {
            assert_eq!(whole[key], second[key], "{key} of {scene}");
        }
        assert_eq!(
            without_seconds(&folder.read("whole/history.csv")),
            without_seconds(&folder.read("cut/history.csv"))
        );
        assert_eq!(folder.read("whole/body.pvd"), folder.read("cut/body.pvd"));
        let frame = format!("frames/step_{:06}.vtu", whole["steps"].as_u64().unwrap());
        let bytes = |run: &str| std::fs::read(folder.path().join(run).join(&frame)).unwrap();
        assert_eq!(bytes("whole"), bytes("cut"), "the last frame of {scene}");
        std::fs::remove_dir_all(folder.path().join("cut")).unwrap();
    }
}

#[test]
fn a_run_that_cannot_converge_ends_with_3_and_keeps_its_files() {
    let folder = Folder::new();
    let output = folder.run(&format!("run {SHORT} --set solver.max_iterations=1 --json --out o"));
    let line = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{line}");
    let summary = json(std::str::from_utf8(&output.stdout).unwrap());
    assert_eq!(summary["converged"], Value::Bool(false));
    let (count, first) = (&summary["solver"]["unconverged_solves"], &summary["solver"]["first_unconverged_cycle"]);
    assert!(line.contains(&format!("{count} solves did not reach solver.tolerance")), "{line}");
    assert!(line.contains(&format!("the first in cycle {first};")) && line.contains("files kept in o"), "{line}");
    assert!(count.as_u64().unwrap() > 0 && first.as_u64().unwrap() > 0);
    assert_eq!(json(&folder.read("o/summary.json")), summary);
    assert!(folder.has("o/mesh.svg") && folder.has("o/history.csv"));
}

#[test]
fn a_step_that_fails_is_named_and_the_steps_before_it_are_kept() {
    let folder = Folder::new();
    // No residual is as small as this: the first cycle has no forces, the second stalls at rounding errors.
    let impossible = "--set solver.tolerance=1e-14 --set solver.round_off=0 --set solver.criterion=external";
    let output = folder.run(&format!("run slab2d-insertion --set needle.speed=1 {impossible} --json --quiet --out o"));
    let line = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{line}");
    assert!(line.lines().count() == 1 && line.contains("files kept in o"), "{line}");
    let summary = json(std::str::from_utf8(&output.stdout).unwrap());
    let cycle = summary["steps"].as_u64().unwrap();
    assert!(line.contains(&format!("slab2d-insertion: cycle {cycle}: ")), "{line}");
    assert_eq!(summary["converged"], Value::Bool(false));
    assert!(line.contains(summary["failure"].as_str().unwrap()), "{line}");
    assert_eq!(json(&folder.read("o/summary.json")), summary);
    assert_eq!(table(&folder.read("o/history.csv")).1.len() as u64, cycle - 1, "one row for each cycle that succeeded");
    assert!(folder.has("o/mesh.svg") && folder.has(&format!("o/frames/step_{cycle:06}.vtu")));
}

#[test]
fn a_finished_run_resumes_to_the_same_end() {
    let folder = Folder::new();
    for scene in ["slab2d-static", SHORT] {
        let end = json(&folder.succeed(&format!("run {scene} --save-state 1000 --json --quiet --out o")));
        let state = format!("o/state/step_{:06}.state", end["steps"].as_u64().unwrap());
        let again = json(&folder.succeed(&format!("run {scene} --resume {state} --json --quiet --out again")));
        for key in ["steps", "converged", "interrupted", "energy_j", "needle"] {
            assert_eq!(end[key], again[key], "{key} of {scene}");
        }
        assert_eq!(without_seconds(&folder.read("o/history.csv")), without_seconds(&folder.read("again/history.csv")));
    }
}

#[test]
fn scenes_are_listed_shown_and_documented() {
    let folder = Folder::new();
    let list = folder.succeed("scenes");
    for name in ["slab2d-static", "slab2d-insertion", "slab2d-tilted", "slab2d-sideways"] {
        let line = list.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("no {name}"));
        assert!(line.len() > name.len() + 10, "{line}");
        // What is shown is a scene file that runs as the built-in scene does.
        folder.file("mine.toml", folder.succeed(&format!("scenes --show {name}")));
        let of = |scene: &str| json(&folder.succeed(&format!("run {scene} --steps 2 --json --quiet --no-files")));
        assert_eq!(of("mine.toml")["energy_j"], of(name)["energy_j"]);
    }
    let schema = folder.succeed("scenes --schema");
    for key in ["mesh.h_start", "material.poisson", "solver.tolerance", "needle.rearrange", "output.frames"] {
        assert!(schema.contains(key), "no {key} in the schema");
    }
    assert!(folder.succeed("--version").starts_with("stylet 0."));
    for help in ["", "--help", "run --help", "scenes --help", "bench --help"] {
        let text = folder.succeed(help);
        assert!(text.contains("stylet") && text.contains("Usage:"), "{help}: {text}");
    }
}

#[test]
fn a_built_in_name_wins_over_a_file_of_that_name() {
    let folder = Folder::new();
    folder.file("slab2d-static", folder.succeed("scenes --show slab2d-static").replace("h_ref = 6", "h_ref = 4"));
    let nodes =
        |scene: &str| json(&folder.succeed(&format!("run {scene} --json --quiet --no-files")))["nodes"].as_u64();
    assert!(nodes("slab2d-static") > nodes("./slab2d-static"));
}

fn check_svg(name: &str, text: &str) {
    assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{name}");
    assert!(!text.contains("NaN") && !text.contains("inf"), "{name} holds a number that is none");
    check_tags(name, text);
}

/// Whether every tag of an XML text is closed, in order.
fn check_tags(name: &str, text: &str) {
    let mut open: Vec<&str> = Vec::new();
    for tag in text.split('<').skip(1).map(|part| part.split('>').next().unwrap()) {
        if tag.starts_with(['?', '!']) || tag.ends_with('/') {
            continue;
        }
        match tag.strip_prefix('/') {
            Some(closed) => assert_eq!(open.pop(), Some(closed.trim()), "{name}"),
            None => open.push(tag.split_whitespace().next().unwrap()),
        }
    }
    assert!(open.is_empty(), "{name} leaves {open:?} open");
}
