//! Reads `.node`, `.ele`, `.face` and `.edge`.

use super::{MARKER, TetgenFiles};
use crate::io::{
    DataField, MeshData, Place, Problem, ReadError,
    cursor::{Cursor, check_finite},
    fields::{self, Budget},
    number::whole,
};

/// An error, and the extension of the file that it is in.
type Located<T> = Result<T, (ReadError, &'static str)>;

/// Reads the files of a mesh; the cells come in the order `.ele`, `.face`, `.edge`.
pub(in crate::io) fn read(files: &TetgenFiles<'_>, notes: &mut Vec<String>) -> Located<MeshData> {
    let mut budget = Budget::of([Some(files.node), files.ele, files.face, files.edge].into_iter().flatten());
    let at = |extension| move |error| (error, extension);
    let (mut data, base) = read_points(files.node, &mut budget).map_err(at("node"))?;
    let mut attributes = Vec::new();
    if let Some(bytes) = files.ele {
        let size = data.dimension + 1;
        attributes = read_elements(bytes, size, base, &mut data).map_err(at("ele"))?;
    }
    let n_elements = data.n_cells();
    for (bytes, size, extension) in [(files.face, 3, "face"), (files.edge, 2, "edge")] {
        if let Some(bytes) = bytes {
            read_faces(bytes, size, base, &mut data).map_err(at(extension))?;
        }
    }
    add_attributes(&mut data, &attributes, n_elements, &mut budget, notes).map_err(at("ele"))?;
    Ok(data)
}

/// The points, their fields, and the number of the first one, 0 or 1.
fn read_points(bytes: &[u8], budget: &mut Budget) -> Result<(MeshData, u64), ReadError> {
    let mut cursor = Cursor::new(bytes);
    let mut header = record(&mut cursor, "a line with the number of points")?;
    let at = header.at();
    let n: u64 = header.number("the number of points")?;
    let dimension: usize = header.number("the dimension, 2 or 3")?;
    if !matches!(dimension, 2 | 3) {
        return Err(header.syntax(at, "dimension 2 or 3", dimension.to_string().as_bytes()));
    }
    let n_attributes = optional(&mut header, "the number of attributes")?;
    let has_marker = flag(&mut header, "0 or 1, whether there are boundary markers")?;
    // A word and its separator take two bytes.
    let words = n_attributes.saturating_add(u64::from(has_marker)).saturating_add(1 + dimension as u64);
    let each = usize::try_from(words.saturating_mul(2)).unwrap_or(usize::MAX);
    let n = cursor.check_count(n, each, "points").map_err(|problem| cursor.line_error(at, problem))?;
    // Without points nothing has bounded it.
    let n_attributes = if n == 0 { 0 } else { n_attributes as usize };

    let mut data = MeshData { dimension, ..MeshData::default() };
    budget
        .take(n as u64, n_attributes as u64 + u64::from(has_marker))
        .map_err(|problem| cursor.line_error(at, problem))?;
    let mut columns = vec![Vec::with_capacity(n); n_attributes];
    let (mut markers, mut base) = (Vec::new(), 0);
    for vertex in 0..n {
        let mut line = record(&mut cursor, "a point")?;
        let at = line.at();
        let number: u64 = line.number("the number of a point")?;
        if vertex == 0 {
            base = number;
        }
        check_number(&line, at, number, base, vertex)?;
        let mut point = [0.0; 3];
        for (axis, x) in point.iter_mut().enumerate().take(dimension) {
            let value = line.number("a coordinate")?;
            *x = check_finite(vertex, axis, value).map_err(|problem| line.line_error(at, problem))?;
        }
        data.points.push(point);
        for column in &mut columns {
            column.push(line.number("an attribute")?);
        }
        if has_marker {
            markers.push(f64::from(line.number::<i32>("a boundary marker")?));
        }
        end(&mut line)?;
    }
    let named = columns.into_iter().enumerate();
    let attributes = named.map(|(i, values)| scalar(format!("attribute {}", i + 1), values));
    for field in attributes.chain(has_marker.then(|| scalar(MARKER.to_owned(), markers))) {
        fields::add(&mut data.point_fields, field).map_err(|problem| cursor.line_error(at, problem))?;
    }
    nothing_more(&mut cursor, "points")?;
    Ok((data, base))
}

/// The first point is 0 or 1, and the others follow one by one.
fn check_number(line: &Cursor<'_>, at: usize, number: u64, base: u64, vertex: usize) -> Result<(), ReadError> {
    let expected = base.saturating_add(vertex as u64);
    if base > 1 {
        return Err(line.syntax(at, "0 or 1 as the number of the first point", number.to_string().as_bytes()));
    }
    if number < expected {
        return Err(line.line_error(at, Problem::Duplicate { what: "point", id: number.into() }));
    }
    if number > expected {
        return Err(line.syntax(at, format!("point {expected}"), format!("point {number}").as_bytes()));
    }
    Ok(())
}

/// The cells of an `.ele` file and their attributes, by attribute.
fn read_elements(bytes: &[u8], size: usize, base: u64, data: &mut MeshData) -> Result<Vec<Vec<f64>>, ReadError> {
    let mut cursor = Cursor::new(bytes);
    let mut header = record(&mut cursor, "a line with the number of cells")?;
    let at = header.at();
    let n: u64 = header.number("the number of cells")?;
    let corners = optional(&mut header, "the number of corners")?;
    let n_attributes = optional(&mut header, "the number of attributes")?;
    let corners = if corners == 0 { size as u64 } else { corners };
    if corners != size as u64 {
        let kind = match (size, corners) {
            (4, 10) => "tetrahedron with 10 nodes".into(),
            (3, 6) => "triangle with 6 nodes".into(),
            _ => format!("cell with {corners} nodes in {} dimensions", size - 1).into(),
        };
        return Err(cursor.line_error(at, Problem::Element { kind, count: n }));
    }
    let words = n_attributes.saturating_add(1 + corners);
    let each = usize::try_from(words.saturating_mul(2)).unwrap_or(usize::MAX);
    let n = cursor.check_count(n, each, "cells").map_err(|problem| cursor.line_error(at, problem))?;
    let n_attributes = if n == 0 { 0 } else { n_attributes as usize };
    let mut attributes = vec![Vec::with_capacity(n); n_attributes];
    for _ in 0..n {
        let mut line = record(&mut cursor, "a cell")?;
        line.number::<i64>("the number of a cell")?;
        let vertices = vertices(&mut line, size, base, data.points.len())?;
        data.push_cell(&vertices[..size], 0);
        for column in &mut attributes {
            column.push(line.number("an attribute")?);
        }
        end(&mut line)?;
    }
    nothing_more(&mut cursor, "cells")?;
    Ok(attributes)
}

/// The faces or segments of a `.face` or `.edge` file. What Triangle and TetGen add with further options (second-order
/// nodes, adjacent cells) follows the marker and is skipped.
fn read_faces(bytes: &[u8], size: usize, base: u64, data: &mut MeshData) -> Result<(), ReadError> {
    let (what, one) = if size == 3 { ("faces", "a face") } else { ("segments", "a segment") };
    let mut cursor = Cursor::new(bytes);
    let mut header = record(&mut cursor, "a line with the number of faces or segments")?;
    let at = header.at();
    let n: u64 = header.number("the number of faces or segments")?;
    let has_marker = flag(&mut header, "0 or 1, whether there are boundary markers")?;
    let each = 2 * (1 + size + usize::from(has_marker));
    let n = cursor.check_count(n, each, what).map_err(|problem| cursor.line_error(at, problem))?;
    for _ in 0..n {
        let mut line = record(&mut cursor, one)?;
        line.number::<i64>("the number of a face or segment")?;
        let vertices = vertices(&mut line, size, base, data.points.len())?;
        let region = if has_marker { line.number("a boundary marker")? } else { 0 };
        data.push_cell(&vertices[..size], region);
    }
    nothing_more(&mut cursor, what)
}

/// The vertices of a cell as indices.
fn vertices(line: &mut Cursor<'_>, size: usize, base: u64, n_points: usize) -> Result<[u32; 4], ReadError> {
    let (mut vertices, n) = ([0_u32; 4], n_points as u64);
    for vertex in &mut vertices[..size] {
        line.skip_space();
        let at = line.at();
        let found: i64 = line.number("the number of a point")?;
        let index = u64::try_from(found).ok().and_then(|found| found.checked_sub(base)).filter(|&v| v < n);
        let Some(index) = index else {
            let range = format!("points {base} to {}", (base + n).saturating_sub(1));
            let range = if n == 0 { "no points".to_owned() } else { range };
            return Err(line.line_error(at, Problem::Index { what: "point", found: found.into(), range }));
        };
        *vertex = index as u32;
    }
    Ok(vertices)
}

/// Makes regions of the first attribute if it has whole numbers only, and fields of the others.
fn add_attributes(
    data: &mut MeshData,
    attributes: &[Vec<f64>],
    n_elements: usize,
    budget: &mut Budget,
    notes: &mut Vec<String>,
) -> Result<(), ReadError> {
    let mut kept = attributes;
    if let Some((first, others)) = attributes.split_first() {
        if let Some(regions) = first.iter().map(|&x| whole(x)).collect::<Option<Vec<i32>>>() {
            if let Some(block) = data.blocks.first_mut().filter(|_| n_elements > 0) {
                block.regions[..n_elements].copy_from_slice(&regions);
            }
            kept = others;
        } else {
            notes.push("the first attribute of the cells is no region: it has numbers that are not whole".to_owned());
        }
    }
    let n_cells = data.n_cells();
    let fail = |problem| ReadError::new(Place::File, problem);
    for values in kept {
        budget.take(n_cells as u64, 1).map_err(fail)?;
        let mut values = values.clone();
        values.resize(n_cells, f64::NAN);
        let name = format!("attribute {}", data.cell_fields.len() + 1);
        fields::add(&mut data.cell_fields, scalar(name, values)).map_err(fail)?;
    }
    Ok(())
}

fn scalar(name: String, values: Vec<f64>) -> DataField {
    DataField { name, components: 1, values }
}

fn record<'a>(cursor: &mut Cursor<'a>, expected: &'static str) -> Result<Cursor<'a>, ReadError> {
    let found = cursor.record();
    found.ok_or_else(|| cursor.line_error(cursor.at(), Problem::Truncated { expected: expected.into() }))
}

/// A number at the end of a header; 0 if it is left out.
fn optional(header: &mut Cursor<'_>, expected: &'static str) -> Result<u64, ReadError> {
    if header.peek().is_some() { header.number(expected) } else { Ok(0) }
}

fn flag(header: &mut Cursor<'_>, expected: &'static str) -> Result<bool, ReadError> {
    header.skip_space();
    let at = header.at();
    match optional(header, expected)? {
        0 => Ok(false),
        1 => Ok(true),
        more => Err(header.syntax(at, expected, more.to_string().as_bytes())),
    }
}

fn end(line: &mut Cursor<'_>) -> Result<(), ReadError> {
    match line.word() {
        Some((at, word)) => Err(line.syntax(at, "the end of the line", word)),
        None => Ok(()),
    }
}

fn nothing_more(cursor: &mut Cursor<'_>, what: &str) -> Result<(), ReadError> {
    match cursor.record() {
        Some(mut line) => {
            let (at, word) = line.need("a word")?;
            Err(line.syntax(at, format!("the end of the file after as many {what} as the first line says"), word))
        }
        None => Ok(()),
    }
}
