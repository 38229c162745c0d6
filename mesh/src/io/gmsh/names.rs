//! Names of physical groups.

use super::stream::Stream;
use crate::io::{MeshData, Problem, ReadError, RegionName};

/// Reads the section `$PhysicalNames` behind its first line; it is text in binary files as well.
pub(super) fn read(stream: &mut Stream<'_>, data: &mut MeshData) -> Result<(), ReadError> {
    let cursor = &mut stream.cursor;
    // "0 1 \"\"" and the end of the line
    let n = cursor.count("names of physical groups", 6)?;
    for _ in 0..n {
        cursor.skip_space();
        let at = cursor.at();
        let dimension: usize = cursor.number("the dimension of a physical group")?;
        if dimension > 3 {
            return Err(cursor.syntax(at, "a dimension from 0 to 3", dimension.to_string().as_bytes()));
        }
        let region = cursor.number("the number of a physical group")?;
        let text_at = cursor.at();
        let text = cursor.line();
        let quoted = text.strip_prefix(b"\"").and_then(|text| text.strip_suffix(b"\""));
        let quoted = quoted.ok_or_else(|| cursor.syntax(text_at, "a name in quotation marks", text))?;
        let name = String::from_utf8_lossy(quoted).into_owned();
        data.region_names.push(RegionName { vertices_per_cell: dimension + 1, region, name });
    }
    let mut named: Vec<_> = data.region_names.iter().map(|name| (name.vertices_per_cell, name.region)).collect();
    named.sort_unstable();
    if let Some(pair) = named.windows(2).find(|pair| pair[0] == pair[1]) {
        let problem = Problem::Duplicate { what: "name of physical group", id: pair[0].1.into() };
        return Err(cursor.line_error(cursor.at(), problem));
    }
    stream.end("PhysicalNames")
}

/// The section; empty without names.
pub(super) fn section(data: &MeshData, notes: &mut Vec<String>) -> String {
    if data.region_names.is_empty() {
        return String::new();
    }
    let mut text = format!("$PhysicalNames\n{}\n", data.region_names.len());
    for RegionName { vertices_per_cell, region, name } in &data.region_names {
        let written: String = name.chars().map(|c| if is_quotable(c) { c } else { '_' }).collect();
        if written != *name {
            notes.push(format!("the name {name:?} of region {region}, written as {written:?}"));
        }
        text.push_str(&format!("{} {region} \"{written}\"\n", vertices_per_cell - 1));
    }
    text.push_str("$EndPhysicalNames\n");
    text
}

/// Whether a character can stand between quotation marks on a line.
pub(super) fn is_quotable(c: char) -> bool {
    c != '"' && !c.is_control()
}
