//! Between a mesh as files hold it and a mesh that can be bisected.
//!
//! [`Imported::new`] takes the cells of one size of a [`MeshData`] with their regions, and the tags of its boundary from
//! the cells of one vertex less; [`export`] makes a [`MeshData`] of the live cells and of the boundary facets with tags.

use crate::check::{CheckSettings, Finding, check};
use crate::io::{CellBlock, MeshData};
use crate::manifold::facets;
use crate::{CellId, MeshError, Rule, SimplexMesh, VertexId};

/// Why the cells of a file do not make a mesh.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// There are no cells of the size asked for.
    #[error("found no cells with {wanted} vertices, expected some")]
    NoCells {
        /// Vertices per cell asked for.
        wanted: usize,
    },
    /// A mesh cannot have this fault.
    #[error("{finding}{}", more(.n_more))]
    Refused {
        /// The first fault, by positions in the file: of points, and of cells among those of one size.
        finding: Finding,
        /// How many more there are.
        n_more: usize,
    },
}

fn more(n: &usize) -> String {
    match n {
        0 => String::new(),
        1 => " (and 1 more fault)".to_owned(),
        n => format!(" (and {n} more faults)"),
    }
}

/// A mesh made of a file, and how it relates to that.
#[derive(Clone, Debug)]
pub struct Imported<const D: usize, const N: usize> {
    /// The mesh. A region of a file, which may be negative, has the same 32 bits as the region of its cells here. Its
    /// boundary has the tags that are positive.
    pub mesh: SimplexMesh<D, N>,
    /// For each vertex its position among the points of the file. Points that no cell names have no vertex.
    pub point_of_vertex: Vec<u32>,
    /// Tags of the boundary, negative ones too, by cell and facet, ascending.
    pub tags: Vec<FacetTag>,
    /// What the file holds and the mesh does not, a line for each.
    pub left_out: Vec<String>,
}

/// The tag of a facet on the boundary.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct FacetTag {
    /// The cell.
    pub cell: CellId,
    /// Local index of the vertex opposite the facet.
    pub facet: usize,
    /// The tag, not 0.
    pub tag: i32,
}

impl<const D: usize, const N: usize> Imported<D, N> {
    /// Makes a mesh of the cells with `N` vertices. Cell `i` among them becomes start cell `i`.
    ///
    /// # Errors
    /// [`ImportError`], with the fault named by the positions in the file.
    pub fn new(data: &MeshData) -> Result<Self, ImportError> {
        Self::with_rule(data, Rule::default())
    }

    /// As [`new`](Self::new), with a choice of the rule by which cells come to their refinement edges.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_rule(data: &MeshData, rule: Rule) -> Result<Self, ImportError> {
        let (cells, regions) = data.simplices::<N>();
        if cells.is_empty() {
            return Err(ImportError::NoCells { wanted: N });
        }
        let given: Vec<[f64; D]> = data.coordinates();
        let (point_of_vertex, vertex_of_point) = used(given.len(), &cells);
        let points = point_of_vertex.iter().map(|&p| given[p as usize]).collect();
        let place = |p: u32| vertex_of_point.get(p as usize).copied().flatten().unwrap_or(u32::MAX);
        let named: Vec<[u32; N]> = cells.iter().map(|v| v.map(place)).collect();
        let regions = regions.iter().map(|&region| region.cast_unsigned()).collect();
        // Refused meshes are described anew in the file's own numbers.
        let mut mesh = SimplexMesh::with_rule(points, named, regions, rule)
            .map_err(|error| refuse(&given, &cells, &vertex_of_point, &error))?;

        let mut left_out = Vec::new();
        let unused = given.len() - point_of_vertex.len();
        note(&mut left_out, unused, "point that no cell names", "points that no cell names");
        let (tags, strays) = tags(&mesh, data, &vertex_of_point);
        note(
            &mut left_out,
            strays,
            "tagged cell that is no facet of the boundary",
            "tagged cells that are no facets of the boundary",
        );
        // Facets were looked up in the mesh itself, so that only the sign of a tag can be refused.
        let mut set =
            |t: &FacetTag| u32::try_from(t.tag).is_ok_and(|tag| mesh.set_boundary_tag(t.cell, t.facet, tag).is_ok());
        let kept = tags.iter().filter(|t| set(t)).count();
        note(&mut left_out, tags.len() - kept, "negative tag of the boundary", "negative tags of the boundary");
        let smaller = |n: usize| n != N && n + 1 != N;
        let others: usize = data.blocks.iter().filter(|b| smaller(b.vertices_per_cell)).map(CellBlock::n_cells).sum();
        note(&mut left_out, others, "cell of another size", "cells of other sizes");
        Ok(Self { mesh, point_of_vertex, tags, left_out })
    }
}

fn note(notes: &mut Vec<String>, count: usize, one: &str, many: &str) {
    match count {
        0 => {}
        1 => notes.push(format!("1 {one}")),
        n => notes.push(format!("{n} {many}")),
    }
}

/// The first fault for which a mesh is refused. Points that no cell names are left out, whatever they are.
fn refuse<const D: usize, const N: usize>(
    points: &[[f64; D]],
    cells: &[[u32; N]],
    vertex_of_point: &[Option<u32>],
    error: &MeshError,
) -> ImportError {
    let report = check(points, cells, &CheckSettings::default());
    let counts = |finding: &Finding| match *finding {
        Finding::Unused { .. } => false,
        Finding::Coordinate { vertex, .. } => vertex_of_point[vertex as usize].is_some(),
        _ => finding.is_fatal(),
    };
    let mut faults = report.findings.into_iter().filter(counts);
    match faults.next() {
        Some(finding) => ImportError::Refused { finding, n_more: faults.count() },
        // Only by number could arrays be refused for what is not found in them.
        None => ImportError::Refused { finding: Finding::Refused { reason: error.to_string() }, n_more: 0 },
    }
}

/// The points that cells name, ascending, and the places of all points among them.
fn used<const N: usize>(n_points: usize, cells: &[[u32; N]]) -> (Vec<u32>, Vec<Option<u32>>) {
    let mut vertex = vec![None; n_points];
    for &p in cells.iter().flatten() {
        if let Some(vertex) = vertex.get_mut(p as usize) {
            *vertex = Some(0);
        }
    }
    let mut points = Vec::new();
    for (p, vertex) in vertex.iter_mut().enumerate().filter(|(_, vertex)| vertex.is_some()) {
        *vertex = Some(points.len() as u32);
        points.push(p as u32);
    }
    (points, vertex)
}

/// The tags of boundary facets, from the regions of the cells with one vertex less, and how many of these are no such
/// facet.
fn tags<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    data: &MeshData,
    vertex_of_point: &[Option<u32>],
) -> (Vec<FacetTag>, usize) {
    let boundary = facets(mesh.cells().map(|c| (c.0, mesh.cell(c).map(|v| v.0))));
    let boundary: Vec<_> =
        boundary.chunk_by(|f, g| f.vertices == g.vertices).filter(|g| g.len() == 1).map(|g| g[0]).collect();
    let (mut tags, mut strays) = (Vec::new(), 0);
    for block in data.blocks.iter().filter(|block| block.vertices_per_cell + 1 == N) {
        for (cell, &tag) in block.vertices.chunks_exact(N - 1).zip(&block.regions).filter(|(_, tag)| **tag != 0) {
            let mut key = [u32::MAX; N];
            let vertex = |p: u32| vertex_of_point.get(p as usize).copied().flatten().unwrap_or(u32::MAX);
            key.iter_mut().zip(cell).for_each(|(slot, &p)| *slot = vertex(p));
            key.sort_unstable();
            match boundary.binary_search_by_key(&key, |facet| facet.vertices) {
                Ok(at) => {
                    let facet = boundary[at];
                    tags.push(FacetTag { cell: CellId(facet.cell), facet: facet.local.into(), tag });
                }
                Err(_) => strays += 1,
            }
        }
    }
    tags.sort_unstable();
    tags.dedup_by_key(|t| (t.cell, t.facet));
    (tags, strays)
}

/// The live cells as files hold them, in positive orientation, then the boundary facets that have a tag, wound outwards,
/// with the tag as region; with their vertices numbered afresh, and the vertices in that order. `None` in more than three
/// dimensions.
pub fn export<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Option<(MeshData, Vec<VertexId>)> {
    if D > 3 {
        return None;
    }
    let cells: Vec<[u32; N]> = mesh.cells().map(|c| mesh.oriented(c).map(|v| v.0)).collect();
    let slots = cells.iter().flatten().max().map_or(0, |&v| v as usize + 1);
    let (vertices, place) = used(slots, &cells);
    let point = |v: &u32| {
        let p = mesh.point(VertexId(*v));
        std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0))
    };
    let block = CellBlock {
        vertices_per_cell: N,
        vertices: cells.iter().flatten().filter_map(|&v| place[v as usize]).collect(),
        regions: mesh.cells().map(|c| mesh.region(c).cast_signed()).collect(),
    };
    let points = vertices.iter().map(point).collect();
    let mut data = MeshData { dimension: D.max(2), points, blocks: vec![block], ..MeshData::default() };
    for (cell, facet, tag) in tagged_facets(mesh) {
        let oriented = mesh.oriented(cell);
        let opposite = mesh.cell(cell)[facet];
        let local = oriented.iter().position(|&v| v == opposite).unwrap_or(facet);
        let corners = oriented.iter().filter(|&&v| v != opposite);
        let mut corners: Vec<u32> = corners.filter_map(|v| place[v.index()]).collect();
        // The boundary of a simplex is the alternating sum of its facets.
        if local % 2 == 1 && corners.len() > 1 {
            corners.swap(0, 1);
        }
        data.push_cell(&corners, tag.cast_signed());
    }
    Some((data, vertices.into_iter().map(VertexId).collect()))
}

/// The boundary facets that have a tag, as cell, local index of the vertex opposite, and tag; in the order in which
/// [`export`] writes them.
pub fn tagged_facets<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
) -> impl Iterator<Item = (CellId, usize, u32)> + '_ {
    let facets = mesh.boundary_facets().map(|(cell, facet)| (cell, facet, mesh.boundary_tag(cell, facet).unwrap_or(0)));
    facets.filter(|&(_, _, tag)| tag != 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MeshChange;
    use crate::generate::kuhn_box;

    /// A unit square of two triangles between points that nobody names, with tagged sides.
    fn square() -> MeshData {
        let block = |n, vertices: &[u32], regions: &[i32]| CellBlock {
            vertices_per_cell: n,
            vertices: vertices.to_vec(),
            regions: regions.to_vec(),
        };
        MeshData {
            dimension: 2,
            points: [[9.0, 9.0], [0.0, 0.0], [1.0, 0.0], [f64::NAN, 0.0], [0.0, 1.0], [1.0, 1.0]]
                .map(|[x, y]| [x, y, 0.0])
                .to_vec(),
            blocks: vec![
                block(2, &[2, 1, 2, 4, 4, 5, 1, 4], &[7, 8, -1, 0]),
                block(3, &[1, 2, 4], &[-3]),
                block(1, &[0], &[5]),
                block(3, &[2, 5, 4], &[4]),
            ],
            ..MeshData::default()
        }
    }

    #[test]
    fn cells_regions_and_tags_arrive() {
        let imported = Imported::<2, 3>::new(&square()).unwrap();
        assert_eq!(imported.point_of_vertex, [1, 2, 4, 5]);
        assert_eq!(imported.mesh.region(CellId(0)).cast_signed(), -3);
        assert_eq!(imported.mesh.region(CellId(1)), 4);
        let sides: Vec<(i32, Vec<u32>)> = imported
            .tags
            .iter()
            .map(|t| {
                let v = imported.mesh.cell(t.cell);
                let mut side: Vec<u32> = (0..3).filter(|&i| i != t.facet).map(|i| v[i].0).collect();
                side.sort_unstable();
                (t.tag, side)
            })
            .collect();
        assert!(sides.contains(&(7, vec![0, 1])) && sides.contains(&(-1, vec![2, 3])) && sides.len() == 2);
        assert_eq!(
            imported.left_out,
            [
                "2 points that no cell names",
                "1 tagged cell that is no facet of the boundary",
                "1 negative tag of the boundary",
                "1 cell of another size"
            ]
        );
    }

    #[test]
    fn tags_of_the_boundary_are_set_inherited_and_written_outwards() {
        let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [2; 3]).unwrap();
        let (mut data, _) = export(&start).unwrap();
        let top: Vec<(CellId, usize)> = start
            .boundary_facets()
            .filter(|&(c, facet)| (0..4).all(|i| i == facet || start.point(start.cell(c)[i])[2] == 1.0))
            .collect();
        for &(c, facet) in &top {
            let corners: Vec<u32> = (0..4).filter(|&i| i != facet).map(|i| start.cell(c)[i].0).collect();
            data.push_cell(&corners, 42);
        }
        let mut imported = Imported::<3, 4>::new(&data).unwrap();
        assert_eq!((imported.tags.len(), imported.left_out.len()), (8, 0));
        imported.mesh.refine_everywhere(0.5, &mut MeshChange::default()).unwrap();
        let (fine, _) = export(&imported.mesh).unwrap();
        let (facets, tags) = fine.simplices::<3>();
        assert!(facets.len() > 8 && tags.iter().all(|&tag| tag == 42));
        let area: f64 = facets
            .iter()
            .map(|v| v.map(|v| fine.points[v as usize]))
            .map(|[a, b, c]| {
                assert_eq!([a[2], b[2], c[2]], [1.0; 3]);
                0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
            })
            .sum();
        assert!((area - 1.0).abs() < 1e-12, "seen from above they run counterclockwise: {area}");
        assert_eq!(Imported::<3, 4>::new(&fine).unwrap().tags.len(), facets.len());
    }

    #[test]
    fn faults_are_named_in_the_numbers_of_the_file() {
        let mut data = square();
        data.points[5] = [0.5, 0.5, 0.0];
        let line = Imported::<2, 3>::new(&data).unwrap_err().to_string();
        assert!(line.starts_with("cell 1: is flat"), "{line}");
        let mut data = square();
        data.points[5][1] = f64::INFINITY;
        let line = Imported::<2, 3>::new(&data).unwrap_err().to_string();
        assert!(line.starts_with("vertex 5: coordinate 1 is inf") && !line.contains("more fault"), "{line}");
        let mut data = square();
        data.blocks[1].vertices = vec![77, 2, 2];
        let line = Imported::<2, 3>::new(&data).unwrap_err().to_string();
        assert!(line == "cell 0: names vertex 77, but there are 6 (and 1 more fault)", "{line}");
        assert_eq!(Imported::<3, 4>::new(&data).unwrap_err(), ImportError::NoCells { wanted: 4 });
    }

    #[test]
    fn what_is_exported_is_imported_again() {
        let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [1; 3]).unwrap();
        mesh.refine_around([0.3, 0.2, 0.1], 0.2, &mut MeshChange::default()).unwrap();
        let (data, vertices) = export(&mesh).unwrap();
        assert_eq!(vertices.len(), mesh.n_vertices());
        let back = Imported::<3, 4>::new(&data).unwrap();
        assert!(back.left_out.is_empty() && back.tags.is_empty());
        let shape = |mesh: &SimplexMesh<3, 4>| -> Vec<[[f64; 3]; 4]> {
            mesh.cells()
                .map(|c| mesh.oriented(c).map(|v| mesh.point(v)))
                .map(|mut corners| {
                    corners.sort_by(|p, q| p.partial_cmp(q).unwrap());
                    corners
                })
                .collect()
        };
        assert_eq!(shape(&back.mesh), shape(&mesh));
        assert!(export(&kuhn_box::<4, 5>([0.0; 4], [1.0; 4], [1; 4]).unwrap()).is_none());
    }
}
