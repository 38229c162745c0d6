//! Whatever is wrong with the input: exit code 2 and one line that names the thing, what was found and what was expected.

use crate::support::{Folder, expect_refusal, refuses};

#[test]
fn arguments() {
    let folder = Folder::new();
    for (arguments, parts) in [
        ("rum", &["rum", "expected scenes, run, bench, mesh or solve", "nearest is run"][..]),
        ("run", &["SCENE"]),
        ("run slab2d-static --setp mesh.h_ref=3", &["--setp", "nearest is --set"]),
        ("run slab2d-static extra", &["extra"]),
        ("run slab2d-static --threads 0", &["--threads: found 0, expected a whole number from 1 to 1024"]),
        ("run slab2d-static --threads 1025", &["--threads: found 1025"]),
        ("run slab2d-static --threads -1", &["--threads: found -1"]),
        ("run slab2d-static --threads 1.5", &["--threads: found 1.5"]),
        ("run slab2d-static --threads 99999999999999999999999", &["--threads"]),
        ("run slab2d-static --threads", &["--threads: found nothing"]),
        ("run slab2d-static --threads 1 --threads 2", &["--threads"]),
        ("run slab2d-static --steps 0", &["--steps: found 0, expected a whole number, at least 1"]),
        ("run slab2d-static --save-state 0", &["--save-state: found 0"]),
        ("run slab2d-static --no-files --out here", &["--no-files", "--out", "only one of the two"]),
        ("run slab2d-static --no-files --save-state 5", &["--no-files", "--save-state"]),
        ("run slab2d-static --out=", &["--out: found nothing, expected a folder"]),
        ("scenes --show slab2d-statik", &["--show: found slab2d-statik", "nearest is slab2d-static"]),
        ("scenes --show slab2d-static --schema", &["--show", "--schema"]),
        ("bench densiti", &["densiti", "nearest is density"]),
        ("bench", &["SUITE"]),
    ] {
        refuses(&folder, arguments, parts);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "bad input leaves no files");
}

#[test]
fn scenes_that_are_none() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path().join("a-folder")).unwrap();
    folder.file("empty.toml", "");
    folder.file("blank.toml", " \n\n");
    folder.file("garbage.toml", (0..4096u32).map(|i| (i * 197 % 256) as u8).collect::<Vec<u8>>());
    folder.file("zeros.toml", [0u8; 512]);
    folder.file("syntax.toml", "[mesh]\nh_ref = = 3\n");
    folder.file("nothing.toml", "# a comment\n");
    for (arguments, parts) in [
        ("run slab2d-insertoin", &["slab2d-insertoin", "nearest built-in scene is slab2d-insertion"][..]),
        ("run no/such/file.toml", &["no/such/file.toml", "no such file"]),
        ("run missing.toml", &["missing.toml", "no such file"]),
        ("run a-folder", &["a-folder", "is a folder, expected a scene"]),
        ("run empty.toml", &["empty.toml", "is empty, expected a scene"]),
        ("run blank.toml", &["blank.toml", "is empty"]),
        ("run garbage.toml", &["garbage.toml", "expected UTF-8 text"]),
        ("run zeros.toml", &["zeros.toml", "expected text"]),
        ("run syntax.toml", &["syntax.toml:2", "TOML"]),
        ("run nothing.toml", &["nothing.toml", "expected [statics], [time] or [needle]"]),
        ("run /dev/null", &["/dev/null", "is empty"]),
    ] {
        refuses(&folder, arguments, parts);
    }
}

#[test]
fn keys_of_a_scene_file() {
    let folder = Folder::new();
    let base = folder.succeed("scenes --show slab2d-insertion");
    for (old, new, parts) in [
        ("h_ref = 6", "h_rfe = 6", &["s.toml:", "mesh.h_rfe: unknown key", "nearest known key is mesh.h_ref"][..]),
        ("h_ref = 6", "h_ref = \"six\"", &["s.toml:", "mesh.h_ref: found", "six", "expected"]),
        ("h_ref = 6", "h_ref = 6.5", &["mesh.h_ref: found 6.5"]),
        ("poisson = 0.34", "poisson = 0.5", &["material.poisson: found 0.5", "less than 0.5|< 0.5|below 0.5"]),
        ("poisson = 0.34", "poisson = nan", &["material.poisson: found nan"]),
        ("young = 34000.0", "young = -1.0", &["material.young: found -1"]),
        ("young = 34000.0", "young = inf", &["material.young: found inf"]),
        ("model = \"linear\"", "model = \"hookean\"", &["material.model: found", "hookean", "neo-hookean"]),
        ("[friction]", "[fricton]", &["[fricton]: unknown table", "[friction]"]),
    ] {
        assert!(base.contains(old), "{old}");
        folder.file("s.toml", base.replace(old, new));
        let output = folder.run("run s.toml --no-files");
        // A part may hold alternatives.
        let line = crate::support::stderr(&output);
        let found: Vec<&str> =
            parts.iter().map(|part| part.split('|').find(|p| line.contains(p)).unwrap_or(part)).collect();
        expect_refusal(&output, &format!("run s.toml with {new}"), &found);
    }
}

#[test]
fn values_out_of_range() {
    let folder = Folder::new();
    for (set, parts) in [
        ("material.poisson=0.5", &["--set: material.poisson: found 0.5"][..]),
        ("material.poisson=nan", &["material.poisson: found nan"]),
        ("material.young=-34000", &["material.young: found -34000"]),
        ("material.young=0", &["material.young: found 0"]),
        ("mesh.h_start=60", &["mesh.h_start: found 60", "expected", "10"]),
        ("mesh.h_start=99999999999999999999", &["mesh.h_start"]),
        ("mesh.h_ref=2", &["mesh.h_ref: found 2, expected at least mesh.h_start = 3"]),
        ("solver.tolerance=0", &["solver.tolerance: found 0"]),
        ("solver.tolerance=1", &["solver.tolerance: found 1"]),
        ("solver.max_iterations=0", &["solver.max_iterations: found 0"]),
        ("solver.method=cgg", &["solver.method: found", "cgg", "nonlinear-cg"]),
        ("needle.speed=0", &["needle.speed: found 0"]),
        ("needle.speed=1e-300", &["needle.speed: found 1e-300"]),
        ("needle.depth=0.11", &["needle.depth: found 0.11", "tip"]),
        ("needle.depth=-0.01", &["needle.depth: found -0.01"]),
        ("needle.depth=1e-300", &["needle.depth: found", "expected at least 1e-13 m"]),
        ("needle.entry=[0.03,0.05]", &["needle.entry: found [0.03, 0.05]", "boundary"]),
        ("mesh.hstart=3", &["mesh.hstart: unknown key", "mesh.h_start"]),
        ("mesh.h_start", &["mesh.h_start", "key=value"]),
        ("=3", &["key=value"]),
        ("mesh.h_start=", &["mesh.h_start"]),
    ] {
        refuses(&folder, &format!("run slab2d-insertion --no-files --set {set}"), parts);
    }
    let cg = "run slab2d-sideways --no-files --set solver.method=cg";
    refuses(&folder, cg, &["solver.method: found cg", "newton-cg"]);
}

#[test]
fn probes() {
    let folder = Folder::new();
    for (probe, parts) in [
        ("0.2,0.05", &["--probe", "(0.2, 0.05)", "0 to 0.1 m"][..]),
        ("-0.001,0.05", &["--probe", "-0.001"]),
        ("0.05", &["--probe: found 1 number", "expected x,y in m"]),
        ("0.01,0.02,0.03", &["--probe: found 3 numbers", "2 dimensions"]),
        ("nan,0.05", &["--probe: found `nan`"]),
        ("0.05,1e999", &["--probe: found `1e999`"]),
        ("a,b", &["--probe: found `a`"]),
        (",", &["--probe: found ``"]),
    ] {
        refuses(&folder, &format!("run slab2d-static --no-files --probe {probe}"), parts);
    }
    // The whole boundary belongs to the body.
    folder.succeed("run slab2d-static --no-files --quiet --probe 0,0 --probe 0.1,0.1 --probe 0.1,0");
}

#[test]
fn folders_that_cannot_be_written() {
    let folder = Folder::new();
    // Below a regular file not even root can make a folder.
    folder.file("file", "x");
    refuses(&folder, "run slab2d-static --out file", &["file", "expected a folder"]);
    refuses(&folder, "run slab2d-static --out file/below", &["file/below"]);
    refuses(&folder, "run slab2d-static --out /proc/no-such-place", &["/proc/no-such-place"]);
    refuses(&folder, "bench density --quick --out file/below", &["file/below"]);
    // A folder where a file should go.
    std::fs::create_dir_all(folder.path().join("taken/history.csv")).unwrap();
    refuses(&folder, "run slab2d-static --out taken", &["taken/history.csv"]);
    assert_eq!(folder.read("file"), "x");
}

#[test]
fn needles_that_do_not_enter() {
    let folder = Folder::new();
    let along = "slab2d-insertion --set needle.entry=[0.02,0]";
    refuses(&folder, &format!("run {along}"), &["needle.angle: found 0", "along a side", "expected"]);
    // Out of the slab, by less than what once passed for a rounding error: no line for the load to act along.
    let outward = "slab2d-static --set needle.depth=1e-10 --set needle.angle=3";
    refuses(&folder, &format!("run {outward}"), &["needle.depth", "expected a tip in the slab"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "bad input leaves no files");
}

#[test]
fn motions_that_cannot_be() {
    let folder = Folder::new();
    for (rows, parts) in [
        ("{depth=0,insert=0.02},{depth=0.05,insert=0.07}", &["row 1 at depth 0", "insert 0.02", "starts outside"][..]),
        ("{depth=0.01,insert=0.01,sleeve=0.2}", &["insert of row 1", "tip at (0.0100, 0.2500) m"]),
        ("{depth=0.01,insert=0.01},{depth=0.01,insert=0.02}", &["depth 0.01 in row 2", "more than 0.01"]),
        ("{depth=0}", &["travel of 0"]),
        ("{insert=0.01}", &["depth"]),
        ("{depth=0.01,spin=1}", &["spin", "unknown"]),
    ] {
        refuses(&folder, &format!("run slab2d-insertion --no-files --set needle.motion=[{rows}]"), parts);
    }
}

#[test]
fn state_files() {
    let folder = Folder::new();
    let scene = "slab2d-insertion --set needle.speed=1 --set needle.depth=0.02 --quiet";
    folder.succeed(&format!("run {scene} --steps 4 --save-state 4 --out a"));
    let state = std::fs::read(folder.path().join("a/state/step_000004.state")).unwrap();
    let resume = |name: &str, content: &[u8], more: &str, parts: &[&str]| {
        folder.file(name, content);
        refuses(&folder, &format!("run {scene} {more} --no-files --resume {name}"), parts);
    };
    resume("empty.state", &[], "", &["empty.state", "expected a state file"]);
    resume("other.state", b"PNG but not really, and long enough", "", &["other.state", "expected a state file"]);
    resume("short.state", &state[..state.len() / 2], "", &["short.state", "damaged or truncated"]);
    let mut damaged = state.clone();
    damaged[state.len() / 2] ^= 1;
    resume("damaged.state", &damaged, "", &["damaged.state", "damaged"]);
    let differs = &["s.state", "mesh.h_ref = 6", "expected 5"];
    resume("s.state", &state, "--set mesh.h_ref=5", differs);
    refuses(&folder, "run slab2d-static --no-files --resume s.state", &["s.state", "found the state of a scene with"]);
    refuses(&folder, &format!("run {scene} --resume missing.state"), &["missing.state"]);
    refuses(&folder, &format!("run {scene} --resume a"), &["a: "]);
    // What is only written may differ.
    folder.succeed(&format!("run {scene} --no-files --set output.frames=3 --resume s.state"));
}

#[test]
fn hostile_names_stay_on_one_line() {
    let folder = Folder::new();
    let output = folder.command("run").arg("no\nsuch/scene\u{1b}[2J.toml").output().unwrap();
    expect_refusal(&output, "run with a line break", &["no"]);
    let output = folder.command("run slab2d-static --set").arg("mesh.h\nref=3\n4").output().unwrap();
    expect_refusal(&output, "--set with line breaks", &["--set"]);
    let output = folder.command("run slab2d-static --probe").arg("0.1\n,2").output().unwrap();
    expect_refusal(&output, "--probe with a line break", &["--probe"]);
}
