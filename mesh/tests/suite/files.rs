//! VTK files, read back.

use std::{fs, path::PathBuf};
use stylet_mesh::{
    MeshChange, SimplexMesh,
    generate::kuhn_box,
    io::{Collection, Field, IoError, VtuData, write_vtu},
};
use vtkio::model::{Attribute, DataSet, IOBuffer, Piece, UnstructuredGridPiece, VertexNumbers, Vtk};

/// A folder of its own for a test, empty.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn read(path: &PathBuf) -> UnstructuredGridPiece {
    match Vtk::import(path).unwrap().data {
        DataSet::UnstructuredGrid { pieces, .. } => match pieces.into_iter().next().unwrap() {
            Piece::Inline(piece) => *piece,
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    }
}

fn values(attributes: &[Attribute], name: &str) -> (usize, Vec<f64>) {
    let found = attributes.iter().find(|attribute| attribute.name() == name).unwrap();
    match found {
        Attribute::DataArray(array) => (array.num_comp(), array.data.cast_into::<f64>().unwrap()),
        Attribute::Field { .. } => panic!("{name} is a field"),
    }
}

fn triangles() -> SimplexMesh<2, 3> {
    let mut mesh = kuhn_box([0.0; 2], [1.0; 2], [2; 2]).unwrap();
    mesh.refine_around([0.3, 0.4], 0.2, &mut MeshChange::default()).unwrap();
    mesh
}

#[test]
fn a_displaced_mesh_with_fields() {
    let (mesh, folder) = (triangles(), folder("fields"));
    let path = folder.join("mesh.vtu");
    let (n, m) = (mesh.n_vertices(), mesh.n_cells());
    let u: Vec<f64> = (0..2 * n).map(|i| 0.01 * i as f64).collect();
    let heat: Vec<f64> = (0..n).map(|i| if i == 3 { f64::NAN } else { 0.1 * i as f64 }).collect();
    let stress: Vec<f64> = (0..4 * m).map(|i| -(i as f64)).collect();
    let point_fields = [
        Field { name: "heat <K> & \"more\"", components: 1, values: &heat },
        Field { name: "force", components: 2, values: &u },
    ];
    let cell_fields = [Field { name: "stress", components: 4, values: &stress }];
    let data = VtuData { displacement: Some(&u), point_fields: &point_fields, cell_fields: &cell_fields };
    write_vtu(&mesh, &path, &data).unwrap();

    let piece = read(&path);
    let points: Vec<f64> = match piece.points {
        IOBuffer::F64(points) => points,
        other => panic!("{other:?}"),
    };
    for (v, p) in mesh.points().iter().enumerate() {
        assert_eq!(points[3 * v..3 * v + 3], [p[0] + u[2 * v], p[1] + u[2 * v + 1], 0.0]);
    }
    let VertexNumbers::XML { connectivity, offsets } = piece.cells.cell_verts else { panic!("not XML") };
    assert_eq!(offsets.len(), m);
    let expected: Vec<u64> = mesh.cells().flat_map(|c| mesh.oriented(c)).map(|v| u64::from(v.0)).collect();
    assert_eq!(connectivity, expected);

    let (components, read_u) = values(&piece.data.point, "displacement");
    assert_eq!((components, &read_u[3..6]), (3, &[u[2], u[3], 0.0][..]));
    assert_eq!(values(&piece.data.point, "force").1, read_u);
    let (_, read_heat) = values(&piece.data.point, "heat <K> & \"more\"");
    assert!(read_heat[3].is_nan() && read_heat[4..] == heat[4..]);
    assert_eq!(values(&piece.data.cell, "stress"), (4, stress));
    assert_eq!(values(&piece.data.cell, "region"), (1, vec![0.0; m]));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "no temporary file is left");
}

#[test]
fn what_does_not_fit_is_refused_and_leaves_the_old_file() {
    let (mesh, folder) = (triangles(), folder("refused"));
    let path = folder.join("mesh.vtu");
    write_vtu(&mesh, &path, &VtuData::default()).unwrap();
    let old = fs::read(&path).unwrap();
    let mut u = vec![0.0; 2 * mesh.n_vertices()];
    let short = VtuData { displacement: Some(&u[1..]), ..VtuData::default() };
    assert!(matches!(write_vtu(&mesh, &path, &short), Err(IoError::Length { .. })));
    u[5] = f64::INFINITY;
    let infinite = VtuData { displacement: Some(&u), ..VtuData::default() };
    assert!(matches!(write_vtu(&mesh, &path, &infinite), Err(IoError::Position { vertex: 2, .. })));
    let taken = [Field { name: "region", components: 1, values: &u }];
    let taken = VtuData { cell_fields: &taken, ..VtuData::default() };
    assert!(matches!(write_vtu(&mesh, &path, &taken), Err(IoError::Name { .. })));
    let none = [Field { name: "none", components: 0, values: &[] }];
    let none = VtuData { point_fields: &none, ..VtuData::default() };
    assert!(matches!(write_vtu(&mesh, &path, &none), Err(IoError::Length { .. })));
    assert_eq!(fs::read(&path).unwrap(), old);

    let nowhere = folder.join("missing").join("mesh.vtu");
    let error = write_vtu(&mesh, &nowhere, &VtuData::default()).unwrap_err();
    assert!(error.to_string().contains("missing/mesh.vtu"), "{error}");
    let hyper = kuhn_box::<4, 5>([0.0; 4], [1.0; 4], [1; 4]).unwrap();
    assert!(matches!(write_vtu(&hyper, &path, &VtuData::default()), Err(IoError::Dimension { d: 4, n: 5, .. })));
    // A folder in the way: the rename fails, and the temporary file goes.
    fs::create_dir(folder.join("taken.vtu")).unwrap();
    assert!(matches!(write_vtu(&mesh, folder.join("taken.vtu"), &VtuData::default()), Err(IoError::System { .. })));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn a_collection_of_tetrahedra_and_a_rod() {
    let folder = folder("collection");
    let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [1; 3]).unwrap();
    let mut collection = Collection::default();
    for frame in 0..3_u8 {
        mesh.refine_around([0.3, 0.4, 0.5], 1.0 / f64::from(frame + 1), &mut MeshChange::default()).unwrap();
        let name = format!("frame-{frame}.vtu");
        write_vtu(&mesh, folder.join(&name), &VtuData::default()).unwrap();
        collection.push(0.5 * f64::from(frame), name);
        collection.write(folder.join("frames.pvd")).unwrap();
    }
    assert_eq!(read(&folder.join("frame-2.vtu")).cells.types.len(), mesh.n_cells());
    let rod = SimplexMesh::<3, 2>::new(vec![[0.0; 3], [1.0, 2.0, 3.0]], vec![[0, 1]]).unwrap();
    write_vtu(&rod, folder.join("rod.vtu"), &VtuData::default()).unwrap();
    assert_eq!(read(&folder.join("rod.vtu")).points.len(), 6);
    collection.push(f64::NAN, "never.vtu");
    assert!(matches!(collection.write(folder.join("frames.pvd")), Err(IoError::Time { .. })));
    let xml = fs::read_to_string(folder.join("frames.pvd")).unwrap();
    assert_eq!(xml.matches("<DataSet").count(), 3);
}
