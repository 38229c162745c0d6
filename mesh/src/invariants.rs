//! What must hold of every mesh, checked from scratch.

use crate::{
    InvariantError as Error, Rule, SimplexMesh, geometry, longest_edge, manifold,
    node::{NONE, Node, is_interior, link, unlink},
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
        self.check_free()?;
        self.check_vertices()?;
        self.check_forest()?;
        self.check_links()?;
        self.check_orientations()?;
        self.check_measures()
    }

    /// Whether every index is in range, so that the checks that follow may use it.
    fn check_ranges(&self) -> Result<(), Error> {
        let (n_vertices, n_slots) = (self.points.len(), self.nodes.len());
        let reference = if self.reference.is_empty() { n_vertices } else { self.reference.len() };
        let vertex_arrays = [self.parents.len(), self.generations.len(), self.vertex_leaf.len(), reference];
        if vertex_arrays != [n_vertices; 4] || self.n_macros > n_slots {
            return Err(Error::Range { cell: NONE, what: "the length of an array" });
        }
        for (slot, node) in self.nodes.iter().enumerate() {
            let wrong = if node.is_free() { (slot < self.n_macros).then_some("free") } else { self.out_of_range(node) };
            if let Some(what) = wrong {
                return Err(Error::Range { cell: slot as u32, what });
            }
        }
        Ok(())
    }

    /// What of a node that is in use is out of range.
    fn out_of_range(&self, node: &Node<N>) -> Option<&'static str> {
        let inside = |index: u32| (index as usize) < self.nodes.len();
        let link_inside = |&link: &u32| {
            let (neighbor, facet) = unlink(link);
            !is_interior(link) || neighbor < self.nodes.len() && facet < N && self.nodes[neighbor].is_leaf()
        };
        // What a covered cell was linked to may be covered, too, or may have been bisected.
        let old_link_inside = |&link: &u32| {
            let (neighbor, facet) = unlink(link);
            !is_interior(link) || neighbor < self.nodes.len() && facet < N
        };
        let is_used = |v: u32| self.vertex_leaf.get(v as usize).is_some_and(|&leaf| leaf != NONE);
        let tags = if node.parent == NONE { 0..N } else { 1..N };
        let checks = [
            (node.v.iter().all(|&v| is_used(v)), "a vertex"),
            (node.parent == NONE || inside(node.parent), "the parent"),
            (!node.is_inner() || node.child() < NONE - 1 && inside(node.child() + 1), "a child"),
            (tags.contains(&node.tag()), "the tag"),
            (node.region() < self.regions.len(), "the region"),
            (!node.is_leaf() || node.links.iter().all(link_inside), "a neighbour"),
            (!node.is_covered() || node.links.iter().all(old_link_inside), "a former neighbour"),
            (node.info == node.lasting_info(), "a scratch mark"),
        ];
        checks.into_iter().find(|(holds, _)| !holds).map(|(_, what)| what)
    }

    /// Whether the lists of free slots and vertices hold every one that is free once.
    fn check_free(&self) -> Result<(), Error> {
        let mut listed = vec![false; self.nodes.len()];
        for &first in &self.free_pairs {
            for slot in [first as usize, (first as usize).saturating_add(1)] {
                if self.nodes.get(slot).is_none_or(|node| !node.is_free()) || listed[slot] {
                    return Err(Error::Range { cell: slot as u32, what: "the list of free slots" });
                }
                listed[slot] = true;
            }
        }
        for &slot in &self.overlay.free_slots {
            if self.nodes.get(slot as usize).is_none_or(|node| !node.is_free()) || listed[slot as usize] {
                return Err(Error::Range { cell: slot, what: "the list of free slots" });
            }
            listed[slot as usize] = true;
        }
        if let Some(slot) = self.nodes.iter().zip(&listed).position(|(node, listed)| node.is_free() != *listed) {
            return Err(Error::Range { cell: slot as u32, what: "the list of free slots" });
        }
        let mut listed = vec![false; self.points.len()];
        for &vertex in &self.free_vertices {
            if listed.get(vertex as usize).is_none_or(|&twice| twice) {
                return Err(Error::Vertex { vertex, what: "twice in the list of free vertices, or out of range" });
            }
            listed[vertex as usize] = true;
        }
        match self.vertex_leaf.iter().zip(&listed).position(|(&leaf, &listed)| (leaf == NONE) != listed) {
            Some(vertex) => Err(Error::Vertex { vertex: vertex as u32, what: "free but not listed, or the reverse" }),
            None => Ok(()),
        }
    }

    fn check_vertices(&self) -> Result<(), Error> {
        for vertex in self.vertices() {
            let v = vertex.index();
            let wrong = |what| Err(Error::Vertex { vertex: vertex.0, what });
            let [a, b] = self.parents[v].map(|p| p as usize);
            if self.generations[v] == 0 {
                if (a, b) != (v, v) {
                    return wrong("of generation 0 with parents");
                }
            } else if [a, b].iter().any(|&p| self.vertex_leaf.get(p).is_none_or(|&leaf| leaf == NONE)) {
                return wrong("a parent does not exist");
            } else if self.generations[v] <= self.generations[a].max(self.generations[b]) {
                return wrong("a parent is not of an older generation");
            }
            let leaf = self.nodes.get(self.vertex_leaf[v] as usize);
            if leaf.is_none_or(|node| !node.is_leaf() || !node.v.contains(&vertex.0)) {
                return wrong("its stored cell is not a live cell around it");
            }
        }
        Ok(())
    }

    /// Makes the children of every bisected node anew and compares.
    fn check_forest(&self) -> Result<(), Error> {
        let wrong = |cell: usize, what| Err(Error::Tree { cell: cell as u32, what });
        for (slot, node) in self.nodes.iter().enumerate().filter(|(_, node)| !node.is_free()) {
            let is_root = slot < self.n_macros || node.tag() == 0;
            if (node.parent == NONE) != is_root {
                return wrong(slot, "a start cell has a parent, or another none");
            }
            if !is_root && !self.nodes[node.parent as usize].child_slots().contains(&(slot as u32)) {
                return wrong(slot, "its parent does not know it");
            }
            if node.is_inner() {
                self.check_children(slot, node)?;
            }
        }
        let used = |node: &&Node<N>| node.is_leaf();
        if self.nodes.iter().filter(used).count() != self.n_live {
            return wrong(self.n_macros, "the number of live cells");
        }
        Ok(())
    }

    fn check_children(&self, slot: usize, node: &Node<N>) -> Result<(), Error> {
        let child = node.child() as usize;
        let wrong = |cell: usize, what| Err(Error::Tree { cell: cell as u32, what });
        if node.tag() == 0 {
            return wrong(slot, "bisected, though it is of an overlay");
        }
        // The midpoint is the one vertex that the parent lacks.
        let midpoint = self.nodes[child].v.into_iter().find(|v| !node.v.contains(v)).unwrap_or(NONE);
        let mut ends = self.parents.get(midpoint as usize).copied().unwrap_or([NONE; 2]);
        ends.sort_unstable();
        if ends != node.edge() {
            return wrong(child, "its newest vertex does not halve the refinement edge");
        }
        if node.v.iter().any(|&v| self.generations[v as usize] >= self.generations[midpoint as usize]) {
            return wrong(child, "its newest vertex is not of a younger generation");
        }
        for (second, mut made) in node.children(slot as u32, child as u32, midpoint).into_iter().enumerate() {
            if self.rule == Rule::LongestEdge {
                longest_edge::arrange(self.reference_points(), &mut made);
            }
            let found = &self.nodes[child + second];
            if (made.v, made.parent, made.tree_info()) != (found.v, found.parent, found.tree_info()) {
                return wrong(child + second, "vertices, tag, level, region or orientation");
            }
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
        for (slot, (node, expected)) in self.nodes.iter().zip(&expected).enumerate().filter(|(_, (n, _))| n.is_leaf()) {
            let agrees = |facet: usize| match expected[facet] {
                NONE => !is_interior(node.links[facet]),
                expected => node.links[facet] == expected,
            };
            if let Some(facet) = (0..N).find(|&facet| !agrees(facet)) {
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
    ///
    /// Cells that the remesher covered count as leaves here; that the overlay fills their place is looked at where they
    /// really are.
    fn check_measures(&self) -> Result<(), Error> {
        let macros = || self.nodes[..self.n_macros].iter().enumerate().map(|(slot, node)| (slot as u32, node.v));
        let in_forest = |node: &Node<N>| (node.is_leaf() || node.is_covered()) && !node.is_overlay();
        let forest = || {
            let nodes = self.nodes.iter().enumerate().filter(move |(_, node)| in_forest(node));
            nodes.map(|(slot, node)| (slot as u32, node.v))
        };
        let volume = |v: [u32; N]| geometry::signed_measure(&self.reference_corners(&v)).abs();
        let total = |cells: &mut dyn Iterator<Item = (u32, [u32; N])>| cells.map(|(_, v)| volume(v)).sum();
        compare("volume", total(&mut macros()), total(&mut forest()), VOLUME)?;
        compare("boundary", self.boundary(macros()), self.boundary(forest()), BOUNDARY)?;
        if !self.overlay.is_active() || N < D + 1 {
            return Ok(());
        }
        let signed = |node: &Node<N>| {
            let volume = geometry::signed_measure(&self.corners_of(&node.v));
            if node.is_negative() { -volume } else { volume }
        };
        let of = |is: &dyn Fn(&Node<N>) -> bool| self.nodes.iter().filter(|node| is(node)).map(signed).sum::<f64>();
        compare("volume of what the overlay covers", of(&in_forest), of(&|node| node.is_leaf()), VOLUME)
    }

    /// The measure of the facets that belong to one cell only, of some cells.
    fn boundary(&self, cells: impl Iterator<Item = (u32, [u32; N])> + Clone) -> f64 {
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

    fn leaves(&self) -> impl Iterator<Item = (u32, [u32; N])> + Clone + '_ {
        self.cells().map(|c| (c.0, self.nodes[c.index()].v))
    }
}

fn compare(what: &'static str, expected: f64, found: f64, tolerance: f64) -> Result<(), Error> {
    let agrees = (expected - found).abs() <= tolerance * expected;
    if agrees { Ok(()) } else { Err(Error::Measure { what, expected, found }) }
}

#[cfg(test)]
mod tests {
    use crate::{InvariantError as Error, MeshChange, SimplexMesh, VertexId, generate::kuhn_box, node::link};

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
        let some = mesh.cells().next().unwrap();
        mesh.nodes[cell.index()].links[facet] = link(some.0, 0);
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
