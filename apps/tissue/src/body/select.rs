//! Which nodes and boundary facets a row of `[[constraint]]` or `[[load]]` is about. A row with several selectors picks what
//! all of them pick; a row that picks nothing is an error.

use super::columns::SIDES;
use super::geometry::{Geometry, corners_of, fixed, within};
use std::collections::BTreeSet;
use stylet_mesh::{CellId, VertexId};
use stylet_scene::{Row, Value, nearest};

/// How far from a plane or a side a node may be, in sizes of the body.
const SLACK: f64 = 1e-9;

/// The columns that select.
const SELECTORS: [&str; 6] = ["side", "box", "plane", "region", "tag", "group"];

/// What a row picks.
#[derive(Clone, Debug)]
pub(super) struct Picked {
    /// By vertex slot.
    pub nodes: Vec<bool>,
    /// Boundary facets, where the row names them by tag or group; otherwise those whose nodes are all picked.
    pub facets: Option<BTreeSet<(CellId, usize)>>,
}

impl Picked {
    /// The nodes, ascending.
    pub fn vertices(&self) -> impl Iterator<Item = VertexId> + '_ {
        self.nodes.iter().enumerate().filter(|(_, picked)| **picked).map(|(vertex, _)| VertexId::new(vertex))
    }
}

/// Whether a row says where it is.
pub(super) fn selects(row: &Row) -> bool {
    SELECTORS.iter().any(|name| row.value(name).is_some())
}

/// What a row picks; `regions` are the rows of `[[region]]`. A row without selectors picks all nodes.
///
/// # Errors
/// The column, what was found and what was expected.
pub(super) fn pick<const D: usize, const N: usize>(
    row: &Row,
    geometry: &Geometry<D, N>,
    regions: &[Row],
) -> Result<Picked, String> {
    let mesh = &geometry.mesh;
    let mut live = vec![false; mesh.n_vertex_slots()];
    mesh.vertices().for_each(|v| live[v.index()] = true);
    let mut picked = Picked { nodes: live, facets: None };
    let keep = |picked: &mut Picked, holds: &dyn Fn(&[f64; D]) -> bool| {
        for v in mesh.vertices() {
            picked.nodes[v.index()] &= holds(&mesh.point(v));
        }
    };
    let slack = SLACK * geometry.size();
    if let Some(side) = row.value("side") {
        let (axis, end) = side_of::<D>(side.text()?)?;
        keep(&mut picked, &|x| (x[axis] - geometry.bounds[end][axis]).abs() <= slack);
    }
    if let Some(corners) = row.value("box") {
        let corners = corners_of("box", corners.floats()?)?;
        keep(&mut picked, &|x| within(&corners, x, slack));
    }
    if let Some(plane) = row.value("plane") {
        let numbers = plane.floats()?;
        if numbers.len() != D + 1 {
            return Err(format!("plane: found {} numbers, expected {}: a normal and an offset", numbers.len(), D + 1));
        }
        let normal: [f64; D] = fixed("plane", &numbers[..D])?;
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 {
            return Err("plane: found a normal of zero, expected a direction".into());
        }
        let offset = numbers[D] / length;
        keep(&mut picked, &|x| ((0..D).map(|k| normal[k] / length * x[k]).sum::<f64>() - offset).abs() <= slack);
    }
    if let Some(name) = row.value("region") {
        let region = region_number(name.text()?, regions)?;
        let mut inside = vec![false; picked.nodes.len()];
        for cell in mesh.cells().filter(|&cell| mesh.region(cell) == region) {
            mesh.cell(cell).iter().for_each(|v| inside[v.index()] = true);
        }
        picked.nodes.iter_mut().zip(inside).for_each(|(node, inside)| *node &= inside);
    }
    let group = match (row.value("tag"), row.value("group")) {
        (Some(_), Some(_)) => return Err("found tag beside group, expected one of the two".into()),
        (Some(tag), None) => Some((None, tag.int()? as i32)),
        (None, Some(name)) => Some(named_group::<D, N>(name, geometry)?),
        (None, None) => None,
    };
    if let Some((size, number)) = group {
        pick_group(size, number, geometry, &mut picked)?;
    }
    if picked.nodes.iter().any(|&node| node) {
        Ok(picked)
    } else {
        let extent = geometry.extent();
        Err(format!("found no node in its place, expected at least one; the body reaches {extent}"))
    }
}

/// The number of a region of this name, as the mesh has it.
pub(super) fn region_number(name: &str, regions: &[Row]) -> Result<u32, String> {
    let name_of =
        |row: &Row| row.value("name").and_then(|value| value.text().ok().map(str::to_owned)).unwrap_or_default();
    let names: Vec<String> = regions.iter().map(name_of).collect();
    match names.iter().position(|known| known == name) {
        Some(at) => Ok(at as u32 + 1),
        None if names.is_empty() => Err(format!("region: found {name}, expected a scene with [[region]]")),
        None => {
            let near = nearest(name, names.iter().map(String::as_str));
            Err(format!("region: found {name}, expected one of {}; nearest is {near}", names.join(", ")))
        }
    }
}

/// Axis and end (0 low, 1 high) of a side by its name.
fn side_of<const D: usize>(name: &str) -> Result<(usize, usize), String> {
    let at = SIDES.iter().position(|side| *side == name).unwrap_or(0);
    match (D, at / 2, at % 2) {
        (2, 1, _) => Err(format!("side: found {name}, expected left, right, bottom or top in two dimensions")),
        (2, 2, end) => Ok((1, end)),
        (_, axis, end) => Ok((axis, end)),
    }
}

/// Vertices per cell and number of a group that the file names.
fn named_group<const D: usize, const N: usize>(
    name: &Value,
    geometry: &Geometry<D, N>,
) -> Result<(Option<usize>, i32), String> {
    let name = name.text()?;
    let smaller = || geometry.data.region_names.iter().filter(|region| region.vertices_per_cell < N);
    if let Some(found) = smaller().find(|region| region.name == name) {
        return Ok((Some(found.vertices_per_cell), found.region));
    }
    let known: Vec<&str> = smaller().map(|region| region.name.as_str()).collect();
    Err(match known.is_empty() {
        true => format!("group: found {name}, expected a mesh file with named boundaries"),
        false => {
            format!(
                "group: found {name}, expected one of {}; nearest is {}",
                known.join(", "),
                nearest(name, known.iter().copied())
            )
        }
    })
}

/// Keeps the nodes of the boundary facets, edges or points of a number, and the facets themselves.
fn pick_group<const D: usize, const N: usize>(
    size: Option<usize>,
    number: i32,
    geometry: &Geometry<D, N>,
    picked: &mut Picked,
) -> Result<(), String> {
    let mut inside = vec![false; picked.nodes.len()];
    let wanted = |n: usize| size.is_none_or(|size| size == n);
    if wanted(N - 1) {
        let facets: BTreeSet<(CellId, usize)> =
            geometry.tags.iter().filter(|t| t.tag == number).map(|t| (t.cell, t.facet)).collect();
        for &(cell, facet) in &facets {
            let vertices = geometry.mesh.cell(cell);
            (0..N).filter(|&k| k != facet).for_each(|k| inside[vertices[k].index()] = true);
        }
        picked.facets = (!facets.is_empty()).then_some(facets);
    }
    for block in geometry.data.blocks.iter().filter(|b| b.vertices_per_cell < N && wanted(b.vertices_per_cell)) {
        for (cell, &region) in block.vertices.chunks_exact(block.vertices_per_cell).zip(&block.regions) {
            if region == number {
                let vertices = cell.iter().filter_map(|&p| geometry.vertex_of_point.get(p as usize).copied().flatten());
                vertices.for_each(|v| inside[v.index()] = true);
            }
        }
    }
    if !inside.iter().any(|&node| node) {
        let smaller = geometry.data.blocks.iter().filter(|block| block.vertices_per_cell < N);
        let numbers: BTreeSet<i32> =
            smaller.flat_map(|block| block.regions.iter().copied()).filter(|&n| n != 0).collect();
        let known: Vec<String> = numbers.iter().map(i32::to_string).collect();
        let expected =
            if known.is_empty() { "a mesh file with tags".into() } else { format!("one of {}", known.join(", ")) };
        return Err(format!("tag: found no boundary with number {number}, expected {expected}"));
    }
    picked.nodes.iter_mut().zip(inside).for_each(|(node, inside)| *node &= inside);
    Ok(())
}
