//! Nodes and elements of version 2.

use super::{
    elements::vertices_per_cell,
    read::{Parts, ids_of, need_nodes, vertices},
    stream::Stream,
};
use crate::io::{
    Problem, ReadError,
    cursor::{Cursor, check_finite, parse},
};

pub(super) fn nodes(stream: &mut Stream<'_>, parts: &mut Parts) -> Result<(), ReadError> {
    let n = stream.cursor.count("nodes", stream.bytes_of(1, 0, 3))?;
    stream.cursor.line();
    let (mut ids, mut places) = (Vec::with_capacity(n), Vec::with_capacity(n));
    for vertex in 0..n {
        places.push(stream.at());
        ids.push(stream.natural("the number of a node")?);
        let mut point = [0.0; 3];
        for (axis, x) in point.iter_mut().enumerate() {
            let at = stream.at();
            let value = stream.real("a coordinate")?;
            *x = check_finite(vertex, axis, value).map_err(|problem| stream.error(at, problem))?;
        }
        parts.data.points.push(point);
    }
    parts.nodes = Some(ids_of(stream, &ids, &places)?);
    stream.end("Nodes")
}

pub(super) fn elements(stream: &mut Stream<'_>, parts: &mut Parts) -> Result<(), ReadError> {
    // In text a number, a type, a number of tags, and a node; in binary a number and a node, the others before a run.
    let n = stream.cursor.count("elements", 8)?;
    stream.cursor.line();
    let mut ids = Vec::with_capacity(n);
    while ids.len() < n {
        if stream.order.is_none() {
            let id = stream.natural("the number of an element")?;
            element_of_text(stream, id, parts, &mut ids)?;
        } else {
            run_of_binary(stream, n, parts, &mut ids)?;
        }
    }
    parts.elements = Some(ids);
    stream.end("Elements")
}

fn element_of_text(stream: &mut Stream<'_>, id: u64, parts: &mut Parts, ids: &mut Vec<u64>) -> Result<(), ReadError> {
    let at = stream.at();
    let kind = stream.int("the type of an element")?;
    let behind = stream.cursor;
    let size = vertices_per_cell(kind, || 1 + count_behind(behind, kind));
    let size = size.map_err(|problem| stream.error(at, problem))?;
    let at = stream.at();
    let n_tags = stream.natural("the number of tags of an element")?;
    let n_tags = stream.check_count(at, n_tags, 2, "tags")?;
    element(stream, id, size, n_tags, parts, ids)
}

/// Elements of a type in the lines behind one of that type.
fn count_behind(mut cursor: Cursor<'_>, kind: i64) -> u64 {
    cursor.line();
    let mut count = 0;
    while cursor.left() > 0 {
        let line = cursor.line();
        if line.starts_with(b"$") {
            break;
        }
        let word = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).nth(1);
        count += u64::from(word.and_then(parse::<i64>) == Some(kind));
    }
    count
}

/// Elements of one type behind a header: type, number of elements, number of tags.
fn run_of_binary(stream: &mut Stream<'_>, n: usize, parts: &mut Parts, ids: &mut Vec<u64>) -> Result<(), ReadError> {
    let at = stream.at();
    let kind = stream.int("the type of elements")?;
    let count = stream.natural("the number of elements of a type")?;
    let n_tags = stream.natural("the number of tags of elements")?;
    let size = vertices_per_cell(kind, || count).map_err(|problem| stream.error(at, problem))?;
    let bytes_each = stream.bytes_of(n_tags.saturating_add(1 + size as u64), 0, 0);
    let count = stream.check_count(at, count, bytes_each, "elements of a type")?;
    if count == 0 || count > n - ids.len() {
        let expected = format!("1 to {} elements of a type", n - ids.len()).into();
        return Err(stream.error(at, Problem::Syntax { expected, found: count.to_string() }));
    }
    for _ in 0..count {
        let id = stream.natural("the number of an element")?;
        element(stream, id, size, n_tags as usize, parts, ids)?;
    }
    Ok(())
}

fn element(
    stream: &mut Stream<'_>,
    id: u64,
    size: usize,
    n_tags: usize,
    parts: &mut Parts,
    ids: &mut Vec<u64>,
) -> Result<(), ReadError> {
    let mut region = 0;
    for tag in 0..n_tags {
        let at = stream.at();
        let value = stream.int("a tag of an element")?;
        // The first tag is the physical group; the others are its geometrical entity and partitions.
        if tag == 0 {
            let syntax = || Problem::Syntax { expected: "a number of 32 bits".into(), found: value.to_string() };
            region = i32::try_from(value).map_err(|_| stream.error(at, syntax()))?;
        }
    }
    let nodes = need_nodes(stream, &parts.nodes)?;
    let vertices = vertices(stream, size, nodes, false)?;
    parts.data.push_cell(&vertices[..size], region);
    ids.push(id);
    Ok(())
}
