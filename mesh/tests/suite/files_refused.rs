//! What cannot be read is an error that says where, what was found, and what was expected.

use crate::files_support::{folder, sample};
use std::fs;
use stylet_mesh::io::{Collection, Format, TetgenFiles, read, read_bytes, read_tetgen};

fn error(format: Format, bytes: &[u8]) -> String {
    match read_bytes(format, bytes) {
        Err(error) => error.to_string(),
        Ok((data, _)) => panic!("{data:?}"),
    }
}

/// A sample with `from` replaced by `to`, which has to be there.
fn changed(file: &str, format: Format, from: &str, to: &str) -> String {
    let text = fs::read_to_string(sample(file)).unwrap();
    assert!(text.contains(from), "{from}");
    error(format, text.replacen(from, to, 1).as_bytes())
}

#[track_caller]
fn assert_says(message: &str, parts: &[&str]) {
    assert!(parts.iter().all(|part| message.contains(part)), "{message:?} lacks one of {parts:?}");
}

#[test]
fn files_as_such() {
    let folder = folder("as-such");
    let says = |name: &str, bytes: &[u8], parts: &[&str]| {
        fs::write(folder.join(name), bytes).unwrap();
        let message = read(folder.join(name)).unwrap_err().to_string();
        assert_says(&message, &[name]);
        assert_says(&message, parts);
    };
    says("empty.msh", b"", &["the file is empty"]);
    says("blank.vtk", b" \n\n", &["the file is empty"]);
    says("mesh.xyz", b"hello", &["unknown format: extension \"xyz\"", "\"hello\"", ".msh"]);
    says("frames.pvd", b"<VTKFile type=\"Collection\"/>", &["ParaView collection"]);
    says("mesh.msh", b"# vtk DataFile Version 3.0\n", &["line 1: expected \"$MeshFormat\", found \"#\""]);
    says("garbage.msh", &[0, 255, 7, 9, 254, 13], &["line 1: expected \"$MeshFormat\""]);
    says("garbage.vtu", &[0x7f, 255, 7, 9], &["line 1: expected an XML document"]);
    says("garbage.vtk", &[0x7f, 255, 7, 9], &["line 1: expected \"# vtk DataFile Version\""]);
    says("garbage.stl", &[0x7f, 255, 7, 9], &["byte 4: the file ends where \"solid\""]);
    says("garbage.node", &[0x7f, 255, 7, 9], &["line 1: expected the number of points"]);
    fs::create_dir(folder.join("folder.msh")).unwrap();
    assert_says(&read(folder.join("folder.msh")).unwrap_err().to_string(), &["folder.msh: this is a folder"]);
    assert_says(&read(folder.join("none.msh")).unwrap_err().to_string(), &["none.msh: No such file"]);
    assert_says(&read(folder.join("none.ele")).unwrap_err().to_string(), &["none.ele: No such file"]);
    assert_says(&Collection::read(folder.join("none.pvd")).unwrap_err().to_string(), &["none.pvd: No such file"]);
}

#[test]
fn gmsh_headers() {
    let says = |text: &str, parts: &[&str]| assert_says(&error(Format::Msh41, text.as_bytes()), parts);
    says("$MeshFormat\n4.0 0 8\n$EndMeshFormat\n", &["line 2: version \"4.0\" is not read", "2.0 to 2.2, or 4.1"]);
    says("$MeshFormat\nx 0 8\n", &["line 2: version \"x\""]);
    says("$NOD\n3\n", &["line 1: version 1.0 is not read"]);
    says("$MeshFormat\n2.2 2 8\n", &["line 2: expected 0 for text or 1 for binary, found \"2\""]);
    says("$MeshFormat\n2.2 1 4\n", &["line 2: expected data size 8, found \"4\""]);
    says(
        "$MeshFormat\n2.2 1 8\n\x07\0\0\0\n",
        &["byte 20: expected the number 1 in 4 bytes, found bytes [7, 0, 0, 0]"],
    );
    says("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", &["section $Nodes is missing"]);
    says("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n0 0 0 0\n$EndNodes\n", &["section $Elements is missing"]);
    says("$MeshFormat\n4.1 0 8\n$Nodes\n", &["line 3: expected \"$EndMeshFormat\"", "found \"$Nodes\""]);
    says(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\nNodes\n",
        &["line 4: expected a section such as \"$Nodes\", found \"Nodes\""],
    );
    says("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Other\n1 2 3\n", &["line 4", "$EndOther", "ends"]);
    says(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Elements\n1\n1 15 0 1\n$EndElements\n",
        &["$Nodes before this one is missing"],
    );
}

#[test]
fn gmsh_22() {
    let says = |from: &str, to: &str, parts: &[&str]| {
        assert_says(&changed("square-22.msh", Format::Msh22, from, to), parts);
    };
    says("$Nodes\n4\n", "$Nodes\n4000000000\n", &["line 11: 4000000000 nodes need 32000000000 bytes or more"]);
    says("$Nodes\n4\n", "$Nodes\n99999999999999999999\n", &["line 11: expected the number of nodes"]);
    says("$Nodes\n4\n", "$Nodes\n-4\n", &["line 11: expected the number of nodes, found \"-4\""]);
    says("$Nodes\n4\n", "$Nodes\n3\n", &["line 15: expected \"$EndNodes\"", "found \"5\""]);
    says("$Nodes\n4\n", "$Nodes\n5\n", &["line 16: expected the number of a node, found \"$EndNodes\""]);
    says("7 1 1 0\n", "7 1 nan 0\n", &["line 14: coordinate 1 of vertex 2 is NaN, expected was a finite number"]);
    says("7 1 1 0\n", "7 1 1 1e999\n", &["line 14: coordinate 2 of vertex 2 is inf"]);
    says("7 1 1 0\n", "7 1 one 0\n", &["line 14: expected a coordinate, found \"one\""]);
    says("7 1 1 0\n", "1 1 1 0\n", &["line 14: node 1 occurs twice"]);
    says("7 1 1 0\n", "-7 1 1 0\n", &["line 14: expected the number of a node, found -7"]);
    says("0 1 2 7\n", "0 1 2 8\n", &["line 20: node 8 does not exist, there are 4 between 1 and 7"]);
    says(
        "13 2 2 6 1",
        "13 3 2 6 1",
        &["line 21: 1 cells of type quadrangle (number 3): only points, segments, triangles"],
    );
    says("12 2 3 5", "12 9 3 5", &["line 20: 1 cells of type triangle with 6 nodes (number 9)"]);
    says("12 2 3 5", "12 2 300000 5", &["line 20: 300000 tags need 600000 bytes or more"]);
    says("12 2 3 5", "12 2 3 5000000000", &["line 20: expected a number of 32 bits, found 5000000000"]);
    says("$Comments", "$Nodes", &["line 23: section $Nodes occurs a second time"]);
    says("1 1 \"left side\"", "1 1 left side", &["line 6: expected a name in quotation marks, found \"left side\""]);
    says("1 1 \"left side\"", "4 1 \"left side\"", &["line 6: expected a dimension from 0 to 3, found \"4\""]);
    says("2 6 \"upper\"", "2 5 \"upper\"", &["name of physical group 5 occurs twice"]);
    says("0\n1\n3\n1 20.5", "0\n1\n3000\n1 20.5", &["3000 entries of a field need"]);
    says("0\n1\n3\n1 20.5", "0\n77\n3\n1 20.5", &["expected 1 to 9 components, found \"77\""]);
    says("5 -3e2\n", "6 -3e2\n", &["line 37: node 6 does not exist"]);
    says("5 -3e2\n", "1 -3e2\n", &["line 37: node 1 occurs twice"]);
    says("12 1 0 0", "14 1 0 0", &["element 14 does not exist"]);
    says("13 2 2 6 1", "12 2 2 6 1", &["element 12 occurs twice"]);
    says("0.5\n3\n0\n1\n3\n", "0.5\n2\n0\n1\n", &["3 integers or more"]);
    says("\"temperature\"", "temperature", &["expected a text in quotation marks, found \"temperature\""]);
    // All quadrangles are counted.
    let text = fs::read_to_string(sample("square-22.msh")).unwrap();
    let quads = text.replace("12 2 3 5", "12 3 3 5").replace("13 2 2 6", "13 3 2 6");
    assert_says(&error(Format::Msh22, quads.as_bytes()), &["line 20: 2 cells of type quadrangle"]);
}

#[test]
fn gmsh_41() {
    let says = |from: &str, to: &str, parts: &[&str]| {
        assert_says(&changed("tets-41.msh", Format::Msh41, from, to), parts);
    };
    says("2 5 1 20", "2 6 1 20", &["line 16: the sum of the blocks of nodes has 5 numbers, expected were 6"]);
    says("2 5 1 20", "2 4000000000 1 20", &["line 16: 4000000000 nodes need"]);
    says("2 5 1 20", "9000000000 5 1 20", &["line 16: 9000000000 blocks need"]);
    says(
        "3 1 0 3\n",
        "3 1 0 18446744073709551615\n",
        &["line 22: 18446744073709551615 nodes need 18446744073709551615 bytes"],
    );
    says("2 1 1 2\n", "7 1 1 2\n", &["line 17: expected a dimension from 0 to 3"]);
    says("2 3 1 9", "2 4 1 9", &["line 31: the sum of the blocks of elements has 3 numbers, expected were 4"]);
    says("3 1 4 2\n", "3 1 11 2\n", &["line 34: 2 cells of type tetrahedron with 10 nodes (number 11)"]);
    says("3 1 4 2\n", "3 1 5 2\n", &["line 34: 2 cells of type hexahedron (number 5)"]);
    says("9 2 10 20 4", "9 2 10 21 4", &["line 36: node 21 does not exist"]);
    says("1 0 1 1\n", "1 0 1 1000000000000\n", &["line 10: 1000000000000 entities need"]);
    says("1 1 1 1 1 1 1\n", "1 1 1 1 1 99999 1\n", &["line 13: 99999 bounding entities need"]);
    says("\n20\n4\n", "\n2\n4\n", &["line 24: node 2 occurs twice"]);
}

#[test]
fn vtu() {
    let says = |from: &str, to: &str, parts: &[&str]| assert_says(&changed("grid.vtu", Format::Vtu, from, to), parts);
    says(
        "type=\"UnstructuredGrid\"",
        "type=\"ImageData\"",
        &["line 3: expected VTK data of type \"UnstructuredGrid\"", "ImageData"],
    );
    says("LittleEndian", "MiddleEndian", &["line 3: expected byte_order", "MiddleEndian"]);
    says(
        "version=\"0.1\"",
        "compressor=\"vtkLZMADataCompressor\"",
        &["expected no compressor", "vtkLZMADataCompressor"],
    );
    says("NumberOfPoints=\"4\"", "NumberOfPoints=\"99999999999\"", &["line 20: 99999999999 points are too many"]);
    says(
        "NumberOfPoints=\"4\"",
        "NumberOfPoints=\"4000000000\"",
        &["numbers in fields for a file of this size are too many"],
    );
    says("NumberOfPoints=\"4\"", "NumberOfPoints=\"5\"", &["line 20: array \"\" has 12 numbers, expected were 15"]);
    says("NumberOfPoints=\"4\"", "NumberOfPoints=\"-4\"", &["line 8: expected a count as attribute NumberOfPoints"]);
    says("NumberOfCells=\"3\"", "", &["line 8: attribute NumberOfCells is missing"]);
    says("1 0 0  1 1 0", "1 0 inf  1 1 0", &["line 20: coordinate 2 of vertex 1 is inf"]);
    says("0 2 3 0 1<", "0 2 4 0 1<", &["line 25: point 4 does not exist, there are points 0 to 3"]);
    says("3 6 8<", "3 5 8<", &["line 26: expected offset 6 behind cell 1, which has 3 vertices, found 5"]);
    says("0 2 3 0 1<", "0 2 3 0<", &["line 25: array \"connectivity\" has 7 numbers, expected were 8"]);
    says("0 2 3 0 1<", "0 2 3 0 1 2<", &["line 25: array \"connectivity\" has 9 numbers, expected were 8"]);
    says("5 5 3<", "5 9 9<", &["line 27: 2 cells of type quadrilateral (number 9)"]);
    says("5 5 3<", "5 24 3<", &["line 27: 1 cells of type quadratic tetrahedron (number 24)"]);
    says("Name=\"types\"", "Name=\"kinds\"", &["line 24: array \"types\" is missing"]);
    says("1 2.5 3 1e-3", "1 2.5 3 x", &["line 10: expected a number, found \"x\""]);
    says("1 2.5 3 1e-3", "1 2.5 3", &["line 10: array \"heat\" has 3 numbers, expected were 4"]);
    says("type=\"Float32\"", "type=\"Float16\"", &["line 11: expected a type of numbers", "Float16"]);
    says(
        "NumberOfComponents=\"3\" format=\"ascii\">\n          0 0 1",
        "NumberOfComponents=\"0\" format=\"ascii\">\n          0 0 1",
        &["line 11: expected a component or more"],
    );
    says(
        "format=\"ascii\">1 2.5 3 1e-3<",
        "format=\"binary\">AAAA<",
        &["line 10: the file ends where 4 bytes of an array, 3 of them there"],
    );
    says(
        "format=\"ascii\">1 2.5 3 1e-3<",
        "format=\"binary\">/////w==<",
        &["line 10: 4294967295 bytes of an array need"],
    );
    says(
        "format=\"ascii\">1 2.5 3 1e-3<",
        "format=\"appended\" offset=\"0\"><",
        &["line 10: element AppendedData is missing"],
    );
    let attributes: String = (0..300).map(|i| format!("a{i}=\"\" ")).collect();
    says("<Cells>", &format!("<Cells {attributes}>"), &["line 24: 300 attributes of an element are too many"]);
    let spaces: String = (0..20).map(|i| format!("xmlns:a{i}=\"b\" ")).collect();
    says("<Cells>", &format!("<Cells {spaces}>"), &["line 24: 20 name spaces are too many"]);
    says("</Cells>", "", &["line 29: expected an XML document"]);
    says("<?xml version=\"1.0\"?>", "<!DOCTYPE a [<!ENTITY b \"b\">]>", &["DTD"]);
}

#[test]
fn legacy_vtk() {
    let says =
        |from: &str, to: &str, parts: &[&str]| assert_says(&changed("grid-20.vtk", Format::Vtk, from, to), parts);
    says("Version 2.0", "Version 9.0", &["line 1: version \"9.0\" is not read", "1.0 to 5.1"]);
    says("ASCII", "MORSE", &["line 3: expected \"ASCII\" or \"BINARY\", found \"MORSE\""]);
    says("UNSTRUCTURED_GRID", "STRUCTURED_POINTS", &["line 4: a data set of type \"STRUCTURED_POINTS\""]);
    says("POINTS 4 float", "POINTS 4000000000 float", &["line 6: 12000000000 coordinates need 24000000000 bytes"]);
    says("POINTS 4 float", "POINTS 5000000000 float", &["line 6: 5000000000 points are too many"]);
    says("POINTS 4 float", "POINTS 4 string", &["line 6: an array of type \"string\" cannot be read"]);
    says("0 1 0  0 0 1", "0 1 0  0 NaN 1", &["line 8: coordinate 1 of vertex 3 is NaN"]);
    says("CELLS 2 9", "CELLS 3 9", &["line 10: the list of cells has 2 numbers, expected were 3"]);
    says("CELLS 2 9", "CELLS 2 8", &["line 10: expected 3 vertices of cell 1, found 2 numbers left in the list"]);
    says("4 0 1 2 3", "-4 0 1 2 3", &["line 10: expected -4 vertices of cell 0"]);
    says("3 0 1 2\n", "3 0 1 4\n", &["line 10: point 4 does not exist, there are points 0 to 3"]);
    says("10\n5\n", "10\n9\n", &["line 14: 1 cells of type quadrilateral (number 9)"]);
    says("10\n5\n", "10\n10\n", &["line 10: expected 4 vertices of cell 1, which has type 10, found 3 vertices"]);
    says("CELL_TYPES 2", "CELL_TYPES 1", &["line 16: expected a section", "found \"5\""]);
    says("POINT_DATA 4", "POINT_DATA 3", &["\"4.5\""]);
    says("CELL_DATA 2", "CELL_DATA 3", &["array \"region\"", "2 numbers, expected were 3"]);
    says("VECTORS velocity", "MATRICES velocity", &["line 22: expected an attribute", "MATRICES"]);
    says("POINT_DATA 4", "POINTS 0 float\nPOINT_DATA 4", &["line 18: section \"POINTS\" occurs a second time"]);
    let says =
        |from: &str, to: &str, parts: &[&str]| assert_says(&changed("surface.vtk", Format::Vtk, from, to), parts);
    says("POLYGONS 2 8\n3 0 1 2\n3 1 3 2", "POLYGONS 1 5\n4 0 1 2 3", &["1 cells of type polygon with 4 vertices"]);
    says("POLYGONS 2", "TRIANGLE_STRIPS 2", &["2 cells of type triangle strip"]);
    let says =
        |from: &str, to: &str, parts: &[&str]| assert_says(&changed("grid-51.vtk", Format::Vtk, from, to), parts);
    says("0 3 6", "0 7 6", &["line 17: expected offsets that ascend from 0 to 6"]);
    says("0 3 6", "0 3 5", &["line 17: expected offsets that ascend from 0 to 6, found such from 0 to 5"]);
    says("CELLS 3 6", "CELLS 3 99999999", &["99999999 vertices of cells need"]);
}

#[test]
fn binary_places_are_bytes() {
    let mut bytes = b"# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 double\n".to_vec();
    let start = bytes.len();
    [0.0, 1.0, 2.0, 3.0, f64::NEG_INFINITY, 5.0].iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    assert_says(
        &error(Format::VtkBinary, &bytes),
        &[&format!("byte {}: coordinate 1 of vertex 1 is -inf", start + 32)],
    );

    let mut bytes = vec![b' '; 80];
    bytes.extend(1_u32.to_le_bytes());
    [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, f32::NAN].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes.resize(134, 0);
    assert_says(&error(Format::StlBinary, &bytes), &["byte 84: coordinate 0 of vertex 1 is NaN"]);
    bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_says(
        &error(Format::StlBinary, &bytes),
        &["byte 80: 4294967295 triangles need 214748364750 bytes or more, but 50 are left"],
    );
    bytes[80..84].copy_from_slice(&0_u32.to_le_bytes());
    assert_says(
        &error(Format::StlBinary, &bytes),
        &["byte 84: expected the end of the file after 0 triangles, found 50 bytes more"],
    );
}

#[test]
fn stl_text() {
    let says = |from: &str, to: &str, parts: &[&str]| assert_says(&changed("two.stl", Format::Stl, from, to), parts);
    says("vertex 0 1 0", "vertex 0 inf 0", &["line 6: coordinate 1 of vertex 2 is inf"]);
    says("vertex 0 1 0", "vertex 0 1", &["line 7: expected a coordinate, found \"endloop\""]);
    says("    endloop\n", "", &["line 7: expected \"endloop\", found \"endfacet\""]);
    says("endsolid upper", "", &["line 19: the file ends where \"facet\" or \"endsolid\" was expected"]);
    says("facet normal 0.0", "face normal 0.0", &["line 11: expected \"facet\" or \"endsolid\", found \"face\""]);
    says("endsolid lower part\n", "endsolid lower part\nmore\n", &["line 10: expected \"solid\", found \"more\""]);
}

#[test]
fn tetgen() {
    let [node, ele, face] =
        ["node", "ele", "face"].map(|e| fs::read_to_string(sample("two").with_extension(e)).unwrap());
    let says = |from: &str, to: &str, parts: &[&str]| {
        let count = [&node, &ele, &face].iter().filter(|text| text.contains(from)).count();
        assert_eq!(count, 1, "{from}");
        let [node, ele, face] = [&node, &ele, &face].map(|text| text.replacen(from, to, 1));
        let files =
            TetgenFiles { node: node.as_bytes(), ele: Some(ele.as_bytes()), face: Some(face.as_bytes()), edge: None };
        assert_says(&read_tetgen(&files).unwrap_err().to_string(), parts);
    };
    says("5 3 1 1\n", "5 4 1 1\n", &[".node, line 2: expected dimension 2 or 3, found \"4\""]);
    says("5 3 1 1\n", "6 3 1 1\n", &[".node, line 10", "ends where a point was expected"]);
    says("5 3 1 1\n", "4 3 1 1\n", &[".node, line 9: expected the end of the file after as many points"]);
    says("5 3 1 1\n", "5000000000 3 1 1\n", &[".node, line 2: 5000000000 points need"]);
    says("5 3 1 1\n", "5 3 18446744073709551615 1\n", &[".node, line 2: 5 points need"]);
    says(
        "5 3 1 1\n",
        "5 3 1 2\n",
        &[".node, line 2: expected 0 or 1, whether there are boundary markers, found \"2\""],
    );
    says("3   0.0 1.0", "4   0.0 1.0", &[".node, line 6: expected point 3, found \"point 4\""]);
    says("3   0.0 1.0", "2   0.0 1.0", &[".node, line 6: point 2 occurs twice"]);
    says("1   0.0 0.0", "7   0.0 0.0", &[".node, line 4: expected 0 or 1 as the number of the first point"]);
    says("1.0 1.0 1.0 ", "1.0 nan 1.0 ", &[".node, line 9: coordinate 1 of vertex 4 is NaN"]);
    says("3.5   2", "3.5   2 8", &[".node, line 6: expected the end of the line, found \"8\""]);
    says("3.5   2", "3.5", &[".node, line 6: the file ends where a boundary marker"]);
    says("2 4 2\n", "2 10 2\n", &[".ele, line 1: 2 cells of type tetrahedron with 10 nodes"]);
    says("2 4 2\n", "2 3 2\n", &[".ele, line 1: 2 cells of type cell with 3 nodes in 3 dimensions"]);
    says("2 3 4 5   -2", "2 3 4 6   -2", &[".ele, line 3: point 6 does not exist, there are points 1 to 5"]);
    says("2 3 4 5   -2", "0 3 4 5   -2", &[".ele, line 3: point 0 does not exist"]);
    says("1 1 2 3 5", "1 1 2 3 x", &[".face, line 2: expected a boundary marker, found \"x\""]);
}

/// Wherever a file is cut, there is an error or, where what is cut off was not needed, less data; never a panic.
#[test]
fn every_sample_cut_anywhere() {
    let mut read = 0;
    for entry in fs::read_dir(sample("")).unwrap() {
        let path = entry.unwrap().path();
        let Some(format) = Format::of_extension(&path) else { continue };
        let bytes = fs::read(&path).unwrap();
        for end in 0..bytes.len() {
            if let Ok((data, _)) = read_bytes(format, &bytes[..end]) {
                assert_eq!(data.check(), Ok(()), "{path:?} cut at {end}");
                read += 1;
            }
        }
    }
    assert!(read > 0, "some files have something behind the mesh");
}
