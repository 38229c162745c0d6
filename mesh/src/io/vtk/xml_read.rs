//! Reads `.vtu` files.

use super::{
    kind::Kind,
    push_cell, take_regions, vertices_per_cell, xml,
    xml_arrays::{Appended, Encoding},
};
use crate::io::{
    DataField, MeshData, Problem, ReadError,
    cursor::{self, ByteOrder, check_finite, check_u32},
    fields::{self, Budget},
};
use roxmltree::Node;

/// Reads an unstructured grid; its pieces become one mesh.
pub(in crate::io) fn read(bytes: &[u8], notes: &mut Vec<String>) -> Result<MeshData, ReadError> {
    let (head, appended) = split_appended(bytes);
    let mut text = String::from_utf8_lossy(head).into_owned();
    if appended.is_some() {
        text.push_str("</AppendedData></VTKFile>");
    }
    let document = xml::parse(&text)?;
    let root = xml::root(&document, "UnstructuredGrid")?;
    let encoding = encoding(root, appended)?;
    let grid = xml::child(root, "UnstructuredGrid")?;
    for array in xml::children(grid, "FieldData").flat_map(|node| xml::children(node, "DataArray")) {
        notes.push(format!(
            "field data {:?}: neither on points nor on cells",
            array.attribute("Name").unwrap_or_default()
        ));
    }
    let mut data = MeshData::default();
    // Several arrays may name the same appended bytes.
    let mut budget = Budget::of(std::iter::once(bytes));
    for (number, piece) in xml::children(grid, "Piece").enumerate() {
        read_piece(piece, number == 0, &encoding, &mut budget, &mut data, notes)?;
    }
    take_regions(&mut data, notes);
    data.dimension = data.natural_dimension();
    Ok(data)
}

/// The part that is XML, up to the start tag of the appended data, and these behind their underscore: raw ones are no
/// XML.
fn split_appended(bytes: &[u8]) -> (&[u8], Option<&[u8]>) {
    let Some(tag) = cursor::find(bytes, b"<AppendedData") else {
        return (bytes, None);
    };
    let Some(end) = bytes[tag..].iter().position(|&b| b == b'>').map(|at| tag + at + 1) else {
        return (bytes, None);
    };
    if bytes[end - 2] == b'/' {
        return (bytes, None);
    }
    let start = bytes[end..].iter().position(|&b| b == b'_').map_or(bytes.len(), |at| end + at + 1);
    // Raw data may hold the end tag by chance, so the last one counts.
    let tag: &[u8] = b"</AppendedData";
    let stop = bytes[start..].windows(tag.len()).rposition(|window| window == tag);
    (&bytes[..end], Some(&bytes[start..stop.map_or(bytes.len(), |at| start + at)]))
}

fn encoding<'a>(root: Node<'_, '_>, appended: Option<&'a [u8]>) -> Result<Encoding<'a>, ReadError> {
    let unknown = |name: &'static str, expected: &'static str| {
        let found = cursor::shown(root.attribute(name).unwrap_or_default().as_bytes());
        xml::error(root, Problem::Syntax { expected: expected.into(), found })
    };
    let order = match root.attribute("byte_order") {
        None | Some("LittleEndian") => ByteOrder::Little,
        Some("BigEndian") => ByteOrder::Big,
        Some(_) => return Err(unknown("byte_order", "byte_order \"LittleEndian\" or \"BigEndian\"")),
    };
    let header = match root.attribute("header_type") {
        None | Some("UInt32") => Kind::U32,
        Some("UInt64") => Kind::U64,
        Some(_) => return Err(unknown("header_type", "header_type \"UInt32\" or \"UInt64\"")),
    };
    let compressed = match root.attribute("compressor") {
        None | Some("") => false,
        Some("vtkZLibDataCompressor") => true,
        Some(_) => return Err(unknown("compressor", "no compressor, or \"vtkZLibDataCompressor\"")),
    };
    let appended = match appended {
        None => None,
        Some(bytes) => {
            let node = xml::child(root, "AppendedData")?;
            Some(Appended { bytes, is_base64: node.attribute("encoding") != Some("raw") })
        }
    };
    Ok(Encoding { order, header, compressed, appended })
}

fn read_piece(
    piece: Node<'_, '_>,
    is_first: bool,
    encoding: &Encoding<'_>,
    budget: &mut Budget,
    data: &mut MeshData,
    notes: &mut Vec<String>,
) -> Result<(), ReadError> {
    let (n_points, n_cells) = (xml::number(piece, "NumberOfPoints")?, xml::number(piece, "NumberOfCells")?);
    let (first, cells_before) = (data.points.len(), data.n_cells());
    if n_points > 0 {
        read_points(xml::child(piece, "Points")?, n_points, encoding, budget, data)?;
    }
    if n_cells > 0 {
        read_cells(xml::child(piece, "Cells")?, n_cells, first, encoding, budget, data)?;
    }
    // These arrays are in memory now, so the counts are those of a file that has paid for them.
    for (name, entries, before) in [("PointData", n_points, first), ("CellData", n_cells, cells_before)] {
        let mut fields = Vec::new();
        for node in xml::children(piece, name) {
            read_fields(node, entries, encoding, budget, &mut fields, notes)?;
        }
        let all = if name == "PointData" { &mut data.point_fields } else { &mut data.cell_fields };
        // A piece without entries need not have the fields of the others.
        if is_first || before == 0 && all.is_empty() {
            *all = fields;
        } else if entries > 0 {
            append_fields(piece, all, fields)?;
        }
    }
    Ok(())
}

/// The array of an element by its name.
fn array_named<'a>(node: Node<'a, 'a>, name: &'static str) -> Result<Node<'a, 'a>, ReadError> {
    let found = xml::children(node, "DataArray").find(|array| array.attribute("Name") == Some(name));
    found.ok_or_else(|| xml::error(node, Problem::Missing(format!("array {name:?}").into())))
}

fn read_points(
    node: Node<'_, '_>,
    n: u64,
    encoding: &Encoding<'_>,
    budget: &mut Budget,
    data: &mut MeshData,
) -> Result<(), ReadError> {
    let node = xml::child(node, "DataArray")?;
    let fail = |problem| xml::error(node, problem);
    check_u32(n.saturating_add(data.points.len() as u64), "points").map_err(fail)?;
    if components(node)? != 3 {
        let found = format!("{:?}", node.attribute("NumberOfComponents"));
        return Err(fail(Problem::Syntax { expected: "points of 3 components".into(), found }));
    }
    budget.take(n, 3).map_err(fail)?;
    let coordinates = encoding.array(node, Some(n.saturating_mul(3)))?.reals();
    for point in coordinates.as_chunks::<3>().0 {
        for axis in 0..3 {
            check_finite(data.points.len(), axis, point[axis]).map_err(fail)?;
        }
        data.points.push(*point);
    }
    Ok(())
}

fn components(node: Node<'_, '_>) -> Result<u64, ReadError> {
    match node.attribute("NumberOfComponents") {
        None => Ok(1),
        Some(_) => xml::number(node, "NumberOfComponents"),
    }
}

fn read_cells(
    node: Node<'_, '_>,
    n: u64,
    first: usize,
    encoding: &Encoding<'_>,
    budget: &mut Budget,
    data: &mut MeshData,
) -> Result<(), ReadError> {
    let type_node = array_named(node, "types")?;
    budget.take(n, 2).map_err(|problem| xml::error(type_node, problem))?;
    let types = encoding.array(type_node, Some(n))?.integers();
    let offset_node = array_named(node, "offsets")?;
    let offsets = encoding.array(offset_node, Some(n))?.integers();
    let connectivity_node = array_named(node, "connectivity")?;
    let connectivity = encoding.array(connectivity_node, None)?.integers();
    let mut start = 0;
    for (cell, (&kind, &end)) in types.iter().zip(&offsets).enumerate() {
        let size = vertices_per_cell(kind, &types).map_err(|problem| xml::error(type_node, problem))?;
        if end != (start + size) as i64 {
            let expected = format!("offset {} behind cell {cell}, which has {size} vertices", start + size).into();
            return Err(xml::error(offset_node, Problem::Syntax { expected, found: end.to_string() }));
        }
        let vertices = connectivity.get(start..start + size).ok_or_else(|| {
            let (found, expected) = (connectivity.len() as u64, offsets.last().map_or(0, |&last| last.max(0) as u64));
            xml::error(
                connectivity_node,
                Problem::Length { what: "array \"connectivity\"".to_owned(), found, expected },
            )
        })?;
        push_cell(data, vertices, first).map_err(|problem| xml::error(connectivity_node, problem))?;
        start += size;
    }
    if start != connectivity.len() {
        let (found, expected) = (connectivity.len() as u64, start as u64);
        let what = "array \"connectivity\"".to_owned();
        return Err(xml::error(connectivity_node, Problem::Length { what, found, expected }));
    }
    Ok(())
}

fn read_fields(
    node: Node<'_, '_>,
    entries: u64,
    encoding: &Encoding<'_>,
    budget: &mut Budget,
    fields: &mut Vec<DataField>,
    notes: &mut Vec<String>,
) -> Result<(), ReadError> {
    for array in xml::children(node, "DataArray").chain(xml::children(node, "Array")) {
        let name = array.attribute("Name").unwrap_or_default();
        if matches!(array.attribute("type"), Some("String" | "Bit" | "vtkStringArray")) {
            notes.push(format!("array {name:?}: it does not hold numbers"));
            continue;
        }
        let components = components(array)?;
        let positive = usize::try_from(components).ok().filter(|&n| n > 0);
        let zero = || Problem::Syntax { expected: "a component or more".into(), found: components.to_string() };
        let positive = positive.ok_or_else(|| xml::error(array, zero()))?;
        budget.take(entries, components).map_err(|problem| xml::error(array, problem))?;
        let values = encoding.array(array, Some(entries.saturating_mul(components)))?.reals();
        let field = DataField { name: name.to_owned(), components: positive, values };
        fields::add(fields, field).map_err(|problem| xml::error(array, problem))?;
    }
    Ok(())
}

/// Appends the fields of a further piece, which has to have the same ones.
fn append_fields(piece: Node<'_, '_>, all: &mut [DataField], fields: Vec<DataField>) -> Result<(), ReadError> {
    for field in &mut *all {
        let same = |other: &&DataField| other.name == field.name && other.components == field.components;
        let Some(more) = fields.iter().find(same) else {
            let what = format!("array {:?} with {} components, as in the pieces before,", field.name, field.components);
            return Err(xml::error(piece, Problem::Missing(what.into())));
        };
        field.values.extend_from_slice(&more.values);
    }
    if let Some(new) = fields.iter().find(|field| all.iter().all(|other| other.name != field.name)) {
        let what = format!("array {:?} in the pieces before this one", new.name);
        return Err(xml::error(piece, Problem::Missing(what.into())));
    }
    Ok(())
}
