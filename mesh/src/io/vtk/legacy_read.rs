//! Reads legacy `.vtk` files: unstructured grids, and the vertices, lines and triangles of polygonal data.

use super::{
    kind::Kind,
    legacy_arrays::Legacy,
    legacy_fields::{attributes, field_arrays, skip_metadata},
    push_cell, take_regions, vertices_per_cell,
};
use crate::io::{
    DataField, MeshData, Place, Problem, ReadError,
    cursor::{Cursor, check_finite, check_u32, parse, shown},
};

/// Cells as the file has them: where each begins in the list of vertices, and that list.
struct Topology {
    offsets: Vec<i64>,
    connectivity: Vec<i64>,
    /// Where it stands in the file, for errors.
    at: usize,
}

/// What a file is made of, before it is put together.
#[derive(Default)]
struct Parts {
    is_polygonal: bool,
    points: Option<Vec<[f64; 3]>>,
    /// Cells, or vertices, lines and polygons.
    topologies: [Option<Topology>; 3],
    types: Option<(Vec<i64>, usize)>,
    /// Fields on points and on cells, with the number of entries stated and where.
    fields: [Option<(u64, usize, Vec<DataField>)>; 2],
}

const VERSIONS: &str = "\"# vtk DataFile Version\" 1.0 to 5.1";

/// Reads a mesh.
pub(in crate::io) fn read(bytes: &[u8], notes: &mut Vec<String>) -> Result<MeshData, ReadError> {
    let mut cursor = Cursor::new(bytes);
    let is_new = version(&mut cursor)?;
    cursor.line(); // the title
    let (at, word) = cursor.need("\"ASCII\" or \"BINARY\"")?;
    let is_binary = word.eq_ignore_ascii_case(b"binary");
    if !is_binary && !word.eq_ignore_ascii_case(b"ascii") {
        return Err(cursor.syntax(at, "\"ASCII\" or \"BINARY\"", word));
    }
    let mut file = Legacy { cursor, is_binary };
    let mut parts = Parts::default();
    dataset(&mut file, &mut parts)?;
    while let Some((at, word)) = file.cursor.word() {
        section(&mut file, &mut parts, at, word, is_new, notes)?;
    }
    let mut data = assemble(&file.cursor, parts)?;
    take_regions(&mut data, notes);
    data.dimension = data.natural_dimension();
    Ok(data)
}

/// Reads the first line; true from version 5 on, which has another layout of cells.
fn version(cursor: &mut Cursor<'_>) -> Result<bool, ReadError> {
    let at = cursor.at();
    let line = cursor.line();
    let mark = b"# vtk DataFile Version";
    let number = line.get(..mark.len()).filter(|start| start.eq_ignore_ascii_case(mark)).map(|_| &line[mark.len()..]);
    let number = number.ok_or_else(|| cursor.syntax(at, VERSIONS, line))?.trim_ascii();
    match parse::<f64>(number) {
        Some(version) if (1.0..6.0).contains(&version) => Ok(version >= 5.0),
        _ => Err(cursor.line_error(at, Problem::Version { found: shown(number), expected: VERSIONS })),
    }
}

fn dataset(file: &mut Legacy<'_>, parts: &mut Parts) -> Result<(), ReadError> {
    file.cursor.keyword("DATASET")?;
    let (at, word) = file.cursor.need("a type of data set")?;
    match word.to_ascii_uppercase().as_slice() {
        b"UNSTRUCTURED_GRID" => parts.is_polygonal = false,
        b"POLYDATA" => parts.is_polygonal = true,
        b"STRUCTURED_POINTS" | b"STRUCTURED_GRID" | b"RECTILINEAR_GRID" => {
            let what = format!("a data set of type {}, which has no simplices,", shown(word)).into();
            return Err(file.cursor.line_error(at, Problem::Unsupported(what)));
        }
        _ => return Err(file.cursor.syntax(at, "\"UNSTRUCTURED_GRID\" or \"POLYDATA\"", word)),
    }
    Ok(())
}

fn section(
    file: &mut Legacy<'_>,
    parts: &mut Parts,
    at: usize,
    word: &[u8],
    is_new: bool,
    notes: &mut Vec<String>,
) -> Result<(), ReadError> {
    let name = word.to_ascii_uppercase();
    let repeated =
        |cursor: &Cursor<'_>| cursor.line_error(at, Problem::Repeated(format!("section {}", shown(word)).into()));
    match (name.as_slice(), parts.is_polygonal) {
        (b"POINTS", _) if parts.points.is_some() => Err(repeated(&file.cursor)),
        (b"POINTS", _) => {
            parts.points = Some(points(file)?);
            Ok(())
        }
        (b"CELLS", false) => put(file, &mut parts.topologies[0], is_new, at, repeated),
        (b"VERTICES", true) => put(file, &mut parts.topologies[0], is_new, at, repeated),
        (b"LINES", true) => put(file, &mut parts.topologies[1], is_new, at, repeated),
        (b"POLYGONS", true) => put(file, &mut parts.topologies[2], is_new, at, repeated),
        (b"TRIANGLE_STRIPS", true) => {
            let count = file.cursor.number("a number of strips")?;
            Err(file.cursor.line_error(at, Problem::Element { kind: "triangle strip".into(), count }))
        }
        (b"CELL_TYPES", false) if parts.types.is_some() => Err(repeated(&file.cursor)),
        (b"CELL_TYPES", false) => {
            let n = file.cursor.number("the number of cells")?;
            parts.types = Some((file.integers(Kind::I32, n, "types of cells")?, at));
            Ok(())
        }
        (b"POINT_DATA", _) => attributes(file, &mut parts.fields[0], at, repeated, notes),
        (b"CELL_DATA", _) => attributes(file, &mut parts.fields[1], at, repeated, notes),
        (b"METADATA", _) => {
            skip_metadata(file);
            Ok(())
        }
        (b"FIELD", _) => {
            for field in field_arrays(file, None)? {
                notes.push(format!("field data {:?}: neither on points nor on cells", field.name));
            }
            Ok(())
        }
        _ => Err(file.cursor.syntax(at, "a section such as \"POINTS\", \"CELLS\" or \"POINT_DATA\"", word)),
    }
}

fn points(file: &mut Legacy<'_>) -> Result<Vec<[f64; 3]>, ReadError> {
    let at = file.cursor.at();
    let n: u64 = file.cursor.number("the number of points")?;
    check_u32(n, "points").map_err(|problem| file.cursor.line_error(at, problem))?;
    let kind = file.kind()?;
    let start = file.cursor;
    let flat = file.reals(kind, n.saturating_mul(3), "coordinates")?;
    let points = flat.as_chunks::<3>().0.to_vec();
    for (vertex, point) in points.iter().enumerate() {
        for axis in 0..3 {
            check_finite(vertex, axis, point[axis])
                .map_err(|problem| place(file, start, 3 * vertex + axis, kind, problem))?;
        }
    }
    Ok(points)
}

/// An error about number `index` of an array that begins in the line after `start`.
fn place(file: &Legacy<'_>, mut start: Cursor<'_>, index: usize, kind: Kind, problem: Problem) -> ReadError {
    if file.is_binary {
        start.line();
        return ReadError::new(Place::Byte(start.at() + index * kind.size()), problem);
    }
    for _ in 0..index {
        start.word();
    }
    start.skip_space();
    start.line_error(start.at(), problem)
}

fn put(
    file: &mut Legacy<'_>,
    into: &mut Option<Topology>,
    is_new: bool,
    at: usize,
    repeated: impl Fn(&Cursor<'_>) -> ReadError,
) -> Result<(), ReadError> {
    if into.is_some() {
        return Err(repeated(&file.cursor));
    }
    let n: u64 = file.cursor.number("the number of cells")?;
    let size: u64 = file.cursor.number("the size of the list of cells")?;
    *into = Some(if is_new { new_topology(file, n, size, at)? } else { old_topology(file, n, size, at)? });
    Ok(())
}

/// Cells as `k v1 ... vk`, `size` numbers in all.
fn old_topology(file: &mut Legacy<'_>, n: u64, size: u64, at: usize) -> Result<Topology, ReadError> {
    let list = file.integers(Kind::I32, size, "numbers of cells")?;
    let (mut offsets, mut connectivity) = (vec![0], Vec::with_capacity(list.len()));
    let mut rest = list.as_slice();
    while let Some((&k, more)) = rest.split_first() {
        let split = usize::try_from(k).ok().and_then(|k| more.split_at_checked(k));
        let Some((vertices, more)) = split else {
            let expected = format!("{k} vertices of cell {}", offsets.len() - 1).into();
            let found = format!("{} numbers left in the list", more.len());
            return Err(file.cursor.line_error(at, Problem::Syntax { expected, found }));
        };
        connectivity.extend_from_slice(vertices);
        offsets.push(connectivity.len() as i64);
        rest = more;
    }
    let found = offsets.len() as u64 - 1;
    if found != n {
        return Err(file
            .cursor
            .line_error(at, Problem::Length { what: "the list of cells".into(), found, expected: n }));
    }
    Ok(Topology { offsets, connectivity, at })
}

/// Cells as offsets, one more than cells, and vertices, each with a type.
fn new_topology(file: &mut Legacy<'_>, n: u64, size: u64, at: usize) -> Result<Topology, ReadError> {
    file.cursor.keyword("OFFSETS")?;
    let kind = file.kind()?;
    let mut offsets = file.integers(kind, n, "offsets of cells")?;
    file.cursor.keyword("CONNECTIVITY")?;
    let kind = file.kind()?;
    let connectivity = file.integers(kind, size, "vertices of cells")?;
    if offsets.is_empty() {
        offsets.push(0);
    }
    let ends = (offsets.first().copied(), offsets.last().copied());
    if ends != (Some(0), Some(connectivity.len() as i64)) || !offsets.is_sorted() {
        let expected = format!("offsets that ascend from 0 to {}", connectivity.len()).into();
        let found = format!("such from {} to {}", ends.0.unwrap_or(0), ends.1.unwrap_or(0));
        return Err(file.cursor.line_error(at, Problem::Syntax { expected, found }));
    }
    Ok(Topology { offsets, connectivity, at })
}

/// Puts the parts together and checks that they fit.
fn assemble(cursor: &Cursor<'_>, parts: Parts) -> Result<MeshData, ReadError> {
    let missing = |what: &'static str| cursor.line_error(cursor.at(), Problem::Missing(what.into()));
    let points = parts.points.ok_or_else(|| missing("section POINTS"))?;
    let mut data = MeshData { points, ..MeshData::default() };
    if parts.is_polygonal {
        for (topology, size) in parts.topologies.iter().zip(1..) {
            if let Some(topology) = topology {
                push_polygons(cursor, topology, size, &mut data)?;
            }
        }
    } else if let [Some(topology), ..] = &parts.topologies {
        let (types, at) = parts.types.ok_or_else(|| missing("section CELL_TYPES"))?;
        push_cells(cursor, topology, &types, at, &mut data)?;
    } else if parts.types.is_some_and(|(types, _)| !types.is_empty()) {
        return Err(missing("section CELLS"));
    }
    let expected = [data.points.len() as u64, data.n_cells() as u64];
    for (kind, (fields, expected)) in parts.fields.into_iter().zip(expected).enumerate() {
        let Some((found, at, fields)) = fields else { continue };
        if found != expected {
            let what = if kind == 0 { "POINT_DATA" } else { "CELL_DATA" }.to_owned();
            return Err(cursor.line_error(at, Problem::Length { what, found, expected }));
        }
        *(if kind == 0 { &mut data.point_fields } else { &mut data.cell_fields }) = fields;
    }
    Ok(data)
}

fn push_cells(
    cursor: &Cursor<'_>,
    topology: &Topology,
    types: &[i64],
    at: usize,
    data: &mut MeshData,
) -> Result<(), ReadError> {
    let n = topology.offsets.len() - 1;
    if types.len() != n {
        let problem = Problem::Length { what: "CELL_TYPES".to_owned(), found: types.len() as u64, expected: n as u64 };
        return Err(cursor.line_error(at, problem));
    }
    for (cell, (ends, &kind)) in topology.offsets.windows(2).zip(types).enumerate() {
        let size = vertices_per_cell(kind, types).map_err(|problem| cursor.line_error(at, problem))?;
        let vertices = &topology.connectivity[ends[0] as usize..ends[1] as usize];
        if vertices.len() != size {
            let expected = format!("{size} vertices of cell {cell}, which has type {kind}").into();
            let problem = Problem::Syntax { expected, found: format!("{} vertices", vertices.len()) };
            return Err(cursor.line_error(topology.at, problem));
        }
        push_cell(data, vertices, 0).map_err(|problem| cursor.line_error(topology.at, problem))?;
    }
    Ok(())
}

fn push_polygons(cursor: &Cursor<'_>, topology: &Topology, size: usize, data: &mut MeshData) -> Result<(), ReadError> {
    for ends in topology.offsets.windows(2) {
        let vertices = &topology.connectivity[ends[0] as usize..ends[1] as usize];
        if vertices.len() != size {
            let name = ["poly-vertex", "poly-line", "polygon"][size - 1];
            let kind = format!("{name} with {} vertices", vertices.len()).into();
            let alike = topology.offsets.windows(2).filter(|other| other[1] - other[0] == ends[1] - ends[0]);
            return Err(cursor.line_error(topology.at, Problem::Element { kind, count: alike.count() as u64 }));
        }
        push_cell(data, vertices, 0).map_err(|problem| cursor.line_error(topology.at, problem))?;
    }
    Ok(())
}
