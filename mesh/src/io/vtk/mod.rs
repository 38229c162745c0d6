//! VTK: XML unstructured grids and legacy files.
//!
//! Source of the formats: *VTK file formats* in the documentation of VTK (Kitware); the legacy format of version 5 and its
//! percent signs in names from the same place.

mod base64;
mod kind;
mod legacy_arrays;
mod legacy_fields;
mod legacy_read;
mod legacy_write;
pub(super) mod xml;
mod xml_arrays;
mod xml_read;
mod xml_write;

pub(super) use legacy_read::read as read_legacy;
pub(super) use legacy_write::write as write_legacy;
pub(super) use xml_read::read as read_xml;
pub(super) use xml_write::{Array, Grid, Values, write as write_xml};

use super::{MeshData, Problem, number::whole};
use std::borrow::Cow;

/// The cell array that regions are in.
const REGION: &str = "region";

/// VTK's number of the cell with so many vertices.
const CELL_TYPES: [(i64, usize); 4] = [(1, 1), (3, 2), (5, 3), (10, 4)];

/// The vertices of a cell of VTK's type `kind`; an error names it and counts its kin among `all`.
fn vertices_per_cell(kind: i64, all: &[i64]) -> Result<usize, Problem> {
    if let Some((_, size)) = CELL_TYPES.into_iter().find(|&(known, _)| known == kind) {
        return Ok(size);
    }
    let count = all.iter().filter(|&&other| other == kind).count() as u64;
    Err(Problem::Element { kind: type_name(kind), count })
}

fn type_name(kind: i64) -> Cow<'static, str> {
    let name = match kind {
        0 => "empty cell",
        2 => "poly-vertex",
        4 => "poly-line",
        6 => "triangle strip",
        7 => "polygon",
        8 => "pixel",
        9 => "quadrilateral",
        11 => "voxel",
        12 => "hexahedron",
        13 => "wedge",
        14 => "pyramid",
        21 => "quadratic edge",
        22 => "quadratic triangle",
        23 => "quadratic quadrilateral",
        24 => "quadratic tetrahedron",
        25 => "quadratic hexahedron",
        42 => "polyhedron",
        _ => return format!("number {kind}").into(),
    };
    format!("{name} (number {kind})").into()
}

/// Appends a cell whose vertices are given relative to point `first`.
fn push_cell(data: &mut MeshData, vertices: &[i64], first: usize) -> Result<(), Problem> {
    let (mut cell, n) = ([0; 4], data.points.len() - first);
    for (v, &found) in cell.iter_mut().zip(vertices) {
        if !usize::try_from(found).is_ok_and(|found| found < n) {
            let range = if n == 0 { "no points".to_owned() } else { format!("points 0 to {}", n - 1) };
            return Err(Problem::Index { what: "point", found: found.into(), range });
        }
        *v = (found as usize + first) as u32;
    }
    data.push_cell(&cell[..vertices.len()], 0);
    Ok(())
}

/// Makes regions of the cell field of that name, if it has whole numbers only.
fn take_regions(data: &mut MeshData, notes: &mut Vec<String>) {
    let Some(at) = data.cell_fields.iter().position(|field| field.name == REGION) else {
        return;
    };
    let field = &data.cell_fields[at];
    let regions = field.values.iter().map(|&x| whole(x)).collect::<Option<Vec<i32>>>();
    let Some(regions) = regions.filter(|_| field.components == 1) else {
        notes.push(format!("cell field {REGION:?} stays a field: it has values that are no whole numbers"));
        return;
    };
    let mut next = regions.into_iter();
    for block in &mut data.blocks {
        block.regions.iter_mut().zip(&mut next).for_each(|(region, found)| *region = found);
    }
    data.cell_fields.remove(at);
}

/// Notes what no VTK file holds.
fn note_unwritten(data: &MeshData, notes: &mut Vec<String>) {
    let names = data.region_names.iter();
    notes.extend(names.map(|name| format!("the name {:?} of region {}: VTK has numbers only", name.name, name.region)));
    if data.dimension != data.natural_dimension() {
        notes.push("that space has three dimensions: all third coordinates are zero".to_owned());
    }
}
