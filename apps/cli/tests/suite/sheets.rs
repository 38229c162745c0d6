//! Bodies in two dimensions: thin sheets in plane stress, slices of long bodies in plane strain.

use crate::support::{Folder, json, stderr};
use serde_json::Value;

/// A strip 0.1 m long and 0.02 m wide, stretched by a fifth between ends on which it may narrow.
const STRIP: &str = "\
[mesh]
size = [0.1, 0.02]
cells = [8, 2]
thickness = 0.005

[[constraint]]
side = \"left\"
components = [1.0, 0.0]

[[constraint]]
side = \"bottom\"
components = [0.0, 1.0]

[[constraint]]
side = \"right\"
components = [1.0, 0.0]
offset = [0.02, 0.0]

[solver]
tolerance = 1e-10

[statics]
";

fn run(folder: &Folder, more: &str) -> Value {
    json(&folder.succeed(&format!("run s.toml --json --quiet --no-files {more}")))
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {value}"))
}

/// Uniaxial stress: the stretch of the free sides, width and thickness alike, is that of the solid (validation A).
#[test]
fn a_stretched_strip_narrows_and_thins_as_its_solid_does() {
    let folder = Folder::new();
    folder.file("s.toml", STRIP);
    for (model, poisson, free) in [
        ("linear", 0.45, 1.0 - 0.2 * 0.45),
        ("corotated", 0.45, 1.0 - 0.2 * 0.45),
        ("st-venant-kirchhoff", 0.45, (1.0f64 - 0.44 * 0.45).sqrt()),
        ("neo-hookean", 0.34, 0.937295),
        ("neo-hookean", 0.49, 0.914391),
        ("invertible-neo-hookean", 0.45, 0.920459),
        ("fixed-corotated", 0.34, 0.936736),
        ("fixed-corotated", 0.49, 0.914325),
    ] {
        let set = format!("--set material.model={model} --set material.poisson={poisson} --probe 0.1,0.02");
        let end = run(&folder, &set);
        let narrowed = number(&end, "/probes/0/displacement/1");
        assert!((narrowed - (free - 1.0) * 0.02).abs() < 0.6e-6 * 0.02, "{model}: {narrowed} m for stretch {free}");
        let volume = number(&end, "/body/volume_m3") / (0.1 * 0.02 * 0.005);
        assert!((volume - 1.2 * free * free).abs() < 3e-6, "{model}: volume {volume}");
        assert_eq!(end["body"]["warnings"], Value::Array(Vec::new()), "a sheet does not lock");
    }
}

/// Across a slice of a long body nothing moves: small strains narrow it by `nu/(1 - nu)`.
#[test]
fn a_slice_of_a_long_body_does_not_thin() {
    let folder = Folder::new();
    folder.file("s.toml", STRIP);
    let strain = "--set material.plane=strain --set material.model=linear --probe 0.1,0.02";
    for nu in [0.0, 0.3, 0.45] {
        let end = run(&folder, &format!("{strain} --set material.poisson={nu}"));
        let narrowed = number(&end, "/probes/0/displacement/1") / 0.02;
        assert!((narrowed + 0.2 * nu / (1.0 - nu)).abs() < 1e-8, "{narrowed} at nu {nu}");
        let volume = number(&end, "/body/volume_m3") / (0.1 * 0.02 * 0.005);
        assert!((volume - 1.2 * (1.0 + narrowed)).abs() < 1e-8, "{volume} at nu {nu}");
    }
    let locked = run(&folder, &format!("{strain} --set material.poisson=0.495"));
    assert!(locked["body"]["warnings"][0].as_str().unwrap().contains("lock"), "{locked}");
}

#[test]
fn sheets_without_thickness_are_reported() {
    let folder = Folder::new();
    let both = STRIP.replace(
        "side = \"right\"\ncomponents = [1.0, 0.0]\noffset = [0.02, 0.0]",
        "side = \"right\"\ncomponents = [1.0, 0.0]\noffset = [0.05, 0.0]\n\n[[constraint]]\nside = \"top\"\ncomponents = [0.0, 1.0]\noffset = [0.0, 0.01]",
    );
    folder.file("s.toml", both);
    // Stretched by half both ways at nu = 0.45, St. Venant-Kirchhoff has no thickness left (validation A).
    let end = run(&folder, "--set material.model=invertible-st-venant-kirchhoff --set material.poisson=0.45");
    let warning = end["body"]["warnings"][0].as_str().unwrap_or_else(|| panic!("{end}"));
    assert!(warning.contains("material.plane: found 32 elements") && warning.contains("no thickness"), "{warning}");
    let output = folder
        .run("run s.toml --quiet --no-files --set material.model=st-venant-kirchhoff --set material.poisson=0.45");
    let line = stderr(&output);
    assert_eq!((output.status.code(), line.lines().count()), (Some(3), 1), "{line}");
    let sound = run(&folder, "--set material.model=neo-hookean --set material.poisson=0.45");
    assert_eq!(sound["body"]["warnings"], Value::Array(Vec::new()));
    let volume = number(&sound, "/body/volume_m3") / (0.1 * 0.02 * 0.005);
    assert!((volume - 1.5 * 1.5 * 0.479673).abs() < 3e-6, "{volume}");
}

#[test]
fn frames_of_a_sheet_show_its_thickness() {
    let folder = Folder::new();
    folder.file("s.toml", STRIP);
    let has = |more: &str| {
        folder.succeed(&format!("run s.toml --quiet --out o {more}"));
        String::from_utf8_lossy(&std::fs::read(folder.path().join("o/frames/step_000001.vtu")).unwrap())
            .contains("Name=\"thickness_stretch\"")
    };
    assert!(has("") && has("--set material.model=linear"));
    assert!(!has("--set material.plane=strain"));
}

/// Crushed sheets come back as crushed cubes do.
#[test]
fn crushed_sheets_recover() {
    let folder = Folder::new();
    let scene = folder.succeed("scenes --show crush-recover");
    folder.file("s.toml", scene.replace("0.1, 0.1, 0.1", "0.1, 0.1").replace("8, 8, 8", "6, 6"));
    for model in ["corotated", "fixed-corotated"] {
        for shape in ["point", "plane", "line", "scramble"] {
            let set = format!("--set material.model={model} --set start.shape={shape} --set time.end=2");
            let end = run(&folder, &set);
            let (error, j) = (number(&end, "/body/max_displacement_m"), number(&end, "/body/min_j"));
            assert!(error < 1e-3 * 0.1 && j > 0.9, "{model}, {shape}: {error} m from rest, smallest J {j}");
        }
    }
}

/// A free sheet falls as a point does, whatever its law does inside.
#[test]
fn a_free_sheet_falls() {
    let folder = Folder::new();
    folder.file(
        "s.toml",
        "[mesh]\nsize = [0.1, 0.05]\ncells = [4, 2]\nthickness = 0.01\n[[load]]\ngravity = [0.0, -10.0]\n\
         [time]\ndt = 0.01\nend = 0.2\nnewton = \"full\"\n[solver]\ntolerance = 1e-9\n",
    );
    for more in
        ["", "--set material.plane=strain", "--set material.model=linear", "--set material.model=stable-neo-hookean"]
    {
        let end = run(&folder, more);
        let mass = 1000.0 * 0.1 * 0.05 * 0.01;
        assert!((number(&end, "/body/mean_displacement_m/1") + 0.5 * 10.0 * 0.04).abs() < 1e-9, "{more}: {end}");
        assert!((number(&end, "/body/momentum/1") + mass * 10.0 * 0.2).abs() < 1e-9 * mass, "{more}: {end}");
    }
}
