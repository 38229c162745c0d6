//! Partitions: their quality on a cube, and what they promise for any graph.

use crate::common::elasticity::cube;
use crate::common::graphs::{Graph, graph};
use proptest::prelude::*;
use stylet_solver::ordering::Adjacency;
use stylet_solver::partition::{Partition, PartitionError, PartsError, partition};

#[test]
fn a_cube_is_cut_across() {
    let a = cube(13, 0.34).a;
    let edges = (a.n_blocks() - a.n_rows()) / 2;
    for (k, limit) in [(2, 0.05), (4, 0.12), (8, 0.2)] {
        let parts = partition(&a, k).unwrap();
        let cut = parts.edge_cut(&a) as f64 / edges as f64;
        assert!(cut < limit, "{k} parts cut {cut} of the edges");
        assert!(parts.imbalance() < 1.05, "{k} parts: {}", parts.imbalance());
        assert_eq!(parts.sizes().iter().sum::<usize>(), a.n_rows());
        assert_eq!(parts, partition(&a, k).unwrap());
        assert!(!parts.drift(&a).is_due(1.2, 1.5));
    }
}

#[test]
fn degenerate_graphs_are_partitioned() {
    let none = Graph::new(0, &[]);
    assert_eq!(partition(&none.view(), 0).unwrap().n_parts(), 0);
    let parts = partition(&none.view(), 3).unwrap();
    assert_eq!((parts.sizes(), parts.imbalance()), (&[0, 0, 0][..], 1.0));
    let isolated = Graph::new(7, &[]);
    let parts = partition(&isolated.view(), 3).unwrap();
    assert_eq!((parts.sizes(), parts.edge_cut(&isolated.view())), (&[3, 2, 2][..], 0));
    let triangle = Graph::new(3, &[(0, 1), (1, 2), (2, 0)]);
    assert_eq!(partition(&triangle.view(), 1).unwrap().parts(), [0, 0, 0]);
    let parts = partition(&triangle.view(), 5).unwrap();
    assert_eq!(
        (parts.parts(), parts.sizes(), parts.edge_cut(&triangle.view())),
        (&[0, 1, 2][..], &[1, 1, 1, 0, 0][..], 3)
    );
    assert_eq!(partition(&triangle.view(), 0), Err(PartitionError::NoParts { nodes: 3 }));
    let many = i32::MAX as usize + 1;
    assert_eq!(partition(&triangle.view(), many), Err(PartitionError::TooManyParts(many)));
}

#[test]
fn parts_are_checked() {
    let path = Graph::new(3, &[(0, 1), (1, 2)]);
    let new = |parts: &[u32]| Partition::new(&path.view(), parts.to_vec(), 2);
    assert_eq!(new(&[0, 1]), Err(PartsError::Shape { parts: 2, nodes: 3 }));
    assert_eq!(new(&[0, 1, 2]), Err(PartsError::NoSuchPart { node: 2, part: 2, n_parts: 2 }));
    let mut parts = new(&[0, 0, 1]).unwrap();
    assert_eq!(parts.follow(&path.view(), &[3]), Err(PartsError::NodeOutOfRange { node: 3, n_nodes: 3 }));
    assert_eq!(parts, new(&[0, 0, 1]).unwrap());
}

#[test]
fn new_nodes_join_their_neighbours_and_drift_grows() {
    // A path in two halves grows at its right end: all new nodes land in the right part.
    let path = |n: usize| Graph::new(n, &(1..n).map(|i| (i - 1, i)).collect::<Vec<_>>());
    let mut parts = Partition::new(&path(10).view(), (0..10).map(|i| u32::from(i >= 5)).collect(), 2).unwrap();
    parts.follow(&path(30).view(), &[]).unwrap();
    assert_eq!(parts.sizes(), [5, 25]);
    let drift = parts.drift(&path(30).view());
    assert_eq!((drift.imbalance, drift.cut), (25.0 / 15.0, 1.0 / 29.0));
    assert!(drift.is_due(1.2, 1.5) && !drift.is_due(2.0, 1.5));
    // It shrinks again, and node 0 dies and is born as a neighbour of 9 and 8.
    parts.follow(&path(10).view(), &[]).unwrap();
    assert_eq!(parts.sizes(), [5, 5]);
    let moved = Graph::new(10, &[(1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (6, 7), (7, 8), (8, 9), (0, 8), (0, 9)]);
    parts.follow(&moved.view(), &[0, 0]).unwrap();
    assert_eq!((parts.parts()[0], parts.sizes()), (1, &[4, 6][..]));
    // Nodes without neighbours go where there is most room; the first nodes of all found the first part.
    parts.follow(&Graph::new(12, &[]).view(), &[]).unwrap();
    assert_eq!(parts.sizes(), [6, 6]);
    let mut parts = Partition::default();
    parts.follow(&path(4).view(), &[]).unwrap();
    assert_eq!(parts.sizes(), [4]);
}

#[test]
fn a_cut_that_grows_is_seen() {
    let a = cube(5, 0.34).a;
    let fresh = partition(&a, 2).unwrap();
    let mut parts = fresh.parts().to_vec();
    parts.iter_mut().step_by(7).for_each(|part| *part = 1 - *part);
    let torn = Partition::new(&a, parts, 2).unwrap();
    let drift = stylet_solver::partition::Drift { first_cut: fresh.drift(&a).first_cut, ..torn.drift(&a) };
    assert!(drift.is_due(1.2, 1.5));
}

proptest! {
    #[test]
    fn every_node_has_a_part_and_the_cut_is_counted_right(graph in graph(), k in 1usize..9) {
        let view = graph.view();
        let parts = partition(&view, k).unwrap();
        prop_assert_eq!((parts.parts().len(), parts.n_parts()), (view.n_nodes(), k));
        for part in 0..k {
            let size = parts.parts().iter().filter(|&&p| p as usize == part).count();
            prop_assert_eq!(parts.sizes()[part], size);
        }
        let cut = graph.edges().into_iter().filter(|&(i, j)| parts.parts()[i] != parts.parts()[j]).count();
        prop_assert_eq!(parts.edge_cut(&view), cut);
        prop_assert_eq!(parts.edge_cut(&graph.laplacian()), cut);
        prop_assert_eq!(&partition(&view, k).unwrap(), &parts);
    }

    #[test]
    fn following_keeps_what_has_not_changed(old in graph(), new in graph(), k in 1usize..5, born in proptest::collection::vec(0usize..60, 0..9)) {
        let mut parts = partition(&old.view(), k).unwrap();
        let before = parts.parts().to_vec();
        let n = new.view().n_nodes();
        let born: Vec<usize> = born.into_iter().filter(|&node| node < n).collect();
        parts.follow(&new.view(), &born).unwrap();
        prop_assert_eq!(parts.parts().len(), n);
        let recounted = Partition::new(&new.view(), parts.parts().to_vec(), k).unwrap();
        prop_assert_eq!(recounted.sizes(), parts.sizes());
        for node in (0..n.min(before.len())).filter(|node| !born.contains(node)) {
            prop_assert_eq!(parts.parts()[node], before[node]);
        }
    }
}
