//! Scenes of bodies on mesh files of every format: one mesh, one result; and a state belongs to its mesh.

use crate::support::{Folder, json, refuses};

/// Two tetrahedra of two regions, with tagged triangles on the boundary.
const BLOCK: &str = "\
$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
5
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
5 1 1 1
$EndNodes
$Elements
5
1 2 2 31 1 1 2 3
2 2 2 31 1 1 2 4
3 2 2 32 1 5 3 4
4 4 2 7 1 1 2 3 4
5 4 2 8 1 2 3 4 5
$EndElements
";

const BY_TAGS: &str = "\
[mesh]
file = \"a.msh\"

[[region]]
name = \"stiff\"
tag = 8
young = 200000.0

[[constraint]]
tag = 31

[[load]]
tag = 32
traction = [500.0, 0.0, 300.0]

[statics]
";

/// A refined block in every format, tags and regions included.
fn formats(folder: &Folder) -> Vec<String> {
    folder.file("coarse.msh", BLOCK);
    folder.succeed("mesh refine --start coarse.msh --uniform 3 --out a.msh");
    let mut names = vec!["a.msh".to_owned()];
    for (name, format) in [
        ("old.msh", "msh22"),
        ("binary.msh", "msh41-binary"),
        ("a.vtu", "vtu"),
        ("a.vtk", "vtk"),
        ("binary.vtk", "vtk-binary"),
        ("a.node", "tetgen"),
    ] {
        folder.succeed(&format!("mesh convert a.msh {name} --format {format}"));
        names.push(name.to_owned());
    }
    names.push("a.ele".to_owned());
    names
}

#[test]
fn one_mesh_gives_one_result_in_every_format() {
    let folder = Folder::new();
    folder.file("s.toml", BY_TAGS);
    let mut expected = None;
    for name in formats(&folder) {
        let run = format!("run s.toml --json --quiet --no-files --probe 0.5,0.5,0.5 --set mesh.file={name}");
        let found = json(&folder.succeed(&run));
        let kept = ["energy_j", "probes", "nodes", "elements", "quality", "body"].map(|key| found[key].clone());
        assert!(found["body"]["max_displacement_m"].as_f64().unwrap() > 1e-3, "{name}: {found}");
        assert_eq!(*expected.get_or_insert_with(|| kept.clone()), kept, "{name}");
    }
    // The stiff region of the file is there: without it the body gives way further.
    let soft = json(&folder.succeed("run s.toml --json --quiet --no-files --set region=[{name=\"stiff\",tag=8}]"));
    let stiff = expected.unwrap();
    assert!(soft["body"]["max_displacement_m"].as_f64() > stiff[5]["max_displacement_m"].as_f64());
}

#[test]
fn a_plane_mesh_of_ones_own_is_a_sheet() {
    let folder = Folder::new();
    folder.succeed("mesh box --lower 0,0 --upper 0.1,0.02 --cells 10,2 --out sheet.vtu");
    folder.succeed("mesh convert sheet.vtu sheet.node --format tetgen");
    let ends = "constraint=[{side=\"left\"},{side=\"right\",offset=[0.01,0.0]}]";
    let run = |mesh: &str| {
        let scene = format!("[mesh]\n{mesh}\nthickness = 0.005\n[statics]\n");
        folder.file("s.toml", scene);
        let found = folder.succeed(&format!("run s.toml --json --quiet --no-files --probe 0.05,0.02 --set {ends}"));
        let found = json(&found);
        [found["energy_j"].clone(), found["probes"].clone()]
    };
    let made = run("size = [0.1, 0.02]\ncells = [10, 2]");
    let narrowed = made[1][0]["displacement"][1].as_f64().unwrap();
    assert!(narrowed < -1e-4, "a stretched sheet narrows: {narrowed} m");
    for file in ["sheet.vtu", "sheet.node", "sheet.ele"] {
        let read = run(&format!("file = \"{file}\""));
        let energy = |x: &[serde_json::Value; 2]| x[0].as_f64().unwrap();
        // Cells come in another order.
        assert!((energy(&read) / energy(&made) - 1.0).abs() < 1e-9, "{file}: {read:?} against {made:?}");
        let y = read[1][0]["displacement"][1].as_f64().unwrap();
        assert!((y - narrowed).abs() < 1e-9 * 0.02, "{file}: {y} against {narrowed}");
    }
}

#[test]
fn a_state_belongs_to_its_mesh() {
    let folder = Folder::new();
    let moving = BY_TAGS.replace("[statics]", "[time]\ndt = 0.01\nend = 0.05");
    folder.file("s.toml", &moving);
    formats(&folder);
    let start = "run s.toml --quiet --set mesh.file=old.msh";
    folder.succeed(&format!("{start} --steps 2 --save-state 2 --out o"));
    let resume = format!("{start} --resume o/state/step_000002.state --no-files");
    folder.succeed(&resume);
    let mesh = folder.read("old.msh");
    // Another place of one node, another tag, another order of two corners; more cells are named by their numbers.
    let moved = mesh.replacen("0.5", "0.51", 1);
    let tagged = mesh.replacen(" 4 2 8 ", " 4 2 7 ", 1);
    for changed in [moved, tagged] {
        assert_ne!(changed, mesh);
        folder.file("old.msh", changed);
        refuses(
            &folder,
            &resume,
            &["step_000002.state: found the state of a mesh of", "points", "checksum", "expected"],
        );
    }
    folder.succeed("mesh refine --start a.msh --uniform 1 --out fine.msh");
    folder.succeed("mesh convert fine.msh old.msh --format msh22");
    refuses(&folder, &resume, &["found the state of a mesh of", "expected"]);
    folder.file("old.msh", mesh);
    folder.succeed(&resume);
}
