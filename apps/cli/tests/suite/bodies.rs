//! Scenes of bodies from the outside: the built-in ones, a mesh of one's own, what a scene pays for, and going on.

use crate::support::{Folder, json, stderr, without_seconds};
use serde_json::Value;

fn summary(folder: &Folder, arguments: &str) -> Value {
    json(&folder.succeed(&format!("run {arguments} --json --quiet --no-files")))
}

fn number(summary: &Value, path: &str) -> f64 {
    summary.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {summary}"))
}

#[test]
fn built_in_scenes_come_to_their_end() {
    let folder = Folder::new();
    let bend = summary(&folder, "beam-bend");
    assert_eq!(bend["converged"], Value::Bool(true));
    // Beam theory, w L^4 / (8 E I) with w = rho g A, for a slender beam in small strains; this one is short and soft.
    let theory = 1000.0 * 9.81 * 0.04_f64.powi(2) * 0.2_f64.powi(4) / (8.0 * 1e5 * 0.04_f64.powi(4) / 12.0);
    let tip = number(&bend, "/body/max_displacement_m");
    assert!((0.5..1.3).contains(&(tip / theory)), "{tip} m, theory {theory} m");
    let twist = summary(&folder, "beam-twist --probe 0.2,0.0,0.0 --probe 0.2,0.02,0.02");
    // A corner of the turned end goes to the next corner; its middle stays.
    let moved = &twist["probes"][0]["displacement"];
    for (k, expected) in [0.0, 0.04, 0.0].into_iter().enumerate() {
        assert!((moved[k].as_f64().unwrap() - expected).abs() < 1e-12, "{moved}");
    }
    assert!(number(&twist, "/probes/1/displacement/1").abs() < 1e-12);
    assert!(number(&twist, "/body/min_j") > 0.3 && number(&twist, "/energy_j") > 0.0, "{twist}");
}

#[test]
fn a_block_that_is_let_go_falls_with_gravity() {
    let folder = Folder::new();
    let common = "block-drop --set mesh.cells=[3,3,3] --set solver.tolerance=1e-8";
    let momentum = |end: f64| number(&summary(&folder, &format!("{common} --set time.end={end}")), "/body/momentum/2");
    // 1 kg of tissue: after its release momentum grows by its weight, whatever the swinging.
    let (early, late) = (momentum(0.4), momentum(0.5));
    assert!((late - early + 9.81 * 0.1).abs() < 1e-4, "{early} to {late} kg m/s");
}

#[test]
fn crushed_cubes_recover() {
    let folder = Folder::new();
    for shape in ["point", "plane", "line", "scramble"] {
        let common = "crush-recover --set mesh.cells=[4,4,4] --set time.end=2";
        let end = summary(&folder, &format!("{common} --set start.shape={shape}"));
        let (error, j) = (number(&end, "/body/max_displacement_m"), number(&end, "/body/min_j"));
        assert!(error < 1e-3 * 0.1 && j > 0.9, "{shape}: {error} m from rest, smallest J {j}");
    }
}

#[test]
fn a_scene_pays_only_for_what_it_uses() {
    let folder = Folder::new();
    let bend = "beam-bend --set mesh.cells=[5,2,2]";
    let names = |summary: &Value| summary["stages"].as_object().unwrap().keys().cloned().collect::<Vec<_>>(); // ascending
    let linear = summary(&folder, &format!("{bend} --set material.model=linear --set statics.method=cg"));
    assert_eq!(names(&linear), ["assemble", "constrain", "load", "mesh", "solve"]);
    assert_eq!(number(&linear, "/body/elements_linearized"), 0.0, "no law is evaluated, so no rotation is sought");
    let nonlinear = summary(&folder, bend);
    assert!(!names(&nonlinear).contains(&"mass".to_owned()) && number(&nonlinear, "/body/elements_linearized") > 0.0);
    let moving = summary(&folder, "block-drop --set mesh.cells=[2,2,2] --steps 2");
    assert_eq!(names(&moving), ["assemble", "constrain", "force", "linearize", "load", "mass", "mesh", "solve"]);
    let linear = summary(&folder, "block-drop --set mesh.cells=[2,2,2] --steps 2 --set material.model=linear");
    assert_eq!(names(&linear), ["assemble", "constrain", "load", "mass", "mesh", "solve"]);
    assert!(number(&moving, "/bytes/total") > 0.0 && number(&moving, "/bytes/per_element") > 0.0);
    for absent in ["move", "locate", "rearrange", "capture"] {
        assert!(!names(&moving).contains(&absent.to_owned()), "a scene without contact runs {absent}");
    }
}

#[test]
fn every_method_and_preconditioner_finds_one_equilibrium() {
    let folder = Folder::new();
    let bend = "beam-bend --set mesh.cells=[6,2,2] --set solver.tolerance=1e-8 --probe 0.2,0.02,0.04";
    let tip = |more: &str| number(&summary(&folder, &format!("{bend} {more}")), "/probes/0/displacement/2");
    let expected = tip("");
    for method in ["newton-cg", "polak-ribiere", "hager-zhang", "l-bfgs"] {
        let found = tip(&format!("--set statics.method={method} --set solver.max_iterations=100000"));
        assert!((found / expected - 1.0).abs() < 1e-5, "{method}: {found} for {expected}");
    }
    let linear = "--set material.model=linear";
    let expected = tip(&format!("{linear} --set statics.method=llt"));
    for method in ["cg", "ldlt", "newton-cg"] {
        let found = tip(&format!("{linear} --set statics.method={method}"));
        assert!((found / expected - 1.0).abs() < 1e-5, "{method}: {found} for {expected}");
    }
    for kind in ["none", "jacobi", "block-jacobi", "ssor", "ic0", "chebyshev", "aggregation", "factor"] {
        let found = tip(&format!("{linear} --set statics.method=cg --set solver.preconditioner={kind}"));
        assert!((found / expected - 1.0).abs() < 1e-5, "{kind}: {found} for {expected}");
    }
}

#[test]
fn a_moving_body_goes_on_with_the_same_bits() {
    let folder = Folder::new();
    for scene in ["block-drop --set mesh.cells=[3,3,3]", "crush-recover --set mesh.cells=[3,3,3] --set time.end=0.4"] {
        let common = format!("{scene} --probe 0.03,0.04,0.02 --json --quiet");
        let whole = json(&folder.succeed(&format!("run {common} --out whole --threads 2")));
        folder.succeed(&format!("run {common} --out cut --steps 7 --save-state 100"));
        let second = json(&folder.succeed(&format!("run {common} --out cut --resume cut/state/step_000007.state")));
        for key in ["probes", "energy_j", "solver", "steps", "converged"] {
            assert_eq!(whole[key], second[key], "{key} of {scene}");
        }
        let rows = |run: &str| without_seconds(&folder.read(&format!("{run}/history.csv")));
        assert_eq!(rows("whole"), rows("cut"));
        let frame = format!("frames/step_{:06}.vtu", whole["steps"].as_u64().unwrap());
        let bytes = |run: &str| std::fs::read(folder.path().join(run).join(&frame)).unwrap();
        assert_eq!(bytes("whole"), bytes("cut"), "the last frame of {scene}");
        for run in ["whole", "cut"] {
            std::fs::remove_dir_all(folder.path().join(run)).unwrap();
        }
    }
}

/// The scene of `examples/two-regions`, as it stands there.
#[test]
fn a_mesh_of_ones_own_runs_from_end_to_end() {
    let folder = Folder::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/two-regions/two-regions.toml");
    let end = json(&folder.succeed(&format!("run {scene} --json --quiet --out o --probe 0.02,0.02,0.05")));
    assert_eq!(end["converged"], Value::Bool(true));
    let vtu =
        String::from_utf8_lossy(&std::fs::read(folder.path().join("o/frames/step_000001.vtu")).unwrap()).into_owned();
    assert!(vtu.contains("Name=\"region\"") && folder.has("o/mesh.svg"));
    // A stiff layer on a soft one, pressed down: in a column of one material the top would sink evenly.
    let top = number(&end, "/probes/0/displacement/2");
    let soft = json(&folder.succeed(&format!(
        "run {scene} --json --quiet --no-files --set region=[{{name=\"stiff\"}}] --probe 0.02,0.02,0.05"
    )));
    let alone = number(&soft, "/probes/0/displacement/2");
    assert!(top < 0.0 && alone < 1.2 * top, "{top} m with a stiff layer, {alone} m without");
}

#[test]
fn a_failed_solve_says_why() {
    let folder = Folder::new();
    let output = folder.run("run beam-bend --no-files --quiet --set material.young=34 --set mesh.size=[50,10,10]");
    let line = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{line}");
    assert!(
        line.lines().count() == 1 && line.contains("would strain") && line.contains("material.young = 34"),
        "{line}"
    );
    let locked = summary(&folder, "beam-bend --set mesh.cells=[4,2,2] --set material.poisson=0.49");
    assert!(locked["body"]["warnings"][0].as_str().unwrap().contains("lock"), "{locked}");
}
