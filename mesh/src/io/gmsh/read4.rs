//! Entities, nodes and elements of version 4.1.

use super::{
    elements::vertices_per_cell,
    read::{Parts, ids_of, need_nodes, vertices},
    stream::Stream,
};
use crate::io::{Problem, ReadError, cursor::check_finite};

/// Reads `$Entities` or `$PartitionedEntities` behind their first line: the physical groups, and past all else.
pub(super) fn entities(stream: &mut Stream<'_>, is_partitioned: bool, parts: &mut Parts) -> Result<(), ReadError> {
    if is_partitioned {
        stream.size("the number of partitions")?;
        let at = stream.at();
        let n = stream.size("the number of ghost entities")?;
        let n = stream.check_count(at, n, stream.bytes_of(2, 0, 0), "ghost entities")?;
        for _ in 0..2 * n {
            stream.int("a ghost entity")?;
        }
    }
    let at = stream.at();
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = stream.size("a number of entities")?;
    }
    for (dimension, count) in (0..).zip(counts) {
        let n_reals = if dimension == 0 { 3 } else { 6 };
        let count = stream.check_count(at, count, stream.bytes_of(1, 1, n_reals), "entities")?;
        for _ in 0..count {
            entity(stream, dimension, is_partitioned, parts)?;
        }
    }
    stream.end(if is_partitioned { "PartitionedEntities" } else { "Entities" })
}

fn entity(stream: &mut Stream<'_>, dimension: i64, is_partitioned: bool, parts: &mut Parts) -> Result<(), ReadError> {
    let at = stream.at();
    let tag = stream.int("the number of an entity")?;
    if is_partitioned {
        stream.int("the dimension of a parent entity")?;
        stream.int("the number of a parent entity")?;
        list(stream, "partitions")?;
    }
    for _ in 0..if dimension == 0 { 3 } else { 6 } {
        stream.real("a bound of an entity")?;
    }
    let groups_at = stream.at();
    let (n, first) = list(stream, "physical groups")?;
    if n > 1 {
        let what = ["point", "curve", "surface", "volume"][dimension as usize];
        parts.notes.push(format!("the physical groups of {what} {tag} but the first: it is in {n}"));
    }
    if dimension > 0 {
        list(stream, "bounding entities")?;
    }
    let syntax = || Problem::Syntax { expected: "a number of 32 bits".into(), found: first.to_string() };
    let region = i32::try_from(first).map_err(|_| stream.error(groups_at, syntax()))?;
    if parts.entities.insert((dimension, tag), region).is_some() {
        return Err(stream.error(at, Problem::Duplicate { what: "entity", id: tag.into() }));
    }
    Ok(())
}

/// Reads a count and as many numbers; returns the count and the first number, or 0.
fn list(stream: &mut Stream<'_>, what: &'static str) -> Result<(usize, i64), ReadError> {
    let at = stream.at();
    let n = stream.size("the length of a list")?;
    let n = stream.check_count(at, n, stream.bytes_of(1, 0, 0), what)?;
    let mut first = 0;
    for i in 0..n {
        let value = stream.int("a number in a list")?;
        if i == 0 {
            first = value;
        }
    }
    Ok((n, first))
}

/// Blocks, things in all, smallest and largest number.
fn totals(stream: &mut Stream<'_>, bytes_each: usize, what: &'static str) -> Result<(u64, u64, usize), ReadError> {
    let at = stream.at();
    let n_blocks = stream.size("the number of blocks")?;
    let n = stream.size("a number of nodes or elements")?;
    stream.size("the smallest number")?;
    stream.size("the largest number")?;
    stream.check_count(at, n_blocks, stream.bytes_of(3, 1, 0), "blocks")?;
    stream.check_count(at, n, bytes_each, what)?;
    Ok((n_blocks, n, at))
}

fn check_total(stream: &Stream<'_>, at: usize, what: &str, found: usize, expected: u64) -> Result<(), ReadError> {
    if found as u64 == expected {
        return Ok(());
    }
    let what = format!("the sum of the blocks of {what}");
    Err(stream.error(at, Problem::Length { what, found: found as u64, expected }))
}

pub(super) fn nodes(stream: &mut Stream<'_>, parts: &mut Parts) -> Result<(), ReadError> {
    let (n_blocks, total, start) = totals(stream, stream.bytes_of(0, 1, 3), "nodes")?;
    let (mut ids, mut places) = (Vec::new(), Vec::new());
    for _ in 0..n_blocks {
        let at = stream.at();
        let dimension = stream.int("the dimension of an entity")?;
        stream.int("the number of an entity")?;
        let is_parametric = stream.int("0 or 1, whether nodes have parameters")?;
        let n_parameters = if is_parametric == 0 { 0 } else { dimension };
        if !(0..=3).contains(&dimension) || !(0..=1).contains(&is_parametric) {
            let expected = "a dimension from 0 to 3, a number, and 0 or 1".into();
            let found = format!("dimension {dimension} and {is_parametric}");
            return Err(stream.error(at, Problem::Syntax { expected, found }));
        }
        let at = stream.at();
        let n = stream.size("the number of nodes in a block")?;
        let n = stream.check_count(at, n, stream.bytes_of(0, 1, 3 + n_parameters as u64), "nodes")?;
        for _ in 0..n {
            places.push(stream.at());
            ids.push(stream.size("the number of a node")?);
        }
        for _ in 0..n {
            let mut point = [0.0; 3];
            for (axis, x) in point.iter_mut().enumerate() {
                let at = stream.at();
                let value = stream.real("a coordinate")?;
                *x = check_finite(parts.data.points.len(), axis, value).map_err(|problem| stream.error(at, problem))?;
            }
            for _ in 0..n_parameters {
                stream.real("a parameter of a node")?;
            }
            parts.data.points.push(point);
        }
    }
    check_total(stream, start, "nodes", ids.len(), total)?;
    parts.nodes = Some(ids_of(stream, &ids, &places)?);
    stream.end("Nodes")
}

pub(super) fn elements(stream: &mut Stream<'_>, parts: &mut Parts) -> Result<(), ReadError> {
    let (n_blocks, total, start) = totals(stream, stream.bytes_of(0, 2, 0), "elements")?;
    let mut ids = Vec::new();
    for _ in 0..n_blocks {
        let dimension = stream.int("the dimension of an entity")?;
        let tag = stream.int("the number of an entity")?;
        let at = stream.at();
        let kind = stream.int("the type of elements")?;
        let n = stream.size("the number of elements in a block")?;
        let size = vertices_per_cell(kind, || n).map_err(|problem| stream.error(at, problem))?;
        let n = stream.check_count(at, n, stream.bytes_of(0, 1 + size as u64, 0), "elements")?;
        let region = parts.entities.get(&(dimension, tag)).copied().unwrap_or(0);
        for _ in 0..n {
            ids.push(stream.size("the number of an element")?);
            let vertices = vertices(stream, size, need_nodes(stream, &parts.nodes)?, true)?;
            parts.data.push_cell(&vertices[..size], region);
        }
    }
    check_total(stream, start, "elements", ids.len(), total)?;
    parts.elements = Some(ids);
    stream.end("Elements")
}
