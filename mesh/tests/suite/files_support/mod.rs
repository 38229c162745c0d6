//! Meshes for the tests of files, and comparison bit for bit.

use std::{fs, path::PathBuf};
use stylet_mesh::{
    MeshChange,
    generate::kuhn_box,
    io::{CellBlock, DataField, Format, MeshData, RegionName, read_with_notes, write},
};

/// A folder of its own for a test, empty.
pub fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The path of a hand-written file.
pub fn sample(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/samples").join(name)
}

pub fn field(name: &str, components: usize, values: Vec<f64>) -> DataField {
    DataField { name: name.to_owned(), components, values }
}

pub fn name(vertices_per_cell: usize, region: i32, name: &str) -> RegionName {
    RegionName { vertices_per_cell, region, name: name.to_owned() }
}

/// Numbers without a short decimal form.
fn awkward(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| (seed + i as f64).sin() * 10_f64.powi(i as i32 % 40 - 20)).collect()
}

/// Triangles in two dimensions with segments on a side, regions and fields.
pub fn triangles() -> MeshData {
    let mut mesh = kuhn_box::<2, 3>([0.1; 2], [1.3, 0.7], [3, 2]).unwrap();
    mesh.refine_around([0.3, 0.4], 0.2, &mut MeshChange::default()).unwrap();
    let mut data = MeshData {
        dimension: 2,
        points: mesh.points().iter().map(|p| [p[0], p[1], 0.0]).collect(),
        region_names: vec![name(3, 2, "soft tissue"), name(2, 1, "skin")],
        ..MeshData::default()
    };
    for (i, c) in mesh.cells().enumerate() {
        data.push_cell(&mesh.oriented(c).map(|v| v.0), 1 + (i % 3) as i32);
    }
    let sides: Vec<_> = mesh
        .boundary_facets()
        .map(|(c, facet)| {
            let v = mesh.cell(c).map(|v| v.0);
            [v[(facet + 1) % 3], v[(facet + 2) % 3]]
        })
        .collect();
    sides.iter().for_each(|side| data.push_cell(side, 1));
    with_fields(data)
}

/// Tetrahedra alone, with regions and fields.
pub fn tetrahedra() -> MeshData {
    let mesh = kuhn_box::<3, 4>([-0.3; 3], [1.0 / 3.0, 0.7, 1e-3], [2, 1, 2]).unwrap();
    let mut data = MeshData {
        dimension: 3,
        points: mesh.points().to_vec(),
        region_names: vec![name(4, 7, "prostate"), name(4, 1, "Knochen \u{3b1}")],
        ..MeshData::default()
    };
    for (i, c) in mesh.cells().enumerate() {
        data.push_cell(&mesh.oriented(c).map(|v| v.0), if i % 2 == 0 { 7 } else { 1 });
    }
    with_fields(data)
}

/// Tetrahedra, triangles on their boundary, a segment and a point, in several runs.
pub fn mixed() -> MeshData {
    let mesh = kuhn_box::<3, 4>([0.0; 3], [1.0, 0.1, 0.3], [1, 2, 1]).unwrap();
    let mut data = MeshData {
        dimension: 3,
        points: mesh.points().to_vec(),
        region_names: vec![name(3, 5, "skin"), name(4, 5, "body"), name(1, 9, "tip")],
        ..MeshData::default()
    };
    for (c, facet) in mesh.boundary_facets() {
        let v = mesh.cell(c).map(|v| v.0);
        data.push_cell(&[v[(facet + 1) % 4], v[(facet + 2) % 4], v[(facet + 3) % 4]], 5);
    }
    for c in mesh.cells() {
        data.push_cell(&mesh.oriented(c).map(|v| v.0), 5);
    }
    data.push_cell(&[0, 1], 0);
    data.push_cell(&[3], 9);
    data.push_cell(&[0, 1, 2], -4);
    with_fields(data)
}

/// A scalar, a vector and a tensor on points and on cells.
fn with_fields(mut data: MeshData) -> MeshData {
    let (n, m) = (data.points.len(), data.n_cells());
    data.point_fields = vec![field("heat", 1, awkward(n, 0.1)), field("velocity of tissue", 3, awkward(3 * n, 0.2))];
    data.cell_fields = vec![field("pressure", 1, awkward(m, 0.3)), field("Cauchy stress", 9, awkward(9 * m, 0.4))];
    data
}

/// Writes and reads back; the notes are those of both.
pub fn there_and_back(data: &MeshData, format: Format, test: &str) -> (MeshData, Vec<String>) {
    let path = folder(test).join("mesh").with_extension(format.extension());
    let mut notes = write(&path, data, format).unwrap();
    let (back, more) = read_with_notes(&path).unwrap();
    notes.extend(more);
    (back, notes)
}

/// Equal to the bit; NaN equals NaN.
fn same_numbers(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()))
}

/// Panics unless both are the same, numbers to the bit.
pub fn assert_same(a: &MeshData, b: &MeshData, what: &str) {
    assert_eq!(a.dimension, b.dimension, "{what}: dimension");
    assert!(same_numbers(a.points.as_flattened(), b.points.as_flattened()), "{what}: {:?} {:?}", a.points, b.points);
    let blocks = |data: &MeshData| -> Vec<CellBlock> {
        data.blocks.iter().filter(|block| block.n_cells() > 0).cloned().collect()
    };
    assert_eq!(blocks(a), blocks(b), "{what}: cells");
    assert_eq!(a.region_names, b.region_names, "{what}: names");
    for (a, b, kind) in [(&a.point_fields, &b.point_fields, "point"), (&a.cell_fields, &b.cell_fields, "cell")] {
        let shape = |fields: &[DataField]| -> Vec<(String, usize)> {
            fields.iter().map(|field| (field.name.clone(), field.components)).collect()
        };
        assert_eq!(shape(a), shape(b), "{what}: {kind} fields");
        for (a, b) in a.iter().zip(b) {
            assert!(same_numbers(&a.values, &b.values), "{what}: {a:?} {b:?}");
        }
    }
}

/// What a format that holds fields and cells in order gives back.
pub fn as_read_back(data: &MeshData, format: Format) -> MeshData {
    let mut expected = data.clone();
    expected.dimension = data.natural_dimension();
    if format.extension() != "msh" {
        expected.region_names.clear();
    } else {
        for (fields, entries) in
            [(&mut expected.point_fields, data.points.len()), (&mut expected.cell_fields, data.n_cells())]
        {
            fields.retain(|field| field.components <= 9);
            fields.iter_mut().for_each(|field| pad(field, entries));
        }
    }
    if format.extension() == "vtk" && data.n_cells() == 0 {
        expected.cell_fields.clear();
    }
    expected
}

/// Gmsh has scalars, vectors and tensors, and leaves out entries without a value.
fn pad(field: &mut DataField, entries: usize) {
    let components = [1, 3, 3, 9, 9, 9, 9, 9, 9][field.components - 1];
    let mut values = Vec::with_capacity(entries * components);
    for entry in field.values.chunks_exact(field.components) {
        let fill = if entry.iter().all(|x| x.is_nan()) { f64::NAN } else { 0.0 };
        values.extend((0..components).map(|k| entry.get(k).copied().unwrap_or(fill)));
    }
    (field.components, field.values) = (components, values);
}
