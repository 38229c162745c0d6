//! Hostile input to scenes of bodies: exit code 2 and one line.

use crate::support::{Folder, refuses};

const STATIC: &str = "[mesh]\nfile = \"m.msh\"\n[[constraint]]\nplane = [0.0, 0.0, 1.0, 0.0]\n[statics]\n";

/// A Gmsh file of points and tetrahedra.
fn msh(points: &[[f64; 3]], tets: &[[usize; 4]]) -> String {
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", points.len());
    for (k, x) in points.iter().enumerate() {
        text += &format!("{} {:?} {:?} {:?}\n", k + 1, x[0], x[1], x[2]);
    }
    text += &format!("$EndNodes\n$Elements\n{}\n", tets.len());
    for (k, v) in tets.iter().enumerate() {
        text += &format!("{} 4 2 1 1 {} {} {} {}\n", k + 1, v[0], v[1], v[2], v[3]);
    }
    text + "$EndElements\n"
}

const TET: [[f64; 3]; 4] = [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];

#[test]
fn values_that_cannot_be() {
    let folder = Folder::new();
    for (set, parts) in [
        ("material.young=nan", &["--set: material.young: found nan"][..]),
        ("material.young=inf", &["material.young: found inf"]),
        ("material.young=-34000", &["material.young: found -34000"]),
        ("material.poisson=0.5", &["material.poisson: found 0.5"]),
        ("material.poisson=-1", &["material.poisson: found -1"]),
        ("material.density=0", &["material.density: found 0"]),
        ("material.model=hookean", &["material.model: found", "nearest is"]),
        ("mesh.cells=[0,1,1]", &["mesh.cells: found 0", "at least 1"]),
        ("mesh.cells=[1e9,1e9,1e9]", &["mesh.cells: found", "at most"]),
        ("mesh.cells=[2,2]", &["mesh.cells: found 2 numbers, expected 3"]),
        ("mesh.size=[1e308,1e308,1e308]", &["mesh"]),
        ("mesh.size=[0.1,-0.1,0.1]", &["mesh.size: found -0.1"]),
        ("mesh.file=none.msh", &["none.msh"]),
        ("constraint=[{side=\"left\",components=[1,2,0]}]", &["constraint (row 1): components: found 2"]),
        ("constraint=[{components=[1,0,0]}]", &["row 1", "found no place"]),
        ("constraint=[{side=\"lefft\"}]", &["constraint.side (row 1)", "nearest is \"left\""]),
        ("constraint=[{box=[5,5,5,6,6,6]}]", &["constraint (row 1): found no node", "the body reaches"]),
        ("constraint=[{tag=7,offset=[0,0,0]}]", &["constraint (row 1): tag: found no boundary with number 7"]),
        ("constraint=[{side=\"left\",normal=[1,0,0]}]", &["not held against", "translation along"]),
        ("constraint=[{side=\"left\",angle=1.0}]", &["angle without axis"]),
        ("load=[{gravity=[0,0,-9.81],force=[0,0,1]}]", &["row 1: found gravity and force"]),
        ("load=[{force=[0,0,1]}]", &["row 1: found force without a place"]),
        ("region=[{name=\"bone\"}]", &["region (row 1): name: found bone", "expected a tag, a box"]),
        ("statics.method=cg", &["statics.method: found cg"]),
        ("time.dt=0.1", &["time: found beside [statics]"]),
    ] {
        refuses(&folder, &format!("run beam-bend --no-files --set {set}"), parts);
    }
    let crushed = "run crush-recover --no-files --set material.model=neo-hookean";
    refuses(&folder, crushed, &["start.shape", "material.model"]);
    refuses(
        &folder,
        "run beam-bend --no-files --probe 1,1,1",
        &["--probe: found (1, 1, 1)", "undeformed body, which reaches"],
    );
    refuses(&folder, "run beam-bend --no-files --probe 1,1", &["expected x,y,z"]);
}

#[test]
fn meshes_that_are_none() {
    let folder = Folder::new();
    folder.file("s.toml", STATIC);
    let run = |content: &str, parts: &[&str]| {
        folder.file("m.msh", content);
        refuses(&folder, "run s.toml --no-files", parts);
    };
    run("", &["m.msh", "empty"]);
    run(&msh(&TET, &[]), &["m.msh: found"]);
    run(&msh(&TET, &[[1, 2, 3, 4], [1, 2, 3, 4]]), &["m.msh: ", "cell"]);
    run(&msh(&[[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.0]], &[[1, 2, 3, 4]]), &["m.msh: "]);
    run(&msh(&[[0.0; 3], [1e308, 0.0, 0.0], [0.0, 1e308, 0.0], [0.0, 0.0, 1e308]], &[[1, 2, 3, 4]]), &["m.msh: "]);
    run(&msh(&TET, &[[1, 2, 3, 4]]).replace("0.1 0.0 0.0", "nan 0.0 0.0"), &["m.msh"]);
    run(&msh(&TET, &[[1, 2, 3, 9]]), &["m.msh"]);
    // A second tetrahedron that nothing holds: the part is named.
    let far = TET.map(|x| [x[0] + 1.0, x[1], x[2] + 0.5]);
    let points: Vec<[f64; 3]> = TET.into_iter().chain(far).collect();
    run(&msh(&points, &[[1, 2, 3, 4], [5, 6, 7, 8]]), &["part 2 of 2", "vertex 4", "not held against"]);
}

#[test]
fn turned_and_doubled_cells_have_remedies() {
    let folder = Folder::new();
    folder.file("s.toml", STATIC);
    // The order of the corners of a cell does not matter.
    folder.file("m.msh", msh(&TET, &[[1, 3, 2, 4]]));
    folder.succeed("run s.toml --no-files --quiet");
    folder.file("m.msh", msh(&TET, &[[1, 2, 3, 4], [2, 1, 3, 4]]));
    folder.succeed("run s.toml --no-files --quiet --set mesh.repair=true");
}
