//! Fields on nodes and elements, which have the same layout in all versions.

use super::{
    ids::Ids,
    read::{Parts, need_nodes},
    stream::Stream,
};
use crate::io::{DataField, Problem, ReadError, fields};

/// The most components that Gmsh has, those of a tensor.
const MOST_COMPONENTS: u64 = 9;

/// Reads `$NodeData` or `$ElementData` behind its first line. Entries that it leaves out are NaN.
pub(super) fn read(stream: &mut Stream<'_>, section: &str, parts: &mut Parts) -> Result<(), ReadError> {
    let start = stream.cursor.at();
    let name = name(stream)?;
    let n = stream.cursor.count("numbers before a field", 2)?;
    for _ in 0..n {
        stream.cursor.number::<f64>("a number such as the time of a field")?;
    }
    let n = stream.cursor.count("integers before a field", 2)?;
    stream.cursor.skip_space();
    let at = stream.cursor.at();
    let mut tags = Vec::with_capacity(n);
    for _ in 0..n {
        tags.push(stream.cursor.number::<u64>("an integer such as the number of components")?);
    }
    let &[_, components, n, ..] = tags.as_slice() else {
        let expected = "3 integers or more: time step, components, entries".into();
        let problem = Problem::Syntax { expected, found: format!("{} of them", tags.len()) };
        return Err(stream.cursor.line_error(at, problem));
    };
    if components == 0 || components > MOST_COMPONENTS {
        return Err(stream.cursor.syntax(at, "1 to 9 components", components.to_string().as_bytes()));
    }
    stream.cursor.line();
    let n = stream.check_count(at, n, stream.bytes_of(1, 0, components), "entries of a field")?;
    let elements;
    let (what, ids) = if section == "NodeData" {
        ("node", need_nodes(stream, &parts.nodes)?)
    } else {
        elements = element_ids(stream, start, parts)?;
        ("element", &elements)
    };
    let entries = if section == "NodeData" { parts.data.points.len() } else { parts.data.n_cells() };
    let taken = parts.budget.take(entries as u64, components);
    taken.map_err(|problem| stream.cursor.line_error(at, problem))?;
    let values = values(stream, (what, ids), n, entries, components as usize)?;
    let all = if section == "NodeData" { &mut parts.data.point_fields } else { &mut parts.data.cell_fields };
    let field = DataField { name, components: components as usize, values };
    fields::add(all, field).map_err(|problem| stream.cursor.line_error(at, problem))?;
    stream.end(section)
}

/// The first of the texts before a field is its name.
fn name(stream: &mut Stream<'_>) -> Result<String, ReadError> {
    let n = stream.cursor.count("texts before a field", 1)?;
    stream.cursor.line();
    let mut name = String::new();
    for i in 0..n {
        let at = stream.cursor.at();
        let text = stream.cursor.line();
        let quoted = text.strip_prefix(b"\"").and_then(|text| text.strip_suffix(b"\""));
        let quoted = quoted.ok_or_else(|| stream.cursor.syntax(at, "a text in quotation marks", text))?;
        if i == 0 {
            name = String::from_utf8_lossy(quoted).into_owned();
        }
    }
    Ok(name)
}

fn element_ids(stream: &Stream<'_>, at: usize, parts: &Parts) -> Result<Ids, ReadError> {
    let fail = |problem| stream.cursor.line_error(at, problem);
    let ids = parts.elements.as_ref();
    let ids = ids.ok_or_else(|| fail(Problem::Missing("section $Elements before this one".into())))?;
    Ids::new(ids).map_err(|(id, _)| fail(Problem::Duplicate { what: "element", id: id.into() }))
}

/// `n` numbered entries, in an array of all.
fn values(
    stream: &mut Stream<'_>,
    (what, ids): (&'static str, &Ids),
    n: usize,
    entries: usize,
    components: usize,
) -> Result<Vec<f64>, ReadError> {
    let mut values = vec![f64::NAN; entries * components];
    let mut is_set = vec![false; entries];
    for _ in 0..n {
        let at = stream.at();
        let id = stream.natural("the number of a node or element")?;
        let index = ids
            .index(id)
            .ok_or_else(|| stream.error(at, Problem::Index { what, found: id.into(), range: ids.range() }))?
            as usize;
        if std::mem::replace(&mut is_set[index], true) {
            return Err(stream.error(at, Problem::Duplicate { what, id: id.into() }));
        }
        for value in &mut values[index * components..][..components] {
            *value = stream.real("a value of a field")?;
        }
    }
    Ok(values)
}
