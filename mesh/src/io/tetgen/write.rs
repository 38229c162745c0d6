//! Writes `.node`, `.ele`, `.face` and `.edge`.

use super::MARKER;
use crate::io::{
    DataField, MeshData,
    number::{Real, whole},
};
use std::fmt::Write as _;

/// The contents of the files, numbered from 0, in the order of the extensions; `None` for one without cells.
///
/// The cells come in the order in which they are read back: tetrahedra (triangles in two dimensions), faces, segments.
pub(in crate::io) fn write(data: &MeshData, notes: &mut Vec<String>) -> [Option<String>; 4] {
    let size = data.dimension + 1;
    left_out(data, size, notes);
    let triangles = if data.dimension == 3 { faces(data, 3) } else { None };
    [Some(points(data)), elements(data, size, notes), triangles, faces(data, 2)]
}

fn left_out(data: &MeshData, size: usize, notes: &mut Vec<String>) {
    let count = |size: usize| data.cells().filter(|(vertices, _)| vertices.len() == size).count();
    if count(1) > 0 {
        notes.push(format!("{} cells of one point: TetGen has none", count(1)));
    }
    let kept: Vec<usize> = data.cells().map(|(vertices, _)| vertices.len()).filter(|&n| n > 1).collect();
    if kept.windows(2).any(|pair| pair[0] < pair[1]) {
        notes.push("the order of the cells: TetGen has a file for each kind of them".to_owned());
    }
    let names = data.region_names.iter();
    notes.extend(
        names.map(|name| format!("the name {:?} of region {}: TetGen has numbers only", name.name, name.region)),
    );
    let others = data.n_cells() - count(size) - count(1);
    if others > 0 && !data.cell_fields.is_empty() {
        notes.push(format!("the cell fields of {others} faces and segments: TetGen has attributes of cells only"));
    }
    let renamed = |fields: &[DataField], regular: &dyn Fn(usize) -> String| {
        let all = fields.iter().enumerate();
        all.filter(|(i, field)| field.name != regular(*i) || field.components != 1)
            .map(|(_, field)| field.name.clone())
            .collect::<Vec<_>>()
    };
    let attribute = |i: usize| format!("attribute {}", i + 1);
    let (plain, _) = split_marker(data);
    let mut lost = renamed(&plain, &attribute);
    if count(size) > 0 {
        lost.extend(renamed(&data.cell_fields, &attribute));
    }
    notes.extend(
        lost.iter().map(|name| format!("the name and shape of field {name:?}: TetGen has numbered attributes")),
    );
}

/// The point fields that become attributes, and the one that becomes the boundary markers.
fn split_marker(data: &MeshData) -> (Vec<DataField>, Option<&DataField>) {
    let is_marker = |field: &&DataField| {
        field.name == MARKER && field.components == 1 && field.values.iter().all(|&x| whole(x).is_some())
    };
    let marker = data.point_fields.iter().find(is_marker);
    let others = data.point_fields.iter().filter(|field| marker.is_none_or(|marker| marker.name != field.name));
    (others.cloned().collect(), marker)
}

fn points(data: &MeshData) -> String {
    let (fields, marker) = split_marker(data);
    let n_attributes: usize = fields.iter().map(|field| field.components).sum();
    let (n, d) = (data.points.len(), data.dimension);
    let mut text = format!("{n} {d} {n_attributes} {}\n", u8::from(marker.is_some()));
    for (vertex, point) in data.points.iter().enumerate() {
        push(&mut text, vertex);
        point[..d].iter().for_each(|x| push(&mut text, Real(*x)));
        push_values(&mut text, &fields, vertex);
        if let Some(marker) = marker {
            push(&mut text, marker.values[vertex] as i32);
        }
        text.push('\n');
    }
    text
}

/// The `.ele` file; a mesh of a surface or of segments has none.
fn elements(data: &MeshData, size: usize, notes: &mut Vec<String>) -> Option<String> {
    let chosen = || data.cells().enumerate().filter(|(_, (vertices, _))| vertices.len() == size);
    let n = chosen().count();
    if n == 0 {
        notes.extend(
            data.cell_fields.iter().map(|field| format!("cell field {:?}: only an .ele file has them", field.name)),
        );
        return None;
    }
    let has_regions = !data.cell_fields.is_empty() || chosen().any(|(_, (_, region))| region != 0);
    let n_fields: usize = data.cell_fields.iter().map(|field| field.components).sum();
    let mut text = format!("{n} {size} {}\n", usize::from(has_regions) + n_fields);
    for (number, (cell, (vertices, region))) in chosen().enumerate() {
        push(&mut text, number);
        vertices.iter().for_each(|v| push(&mut text, v));
        if has_regions {
            push(&mut text, region);
        }
        push_values(&mut text, &data.cell_fields, cell);
        text.push('\n');
    }
    Some(text)
}

/// A `.face` or `.edge` file.
fn faces(data: &MeshData, size: usize) -> Option<String> {
    let chosen = || data.cells().filter(|(vertices, _)| vertices.len() == size);
    let n = chosen().count();
    if n == 0 {
        return None;
    }
    let mut text = format!("{n} 1\n");
    for (number, (vertices, region)) in chosen().enumerate() {
        push(&mut text, number);
        vertices.iter().for_each(|v| push(&mut text, v));
        push(&mut text, region);
        text.push('\n');
    }
    Some(text)
}

fn push(text: &mut String, value: impl std::fmt::Display) {
    if !text.ends_with('\n') {
        text.push(' ');
    }
    // Writing to a string does not fail.
    let _ = write!(text, "{value}");
}

fn push_values(text: &mut String, fields: &[DataField], entry: usize) {
    for field in fields {
        let values = field.values.chunks_exact(field.components).nth(entry).unwrap_or_default();
        values.iter().for_each(|x| push(text, Real(*x)));
    }
}
