//! Orderings against sprs and faer, and what they promise for any graph.

use crate::common::elasticity::cube;
use crate::common::graphs::{Graph, graph};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, SymmetricOrdering, factorize_symbolic_cholesky};
use proptest::prelude::*;
use stylet_solver::ordering::{
    Adjacency, Permutation, bandwidth, minimum_degree, nested_dissection, profile, reverse_cuthill_mckee,
};
use stylet_solver::sparse::BlockCsr;

fn sprs_order(graph: &impl Adjacency) -> Permutation {
    let n = graph.n_nodes();
    let (mut offsets, mut indices) = (vec![0], Vec::new());
    for i in 0..n {
        indices.extend(graph.neighbours(i).iter().map(|&j| j as usize));
        offsets.push(indices.len());
    }
    let values = vec![1.0; indices.len()];
    let matrix = sprs::CsMat::new((n, n), offsets, indices, values);
    let order = sprs::linalg::reverse_cuthill_mckee(matrix.view());
    Permutation::from_new_to_old(order.perm.vec().iter().map(|&old| old as u32).collect()).unwrap()
}

/// Entries of the scalar Cholesky factor of a matrix with this pattern of blocks, by faer's symbolic analysis.
fn fill<const B: usize>(a: &BlockCsr<B>, order: &Permutation) -> usize {
    let (starts, rows, _) = order.matrix(a).unwrap().to_scalar_csr().into_parts();
    let n = starts.len() - 1;
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows);
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
        ..Default::default()
    };
    factorize_symbolic_cholesky(pattern, faer::Side::Upper, SymmetricOrdering::Identity, params).unwrap().len_val()
}

#[test]
fn the_band_of_a_cube_is_as_narrow_as_that_of_sprs_and_scipy() {
    for (cells, scipy) in [(5, None), (13, Some(183))] {
        let a = cube(cells, 0.34).a;
        let order = reverse_cuthill_mckee(&a);
        let (own, sprs) = (bandwidth(&a, &order), bandwidth(&a, &sprs_order(&a)));
        assert!(own <= sprs, "{cells} cells: {own} above {sprs} of sprs");
        if let Some(scipy) = scipy {
            assert!(own <= scipy, "{cells} cells: {own} above {scipy} of scipy");
        }
        assert!(profile(&a, &order) < profile(&a, &Permutation::identity(a.n_rows())));
    }
}

#[test]
fn nested_dissection_leaves_less_fill_than_minimum_degree() {
    let a = cube(13, 0.34).a;
    let natural = fill(&a, &Permutation::identity(a.n_rows()));
    let amd = fill(&a, &minimum_degree(&a).unwrap());
    let dissection = fill(&a, &nested_dissection(&a).unwrap());
    println!("fill: natural {natural}, minimum degree {amd}, nested dissection {dissection}");
    assert!(amd < natural && dissection < natural);
    assert!(dissection as f64 <= 0.9 * amd as f64, "{dissection} against {amd}");
}

#[test]
fn degenerate_graphs_are_ordered() {
    let path: Vec<_> = (0..9).map(|i| (i, i + 1)).collect();
    for graph in
        [Graph::new(0, &[]), Graph::new(1, &[]), Graph::new(7, &[]), Graph::new(2, &[(0, 1)]), Graph::new(10, &path)]
    {
        let graph = graph.view();
        for order in
            [reverse_cuthill_mckee(&graph), minimum_degree(&graph).unwrap(), nested_dissection(&graph).unwrap()]
        {
            assert_eq!(order.len(), graph.n_nodes());
        }
    }
    let graph = Graph::new(10, &path);
    let order = reverse_cuthill_mckee(&graph.view());
    assert_eq!((bandwidth(&graph.view(), &order), profile(&graph.view(), &order)), (1, 9));
    // One node next to all others: METIS may not be led astray by a dense row.
    let star: Vec<_> = (1..200).map(|i| (0, i)).collect();
    assert_eq!(nested_dissection(&Graph::new(200, &star).view()).unwrap().len(), 200);
}

#[test]
fn a_pattern_that_is_not_symmetric_is_made_so() {
    // Only the lower triangle of a path, with loops.
    let lower = [0usize, 1, 3, 5, 7];
    let cols = [0u32, 0, 1, 1, 2, 2, 3];
    let lower = stylet_solver::ordering::AdjacencySlices::new(&lower, &cols).unwrap();
    let path = Graph::new(4, &[(0, 1), (1, 2), (2, 3)]);
    assert_eq!(nested_dissection(&lower).unwrap(), nested_dissection(&path.view()).unwrap());
    assert_eq!(reverse_cuthill_mckee(&lower).len(), 4);
}

#[test]
fn threads_that_order_at_once_get_the_same() {
    let a = cube(7, 0.34).a;
    let alone = nested_dissection(&a).unwrap();
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..4).map(|_| scope.spawn(|| nested_dissection(&a).unwrap())).collect();
        for order in all {
            assert_eq!(order.join().unwrap(), alone);
        }
    });
}

proptest! {
    #[test]
    fn every_order_is_a_bijection_and_the_same_twice(graph in graph()) {
        let matrix = graph.laplacian();
        let view = graph.view();
        let n = view.n_nodes();
        let rcm = reverse_cuthill_mckee(&view);
        // Loops mean nothing: the matrix has a diagonal, the graph has none.
        prop_assert_eq!(&rcm, &reverse_cuthill_mckee(&matrix));
        prop_assert_eq!(nested_dissection(&view).unwrap(), nested_dissection(&matrix).unwrap());
        prop_assert_eq!(minimum_degree(&view).unwrap(), minimum_degree(&view).unwrap());
        for order in [rcm, nested_dissection(&view).unwrap(), minimum_degree(&view).unwrap()] {
            prop_assert_eq!(Permutation::from_new_to_old(order.new_to_old().to_vec()).unwrap(), order.clone());
            prop_assert_eq!(order.len(), n);
        }
    }

    #[test]
    fn band_and_profile_are_those_of_the_renumbered_matrix(graph in graph()) {
        let matrix = graph.laplacian();
        let order = reverse_cuthill_mckee(&matrix);
        let renumbered = order.matrix(&matrix).unwrap();
        let widest = renumbered.blocks().map(|(i, j, _)| i.abs_diff(j)).max().unwrap_or(0);
        let envelope: usize = (0..renumbered.n_rows()).map(|i| i - renumbered.row(i).0[0] as usize).sum();
        prop_assert_eq!((bandwidth(&matrix, &order), profile(&matrix, &order)), (widest, envelope));
        // Breadth-first numbering of a random graph is as good as that of sprs, give or take the choice of a start.
        let sprs = bandwidth(&matrix, &sprs_order(&matrix));
        prop_assert!(widest <= sprs + sprs / 2 + 3, "{} against {} of sprs", widest, sprs);
    }
}

/// About 20 ms: run with `--release -- --ignored --nocapture`.
#[test]
#[ignore = "measures"]
fn fifty_thousand_nodes() {
    let a = cube(36, 0.34).a;
    let time = |what: &str, order: &dyn Fn() -> Permutation| {
        let start = std::time::Instant::now();
        let order = order();
        println!("{what}: {:?}, bandwidth {}", start.elapsed(), bandwidth(&a, &order));
    };
    for _ in 0..3 {
        time("reverse Cuthill-McKee", &|| reverse_cuthill_mckee(&a));
    }
    time("sprs", &|| sprs_order(&a));
    time("nested dissection", &|| nested_dissection(&a).unwrap());
    time("minimum degree", &|| minimum_degree(&a).unwrap());
}
