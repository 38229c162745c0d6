//! `stylet mesh convert`, and mesh files in and out of the other commands.
#![cfg(unix)]

use crate::support::{Folder, json, refuses};
use serde_json::{Value, json as value};

/// Two tetrahedra of two regions, with three tagged triangles on the boundary, names, and a field.
const BLOCK: &str = "\
$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
2 31 \"skin\"
3 7 \"muscle\"
3 8 \"bone\"
$EndPhysicalNames
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
$NodeData
1
\"temperature\"
1
0.0
3
0
1
5
1 36.5
2 36.6
3 36.7
4 36.8
5 36.9
$EndNodeData
";

/// What a reader of the text formats sees in a legacy VTK file: the array after this word.
fn numbers_after(text: &str, word: &str) -> Vec<f64> {
    let at = text.find(word).unwrap_or_else(|| panic!("no {word} in {text}"));
    let lines = text[at..].lines().skip(1);
    let words = lines.flat_map(str::split_whitespace);
    words.map_while(|word| word.parse().ok()).collect()
}

#[test]
fn a_mesh_goes_around_all_formats_with_its_regions() {
    let folder = Folder::new();
    folder.file("a.msh", BLOCK);
    let steps = [
        ("a.msh", "b.msh", "msh41"),
        ("b.msh", "c.msh", "msh22-binary"),
        ("c.msh", "d.vtu", "vtu"),
        ("d.vtu", "e.vtk", "vtk-binary"),
        ("e.vtk", "f.msh", "msh41-binary"),
        ("f.msh", "g.node", "tetgen"),
        ("g.node", "h.vtk", "vtk"),
    ];
    for (from, to, format) in steps {
        let report = json(&folder.succeed(&format!("mesh convert {from} {to} --format {format} --json")));
        assert_eq!(report["format"], format);
        assert_eq!(report["vertices"], 5, "{to}");
        assert_eq!(report["cells"], value!({ "triangles": 3, "tetrahedra": 2 }), "{to}");
        assert_eq!(report["point_fields"], 1, "{to}");
    }
    // Names do not pass through VTK; as far as the second file they are there.
    for name in ["skin", "muscle", "bone"] {
        assert!(folder.read("b.msh").contains(name));
    }
    let text = folder.succeed("mesh convert b.msh i.vtu");
    assert!(text.contains("left out") && text.contains("temperature"), "{text}");

    let last = folder.read("h.vtk");
    let points = numbers_after(&last, "POINTS");
    assert_eq!(points, [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 1., 1., 1.]);
    let cells = [[4., 0., 1., 2., 3.], [4., 1., 2., 3., 4.]].concat();
    let facets = [[3., 0., 1., 2.], [3., 0., 1., 3.], [3., 4., 2., 3.]].concat();
    assert_eq!(numbers_after(&last, "CELLS"), [cells, facets].concat());
    assert_eq!(numbers_after(&last, "region 1 5"), [7., 8., 31., 31., 32.]);
    assert_eq!(numbers_after(&last, "attribute"), [36.5, 36.6, 36.7, 36.8, 36.9]);
}

#[test]
fn regions_and_boundary_tags_are_refined_and_written_back() {
    let folder = Folder::new();
    folder.file("a.msh", BLOCK);
    let report = json(&folder.succeed("mesh refine --start a.msh --uniform 3 --json --out fine.msh"));
    // Two cells, doubled three times; more because they are not of one kind.
    let leaves = report["leaves"].as_u64().unwrap();
    assert!(leaves >= 16 && report["dimension"] == 3);
    assert_eq!(report["notes"], value!(["field temperature"]));
    folder.succeed("mesh convert fine.msh fine22.msh --format msh22");
    let fine = folder.read("fine22.msh");
    // Three bisections halve a facet once or more; each half keeps the tag, and its name.
    let tagged =
        |tag: &str| fine.lines().filter(|line| line.split(' ').nth(1) == Some("2") && line.contains(tag)).count();
    assert!(tagged(" 31 ") >= 4 && tagged(" 32 ") >= 2, "{fine}");
    assert!(["skin", "muscle", "bone"].iter().all(|name| fine.contains(name)));
    let report = json(&folder.succeed("mesh quality fine.msh --json"));
    assert_eq!(
        (&report["cells"], &report["is_mesh"], &report["findings"]),
        (&leaves.into(), &true.into(), &value!([]))
    );

    // Back to the start: what was read comes out.
    let text = folder.succeed("mesh coarsen --start a.msh --uniform 6 --out back.msh");
    assert!(text.contains("back: same ids, vertex sets, positions"), "{text}");
    let report = json(&folder.succeed("mesh convert back.msh back.vtu --json"));
    assert_eq!(report["cells"], value!({ "triangles": 3, "tetrahedra": 2 }));

    // Surfaces and plane meshes.
    folder.file("skin.node", "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n");
    folder.file("skin.face", "4 1\n0 0 2 1 5\n1 0 1 3 5\n2 1 2 3 5\n3 2 0 3 5\n");
    let text = folder.succeed("mesh convert skin.face skin.stl");
    assert!(text.contains("left out") && text.contains("regions"), "{text}");
    let report = json(&folder.succeed("mesh refine --start skin.stl --uniform 2 --json"));
    assert!(report["leaves"].as_u64() >= Some(16) && report["dimension"] == 3, "{report}");
    folder.succeed("mesh box --lower 0,0 --upper 1,1 --cells 3,2 --out plane.node");
    let report = json(&folder.succeed("mesh quality plane.ele --json"));
    assert_eq!((&report["cells"], &report["dimension"]), (&12.into(), &2.into()));
    let report = json(&folder.succeed("mesh quality plane.ele --json --repair plane.vtu"));
    assert_eq!(report["repairs"], value!([]));
    assert!(folder.has("plane.vtu"));
}

#[test]
fn bad_files_and_names_are_refused_in_one_line() {
    let folder = Folder::new();
    folder.file("a.msh", BLOCK);
    folder.file("cut.msh", &BLOCK[..300]);
    folder.file("word.msh", BLOCK.replace("5 1 1 1", "5 1 one 1"));
    folder.file("flat.msh", BLOCK.replace("5 1 1 1", "5 1 0 0"));
    folder.file("lines.msh", BLOCK.replace("1 2 2 31 1 1 2 3", "1 1 2 31 1 1 2"));
    folder.file("points.node", "2 2 0 0\n0 0 0\n1 1 0\n");
    folder.file("empty.vtu", "");
    folder.file("noise", "no mesh at all");
    let before = std::fs::read_dir(folder.path()).unwrap().count();
    for (arguments, parts) in [
        ("mesh convert", &["IN"][..]),
        ("mesh convert a.msh", &["OUT"]),
        ("mesh convert a.msh b.xyz", &["OUT: found b.xyz", ".vtu"]),
        ("mesh convert a.msh b", &["OUT: found b,"]),
        ("mesh convert a.msh b.msh --format mhs22", &["--format: found mhs22", "nearest is msh22"]),
        ("mesh convert missing.msh b.vtu", &["missing.msh"]),
        ("mesh convert cut.msh b.vtu", &["cut.msh"]),
        ("mesh convert word.msh b.vtu", &["word.msh", "line 16", "one"]),
        ("mesh convert empty.vtu b.vtu", &["empty.vtu"]),
        ("mesh convert noise b.vtu", &["noise"]),
        ("mesh convert . b.vtu", &["."]),
        ("mesh convert a.msh no/folder/b.vtu", &["no/folder/b.vtu"]),
        ("mesh refine --start flat.msh --uniform 1", &["flat.msh: cell 1", "flat", "stylet mesh quality"]),
        ("mesh refine --start word.msh --uniform 1", &["word.msh", "line 16"]),
        ("mesh refine --start points.node --uniform 1", &["points.node: found no cells"]),
        ("mesh coarsen --start missing.vtk --uniform 1", &["missing.vtk"]),
        ("mesh remesh --mesh flat.msh", &["flat.msh: cell 1"]),
    ] {
        refuses(&folder, arguments, parts);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), before, "bad input leaves no files");
    let report = json(&folder.succeed("mesh quality flat.msh --json"));
    assert_eq!(report["is_mesh"], Value::Bool(false));
}
