//! The start mesh: user input, checked at the door.

use crate::{
    MeshError, Rule, SimplexMesh, colouring, geometry, longest_edge, manifold,
    node::{MAX_REGIONS, MAX_SLOTS, NONE, Node, link},
};

/// The relative volume below which a cell counts as flat. Real meshers stay above 1e-6, and rounding of coordinates
/// disturbs the relative volume by some 1e-16 times the distance from the origin over the edge length.
pub(crate) const FLAT: f64 = 1e-10;

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// A mesh from any conforming set of simplices, all in region 0; see [`with_regions`](Self::with_regions).
    ///
    /// # Errors
    /// As [`with_regions`](Self::with_regions).
    pub fn new(points: Vec<[f64; D]>, cells: Vec<[u32; N]>) -> Result<Self, MeshError> {
        let regions = vec![0; cells.len()];
        Self::with_regions(points, cells, regions)
    }

    /// A mesh from any conforming set of simplices: `points` by vertex id, `cells` as vertex ids in any order and
    /// orientation, one region per cell. Start cell `i` becomes `CellId(i)`.
    ///
    /// The order of a cell's vertices and the choice of its first edges follow from the geometry alone, so no
    /// preparation of the input (colouring, compatible refinement edges) is needed.
    ///
    /// # Errors
    /// A [`MeshError`] that names the offenders: coordinates that are not finite or too large, indices out of range,
    /// repeated vertices, flat cells, duplicate cells, facets of more than two cells or with both on one side, cells
    /// that are joined by a vertex or an edge alone, unused vertices. Cells that overlap elsewhere, and vertices that
    /// hang on the facet of another cell, are not searched for: such a facet counts as boundary.
    pub fn with_regions(points: Vec<[f64; D]>, cells: Vec<[u32; N]>, regions: Vec<u32>) -> Result<Self, MeshError> {
        Self::with_rule(points, cells, regions, Rule::default())
    }

    /// As [`with_regions`](Self::with_regions), with a choice of the rule by which cells come to their refinement edges.
    ///
    /// # Errors
    /// As [`with_regions`](Self::with_regions).
    pub fn with_rule(
        points: Vec<[f64; D]>,
        cells: Vec<[u32; N]>,
        regions: Vec<u32>,
        rule: Rule,
    ) -> Result<Self, MeshError> {
        let mesh = Self::assemble(points, cells, regions, rule)?;
        manifold::check_stars(&mesh)?;
        Ok(mesh)
    }

    /// As [`with_regions`](Self::with_regions), for cells whose stars are known to be joined by facets.
    pub(crate) fn assemble(
        points: Vec<[f64; D]>,
        cells: Vec<[u32; N]>,
        regions: Vec<u32>,
        rule: Rule,
    ) -> Result<Self, MeshError> {
        let () = Self::VALID;
        check_counts(&points, &cells, &regions)?;
        check_coordinates(&points)?;
        let mut mesh = Self::with_points(points);
        mesh.regions = region_table(&regions)?;
        for (cell, (v, region)) in cells.into_iter().zip(regions).enumerate() {
            mesh.push_macro(cell, v, region)?;
        }
        (mesh.n_macros, mesh.n_live) = (mesh.nodes.len(), mesh.nodes.len());
        if let Some(vertex) = mesh.vertex_leaf.iter().position(|&leaf| leaf == NONE) {
            return Err(MeshError::Unreferenced { vertex });
        }
        mesh.rule = rule;
        match rule {
            Rule::LongestEdge => mesh.nodes.iter_mut().for_each(|node| {
                longest_edge::arrange(&mesh.points, node);
            }),
            Rule::Colouring => colouring::order_by_colour(mesh.points.len(), &mut mesh.nodes),
        }
        mesh.link_macros()?;
        Ok(mesh)
    }

    /// Appends a start cell after checking its vertices and its shape.
    fn push_macro(&mut self, cell: usize, v: [u32; N], region: u32) -> Result<(), MeshError> {
        for (i, &vertex) in v.iter().enumerate() {
            if vertex as usize >= self.points.len() {
                return Err(MeshError::Index { cell, vertex, n_vertices: self.points.len() });
            }
            if v[..i].contains(&vertex) {
                return Err(MeshError::RepeatedVertex { cell, vertex });
            }
        }
        let corners = self.corners_of(&v);
        let relative_volume = geometry::relative_measure(&corners);
        let longest_edge = geometry::longest_edge2(&corners).sqrt();
        if relative_volume.abs() < FLAT || longest_edge < 1.0 / coordinate_limit::<D>() {
            return Err(MeshError::Flat { cell, relative_volume, longest_edge, limit: FLAT });
        }
        let region = self.regions.binary_search(&region).unwrap_or_default() as u32;
        // Of a surface or a rod the given order is the reference, and Gram-Schmidt never yields a negative.
        let node = Node::root(v, region, relative_volume < 0.0);
        for &vertex in &v {
            self.vertex_leaf[vertex as usize] = cell as u32;
        }
        self.nodes.push(node);
        Ok(())
    }

    /// Finds the neighbours of the start cells.
    fn link_macros(&mut self) -> Result<(), MeshError> {
        let facets = manifold::facets(self.nodes.iter().enumerate().map(|(slot, node)| (slot as u32, node.v)));
        for group in facets.chunk_by(|f, g| f.vertices == g.vertices) {
            let [f, g] = match group {
                [_] => continue,
                [f, g] => [f, g],
                // Facets of two cells with the same vertices come in twos as well, so duplicates are told apart here.
                more => {
                    self.check_distinct(&[more[0].cell, more[1].cell, more[2].cell])?;
                    let cells = [more[0].cell as usize, more[1].cell as usize, more[2].cell as usize];
                    return Err(MeshError::SharedFacet { cells });
                }
            };
            self.check_distinct(&[f.cell, g.cell])?;
            let ((p, i), (q, j)) = ((f.cell as usize, f.local as usize), (g.cell as usize, g.local as usize));
            if N == D + 1 && !self.on_opposite_sides((p, i), (q, j)) {
                return Err(MeshError::Overlap { cells: [p, q] });
            }
            self.nodes[p].links[i] = link(g.cell, j);
            self.nodes[q].links[j] = link(f.cell, i);
        }
        Ok(())
    }

    /// Refuses cells with the same vertices.
    fn check_distinct(&self, cells: &[u32]) -> Result<(), MeshError> {
        let sorted = |cell: u32| {
            let mut v = self.nodes[cell as usize].v;
            v.sort_unstable();
            v
        };
        for (i, &second) in cells.iter().enumerate() {
            for &first in &cells[..i] {
                if sorted(first) == sorted(second) {
                    return Err(MeshError::DuplicateCell { first: first as usize, second: second as usize });
                }
            }
        }
        Ok(())
    }

    /// Whether the vertices opposite the common facet of two cells are on its two sides.
    fn on_opposite_sides(&self, (p, i): (usize, usize), (q, j): (usize, usize)) -> bool {
        // Put the vertex that q has beyond the facet into p's order: the sign must turn over.
        let mut v = self.nodes[p].v;
        v[i] = self.nodes[q].v[j];
        let reflected = geometry::relative_measure(&self.corners_of(&v));
        (reflected < 0.0) != self.nodes[p].is_negative()
    }
}

/// The different regions, ascending.
fn region_table(regions: &[u32]) -> Result<Vec<u32>, MeshError> {
    let mut table = regions.to_vec();
    table.sort_unstable();
    table.dedup();
    table.shrink_to_fit();
    let (count, limit) = (table.len(), MAX_REGIONS);
    if count > limit { Err(MeshError::TooManyRegions { count, limit }) } else { Ok(table) }
}

fn check_counts<const D: usize, const N: usize>(
    points: &[[f64; D]],
    cells: &[[u32; N]],
    regions: &[u32],
) -> Result<(), MeshError> {
    if cells.is_empty() {
        return Err(MeshError::NoCells);
    }
    let count = cells.len().max(points.len());
    if count > MAX_SLOTS {
        return Err(MeshError::TooManyCells { count, limit: MAX_SLOTS });
    }
    if regions.len() != cells.len() {
        return Err(MeshError::Regions { expected: cells.len(), found: regions.len() });
    }
    Ok(())
}

/// The largest coordinate whose power `D` does not overflow: 1e150, 1e100, 1e75 for two, three, four dimensions.
pub(crate) fn coordinate_limit<const D: usize>() -> f64 {
    // A squared length must not overflow either.
    10_f64.powi(300 / (D.max(2) as i32))
}

pub(crate) fn check_coordinates<const D: usize>(points: &[[f64; D]]) -> Result<(), MeshError> {
    let limit = coordinate_limit::<D>();
    for (vertex, point) in points.iter().enumerate() {
        for (axis, &value) in point.iter().enumerate() {
            if value.is_nan() || value.abs() > limit {
                return Err(MeshError::Coordinate { vertex, axis, value, limit });
            }
        }
    }
    Ok(())
}
