//! Writes `.vtu` files: one piece, arrays in base64 within the elements, little-endian, 64-bit byte counts.

use super::{CELL_TYPES, REGION, base64, note_unwritten};
use crate::io::{DataField, MeshData, fields::written_names};
use std::fmt::Write as _;

/// What a file is made of.
pub(in crate::io) struct Grid<'a> {
    /// Coordinates, three per point.
    pub points: Vec<f64>,
    /// Point indices of the cells, one cell after the other.
    pub connectivity: Vec<i64>,
    /// Vertices of each cell, 1 to 4.
    pub sizes: Vec<usize>,
    /// Arrays on points.
    pub point_data: Vec<Array<'a>>,
    /// Arrays on cells.
    pub cell_data: Vec<Array<'a>>,
}

/// A named array.
pub(in crate::io) struct Array<'a> {
    pub name: &'a str,
    pub components: usize,
    pub values: Values<'a>,
}

/// The numbers of an array.
pub(in crate::io) enum Values<'a> {
    Reals(&'a [f64]),
    Int32(Vec<i32>),
    UInt32(Vec<u32>),
}

/// The bytes of a file.
pub(in crate::io) fn write(data: &MeshData, notes: &mut Vec<String>) -> Vec<u8> {
    note_unwritten(data, notes);
    let regions = data.cells().map(|(_, region)| region).collect();
    let point_names = written_names(&data.point_fields, &[], is_legal, notes);
    let cell_names = written_names(&data.cell_fields, &[REGION], is_legal, notes);
    let mut cell_data = vec![Array { name: REGION, components: 1, values: Values::Int32(regions) }];
    cell_data.extend(arrays(&cell_names, &data.cell_fields));
    let grid = Grid {
        points: data.points.as_flattened().to_vec(),
        connectivity: data.cells().flat_map(|(vertices, _)| vertices.iter().map(|&v| i64::from(v))).collect(),
        sizes: data.cells().map(|(vertices, _)| vertices.len()).collect(),
        point_data: arrays(&point_names, &data.point_fields).collect(),
        cell_data,
    };
    grid.to_xml().into_bytes()
}

fn arrays<'a>(names: &'a [String], fields: &'a [DataField]) -> impl Iterator<Item = Array<'a>> {
    let array = |(name, field): (&'a String, &'a DataField)| Array {
        name,
        components: field.components,
        values: Values::Reals(&field.values),
    };
    names.iter().zip(fields).map(array)
}

/// XML has no way to write most control characters.
fn is_legal(c: char) -> bool {
    !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}')
}

impl Grid<'_> {
    /// The text of a file.
    pub fn to_xml(&self) -> String {
        let mut xml = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">\n  <UnstructuredGrid>\n",
        );
        // Writing to a string does not fail.
        let (n_points, n_cells) = (self.points.len() / 3, self.sizes.len());
        let _ = writeln!(xml, "    <Piece NumberOfPoints=\"{n_points}\" NumberOfCells=\"{n_cells}\">");
        for (element, arrays) in [("PointData", &self.point_data), ("CellData", &self.cell_data)] {
            let _ = writeln!(xml, "      <{element}>");
            arrays.iter().for_each(|array| array.push(&mut xml));
            let _ = writeln!(xml, "      </{element}>");
        }
        xml.push_str("      <Points>\n");
        push_array(&mut xml, "Float64", "Points", 3, self.points.iter().map(|x| x.to_le_bytes()));
        xml.push_str("      </Points>\n      <Cells>\n");
        push_array(&mut xml, "Int64", "connectivity", 1, self.connectivity.iter().map(|v| v.to_le_bytes()));
        let ends = self.sizes.iter().scan(0_i64, |end, &size| {
            *end += size as i64;
            Some(end.to_le_bytes())
        });
        push_array(&mut xml, "Int64", "offsets", 1, ends);
        push_array(&mut xml, "UInt8", "types", 1, self.sizes.iter().map(|&size| [cell_type(size)]));
        xml.push_str("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n</VTKFile>\n");
        xml
    }
}

fn cell_type(size: usize) -> u8 {
    CELL_TYPES.into_iter().find(|&(_, vertices)| vertices == size).map_or(0, |(kind, _)| kind as u8)
}

impl Array<'_> {
    fn push(&self, xml: &mut String) {
        let (name, components) = (self.name, self.components);
        match &self.values {
            Values::Reals(values) => {
                push_array(xml, "Float64", name, components, values.iter().map(|x| x.to_le_bytes()))
            }
            Values::Int32(values) => push_array(xml, "Int32", name, components, values.iter().map(|x| x.to_le_bytes())),
            Values::UInt32(values) => {
                push_array(xml, "UInt32", name, components, values.iter().map(|x| x.to_le_bytes()))
            }
        }
    }
}

fn push_array<const B: usize>(
    xml: &mut String,
    kind: &str,
    name: &str,
    components: usize,
    numbers: impl Iterator<Item = [u8; B]>,
) {
    // The number of bytes comes first, in the same base64 unit.
    let mut bytes = vec![0; 8];
    bytes.extend(numbers.flatten());
    let count = bytes.len() as u64 - 8;
    bytes[..8].copy_from_slice(&count.to_le_bytes());
    let name = super::xml::escape(name);
    let _ = write!(xml, "        <DataArray type=\"{kind}\" Name=\"{name}\" format=\"binary\"");
    if components != 1 {
        // Left out for one: some readers make columns of what is said to have one.
        let _ = write!(xml, " NumberOfComponents=\"{components}\"");
    }
    xml.push('>');
    base64::encode(&bytes, xml);
    xml.push_str("</DataArray>\n");
}
