//! Scenes that say what they should, and scenes that do not.

use super::*;
use std::path::Path;
use stylet_mesh::generate::implicit::Implicit;

const HEAD: &str = "[domain]\nlow = [-1, -1, -1]\nhigh = [1, 1, 1]\n";

/// A scene with these shapes, the last of which is a region.
fn scene(shapes: &str) -> Result<ShapeScene, String> {
    let text = format!("{HEAD}{shapes}[[region]]\nname = \"r\"\nshape = \"s\"\n");
    ShapeScene::parse("test.toml", &text, Path::new("")).map_err(|error| error.to_string())
}

fn shape(kind: &str, parameters: &str) -> String {
    let lines = parameters.replace("; ", "\n");
    format!("[[shape]]\nname = \"s\"\nkind = \"{kind}\"\n{lines}\n")
}

fn error(shapes: &str) -> String {
    scene(shapes).expect_err(shapes)
}

#[test]
fn the_declaration_is_sound() {
    assert_eq!(TABLE.check(), Ok(()));
}

#[test]
fn every_kind_is_what_it_says() {
    let ball = "[[shape]]\nname = \"a\"\nkind = \"sphere\"\ncentre = [0, 0, 0]\nradius = 0.5\n\
                [[shape]]\nname = \"b\"\nkind = \"sphere\"\ncentre = [0.5, 0, 0]\nradius = 0.5\n";
    for (kind, parameters, p, distance) in [
        ("sphere", "centre = [0, 0, 0]; radius = 0.5", [0.75, 0.0, 0.0], 0.25),
        ("ellipsoid", "centre = [0, 0, 0]; semi_axes = [0.5, 0.25, 0.25]", [0.75, 0.0, 0.0], 0.25),
        ("capsule", "from = [0, 0, 0]; to = [0.5, 0, 0]; radius = 0.25", [1.0, 0.0, 0.0], 0.25),
        ("cylinder", "from = [0, 0, 0]; to = [0.5, 0, 0]; radius = 0.25", [1.0, 0.0, 0.0], 0.5),
        (
            "torus-arc",
            "centre = [0, 0, 0]; axis = [0, 0, 1]; start = [1, 0, 0]; angle = 3; ring = 0.5; tube = 0.125",
            [0.0, 0.5, 0.25],
            0.125,
        ),
        ("box", "low = [0, 0, 0]; high = [0.5, 0.5, 0.5]", [0.25, 0.25, 0.75], 0.25),
        ("half-space", "point = [0, 0, 0.5]; normal = [0, 0, 3]", [0.3, 0.3, 0.75], 0.25),
        ("shell", "of = \"a\"; inside = 0.25", [0.0, 0.0, 0.125], 0.125),
        ("union", "of = \"a, b\"", [1.25, 0.0, 0.0], 0.25),
        ("intersection", "of = \"a, b\"", [0.25, 0.0, 0.0], -0.25),
        ("difference", "of = \"a , b\"", [0.25, 0.0, 0.0], 0.25),
        ("smooth-union", "of = \"a, b\"; reach = 0.5", [0.25, 0.0, 0.0], -0.375),
        ("placed", "of = \"a\"; shift = [0, 0, 1]", [0.0, 0.0, 1.0], -0.5),
        (
            "box",
            "low = [0, 0, 0]; high = [0.5, 0.5, 0.5]; turn = 3.141592653589793; turn_axis = [0, 0, 2]; shift = [0, 0, 1]",
            [-0.25, -0.25, 1.75],
            0.25,
        ),
    ] {
        let scene = scene(&format!("{ball}{}", shape(kind, parameters))).unwrap();
        let found = scene.regions[0].solid.distance(&p);
        assert!((found - distance).abs() < 1e-12, "{kind}: {found} is not {distance}");
    }
}

#[test]
fn a_whole_scene_is_read() {
    let text = "
        domain = { low = [0, 0, 0], high = [1, 2, 3], size = 0.1, coarsest = 0.4, background = false }
        material = { model = 'linear', young = 1e4, poisson = 0.4, density = 1000 }
        [[shape]]
        name = 'pelvic bone'
        kind = 'box'
        low = [0, 0, 0]
        high = [1, 1, 1]
        [[shape]]
        name = 'gland'
        kind = 'sphere'
        centre = [0.5, 1.0, 1.0]
        radius = 0.4
        [[region]]
        name = 'bone'
        shape = 'pelvic bone'
        conform = false
        fixed = true
        young = 1e9
        [[region]]
        name = 'prostate'
        shape = 'gland'
        size = 0.05
        poisson = 0.49
        [[refine]]
        shape = 'gland'
        size = 0.025
    ";
    let scene = ShapeScene::parse("whole.toml", text, Path::new("")).unwrap();
    assert_eq!(scene.domain, [[0.0; 3], [1.0, 2.0, 3.0]]);
    assert_eq!((scene.size, scene.coarsest, scene.meshes_background), (0.1, Some(0.4), false));
    let of = |region: &Region| (region.name.clone(), region.conforming, region.size, region.fixed);
    assert_eq!(of(&scene.regions[0]), ("bone".into(), false, None, true));
    assert_eq!(of(&scene.regions[1]), ("prostate".into(), true, Some(0.05), false));
    assert_eq!(scene.regions[0].material, Material { young: Some(1e9), ..Material::default() });
    assert_eq!(scene.regions[1].material, Material { poisson: Some(0.49), ..Material::default() });
    assert_eq!((scene.background.model.as_deref(), scene.background.density), (Some("linear"), Some(1000.0)));
    assert_eq!((scene.refinements.len(), scene.refinements[0].size), (1, 0.025));
    // Both hold the point; the earlier row has it.
    let strata = scene.strata();
    assert_eq!(strata.region(&[0.5, 0.9, 0.9]), 0);
    assert_eq!(strata.region(&[0.5, 1.1, 1.1]), 1);
    assert_eq!(strata.region(&[0.5, 1.9, 2.9]), 2);
}

#[test]
fn a_scene_survives_being_written() {
    let mut draft = Draft::default();
    let text = format!("{HEAD}{}", shape("sphere", "centre = [0, 0, 0]; radius = 0.5"));
    TABLE.read("a", &text, &mut draft).unwrap();
    TABLE.set(&mut draft, "domain.size=0.05").unwrap();
    let mut again = Draft::default();
    TABLE.read("b", &TABLE.write(&draft), &mut again).unwrap();
    assert_eq!(draft, again);
    assert_eq!(draft.size, 0.05);
}

#[test]
fn a_surface_is_read_from_beside_the_scene() {
    let folder = std::env::temp_dir().join(format!("stylet-shapes-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let corners = [[0, 0, 0], [30, 0, 0], [0, 30, 0], [0, 0, 30]];
    let facet = |ids: [usize; 3]| {
        let vertex = |i: usize| format!("vertex {} {} {}\n", corners[i][0], corners[i][1], corners[i][2]);
        format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", ids.map(vertex).concat())
    };
    let all = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    std::fs::write(folder.join("tet.stl"), format!("solid\n{}endsolid\n", all.map(facet).concat())).unwrap();
    std::fs::write(
        folder.join("open.stl"),
        format!("solid\n{}endsolid\n", all[..3].iter().map(|t| facet(*t)).collect::<String>()),
    )
    .unwrap();
    let of = |file: &str| {
        let shape = shape("surface", &format!("file = \"{file}\"; unit = 1e-3"));
        let path = folder.join("scene.toml");
        std::fs::write(&path, format!("{HEAD}{shape}[[region]]\nname = \"r\"\nshape = \"s\"\n")).unwrap();
        ShapeScene::read(path).map_err(|error| error.to_string())
    };
    let scene = of("tet.stl").unwrap();
    assert!((scene.regions[0].solid.distance(&[0.005, 0.005, -0.002]) - 0.002).abs() < 1e-15);
    assert!((scene.regions[0].solid.distance(&[0.002, 0.005, 0.005]) + 0.002).abs() < 1e-15);
    let message = of("open.stl").unwrap_err();
    assert!(message.contains("scene.toml: shape: row 1 (s): file: "), "{message}");
    assert!(message.contains("open.stl: the surface is open: 3 edges"), "{message}");
    assert!(of("none.stl").unwrap_err().contains("none.stl"));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn errors_name_the_file_the_key_what_was_found_and_what_was_expected() {
    for (shapes, message) in [
        (
            shape("sphere", "centre = [0, 0, 0]; radius = 0"),
            "test.toml:8: shape.radius (row 1): found 0, expected a number >= 1e-9 and <= 1e6",
        ),
        (
            shape("sphere", "centre = [0, 0, 0]; raduis = 1"),
            "test.toml:8: shape.raduis (row 1): unknown key; nearest known key is shape.radius",
        ),
        (
            shape("sphere", "centre = [0, 0, 0]"),
            "test.toml:4: shape: row 1 (s): radius: missing, expected for sphere centre, radius",
        ),
        (
            shape("sphere", "centre = [0, 0, 0]; radius = 1; ring = 2"),
            "test.toml:4: shape: row 1 (s): found ring, expected for sphere centre, radius; nearest is radius",
        ),
        (
            shape("box", "low = [0, 0, 0]; high = [1, 1, 1]; turn = 1"),
            "test.toml:4: shape: row 1 (s): turn_axis: missing, expected beside turn",
        ),
        (
            shape("union", "of = \"t\""),
            "test.toml: shape: row 1 (s): of: found t, expected the name of a [[shape]], of which there are none before",
        ),
        (
            shape("box", "low = [0, 0, 0]; high = [1, -1, 1]"),
            "test.toml: shape: row 1 (s): the length along y is -1e0 m: expected from 1e-12 to 1e12 m",
        ),
        (
            shape("sphere", "centre = [0, 0, 0]; radius = 1").repeat(2),
            "test.toml: shape: row 2 (s): name: found s once more, expected one shape of each name",
        ),
        (
            shape("sphere", "centre = [0, 0, 0]; radius = 1").replace("\"s\"", "\"ss\""),
            "test.toml: region: row 1 (r): shape: found s, expected the name of a [[shape]] stated before; nearest is ss",
        ),
        (
            shape("sphere", "centre = [0, 0, 0]; radius = 1").replace("\"s\"", "\"a\"")
                + &shape("difference", "of = \"a\""),
            "test.toml: shape: row 2 (s): of: found 1 name, expected two or more",
        ),
    ] {
        let found = error(&shapes);
        assert!(found.starts_with(message), "{found}\n{message}");
    }
    let empty = ShapeScene::parse("test.toml", HEAD, Path::new("")).unwrap_err().to_string();
    assert_eq!(empty, "test.toml: region: found 0 rows, expected from 1 to 1000");
    let flat = HEAD.replace("high = [1, 1, 1]", "high = [1, -1, 1]");
    let flat = ShapeScene::parse("test.toml", &flat, Path::new("")).unwrap_err().to_string();
    assert_eq!(flat, "test.toml: domain: found low -1 and high -1 along y, expected low below high");
}

#[test]
fn shapes_that_double_are_refused_before_they_take_for_ever() {
    let mut text = shape("sphere", "centre = [0, 0, 0]; radius = 0.5").replace("\"s\"", "\"x0\"");
    for i in 1..60 {
        let of = format!("of = \"x{}, x{}\"", i - 1, i - 1);
        text += &shape("union", &of).replace("\"s\"", &format!("\"x{i}\""));
    }
    assert!(error(&text).contains("row 15 (x14): of: found 16384 simple shapes in it, expected at most 10000"));
    let mut text = shape("sphere", "centre = [0, 0, 0]; radius = 0.5").replace("\"s\"", "\"x0\"");
    for i in 1..200 {
        let of = format!("of = \"x{}\"", i - 1);
        text += &shape("union", &of).replace("\"s\"", &format!("\"x{i}\""));
    }
    assert!(error(&text).contains("row 101 (x100): of: found shapes within shapes 101 deep, expected at most 100"));
}
