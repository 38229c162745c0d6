//! Reads MSH files: header and sections.

use super::{ids::Ids, names, read_fields, read2, read4, stream::Stream};
use crate::io::{
    MeshData, Problem, ReadError,
    cursor::{ByteOrder, Cursor, parse, shown},
    fields::Budget,
};
use std::collections::{BTreeMap, BTreeSet};

/// What has been read so far.
pub(super) struct Parts {
    pub data: MeshData,
    pub nodes: Option<Ids>,
    /// The numbers of the elements, in order, once there are any.
    pub elements: Option<Vec<u64>>,
    /// The physical group of each entity, by dimension and number, in version 4.1.
    pub entities: BTreeMap<(i64, i64), i32>,
    pub budget: Budget,
    pub notes: Vec<String>,
}

const VERSIONS: &str = "MSH version 2.0 to 2.2, or 4.1";

/// Reads a mesh.
pub(in crate::io) fn read(bytes: &[u8], notes: &mut Vec<String>) -> Result<MeshData, ReadError> {
    let (mut stream, is_new) = header(bytes)?;
    let mut parts = Parts {
        data: MeshData::default(),
        nodes: None,
        elements: None,
        entities: BTreeMap::new(),
        budget: Budget::of(std::iter::once(bytes)),
        notes: Vec::new(),
    };
    let mut seen = BTreeSet::from(["MeshFormat".to_owned()]);
    while let Some((at, word)) = stream.cursor.word() {
        let Some(section) = word.strip_prefix(b"$").and_then(|name| std::str::from_utf8(name).ok()) else {
            return Err(stream.cursor.syntax(at, "a section such as \"$Nodes\"", word));
        };
        let is_new_here = seen.insert(section.to_owned());
        if !is_new_here && !matches!(section, "NodeData" | "ElementData" | "ElementNodeData" | "Comments") {
            return Err(stream.cursor.line_error(at, Problem::Repeated(format!("section ${section}").into())));
        }
        stream.cursor.line();
        read_section(&mut stream, section, at, is_new, &mut parts)?;
    }
    for (is_there, section) in [(parts.nodes.is_some(), "$Nodes"), (parts.elements.is_some(), "$Elements")] {
        if !is_there {
            let problem = Problem::Missing(format!("section {section}").into());
            return Err(stream.cursor.line_error(stream.cursor.at(), problem));
        }
    }
    parts.data.dimension = parts.data.natural_dimension();
    notes.append(&mut parts.notes);
    Ok(parts.data)
}

/// Reads the section `$MeshFormat`; true for version 4.1.
fn header(bytes: &[u8]) -> Result<(Stream<'_>, bool), ReadError> {
    let mut cursor = Cursor::new(bytes);
    let (at, word) = cursor.need("\"$MeshFormat\"")?;
    if word == b"$NOD" {
        return Err(cursor.line_error(at, Problem::Version { found: "1.0".to_owned(), expected: VERSIONS }));
    }
    if word != b"$MeshFormat" {
        return Err(cursor.syntax(at, "\"$MeshFormat\"", word));
    }
    let (at, word) = cursor.need("a version number")?;
    let version = parse::<f64>(word);
    let is_new = version == Some(4.1);
    if !is_new && !version.is_some_and(|version| (2.0..3.0).contains(&version)) {
        return Err(cursor.line_error(at, Problem::Version { found: shown(word), expected: VERSIONS }));
    }
    cursor.skip_space();
    let at = cursor.at();
    let is_binary: u64 = cursor.number("0 for text or 1 for binary")?;
    if is_binary > 1 {
        return Err(cursor.syntax(at, "0 for text or 1 for binary", is_binary.to_string().as_bytes()));
    }
    cursor.skip_space();
    let at = cursor.at();
    let data_size: u64 = cursor.number("a data size")?;
    if is_binary == 1 && !(data_size == 8 || (is_new && data_size == 4)) {
        return Err(cursor.syntax(at, "data size 8", data_size.to_string().as_bytes()));
    }
    cursor.line();
    let mut order = None;
    if is_binary == 1 {
        let at = cursor.at();
        let one = cursor.take(4, "the number 1, which tells the order of bytes")?;
        order = match one {
            [1, 0, 0, 0] => Some(ByteOrder::Little),
            [0, 0, 0, 1] => Some(ByteOrder::Big),
            _ => {
                let expected = "the number 1 in 4 bytes".into();
                return Err(cursor.byte_error(at, Problem::Syntax { expected, found: format!("bytes {one:?}") }));
            }
        };
    }
    // In text all numbers are words, whatever their size.
    let mut stream = Stream { cursor, order, size_of_size: data_size as usize };
    stream.end("MeshFormat")?;
    Ok((stream, is_new))
}

fn read_section(
    stream: &mut Stream<'_>,
    section: &str,
    at: usize,
    is_new: bool,
    parts: &mut Parts,
) -> Result<(), ReadError> {
    match section {
        "PhysicalNames" => names::read(stream, &mut parts.data),
        "Entities" if is_new => read4::entities(stream, false, parts),
        "PartitionedEntities" if is_new => read4::entities(stream, true, parts),
        "Nodes" if is_new => read4::nodes(stream, parts),
        "Elements" if is_new => read4::elements(stream, parts),
        "Nodes" => read2::nodes(stream, parts),
        "Elements" => read2::elements(stream, parts),
        "NodeData" | "ElementData" => read_fields::read(stream, section, parts),
        _ => {
            // Nothing of ours: from here to its end mark, which binary data hold by chance in one of 2^80 cases.
            let end = format!("$End{section}");
            if !stream.cursor.skip_past(end.as_bytes()) {
                let problem = Problem::Truncated { expected: format!("{end:?} after section ${section}").into() };
                return Err(stream.cursor.line_error(at, problem));
            }
            if section != "Comments" {
                parts.notes.push(format!("section ${section}"));
            }
            Ok(())
        }
    }
}

/// The nodes of an element as indices.
pub(super) fn vertices(stream: &mut Stream<'_>, size: usize, nodes: &Ids, is_new: bool) -> Result<[u32; 4], ReadError> {
    let mut vertices = [0; 4];
    for vertex in &mut vertices[..size] {
        let at = stream.at();
        let expected = "the number of a node";
        let id = if is_new { stream.size(expected)? } else { stream.natural(expected)? };
        *vertex = nodes
            .index(id)
            .ok_or_else(|| stream.error(at, Problem::Index { what: "node", found: id.into(), range: nodes.range() }))?;
    }
    Ok(vertices)
}

/// The numbers of all nodes; an error names the second occurrence of one.
pub(super) fn ids_of(stream: &Stream<'_>, ids: &[u64], places: &[usize]) -> Result<Ids, ReadError> {
    Ids::new(ids).map_err(|(id, index)| {
        let at = places.get(index).copied().unwrap_or_default();
        stream.error(at, Problem::Duplicate { what: "node", id: id.into() })
    })
}

/// The nodes, if they came before.
pub(super) fn need_nodes<'p>(stream: &Stream<'_>, nodes: &'p Option<Ids>) -> Result<&'p Ids, ReadError> {
    nodes.as_ref().ok_or_else(|| {
        let problem = Problem::Missing("section $Nodes before this one".into());
        stream.cursor.line_error(stream.cursor.at(), problem)
    })
}
