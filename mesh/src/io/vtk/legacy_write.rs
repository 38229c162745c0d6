//! Writes legacy `.vtk` files of version 3.0, which every reader knows.

use super::{CELL_TYPES, REGION, legacy_arrays::encode_name, note_unwritten};
use crate::io::{DataField, MeshData, fields::written_names, number::Real};
use std::fmt::Write as _;

/// Text and numbers, the latter as text or in the order of bytes that the format has.
struct Out {
    bytes: Vec<u8>,
    is_binary: bool,
}

impl Out {
    fn line(&mut self, text: &str) {
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(b'\n');
    }

    /// Rows of real numbers.
    fn reals(&mut self, values: &[f64], per_row: usize) {
        if self.is_binary {
            values.iter().for_each(|x| self.bytes.extend(x.to_be_bytes()));
            self.bytes.push(b'\n');
        } else {
            self.rows(values.chunks(per_row).map(|row| row.iter().map(|&x| Real(x))));
        }
    }

    /// Rows of integers.
    fn integers<'a>(&mut self, rows: impl Iterator<Item = &'a [i32]>) {
        if self.is_binary {
            rows.flatten().for_each(|x| self.bytes.extend(x.to_be_bytes()));
            self.bytes.push(b'\n');
        } else {
            self.rows(rows.map(|row| row.iter().copied()));
        }
    }

    fn rows<T: std::fmt::Display>(&mut self, rows: impl Iterator<Item = impl Iterator<Item = T>>) {
        let mut text = String::new();
        for row in rows {
            for (i, value) in row.enumerate() {
                // Writing to a string does not fail.
                let _ = write!(text, "{}{value}", if i == 0 { "" } else { " " });
            }
            text.push('\n');
        }
        self.bytes.extend(text.into_bytes());
    }
}

/// The bytes of a file.
///
/// # Errors
/// What does not fit: more points, or more numbers for cells, than 31 bits count.
pub(in crate::io) fn write(data: &MeshData, is_binary: bool, notes: &mut Vec<String>) -> Result<Vec<u8>, String> {
    note_unwritten(data, notes);
    let n_cells = data.n_cells();
    let size = n_cells + data.blocks.iter().map(|block| block.vertices.len()).sum::<usize>();
    if i32::try_from(data.points.len().max(size)).is_err() {
        return Err(format!("{} points and {n_cells} cells, which are more than 31 bits count", data.points.len()));
    }
    let mut out = Out { bytes: Vec::new(), is_binary };
    out.line("# vtk DataFile Version 3.0");
    out.line("mesh");
    out.line(if is_binary { "BINARY" } else { "ASCII" });
    out.line("DATASET UNSTRUCTURED_GRID");
    out.line(&format!("POINTS {} double", data.points.len()));
    out.reals(data.points.as_flattened(), 3);
    out.line(&format!("CELLS {n_cells} {size}"));
    let cells: Vec<Vec<i32>> = data.cells().map(|(vertices, _)| row(vertices)).collect();
    out.integers(cells.iter().map(Vec::as_slice));
    out.line(&format!("CELL_TYPES {n_cells}"));
    let types: Vec<i32> = data.cells().map(|(vertices, _)| cell_type(vertices.len())).collect();
    out.integers(types.chunks(1));
    if !data.point_fields.is_empty() {
        out.line(&format!("POINT_DATA {}", data.points.len()));
        out.line(&format!("FIELD FieldData {}", data.point_fields.len()));
        let names = written_names(&data.point_fields, &[], |_| true, notes);
        write_fields(&mut out, &data.point_fields, &names, data.points.len());
    }
    if n_cells > 0 {
        out.line(&format!("CELL_DATA {n_cells}"));
        out.line(&format!("FIELD FieldData {}", data.cell_fields.len() + 1));
        out.line(&format!("{REGION} 1 {n_cells} int"));
        let regions: Vec<i32> = data.cells().map(|(_, region)| region).collect();
        out.integers(regions.chunks(1));
        let names = written_names(&data.cell_fields, &[REGION], |_| true, notes);
        write_fields(&mut out, &data.cell_fields, &names, n_cells);
    } else {
        notes.extend(data.cell_fields.iter().map(|field| format!("cell field {:?}: there are no cells", field.name)));
    }
    Ok(out.bytes)
}

/// The number of vertices, and these.
fn row(vertices: &[u32]) -> Vec<i32> {
    std::iter::once(vertices.len() as i32).chain(vertices.iter().map(|&v| v as i32)).collect()
}

fn cell_type(size: usize) -> i32 {
    CELL_TYPES.into_iter().find(|&(_, vertices)| vertices == size).map_or(0, |(kind, _)| kind as i32)
}

fn write_fields(out: &mut Out, fields: &[DataField], names: &[String], entries: usize) {
    for (field, name) in fields.iter().zip(names) {
        out.line(&format!("{} {} {entries} double", encode_name(name), field.components));
        out.reals(&field.values, field.components);
    }
}
