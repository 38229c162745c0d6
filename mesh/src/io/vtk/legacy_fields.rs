//! Fields in legacy VTK files.

use super::{kind::Kind, legacy_arrays::Legacy};
use crate::io::{
    DataField, Problem, ReadError,
    cursor::{Cursor, parse},
    fields,
};

/// Lines up to an empty one.
pub(super) fn skip_metadata(file: &mut Legacy<'_>) {
    file.cursor.line();
    while file.cursor.left() > 0 && !file.cursor.line().is_empty() {}
}

/// The fields behind `POINT_DATA` or `CELL_DATA`.
pub(super) fn attributes(
    file: &mut Legacy<'_>,
    into: &mut Option<(u64, usize, Vec<DataField>)>,
    at: usize,
    repeated: impl Fn(&Cursor<'_>) -> ReadError,
    notes: &mut Vec<String>,
) -> Result<(), ReadError> {
    if into.is_some() {
        return Err(repeated(&file.cursor));
    }
    let entries: u64 = file.cursor.number("a number of entries")?;
    let mut fields = Vec::new();
    while let Some(word) = file.cursor.peek() {
        let keyword = word.to_ascii_uppercase();
        if matches!(keyword.as_slice(), b"POINT_DATA" | b"CELL_DATA" | b"POINTS" | b"CELLS" | b"CELL_TYPES") {
            break;
        }
        file.cursor.word();
        attribute(file, &keyword, entries, &mut fields, notes)?;
    }
    *into = Some((entries, at, fields));
    Ok(())
}

/// The attribute behind a keyword.
fn attribute(
    file: &mut Legacy<'_>,
    keyword: &[u8],
    entries: u64,
    fields: &mut Vec<DataField>,
    notes: &mut Vec<String>,
) -> Result<(), ReadError> {
    let at = file.cursor.at();
    match keyword {
        b"FIELD" => {
            for field in field_arrays(file, Some(entries))? {
                fields::add(fields, field).map_err(|problem| file.cursor.line_error(at, problem))?;
            }
        }
        b"METADATA" => skip_metadata(file),
        b"LOOKUP_TABLE" => {
            file.name()?;
            let n: u64 = file.cursor.number("the size of the table")?;
            file.reals(colour_kind(file), n.saturating_mul(4), "colours")?;
            notes.push("a table of colours".to_owned());
        }
        b"COLOR_SCALARS" => {
            let name = file.name()?;
            let components = file.cursor.number("the number of components")?;
            push_field(file, name, colour_kind(file), components, entries, fields)?;
        }
        b"TEXTURE_COORDINATES" => {
            let name = file.name()?;
            let components = file.cursor.number("the number of components")?;
            let kind = file.kind()?;
            push_field(file, name, kind, components, entries, fields)?;
        }
        b"SCALARS" => scalars(file, entries, fields)?,
        _ => {
            let components = components_of(keyword).ok_or_else(|| {
                let expected = "an attribute such as \"SCALARS\", \"VECTORS\" or \"FIELD\"";
                file.cursor.syntax(at.saturating_sub(keyword.len()), expected, keyword)
            })?;
            let name = file.name()?;
            let kind = file.kind()?;
            push_field(file, name, kind, components, entries, fields)?;
        }
    }
    Ok(())
}

/// Colours are bytes in binary files and numbers from 0 to 1 in text.
fn colour_kind(file: &Legacy<'_>) -> Kind {
    if file.is_binary { Kind::U8 } else { Kind::F32 }
}

/// The components of attributes that always have as many.
fn components_of(keyword: &[u8]) -> Option<u64> {
    match keyword {
        b"VECTORS" | b"NORMALS" => Some(3),
        b"TENSORS" => Some(9),
        b"TENSORS6" => Some(6),
        b"GLOBAL_IDS" | b"PEDIGREE_IDS" | b"EDGE_FLAGS" => Some(1),
        _ => None,
    }
}

/// The field behind `SCALARS`. The number of components is on the line or is 1; the name of a table of colours, on the
/// next line, is left out by some programs.
fn scalars(file: &mut Legacy<'_>, entries: u64, fields: &mut Vec<DataField>) -> Result<(), ReadError> {
    let name = file.name()?;
    let kind = file.kind()?;
    let mut line_end = file.cursor;
    let at = file.cursor.at();
    let rest = file.cursor.line();
    let components = if rest.is_empty() { Some(1) } else { parse(rest) };
    let components = components.ok_or_else(|| file.cursor.syntax(at, "the number of components", rest))?;
    if file.cursor.peek().is_some_and(|word| word.eq_ignore_ascii_case(b"LOOKUP_TABLE")) {
        file.cursor.word();
        file.cursor.need("the name of a table")?;
    } else {
        // The numbers begin behind the end of this line.
        if !rest.is_empty() {
            line_end.word();
        }
        file.cursor = line_end;
    }
    push_field(file, name, kind, components, entries, fields)
}

fn push_field(
    file: &mut Legacy<'_>,
    name: String,
    kind: Kind,
    components: u64,
    entries: u64,
    fields: &mut Vec<DataField>,
) -> Result<(), ReadError> {
    let at = file.cursor.at();
    let field = field(file, name, kind, components, entries)?;
    fields::add(fields, field).map_err(|problem| file.cursor.line_error(at, problem))
}

fn field(
    file: &mut Legacy<'_>,
    name: String,
    kind: Kind,
    components: u64,
    entries: u64,
) -> Result<DataField, ReadError> {
    let at = file.cursor.at();
    if components == 0 {
        return Err(file.cursor.syntax(at, "a component or more", b"0"));
    }
    let values = file.reals(kind, entries.saturating_mul(components), "numbers of a field")?;
    let components = usize::try_from(components).unwrap_or(usize::MAX);
    Ok(DataField { name, components, values })
}

/// The arrays behind `FIELD`, each with `entries` tuples if that is given.
pub(super) fn field_arrays(file: &mut Legacy<'_>, entries: Option<u64>) -> Result<Vec<DataField>, ReadError> {
    file.name()?;
    // "a 1 1 int" and as many line ends
    let n = file.cursor.count("arrays", 8)?;
    let mut fields = Vec::new();
    for _ in 0..n {
        while file.cursor.peek().is_some_and(|word| word.eq_ignore_ascii_case(b"METADATA")) {
            file.cursor.word();
            skip_metadata(file);
        }
        let name = file.name()?;
        file.cursor.skip_space();
        let at = file.cursor.at();
        let components = file.cursor.number("the number of components")?;
        let tuples: u64 = file.cursor.number("the number of tuples")?;
        if let Some(expected) = entries.filter(|&entries| entries != tuples) {
            let what = format!("the tuples of array {name:?}: it");
            return Err(file.cursor.line_error(at, Problem::Length { what, found: tuples, expected }));
        }
        let kind = file.kind()?;
        if entries.is_none() && components == 0 {
            continue;
        }
        fields.push(field(file, name, kind, components, tuples)?);
    }
    Ok(fields)
}
