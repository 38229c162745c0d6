//! The mesh of a scene: a box or a file, with the region of each cell and the groups that the file names.

use super::scene::{MeshStage, Scene};
use crate::error::RunError;
use crate::order::VertexOrder;
use crate::state::Checksum;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use stylet_mesh::check::{RepairSettings, repair};
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::import::{FacetTag, Imported, export};
use stylet_mesh::io::{CellBlock, MeshData, read};
use stylet_mesh::{SimplexMesh, VertexId};
use stylet_scene::Row;

/// More cells than this are a typing error.
const MOST_CELLS: f64 = 2e7;

/// A mesh with what constraints and loads are selected by.
#[derive(Clone, Debug)]
pub(super) struct Geometry<const D: usize, const N: usize> {
    /// The mesh; the region of a cell is 0, or the number of its `[[region]]` from 1.
    pub mesh: SimplexMesh<D, N>,
    /// What the mesh was made of.
    pub data: MeshData,
    /// The tags of its boundary.
    pub tags: Vec<FacetTag>,
    /// By point of the file, the vertex, if any cell names it.
    pub vertex_of_point: Vec<Option<VertexId>>,
    /// Lower and upper corner of the box around it, m.
    pub bounds: [[f64; D]; 2],
}

/// What a mesh was made of, in short.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(super) struct Fingerprint {
    points: usize,
    cells: usize,
    checksum: u64,
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} points and {} cells (checksum {:016x})", self.points, self.cells, self.checksum)
    }
}

/// A mesh in the plane or in space.
#[derive(Clone, Debug)]
pub(super) enum AnyGeometry {
    Plane(Arc<Geometry<2, 3>>),
    Space(Arc<Geometry<3, 4>>),
}

impl AnyGeometry {
    /// Makes or reads the mesh of a scene.
    ///
    /// # Errors
    /// [`RunError::Inconsistent`] names the scene or the mesh file, what was found and what was expected.
    pub fn of(scene: &Scene) -> Result<Self, RunError> {
        let Some(file) = &scene.mesh.file else { return Self::made(scene) };
        if scene.mesh.order != VertexOrder::Made {
            let reason = "mesh.order: found rcm beside mesh.file, expected made: vertices of a file keep their numbers";
            return Err(RunError::Inconsistent { source_name: scene.label.clone(), reason: reason.to_owned() });
        }
        let path = scene.folder.join(file);
        let refuse = |reason: String| RunError::Inconsistent { source_name: path.display().to_string(), reason };
        let data = read(&path).map_err(|error| {
            let (text, named) = (error.to_string(), format!("{}: ", path.display()));
            refuse(text.strip_prefix(&named).unwrap_or(&text).to_owned())
        })?;
        match (data.dimension, data.largest_simplex()) {
            (2, 3) => Geometry::new(scene, data, &path).map(|geometry| Self::Plane(Arc::new(geometry))),
            (3, 4) => Geometry::new(scene, data, &path).map(|geometry| Self::Space(Arc::new(geometry))),
            (d, n) => {
                let found = ["no cells", "points alone", "segments", "a surface"].get(n).unwrap_or(&"other cells");
                Err(refuse(format!("found {found} in {d} dimensions, expected triangles in the plane or tetrahedra")))
            }
        }
    }

    fn made(scene: &Scene) -> Result<Self, RunError> {
        let refuse = |reason: String| RunError::Inconsistent { source_name: scene.label.clone(), reason };
        match scene.mesh.size.len() {
            2 => Ok(Self::Plane(Arc::new(boxed(scene).map_err(refuse)?))),
            _ => Ok(Self::Space(Arc::new(boxed(scene).map_err(refuse)?))),
        }
    }
}

/// A box of Kuhn simplices.
fn boxed<const D: usize, const N: usize>(scene: &Scene) -> Result<Geometry<D, N>, String> {
    let MeshStage { size, origin, cells, .. } = &scene.mesh;
    let size: [f64; D] = fixed("mesh.size", size)?;
    let cells: [f64; D] = fixed("mesh.cells", cells)?;
    let origin = if origin.is_empty() { [0.0; D] } else { fixed("mesh.origin", origin)? };
    if let Some(side) = size.iter().find(|side| **side <= 0.0) {
        return Err(format!("mesh.size: found {side}, expected sides above 0 m"));
    }
    if let Some(parts) = cells.iter().find(|parts| !(**parts >= 1.0 && parts.fract() == 0.0)) {
        return Err(format!("mesh.cells: found {parts}, expected whole numbers of at least 1"));
    }
    let simplices = cells.iter().product::<f64>() * if D == 2 { 2.0 } else { 6.0 };
    if simplices > MOST_CELLS {
        return Err(format!("mesh.cells: found {simplices:e} simplices, expected at most {MOST_CELLS:e}"));
    }
    let upper = std::array::from_fn(|k| origin[k] + size[k]);
    let mesh: SimplexMesh<D, N> =
        kuhn_box(origin, upper, cells.map(|n| n as usize)).map_err(|e| format!("mesh: {e}"))?;
    let mesh = scene.mesh.order.of(mesh)?;
    let (data, _) = export(&mesh).ok_or("mesh: found a dimension that files do not have")?;
    Geometry::of_data(scene, data)
}

/// The numbers of a key as a vector of this dimension.
pub(super) fn fixed<const D: usize>(key: &str, numbers: &[f64]) -> Result<[f64; D], String> {
    numbers.try_into().map_err(|_| {
        let n = numbers.len();
        format!("{key}: found {n} number{}, expected {D}: the mesh has {D} dimensions", if n == 1 { "" } else { "s" })
    })
}

impl<const D: usize, const N: usize> Geometry<D, N> {
    fn new(scene: &Scene, mut data: MeshData, path: &Path) -> Result<Self, RunError> {
        if scene.mesh.repair {
            data = repaired::<D, N>(data);
        }
        Self::of_data(scene, data)
            .map_err(|reason| RunError::Inconsistent { source_name: path.display().to_string(), reason })
    }

    fn of_data(scene: &Scene, mut data: MeshData) -> Result<Self, String> {
        let file = data.clone();
        assign_regions::<D, N>(&scene.regions, &mut data)?;
        let imported = Imported::<D, N>::new(&data).map_err(|e| e.to_string())?;
        let mut vertex_of_point = vec![None; data.points.len()];
        for (vertex, &point) in imported.point_of_vertex.iter().enumerate() {
            vertex_of_point[point as usize] = Some(VertexId::new(vertex));
        }
        let mut bounds = [[f64::INFINITY; D], [f64::NEG_INFINITY; D]];
        for x in imported.mesh.points() {
            for k in 0..D {
                bounds[0][k] = bounds[0][k].min(x[k]);
                bounds[1][k] = bounds[1][k].max(x[k]);
            }
        }
        Ok(Self { mesh: imported.mesh, data: file, tags: imported.tags, vertex_of_point, bounds })
    }

    /// What the mesh was made of, in short: another file has another one.
    pub fn fingerprint(&self) -> Fingerprint {
        let coordinates = self.data.points.iter().flatten().flat_map(|x| x.to_bits().to_le_bytes());
        let mut cells = 0;
        let mut checksum = Checksum::default().and(coordinates);
        for block in &self.data.blocks {
            cells += if block.vertices_per_cell == N { block.regions.len() } else { 0 };
            let numbers = block.vertices.iter().flat_map(|v| v.to_le_bytes());
            checksum = checksum.and([block.vertices_per_cell as u8]).and(numbers);
            checksum = checksum.and(block.regions.iter().flat_map(|region| region.to_le_bytes()));
        }
        for named in &self.data.region_names {
            checksum = checksum.and(named.region.to_le_bytes()).and(named.name.bytes());
        }
        Fingerprint { points: self.data.points.len(), cells, checksum: checksum.value() }
    }

    /// Bytes that all of it takes, spare room included.
    pub fn memory_bytes(&self) -> usize {
        let blocks: usize = self.data.blocks.iter().map(|b| 4 * (b.vertices.capacity() + b.regions.capacity())).sum();
        self.mesh.bytes()
            + self.data.points.capacity() * size_of::<[f64; 3]>()
            + blocks
            + self.tags.capacity() * size_of::<FacetTag>()
            + self.vertex_of_point.capacity() * size_of::<Option<VertexId>>()
    }

    /// The largest extent, m.
    pub fn size(&self) -> f64 {
        (0..D).map(|k| self.bounds[1][k] - self.bounds[0][k]).fold(0.0, f64::max)
    }

    /// The middle of the box around it, m.
    pub fn centre(&self) -> [f64; D] {
        std::array::from_fn(|k| 0.5 * (self.bounds[0][k] + self.bounds[1][k]))
    }

    /// `from (0, 0) to (0.1, 0.1) m`
    pub fn extent(&self) -> String {
        let corner = |x: &[f64; D]| x.map(|x| x.to_string()).join(", ");
        format!("from ({}) to ({}) m", corner(&self.bounds[0]), corner(&self.bounds[1]))
    }
}

/// Puts right what has one remedy: duplicate cells and the like go.
fn repaired<const D: usize, const N: usize>(data: MeshData) -> MeshData {
    let (cells, regions) = data.simplices::<N>();
    let repaired = repair::<D, N>(&data.coordinates(), &cells, &RepairSettings::default());
    let moved = |v: &u32| repaired.new_vertex.get(*v as usize).copied().flatten();
    let mut mended =
        MeshData { dimension: data.dimension, region_names: data.region_names.clone(), ..MeshData::default() };
    let pad = |x: &[f64; D]| std::array::from_fn(|k| if k < D { x[k] } else { 0.0 });
    mended.points = repaired.points.iter().map(pad).collect();
    for (cell, region) in repaired.cells.iter().zip(repaired.of_cells(&regions)) {
        mended.push_cell(cell, region);
    }
    for block in data.blocks.iter().filter(|block| block.vertices_per_cell < N) {
        for (cell, &region) in block.vertices.chunks_exact(block.vertices_per_cell).zip(&block.regions) {
            let cell: Option<Vec<u32>> = cell.iter().map(moved).collect();
            cell.into_iter().for_each(|cell| mended.push_cell(&cell, region));
        }
    }
    mended
}

/// Gives each cell the number of the last `[[region]]` that picks it, or 0.
fn assign_regions<const D: usize, const N: usize>(rows: &[Row], data: &mut MeshData) -> Result<(), String> {
    let points: Vec<[f64; D]> = data.coordinates();
    let mut picks = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let key = format!("region (row {})", index + 1);
        picks.push((key.clone(), Place::<D>::of(row, &key, data, N)?, 0_usize));
    }
    for block in data.blocks.iter_mut().filter(|block| block.vertices_per_cell == N) {
        let CellBlock { vertices, regions, .. } = block;
        for (cell, region) in vertices.chunks_exact(N).zip(regions) {
            let tag = std::mem::take(region);
            let mut centre = [0.0; D];
            for x in cell.iter().filter_map(|&v| points.get(v as usize)) {
                (0..D).for_each(|k| centre[k] += x[k] / N as f64);
            }
            for (index, (_, place, count)) in picks.iter_mut().enumerate() {
                if place.holds(tag, &centre) {
                    *region = index as i32 + 1;
                    *count += 1;
                }
            }
        }
    }
    match picks.iter().find(|(.., count)| *count == 0) {
        Some((key, ..)) => Err(format!("{key}: found no cell in its place, expected at least one")),
        None => Ok(()),
    }
}

/// Where the cells of a region are.
enum Place<const D: usize> {
    Tag(i32),
    Box([[f64; D]; 2]),
}

impl<const D: usize> Place<D> {
    fn of(row: &Row, key: &str, data: &MeshData, n: usize) -> Result<Self, String> {
        if let Some(tag) = row.value("tag") {
            return Ok(Self::Tag(tag.int()? as i32));
        }
        if let Some(corners) = row.value("box") {
            return Ok(Self::Box(corners_of(&format!("{key}: box"), corners.floats()?)?));
        }
        let column = if row.value("group").is_some() { "group" } else { "name" };
        let name = row.value(column).map_or(Ok(""), |value| value.text())?;
        let named = |region: &&stylet_mesh::io::RegionName| region.vertices_per_cell == n && region.name == name;
        if let Some(region) = data.region_names.iter().find(named) {
            return Ok(Self::Tag(region.region));
        }
        let known: Vec<&str> =
            data.region_names.iter().filter(|r| r.vertices_per_cell == n).map(|r| r.name.as_str()).collect();
        let expected = match known.is_empty() {
            true => "a tag, a box, or a mesh file with named cells".to_owned(),
            false => format!(
                "one of {}; nearest is {}",
                known.join(", "),
                stylet_scene::nearest(name, known.iter().copied())
            ),
        };
        Err(format!("{key}: {column}: found {name}, expected {expected}"))
    }

    fn holds(&self, tag: i32, centre: &[f64; D]) -> bool {
        match self {
            Self::Tag(wanted) => tag == *wanted,
            Self::Box(corners) => within(corners, centre, 0.0),
        }
    }
}

/// The two corners of a box from its numbers.
pub(super) fn corners_of<const D: usize>(key: &str, numbers: &[f64]) -> Result<[[f64; D]; 2], String> {
    if numbers.len() != 2 * D {
        let n = numbers.len();
        return Err(format!("{key}: found {n} numbers, expected {}: two corners of {D} coordinates", 2 * D));
    }
    let corners = [0, D].map(|at| std::array::from_fn(|k| numbers[at + k]));
    let [low, high]: [[f64; D]; 2] = corners;
    match (0..D).find(|&k| low[k] > high[k]) {
        Some(k) => {
            Err(format!("{key}: found {} to {} along axis {}, expected ascending corners", low[k], high[k], k + 1))
        }
        None => Ok(corners),
    }
}

/// Whether a point lies in a box, its surface included.
pub(super) fn within<const D: usize>(corners: &[[f64; D]; 2], x: &[f64; D], slack: f64) -> bool {
    (0..D).all(|k| (corners[0][k] - slack..=corners[1][k] + slack).contains(&x[k]))
}
