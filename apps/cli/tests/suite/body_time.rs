//! Scenes of bodies in motion: loads on a segment and for a while, lazy stiffness, steps that adapt, threads.

use crate::support::{Folder, json, table, without_seconds};
use serde_json::Value;

fn run(folder: &Folder, arguments: &str) -> Value {
    json(&folder.succeed(&format!("run {arguments} --json --quiet")))
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {value}"))
}

/// A force along a segment through a free cube gives it momentum until it ends, and none of it is lost.
#[test]
fn a_force_along_a_segment_acts_for_a_while() {
    let folder = Folder::new();
    folder.file(
        "s.toml",
        "[mesh]\ncells = [3, 3, 3]\n[[load]]\nfrom = [0.02, 0.05, 0.05]\nto = [0.08, 0.05, 0.05]\n\
         force = [0.3, 0.0, 0.1]\nuntil = 0.055\n[time]\ndt = 0.01\nend = 0.1\nnewton = \"full\"\n\
         [solver]\ntolerance = 1e-9\n",
    );
    let momentum = |end: f64| {
        let end = run(&folder, &format!("s.toml --no-files --set time.end={end}"));
        [0, 1, 2].map(|k| number(&end, &format!("/body/momentum/{k}")))
    };
    // What a step may leave of its residual, N: 1e-8 of E L^2.
    let left = 1e-8 * 34e3 * 0.1 * 0.1;
    for seconds in [0.03, 0.05] {
        let p = momentum(seconds);
        for (found, force) in p.into_iter().zip([0.3, 0.0, 0.1]) {
            assert!((found - force * seconds).abs() < left * seconds, "{p:?} after {seconds} s");
        }
    }
    let (after, later) = (momentum(0.07), momentum(0.1));
    for k in 0..3 {
        assert!((after[k] - later[k]).abs() < left * 0.03, "{after:?} and {later:?} without a force");
    }
    assert!(later[0] > 0.3 * 0.05 - left && later[0] < 0.3 * 0.06 + left, "{later:?}");
}

#[test]
fn lazy_stiffness_saves_work_and_stays_near() {
    let folder = Folder::new();
    let drop =
        "block-drop --no-files --set mesh.cells=[4,4,4] --set time.newton=one --set time.end=0.2 --probe 0.05,0.05,0.0";
    let sum = |lazy: f64| {
        let end = run(&folder, &format!("{drop} --set time.lazy={lazy}"));
        (number(&end, "/body/elements_linearized"), number(&end, "/probes/0/displacement/2"))
    };
    let ((all, exact), (some, near)) = (sum(0.0), sum(1e-3));
    assert_eq!(all, 40.0 * 384.0, "an eager step evaluates every element");
    assert!(some > 0.0 && some < 0.7 * all, "{some} of {all} stiffnesses");
    assert!(exact < -1e-3 && (near / exact - 1.0).abs() < 1e-3, "{near} m, without laziness {exact} m");
    // A threshold below every change keeps nothing but what is at rest at the start.
    let (most, same) = sum(1e-12);
    assert!(most > 0.95 * all && (same / exact - 1.0).abs() < 1e-6, "{most} of {all}, {same} for {exact}");
    // By the other measures in N/m; an entry of the stiffness of an element is some 500 N/m.
    for (measure, threshold) in [("stiffness", 3.0), ("rotation", 1.0)] {
        let end = run(&folder, &format!("{drop} --set time.lazy={threshold} --set time.lazy_measure={measure}"));
        let (some, near) = (number(&end, "/body/elements_linearized"), number(&end, "/probes/0/displacement/2"));
        assert!(some > 0.0 && some < 0.9 * all, "{measure}: {some} of {all} stiffnesses");
        assert!((near / exact - 1.0).abs() < 0.02, "{measure}: {near} m, without laziness {exact} m");
    }
}

#[test]
fn adaptive_steps_meet_their_tolerance_and_the_end() {
    let folder = Folder::new();
    let drop = "block-drop --set mesh.cells=[2,2,2] --set time.end=0.25 --set output.frames=0 --probe 0.05,0.05,0.0";
    let tip = |more: &str, out: &str| {
        let end = run(&folder, &format!("{drop} {more} --out {out}"));
        (number(&end, "/probes/0/displacement/2"), number(&end, "/body/time_s"), number(&end, "/steps"))
    };
    let (exact, end, _) = tip("--set time.dt=0.0005", "fine");
    assert!((end - 0.25).abs() < 1e-12);
    let (coarse, end, few) = tip("--set time.dt=0.002 --set time.adaptive=1e-4", "coarse");
    assert!((end - 0.25).abs() < 1e-12, "{end}");
    let (fine, _, many) = tip("--set time.dt=0.002 --set time.adaptive=1e-6", "adaptive");
    assert!(many > few, "{many} steps for the tighter tolerance, {few} for the wider");
    assert!((fine - exact).abs() < (coarse - exact).abs().max(2e-5), "{coarse}, {fine}, {exact}");
    assert!((fine - exact).abs() < 5e-5, "{fine} m, {exact} m by steps of 0.5 ms");
    // Steps of several lengths.
    let (head, rows) = table(&folder.read("adaptive/history.csv"));
    let column = head.iter().position(|name| name == "time_s").unwrap();
    let times: Vec<f64> = rows.iter().map(|row| row[column].parse().unwrap()).collect();
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (low, high) = steps.iter().fold((f64::INFINITY, 0.0f64), |(l, h), s| (l.min(*s), h.max(*s)));
    assert!(low > 0.0 && high > 1.5 * low, "steps from {low} to {high} s");
}

/// Enough elements that a team is woken.
#[test]
fn threads_do_not_change_a_bit() {
    let folder = Folder::new();
    let common = "block-drop --set mesh.cells=[9,9,9] --set time.newton=one --steps 4 --probe 0.03,0.04,0.02";
    let whole = |threads: u32| {
        let out = format!("t{threads}");
        let end = run(&folder, &format!("{common} --threads {threads} --out {out}"));
        let kept = ["probes", "energy_j", "body", "solver"].map(|key| end[key].clone());
        let frame = std::fs::read(folder.path().join(out.clone()).join("frames/step_000004.vtu")).unwrap();
        (kept, without_seconds(&folder.read(&format!("{out}/history.csv"))), frame)
    };
    let one = whole(1);
    for threads in [2, 8] {
        let other = whole(threads);
        assert_eq!(one.0, other.0, "{threads} threads");
        assert_eq!(one.1, other.1, "{threads} threads");
        assert!(one.2 == other.2, "the frame of {threads} threads");
    }
}

#[test]
fn memory_of_statics_counts_the_solver() {
    let folder = Folder::new();
    let bytes = |more: &str| number(&run(&folder, &format!("beam-bend --no-files {more}")), "/bytes/total");
    let linear = "--set material.model=linear --set statics.method=cg --set solver.preconditioner";
    let (nothing, incomplete) = (bytes(&format!("{linear}=none")), bytes(&format!("{linear}=ic0")));
    // The factor has the lower half of the matrix: blocks of 3 x 3 and a column for each of some 7 neighbours of a node.
    let nodes = 21.0 * 5.0 * 5.0;
    assert!(incomplete - nothing > nodes * 5.0 * 76.0, "{incomplete} with a factor, {nothing} without");
    let direct = bytes("--set material.model=linear --set statics.method=llt");
    assert!(direct > incomplete, "{direct} with the whole factor, {incomplete} with an incomplete one");
    let newton = bytes("");
    assert!(newton > nodes * 3.0 * 8.0 * 12.0, "{newton}");
}
