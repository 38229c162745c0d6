//! What must hold of every mesh, checked from scratch.

use crate::{
    InvariantError as Error, SimplexMesh,
    complex::{NONE, Node, link, unlink},
    geometry, longest_edge, manifold,
};

/// Volumes of the start mesh and of the leaves agree to this part.
const VOLUME: f64 = 1e-12;
/// Boundaries may consist of many small facets that nearly cancel in no way: sums are accurate, areas to rounding.
const BOUNDARY: f64 = 1e-9;

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// Checks that every index is in range, that the forest is what bisection makes, that neighbours agree with each
    /// other, that orientations are as stored, and that the live cells fill the start mesh without gaps, overlaps or
    /// hanging vertices. Costs a sort of all facets; meant for tests and for data from outside.
    ///
    /// # Errors
    /// The first [`InvariantError`](crate::InvariantError) found.
    pub fn check_invariants(&self) -> Result<(), Error> {
        self.check_ranges()?;
        self.check_vertices()?;
        self.check_forest()?;
        self.check_links()?;
        self.check_orientations()?;
        self.check_measures()
    }

    fn check_ranges(&self) -> Result<(), Error> {
        let (n_vertices, n_slots) = (self.points.len(), self.nodes.len());
        let reference = if self.reference.is_empty() { n_vertices } else { self.reference.len() };
        let vertex_arrays = [self.parents.len(), self.generations.len(), self.vertex_leaf.len(), reference];
        if vertex_arrays != [n_vertices; 4] || self.links.len() != n_slots || self.n_macros > n_slots {
            return Err(Error::Range { cell: NONE, what: "the length of an array" });
        }
        let inside = |index: u32, n: usize| (index as usize) < n;
        for (slot, node) in self.nodes.iter().enumerate() {
            let links_inside = self.links[slot].iter().all(|&link| {
                let (neighbor, facet) = unlink(link);
                link == NONE || neighbor < n_slots && facet < N
            });
            let what = [
                (node.v.iter().all(|&v| inside(v, n_vertices)), "a vertex"),
                (node.parent == NONE || inside(node.parent, slot), "the parent"),
                (node.child == NONE || node.child as usize > slot && inside(node.child, n_slots - 1), "a child"),
                ((1..N).contains(&(node.tag as usize)), "the tag"),
                (links_inside, "a neighbour"),
                (!node.visited, "a scratch mark"),
            ];
            if let Some((_, what)) = what.into_iter().find(|(holds, _)| !holds) {
                return Err(Error::Range { cell: slot as u32, what });
            }
        }
        Ok(())
    }

    fn check_vertices(&self) -> Result<(), Error> {
        for v in 0..self.points.len() {
            let [a, b] = self.parents[v].map(|p| p as usize);
            let vertex = v as u32;
            if (a, b) != (v, v) && (a >= v || b >= v) {
                return Err(Error::Vertex { vertex, what: "a parent is not older" });
            }
            if (a, b) != (v, v) && self.generations[v] <= self.generations[a].max(self.generations[b]) {
                return Err(Error::Vertex { vertex, what: "a parent is not of an older generation" });
            }
            let leaf = self.nodes.get(self.vertex_leaf[v] as usize);
            if leaf.is_none_or(|node| node.child != NONE || !node.v.contains(&vertex)) {
                return Err(Error::Vertex { vertex, what: "its stored cell is not a live cell around it" });
            }
        }
        Ok(())
    }

    /// Makes the children of every bisected node anew and compares.
    fn check_forest(&self) -> Result<(), Error> {
        let wrong = |cell: usize, what| Err(Error::Tree { cell: cell as u32, what });
        for (slot, node) in self.nodes.iter().enumerate() {
            if (node.parent == NONE) != (slot < self.n_macros) {
                return wrong(slot, "a start cell has a parent, or another none");
            }
            if node.child == NONE {
                continue;
            }
            let child = node.child as usize;
            // The midpoint is the one vertex that the parent lacks.
            let midpoint = self.nodes[child].v.into_iter().find(|v| !node.v.contains(v)).unwrap_or(NONE);
            let mut ends = self.parents.get(midpoint as usize).copied().unwrap_or([NONE; 2]);
            ends.sort_unstable();
            if ends != node.edge() {
                return wrong(child, "its newest vertex does not halve the refinement edge");
            }
            for (second, mut made) in node.children(slot as u32, midpoint).into_iter().enumerate() {
                longest_edge::arrange(self.reference_points(), &mut made, &mut [NONE; N]);
                let found = self.nodes[child + second];
                if (Node { child: found.child, ..made }) != found {
                    return wrong(child + second, "vertices, tag, level, region or orientation");
                }
            }
        }
        if self.nodes.iter().filter(|node| node.child == NONE).count() != self.n_live {
            return wrong(self.n_macros, "the number of live cells");
        }
        Ok(())
    }

    /// Compares the links with a search for common facets.
    fn check_links(&self) -> Result<(), Error> {
        let mut expected = vec![[NONE; N]; self.nodes.len()];
        let facets = manifold::facets(self.leaves());
        for group in facets.chunk_by(|f, g| f.vertices == g.vertices) {
            match group {
                [_] => {}
                [f, g] => {
                    expected[f.cell as usize][f.local as usize] = link(g.cell, g.local as usize);
                    expected[g.cell as usize][g.local as usize] = link(f.cell, f.local as usize);
                }
                more => return Err(Error::Neighbor { cell: more[0].cell, facet: more[0].local as usize }),
            }
        }
        for (slot, (found, expected)) in self.links.iter().zip(&expected).enumerate() {
            if let Some(facet) = (0..N).find(|&facet| found[facet] != expected[facet]) {
                return Err(Error::Neighbor { cell: slot as u32, facet });
            }
        }
        Ok(())
    }

    pub(crate) fn check_orientations(&self) -> Result<(), Error> {
        if N < D + 1 {
            return Ok(()); // without a normal there is no sign to compare with; the forest check covers parities
        }
        for cell in self.cells() {
            let volume = geometry::signed_measure(&self.corners(cell));
            // A product with NaN is not positive.
            let agrees = volume * f64::from(self.orientation(cell)) > 0.0;
            if !agrees {
                return Err(Error::Orientation { cell: cell.0, volume });
            }
        }
        Ok(())
    }

    /// Cells with the right sum of volumes that are joined facet to facet leave neither gaps nor overlaps, unless facets
    /// inside, at hanging vertices, have no neighbour; these would add to the boundary. Measured at reference positions: a
    /// vertex of the boundary may have been moved, which is no defect.
    fn check_measures(&self) -> Result<(), Error> {
        let macros = || self.nodes[..self.n_macros].iter().enumerate().map(|(slot, node)| (slot as u32, node.v));
        let volume = |v: [u32; N]| geometry::signed_measure(&self.reference_corners(&v)).abs();
        let total = |cells: &mut dyn Iterator<Item = (u32, [u32; N])>| cells.map(|(_, v)| volume(v)).sum();
        compare("volume", total(&mut macros()), total(&mut self.leaves()), VOLUME)?;
        compare("boundary", self.boundary(macros()), self.boundary(self.leaves()), BOUNDARY)
    }

    /// The measure of the facets that belong to one cell only, of some cells.
    fn boundary(&self, cells: impl Iterator<Item = (u32, [u32; N])>) -> f64 {
        let facets = manifold::facets(cells);
        let groups = facets.chunk_by(|f, g| f.vertices == g.vertices);
        let single = groups.filter(|group| group.len() == 1).map(|group| group[0]);
        single
            .map(|f| {
                let corners = self.reference_corners(&self.nodes[f.cell as usize].v);
                geometry::facet_measure(&corners, f.local as usize)
            })
            .sum()
    }

    fn leaves(&self) -> impl Iterator<Item = (u32, [u32; N])> + '_ {
        self.cells().map(|c| (c.0, self.nodes[c.index()].v))
    }
}

fn compare(what: &'static str, expected: f64, found: f64, tolerance: f64) -> Result<(), Error> {
    let agrees = (expected - found).abs() <= tolerance * expected;
    if agrees { Ok(()) } else { Err(Error::Measure { what, expected, found }) }
}

#[cfg(test)]
mod tests {
    use crate::{InvariantError as Error, MeshChange, SimplexMesh, VertexId, generate::kuhn_box};

    fn refined() -> SimplexMesh<3, 4> {
        let mut mesh = kuhn_box([0.0; 3], [1.0; 3], [1; 3]).unwrap();
        mesh.refine_around([0.3, 0.4, 0.5], 0.3, &mut MeshChange::default()).unwrap();
        mesh.check_invariants().unwrap();
        mesh
    }

    #[test]
    fn every_kind_of_damage_is_found() {
        let mut mesh = refined();
        mesh.nodes[100].v[0] = 1_000_000;
        assert!(matches!(mesh.check_invariants(), Err(Error::Range { cell: 100, .. })));

        let mut mesh = refined();
        let last = mesh.nodes.len() - 1;
        mesh.nodes[last].v.swap(1, 2);
        assert!(matches!(mesh.check_invariants(), Err(Error::Tree { .. })));

        let mut mesh = refined();
        let (cell, facet) = mesh.boundary_facets().next().unwrap();
        mesh.links[cell.index()][facet] = 8;
        assert!(matches!(mesh.check_invariants(), Err(Error::Neighbor { .. })));

        let mut mesh = refined();
        let inner = (0..mesh.n_vertices())
            .rev()
            .map(VertexId::new)
            .find(|&v| mesh.point(v).iter().all(|x| (0.1..0.9).contains(x)));
        mesh.points[inner.unwrap().index()] = [5.0; 3];
        assert!(matches!(mesh.check_invariants(), Err(Error::Orientation { .. } | Error::Tree { .. })));

        let mut mesh = refined();
        mesh.vertex_leaf[3] = 0;
        assert!(matches!(mesh.check_invariants(), Err(Error::Vertex { vertex: 3, .. })));
    }
}
