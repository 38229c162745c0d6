//! STL surfaces: triangles as triples of corners, in text or in binary.
//!
//! The format was published by 3D Systems in 1987. Corners of the same coordinates become one vertex (compared exactly; 0 and
//! -0 are equal). Each solid of a text file is a region, numbered from 1 and named as the solid is; a single solid without
//! a name is region 0. A binary file is region 0 throughout: its header is no name, and the 16 bits of attributes per
//! triangle, which no two programs use alike, are ignored. Normals are ignored, and computed for writing.

use super::{
    MeshData, Problem, ReadError, RegionName,
    cursor::{ByteOrder, Cursor, check_finite, check_u32},
};
use crate::geometry;
use std::collections::HashMap;

/// Bytes before the first triangle of a binary file: 80 of text, 4 of count.
const HEADER: usize = 84;
/// Bytes of a triangle: normal and corners as 12 numbers of 4 bytes, 2 of attributes.
const TRIANGLE: usize = 50;

/// Whether the length is that of a binary file with as many triangles as it says. (Text cannot be told from binary by its
/// first word: many a binary header begins with `solid`.)
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    let count = bytes.get(80..HEADER).map(|count| ByteOrder::Little.i32(count) as u32 as usize);
    count.and_then(|n| n.checked_mul(TRIANGLE)).is_some_and(|size| size == bytes.len() - HEADER)
}

/// Vertices by their coordinates.
#[derive(Default)]
struct Welder {
    known: HashMap<[u64; 3], u32>,
}

impl Welder {
    fn vertex(&mut self, data: &mut MeshData, point: [f64; 3]) -> Result<u32, Problem> {
        // Adding zero turns -0 into 0.
        let key = point.map(|x| (x + 0.0).to_bits());
        if let Some(&vertex) = self.known.get(&key) {
            return Ok(vertex);
        }
        let vertex = data.points.len();
        check_u32(vertex as u64 + 1, "points")?;
        for axis in 0..3 {
            check_finite(vertex, axis, point[axis])?;
        }
        self.known.insert(key, vertex as u32);
        data.points.push(point);
        Ok(vertex as u32)
    }
}

/// Reads a surface.
pub(super) fn read(bytes: &[u8]) -> Result<MeshData, ReadError> {
    let text = Cursor::new(bytes).peek().is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let mut data = if is_binary(bytes) || !text { read_binary(bytes)? } else { read_text(bytes)? };
    data.dimension = data.natural_dimension();
    Ok(data)
}

fn read_binary(bytes: &[u8]) -> Result<MeshData, ReadError> {
    let mut cursor = Cursor::at_byte(bytes, 0);
    if bytes.len() < HEADER {
        let expected = "\"solid\", or 80 bytes of header and the number of triangles".into();
        return Err(cursor.byte_error(bytes.len(), Problem::Truncated { expected }));
    }
    cursor.take(80, "header")?;
    let count = cursor.i32(ByteOrder::Little, "the number of triangles")? as u32;
    let n = cursor.check_count(u64::from(count), TRIANGLE, "triangles");
    let n = n.map_err(|problem| cursor.byte_error(80, problem))?;
    let (mut data, mut welder) = (MeshData::default(), Welder::default());
    for _ in 0..n {
        let at = cursor.at();
        let triangle = cursor.take(TRIANGLE, "a triangle")?;
        let mut corners = [0; 3];
        for (corner, bytes) in corners.iter_mut().zip(triangle[12..48].chunks_exact(12)) {
            let point =
                std::array::from_fn(|k| f64::from(f32::from_ne_bytes(ByteOrder::Little.native(&bytes[4 * k..]))));
            *corner = welder.vertex(&mut data, point).map_err(|problem| cursor.byte_error(at, problem))?;
        }
        data.push_cell(&corners, 0);
    }
    if cursor.left() > 0 {
        let found = format!("{} bytes more", cursor.left());
        let expected = format!("the end of the file after {n} triangles").into();
        return Err(cursor.byte_error(cursor.at(), Problem::Syntax { expected, found }));
    }
    Ok(data)
}

fn read_text(bytes: &[u8]) -> Result<MeshData, ReadError> {
    let (mut data, mut welder, mut cursor) = (MeshData::default(), Welder::default(), Cursor::new(bytes));
    let mut region = 0;
    while cursor.peek().is_some() {
        cursor.keyword("solid")?;
        region += 1;
        let name = String::from_utf8_lossy(cursor.line()).into_owned();
        if !name.is_empty() {
            data.region_names.push(RegionName { vertices_per_cell: 3, region, name });
        }
        loop {
            let (at, word) = cursor.need("\"facet\" or \"endsolid\"")?;
            if word.eq_ignore_ascii_case(b"endsolid") {
                cursor.line();
                break;
            }
            if !word.eq_ignore_ascii_case(b"facet") {
                return Err(cursor.syntax(at, "\"facet\" or \"endsolid\"", word));
            }
            let corners = read_facet(&mut cursor, &mut data, &mut welder)?;
            data.push_cell(&corners, region);
        }
    }
    if region == 1 && data.region_names.is_empty() {
        data.blocks.iter_mut().for_each(|block| block.regions.fill(0));
    }
    Ok(data)
}

/// The rest of a facet, behind that word.
fn read_facet(cursor: &mut Cursor<'_>, data: &mut MeshData, welder: &mut Welder) -> Result<[u32; 3], ReadError> {
    cursor.keyword("normal")?;
    for _ in 0..3 {
        // Some programs write "nan" for the normal of a flat triangle.
        cursor.number::<f64>("a component of a normal")?;
    }
    cursor.keyword("outer")?;
    cursor.keyword("loop")?;
    let mut corners = [0; 3];
    for corner in &mut corners {
        cursor.keyword("vertex")?;
        cursor.skip_space();
        let at = cursor.at();
        let mut point = [0.0; 3];
        for x in &mut point {
            *x = cursor.number("a coordinate")?;
        }
        *corner = welder.vertex(data, point).map_err(|problem| cursor.line_error(at, problem))?;
    }
    cursor.keyword("endloop")?;
    cursor.keyword("endfacet")?;
    Ok(corners)
}

/// The triangles of some data, and notes about what else there was.
fn triangles(data: &MeshData, notes: &mut Vec<String>) -> Vec<([u32; 3], i32)> {
    let (triangles, regions) = data.simplices::<3>();
    let others = data.n_cells() - triangles.len();
    if others > 0 {
        notes.push(format!("{others} cells that are not triangles: STL holds triangles only"));
    }
    let mut used = vec![false; data.points.len()];
    triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    let unused = used.iter().filter(|used| !**used).count();
    if unused > 0 {
        notes.push(format!("{unused} points without a triangle"));
    }
    for (fields, kind) in [(&data.point_fields, "point"), (&data.cell_fields, "cell")] {
        notes.extend(fields.iter().map(|field| format!("{kind} field {:?}: STL holds no fields", field.name)));
    }
    triangles.into_iter().zip(regions).collect()
}

/// The unit normal by the right-hand rule; zero for a flat triangle.
fn normal(corners: &[[f64; 3]; 3]) -> [f64; 3] {
    // Differences of numbers scaled down, so that nothing overflows.
    let scale = corners.as_flattened().iter().fold(0.0, |s: f64, x| s.max(x.abs())).max(f64::MIN_POSITIVE);
    let [a, b] = [1, 2].map(|i| geometry::subtract(&corners[i].map(|x| x / scale), &corners[0].map(|x| x / scale)));
    let n = geometry::cross(&a, &b);
    let length = geometry::norm(&n);
    if length > 0.0 { n.map(|x| x / length) } else { [0.0; 3] }
}

/// A text file: a solid for each region, ascending, with coordinates that read back as the same numbers.
pub(super) fn write_text(data: &MeshData, notes: &mut Vec<String>) -> Vec<u8> {
    let mut triangles = triangles(data, notes);
    if !triangles.is_sorted_by_key(|&(_, region)| region) {
        notes.push("the order of the triangles: a solid holds those of one region".to_owned());
    }
    triangles.sort_by_key(|&(_, region)| region);
    let plain = triangles.iter().all(|&(_, region)| region == 0) && data.region_name(3, 0).is_none();
    let mut text = String::new();
    for (solid, run) in triangles.chunk_by(|a, b| a.1 == b.1).enumerate() {
        let region = run[0].1;
        let name = match data.region_name(3, region) {
            _ if plain => String::new(),
            Some(name) => one_line(name),
            None => format!("region {region}"),
        };
        if !plain && (region as i64 != solid as i64 + 1 || data.region_name(3, region) != Some(name.as_str())) {
            notes.push(format!("the number of region {region}, which reads back as {}, named {name:?}", solid + 1));
        }
        let label = if name.is_empty() { String::new() } else { format!(" {name}") };
        text.push_str(&format!("solid{label}\n"));
        for (corners, _) in run {
            push_facet(&mut text, &corners.map(|v| data.points[v as usize]));
        }
        text.push_str(&format!("endsolid{label}\n"));
    }
    if triangles.is_empty() {
        text.push_str("solid\nendsolid\n");
    }
    text.into_bytes()
}

fn push_facet(text: &mut String, corners: &[[f64; 3]; 3]) {
    let [x, y, z] = normal(corners).map(|x| x as f32);
    text.push_str(&format!("  facet normal {x:?} {y:?} {z:?}\n    outer loop\n"));
    for [x, y, z] in corners {
        text.push_str(&format!("      vertex {x:?} {y:?} {z:?}\n"));
    }
    text.push_str("    endloop\n  endfacet\n");
}

fn one_line(name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    name.trim().to_owned()
}

/// A binary file, with coordinates rounded to 32 bits.
///
/// # Errors
/// What does not fit: a coordinate beyond the range of 32-bit numbers, or more triangles than 32 bits count.
pub(super) fn write_binary(data: &MeshData, notes: &mut Vec<String>) -> Result<Vec<u8>, String> {
    let triangles = triangles(data, notes);
    if triangles.iter().any(|&(_, region)| region != 0) {
        notes.push("the regions of the triangles: binary STL holds none".to_owned());
    }
    let n = u32::try_from(triangles.len()).map_err(|_| format!("{} triangles", triangles.len()))?;
    let mut bytes = format!("{:80}", "binary STL, lengths in the units of the mesh").into_bytes();
    bytes.extend(n.to_le_bytes());
    let mut rounded = 0_usize;
    for (vertices, _) in &triangles {
        let corners = vertices.map(|v| data.points[v as usize]);
        for x in normal(&corners) {
            bytes.extend((x as f32).to_le_bytes());
        }
        for (corner, v) in corners.iter().zip(vertices) {
            for &x in corner {
                let narrow = x as f32;
                if !narrow.is_finite() {
                    return Err(format!("coordinate {x:e} of vertex {v} in 32 bits"));
                }
                rounded += usize::from(f64::from(narrow) != x);
                bytes.extend(narrow.to_le_bytes());
            }
        }
        bytes.extend([0; 2]);
    }
    if rounded > 0 {
        notes.push(format!("the precision of {rounded} coordinates of corners, rounded to 32 bits"));
    }
    Ok(bytes)
}
