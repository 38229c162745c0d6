//! Hostile input to scenes of bodies: exit code 2 and one line.

use crate::support::{Folder, json, refuses};

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

/// As [`values_that_cannot_be`], where rows of tables and the keys of motion have values too.
#[test]
fn rows_and_times_that_cannot_be() {
    let folder = Folder::new();
    for (set, parts) in [
        ("region=[{name=\"a\",box=[0,0,0,1,1,1],young=nan}]", &["region.young (row 1): found nan"][..]),
        ("region=[{name=\"a\",box=[0,0,0,1,1,1],young=-1}]", &["region.young (row 1): found -1"]),
        ("region=[{name=\"a\",box=[0,0,0,1,1,1],young=inf}]", &["region.young (row 1): found inf"]),
        ("region=[{name=\"a\",box=[0,0,0,1,1,1],poisson=0.5}]", &["region.poisson (row 1): found 0.5"]),
        ("region=[{name=\"a\",box=[0,0,0,1,1,1],poisson=-1}]", &["region.poisson (row 1): found -1"]),
        ("region=[{name=\"a\",box=[0,0,0,1,1,1],density=0}]", &["region.density (row 1): found 0"]),
        ("region=[{name=\"a\",box=[0,0,0,1,1,1],model=\"stif\"}]", &["region.model (row 1)", "nearest is"]),
        ("region=[{name=\"a\",box=[1,0,0,0,1,1]}]", &["region (row 1): box: found 1 to 0", "ascending"]),
        ("region=[{name=\"a\",box=[5,5,5,6,6,6]}]", &["region (row 1): found no cell"]),
        ("region=[{box=[0,0,0,1,1,1]}]", &["region", "name"]),
        (
            "region=[{name=\"a\",box=[0,0,0,1,1,1],model=\"neo-hookean\",poisson=-0.2}]",
            &["region (row 1): Poisson's ratio is -0.2", "0 <= nu"],
        ),
        ("load=[{gravity=[0,0,nan]}]", &["load.gravity (row 1)", "nan"]),
        ("load=[{gravity=[0,0,inf]}]", &["load.gravity (row 1)", "inf"]),
        ("load=[{gravity=[0,-9.81]}]", &["load (row 1): gravity: found 2 numbers, expected 3"]),
        ("load=[{from=[0.1,0.02,0.02],force=[0,0,1]}]", &["row 1", "from and to"]),
        (
            "load=[{from=[0.1,0.02,0.02],to=[0.1,0.02,0.02],force=[0,0,1]}]",
            &["load (row 1): from and to", "a positive length"],
        ),
        ("load=[{from=[0.1,0.02,0.02],to=[0.9,0.02,0.02],force=[0,0,1]}]", &["load (row 1): from and to"]),
        ("load=[{side=\"top\",traction=[0,0,inf]}]", &["load.traction (row 1)"]),
        ("load=[{side=\"top\",force=[0,0,1],until=-1}]", &["load.until (row 1): found -1"]),
        ("constraint=[{side=\"left\",offset=[nan,0,0]}]", &["constraint.offset (row 1)", "nan"]),
        ("constraint=[{side=\"left\",direction=[0,0,0]}]", &["constraint (row 1)", "direction"]),
        ("mesh.origin=[1e308,0,0]", &["mesh"]),
        ("material.plane=stress", &["material.plane: found in three dimensions"]),
        ("material.plane=strian", &["material.plane: found", "strian", "nearest is \"strain\""]),
    ] {
        refuses(&folder, &format!("run beam-bend --no-files --set {set}"), parts);
    }
    for (set, parts) in [
        ("time.dt=0", &["time.dt: found 0"][..]),
        ("time.dt=nan", &["time.dt: found nan"]),
        ("time.dt=-0.1", &["time.dt: found -0.1"]),
        ("time.end=0", &["time.end: found 0"]),
        ("time.lazy=-1", &["time.lazy: found -1"]),
        ("time.adaptive=nan", &["time.adaptive: found nan"]),
        ("time.newton=ful", &["time.newton: found", "nearest is \"full\""]),
        ("time.newton_iterations=0", &["time.newton_iterations: found 0"]),
        ("time.gamma=0.4", &["time.gamma: found 0.4"]),
        ("time.damping_mass=inf", &["time.damping_mass: found inf"]),
        ("solver.preconditioner=ic0", &["solver.preconditioner", "block-jacobi"]),
        ("material.density=-1", &["material.density: found -1"]),
    ] {
        refuses(&folder, &format!("run block-drop --no-files --set {set}"), parts);
    }
}

/// The line of the file is named where the value stands in one.
#[test]
fn lines_of_scene_files_that_are_wrong() {
    let folder = Folder::new();
    for (text, parts) in [
        (
            "[mesh]\nsize = [0.1, 0.1, 0.1]\n[material]\nyoung = nan\n[statics]\n",
            &["s.toml:4: material.young: found nan"][..],
        ),
        (
            "[mesh]\nsize = [0.1, 0.1, 0.1]\n[material]\ndensity = 0.0\n[time]\n",
            &["s.toml:4: material.density: found 0"],
        ),
        (
            "[statics]\n[[constraint]]\nsied = \"left\"\n",
            &["s.toml:3: constraint.sied (row 1)", "nearest known key is constraint.side"],
        ),
        (
            "[statics]\n[[constraints]]\nside = \"left\"\n",
            &["s.toml:2: [constraints]: unknown table", "nearest known table is [constraint]"],
        ),
        (
            "[statics]\n[[load]]\nside = \"left\"\ngravity = [0.0, 0.0, 1.0]\n",
            &["s.toml:2: load: row 1: found side beside gravity"],
        ),
        ("[statics]\n[mesh]\nfile = 7\n", &["s.toml:3: mesh.file: found 7"]),
        ("[statics]\n[time]\n", &["s.toml: time: found beside [statics]"]),
        ("[statics]\n", &["s.toml: constraint", "not held against"]),
        ("[mesh]\nsize = [0.1, 0.1]\n[statics]\n", &["s.toml: mesh.cells: found 3 numbers, expected 2"]),
        (
            "[mesh]\nsize = [0.1, 0.1]\ncells = [2, 2]\n[[load]]\ngravity = [0.0, 0.0, 1.0]\n[time]\n",
            &["s.toml: load (row 1): gravity: found 3 numbers, expected 2"],
        ),
        (
            "[mesh]\nsize = [0.1, 0.1]\ncells = [2, 2]\nthickness = 0.0\n[time]\n",
            &["s.toml:4: mesh.thickness: found 0"],
        ),
        (
            "[mesh]\nsize = [0.1, 0.1]\ncells = [2, 2]\n[[constraint]]\nside = \"front\"\n[time]\n",
            &["s.toml: constraint (row 1): side: found front"],
        ),
    ] {
        folder.file("s.toml", text);
        refuses(&folder, "run s.toml --no-files", parts);
    }
}

#[test]
fn files_of_other_formats_that_are_no_mesh() {
    let folder = Folder::new();
    folder.file("empty.vtu", "");
    folder.file(
        "points.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 double\n0 0 0\n",
    );
    folder.file("alone.node", "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n");
    folder.file("skin.node", "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n");
    folder.file("skin.face", "4 0\n0 0 2 1\n1 0 1 3\n2 1 2 3\n3 2 0 3\n");
    folder.file("flat.node", "3 2 0 0\n0 0 0\n1 1 0\n2 2 0\n");
    folder.file("flat.ele", "1 3 0\n0 0 1 2\n");
    folder.file("twice.node", "3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n");
    folder.file("twice.ele", "2 3 0\n0 0 1 2\n1 0 1 2\n");
    folder.file("far.node", "3 2 0 0\n0 0 0\n1 1e308 0\n2 0 1e308\n");
    folder.file("far.ele", "1 3 0\n0 0 1 2\n");
    folder.file("nan.node", "3 2 0 0\n0 0 0\n1 nan 0\n2 0 1\n");
    folder.file("nan.ele", "1 3 0\n0 0 1 2\n");
    folder.file("mesh.stl", "");
    for (file, parts) in [
        ("empty.vtu", &["empty.vtu"][..]),
        ("points.vtk", &["points.vtk: found no cells"]),
        ("alone.node", &["alone.node: found no cells"]),
        ("skin.face", &["skin.face: found a surface in 3 dimensions"]),
        ("flat.ele", &["flat.ele: cell 0"]),
        ("twice.ele", &["twice.ele: cell"]),
        ("far.ele", &["far.ele"]),
        ("nan.ele", &["nan.", "nan"]),
        ("mesh.stl", &["mesh.stl"]),
        (".", &["."]),
    ] {
        folder.file("s.toml", format!("[mesh]\nfile = \"{file}\"\n[time]\n"));
        refuses(&folder, "run s.toml --no-files", parts);
    }
    // What has one remedy runs with it.
    folder.file("s.toml", "[mesh]\nfile = \"twice.ele\"\nrepair = true\n[time]\nend = 0.01\n");
    folder.succeed("run s.toml --no-files --quiet");
}

/// Parts that nothing joins are two bodies: in motion each falls by itself.
#[test]
fn parts_that_nothing_joins_move_alone() {
    let folder = Folder::new();
    let far = TET.map(|x| [x[0] + 1.0, x[1], x[2] + 0.5]);
    let points: Vec<[f64; 3]> = TET.into_iter().chain(far).collect();
    folder.file("m.msh", msh(&points, &[[1, 2, 3, 4], [5, 6, 7, 8]]));
    folder.file(
        "s.toml",
        "[mesh]\nfile = \"m.msh\"\n[[load]]\ngravity = [0.0, 0.0, -10.0]\n[time]\ndt = 0.01\nend = 0.1\n",
    );
    let end =
        json(&folder.succeed("run s.toml --no-files --quiet --json --probe 0.02,0.02,0.02 --probe 1.02,0.02,0.52"));
    for k in 0..2 {
        let fallen = end["probes"][k]["displacement"][2].as_f64().unwrap();
        assert!((fallen + 0.05).abs() < 1e-6, "{fallen} m");
    }
}
