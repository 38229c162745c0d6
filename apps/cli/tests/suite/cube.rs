//! Needles into a cube: from every side, at an angle, in and out; and those that never enter, or would leave behind it.

use crate::support::{Folder, json, refuses};
use serde_json::Value;

const COARSE: &str = "cube3d-insertion --no-files --set mesh.fold=12 --set needle.speed=2";

fn run(folder: &Folder, more: &str) -> Value {
    let end = json(&folder.succeed(&format!("run {COARSE} --json --quiet {more}")));
    assert_eq!(end["converged"], Value::Bool(true), "{more}: {end}");
    assert_eq!(end["quality"]["inverted_elements"], 0, "{more}: {end}");
    end
}

fn vector(value: &Value) -> [f64; 3] {
    std::array::from_fn(|k| value[k].as_f64().unwrap_or_else(|| panic!("no vector in {value}")))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// The base is pushed against the tissue, and the material at the tip is pushed ahead of it, by millimetres.
fn enters(folder: &Folder, more: &str, tip: [f64; 3], along: [f64; 3]) {
    for model in ["linear", "neo-hookean"] {
        let end = run(folder, &format!("--set material.model={model} {more}"));
        let needle = &end["needle"];
        assert!(distance(vector(&needle["tip"]), tip) < 1e-9, "{model} {more}: {needle}");
        let material = vector(&needle["tip_reference"]);
        assert!(distance(material, tip) < 6e-3, "{model} {more}: {needle}");
        assert!(needle["nodes"].as_u64() >= Some(4), "{model} {more}: {needle}");
        let force = vector(&needle["base_force"]);
        let push: f64 = (0..3).map(|k| force[k] * along[k]).sum();
        assert!(push > 0.1, "{model} {more}: {push} N along the needle, {needle}");
    }
}

#[test]
fn needles_enter_from_every_side() {
    let folder = Folder::new();
    let quarter = std::f64::consts::FRAC_PI_2;
    let middle = 0.05;
    for (entry, angle, elevation, along, clamped) in [
        ([0.0, middle, middle], 0.0, 0.0, [1.0, 0.0, 0.0], "bottom"),
        ([0.1, middle, middle], 2.0 * quarter, 0.0, [-1.0, 0.0, 0.0], "bottom"),
        ([middle, 0.0, middle], quarter, 0.0, [0.0, 1.0, 0.0], "right"),
        ([middle, 0.1, middle], -quarter, 0.0, [0.0, -1.0, 0.0], "right"),
        ([middle, middle, 0.0], 0.0, quarter, [0.0, 0.0, 1.0], "right"),
        ([middle, middle, 0.1], 0.0, -quarter, [0.0, 0.0, -1.0], "bottom"),
    ] {
        let tip = std::array::from_fn(|k| entry[k] + 0.065 * along[k]);
        let more = format!(
            "--set needle.entry={entry:?} --set needle.angle={angle} --set needle.elevation={elevation} \
             --set support.clamped={clamped}"
        );
        enters(&folder, &more.replace(", ", ","), tip, along);
    }
}

#[test]
fn needles_enter_at_an_angle() {
    let folder = Folder::new();
    let (angle, elevation): (f64, f64) = (0.3, -0.4);
    let along = [elevation.cos() * angle.cos(), elevation.cos() * angle.sin(), elevation.sin()];
    let entry = [0.0, 0.03, 0.08];
    let tip = std::array::from_fn(|k| entry[k] + 0.06 * along[k]);
    let more = "--set needle.entry=[0.0,0.03,0.08] --set needle.angle=0.3 --set needle.elevation=-0.4";
    enters(&folder, &format!("{more} --set needle.depth=0.06"), tip, along);
    // Along the diagonal, through a corner, which is an edge of the mesh.
    let (angle, elevation) = (std::f64::consts::FRAC_PI_4, (0.5f64.sqrt()).atan());
    let more =
        format!("--set needle.entry=[0.0,0.0,0.1] --set needle.angle={angle} --set needle.elevation=-{elevation}");
    let along = [1.0, 1.0, -1.0].map(|x: f64| x / 3f64.sqrt());
    let tip = [0.0, 0.0, 0.1].into_iter().zip(along).map(|(x, t)| x + 0.065 * t).collect::<Vec<f64>>();
    enters(&folder, &more, [tip[0], tip[1], tip[2]], along);
}

#[test]
fn a_needle_that_is_drawn_out_leaves_nothing() {
    let folder = Folder::new();
    for entry in ["[0.0,0.05,0.05]", "[0.0,0.03,0.08] --set needle.angle=0.3 --set needle.elevation=-0.4"] {
        let motion = "needle.motion=[{depth=0.03,insert=0.03},{depth=0.07,insert=-0.01}]";
        let end = run(&folder, &format!("--set {motion} --set needle.entry={entry} --set solver.tolerance=1e-8"));
        let needle = &end["needle"];
        assert_eq!((&needle["nodes"], &needle["sticking"]), (&0.into(), &0.into()), "{entry}: {needle}");
        assert!(distance(vector(&needle["base_force"]), [0.0; 3]) < 1e-6, "{entry}: {needle}");
        assert!(end["energy_j"].as_f64().unwrap() < 1e-12, "{entry}: {end}");
    }
}

#[test]
fn needles_that_miss_the_cube_or_would_leave_it() {
    let folder = Folder::new();
    for (set, parts) in [
        // Out of the back, in one stride or by its motion.
        ("needle.depth=0.12", &["needle.depth: found 0.12", "tip at (0.1200, 0.0500, 0.0500) m", "0 to 0.1 m"][..]),
        (
            "needle.motion=[{depth=0.12,insert=0.12}]",
            &["needle.motion, insert of row 1: found 0.12", "tip in the cube"],
        ),
        ("needle.elevation=1.2", &["needle.depth: found 0.065", "tip at", "expected a tip in the cube"]),
        ("needle.angle=3", &["needle.depth: found 0.065", "tip at (-0.0643"]),
        // Beside it, inside it, along it.
        ("needle.entry=[0.0,0.3,0.05]", &["needle.entry: found [0.0, 0.3, 0.05]", "point of the cube's boundary"]),
        ("needle.entry=[0.05,0.05,0.05]", &["needle.entry", "point of the cube's boundary"]),
        ("needle.entry=[0.0,0.05,0.0]", &["needle.angle: found 0", "along a side of the cube"]),
        ("needle.entry=[0.0,0.05]", &["needle.entry"]),
        ("needle.radius=0.2", &["needle.radius: found 0.2", "a quarter of mesh.side"]),
        ("needle.radius=-1", &["needle.radius: found -1"]),
    ] {
        refuses(&folder, &format!("run {COARSE} --set {set}"), parts);
    }
}
