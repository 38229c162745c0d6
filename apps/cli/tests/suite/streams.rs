//! Closed streams, Ctrl-C, and what goes to which stream.
#![cfg(unix)]

use crate::support::{Folder, json, stderr, table};
use serde_json::Value;
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const SHORT: &str = "slab2d-insertion --set needle.speed=0.5 --set needle.depth=0.03";

fn shell(folder: &Folder, script: &str) -> Output {
    let mut command = Command::new("sh");
    command.args(["-c", script]).env("STYLET", env!("CARGO_BIN_EXE_stylet")).current_dir(folder.path());
    command.output().unwrap()
}

#[test]
fn a_closed_standard_output_ends_a_run_quietly() {
    let folder = Folder::new();
    for (name, redirection) in [("pipe", "| head -c 0"), ("closed", ">&-"), ("both", ">&- 2>&-")] {
        // The exit code of the first command of a pipe is written to a file.
        let script = format!("{{ \"$STYLET\" run {SHORT} --quiet --out {name}; echo $? > code; }} {redirection}");
        let output = shell(&folder, &script);
        assert!(output.stderr.is_empty(), "{redirection}: {}", stderr(&output));
        assert_eq!(folder.read("code").trim(), "0", "{redirection}");
        assert_eq!(json(&folder.read(&format!("{name}/summary.json")))["converged"], Value::Bool(true));
        assert!(folder.has(&format!("{name}/mesh.svg")));
    }
    for command in ["scenes", "scenes --schema", "--help"] {
        let output = shell(&folder, &format!("{{ \"$STYLET\" {command}; echo $? > code; }} | head -c 0"));
        assert!(output.stderr.is_empty(), "{command}: {}", stderr(&output));
        assert_eq!(folder.read("code").trim(), "0", "{command}");
    }
}

#[test]
fn a_full_standard_output_is_an_error_in_one_line() {
    let folder = Folder::new();
    let output = shell(&folder, &format!("\"$STYLET\" run {SHORT} --quiet --no-files > /dev/full"));
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).starts_with("stylet: standard output: ") && stderr(&output).lines().count() == 1);
}

/// Starts a run that would take minutes, and waits until its history has rows.
fn long_run(folder: &Folder) -> Child {
    let arguments = "run slab2d-insertion --set needle.speed=0.0001 --set mesh.h_ref=8 --json --out o";
    let mut command = folder.command(arguments);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let since = Instant::now();
    while std::fs::read_to_string(folder.path().join("o/history.csv")).map_or(0, |text| text.lines().count()) < 5 {
        assert!(since.elapsed() < Duration::from_secs(60), "no history");
        std::thread::sleep(Duration::from_millis(20));
    }
    child
}

fn interrupt(child: &Child) {
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

#[test]
fn ctrl_c_finishes_the_step_and_leaves_a_run_that_can_be_resumed() {
    let folder = Folder::new();
    let child = long_run(&folder);
    interrupt(&child);
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.status.signal()), (Some(130), None), "{}", stderr(&output));
    let summary = json(std::str::from_utf8(&output.stdout).unwrap());
    assert_eq!((&summary["interrupted"], &summary["converged"]), (&Value::Bool(true), &Value::Bool(false)));
    assert_eq!(json(&folder.read("o/summary.json")), summary);
    let steps = summary["steps"].as_u64().unwrap();
    assert_eq!(table(&folder.read("o/history.csv")).1.len() as u64, steps);
    let state = format!("o/state/step_{steps:06}.state");
    let line = stderr(&output);
    let last = line.lines().last().unwrap();
    assert!(last.contains("stopped by Ctrl-C") && last.contains(&state), "{line}");
    assert!(folder.has(&state) && folder.has("o/mesh.svg") && folder.has("o/force.svg") && folder.has("o/body.pvd"));
    let more = steps + 3;
    let arguments = format!(
        "run slab2d-insertion --set needle.speed=0.0001 --set mesh.h_ref=8 --json --quiet --resume {state} --steps {more}"
    );
    assert_eq!(json(&folder.succeed(&arguments))["steps"].as_u64(), Some(more));
}

#[test]
fn one_ctrl_c_may_arrive_twice() {
    let folder = Folder::new();
    let child = long_run(&folder);
    interrupt(&child);
    interrupt(&child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(folder.has("o/summary.json") && stderr(&output).contains("stopped by Ctrl-C"));
}

#[test]
fn quiet_runs_say_nothing_on_standard_error() {
    let folder = Folder::new();
    let output = folder.run(&format!("run {SHORT} --quiet --no-files"));
    assert!(output.status.success() && output.stderr.is_empty() && !output.stdout.is_empty());
}
