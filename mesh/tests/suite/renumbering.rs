//! A mesh under other numbers is the same mesh.

use crate::support::{Random, marks, start_mesh};
use proptest::prelude::*;
use stylet_mesh::{CellId, MeshChange, RenumberError, SimplexMesh, VertexId, generate::kuhn_box};

fn order(n: usize, random: &mut Random) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    for i in (1..n).rev() {
        order.swap(i, random.below(i + 1));
    }
    order
}

/// Each cell by its vertices under the old numbers, with region and tags by opposite vertex.
type Cell = (Vec<u32>, u32, Vec<(u32, Option<u32>)>);

fn cells<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, old: impl Fn(VertexId) -> u32) -> Vec<Cell> {
    let sorted = |vertices: &[VertexId]| {
        let mut vertices: Vec<u32> = vertices.iter().map(|&v| old(v)).collect();
        vertices.sort_unstable();
        vertices
    };
    let of = |c: CellId| {
        let v = mesh.cell(c);
        let mut tags: Vec<_> = (0..N).map(|facet| (old(v[facet]), mesh.boundary_tag(c, facet))).collect();
        tags.sort_unstable();
        (sorted(&v), mesh.region(c), tags)
    };
    let mut cells: Vec<Cell> = mesh.cells().map(of).collect();
    cells.sort_unstable();
    cells
}

fn same_mesh<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let (mut mesh, mut random) = (start_mesh::<D, N>(kind, seed), Random::new(!seed));
    let boundary: Vec<_> = mesh.boundary_facets().collect();
    for (k, &(cell, facet)) in boundary.iter().enumerate() {
        mesh.set_boundary_tag(cell, facet, k as u32 % 4).unwrap();
    }
    let order = order(mesh.n_vertices(), &mut random);
    let mut renumbered = mesh.renumbered(&order).unwrap();
    renumbered.check_invariants().unwrap();
    for v in renumbered.vertices() {
        assert_eq!(renumbered.point(v), mesh.point(VertexId(order[v.index()])));
    }
    assert_eq!(cells(&mesh, |v| v.0), cells(&renumbered, |v| order[v.index()]));
    let named: Vec<Vec<u32>> = cells_as_numbered(&renumbered);
    assert!(named.is_sorted(), "cells come in the order of their vertices");
    // There and back.
    let mut back = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| back[old as usize] = new as u32);
    assert_eq!(cells(&renumbered.renumbered(&back).unwrap(), |v| v.0), cells(&mesh, |v| v.0));
    // What is stored is read again: its cells are those that the rule makes of these numbers.
    let stored = postcard::to_stdvec(&renumbered).unwrap();
    let read: SimplexMesh<D, N> = postcard::from_bytes(&stored).unwrap();
    assert_eq!(postcard::to_stdvec(&read).unwrap(), stored);
    // It can be bisected and coarsened as any other.
    let marked = marks(&renumbered, 5, &mut random);
    renumbered.bisect(&marked, &mut MeshChange::default()).unwrap();
    renumbered.check_invariants().unwrap();
    assert_eq!(renumbered.renumbered(&order).unwrap_err(), RenumberError::Changed);
}

fn cells_as_numbered<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Vec<Vec<u32>> {
    let sorted = |c| {
        let mut v = mesh.cell(c).map(|v| v.0).to_vec();
        v.sort_unstable();
        v
    };
    mesh.cells().map(sorted).collect()
}

/// Against all pairs of all cells.
fn graph_of_edges<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let (mut mesh, mut random) = (start_mesh::<D, N>(kind, seed), Random::new(!seed));
    let marked = marks(&mesh, 5, &mut random);
    mesh.bisect(&marked, &mut MeshChange::default()).unwrap();
    let mut expected = vec![std::collections::BTreeSet::new(); mesh.n_vertex_slots()];
    for v in mesh.cells().map(|c| mesh.cell(c)) {
        for a in 0..N {
            expected[v[a].index()].extend((0..N).filter(|&b| b != a).map(|b| v[b].0));
        }
    }
    let (offsets, neighbours) = mesh.vertex_graph();
    assert_eq!((offsets[0], offsets.len(), offsets[offsets.len() - 1]), (0, expected.len() + 1, neighbours.len()));
    for (range, expected) in offsets.windows(2).zip(expected) {
        assert!(neighbours[range[0]..range[1]].iter().copied().eq(expected));
    }
}

in_each_dimension! {
    kinds 0u8..3, 0u8..3;
    same_mesh, 48, 24, 6;
    graph_of_edges, 24, 12, 4;
}

#[test]
fn what_is_no_order_is_refused() {
    let mesh = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [1; 2]).unwrap();
    let refused = |order: &[u32]| mesh.renumbered(order).unwrap_err().to_string();
    assert_eq!(refused(&[0, 1, 2]), "found an order of 3 vertices, expected 4");
    assert_eq!(refused(&[0, 1, 4, 2]), "entry 2 of the order is 4: expected each vertex from 0 to 3 once");
    assert_eq!(refused(&[0, 1, 2, 1]), "entry 3 of the order is 1: expected each vertex from 0 to 3 once");
}
