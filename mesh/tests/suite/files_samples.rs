//! Hand-written files in the style of the programs that the formats come from.

use crate::files_support::{assert_same, name, sample};
use std::fs;
use stylet_mesh::{
    SimplexMesh,
    io::{Collection, Format, MeshData, read, read_bytes, read_with_notes, write},
};

fn cells(data: &MeshData) -> Vec<(Vec<u32>, i32)> {
    data.cells().map(|(vertices, region)| (vertices.to_vec(), region)).collect()
}

fn values<'a>(data: &'a MeshData, name: &str) -> (usize, &'a [f64]) {
    let all = data.point_fields.iter().chain(&data.cell_fields);
    all.filter(|field| field.name == name).map(|field| (field.components, field.values.as_slice())).next().unwrap()
}

#[test]
fn gmsh_22_with_gaps_in_the_numbering() {
    let (data, notes) = read_with_notes(sample("square-22.msh")).unwrap();
    assert_eq!(data.dimension, 2);
    assert_eq!(data.points, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.5, 0.0]]);
    assert_eq!(cells(&data), [(vec![0, 3], 1), (vec![0, 1, 2], 5), (vec![0, 2, 3], 6)]);
    assert_eq!(data.region_names, [name(2, 1, "left side"), name(3, 5, "lower"), name(3, 6, "upper")]);
    let (components, temperature) = values(&data, "temperature");
    assert_eq!((components, &temperature[..2], temperature[3]), (1, &[20.5, 21.0][..], -300.0));
    assert!(temperature[2].is_nan(), "node 7 has no value");
    let (components, flux) = values(&data, "flux");
    assert_eq!((components, &flux[3..]), (3, &[1.0, 0.0, 0.0, 0.0, 2.5, 0.0][..]));
    assert!(flux[..3].iter().all(|x| x.is_nan()), "the segment has no value");
    assert_eq!(notes, [""; 0]);
    let mesh = SimplexMesh::<2, 3>::new(data.coordinates(), data.simplices().0).unwrap();
    assert_eq!(mesh.n_cells(), 2);
}

#[test]
fn gmsh_41_with_entities_parameters_and_gaps() {
    let (data, notes) = read_with_notes(sample("tets-41.msh")).unwrap();
    assert_eq!(data.dimension, 3);
    assert_eq!(data.points[1], [1.0, 0.0, 0.0]);
    assert_eq!(data.points[4], [1.0; 3]);
    assert_eq!(cells(&data), [(vec![0, 1, 2], 3), (vec![0, 1, 2, 3], 1), (vec![1, 2, 3, 4], 1)]);
    assert_eq!(data.region_names, [name(3, 3, "skin"), name(4, 1, "tissue")]);
    let (_, density) = values(&data, "density");
    assert!(density[0].is_nan());
    assert_eq!(density[1..], [1000.0, 1060.5]);
    assert_eq!(notes, ["section $Periodic"]);
}

#[test]
fn gmsh_binary_of_the_other_byte_order() {
    // One triangle in version 2.2, on a machine that puts the big end first.
    let mut bytes = b"$MeshFormat\n2.2 1 8\n".to_vec();
    bytes.extend(1_i32.to_be_bytes());
    bytes.extend(b"\n$EndMeshFormat\n$Nodes\n3\n");
    for (id, point) in [(4_i32, [0.0, 0.0, 0.0]), (5, [1.0, 0.0, 0.0]), (9, [0.0, 0.1, 0.0_f64])] {
        bytes.extend(id.to_be_bytes());
        point.iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    }
    bytes.extend(b"\n$EndNodes\n$Elements\n1\n");
    for value in [2, 1, 3, 77, 6, 1, 0, 9, 4, 5_i32] {
        bytes.extend(value.to_be_bytes());
    }
    bytes.extend(b"\n$EndElements\n");
    let (data, _) = read_bytes(Format::Msh22Binary, &bytes).unwrap();
    assert_eq!(cells(&data), [(vec![2, 0, 1], 6)]);
    assert_eq!(data.points[2], [0.0, 0.1, 0.0]);

    // The same in version 4.1, with size_t of 4 bytes.
    let mut bytes = b"$MeshFormat\n4.1 1 4\n".to_vec();
    bytes.extend(1_i32.to_be_bytes());
    bytes.extend(b"\n$EndMeshFormat\n$Nodes\n");
    [1, 3, 4, 9, 2, 1, 0, 3, 4, 5, 9_i32].iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0_f64].iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    bytes.extend(b"\n$EndNodes\n$Elements\n");
    [1, 1, 7, 7, 2, 1, 2, 1, 7, 9, 4, 5_i32].iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    bytes.extend(b"\n$EndElements\n");
    let (data, _) = read_bytes(Format::Msh41Binary, &bytes).unwrap();
    assert_eq!(cells(&data), [(vec![2, 0, 1], 0)]);
    assert_eq!(data.points[2], [0.0, 0.1, 0.0]);
}

#[test]
fn vtu_in_text() {
    let (data, notes) = read_with_notes(sample("grid.vtu")).unwrap();
    assert_eq!(data.dimension, 2);
    assert_eq!(cells(&data), [(vec![0, 1, 2], 1), (vec![0, 2, 3], 2), (vec![0, 1], -3)]);
    assert_eq!(values(&data, "heat"), (1, &[1.0, 2.5, 3.0, 1e-3][..]));
    assert_eq!(values(&data, "velocity").0, 3);
    assert_eq!(values(&data, "flag"), (1, &[0.0, 1.0, 255.0][..]));
    assert_eq!(data.cell_fields.len(), 1, "regions are no field");
    assert_eq!(notes.len(), 1, "the time: {notes:?}");
}

#[test]
fn vtu_in_pieces() {
    let text = fs::read_to_string(sample("grid.vtu")).unwrap();
    let (start, end) = (text.find("<Piece").unwrap(), text.find("</Piece>").unwrap() + "</Piece>".len());
    let piece = &text[start..end];
    let empty = "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"><Points/><Cells/></Piece>";
    let pieces = format!("{}{empty}{piece}{piece}{}", &text[..start], &text[end..]);
    let (data, _) = read_bytes(Format::Vtu, pieces.as_bytes()).unwrap();
    let (one, _) = read_bytes(Format::Vtu, text.as_bytes()).unwrap();
    assert_eq!(data.points, [one.points.clone(), one.points].concat());
    assert_eq!(cells(&data)[3..], [(vec![4, 5, 6], 1), (vec![4, 6, 7], 2), (vec![4, 5], -3)]);
    assert_eq!(values(&data, "flag").1, [0.0, 1.0, 255.0, 0.0, 1.0, 255.0]);
    // A piece without a field of the others.
    let other = piece.replace("\"heat\"", "\"warmth\"");
    let error = read_bytes(Format::Vtu, pieces.replacen(piece, &other, 1).as_bytes()).unwrap_err();
    assert!(error.to_string().contains("array \"warmth\" with 1 components"), "{error}");
}

#[test]
fn vtu_appended_and_compressed() {
    // Points packed by zlib in stored blocks, appended raw; the rest appended as it is.
    let stored = |plain: &[u8]| {
        let mut zlib = vec![0x78, 0x01, 0x01];
        zlib.extend((plain.len() as u16).to_le_bytes());
        zlib.extend((!(plain.len() as u16)).to_le_bytes());
        zlib.extend(plain);
        let (mut a, mut b) = (1_u32, 0_u32);
        for &byte in plain {
            (a, b) = ((a + u32::from(byte)) % 65521, (b + a + u32::from(byte)) % 65521);
        }
        zlib.extend((b << 16 | a).to_be_bytes());
        zlib
    };
    let points: Vec<u8> =
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.1, 0.3_f64].iter().flat_map(|x| x.to_le_bytes()).collect();
    // Two blocks of 40 bytes at most, hence a last one of 32.
    let blocks = [stored(&points[..40]), stored(&points[40..])];
    let mut raw = Vec::new();
    let array = |raw: &mut Vec<u8>, header: &[u32], blocks: &[Vec<u8>]| {
        let offset = raw.len();
        header.iter().for_each(|x| raw.extend(x.to_le_bytes()));
        blocks.iter().for_each(|block| raw.extend(&block[..]));
        offset
    };
    let sizes = [blocks[0].len() as u32, blocks[1].len() as u32];
    let at_points = array(&mut raw, &[2, 40, 32, sizes[0], sizes[1]], &blocks);
    let one = |plain: Vec<u8>| (plain.len() as u32, vec![stored(&plain)]);
    let (n, block) = one([0_i32, 1, 2].iter().flat_map(|x| x.to_le_bytes()).collect());
    let at_connectivity = array(&mut raw, &[1, n, 0, block[0].len() as u32], &block);
    let (n, block) = one(3_i32.to_le_bytes().to_vec());
    let at_offsets = array(&mut raw, &[1, n, 0, block[0].len() as u32], &block);
    let (n, block) = one(vec![5]);
    let at_types = array(&mut raw, &[1, n, 0, block[0].len() as u32], &block);
    let mut file = format!(
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\">\n\
         <UnstructuredGrid><Piece NumberOfPoints=\"3\" NumberOfCells=\"1\">\n\
         <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" offset=\"{at_points}\"/></Points>\n\
         <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"appended\" offset=\"{at_connectivity}\"/>\n\
         <DataArray type=\"Int32\" Name=\"offsets\" format=\"appended\" offset=\"{at_offsets}\"/>\n\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"appended\" offset=\"{at_types}\"/></Cells>\n\
         </Piece></UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_"
    )
    .into_bytes();
    file.extend(&raw);
    file.extend(b"\n</AppendedData>\n</VTKFile>\n");
    let (data, _) = read_bytes(Format::Vtu, &file).unwrap();
    assert_eq!(data.points, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.1, 0.3]]);
    assert_eq!(cells(&data), [(vec![0, 1, 2], 0)]);
    // A bit turned over in the packed data.
    let at = file.windows(2).position(|w| w == [0x78, 0x01]).unwrap() + 12;
    file[at] ^= 1;
    let error = read_bytes(Format::Vtu, &file).unwrap_err();
    assert!(error.to_string().contains("line 3: expected a zlib block of 40 bytes"), "{error}");
}

#[test]
fn legacy_vtk_of_three_versions() {
    let data = read(sample("grid-20.vtk")).unwrap();
    assert_eq!(data.dimension, 3);
    assert_eq!(cells(&data), [(vec![0, 1, 2, 3], 7), (vec![0, 1, 2], 8)]);
    assert_eq!(values(&data, "heat"), (1, &[1.0, 2.0, 3.0, 4.5][..]));
    assert_eq!(values(&data, "velocity").0, 3);
    assert_eq!(values(&data, "von Mises"), (2, &[1.0, 2.0, 3.0, 4.0][..]));

    let (data, notes) = read_with_notes(sample("grid-51.vtk")).unwrap();
    assert_eq!(cells(&data), [(vec![0, 1, 2], 4), (vec![1, 2, 3], -5)]);
    assert_eq!(notes.len(), 1, "the time: {notes:?}");

    let data = read(sample("surface.vtk")).unwrap();
    assert_eq!(cells(&data), [(vec![0, 3], 0), (vec![0, 1, 2], 0), (vec![1, 3, 2], 0)]);
    assert_eq!(values(&data, "n"), (3, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0][..]));
}

/// Attributes of every kind, in text and in binary; a table of colours may be named or not.
#[test]
fn legacy_attributes() {
    let head = |kind: &str| format!("# vtk DataFile Version 3.0\n\n{kind}\nDATASET POLYDATA\nPOINTS 2 float\n");
    let text = head("ASCII")
        + "0 0 0 1 0 0\nPOINT_DATA 2\nSCALARS a int 2\nLOOKUP_TABLE default\n1 2 3 4\nSCALARS b double\n5 6\n\
           LOOKUP_TABLE t 1\n0 0 0 1\nCOLOR_SCALARS c 1\n0.5 1\nTEXTURE_COORDINATES d 2 float\n1 2 3 4\n\
           TENSORS e float\n1 2 3\n4 5 6\n7 8 9\n\n1 2 3\n4 5 6\n7 8 9\nGLOBAL_IDS f vtkIdType\n7 8\n";
    let (data, notes) = read_bytes(Format::Vtk, text.as_bytes()).unwrap();
    let fields: Vec<_> = data.point_fields.iter().map(|field| (field.name.as_str(), field.components)).collect();
    assert_eq!(fields, [("a", 2), ("b", 1), ("c", 1), ("d", 2), ("e", 9), ("f", 1)]);
    assert_eq!(values(&data, "b").1, [5.0, 6.0]);
    assert_eq!(values(&data, "f").1, [7.0, 8.0]);
    assert_eq!(notes, ["a table of colours"]);

    let mut bytes = head("BINARY").into_bytes();
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0_f32].iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    bytes.extend(b"\nPOINT_DATA 2\nSCALARS a int 2\nLOOKUP_TABLE default\n");
    // The last one begins with a byte that is white space.
    [1, 2, 3, 0x0a00_0000].iter().for_each(|x: &i32| bytes.extend(x.to_be_bytes()));
    bytes.extend(b"\nSCALARS b short 1\n");
    [0x0a0a, 0x2020_i16].iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    bytes.extend(b"\nSCALARS c char\n\x0a\x20\nCOLOR_SCALARS d 1\n\x00\xff\n");
    let (data, _) = read_bytes(Format::Vtk, &bytes).unwrap();
    assert_eq!(values(&data, "a").1, [1.0, 2.0, 3.0, f64::from(0x0a00_0000)]);
    assert_eq!(values(&data, "b").1, [f64::from(0x0a0a), f64::from(0x2020)]);
    assert_eq!(values(&data, "c").1, [10.0, 32.0]);
    assert_eq!(values(&data, "d").1, [0.0, 255.0]);
}

#[test]
fn tetgen_numbered_from_one_with_comments() {
    let data = read(sample("two.node")).unwrap();
    assert_eq!(data.dimension, 3);
    assert_eq!(data.points[4], [1.0; 3]);
    let expected = [(vec![0, 1, 2, 3], 7), (vec![1, 2, 3, 4], -2), (vec![0, 1, 2], 5), (vec![0, 1, 3], -1)];
    assert_eq!(cells(&data), expected);
    assert_eq!(data.point_fields.len(), 2);
    assert_eq!(values(&data, "boundary marker"), (1, &[0.0, -1.0, 2.0, 3.0, 4.0][..]));
    let kept = &data.cell_fields[0];
    assert_eq!((kept.name.as_str(), &kept.values[..2]), ("attribute 1", &[0.25, 0.5][..]));
    assert!(kept.values[2..].iter().all(|x| x.is_nan()));
    for extension in ["ele", "face"] {
        assert_same(&read(sample("two").with_extension(extension)).unwrap(), &data, extension);
    }
}

#[test]
fn triangle_numbered_from_zero_in_the_plane() {
    let data = read(sample("plate.ele")).unwrap();
    assert_eq!(data.dimension, 2);
    assert_eq!(cells(&data), [(vec![0, 1, 2], 0), (vec![0, 2, 3], 0), (vec![0, 1], 9)]);
    SimplexMesh::<2, 3>::new(data.coordinates(), data.simplices().0).unwrap();
}

#[test]
fn stl_of_two_solids_shares_vertices() {
    let data = read(sample("two.stl")).unwrap();
    assert_eq!(data.points.len(), 4, "0 and -0 are equal");
    assert_eq!(cells(&data), [(vec![0, 1, 2], 1), (vec![1, 3, 2], 2)]);
    assert_eq!(data.region_names, [name(3, 1, "lower part"), name(3, 2, "upper")]);
}

#[test]
fn a_collection() {
    let collection = Collection::read(sample("frames.pvd")).unwrap();
    assert_eq!(collection.frames(), [(0.0, "frame-0.vtu".to_owned()), (0.5, "frame-1.vtu".to_owned())]);
}

/// CR before LF, comments that are no UTF-8, byte order marks and blanks change nothing.
#[test]
fn line_ends_and_foreign_bytes() {
    for (file, format) in [
        ("square-22.msh", Format::Msh22),
        ("tets-41.msh", Format::Msh41),
        ("grid.vtu", Format::Vtu),
        ("grid-20.vtk", Format::Vtk),
        ("grid-51.vtk", Format::Vtk),
        ("two.stl", Format::Stl),
    ] {
        let text = fs::read_to_string(sample(file)).unwrap();
        let (plain, _) = read_bytes(format, text.as_bytes()).unwrap();
        let (crlf, _) = read_bytes(format, text.replace('\n', "\r\n").as_bytes()).unwrap();
        assert_same(&crlf, &plain, file);
        let (marked, _) = read_bytes(format, format!("\u{feff}{text}").as_bytes()).unwrap();
        assert_same(&marked, &plain, file);
        let by_hand = text.as_bytes().windows(7).position(|w| w == b"by hand").map(|at| {
            let mut bytes = text.clone().into_bytes();
            bytes[at..at + 7].copy_from_slice(b"b\xff\xfe\x80\xc3(d");
            bytes
        });
        if let Some(bytes) = by_hand {
            assert_same(&read_bytes(format, &bytes).unwrap().0, &plain, file);
        }
    }
    let folder = crate::files_support::folder("crlf");
    for extension in ["node", "ele", "face"] {
        let mut bytes =
            fs::read_to_string(sample("two").with_extension(extension)).unwrap().replace('\n', "\r\n").into_bytes();
        bytes.extend(b"# \xff\xfe");
        fs::write(folder.join("two").with_extension(extension), bytes).unwrap();
    }
    assert_same(&read(folder.join("two.node")).unwrap(), &read(sample("two.node")).unwrap(), "tetgen");
}

/// A file of an unknown extension is told by its content.
#[test]
fn content_without_an_extension() {
    let folder = crate::files_support::folder("content");
    for file in ["square-22.msh", "tets-41.msh", "grid.vtu", "grid-20.vtk", "two.stl"] {
        let nameless = folder.join("mesh.txt");
        fs::copy(sample(file), &nameless).unwrap();
        assert_same(&read(&nameless).unwrap(), &read(sample(file)).unwrap(), file);
    }
    let data = read(sample("two.stl")).unwrap();
    write(folder.join("mesh.bin"), &data, Format::StlBinary).unwrap();
    assert_eq!(read(folder.join("mesh.bin")).unwrap().points.len(), 4);
}
