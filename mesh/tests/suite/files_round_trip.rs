//! What is written reads back as the same, to the bit.

use crate::files_support::{
    as_read_back, assert_same, field, folder, mixed, name, sample, tetrahedra, there_and_back, triangles,
};
use proptest::{collection::vec, prelude::*};
use std::fs;
use stylet_mesh::io::{DataError, DataField, Format, IoError, MeshData, RegionName, read, write};

/// Formats that hold the cells in order, and fields.
const GENERAL: [Format; 7] = [
    Format::Msh22,
    Format::Msh22Binary,
    Format::Msh41,
    Format::Msh41Binary,
    Format::Vtu,
    Format::Vtk,
    Format::VtkBinary,
];

#[test]
fn regions_and_fields_in_gmsh_and_vtk() {
    for format in GENERAL {
        for (data, kind) in [(triangles(), "triangles"), (tetrahedra(), "tetrahedra"), (mixed(), "mixed")] {
            let (back, notes) = there_and_back(&data, format, "general");
            assert_same(&back, &as_read_back(&data, format), &format!("{kind} in {format}"));
            // Gmsh has its own idea of a negative region, VTK no names.
            let negative = usize::from(data.cells().any(|(_, region)| region < 0));
            let expected = if format.extension() == "msh" { negative } else { data.region_names.len() };
            assert_eq!(notes.len(), expected, "{kind} in {format}: {notes:?}");
        }
    }
}

#[test]
fn from_any_format_to_any_other() {
    for data in [triangles(), tetrahedra()] {
        for first in GENERAL {
            let (once, _) = there_and_back(&data, first, "first");
            for second in GENERAL {
                let (twice, _) = there_and_back(&once, second, "second");
                assert_same(&twice, &as_read_back(&once, second), &format!("{first} to {second}"));
            }
        }
    }
}

/// Tetrahedra with scalars only, then faces and segments: all that TetGen has, in its order.
#[test]
fn tetgen_holds_what_it_can() {
    let mut data = tetrahedra();
    data.region_names.clear();
    data.cell_fields.truncate(1);
    data.cell_fields[0].name = "attribute 1".to_owned();
    data.point_fields.truncate(1);
    data.point_fields[0].name = "attribute 1".to_owned();
    let markers = (0..data.points.len()).map(|i| i as f64 - 3.0).collect();
    data.point_fields.push(field("boundary marker", 1, markers));
    let (back, notes) = there_and_back(&data, Format::Tetgen, "tetgen");
    assert_same(&back, &data, "tetgen");
    assert_eq!(notes, [""; 0]);

    data.cell_fields.clear();
    data.push_cell(&[0, 1, 2], -1);
    data.push_cell(&[1, 2, 3], 6);
    data.push_cell(&[1, 2], 3);
    let (back, notes) = there_and_back(&data, Format::Tetgen, "tetgen");
    assert_same(&back, &data, "tetgen with faces");
    assert_eq!(notes, [""; 0]);

    // A plane and its sides.
    let mut data = triangles();
    (data.region_names, data.point_fields, data.cell_fields) = Default::default();
    let (back, notes) = there_and_back(&data, Format::Tetgen, "tetgen");
    assert_same(&back, &data, "tetgen in the plane");
    assert_eq!(notes, [""; 0]);
}

#[test]
fn tetgen_says_what_it_leaves_out() {
    let data = mixed();
    let (back, notes) = there_and_back(&data, Format::Tetgen, "tetgen-notes");
    assert_eq!(back.simplices::<4>(), data.simplices::<4>());
    assert_eq!(back.simplices::<3>(), data.simplices::<3>());
    assert_eq!(back.simplices::<2>(), data.simplices::<2>());
    assert_eq!(back.points, data.points);
    for what in
        ["1 cells of one point", "order of the cells", "\"skin\"", "cell fields of", "\"Cauchy stress\"", "\"heat\""]
    {
        assert!(notes.iter().any(|note| note.contains(what)), "{what}: {notes:?}");
    }
    // The vector became three attributes; faces have none.
    assert_eq!(back.point_fields.len(), 4);
    assert_eq!(back.cell_fields[0].name, "attribute 1");
    let n = data.simplices::<4>().0.len();
    assert!(back.cell_fields.iter().all(|field| field.values[n..].iter().all(|x| x.is_nan())));
    let pressure: Vec<f64> =
        data.cells().zip(&data.cell_fields[0].values).filter(|((v, _), _)| v.len() == 4).map(|(_, x)| *x).collect();
    assert_eq!(back.cell_fields[0].values[..n], pressure);
}

#[test]
fn stale_files_of_tetgen_do_not_join_a_new_mesh() {
    let path = folder("stale").join("mesh.node");
    write(&path, &mixed(), Format::Tetgen).unwrap();
    let mut plain = tetrahedra();
    (plain.region_names, plain.point_fields, plain.cell_fields) = Default::default();
    write(&path, &plain, Format::Tetgen).unwrap();
    assert_same(&read(path.with_extension("face")).unwrap(), &plain, "after a mesh with faces");
}

#[test]
fn surfaces_in_stl() {
    let mut data = read(sample("two.stl")).unwrap();
    let (back, notes) = there_and_back(&data, Format::Stl, "stl");
    assert_same(&back, &data, "stl");
    assert_eq!(notes, [""; 0]);
    // One solid without a name.
    data.region_names.clear();
    data.blocks[0].regions.fill(0);
    let (back, notes) = there_and_back(&data, Format::Stl, "stl");
    assert_same(&back, &data, "stl without names");
    assert_eq!(notes, [""; 0]);

    // Binary: exact for numbers of 32 bits, and said otherwise.
    data.points[3][2] = 0.125;
    let (back, notes) = there_and_back(&data, Format::StlBinary, "stl");
    assert_same(&back, &data, "stl-binary");
    assert_eq!(notes, [""; 0]);
    data.points[3][2] = 0.1;
    let (back, notes) = there_and_back(&data, Format::StlBinary, "stl");
    assert_eq!(back.points[3][2], f64::from(0.1_f32));
    assert_eq!(notes.len(), 1, "{notes:?}");
    data.points[3][2] = 1e39;
    let error = write(folder("stl").join("a.stl"), &data, Format::StlBinary).unwrap_err();
    assert!(error.to_string().contains("1e39 of vertex 3"), "{error}");
}

#[test]
fn stl_says_what_it_leaves_out() {
    let data = mixed();
    let (_, notes) = there_and_back(&data, Format::Stl, "stl-notes");
    for what in ["14 cells that are not triangles", "\"heat\"", "\"pressure\"", "region -4", "order of the triangles"] {
        assert!(notes.iter().any(|note| note.contains(what)), "{what}: {notes:?}");
    }
    let (_, notes) = there_and_back(&data, Format::StlBinary, "stl-notes");
    assert!(notes.iter().any(|note| note.contains("regions of the triangles")), "{notes:?}");
}

#[test]
fn names_that_a_format_cannot_spell_are_changed_and_said() {
    let mut data = triangles();
    data.point_fields[0].name = "a \"b\"\nc".to_owned();
    data.cell_fields[0].name = "region".to_owned();
    data.region_names[0].name = "two\nlines".to_owned();
    let (back, notes) = there_and_back(&data, Format::Msh41, "names");
    assert_eq!((back.point_fields[0].name.as_str(), back.region_names[0].name.as_str()), ("a _b__c", "two_lines"));
    assert_eq!(notes.len(), 2, "{notes:?}");
    let (back, notes) = there_and_back(&data, Format::Vtu, "names");
    assert_eq!((back.point_fields[0].name.as_str(), back.cell_fields[0].name.as_str()), ("a \"b\"_c", "region #2"));
    assert_eq!(notes.len(), 4, "{notes:?}");
    let (back, _) = there_and_back(&data, Format::Vtk, "names");
    assert_eq!(back.point_fields[0].name, "a \"b\"\nc", "percent signs hold any name");
}

#[test]
fn contradictions_are_refused_and_leave_the_old_file() {
    let path = folder("contradictions").join("mesh.vtu");
    let good = triangles();
    write(&path, &good, Format::Vtu).unwrap();
    let old = fs::read(&path).unwrap();
    let refused = |change: &dyn Fn(&mut MeshData)| {
        let mut data = good.clone();
        change(&mut data);
        match write(&path, &data, Format::Vtu) {
            Err(IoError::Data { source, .. }) => source,
            other => panic!("{other:?}"),
        }
    };
    assert!(matches!(refused(&|data| data.dimension = 4), DataError::Dimension(4)));
    assert!(matches!(refused(&|data| data.points[2][1] = f64::NAN), DataError::Coordinate { vertex: 2, axis: 1, .. }));
    assert!(matches!(refused(&|data| data.points[2][2] = 1.0), DataError::Coordinate { vertex: 2, axis: 2, .. }));
    assert!(matches!(refused(&|data| data.blocks[0].vertices[4] = 1 << 20), DataError::Index { cell: 1, .. }));
    assert!(matches!(
        refused(&|data| data.blocks[0].vertices_per_cell = 5),
        DataError::Block { block: 0, size: 5, .. }
    ));
    assert!(matches!(refused(&|data| data.blocks[1].regions.truncate(1)), DataError::Block { block: 1, .. }));
    assert!(matches!(refused(&|data| data.point_fields[1].name = "heat".into()), DataError::FieldName(_)));
    assert!(matches!(refused(&|data| data.cell_fields[0].values.truncate(1)), DataError::FieldLength { found: 1, .. }));
    assert!(matches!(
        refused(&|data| data.cell_fields[0].components = 0),
        DataError::FieldLength { components: 0, .. }
    ));
    let twice = |data: &mut MeshData| data.region_names.push(name(2, 1, "again"));
    assert!(matches!(refused(&twice), DataError::RegionName { size: 2, region: 1 }));
    assert_eq!(fs::read(&path).unwrap(), old);
    assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1, "no temporary file is left");
}

/// A name that Gmsh and VTK can spell.
fn names() -> impl Strategy<Value = String> {
    "[a-zA-Z0-9 %_.+#'<>&\u{e4}\u{3b1}-]{1,8}"
}

fn values(n: usize) -> impl Strategy<Value = Vec<f64>> {
    vec(any::<u64>().prop_map(f64::from_bits), n)
}

fn fields(entries: usize) -> impl Strategy<Value = Vec<DataField>> {
    let field = (names(), 1..11_usize)
        .prop_flat_map(move |(name, components)| (Just(name), Just(components), values(entries * components)))
        .prop_map(|(name, components, values)| DataField { name, components, values });
    vec(field, 0..4).prop_map(|mut fields| {
        for (i, field) in fields.iter_mut().enumerate() {
            field.name.push_str(&i.to_string());
        }
        fields
    })
}

/// Any data that hold together.
fn mesh_data() -> impl Strategy<Value = MeshData> {
    let finite = || any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite());
    (2..=3_usize, 0..10_usize, 0..12_usize)
        .prop_flat_map(move |(dimension, n, m)| {
            let m = if n == 0 { 0 } else { m };
            let coordinate = move || finite();
            let points = vec([coordinate(), coordinate(), coordinate()], n);
            let cell = (
                1..=dimension + 1,
                [0..n.max(1) as u32, 0..n.max(1) as u32, 0..n.max(1) as u32, 0..n.max(1) as u32],
                any::<i32>(),
            );
            let names = vec((1..=4_usize, any::<i32>(), names()), 0..4);
            (Just(dimension), points, vec(cell, m), names, fields(n), fields(m))
        })
        .prop_map(|(dimension, points, cells, names, point_fields, cell_fields)| {
            let points = points.into_iter().map(|[x, y, z]| [x, y, if dimension == 2 { 0.0 } else { z }]).collect();
            let mut data = MeshData { dimension, points, point_fields, cell_fields, ..MeshData::default() };
            cells.iter().for_each(|(size, v, region)| data.push_cell(&v[..*size], *region));
            for (vertices_per_cell, region, name) in names {
                if data.region_name(vertices_per_cell, region).is_none() {
                    data.region_names.push(RegionName { vertices_per_cell, region, name });
                }
            }
            data
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_data_read_back_the_same(data in mesh_data()) {
        prop_assert_eq!(data.check(), Ok(()));
        for format in GENERAL {
            let (back, _) = there_and_back(&data, format, "any");
            assert_same(&back, &as_read_back(&data, format), format.name());
        }
    }

    /// Points, and the cells of each size in order, survive TetGen's files whatever the fields are.
    #[test]
    fn any_points_and_cells_survive_tetgen(data in mesh_data()) {
        let (back, _) = there_and_back(&data, Format::Tetgen, "any-tetgen");
        prop_assert_eq!(back.dimension, data.dimension);
        prop_assert!(back.points.iter().flatten().map(|x| x.to_bits()).eq(data.points.iter().flatten().map(|x| x.to_bits())));
        prop_assert_eq!(back.simplices::<4>(), data.simplices::<4>());
        prop_assert_eq!(back.simplices::<3>(), data.simplices::<3>());
        prop_assert_eq!(back.simplices::<2>(), data.simplices::<2>());
    }

    /// The corners of triangles survive STL text to the bit, but for the sign of zeros.
    #[test]
    fn any_triangles_survive_stl(data in mesh_data()) {
        let (back, _) = there_and_back(&data, Format::Stl, "any-stl");
        let corners = |data: &MeshData| {
            let (triangles, regions) = data.simplices::<3>();
            let mut by_region: Vec<_> = triangles.into_iter().zip(regions).collect();
            by_region.sort_by_key(|&(_, region)| region);
            let points = by_region.into_iter().flat_map(|(v, _)| v).map(|v| data.points[v as usize]);
            points.collect::<Vec<_>>()
        };
        prop_assert_eq!(corners(&back), corners(&data));
    }
}
